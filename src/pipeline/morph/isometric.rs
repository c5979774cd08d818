//! The method `isometric`, pair of poses by pair of poses.

use std::sync::Arc;

use rayon::prelude::*;

use super::edges::{EdgeReport, FrameErrors, Strain, lengths};
use super::{AlignmentEffect, AlignmentReport, Moment, Morph, MorphMethod, MorphReport, doubles};
use crate::diag::{Diagnostic, Result, Warned};
use crate::inbetween::isometric::{Alignment, Connectivity, Isometric};
use crate::mesh::{Edges, FrameSource, Sequence};
use crate::space::SpaceError;
use crate::task::Task;

/// Two neighbouring poses.
struct Pair<'a> {
    edges: &'a [[u32; 2]],
    poses: [Vec<f64>; 2],
    lengths: [Vec<f64>; 2],
    morph: Isometric,
}

/// The frames at `moments` of a morph over all poses.
pub(super) fn morph(poses: &Sequence, moments: &[Moment], task: &Task) -> Result<Warned<Morph>> {
    let topology = Arc::clone(poses.topology());
    let edges = Edges::new(&topology);
    let width = 3 * topology.vertices();
    let connectivity =
        Connectivity::new(&topology, &doubles(poses, 0)).map_err(SpaceError::from)?;
    task.phase("morph", moments.len());
    let mut positions = vec![0.0; width * moments.len()];
    let (mut errors, mut warnings) = (Vec::new(), Vec::new());
    let (mut strain, mut alignment) = (Strain::default(), None::<AlignmentReport>);
    let mut rows = positions.chunks_exact_mut(width.max(1));
    for moments in moments.chunk_by(|a, b| a.pose == b.pose) {
        let first = moments[0].pose;
        let rows: Vec<&mut [f32]> = rows.by_ref().take(moments.len()).collect();
        if first + 1 == poses.frames() {
            for row in rows {
                row.copy_from_slice(poses.frame(first));
                errors.push(FrameErrors::default());
            }
            continue;
        }
        let pair = Pair::new(edges.ends(), &connectivity, poses, first)?;
        warnings.extend(pair.opposite_warning(first));
        strain = strain.join(Strain::between(&pair.lengths[0], &pair.lengths[1]));
        let report = pair.alignment(&connectivity, poses)?;
        alignment = match alignment {
            Some(known) if known.turn_degrees >= report.turn_degrees => Some(known),
            _ => Some(report),
        };
        let found: Result<Vec<_>> = rows
            .into_par_iter()
            .zip(moments)
            .map(|(row, moment)| {
                task.check()?;
                let errors = pair.frame(poses, moment, row);
                task.step();
                Ok(errors)
            })
            .collect();
        errors.extend(found?);
    }
    Ok(Warned {
        output: Morph {
            frames: Sequence::new(topology, positions, poses.fps()),
            report: MorphReport {
                method: MorphMethod::Isometric.name(),
                poses: poses.frames(),
                edges: EdgeReport::of(&errors),
                strain,
                alignment,
            },
        },
        warnings,
    })
}

impl<'a> Pair<'a> {
    /// Poses `first` and the next.
    fn new(
        edges: &'a [[u32; 2]],
        connectivity: &Connectivity,
        poses: &Sequence,
        first: usize,
    ) -> Result<Self> {
        let poses = [first, first + 1].map(|pose| doubles(poses, pose));
        let morph = Isometric::new(connectivity, &poses[0], &poses[1], Alignment::Rigid);
        Ok(Pair {
            edges,
            lengths: [lengths(edges, &poses[0]), lengths(edges, &poses[1])],
            morph: morph.map_err(SpaceError::from)?,
            poses,
        })
    }

    /// Writes one frame; a pose is copied.
    fn frame(&self, poses: &Sequence, moment: &Moment, row: &mut [f32]) -> FrameErrors {
        if moment.t == 0.0 {
            row.copy_from_slice(poses.frame(moment.pose));
        } else {
            let mut positions = vec![0.0; row.len()];
            self.morph.at(moment.t, &mut positions);
            for (out, x) in row.iter_mut().zip(&positions) {
                *out = *x as f32;
            }
        }
        // what is written is measured
        let written: Vec<f64> = row.iter().map(|&x| f64::from(x)).collect();
        self.errors(moment.t, &written)
    }

    fn errors(&self, t: f64, positions: &[f64]) -> FrameErrors {
        let [from, to] = &self.lengths;
        let wanted = |edge: usize| from[edge] * (1.0 - t) + to[edge] * t;
        FrameErrors::of(self.edges, wanted, positions)
    }

    /// What the alignment changes half way.
    fn alignment(&self, connectivity: &Connectivity, poses: &Sequence) -> Result<AlignmentReport> {
        let [from, to] = &self.poses;
        let bare = Isometric::new(connectivity, from, to, Alignment::None);
        let bare = bare.map_err(SpaceError::from)?;
        let effect = |morph: &Isometric| {
            let mut positions = vec![0.0; from.len()];
            morph.at(0.5, &mut positions);
            let errors = self.errors(0.5, &positions);
            let [mean, worst] = morph.normal_deviation(0.5, poses.topology().triangles());
            AlignmentEffect {
                edge_mean_percent: errors.mean_percent(),
                edge_worst_percent: errors.worst_percent(),
                normal_mean_degrees: mean.to_degrees(),
                normal_worst_degrees: worst.to_degrees(),
            }
        };
        Ok(AlignmentReport {
            turn_degrees: self.morph.turn().to_degrees(),
            with: effect(&self.morph),
            without: effect(&bare),
        })
    }

    /// What is said of triangles that turn over between the poses.
    fn opposite_warning(&self, first: usize) -> Option<Diagnostic> {
        let triangles = self.morph.opposite();
        let face = triangles.first()?;
        let told = Diagnostic::warning(format!(
            "{} of a polygon have opposite normals in poses {} and {}: which way they turn over is a guess",
            match triangles.len() {
                1 => "one triangle".to_string(),
                many => format!("{many} triangles"),
            },
            first + 1,
            first + 2,
        ));
        Some(
            told.at_face(*face as usize + 1)
                .hint("a pose between the two decides"),
        )
    }
}
