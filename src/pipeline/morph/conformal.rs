//! The method `conformal` (Rojas et al. 2014, §5): one factor a vertex leads from pose to pose, or from
//! one pose to the sphere.

use serde::Serialize;

use super::{Morph, MorphMethod, MorphRequest, doubles, edge_lengths};
use crate::diag::{Diagnostic, Result, Warned};
use crate::inbetween::conformal::{ConformalError, factors, sphere};
use crate::inbetween::edge_lengths::{Blend, Embedding};
use crate::mesh::rigid_align::rigid;
use crate::mesh::{FrameSource, Sequence};
use crate::space::SpaceError;
use crate::task::Task;

/// How poses are conformally equivalent: b_ij = exp((u_i + u_j) / 2) a_ij; the least and the largest over
/// all pairs of neighbours.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ConformalReport {
    /// Whether the last shape is the sphere that the one pose was mapped to.
    pub sphere: bool,
    /// Root mean square over the edges of how far the factors are from explaining a length, in percent.
    pub residual_percent: f64,
    /// The least factor u of a vertex, and the largest.
    pub factors: [f64; 2],
}

/// Poses are equivalent where their lengths are explained to this root mean square, in percent: files
/// with six digits of thin triangles stay below it.
const EQUIVALENT: f64 = 0.1;

/// The frames of a request between equivalent poses, or from one pose to the sphere.
pub(super) fn morph(
    poses: &Sequence,
    request: &MorphRequest,
    task: &Task,
) -> Result<Warned<Morph>> {
    let embedding = Embedding::new(poses.topology()).map_err(SpaceError::from)?;
    let mut shapes: Vec<Vec<f64>> = (0..poses.frames())
        .map(|pose| doubles(poses, pose))
        .collect();
    let round = match &shapes[..] {
        [pose] => Some(sphere_of(poses, &embedding, pose)?),
        _ => None,
    };
    shapes.extend(round);
    let report = equivalence(poses, &embedding, &shapes)?;
    let shapes = (&embedding, &shapes[..]);
    let mut morph = edge_lengths::morph(poses, shapes, request, Blend::Logarithms, task)?;
    morph.output.report.method = MorphMethod::Conformal.name();
    morph.output.report.poses = poses.frames();
    morph.output.report.conformal = Some(report);
    Ok(morph)
}

/// The sphere that a pose is mapped to: of the same area, turned to where it lies nearest.
fn sphere_of(poses: &Sequence, embedding: &Embedding, pose: &[f64]) -> Result<Vec<f64>> {
    let topology = poses.topology();
    let unit = sphere(topology, &embedding.lengths(pose)).map_err(|error| told(error, poses))?;
    let triangles = topology.triangles();
    let size = (area(triangles, pose) / area(triangles, &unit)).sqrt();
    let round: Vec<f64> = unit.iter().map(|x| x * size).collect();
    let motion = rigid(&round, pose);
    let points = round.chunks_exact(3).map(nalgebra::Point3::from_slice);
    Ok(points.flat_map(|p| (motion * p).coords.data.0[0]).collect())
}

fn area(triangles: &[[u32; 3]], pose: &[f64]) -> f64 {
    let point = |v: u32| nalgebra::Vector3::from_column_slice(&pose[3 * v as usize..][..3]);
    let each = triangles.iter().map(|&[a, b, c]| {
        let start = point(a);
        (point(b) - start).cross(&(point(c) - start)).norm()
    });
    0.5 * each.sum::<f64>()
}

/// How neighbouring poses are equivalent.
///
/// # Errors
/// Two of them are not.
fn equivalence(
    poses: &Sequence,
    embedding: &Embedding,
    shapes: &[Vec<f64>],
) -> Result<ConformalReport> {
    let mut report = ConformalReport {
        sphere: shapes.len() > poses.frames(),
        residual_percent: 0.0,
        factors: [f64::MAX, f64::MIN],
    };
    let lengths: Vec<Vec<f64>> = shapes.iter().map(|pose| embedding.lengths(pose)).collect();
    for (first, pair) in lengths.windows(2).enumerate() {
        let found = factors(embedding.vertices(), embedding.edges(), &pair[0], &pair[1])
            .map_err(|error| told(error, poses))?;
        let residual = 100.0 * found.residual;
        if residual > EQUIVALENT {
            return Diagnostic::error(format!(
                "poses {} and {} are not conformally equivalent: no factors of the vertices explain their edge lengths, which are off by {residual:.2} % (root mean square)",
                first + 1,
                first + 2
            ))
            .hint("one closed mesh alone is mapped to the sphere; --method edge-lengths goes between any two poses")
            .err();
        }
        report.residual_percent = report.residual_percent.max(residual);
        for u in found.factors {
            report.factors = [report.factors[0].min(u), report.factors[1].max(u)];
        }
    }
    Ok(report)
}

fn told(error: ConformalError, poses: &Sequence) -> Box<Diagnostic> {
    let said = Diagnostic::error(error.to_string());
    Box::new(match error {
        ConformalError::Solver(error) => return SpaceError::from(error).into(),
        ConformalError::NotASphere { .. } => said.hint(
            "close its borders and join its parts first, or give a second, conformally equivalent pose",
        ),
        ConformalError::NotConverged { .. } => {
            said.hint("triangles that are nearly lines may be the cause")
        }
        ConformalError::Degenerates { triangle } => {
            let [a, b, c] = poses.topology().triangles()[triangle].map(|vertex| vertex + 1);
            said.hint(format!(
                "these triangles have no conformal map to the sphere unless edges are flipped; rounder ones around vertices {a}, {b}, {c} do"
            ))
        }
    })
}
