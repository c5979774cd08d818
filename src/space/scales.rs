//! What makes coordinates of different kinds comparable: see [`super::Block`].

use nalgebra::Vector3;

use crate::mesh::ReferenceTriangle;

/// The sizes of a reference pose from which block weights follow.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Scales {
    /// rho, root of the sum over all vertices of the squared distance to the mean vertex; 1 for a pose
    /// that is a single point.
    gyration: f64,
}

impl Scales {
    /// The sizes of a pose of 3V positions.
    pub(super) fn new(pose: &[f64]) -> Self {
        let points = || pose.chunks_exact(3).map(Vector3::from_column_slice);
        let mean = points().sum::<Vector3<f64>>() / (points().len().max(1) as f64);
        let gyration = points()
            .map(|point| (point - mean).norm_squared())
            .sum::<f64>()
            .sqrt();
        Scales {
            gyration: if gyration > 0.0 { gyration } else { 1.0 },
        }
    }

    /// rho: the displacement of a uniform growth by 100 %.
    pub(super) fn size(&self) -> f64 {
        self.gyration
    }

    /// For rotation vectors: a turn by a small angle about a random axis displaces by
    /// rho sqrt(2/3) times the angle.
    pub(super) fn rotation(&self) -> f64 {
        self.gyration * (2.0_f64 / 3.0).sqrt()
    }

    /// For the entries of a stretch: a uniform scale 1 + s has three entries s and displaces by rho s.
    pub(super) fn stretch(&self) -> f64 {
        self.gyration * (1.0_f64 / 3.0).sqrt()
    }
}

/// Roots of the shares of the triangles in the total area: their squares sum to 1.
pub(super) fn area_shares(reference: &[ReferenceTriangle]) -> Vec<f64> {
    let total: f64 = reference.iter().map(ReferenceTriangle::area).sum();
    reference
        .iter()
        .map(|triangle| (triangle.area() / total).sqrt())
        .collect()
}
