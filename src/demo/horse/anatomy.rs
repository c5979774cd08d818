//! The horse at rest: 1.6 m at the withers, facing +x, its right side towards +z, hooves on y = 0.
//!
//! Proportions after the usual ones of artists' anatomy (Ellenberger, Baum & Dittrich 1901): as long
//! as high, the head 2/5 of the height, the chest half of it deep, the legs a little more than half
//! below it; carpus and hock at 0.3 and 0.37 of the height.

use nalgebra::Vector3;

use crate::demo::implicit::{Blob, Part};

use super::Build;

pub(super) const PELVIS: usize = 0;
pub(super) const LOIN: usize = 1;
pub(super) const THORAX: usize = 2;
/// Four vertebrae groups, base to poll.
pub(super) const NECK: [usize; 4] = [3, 4, 5, 6];
pub(super) const HEAD: usize = 7;
pub(super) const TAIL: [usize; 6] = [8, 9, 10, 11, 12, 13];
/// Left and right: five bones each, hip to hoof.
pub(super) const HIND: [[usize; 5]; 2] = [[14, 15, 16, 17, 18], [19, 20, 21, 22, 23]];
/// Left and right: six bones each, shoulder blade to hoof.
pub(super) const FORE: [[usize; 6]; 2] = [[24, 25, 26, 27, 28, 29], [30, 31, 32, 33, 34, 35]];
/// The last bone of each leg.
pub(super) const HOOVES: [usize; 4] = [18, 23, 29, 35];
pub(super) const EARS: [usize; 2] = [36, 37];
pub(super) const BONES: usize = 38;

/// Joints in the plane of a hind leg: hip, stifle, hock, fetlock, coffin joint, toe.
pub(super) const HIND_JOINTS: [[f64; 2]; 6] = [
    [-0.60, 1.17],
    [-0.45, 0.93],
    [-0.73, 0.60],
    [-0.72, 0.235],
    [-0.655, 0.09],
    [-0.58, 0.0],
];
/// The same of a foreleg: top of the shoulder blade, shoulder, elbow, carpus, fetlock, coffin joint, toe.
pub(super) const FORE_JOINTS: [[f64; 2]; 7] = [
    [0.33, 1.43],
    [0.62, 1.08],
    [0.45, 0.90],
    [0.47, 0.505],
    [0.47, 0.225],
    [0.53, 0.085],
    [0.605, 0.0],
];
/// How far the joints of a leg are from the middle plane.
pub(super) const HIND_WIDTH: [f64; 6] = [0.14, 0.17, 0.135, 0.13, 0.13, 0.13];
pub(super) const FORE_WIDTH: [f64; 7] = [0.09, 0.17, 0.15, 0.125, 0.12, 0.12, 0.12];
/// Joints of neck and head: base, three between, poll, muzzle.
pub(super) const NECK_JOINTS: [[f64; 2]; 6] = [
    [0.50, 1.27],
    [0.65, 1.41],
    [0.79, 1.56],
    [0.90, 1.72],
    [0.99, 1.87],
    [1.36, 1.45],
];
/// Joints of the tail, dock to tip.
pub(super) const TAIL_JOINTS: [[f64; 2]; 7] = [
    [-0.76, 1.36],
    [-0.89, 1.36],
    [-1.01, 1.29],
    [-1.10, 1.17],
    [-1.16, 1.02],
    [-1.19, 0.86],
    [-1.19, 0.67],
];
/// The joint of the back that bends in a gallop.
pub(super) const LUMBOSACRAL: [f64; 2] = [-0.42, 1.40];
/// Where the loin joins the ribs.
pub(super) const LUMBAR: [f64; 2] = [-0.15, 1.38];

/// Where the flesh is.
pub(super) fn flesh(build: Build) -> Vec<Part> {
    let mut parts = vec![];
    parts.extend(trunk());
    parts.extend(neck_and_head());
    parts.push(tail());
    parts.extend(
        hind_leg()
            .into_iter()
            .flat_map(|part| both(&part, &HIND[1], &HIND[0])),
    );
    parts.extend(
        fore_leg()
            .into_iter()
            .flat_map(|part| both(&part, &FORE[1], &FORE[0])),
    );
    parts.extend(both(&ear(), &EARS[1..], &EARS[..1]));
    let grown = |part: Vec<Blob>| part.iter().map(|blob| grown(blob, build)).collect();
    parts.into_iter().map(grown).map(Part::new).collect()
}

