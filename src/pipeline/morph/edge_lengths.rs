//! The method `edge-lengths` (Rojas et al. 2014), which also embeds the lengths of `conformal`.

use std::sync::Arc;

use serde::Serialize;

use super::edges::{EdgeReport, FrameErrors, Strain, lengths};
use super::path::weights;
use super::{Morph, MorphMethod, MorphReport, MorphRequest, morph_frames};
use crate::diag::{Diagnostic, Result, Warned};
use crate::inbetween::edge_lengths::{
    self, Blend, EmbedError, EmbedReport, Embedding, KeyShapes, Mending, Options, SequenceError,
};
use crate::mesh::{Edges, FrameSource, Sequence};
use crate::task::Task;

/// How the embedding of lengths went, over all frames.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct EmbeddingReport {
    /// Frames that were embedded; others have lengths and angles blended between them.
    pub embedded: usize,
    /// Vertices with a closed walk, which is one equation of R14 (1).
    pub walks: usize,
    /// The largest residual of equation (3), and its frame, counted from 1.
    pub residual: f64,
    /// That frame.
    pub residual_frame: usize,
    /// The least part of the edges of a frame within 1 % of the lengths asked for, in percent.
    pub within_percent: f64,
    /// Relative errors in percent that 50, 90, 98 and 99 % of the edges keep to in the worst frame.
    pub percentiles: [f64; 4],
    /// Edges more than 1 % off in any frame, the worst first, 20 at most.
    pub missed: Vec<MissedEdge>,
    /// How many there are.
    pub missed_edges: usize,
    /// Vertices around which corner angles cannot close, with the radians missing: the worst of all
    /// frames, 20 at most.
    pub impossible: Vec<ImpossibleVertex>,
    /// Jumps between embeddings that were found, and what was done.
    pub jumps: Vec<JumpReport>,
    /// Parts that came out as their mirror image and were reflected, over all frames.
    pub mirrored: usize,
}

/// An edge that misses its length.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct MissedEdge {
    /// Its vertices, counted from 1.
    pub edge: [u32; 2],
    /// The frame where it is worst, counted from 1.
    pub frame: usize,
    /// By how much, in percent of its length; positive where it is too long.
    pub percent: f64,
}

/// A vertex whose corner angles do not close (R14 §4).
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ImpossibleVertex {
    /// The vertex, counted from 1.
    pub vertex: usize,
    /// The frame where most is missing, counted from 1.
    pub frame: usize,
    /// How much, in degrees.
    pub degrees: f64,
}

/// A jump from one embedding to another.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct JumpReport {
    /// The first frame after it, counted from 1.
    pub frame: usize,
    /// The edge whose dihedral angle jumped most: its vertices, counted from 1.
    pub edge: [u32; 2],
    /// By how many degrees otherwise than expected.
    pub degrees: f64,
    /// `followed`: embedded again from the frame before; `blended`: lengths and angles blended around it.
    pub mending: &'static str,
    /// How many frames that changed.
    pub frames: usize,
}

/// Rows of the report at most.
const LISTED: usize = 20;

