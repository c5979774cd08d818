//! A saguaro bent to the left, to the front and to the right: three poses in which a straight blend
//! between neighbours passes through shapes that no cactus has (as Fig. 1 of Xia et al. 2019).

use std::f64::consts::PI;
use std::sync::Arc;

use nalgebra::Vector3;

use crate::mesh::{Sequence, Topology};
use crate::task::{Cancelled, Task};

use super::bend::bent;
use super::implicit::{Blob, Field, Flesh, Part, carve};
use super::surface_nets::{Grid, polygonise};

/// Side of the cubes that the skin is found with, in metres.
const STEP: f64 = 0.0335;
const HEIGHT: f64 = 2.0;
/// Angle between root and tip.
const BEND: f64 = 80.0 / 180.0 * PI;
const RIBS: f64 = 9.0;
/// Depth of the furrows between ribs, times the radius.
const FURROW: f64 = 0.09;

/// The three poses.
pub(super) fn generate(task: &Task) -> Result<Sequence, Cancelled> {
    let body = Body {
        flesh: Flesh {
            parts: limbs(),
            blend: 0.03,
        },
    };
    let grid = Grid::uniform([-0.9, -0.1, -0.4], [0.9, HEIGHT + 0.1, 0.4], STEP);
    let mut mesh = polygonise(&body, &grid, task)?;
    mesh.relax(&body, 6, task)?;
    let rest: Vec<Vector3<f64>> = mesh
        .points
        .iter()
        .map(|&point| body.ribbed(point))
        .collect();
    let directions = [[-1.0, 0.0], [0.0, 1.0], [1.0, 0.0]];
    let poses = directions
        .into_iter()
        .flat_map(|towards| pose(&rest, towards));
    let topology = Topology::from_triangles(rest.len(), &mesh.triangles());
    let topology = topology.expect("faces name their own points");
    Ok(Sequence::new(Arc::new(topology), poses.collect(), None))
}

/// Trunk and two arms, in the plane z = 0.
fn limbs() -> Vec<Part> {
    let limb = |points: &[[f64; 3]]| {
        let blob = |pair: &[[f64; 3]]| Blob {
            bone: 0,
            ends: [0, 1].map(|i| Vector3::new(pair[i][0], pair[i][1], 0.0)),
            radii: [pair[0][2], pair[1][2]],
            width: 1.0,
        };
        Part::new(points.windows(2).map(blob).collect())
    };
    vec![
        limb(&[[0.0, -0.1, 0.20], [0.0, 1.0, 0.23], [0.0, 1.78, 0.19]]),
        limb(&[
            [-0.1, 0.78, 0.12],
            [-0.36, 0.81, 0.13],
            [-0.50, 0.89, 0.135],
            [-0.58, 1.03, 0.135],
            [-0.60, 1.45, 0.125],
        ]),
        limb(&[
            [0.1, 1.08, 0.10],
            [0.33, 1.10, 0.11],
            [0.44, 1.16, 0.115],
            [0.51, 1.28, 0.115],
            [0.53, 1.58, 0.105],
        ]),
    ]
}

/// Limbs above the ground.
struct Body {
    flesh: Flesh,
}

impl Field for Body {
    fn at(&self, point: Vector3<f64>) -> (f64, Vector3<f64>) {
        carve(self.flesh.at(point), (point.y, Vector3::y()), 0.02)
    }
}

impl Body {
    /// A point of the smooth skin pushed in where a furrow is. Ribs run along the axis of the nearest
    /// limb; they fade where two limbs meet and towards the ends.
    fn ribbed(&self, point: Vector3<f64>) -> Vector3<f64> {
        let mut blobs: Vec<(f64, &Blob)> = self
            .flesh
            .blobs()
            .map(|blob| (blob.distance(point).0, blob))
            .collect();
        blobs.sort_by(|a, b| a.0.total_cmp(&b.0));
        let blob = blobs[0].1;
        let axis = (blob.ends[1] - blob.ends[0]).normalize();
        let offset = point - blob.ends[0];
        let out = offset - axis * offset.dot(&axis);
        let inward = self.at(point).1.normalize();
        let side = libm::atan2(out.z, out.dot(&axis.cross(&Vector3::z())));
        // at the tips the skin faces along the axis
        let fade = 1.0 - inward.dot(&axis) * inward.dot(&axis);
        let depth = FURROW * blob.radii[0] * (0.5 - 0.5 * libm::cos(RIBS * side));
        point - inward * (depth * fade * fade)
    }
}

/// The 3V coordinates bent about the root towards a direction of the ground (x, z).
fn pose(rest: &[Vector3<f64>], [x, z]: [f64; 2]) -> Vec<f32> {
    let place = |p: &Vector3<f64>| {
        let [up, towards, side] = bent(
            [p.y, p.x * x + p.z * z, p.z * x - p.x * z],
            BEND / HEIGHT,
            0.0,
        );
        [towards * x - side * z, up, towards * z + side * x].map(|value| value as f32)
    };
    rest.iter().flat_map(place).collect()
}
