//! Where a ghost carries what of the mesh: to a triangle, by barycentric weights.
//!
//! A point of the mesh in its first key belongs to the nearest triangle of the ghost that is found by
//! walking from the triangles around what absorbed it, always to a nearer one: close sheets that are far
//! apart on the surface are not confused.

use nalgebra::Vector3;
use rayon::prelude::*;

use super::turns::{Turn, mean};
use crate::mesh::VertexCorners;

/// Points that one thread takes at a time.
const CHUNK: usize = 1024;

/// Steps of a walk at most; a few are usual.
const STEPS: usize = 64;

/// Three vertices of the ghost and their weights, which sum to 1 and are not negative.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Carrier {
    /// Which triangle; 0 where there is none.
    pub(super) triangle: u32,
    pub(super) vertices: [u32; 3],
    pub(super) weights: [f32; 3],
}

impl Carrier {
    /// Carried by one vertex.
    fn at(vertex: u32) -> Self {
        Carrier {
            triangle: 0,
            vertices: [vertex; 3],
            weights: [1.0, 0.0, 0.0],
        }
    }

    /// The blended turn.
    pub(super) fn turn(&self, turns: &[Turn]) -> Turn {
        let corners = self.vertices.iter().zip(self.weights);
        mean(corners.map(|(&vertex, weight)| (f64::from(weight), turns[vertex as usize])))
    }
}

/// Finds carriers on a ghost.
pub(super) struct Walk<'a> {
    triangles: &'a [[u32; 3]],
    corners: VertexCorners,
    places: Vec<Vector3<f64>>,
}

impl<'a> Walk<'a> {
    /// On the ghost with these triangles, 3G `positions` in the first key.
    pub(super) fn new(triangles: &'a [[u32; 3]], positions: &[f64]) -> Self {
        let places = positions.chunks_exact(3).map(Vector3::from_column_slice);
        Walk {
            triangles,
            corners: VertexCorners::new(positions.len() / 3, triangles),
            places: places.collect(),
        }
    }

    /// The mean length of the ghost's edges; 1 without triangles.
    pub(super) fn edge(&self) -> f64 {
        let place = |vertex: u32| self.places[vertex as usize];
        let sides = self
            .triangles
            .iter()
            .flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
        let sum: f64 = sides.map(|[a, b]| (place(a) - place(b)).norm()).sum();
        match sum > 0.0 {
            true => sum / (3 * self.triangles.len()) as f64,
            false => 1.0,
        }
    }

    /// The carriers of all vertices of the mesh, 3V positions in the first key; `absorber` tells where
    /// the walks start.
    pub(super) fn to_vertices(&self, positions: &[f64], absorber: &[u32]) -> Vec<Carrier> {
        positions
            .par_chunks_exact(3)
            .zip(absorber)
            .with_min_len(CHUNK)
            .map(|(place, &from)| self.to(&Vector3::from_column_slice(place), [from; 3]))
            .collect()
    }

    /// The carriers of the centres of all triangles of the mesh.
    pub(super) fn to_faces(
        &self,
        triangles: &[[u32; 3]],
        positions: &[f64],
        absorber: &[u32],
    ) -> Vec<Carrier> {
        let place =
            |vertex: u32| Vector3::from_column_slice(&positions[3 * vertex as usize..][..3]);
        triangles
            .par_iter()
            .with_min_len(CHUNK)
            .map(|triangle| {
                let [a, b, c] = triangle.map(place);
                let from = triangle.map(|vertex| absorber[vertex as usize]);
                self.to(&((a + b + c) / 3.0), from)
            })
            .collect()
    }

    /// The carrier of a point, the walk starting around `from`.
    fn to(&self, point: &Vector3<f64>, from: [u32; 3]) -> Carrier {
        let mut best = (f64::INFINITY, Carrier::at(from[0]));
        let mut around = from;
        for _ in 0..STEPS {
            let before = best.0;
            for vertex in around {
                for &corner in self.corners.at(vertex as usize) {
                    let triangle = corner / 3;
                    let vertices = self.triangles[triangle as usize];
                    let (distance, weights) =
                        nearest(point, vertices.map(|v| self.places[v as usize]));
                    if distance < best.0 {
                        let weights = weights.map(|weight| weight as f32);
                        best = (
                            distance,
                            Carrier {
                                triangle,
                                vertices,
                                weights,
                            },
                        );
                    }
                }
            }
            if best.0 >= before {
                break;
            }
            around = best.1.vertices;
        }
        best.1
    }
}

