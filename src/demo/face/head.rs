//! The head at rest, facing +x with its right side towards +z. Lengths in decimetres.

use nalgebra::Vector3;

use crate::demo::implicit::{Blob, Field, Flesh, Part, carve, smooth_union};
use crate::demo::surface_nets::Grid;

/// Metres a unit of this file.
pub(super) const METRES: f64 = 0.1;
/// The middle of the right eyeball and its radius.
pub(super) const EYE: [f64; 3] = [0.66, 0.17, 0.32];
pub(super) const EYE_RADIUS: f64 = 0.20;
/// The mouth: its middle at the front, half of its width, and the right corner.
pub(super) const MOUTH: [f64; 3] = [0.97, -0.50, 0.0];
pub(super) const MOUTH_WIDTH: f64 = 0.27;

/// Skull and skin, with sockets, eyeballs, lids, pupils (dents, as sculptors make them) and a mouth.
pub(super) struct Head {
    skull: Flesh,
    lids: Flesh,
    eyes: Vec<Blob>,
    sockets: Vec<Blob>,
    pupils: Vec<Blob>,
}

impl Field for Head {
    fn at(&self, point: Vector3<f64>) -> (f64, Vector3<f64>) {
        let mut field = self.skull.at(point);
        for socket in &self.sockets {
            field = carve(field, socket.distance(point), 0.06);
        }
        for eye in &self.eyes {
            field = smooth_union(field, eye.distance(point), 0.006);
        }
        field = smooth_union(field, self.lids.at(point), 0.03);
        for pupil in &self.pupils {
            field = carve(field, pupil.distance(point), 0.012);
        }
        field = carve(field, mouth(point), 0.02);
        carve(field, (point.y + 1.35, Vector3::y()), 0.1)
    }
}

impl Head {
    pub(super) fn new() -> Self {
        let mut skull = vec![
            // cranium, face, jaw, neck, nose
            row(0.84, &[[-0.36, 0.46, 0.0, 0.80], [0.06, 0.50, 0.0, 0.80]]),
            row(0.90, &[[0.26, 0.30, 0.0, 0.60], [0.40, -0.30, 0.0, 0.50]]),
            row(
                1.15,
                &[
                    [0.05, -0.42, 0.0, 0.44],
                    [0.50, -0.68, 0.0, 0.34],
                    [0.66, -0.86, 0.0, 0.20],
                ],
            ),
            row(1.0, &[[-0.30, -0.3, 0.0, 0.44], [-0.42, -1.7, 0.0, 0.46]]),
            row(
                0.8,
                &[
                    [0.84, 0.26, 0.0, 0.07],
                    [0.98, -0.02, 0.0, 0.09],
                    [1.10, -0.20, 0.0, 0.125],
                ],
            ),
            // lips
            row(
                1.0,
                &[
                    [0.75, -0.48, -0.28, 0.035],
                    [0.935, -0.445, -0.10, 0.06],
                    [0.945, -0.45, 0.0, 0.05],
                    [0.935, -0.445, 0.10, 0.06],
                    [0.75, -0.48, 0.28, 0.035],
                ],
            ),
            row(
                1.0,
                &[
                    [0.75, -0.505, -0.27, 0.035],
                    [0.915, -0.565, -0.10, 0.07],
                    [0.92, -0.57, 0.0, 0.07],
                    [0.915, -0.565, 0.10, 0.07],
                    [0.75, -0.505, 0.27, 0.035],
                ],
            ),
        ];
        let mut lids = Vec::new();
        for side in [-1.0, 1.0] {
            let right = |width: f64, points: &[[f64; 4]]| {
                let points: Vec<_> = points
                    .iter()
                    .map(|&[x, y, z, r]| [x, y, side * z, r])
                    .collect();
                row(width, &points)
            };
            skull.extend([
                // cheek, nostril, ear, bone over the eye
                right(1.0, &[[0.50, -0.10, 0.36, 0.22], [0.42, -0.34, 0.32, 0.22]]),
                right(
                    1.0,
                    &[[0.99, -0.235, 0.115, 0.065], [0.90, -0.24, 0.13, 0.05]],
                ),
                right(
                    0.45,
                    &[[-0.17, 0.20, 0.72, 0.17], [-0.12, -0.03, 0.68, 0.11]],
                ),
                right(
                    1.0,
                    &[
                        [0.76, 0.36, 0.12, 0.12],
                        [0.68, 0.40, 0.34, 0.13],
                        [0.50, 0.34, 0.52, 0.10],
                    ],
                ),
                // brow
                right(
                    1.0,
                    &[
                        [0.895, 0.42, 0.12, 0.055],
                        [0.85, 0.49, 0.32, 0.06],
                        [0.66, 0.46, 0.51, 0.03],
                    ],
                ),
            ]);
            lids.extend([right(1.0, &lid(1.0)), right(1.0, &lid(-1.0))]);
        }
        Head {
            skull: Flesh {
                parts: skull,
                blend: 0.05,
            },
            lids: Flesh {
                parts: lids,
                blend: 0.01,
            },
            eyes: both_sides(EYE, EYE_RADIUS),
            sockets: both_sides([EYE[0] + 0.22, EYE[1] - 0.01, EYE[2]], 0.21),
            pupils: both_sides([EYE[0] + 0.205, EYE[1], EYE[2] - 0.01], 0.062),
        }
    }
}

