//! The surface while it is collapsed: which collapses keep it one, and what they change.

use nalgebra::Vector3;
use rayon::prelude::*;

use super::quadric::{Quadric, add};
use super::queue::{Candidate, Scratch};
use super::{CHUNK, Collapsed};
use crate::mesh::VertexCorners;
use crate::mesh::components::root;

/// The mesh while it is collapsed.
pub(super) struct Mesh {
    pub(super) poses: usize,
    /// Place of each vertex in each pose.
    pub(super) places: Vec<Vector3<f64>>,
    /// Quadric of each vertex in each pose, about its place.
    pub(super) quadrics: Vec<Quadric>,
    pub(super) triangles: Vec<[u32; 3]>,
    alive: Vec<bool>,
    pub(super) left: usize,
    /// The triangles at each vertex.
    pub(super) around: Vec<Vec<u32>>,
    border: Vec<bool>,
    /// Where fans meet.
    pub(super) fixed: Vec<bool>,
    /// Where each removed vertex went.
    parent: Vec<u32>,
    /// How often what lies around each vertex has changed.
    pub(super) stamp: Vec<u32>,
}

impl Mesh {
    pub(super) fn new(vertices: usize, triangles: &[[u32; 3]], poses: &[&[f64]]) -> Self {
        let corners = VertexCorners::new(vertices, triangles);
        let around: Vec<Vec<u32>> = (0..vertices)
            .map(|vertex| corners.at(vertex).iter().map(|corner| corner / 3).collect())
            .collect();
        let place = |at: usize| {
            let (vertex, pose) = (at / poses.len(), at % poses.len());
            Vector3::from_column_slice(&poses[pose][3 * vertex..3 * vertex + 3])
        };
        let mut mesh = Mesh {
            poses: poses.len(),
            places: (0..vertices * poses.len()).map(place).collect(),
            quadrics: vec![[0.0; 10]; vertices * poses.len()],
            triangles: triangles.to_vec(),
            alive: vec![true; triangles.len()],
            left: triangles.len(),
            around,
            border: Vec::new(),
            fixed: Vec::new(),
            parent: (0..vertices as u32).collect(),
            stamp: vec![0; vertices],
        };
        let kinds: Vec<(bool, bool)> = (0..vertices as u32)
            .into_par_iter()
            .with_min_len(CHUNK)
            .map_init(Scratch::default, |scratch, vertex| {
                mesh.kind(vertex, scratch)
            })
            .collect();
        mesh.border = kinds.iter().map(|kind| kind.0).collect();
        mesh.fixed = kinds.iter().map(|kind| kind.1).collect();
        mesh
    }

    /// Whether a vertex lies on a border, and whether its triangles make more than one fan. A fan of k
    /// triangles has k neighbours, or k + 1 with a border.
    fn kind(&self, vertex: u32, scratch: &mut Scratch) -> (bool, bool) {
        self.neighbours(vertex, &mut scratch.neighbours);
        let ends = scratch
            .neighbours
            .iter()
            .filter(|(_, count)| *count == 1)
            .count();
        let fans = self.fans(vertex);
        (ends > 0, fans > 1)
    }

    /// How many fans the triangles around a vertex make.
    fn fans(&self, vertex: u32) -> usize {
        let around = &self.around[vertex as usize];
        let mut fan: Vec<usize> = (0..around.len()).collect();
        let joined = |a: u32, b: u32| {
            let [a, b] = [a, b].map(|triangle| self.triangles[triangle as usize]);
            a.iter().any(|v| *v != vertex && b.contains(v))
        };
        for i in 0..around.len() {
            for j in 0..i {
                let (one, other) = (fan[i], fan[j]);
                if one != other && joined(around[i], around[j]) {
                    fan.iter_mut()
                        .filter(|fan| **fan == one.max(other))
                        .for_each(|fan| *fan = one.min(other));
                }
            }
        }
        fan.iter().enumerate().filter(|(i, fan)| i == *fan).count()
    }

    /// The neighbours of a vertex, ascending, and how many of its triangles each lies in.
    pub(super) fn neighbours(&self, vertex: u32, found: &mut Vec<(u32, u32)>) {
        found.clear();
        for &triangle in &self.around[vertex as usize] {
            for other in self.triangles[triangle as usize] {
                if other != vertex {
                    match found.iter_mut().find(|(known, _)| *known == other) {
                        Some((_, count)) => *count += 1,
                        None => found.push((other, 1)),
                    }
                }
            }
        }
        found.sort_unstable();
    }

