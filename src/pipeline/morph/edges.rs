//! How well edges keep to the lengths that a morph gives them.

use rayon::prelude::*;
use serde::Serialize;

use super::{Moment, doubles};
use crate::diag::Diagnostic;
use crate::mesh::{Edges, FrameSource, Sequence};

/// Errors of edge lengths over the frames of a morph, against the straight path between their lengths
/// in the poses.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct EdgeReport {
    /// Mean over edges and frames of the error, each in percent of its own length.
    pub mean_percent: f64,
    /// Root mean square error in percent of the mean length.
    pub rms_percent: f64,
    /// The largest error in percent of the edge's own length.
    pub worst_percent: f64,
    /// The frame with the largest error, counted from 1.
    pub worst_frame: usize,
    /// The vertices of that edge, counted from 1; 0 without edges.
    pub worst_edge: [u32; 2],
}

/// How much edges change their lengths between two poses, each against the mean of both lengths.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Strain {
    /// Mean over the edges, in percent.
    pub mean_percent: f64,
    /// The largest, in percent.
    pub worst_percent: f64,
}

/// The errors of all frames, and the largest strain between neighbouring poses.
pub(super) fn measured(
    poses: &Sequence,
    frames: &Sequence,
    moments: &[Moment],
) -> (EdgeReport, Strain) {
    let edges = Edges::new(poses.topology());
    let lengths: Vec<Vec<f64>> = (0..poses.frames())
        .into_par_iter()
        .map(|pose| lengths(edges.ends(), &doubles(poses, pose)))
        .collect();
    let errors: Vec<FrameErrors> = moments
        .par_iter()
        .enumerate()
        .map(|(frame, moment)| {
            let from = &lengths[moment.pose];
            let to = lengths.get(moment.pose + 1).unwrap_or(from);
            let wanted = |edge: usize| from[edge] * (1.0 - moment.t) + to[edge] * moment.t;
            FrameErrors::of(edges.ends(), wanted, &doubles(frames, frame))
        })
        .collect();
    let pairs = lengths.windows(2);
    let strains = pairs.map(|pair| Strain::between(&pair[0], &pair[1]));
    let strain = strains.fold(Strain::default(), Strain::join);
    (EdgeReport::of(&errors), strain)
}

/// The errors of one frame, to be joined with others'.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct FrameErrors {
    ratios: f64,
    squares: f64,
    lengths: f64,
    count: usize,
    worst: f64,
    edge: [u32; 2],
}

impl FrameErrors {
    /// Compares the edges of `positions` with the lengths `wanted`. An edge that should have no length
    /// is left out.
    pub(super) fn of(edges: &[[u32; 2]], wanted: impl Fn(usize) -> f64, positions: &[f64]) -> Self {
        let mut errors = FrameErrors::default();
        for (edge, &ends) in edges.iter().enumerate() {
            let wanted = wanted(edge);
            let miss = (length(positions, ends) - wanted).abs();
            if wanted > 0.0 {
                let ratio = miss / wanted;
                errors.ratios += ratio;
                if ratio > errors.worst {
                    (errors.worst, errors.edge) = (ratio, ends.map(|vertex| vertex + 1));
                }
            }
            errors.squares += miss * miss;
            errors.lengths += wanted;
            errors.count += 1;
        }
        errors
    }

    pub(super) fn mean_percent(&self) -> f64 {
        100.0 * self.ratios / self.count.max(1) as f64
    }

    pub(super) fn worst_percent(&self) -> f64 {
        100.0 * self.worst
    }
}

impl EdgeReport {
    /// The errors of all frames, given in order.
    pub(super) fn of(frames: &[FrameErrors]) -> Self {
        let (mut sum, mut frame) = (FrameErrors::default(), 0);
        for (index, one) in frames.iter().enumerate() {
            sum.ratios += one.ratios;
            sum.squares += one.squares;
            sum.lengths += one.lengths;
            sum.count += one.count;
            if one.worst > sum.worst {
                (sum.worst, sum.edge, frame) = (one.worst, one.edge, index + 1);
            }
        }
        let count = sum.count.max(1) as f64;
        let mean = sum.lengths / count;
        let rms = (sum.squares / count).sqrt();
        EdgeReport {
            mean_percent: sum.mean_percent(),
            rms_percent: if mean > 0.0 { 100.0 * rms / mean } else { 0.0 },
            worst_percent: sum.worst_percent(),
            worst_frame: frame.max(1),
            worst_edge: sum.edge,
        }
    }
}

impl Strain {
    /// Between two poses with these edge lengths.
    pub(super) fn between(from: &[f64], to: &[f64]) -> Self {
        let strains = from.iter().zip(to).map(|(a, b)| match a + b > 0.0 {
            true => 200.0 * (a - b).abs() / (a + b),
            false => 0.0,
        });
        let (sum, worst) = strains.fold((0.0, 0.0_f64), |(sum, worst), strain| {
            (sum + strain, worst.max(strain))
        });
        Strain {
            mean_percent: sum / from.len().max(1) as f64,
            worst_percent: worst,
        }
    }

    /// The larger of both, each for itself.
    pub(super) fn join(self, other: Self) -> Self {
        Strain {
            mean_percent: self.mean_percent.max(other.mean_percent),
            worst_percent: self.worst_percent.max(other.worst_percent),
        }
    }
}

/// Poses are told to be far from isometric when their edges change by this much on average, in percent.
const NEAR_ISOMETRIC: f64 = 10.0;

/// What is said of poses that are not near-isometric.
pub(super) fn strain_warning(strain: &Strain) -> Option<Diagnostic> {
    (strain.mean_percent > NEAR_ISOMETRIC).then(|| {
        Diagnostic::warning(format!(
            "the poses are not near-isometric: edges change by {:.0} % on average and {:.0} % at most",
            strain.mean_percent, strain.worst_percent
        ))
        .hint("lengths go linearly from one pose to the next; what should keep its lengths does not")
    })
}

/// The length of every edge of a pose.
pub(super) fn lengths(edges: &[[u32; 2]], positions: &[f64]) -> Vec<f64> {
    let ends = edges.iter();
    ends.map(|&ends| length(positions, ends)).collect()
}

fn length(positions: &[f64], [a, b]: [u32; 2]) -> f64 {
    let (a, b) = (3 * a as usize, 3 * b as usize);
    let squares = (0..3).map(|axis| positions[a + axis] - positions[b + axis]);
    squares.map(|x| x * x).sum::<f64>().sqrt()
}
