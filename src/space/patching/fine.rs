//! The patches of a fine mesh for a coarse one that stands for it.

use std::sync::Arc;

use nalgebra::UnitQuaternion;

use super::Patching;
use super::growing::grow;
use super::members::areas;
use crate::mesh::{
    Hinges, ReferenceTriangle, Topology, VertexCorners, reference_triangles, usual_patches,
};
use crate::space::SpaceError;
use crate::space::orientation::polar_factors;

/// A mesh that a coarser one stands for.
pub struct Fine<'a> {
    /// Its connectivity.
    pub topology: &'a Arc<Topology>,
    /// The shapes that patches are grown on, the reference pose first; 3V positions each.
    pub poses: &'a [&'a [f64]],
    /// By what each of its triangles counts beside its area; may be empty.
    pub weights: &'a [f64],
    /// The triangle of the coarser mesh that stands for each of its triangles.
    pub carriers: &'a [u32],
}

/// The patches of a fine mesh and how its shapes turn them.
pub(in crate::space) struct FinePatches {
    topology: Arc<Topology>,
    rest: Arc<[ReferenceTriangle]>,
    patching: Patching,
}

impl FinePatches {
    /// Grows the patches of `fine`; gives those of the coarser mesh of so many triangles with these hinges
    /// too.
    ///
    /// # Errors
    /// The system of the patches is too large.
    ///
    /// # Panics
    /// `fine` has another number of carriers than triangles, or names one beyond `triangles`.
    pub(in crate::space) fn grown(
        fine: &Fine<'_>,
        triangles: usize,
        hinges: &Hinges,
    ) -> Result<(Self, Patching), SpaceError> {
        let (topology, reference) = (fine.topology, fine.poses[0]);
        let rest = reference_triangles(topology.triangles(), reference);
        let corners = VertexCorners::new(topology.vertices(), topology.triangles());
        let own_hinges = Hinges::new(topology.vertices(), topology.triangles(), &corners);
        let of_mesh = (&rest[..], topology.triangles(), fine.weights);
        let sought = usual_patches(rest.len());
        let patch = grow(of_mesh, &own_hinges, (reference, fine.poses), sought);
        let patching = Patching::new(&rest, fine.weights, &own_hinges, patch)?;
        let areas = areas(&rest, fine.weights);
        let coarse = Patching::of_coarse(&patching, &areas, fine.carriers, (triangles, hinges))?;
        let topology = Arc::clone(topology);
        Ok((
            FinePatches {
                topology,
                rest,
                patching,
            },
            coarse,
        ))
    }

    /// The rotations of the patches in a shape of the fine mesh.
    pub(in crate::space) fn rotations(&self, positions: &[f64]) -> Vec<UnitQuaternion<f64>> {
        let mut polars = Vec::new();
        polar_factors(
            &self.rest,
            self.topology.triangles(),
            positions,
            &mut polars,
        );
        self.patching.rotations(&polars)
    }
}
