//! What a fit says about itself: how well, with how much, and what should be known.

use serde::{Deserialize, Serialize};

use super::ch12::{self, Signals, passed};
use super::left_out::LeftOutFit;
use super::subspace::Subspace;
use crate::math::b_spline::Point;

/// The report of a fit; the first fields are the command line's JSON. Zeros and nothing for a loom that
/// was not fitted.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct FitReport {
    /// n, frames of the capture.
    pub frames: usize,
    /// V.
    pub vertices: usize,
    /// Polygons.
    pub faces: usize,
    /// The shape space's name.
    pub space: String,
    /// d, the shape space's dimension.
    pub dimension: usize,
    /// k, control points of the time signal; 0 where nothing moves.
    pub controls: usize,
    /// l, sites of the pose signal; 0 where nothing moves.
    pub sites: usize,
    /// m, modes of the shape signal.
    pub modes: usize,
    /// Frames per second, where known.
    pub fps: Option<f64>,
    /// Errors at the frames.
    pub error: Errors,
    /// Errors between frames; none where it was not asked for, or there are fewer than 5 frames.
    pub left_out: Option<LeftOut>,
    /// The layout's stress, relative: the root of (6) over sum ||x_i - x_j||^2.
    pub stress: f64,
    /// What should be known, one sentence each.
    pub warnings: Vec<String>,
    /// How it was fitted: "ch12" or "ordered".
    pub method: String,
    /// Exponent of the time signal's parametrisation.
    pub alpha: f64,
    /// Positions that differ from the one before: the n of k/n and l/n.
    pub distinct: usize,
    /// k/n, l/n, m/n: how complicated, how little repetitive, how rich in shapes the motion is (CH12 §3.4).
    pub share: Share,
    /// Modes of the capture that are not rounding.
    pub rank: usize,
    /// How the layout ended.
    pub layout: LayoutReport,
    /// Positions so close that they are one site, and what that costs.
    pub merged: Merged,
    /// How the ordered method found it.
    pub ordered: Option<Ordered>,
    /// Where the motion between frames still goes astray, and what would mend it; the worst first.
    pub spans: Vec<Span>,
}

/// Relative errors at the frames: sqrt(sum ||.||^2) / sqrt(sum ||z_i - mean||^2).
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct Errors {
    /// ||z_i - h(x_i)||, by the modes left out.
    pub shape: f64,
    /// ||x_i - g(p_i)||, by the sites left out.
    pub pose: f64,
    /// |p_i - f(i)|, by the control points left out, relative to the spread of the positions.
    pub time: f64,
    /// ||z_i - psi(i)||.
    pub total: f64,
    /// The same in vertex positions, which all shape spaces share; none where it was not measured. In
    /// `vertices` it is the total.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub positions: Option<f64>,
}

/// Relative errors at left-out frames of fits to every second frame.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct LeftOut {
    /// Of this kind of fit, with the same k/n, l/n, m.
    pub psi: f64,
    /// Of linear blending.
    pub linear: f64,
    /// Of a cubic spline in every coordinate.
    pub cubic: f64,
}

/// Numbers kept per frame.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct Share {
    /// k/n.
    pub controls: f64,
    /// l/n.
    pub sites: f64,
    /// m/n.
    pub modes: f64,
}

/// How a layout ended.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct LayoutReport {
    /// Guttman transforms.
    pub steps: usize,
    /// Whether the stress stood still within the steps allowed.
    pub converged: bool,
    /// Frames whose position is held by a pin.
    pub pinned: usize,
}

/// Positions closer than 1e-4 of the layout's diameter share a site.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct Merged {
    /// Frames that share another's site.
    pub frames: usize,
    /// Largest error that this makes, relative like the errors: what exactness can reach.
    pub error: f64,
}

/// The ordered method's choice of a layout, and how right it is between frames.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct Ordered {
    /// How near returning poses must be to be joined, in root mean square distances.
    pub tau: f64,
    /// From 1 (distances along the motion) to 0 (plain distances).
    pub theta: f64,
    /// Root mean square radius of the unpinned layout, in units of the shape space.
    pub radius: f64,
    /// Root mean square deviation from the cubic spline through the frames at the samples fitted,
    /// relative to the motion's spread in the shape subspace.
    pub at_samples: f64,
    /// The same between those samples.
    pub between: f64,
    /// The largest of those, in root mean square steps between frames.
    pub worst: f64,
    /// Residuals evaluated.
    pub evaluations: usize,
    /// Whether the refinement had settled before they were used up.
    pub converged: bool,
}

