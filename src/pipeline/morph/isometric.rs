//! The method `isometric`, pair of poses by pair of poses.

use rayon::prelude::*;

use super::edges::{FrameErrors, lengths};
use super::{AlignmentEffect, AlignmentReport, Found, Moment, doubles};
use crate::diag::{Diagnostic, Result, Warned};
use crate::inbetween::isometric::{Alignment, Connectivity, Isometric};
use crate::mesh::{Edges, FrameSource, Sequence};
use crate::space::SpaceError;
use crate::task::Task;

/// The frames at `moments` of a morph over all poses.
pub(super) fn morph(poses: &Sequence, moments: &[Moment], task: &Task) -> Result<Warned<Found>> {
    task.phase("morph", moments.len());
    let connectivity =
        Connectivity::new(poses.topology(), &doubles(poses, 0)).map_err(SpaceError::from)?;
    let width = 3 * poses.topology().vertices();
    let (mut warnings, mut alignment) = (Vec::new(), None::<AlignmentReport>);
    let mut positions = vec![0.0; width * moments.len()];
    let mut rows = positions.chunks_exact_mut(width.max(1));
    for moments in moments.chunk_by(|a, b| a.pose == b.pose) {
        let first = moments[0].pose;
        let rows: Vec<&mut [f32]> = rows.by_ref().take(moments.len()).collect();
        if first + 1 == poses.frames() {
            rows.into_iter()
                .for_each(|row| row.copy_from_slice(poses.frame(first)));
            continue;
        }
        let pair = [first, first + 1].map(|pose| doubles(poses, pose));
        let morph = between(&connectivity, &pair, Alignment::Rigid)?;
        warnings.extend(opposite_warning(morph.opposite(), first));
        let report = effect_of_alignment(&connectivity, poses, &pair, &morph)?;
        alignment = Some(report.or_more(alignment));
        rows.into_par_iter()
            .zip(moments)
            .try_for_each(|(row, moment)| -> Result<()> {
                task.check()?;
                if moment.t == 0.0 {
                    row.copy_from_slice(poses.frame(first));
                } else {
                    let mut shape = vec![0.0; row.len()];
                    morph.at(moment.t, &mut shape);
                    row.iter_mut()
                        .zip(shape)
                        .for_each(|(out, x)| *out = x as f32);
                }
                task.step();
                Ok(())
            })?;
    }
    Ok(Warned {
        output: Found {
            positions,
            alignment,
        },
        warnings,
    })
}

fn between(
    connectivity: &Connectivity,
    [from, to]: &[Vec<f64>; 2],
    alignment: Alignment,
) -> Result<Isometric> {
    let morph = Isometric::new(connectivity, from, to, alignment);
    Ok(morph.map_err(SpaceError::from)?)
}

/// What the alignment changes half way.
fn effect_of_alignment(
    connectivity: &Connectivity,
    poses: &Sequence,
    pair: &[Vec<f64>; 2],
    morph: &Isometric,
) -> Result<AlignmentReport> {
    let bare = between(connectivity, pair, Alignment::None)?;
    let edges = Edges::new(poses.topology());
    let ends = pair.each_ref().map(|pose| lengths(edges.ends(), pose));
    let wanted = |edge: usize| 0.5 * (ends[0][edge] + ends[1][edge]);
    let effect = |morph: &Isometric| {
        let mut shape = vec![0.0; pair[0].len()];
        morph.at(0.5, &mut shape);
        let errors = FrameErrors::of(edges.ends(), wanted, &shape);
        let [mean, worst] = morph.normal_deviation(0.5, poses.topology().triangles());
        AlignmentEffect {
            edge_mean_percent: errors.mean_percent(),
            edge_worst_percent: errors.worst_percent(),
            normal_mean_degrees: mean.to_degrees(),
            normal_worst_degrees: worst.to_degrees(),
            joint_mean_degrees: None,
            joint_worst_degrees: None,
        }
    };
    Ok(AlignmentReport {
        turn_degrees: morph.turn().to_degrees(),
        with: effect(morph),
        without: effect(&bare),
    })
}

/// What is said of triangles that turn over between pose `first` (from 0) and the next.
fn opposite_warning(triangles: &[u32], first: usize) -> Option<Diagnostic> {
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