/// Elevation over the eyeball's middle, in radians, of the upper (`side` = 1) or lower (-1) lid at
/// azimuth `turn` about it; both meet in the corners of the eye and are level beyond.
pub(super) fn lid_height(turn: f64, side: f64) -> f64 {
    let share = (turn - 0.17) / 0.98;
    let arch = if side > 0.0 { 0.66 } else { -0.52 };
    0.035 + arch * (1.0 - share * share).max(0.0)
}

/// Points of the right upper or lower lid, from corner to corner.
fn lid(side: f64) -> Vec<[f64; 4]> {
    let reach = EYE_RADIUS + 0.015;
    let point = |step: i32| {
        let turn = 0.17 + 0.245 * f64::from(step);
        let height = lid_height(turn, side);
        let flat = reach * libm::cos(height);
        [
            EYE[0] + flat * libm::cos(turn),
            EYE[1] + reach * libm::sin(height),
            EYE[2] + flat * libm::sin(turn),
            0.036,
        ]
    };
    (-4..=4).map(point).collect()
}

/// A flat pocket behind the lips: an ellipsoid, its distance to first order.
fn mouth(point: Vector3<f64>) -> (f64, Vector3<f64>) {
    let middle = Vector3::new(0.68, MOUTH[1], 0.0);
    let sizes = Vector3::new(0.36, 0.038, MOUTH_WIDTH - 0.01);
    let scaled = (point - middle).component_div(&sizes);
    let length = scaled.norm().max(1e-6);
    let gradient = scaled.component_div(&sizes) / length;
    let slope = gradient.norm().max(1e-6);
    ((length - 1.0) / slope, gradient / slope)
}

fn both_sides([x, y, z]: [f64; 3], radius: f64) -> Vec<Blob> {
    [-z, z].iter().map(|&z| ball([x, y, z], radius)).collect()
}

fn ball(middle: [f64; 3], radius: f64) -> Blob {
    Blob {
        bone: 0,
        ends: [Vector3::from(middle); 2],
        radii: [radius; 2],
        width: 1.0,
    }
}

/// A row of blobs through points (x, y, z, radius).
fn row(width: f64, points: &[[f64; 4]]) -> Part {
    let blob = |pair: &[[f64; 4]]| Blob {
        bone: 0,
        ends: [0, 1].map(|i| Vector3::new(pair[i][0], pair[i][1], pair[i][2])),
        radii: [pair[0][3], pair[1][3]],
        width,
    };
    Part::new(points.windows(2).map(blob).collect())
}

/// Fine in the face, coarse behind it.
pub(super) fn grid() -> Grid {
    let planes = |coarse: f64, pieces: &[(f64, f64)]| {
        let mut planes = vec![coarse];
        for &(end, step) in pieces {
            let start = planes[planes.len() - 1];
            let count = libm::round((end - start) / step);
            planes.extend((1..=count as usize).map(|i| start + (end - start) * i as f64 / count));
        }
        planes
    };
    Grid {
        planes: [
            planes(-1.3, &[(0.3, 0.08), (0.55, 0.05), (1.35, 0.033)]),
            planes(
                -1.52,
                &[
                    (-1.0, 0.065),
                    (-0.75, 0.045),
                    (0.62, 0.032),
                    (0.8, 0.05),
                    (1.4, 0.08),
                ],
            ),
            planes(-1.0, &[(-0.62, 0.054), (0.62, 0.031), (1.0, 0.054)]),
        ],
    }
}