/// A blob of the riding horse as that build has it: heavy limbs, a barrel of a trunk, feathered hooves.
fn grown(blob: &Blob, build: Build) -> Blob {
    let factor = match (build, blob.bone) {
        (Build::Light, _) => 1.0,
        (Build::Heavy, PELVIS | LOIN | THORAX) => 1.10,
        (Build::Heavy, bone) if HIND.iter().flatten().any(|&part| part == bone) => 1.45,
        (Build::Heavy, bone) if FORE.iter().flatten().any(|&part| part == bone) => 1.45,
        (Build::Heavy, _) => 1.2,
    };
    Blob {
        radii: blob.radii.map(|radius| factor * radius),
        ..*blob
    }
}

/// A row of blobs on the right, whose bones count within the limb, as the same on both sides.
fn both(right: &[Blob], right_bones: &[usize], left_bones: &[usize]) -> [Vec<Blob>; 2] {
    let left = right
        .iter()
        .map(|blob| blob.mirrored(left_bones[blob.bone]))
        .collect();
    let right = right
        .iter()
        .map(|blob| Blob {
            bone: right_bones[blob.bone],
            ..*blob
        })
        .collect();
    [left, right]
}

/// A row of blobs through points (x, y, z, radius), each moved by its bone.
fn row(width: f64, points: &[[f64; 4]], bones: &[usize]) -> Vec<Blob> {
    let blob = |(pair, &bone): (&[[f64; 4]], &usize)| {
        let ends = [0, 1].map(|i| Vector3::new(pair[i][0], pair[i][1], pair[i][2]));
        Blob {
            bone,
            ends,
            radii: [pair[0][3], pair[1][3]],
            width,
        }
    };
    points.windows(2).zip(bones).map(blob).collect()
}

/// A row in the middle plane, through points (x, y, radius).
fn middle(width: f64, points: &[[f64; 3]], bones: &[usize]) -> Vec<Blob> {
    let points: Vec<_> = points
        .iter()
        .map(|&[x, y, radius]| [x, y, 0.0, radius])
        .collect();
    row(width, &points, bones)
}

fn trunk() -> Vec<Vec<Blob>> {
    vec![
        // chest, belly, flank
        middle(
            0.80,
            &[
                [0.42, 1.17, 0.265],
                [0.24, 1.14, 0.305],
                [0.02, 1.145, 0.305],
                [-0.20, 1.18, 0.275],
                [-0.42, 1.24, 0.225],
            ],
            &[THORAX, THORAX, THORAX, LOIN],
        ),
        // croup and buttocks
        middle(
            0.98,
            &[
                [-0.40, 1.27, 0.20],
                [-0.58, 1.275, 0.225],
                [-0.74, 1.22, 0.165],
            ],
            &[PELVIS; 2],
        ),
        // withers and back
        middle(
            0.5,
            &[[0.50, 1.38, 0.13], [0.34, 1.435, 0.11], [0.10, 1.38, 0.10]],
            &[THORAX; 2],
        ),
        // breast
        middle(1.0, &[[0.58, 1.14, 0.15], [0.46, 1.02, 0.18]], &[THORAX]),
    ]
}

fn neck_and_head() -> Vec<Vec<Blob>> {
    vec![
        // neck
        middle(
            0.50,
            &[
                [0.46, 1.25, 0.24],
                [0.64, 1.40, 0.200],
                [0.78, 1.555, 0.160],
                [0.89, 1.71, 0.122],
                [0.965, 1.825, 0.092],
            ],
            &NECK,
        ),
        // crest and mane
        middle(
            0.50,
            &[
                [0.42, 1.49, 0.05],
                [0.56, 1.60, 0.070],
                [0.675, 1.73, 0.078],
                [0.785, 1.86, 0.072],
                [0.90, 1.945, 0.054],
                [1.01, 1.955, 0.036],
            ],
            &[NECK[0], NECK[1], NECK[2], NECK[3], HEAD],
        ),
        // skull, nose, muzzle
        middle(
            0.72,
            &[
                [1.015, 1.860, 0.085],
                [1.10, 1.780, 0.098],
                [1.21, 1.645, 0.078],
                [1.315, 1.515, 0.062],
                [1.365, 1.450, 0.068],
            ],
            &[HEAD; 4],
        ),
        // cheek and jaw
        middle(
            0.68,
            &[
                [1.045, 1.735, 0.110],
                [1.085, 1.675, 0.108],
                [1.19, 1.56, 0.062],
                [1.305, 1.425, 0.044],
            ],
            &[HEAD; 3],
        ),
    ]
}