/// The frames of a request along its path among `shapes` of the mesh of `poses`, `blend` of their lengths.
pub(super) fn morph(
    poses: &Sequence,
    (embedding, shapes): (&Embedding, &[Vec<f64>]),
    request: &MorphRequest,
    blend: Blend,
    task: &Task,
) -> Result<Warned<Morph>> {
    let frames = morph_frames(poses, request)?;
    let rows = weights(request.path.as_ref(), frames, shapes.len())?;
    let topology = Arc::clone(poses.topology());
    let shapes: Vec<&[f64]> = shapes.iter().map(Vec::as_slice).collect();
    let keys = KeyShapes::new(embedding, &shapes);
    task.phase("morph", frames);
    let options = Options {
        blend,
        every: request.every.unwrap_or(1),
    };
    let found = edge_lengths::morph(embedding, &topology, &keys, &rows, options, task)
        .map_err(|error| told(error, poses, blend))?;
    let edges = Edges::new(&topology);
    let mut positions: Vec<f32> = Vec::with_capacity(frames * 3 * topology.vertices());
    let (mut errors, mut strain) = (Vec::new(), Strain::default());
    let own: Vec<Vec<f64>> = shapes
        .iter()
        .map(|pose| lengths(edges.ends(), pose))
        .collect();
    for pair in own.windows(2) {
        strain = strain.join(Strain::between(&pair[0], &pair[1]));
    }
    for (row, frame) in rows.iter().zip(&found.frames) {
        let start = positions.len();
        positions.extend(frame.iter().map(|&x| x as f32));
        let written: Vec<f64> = positions[start..].iter().map(|&x| f64::from(x)).collect();
        let wanted = |edge: usize| blend.length(row, own.iter().map(|lengths| lengths[edge]));
        errors.push(FrameErrors::of(edges.ends(), wanted, &written));
    }
    let report = report(embedding, &found);
    let warnings = warnings(embedding, &report);
    Ok(Warned {
        output: Morph {
            frames: Sequence::new(topology, positions, poses.fps()),
            report: MorphReport {
                method: MorphMethod::EdgeLengths.name(),
                poses: poses.frames(),
                edges: EdgeReport::of(&errors),
                strain,
                alignment: None,
                conformal: None,
                embedding: Some(report),
            },
        },
        warnings,
    })
}

/// What is said of lengths without an embedding.
fn told(error: SequenceError, poses: &Sequence, blend: Blend) -> Box<Diagnostic> {
    match error {
        SequenceError::Space(error) => error.into(),
        SequenceError::Cancelled => crate::task::Cancelled.into(),
        SequenceError::Embed { frame, error } => {
            let EmbedError::Triangle { triangle, .. } = error;
            let triangles = poses.topology().triangles();
            let corners = triangles[triangle].map(|vertex| vertex + 1);
            let [a, b, c] = corners;
            let told = Diagnostic::error(format!("{error} (vertices {a}, {b}, {c})"));
            let hint = match blend {
                Blend::Logarithms => {
                    "factors between two shapes may leave what makes triangles: rounder triangles there, or a pose between, keep the way open"
                }
                _ => {
                    "inside the poses lengths always make triangles: keep the weights of the path between 0 and 1"
                }
            };
            Box::new(told.at_frame(frame + 1).hint(hint))
        }
    }
}

fn report(embedding: &Embedding, found: &edge_lengths::Morph) -> EmbeddingReport {
    let reports: Vec<(usize, &EmbedReport)> = found
        .reports
        .iter()
        .enumerate()
        .filter_map(|(frame, report)| Some((frame + 1, report.as_ref()?)))
        .collect();
    let worst = |value: &dyn Fn(&EmbedReport) -> f64| {
        reports.iter().copied().fold(
            None,
            |best: Option<(usize, &EmbedReport)>, one| match best {
                Some(best) if value(best.1) >= value(one.1) => Some(best),
                _ => Some(one),
            },
        )
    };
    let residual = worst(&|report| report.residual);
    let farthest = worst(&|report| -report.edges.within);
    let missed = missed(embedding, &reports);
    EmbeddingReport {
        embedded: reports.len(),
        walks: embedding.walks(),
        residual: residual.map_or(0.0, |(_, report)| report.residual),
        residual_frame: residual.map_or(1, |(frame, _)| frame),
        within_percent: farthest.map_or(100.0, |(_, report)| 100.0 * report.edges.within),
        percentiles: farthest.map_or([0.0; 4], |(_, report)| report.edges.percentiles),
        missed_edges: missed.len(),
        missed: missed.into_iter().take(LISTED).collect(),
        impossible: impossible(&reports),
        jumps: jumps(embedding, found),
        mirrored: reports.iter().map(|(_, report)| report.mirrored).sum(),
    }
}

