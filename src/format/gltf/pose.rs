//! The mesh at one time: tracks move nodes and weights, morph targets displace, joints carry.

use gltf::animation::Property;
use nalgebra::Matrix4;

use super::animation::Track;
use super::gather::{Gathered, Joints, Patch};
use super::hierarchy::{Hierarchy, Local};

/// Writes the 3V coordinates at time `t` (seconds).
pub(super) fn pose(
    gathered: &Gathered,
    hierarchy: &Hierarchy,
    tracks: &[Track],
    t: f64,
    positions: &mut [f32],
) {
    let mut locals = hierarchy.rest.clone();
    let mut weights = hierarchy.weights.clone();
    for track in tracks {
        let mut value = vec![0.0; track.width];
        track.at(t, &mut value);
        apply(
            track,
            value,
            &mut locals[track.node],
            &mut weights[track.node],
        );
    }
    let globals = hierarchy.globals(&locals);
    let skins: Vec<Vec<Rows>> = gathered
        .skins
        .iter()
        .map(|Joints(joints)| {
            let carried = joints
                .iter()
                .map(|(node, bind)| rows(&(globals[*node] * bind)));
            carried.collect()
        })
        .collect();
    let mut start = 0;
    for patch in &gathered.patches {
        let end = start + 3 * patch.positions.len();
        let place = rows(&globals[patch.node]);
        let joints = patch.skin.map(|skin| skins[skin].as_slice());
        let target = &mut positions[start..end];
        pose_patch(patch, &weights[patch.node], &place, joints, target);
        start = end;
    }
}

fn apply(track: &Track, value: Vec<f64>, local: &mut Local, weights: &mut Vec<f64>) {
    match (track.property, local) {
        (Property::MorphTargetWeights, _) => *weights = value,
        (Property::Translation, Local::Parts(part, ..))
        | (Property::Scale, Local::Parts(.., part)) => part.copy_from_slice(&value),
        (Property::Rotation, Local::Parts(_, part, _)) => part.copy_from_slice(&value),
        (_, Local::Matrix(_)) => {}
    }
}

/// The upper three rows of a matrix.
type Rows = [[f64; 4]; 3];

fn rows(matrix: &Matrix4<f64>) -> Rows {
    std::array::from_fn(|row| std::array::from_fn(|column| matrix[(row, column)]))
}

fn transformed(rows: &Rows, p: [f64; 3]) -> [f64; 3] {
    rows.map(|row| row[0] * p[0] + row[1] * p[1] + row[2] * p[2] + row[3])
}

fn pose_patch(
    patch: &Patch,
    weights: &[f64],
    place: &Rows,
    joints: Option<&[Rows]>,
    positions: &mut [f32],
) {
    let targets = patch.targets.iter().zip(weights);
    let active: Vec<_> = targets.filter(|(_, weight)| **weight != 0.0).collect();
    for (vertex, output) in positions.chunks_exact_mut(3).enumerate() {
        let mut p = patch.positions[vertex].map(f64::from);
        for (target, weight) in &active {
            let moved = target.get(vertex).copied().unwrap_or_default();
            for axis in 0..3 {
                p[axis] += **weight * f64::from(moved[axis]);
            }
        }
        let p = match joints {
            None => transformed(place, p),
            Some(joints) => {
                let mut sum = [0.0; 3];
                for &(joint, weight) in &patch.influences[vertex] {
                    let carried = transformed(&joints[joint as usize], p);
                    for axis in 0..3 {
                        sum[axis] += f64::from(weight) * carried[axis];
                    }
                }
                sum
            }
        };
        for (output, value) in output.iter_mut().zip(p) {
            *output = value as f32;
        }
    }
}
