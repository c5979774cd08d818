//! The rabbit at rest: sitting on y = 0, 1 m from feet to ears, facing +x.

use nalgebra::Vector3;

use crate::demo::implicit::{Blob, Field, Flesh, Part, carve};
use crate::demo::surface_nets::Grid;

/// Where it is lifted by: the middle of the back.
pub(super) const SCRUFF: [f64; 3] = [0.02, 0.62, 0.0];
/// Radius around it that the hand holds.
pub(super) const HANDFUL: f64 = 0.13;
/// Side of the cubes that the skin is found with, in metres.
const STEP: f64 = 0.03;

/// The body above the floor.
pub(super) struct Rabbit(Flesh);

impl Field for Rabbit {
    fn at(&self, point: Vector3<f64>) -> (f64, Vector3<f64>) {
        carve(self.0.at(point), (point.y, Vector3::y()), 0.02)
    }
}

impl Rabbit {
    /// Body, head, cheeks, tail; haunches, feet, paws and ears on both sides.
    pub(super) fn new() -> Self {
        let mut parts = vec![
            part(&[
                [-0.17, 0.26, 0.0, 0.25],
                [-0.02, 0.34, 0.0, 0.24],
                [0.14, 0.44, 0.0, 0.165],
            ]),
            part(&[[0.22, 0.64, 0.0, 0.155], [0.31, 0.60, 0.0, 0.115]]),
            part(&[[-0.44, 0.24, 0.0, 0.09]; 2]),
        ];
        for side in [-1.0, 1.0] {
            let rows: [&[[f64; 4]]; 4] = [
                &[[-0.16, 0.20, 0.18, 0.17], [-0.08, 0.14, 0.20, 0.13]],
                &[[-0.10, 0.045, 0.20, 0.07], [0.13, 0.04, 0.21, 0.06]],
                &[
                    [0.18, 0.32, 0.10, 0.08],
                    [0.24, 0.12, 0.10, 0.06],
                    [0.27, 0.03, 0.10, 0.058],
                ],
                &[
                    [0.16, 0.75, 0.06, 0.05],
                    [0.10, 0.90, 0.10, 0.06],
                    [0.05, 1.02, 0.13, 0.035],
                ],
            ];
            let mirrored = |row: &[[f64; 4]]| {
                let points: Vec<_> = row
                    .iter()
                    .map(|&[x, y, z, r]| [x, y, side * z, r])
                    .collect();
                part(&points)
            };
            parts.extend(rows.map(mirrored));
        }
        Rabbit(Flesh { parts, blend: 0.03 })
    }
}

/// A row of blobs through points (x, y, z, radius).
fn part(points: &[[f64; 4]]) -> Part {
    let blob = |pair: &[[f64; 4]]| Blob {
        bone: 0,
        ends: [0, 1].map(|i| Vector3::new(pair[i][0], pair[i][1], pair[i][2])),
        radii: [pair[0][3], pair[1][3]],
        width: 1.0,
    };
    Part::new(points.windows(2).map(blob).collect())
}

/// The grid that it is found on.
pub(super) fn grid() -> Grid {
    Grid::uniform([-0.6, -0.1, -0.4], [0.5, 1.1, 0.4], STEP)
}