    pub(super) fn place(&self, vertex: u32, pose: usize) -> &Vector3<f64> {
        &self.places[vertex as usize * self.poses + pose]
    }

    /// The link condition: what both ends neighbour are the corners opposite their edge; a border vertex
    /// moves along its border.
    pub(super) fn keeps_the_surface(
        &self,
        vertex: u32,
        onto: u32,
        neighbours: &[(u32, u32)],
        others: &mut Vec<u32>,
    ) -> bool {
        let Some(&(_, shared)) = neighbours.iter().find(|(other, _)| *other == onto) else {
            return false;
        };
        let [from, to] = [vertex, onto].map(|v| self.border[v as usize]);
        if from && (shared != 1 || !to) {
            return false;
        }
        others.clear();
        for &triangle in &self.around[onto as usize] {
            let corners = self.triangles[triangle as usize];
            others.extend(corners.into_iter().filter(|corner| *corner != onto));
        }
        others.sort_unstable();
        others.dedup();
        let common = neighbours
            .iter()
            .filter(|(other, _)| others.binary_search(other).is_ok())
            .count();
        // a closed surface of four triangles and a border of three sides are as small as they get
        let smallest = match from {
            true => {
                self.around[vertex as usize].len() < 2 && self.border_is_a_triangle(onto, vertex)
            }
            false => neighbours.len() < 4 && others.len() < 4 && !to,
        };
        common == shared as usize && !smallest
    }

    /// Whether the border through two neighbours has three sides only.
    fn border_is_a_triangle(&self, a: u32, b: u32) -> bool {
        let mut found = Vec::new();
        let mut ends = |vertex: u32| {
            self.neighbours(vertex, &mut found);
            let lone = found.iter().filter(|(_, count)| *count == 1);
            lone.map(|(other, _)| *other).collect::<Vec<u32>>()
        };
        let (of_a, of_b) = (ends(a), ends(b));
        of_a.iter().any(|vertex| of_b.contains(vertex))
    }

    /// Moves a vertex onto another.
    pub(super) fn apply(&mut self, candidate: &Candidate) {
        let (vertex, onto) = (candidate.vertex, candidate.onto);
        for pose in 0..self.poses {
            let from = vertex as usize * self.poses + pose;
            let to = onto as usize * self.poses + pose;
            let origin = self.places[from] - self.places[to];
            let quadric = self.quadrics[from];
            add(&mut self.quadrics[to], &quadric, &origin);
        }
        let triangles = std::mem::take(&mut self.around[vertex as usize]);
        for triangle in triangles {
            let corners = self.triangles[triangle as usize];
            if corners.contains(&onto) {
                self.alive[triangle as usize] = false;
                self.left -= 1;
                for corner in corners.into_iter().filter(|corner| *corner != vertex) {
                    self.around[corner as usize].retain(|other| *other != triangle);
                }
            } else {
                let moved = corners.map(|corner| if corner == vertex { onto } else { corner });
                self.triangles[triangle as usize] = moved;
                self.around[onto as usize].push(triangle);
            }
        }
        self.parent[vertex as usize] = onto;
        self.fixed[vertex as usize] = true;
        self.stamp[vertex as usize] += 1;
    }

    /// What is left, its vertices numbered anew.
    pub(super) fn compact(mut self, curve: Vec<(usize, f64)>) -> Collapsed {
        let stays = |vertex: u32, parent: &[u32]| parent[vertex as usize] == vertex;
        let all = 0..self.parent.len() as u32;
        let vertices: Vec<u32> = all.filter(|&vertex| stays(vertex, &self.parent)).collect();
        let mut number = vec![0; self.parent.len()];
        for (new, &old) in vertices.iter().enumerate() {
            number[old as usize] = new as u32;
        }
        let absorber = (0..self.parent.len() as u32)
            .map(|vertex| number[root(&mut self.parent, vertex) as usize])
            .collect();
        let alive = self.triangles.iter().zip(&self.alive);
        let triangles = alive
            .filter(|(_, alive)| **alive)
            .map(|(triangle, _)| triangle.map(|vertex| number[vertex as usize]))
            .collect();
        Collapsed {
            vertices,
            triangles,
            absorber,
            curve,
        }
    }
}
