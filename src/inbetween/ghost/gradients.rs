//! Deformation transfer from a ghost (Sumner & Popovic 2004; X19 §4.3): each triangle of the mesh takes
//! the blended turn of its carrier as its gradient, and one sparse solve finds the places. The system is
//! that of the first key, factored once for all frames.
//!
//! Gradients alone do not say where a limb ends: errors along it add up. Over lengths of more than the
//! screening, about one of the ghost's edges, the places of the direct lift ([`super::direct`]) count too. Three poses of a
//! galloping horse of 18 560 triangles behind 2000: KG error 0.8 %, 4.2 % without the residual; with gradients
//! only, as X19 has it, 1.9 % and 16 % (`examples/xia_ghost.rs`).

use std::sync::Arc;

use nalgebra::Vector3;

use super::carrier::Carrier;
use super::residual::Residual;
use super::turns::Turn;
use crate::diag::Result;
use crate::mesh::{Poisson, PoissonAnalysis, Topology, reference_triangles};
use crate::space::SpaceError;

/// The triangles of a mesh under a ghost.
pub(super) struct Gradients {
    poisson: Poisson,
    carriers: Vec<Carrier>,
    /// R^T D b1 - S b1 and R^T D b2 - S b2 at each key, for the gradient D and the carrier's R and S.
    residual: Residual<6>,
}

impl Gradients {
    /// For the keys' shapes `poses`; triangles count by `weights`, unless there are none, and places over lengths above
    /// `screening`. `turns` gives the turns of the ghost's vertices at a key. The residual is kept where
    /// `keep` says so.
    pub(super) fn new(
        topology: &Topology,
        poses: &[Vec<f64>],
        carriers: Vec<Carrier>,
        (weights, screening): (Vec<f64>, f64),
        turns: impl Fn(usize) -> Vec<Turn>,
        keep: bool,
    ) -> Result<Self> {
        let triangles = topology.triangles();
        let analysis =
            PoissonAnalysis::new(topology.vertices(), triangles).map_err(SpaceError::from)?;
        let reference = reference_triangles(triangles, &poses[0]);
        let poisson = Poisson::screened(analysis, Arc::clone(&reference), weights, screening);
        let poisson = poisson.map_err(SpaceError::from)?;
        let keys = if keep { poses.len() } else { 0 };
        let turns: Vec<Vec<Turn>> = (0..keys).map(turns).collect();
        let residual = Residual::new(triangles.len(), keys, |face, key| {
            let place =
                |vertex: u32| Vector3::from_column_slice(&poses[key][3 * vertex as usize..][..3]);
            let [a, b, c] = triangles[face].map(place);
            let rest = &reference[face];
            let turn = carriers[face].turn(&turns[key]);
            let [d1, d2] = rest.images(&(b - a), &(c - a));
            let one = turn.turned_back(&d1) - turn.stretched(&rest.along);
            let two = turn.turned_back(&d2) - turn.stretched(&rest.across());
            [one.x, one.y, one.z, two.x, two.y, two.z]
        });
        Ok(Gradients {
            poisson,
            carriers,
            residual,
        })
    }

    /// Turns the positions of the direct lift into those that have the gradients, for the turns of the
    /// ghost's vertices and the weights of the keys.
    pub(super) fn integrate(&self, turns: &[Turn], weights: &[f64], positions: &mut [f64]) {
        let reference = self.poisson.reference();
        let images = |face: usize| {
            let rest = &reference[face];
            let turn = self.carriers[face].turn(turns);
            let more = self.residual.blend(face, weights);
            let local = [
                turn.stretched(&rest.along) + Vector3::from_column_slice(&more[..3]),
                turn.stretched(&rest.across()) + Vector3::from_column_slice(&more[3..]),
            ];
            local.map(|image| turn.turned(&image))
        };
        self.poisson.solve(images, positions);
    }
}