fn tail() -> Vec<Blob> {
    let radii = [0.085, 0.056, 0.062, 0.080, 0.088, 0.072, 0.025];
    let points: [[f64; 3]; 7] =
        std::array::from_fn(|i| [TAIL_JOINTS[i][0], TAIL_JOINTS[i][1], radii[i]]);
    middle(0.7, &points, &TAIL)
}

fn hind_leg() -> Vec<Vec<Blob>> {
    let at = |i: usize, dx: f64, dy: f64, radius: f64| {
        let [x, y] = HIND_JOINTS[i];
        [x + dx, y + dy, HIND_WIDTH[i], radius]
    };
    vec![
        // thigh: before the bone, behind it
        row(
            0.60,
            &[
                at(0, 0.04, 0.06, 0.16),
                at(1, -0.05, 0.05, 0.130),
                at(1, -0.075, -0.06, 0.10),
            ],
            &[0, 1],
        ),
        row(
            0.66,
            &[
                at(0, -0.12, 0.02, 0.13),
                at(1, -0.20, 0.02, 0.10),
                at(1, -0.16, -0.11, 0.06),
            ],
            &[0, 1],
        ),
        // gaskin, hock, cannon, fetlock
        row(
            0.74,
            &[
                at(1, -0.09, -0.07, 0.100),
                at(1, -0.165, -0.18, 0.076),
                at(2, 0.045, 0.075, 0.050),
                at(2, 0.012, 0.0, 0.053),
                at(2, 0.008, -0.09, 0.041),
            ],
            &[1, 1, 1, 2],
        ),
        row(
            0.85,
            &[
                at(2, 0.008, -0.07, 0.040),
                at(3, 0.0, 0.07, 0.034),
                at(3, -0.006, 0.0, 0.044),
                at(4, 0.004, 0.015, 0.036),
            ],
            &[2, 2, 3],
        ),
        // the tendon and the point of the hock
        row(
            0.6,
            &[
                at(1, -0.21, -0.11, 0.035),
                at(2, -0.06, 0.075, 0.026),
                at(2, -0.03, -0.03, 0.03),
            ],
            &[1, 2],
        ),
        // hoof
        row(
            1.0,
            &[at(4, -0.01, 0.0, 0.044), [-0.635, 0.02, 0.13, 0.066]],
            &[4],
        ),
    ]
}

fn fore_leg() -> Vec<Vec<Blob>> {
    let at = |i: usize, dx: f64, dy: f64, radius: f64| {
        let [x, y] = FORE_JOINTS[i];
        [x + dx, y + dy, FORE_WIDTH[i], radius]
    };
    vec![
        // shoulder and upper arm
        row(
            0.55,
            &[
                at(0, 0.05, -0.08, 0.09),
                at(1, -0.05, 0.02, 0.125),
                at(2, 0.02, 0.02, 0.11),
            ],
            &[0, 1],
        ),
        row(
            0.55,
            &[at(2, -0.11, 0.17, 0.10), at(2, -0.035, 0.02, 0.085)],
            &[1],
        ),
        // forearm, carpus, cannon, fetlock
        row(
            0.76,
            &[
                at(2, 0.025, 0.0, 0.104),
                at(2, 0.025, -0.13, 0.088),
                at(3, 0.003, 0.11, 0.052),
                at(3, 0.006, 0.0, 0.050),
                at(3, 0.002, -0.08, 0.037),
            ],
            &[2, 2, 2, 3],
        ),
        row(
            0.85,
            &[
                at(3, 0.002, -0.06, 0.038),
                at(4, 0.0, 0.07, 0.034),
                at(4, -0.006, 0.0, 0.044),
                at(5, 0.004, 0.015, 0.036),
            ],
            &[3, 3, 4],
        ),
        // hoof
        row(
            1.0,
            &[at(5, -0.01, 0.0, 0.045), [0.552, 0.02, 0.12, 0.068]],
            &[5],
        ),
    ]
}

fn ear() -> Vec<Blob> {
    row(
        0.75,
        &[
            [0.995, 1.90, 0.045, 0.034],
            [1.01, 1.975, 0.053, 0.038],
            [1.04, 2.075, 0.060, 0.012],
        ],
        &[0, 0],
    )
}