/// The squared distance of a point from a triangle and the weights of its corners at the nearest point
/// (Ericson 2005, Real-Time Collision Detection, 5.1.5).
fn nearest(p: &Vector3<f64>, [a, b, c]: [Vector3<f64>; 3]) -> (f64, [f64; 3]) {
    let weights = weights_of_nearest(p, &a, &b, &c);
    let [u, v, w] = weights;
    ((a * u + b * v + c * w - p).norm_squared(), weights)
}

fn weights_of_nearest(
    p: &Vector3<f64>,
    a: &Vector3<f64>,
    b: &Vector3<f64>,
    c: &Vector3<f64>,
) -> [f64; 3] {
    let (ab, ac) = (b - a, c - a);
    let (d1, d2) = (ab.dot(&(p - a)), ac.dot(&(p - a)));
    if d1 <= 0.0 && d2 <= 0.0 {
        return [1.0, 0.0, 0.0];
    }
    let (d3, d4) = (ab.dot(&(p - b)), ac.dot(&(p - b)));
    if d3 >= 0.0 && d4 <= d3 {
        return [0.0, 1.0, 0.0];
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        let v = d1 / (d1 - d3);
        return [1.0 - v, v, 0.0];
    }
    let (d5, d6) = (ab.dot(&(p - c)), ac.dot(&(p - c)));
    if d6 >= 0.0 && d5 <= d6 {
        return [0.0, 0.0, 1.0];
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        let w = d2 / (d2 - d6);
        return [1.0 - w, 0.0, w];
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 >= d3 && d5 >= d6 {
        let w = (d4 - d3) / ((d4 - d3) + (d5 - d6));
        return [0.0, 1.0 - w, w];
    }
    let sum = va + vb + vc;
    [va / sum, vb / sum, vc / sum]
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn point() -> impl Strategy<Value = Vector3<f64>> {
        prop::array::uniform3(-1.0..1.0).prop_map(Vector3::from)
    }

    proptest! {
        #[test]
        fn no_point_of_the_triangle_is_nearer(
            p in point(),
            corners in prop::array::uniform3(point()),
            u in 0.0..1.0_f64,
            v in 0.0..1.0_f64,
        ) {
            let (distance, weights) = nearest(&p, corners);
            prop_assert!(weights.iter().all(|weight| *weight >= 0.0));
            prop_assert!((weights.iter().sum::<f64>() - 1.0).abs() < 1e-12);
            let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
            let other = corners[0] * (1.0 - u - v) + corners[1] * u + corners[2] * v;
            prop_assert!(distance <= (other - p).norm_squared() + 1e-12);
        }
    }

    #[test]
    fn walks_find_the_triangle_under_a_point_from_afar() {
        // a strip of squares along x
        let positions: Vec<f64> = (0..22)
            .flat_map(|i| [f64::from(i / 2), f64::from(i % 2), 0.0])
            .collect();
        let triangles: Vec<[u32; 3]> = (0..10)
            .flat_map(|i| {
                [
                    [2 * i, 2 * i + 2, 2 * i + 1],
                    [2 * i + 1, 2 * i + 2, 2 * i + 3],
                ]
            })
            .collect();
        let walk = Walk::new(&triangles, &positions);
        let found = walk.to(&Vector3::new(8.25, 0.25, 0.3), [0; 3]);
        let x: f32 = found
            .vertices
            .iter()
            .zip(found.weights)
            .map(|(&vertex, weight)| weight * positions[3 * vertex as usize] as f32)
            .sum();
        assert!((x - 8.25).abs() < 1e-6);
        // without triangles a point stays with what absorbed it
        assert_eq!(
            Walk::new(&[], &positions).to(&Vector3::zeros(), [5; 3]),
            Carrier::at(5)
        );
    }
}