/// Consecutive frames between which g o f leaves the way of the frames.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct Span {
    /// First frame, from 1.
    pub first: usize,
    /// Last frame.
    pub last: usize,
    /// Largest distance from the cubic spline through the frames, in root mean square steps.
    pub deviation: f64,
    /// Largest distance from the segment between two frames, in lengths of that segment.
    pub off_segment: f64,
    /// Least Gaussian curvature of g along f, times the squared root mean square step; a saddle where it
    /// is well below 0.
    pub curvature: f64,
    /// What would mend it, the best first.
    pub mends: Vec<Mend>,
}

/// A change of the options that would mend a span.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Mend {
    /// What to change.
    pub change: Change,
    /// The span's deviation after the change over that before.
    pub left: f64,
}

/// What to change.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Change {
    /// Pin these frames: the first one away from the strand it lies among, the others where they are, so
    /// that the map does not simply move along.
    Pins(Vec<Held>),
    /// Ask for so many sites.
    Sites(usize),
}

/// A frame and its place in the map.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Held {
    /// The frame, from 1.
    pub frame: usize,
    /// The place.
    pub at: Point,
}

impl Span {
    /// One sentence: which frames, how far off, and the best remedy with what it would leave.
    pub fn advice(&self) -> String {
        let (first, last, deviation) = (self.first, self.last, self.deviation);
        let astray =
            format!("frames {first}-{last} leave their way by {deviation:.2} of a frame step");
        match self.mends.first() {
            Some(mend) => format!("{astray}; {}", mend.advice()),
            None => astray,
        }
    }
}

impl Mend {
    /// What to ask for, and how much of the deviation it would leave.
    pub fn advice(&self) -> String {
        let change = match &self.change {
            Change::Sites(sites) => format!("--sites {sites}"),
            Change::Pins(pins) => {
                let pin =
                    |pin: &Held| format!("--pin {}={:.4},{:.4}", pin.frame, pin.at[0], pin.at[1]);
                pins.iter().map(pin).collect::<Vec<_>>().join(" ")
            }
        };
        format!("`{change}` would leave {:.0} % of it", 100.0 * self.left)
    }
}

impl FitReport {
    /// What signals say about themselves, with so many frames pinned; whatever needs more is left open.
    pub fn of_signals(subspace: &Subspace, signals: &Signals, pinned: usize) -> Self {
        let n = subspace.frames;
        let distinct = ch12::distinct(&signals.layout.positions);
        let moves = distinct > 1;
        let count = |count: usize| if moves { count } else { 0 };
        let (controls, sites) = (signals.time.controls().len(), signals.pose.sites().len());
        let share = |count: usize| count as f64 / distinct as f64;
        FitReport {
            frames: n,
            controls: count(controls),
            sites: count(sites),
            modes: subspace.modes,
            error: Errors::measure(subspace, signals),
            stress: signals.layout.relative_stress,
            distinct,
            share: Share {
                controls: share(count(controls)),
                sites: share(count(sites)),
                modes: subspace.modes as f64 / n as f64,
            },
            layout: LayoutReport {
                steps: signals.layout.steps,
                converged: signals.layout.converged,
                pinned,
            },
            merged: Merged {
                frames: n - signals.distinct.min(n),
                error: subspace.relative(signals.merged),
            },
            ordered: signals.ordered,
            ..FitReport::default()
        }
    }
}

impl Errors {
    /// Measures signals at the frames of a subspace.
    pub fn measure(subspace: &Subspace, signals: &Signals) -> Self {
        let positions = &signals.layout.positions;
        let passed = passed(&signals.time);
        let pose = ch12::misfit(subspace, &signals.pose, positions, f64::INFINITY);
        let total = ch12::misfit(subspace, &signals.pose, &passed, f64::INFINITY);
        let shape = subspace.residual;
        Errors {
            shape: subspace.relative(shape),
            pose: subspace.relative(pose.sqrt()),
            time: time_error(positions, &passed),
            total: subspace.relative((shape * shape + total).sqrt()),
            positions: None,
        }
    }
}

impl From<&LeftOutFit> for LeftOut {
    fn from(fit: &LeftOutFit) -> Self {
        LeftOut {
            psi: fit.psi,
            linear: fit.linear,
            cubic: fit.cubic,
        }
    }
}

/// sqrt(sum |p_i - f(i)|^2) relative to the positions' spread about their mean; 0 where that is 0.
fn time_error(positions: &[Point], passed: &[Point]) -> f64 {
    let n = positions.len() as f64;
    let mean: Point = [0, 1].map(|axis| positions.iter().map(|p| p[axis]).sum::<f64>() / n);
    let square = |p: &Point, q: &Point| (p[0] - q[0]).powi(2) + (p[1] - q[1]).powi(2);
    let spread: f64 = positions.iter().map(|p| square(p, &mean)).sum();
    let miss: f64 = positions
        .iter()
        .zip(passed)
        .map(|(p, q)| square(p, q))
        .sum();
    if spread > 0.0 {
        (miss / spread).sqrt()
    } else {
        0.0
    }
}
