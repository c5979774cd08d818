//! Positions from lengths and dihedral angles (Rojas et al. 2014, §2.2): a frame for each fan, all frames
//! turned into one space, then the vertices.
//!
//! The paper solves G_v M_vu = G_u for matrices, nine equations an edge, and projects them to rotations.
//! Here the G_v are rotations from the start ([`RotationGraph`]): the same equations with the
//! orthonormality kept, one scalar matrix factored once for all frames of all meshes of a connectivity.
//! The positions then solve v + G_v u_v = u over all edges, seen from both ends.

use nalgebra::{UnitQuaternion, Vector3};

use super::fans::{Fans, NO_STEP};
use super::walk::{corner_halves, half};
use crate::math::rotation::exp;
use crate::math::rotation_graph::RotationGraph;
use crate::math::sparse::SparseError;
use crate::mesh::{Components, Hinges};

/// The factored systems of one connectivity.
#[derive(Debug)]
pub(super) struct Placer {
    frames: RotationGraph,
    positions: RotationGraph,
    /// The side and the steps at its two ends, for each link.
    sides: Vec<Side>,
    /// Which fans are joined through triangles: their frames are known relative to each other.
    sheets: Components,
}

/// A side of a triangle from its corner k to the next, with the steps of the two corners.
#[derive(Debug, Clone, Copy)]
struct Side {
    edge: u32,
    steps: [u32; 2],
    vertices: [u32; 2],
}

impl Placer {
    /// Factors both systems.
    pub(super) fn new(
        vertices: usize,
        triangles: &[[u32; 3]],
        hinges: &Hinges,
        fans: &Fans,
    ) -> Result<Self, SparseError> {
        let sides: Vec<Side> = (0..3 * triangles.len() as u32)
            .filter_map(|side| {
                let next = 3 * (side / 3) + (side + 1) % 3;
                let ends = [side, next];
                let steps = ends.map(|corner| fans.step_of[corner as usize]);
                let vertices = ends.map(|c| triangles[c as usize / 3][c as usize % 3]);
                let edge = hinges.side_edges()[side as usize];
                let whole = steps.iter().all(|&step| step != NO_STEP);
                whole.then_some(Side {
                    edge,
                    steps,
                    vertices,
                })
            })
            .collect();
        let fan_links: Vec<[u32; 2]> = sides
            .iter()
            .map(|side| side.steps.map(|step| fans.fan_of[step as usize]))
            .collect();
        let ends: Vec<[u32; 2]> = sides.iter().map(|side| side.vertices).collect();
        let unit = vec![1.0; sides.len()];
        Ok(Placer {
            sheets: Components::joined(fans.fans.len(), fan_links.iter().copied()),
            frames: RotationGraph::new(fans.fans.len(), fan_links, unit.clone())?,
            positions: RotationGraph::new(vertices, ends, unit)?,
            sides,
        })
    }

    /// The 3V positions, the first vertex of each connected part at the origin. Sheets of triangles that
    /// no hinge joins to others of their part are turned as in `guide`.
    pub(super) fn place(
        &self,
        fans: &Fans,
        corner_angles: &[f64],
        dihedrals: &[f64],
        lengths: &[f64],
        guide: &dyn Fn(u32) -> UnitQuaternion<f64>,
    ) -> Vec<f64> {
        let corners = corner_halves(corner_angles);
        let local: Vec<_> = fans
            .frames(&corners, dihedrals)
            .iter()
            .zip(&fans.steps)
            .map(|(frame, step)| match step.flipped {
                false => *frame,
                // seen from the triangle's own side: the next corner is at the walk's far spoke
                true => frame * turn_z(corner_angles[step.corner as usize]) * half_turn_x(),
            })
            .collect();
        let relative: Vec<_> = self
            .sides
            .iter()
            .map(|side| {
                let [from, to] = side.steps.map(|step| local[step as usize]);
                let corner = fans.steps[side.steps[1] as usize].corner as usize;
                let outer = std::f64::consts::PI - corner_angles[corner];
                from * turn_z(outer) * to.inverse()
            })
            .collect();
        let mut turned = vec![UnitQuaternion::identity(); fans.fans.len()];
        self.frames.solve(&relative, &|_| true, &mut turned);
        self.turn_sheets(&local, fans, guide, &mut turned);
        self.solve(&local, corner_angles, fans, lengths, &turned)
    }

    /// Turns each sheet so that the triangle at its first fan lies as in the guide.
    fn turn_sheets(
        &self,
        local: &[UnitQuaternion<f64>],
        fans: &Fans,
        guide: &dyn Fn(u32) -> UnitQuaternion<f64>,
        turned: &mut [UnitQuaternion<f64>],
    ) {
        let back: Vec<_> = self
            .sheets
            .first()
            .iter()
            .map(|&fan| {
                let step = fans.fans[fan as usize].start as usize;
                let found = turned[fan as usize] * local[step];
                guide(fans.steps[step].corner) * found.inverse()
            })
            .collect();
        for (rotation, &sheet) in turned.iter_mut().zip(self.sheets.part()) {
            *rotation = back[sheet as usize] * *rotation;
        }
    }

    fn solve(
        &self,
        local: &[UnitQuaternion<f64>],
        corner_angles: &[f64],
        fans: &Fans,
        lengths: &[f64],
        turned: &[UnitQuaternion<f64>],
    ) -> Vec<f64> {
        let n = self.positions.factor().unknowns();
        let mut sides = vec![0.0; 3 * n];
        for side in &self.sides {
            let world = side
                .steps
                .map(|step| turned[fans.fan_of[step as usize] as usize] * local[step as usize]);
            let corner = fans.steps[side.steps[1] as usize].corner as usize;
            let [c, s] = half(corner_angles[corner]);
            // the side as its end sees it: its direction there is the walk's far spoke
            let back = world[1] * Vector3::new(c * c - s * s, 2.0 * c * s, 0.0);
            let along = (world[0] * Vector3::x() - back) * (0.5 * lengths[side.edge as usize]);
            let [a, b] = side.vertices.map(|v| v as usize);
            for axis in 0..3 {
                sides[axis * n + b] += along[axis];
                sides[axis * n + a] -= along[axis];
            }
        }
        self.positions.factor().solve(3, &mut sides);
        let at = |i: usize| [sides[i], sides[n + i], sides[2 * n + i]];
        (0..n).flat_map(at).collect()
    }
}

fn turn_z(angle: f64) -> UnitQuaternion<f64> {
    exp(&Vector3::new(0.0, 0.0, angle))
}

fn half_turn_x() -> UnitQuaternion<f64> {
    UnitQuaternion::new_unchecked(nalgebra::Quaternion::new(0.0, 1.0, 0.0, 0.0))
}
