//! What a collapse costs, in squared distances from planes.

use nalgebra::Vector3;
use rayon::prelude::*;

use super::CHUNK;
use super::quadric::{Quadric, add, at, plane};
use super::surface::Mesh;

/// Distances from places against distances from planes.
const SPREAD: f64 = 1e-3;

/// Borders against planes of triangles.
const BORDER: f64 = 10.0;

impl Mesh {
    /// The quadrics of the original mesh.
    pub(super) fn add_planes(&mut self) {
        let mut quadrics = std::mem::take(&mut self.quadrics);
        let poses = self.poses;
        quadrics
            .par_chunks_mut(poses)
            .with_min_len(CHUNK)
            .enumerate()
            .for_each_init(Vec::new, |neighbours, (vertex, quadrics)| {
                let vertex = vertex as u32;
                self.neighbours(vertex, neighbours);
                for (pose, quadric) in quadrics.iter_mut().enumerate() {
                    self.add_planes_at(vertex, pose, neighbours, quadric);
                }
            });
        self.quadrics = quadrics;
    }

    fn add_planes_at(
        &self,
        vertex: u32,
        pose: usize,
        neighbours: &[(u32, u32)],
        quadric: &mut Quadric,
    ) {
        let here = self.place(vertex, pose);
        for &triangle in &self.around[vertex as usize] {
            let corners = self.triangles[triangle as usize];
            let [a, b, c] = corners.map(|corner| self.place(corner, pose) - here);
            let cross = (b - a).cross(&(c - a));
            let size = cross.norm();
            if size > 0.0 {
                let (normal, weight) = (cross / size, size / 6.0);
                add(quadric, &plane(&normal, 0.0, weight), &Vector3::zeros());
                let spread = SPREAD * weight;
                for entry in [0, 3, 5] {
                    quadric[entry] += spread;
                }
            }
            // the sides at the vertex that no other triangle has
            for other in corners.into_iter().filter(|other| *other != vertex) {
                let lone = neighbours.contains(&(other, 1));
                let side = self.place(other, pose) - here;
                let outward = side.cross(&cross);
                let length = outward.norm();
                if lone && length > 0.0 {
                    let weight = BORDER * side.norm_squared() / 2.0;
                    let wall = plane(&(outward / length), 0.0, weight);
                    add(quadric, &wall, &Vector3::zeros());
                }
            }
        }
    }

    /// The cost of moving a vertex onto another.
    pub(super) fn cost(&self, vertex: u32, onto: u32) -> f64 {
        let quadrics = &self.quadrics[vertex as usize * self.poses..][..self.poses];
        let costs = quadrics.iter().enumerate().map(|(pose, quadric)| {
            let step = self.place(onto, pose) - self.place(vertex, pose);
            at(quadric, &step)
        });
        costs.sum()
    }

    /// Whether no triangle that stays turns far in any pose.
    pub(super) fn turns_little(&self, vertex: u32, onto: u32, limit: f64) -> bool {
        if limit == f64::NEG_INFINITY {
            return true;
        }
        self.around[vertex as usize].iter().all(|&triangle| {
            let corners = self.triangles[triangle as usize];
            corners.contains(&onto)
                || (0..self.poses).all(|pose| {
                    let normal = |corners: [u32; 3]| {
                        let [a, b, c] = corners.map(|corner| self.place(corner, pose));
                        (b - a).cross(&(c - a))
                    };
                    let moved = corners.map(|corner| if corner == vertex { onto } else { corner });
                    let (before, after) = (normal(corners), normal(moved));
                    before.dot(&after) >= limit * before.norm() * after.norm()
                })
        })
    }
}