/// Edges off by more than 1 % in some frame, each with its worst, the worst edge first.
fn missed(embedding: &Embedding, reports: &[(usize, &EmbedReport)]) -> Vec<MissedEdge> {
    let mut worst = std::collections::BTreeMap::new();
    for &(frame, report) in reports {
        for one in &report.edges.missed {
            let known = worst.entry(one.edge).or_insert((frame, one.percent));
            if one.percent.abs() > known.1.abs() {
                *known = (frame, one.percent);
            }
        }
    }
    let mut missed: Vec<MissedEdge> = worst
        .into_iter()
        .map(|(edge, (frame, percent))| MissedEdge {
            edge: embedding.edges()[edge].map(|vertex| vertex + 1),
            frame,
            percent,
        })
        .collect();
    missed.sort_by(|a, b| b.percent.abs().total_cmp(&a.percent.abs()));
    missed
}

/// Vertices whose corner angles do not close in some frame, each with its worst, the worst first.
fn impossible(reports: &[(usize, &EmbedReport)]) -> Vec<ImpossibleVertex> {
    let mut worst = std::collections::BTreeMap::new();
    for &(frame, report) in reports {
        for &(vertex, missing) in &report.impossible {
            let known = worst.entry(vertex).or_insert((frame, missing));
            if missing > known.1 {
                *known = (frame, missing);
            }
        }
    }
    let mut found: Vec<ImpossibleVertex> = worst
        .into_iter()
        .map(|(vertex, (frame, missing))| ImpossibleVertex {
            vertex: vertex + 1,
            frame,
            degrees: missing.to_degrees(),
        })
        .collect();
    found.sort_by(|a, b| b.degrees.total_cmp(&a.degrees));
    found.truncate(LISTED);
    found
}

fn jumps(embedding: &Embedding, found: &edge_lengths::Morph) -> Vec<JumpReport> {
    let each = found.repairs.iter().map(|repair| {
        let (mending, frames) = match repair.mending {
            Mending::Followed { frames } => ("followed", frames),
            Mending::Blended { frames } => ("blended", frames),
        };
        JumpReport {
            frame: repair.frame + 1,
            edge: embedding.edges()[repair.edge].map(|vertex| vertex + 1),
            degrees: repair.change.to_degrees(),
            mending,
            frames,
        }
    });
    each.collect()
}

/// What a person should know beside the figures.
fn warnings(embedding: &Embedding, report: &EmbeddingReport) -> Vec<Diagnostic> {
    let mut warnings = Vec::new();
    if report.walks == 0 && !embedding.edges().is_empty() {
        warnings.push(
            Diagnostic::warning("the mesh has no inner vertex: its lengths do not fix how it folds")
                .hint("dihedral angles are those between the poses'; --method isometric is made for such meshes"),
        );
    }
    if let Some(worst) = report.impossible.first() {
        let told = format!(
            "around {} the angles of the triangles cannot close: {:.1} degrees are missing",
            match report.impossible.len() {
                1 => "a vertex".to_string(),
                LISTED.. => format!("{LISTED} vertices and more"),
                many => format!("{many} vertices"),
            },
            worst.degrees
        );
        warnings.push(
            Diagnostic::warning(told)
                .at_frame(worst.frame)
                .at_vertex(worst.vertex)
                .hint("no shape has these lengths; the nearest was taken"),
        );
    }
    if let Some(worst) = report.missed.first() {
        let [a, b] = worst.edge;
        let told = format!(
            "{} off {} by more than 1 %, that between vertices {a} and {b} by {:.1} %",
            match report.missed_edges {
                1 => "one edge is".to_string(),
                many => format!("{many} edges are"),
            },
            if report.missed_edges == 1 {
                "its length"
            } else {
                "their lengths"
            },
            worst.percent.abs()
        );
        warnings.push(Diagnostic::warning(told).at_frame(worst.frame));
    }
    if let Some(first) = report.jumps.first() {
        let told = format!(
            "{} between two shapes with the same lengths {} mended ({})",
            match report.jumps.len() {
                1 => "a jump".to_string(),
                many => format!("{many} jumps"),
            },
            if report.jumps.len() == 1 {
                "was"
            } else {
                "were"
            },
            first.mending,
        );
        let [a, b] = first.edge;
        warnings.push(
            Diagnostic::warning(told)
                .at_frame(first.frame)
                .hint(format!("the fold between vertices {a} and {b} jumped most")),
        );
    }
    warnings
}
