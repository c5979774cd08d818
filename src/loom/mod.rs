//! psi = h o g o f: a shape space and three signals, fitted, measured, evaluated at any time.

pub mod ch12;
pub mod fidelity;
pub mod file;
pub mod fit;
pub mod fitted;
pub mod frames;
pub mod left_out;
pub mod ordered;
pub mod pins;
pub mod pose_map;
pub mod position_error;
mod reach;
pub mod report;
pub mod session;
pub mod subspace;
pub mod warnings;

use std::fmt;
use std::sync::Arc;

use nalgebra::{Isometry3, Matrix3, Vector3};

use crate::diag::{Diagnostic, Result};
use crate::math::b_spline::Point;
use crate::mesh::Topology;
use crate::signal::pose::PoseSignal;
use crate::signal::root::RootSignal;
use crate::signal::shape::ShapeSignal;
use crate::signal::time::TimeSignal;
use crate::space::ShapeSpace;

pub use report::{Errors, FitReport, LeftOut};

/// Coordinates evaluated at a time: they stay in the cache between the shape signal, the root motion and
/// the store. A multiple of 3.
const BLOCK: usize = 3072;

/// What the signals were fitted to: the frames' places in pose space and in the shape subspace. Edits of
/// time leave it alone.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Layout {
    /// p_i, n points.
    pub positions: Vec<Point>,
    /// x_i, n rows of m.
    pub coordinates: Vec<f64>,
    /// ||z_i - h(x_i)||, n numbers: what the shape signal leaves out of each frame.
    pub residuals: Vec<f64>,
    /// Frames (from 0) that were put where they are.
    pub pins: Vec<(usize, Point)>,
}

/// The parts of a loom. Looms that share parts share their memory.
#[derive(Clone)]
pub struct Parts {
    /// Faces, and what is carried along.
    pub topology: Arc<Topology>,
    /// Frames per second, where it is known.
    pub fps: Option<f64>,
    /// The shape space S, of dimension d.
    pub space: Arc<dyn ShapeSpace>,
    /// h, from R^m to S.
    pub shape: Arc<ShapeSignal>,
    /// g, from R^2 to R^m.
    pub pose: Arc<PoseSignal>,
    /// f, from time to R^2.
    pub time: Arc<TimeSignal>,
    /// Root motion, on the time of f before its changes of time.
    pub root: Option<Arc<RootSignal>>,
    /// What the signals were fitted to.
    pub layout: Arc<Layout>,
    /// What the fit said about itself.
    pub report: Arc<FitReport>,
}

/// psi = h o g o f. Immutable; edits make new looms that share what they do not change.
#[derive(Clone)]
pub struct Loom {
    parts: Parts,
}

/// Sizes, not numbers.
impl fmt::Debug for Loom {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Loom")
            .field("frames", &self.frames())
            .field("controls", &self.parts.time.controls().len())
            .field("sites", &self.parts.pose.sites().len())
            .field("modes", &self.parts.shape.modes())
            .field("space", &self.parts.space.name())
            .finish_non_exhaustive()
    }
}

/// Memory for evaluating one frame after another.
#[derive(Debug, Clone, Default)]
pub struct Scratch {
    x: Vec<f64>,
    z: Vec<f64>,
    positions: Vec<f64>,
}

impl Loom {
    /// A loom of its parts.
    ///
    /// # Errors
    /// Parts that do not fit each other: dimensions of space, h and g; frames of root
    /// and time; a layout with other counts; a frame rate that is not positive.
    pub fn new(parts: Parts) -> Result<Self> {
        let (d, m) = (parts.shape.dimension(), parts.shape.modes());
        let layout = &parts.layout;
        let n = layout.positions.len();
        let pinned = layout.pins.iter().all(|(frame, _)| *frame < n);
        let placed = parts.pose.site_frames().iter().all(|frame| *frame < n);
        let checks = [
            (
                parts.space.dimension() == d,
                "the shape signal is not of the shape space",
            ),
            (
                parts.pose.modes() == m,
                "the pose signal is not of the shape subspace",
            ),
            (
                layout.coordinates.len() == n * m && layout.residuals.len() == n && pinned,
                "the layout has other counts",
            ),
            (
                placed,
                "a site of the pose signal is at a frame that does not exist",
            ),
            (
                parts
                    .root
                    .as_ref()
                    .is_none_or(|r| r.frames().len() == parts.time.places().len()),
                "the root motion has another number of frames than the time signal",
            ),
            (
                parts.fps.is_none_or(|fps| fps > 0.0 && fps.is_finite()),
                "the frame rate is not a positive number",
            ),
        ];
        match checks.iter().find(|(holds, _)| !holds) {
            Some((_, fault)) => Diagnostic::error(*fault).err(),
            None => Ok(Loom { parts }),
        }
    }

    /// The parts, for making another loom of.
    pub fn parts(&self) -> Parts {
        self.parts.clone()
    }

    /// Faces, and what is carried along.
    pub fn topology(&self) -> &Arc<Topology> {
        &self.parts.topology
    }

    /// Frames per second, where it is known.
    pub fn fps(&self) -> Option<f64> {
        self.parts.fps
    }

    /// The shape space.
    pub fn space(&self) -> &Arc<dyn ShapeSpace> {
        &self.parts.space
    }

    /// h.
    pub fn shape(&self) -> &Arc<ShapeSignal> {
        &self.parts.shape
    }

    /// g.
    pub fn pose(&self) -> &Arc<PoseSignal> {
        &self.parts.pose
    }

    /// f.
    pub fn time(&self) -> &Arc<TimeSignal> {
        &self.parts.time
    }

    /// Root motion.
    pub fn root(&self) -> Option<&Arc<RootSignal>> {
        self.parts.root.as_ref()
    }

    /// What the signals were fitted to.
    pub fn layout(&self) -> &Arc<Layout> {
        &self.parts.layout
    }

    /// What the fit said about itself.
    pub fn report(&self) -> &Arc<FitReport> {
        &self.parts.report
    }

    /// ||z_i - psi(i)|| of each frame that was fitted, over the root mean square distance of the frames from
    /// their mean: the root mean square of these is the report's total error. Nothing where the time was
    /// edited so that its frames are others, and zeros where nothing moves.
    pub fn frame_errors(&self) -> Vec<f64> {
        let Parts {
            time, pose, layout, ..
        } = &self.parts;
        let (n, m) = (layout.positions.len(), self.parts.shape.modes());
        if n == 0 || time.places().len() != n || !time.warps().is_empty() {
            return Vec::new();
        }
        let square = |values: &[f64]| values.iter().map(|x| x * x).sum::<f64>();
        let spread = square(&layout.coordinates) + square(&layout.residuals);
        let mut x = vec![0.0; m];
        let mut error = |frame: usize| -> Option<f64> {
            pose.evaluate(time.at((frame + 1) as f64)?, &mut x);
            let target = &layout.coordinates[frame * m..(frame + 1) * m];
            x.iter_mut()
                .zip(target)
                .for_each(|(x, target)| *x -= target);
            let outside = layout.residuals[frame] * layout.residuals[frame];
            let missed = (square(&x) + outside) * n as f64;
            Some(if spread > 0.0 {
                (missed / spread).sqrt()
            } else {
                0.0
            })
        };
        (0..n).filter_map(&mut error).collect()
    }

    /// n: time runs over \[1, n\].
    pub fn frames(&self) -> usize {
        self.parts.time.frames()
    }

    /// The loom with another time signal over the same frames of root motion.
    ///
    /// # Errors
    /// There is root motion, and it has another number of frames.
    pub fn with_time(&self, time: TimeSignal) -> Result<Self> {
        Loom::new(Parts {
            time: Arc::new(time),
            ..self.parts()
        })
    }

    /// The loom with another pose signal.
    ///
    /// # Errors
    /// It is not of the shape subspace.
    pub fn with_pose(&self, pose: PoseSignal) -> Result<Self> {
        Loom::new(Parts {
            pose: Arc::new(pose),
            ..self.parts()
        })
    }

    /// The loom at another frame rate.
    ///
    /// # Errors
    /// The rate is not a positive number.
    pub fn with_fps(&self, fps: Option<f64>) -> Result<Self> {
        Loom::new(Parts {
            fps,
            ..self.parts()
        })
    }

    /// f(t), the place in pose space.
    ///
    /// # Errors
    /// `t` lies outside \[1, n\].
    pub fn position_at(&self, t: f64) -> Result<Point> {
        self.parts.time.at(t).ok_or_else(|| self.outside(t))
    }

    /// g(f(t)), m coordinates in the shape subspace.
    ///
    /// # Errors
    /// `t` lies outside \[1, n\].
    pub fn coordinates_at(&self, t: f64) -> Result<Vec<f64>> {
        let mut x = vec![0.0; self.parts.shape.modes()];
        self.parts.pose.evaluate(self.position_at(t)?, &mut x);
        Ok(x)
    }

    /// h(g(f(t))), d coordinates in the shape space.
    ///
    /// # Errors
    /// `t` lies outside \[1, n\].
    pub fn shape_at(&self, t: f64) -> Result<Vec<f64>> {
        let x = self.coordinates_at(t)?;
        let mut z = vec![0.0; self.parts.shape.dimension()];
        self.parts.shape.evaluate(&x, &mut z);
        Ok(z)
    }

    /// The rigid motion at `t` that was split off; the identity where none was.
    ///
    /// # Errors
    /// `t` lies outside \[1, n\].
    pub fn root_at(&self, t: f64) -> Result<Isometry3<f64>> {
        let (source, _) = self
            .parts
            .time
            .source_time(t)
            .ok_or_else(|| self.outside(t))?;
        Ok(self
            .parts
            .root
            .as_ref()
            .map_or_else(Isometry3::identity, |root| root.at(source)))
    }

    /// psi(t): 3V coordinates.
    ///
    /// # Errors
    /// `t` lies outside \[1, n\].
    pub fn at(&self, t: f64) -> Result<Vec<f32>> {
        let mut positions = vec![0.0; 3 * self.parts.topology.vertices()];
        self.evaluate(t, &mut Scratch::default(), &mut positions)?;
        Ok(positions)
    }

    /// Writes psi(t), 3V coordinates, to `positions`.
    ///
    /// # Errors
    /// `t` lies outside \[1, n\]; a coordinate is beyond single precision.
    ///
    /// # Panics
    /// `positions` is not 3V long.
    pub fn evaluate(&self, t: f64, scratch: &mut Scratch, positions: &mut [f32]) -> Result<()> {
        let p = self.position_at(t)?;
        let motion = match &self.parts.root {
            Some(_) => Some(self.root_at(t)?),
            None => None,
        };
        match self.decode(p, motion, scratch, positions) {
            true => Ok(()),
            false => Err(beyond(&format!("time {t}"))),
        }
    }

    /// The shape at a point of the map, g of it decoded, without root motion: 3V coordinates.
    ///
    /// # Errors
    /// `p` is not finite; a coordinate is beyond single precision.
    pub fn pose_at(&self, p: Point) -> Result<Vec<f32>> {
        if !(p[0].is_finite() && p[1].is_finite()) {
            return Diagnostic::error("the point of the map is not finite").err();
        }
        let mut positions = vec![0.0; 3 * self.parts.topology.vertices()];
        match self.decode(p, None, &mut Scratch::default(), &mut positions) {
            true => Ok(positions),
            false => Err(beyond(&format!("({}, {})", p[0], p[1]))),
        }
    }

    /// psi'(t), 3V numbers, coordinates per frame. Analytic through rho, f~, g, h and the root motion;
    /// where the space is not linear, a central difference along the shape's own change takes it through
    /// the decoding.
    ///
    /// # Errors
    /// `t` lies outside \[1, n\].
    pub fn velocity(&self, t: f64) -> Result<Vec<f64>> {
        let Parts {
            time, pose, shape, ..
        } = &self.parts;
        let (p, v) = time
            .at(t)
            .zip(time.velocity(t))
            .ok_or_else(|| self.outside(t))?;
        let (mut x, mut dx) = (vec![0.0; shape.modes()], vec![0.0; shape.modes()]);
        pose.evaluate(p, &mut x);
        pose.along(p, v, &mut dx);
        let (mut z, mut dz) = (vec![0.0; shape.dimension()], vec![0.0; shape.dimension()]);
        shape.evaluate(&x, &mut z);
        shape.direction(&dx, &mut dz);
        let (positions, mut velocity) = self.decode_with_change(&z, &dz);
        let source = time.source_time(t);
        if let (Some(root), Some((source, rate))) = (&self.parts.root, source) {
            let frame = root.frame_at(source);
            let turn = frame.rotation.to_rotation_matrix();
            for (p, v) in positions.chunks_exact(3).zip(velocity.chunks_exact_mut(3)) {
                let arm = Vector3::from_column_slice(p) - root.pivot();
                let turned = frame.spin.cross(&arm) * rate + Vector3::from_column_slice(v);
                v.copy_from_slice((turn * turned + frame.slope * rate).as_slice());
            }
        }
        Ok(velocity)
    }

    /// Positions of coordinates `z` and how they change with `dz`.
    fn decode_with_change(&self, z: &[f64], dz: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let space = &self.parts.space;
        if space.is_identity() {
            return (z.to_vec(), dz.to_vec());
        }
        let norm = |v: &[f64]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
        let decoded = |step: f64| {
            let moved: Vec<f64> = z.iter().zip(dz).map(|(z, dz)| z + step * dz).collect();
            let mut positions = vec![0.0; 3 * self.parts.topology.vertices()];
            space.decode(&moved, &mut positions);
            positions
        };
        let speed = norm(dz);
        if speed == 0.0 {
            let positions = decoded(0.0);
            let still = vec![0.0; positions.len()];
            return (positions, still);
        }
        // Half the digits: truncation h^2 and rounding 1e-16 / h are about equal at 1e-5.
        let h = 1e-5 * norm(z).max(speed) / speed;
        let (before, after) = (decoded(-h), decoded(h));
        let change = before.iter().zip(&after).map(|(a, b)| (b - a) / (2.0 * h));
        (decoded(0.0), change.collect())
    }

    /// Writes the shape at `p`, moved by `motion`, and says whether it is finite.
    fn decode(
        &self,
        p: Point,
        motion: Option<Isometry3<f64>>,
        scratch: &mut Scratch,
        positions: &mut [f32],
    ) -> bool {
        let Parts {
            space, pose, shape, ..
        } = &self.parts;
        let motion = motion.map(Motion::new);
        scratch.x.resize(shape.modes(), 0.0);
        pose.evaluate(p, &mut scratch.x);
        if space.is_identity() {
            scratch.z.resize(BLOCK, 0.0);
            let mut finite = true;
            for (block, out) in positions.chunks_mut(BLOCK).enumerate() {
                let z = &mut scratch.z[..out.len()];
                shape.evaluate_from(block * BLOCK, &scratch.x, z);
                finite &= store(z, motion.as_ref(), out);
            }
            return finite;
        }
        scratch.z.resize(shape.dimension(), 0.0);
        scratch.positions.resize(positions.len(), 0.0);
        shape.evaluate(&scratch.x, &mut scratch.z);
        space.decode(&scratch.z, &mut scratch.positions);
        store(&mut scratch.positions, motion.as_ref(), positions)
    }

    fn outside(&self, t: f64) -> Box<Diagnostic> {
        let n = self.frames();
        let error = Diagnostic::error(format!("time {t} lies outside [1, {n}]"));
        Box::new(error.hint("frames are counted from 1; `extend` continues a loom past its end"))
    }
}

/// A rigid motion as the nine numbers that positions are multiplied with.
struct Motion {
    turn: Matrix3<f64>,
    shift: Vector3<f64>,
}

impl Motion {
    fn new(motion: Isometry3<f64>) -> Self {
        Motion {
            turn: motion.rotation.to_rotation_matrix().into_inner(),
            shift: motion.translation.vector,
        }
    }
}

/// Moves positions and rounds them to single precision; whether all are finite there.
fn store(z: &mut [f64], motion: Option<&Motion>, out: &mut [f32]) -> bool {
    if let Some(Motion { turn, shift }) = motion {
        for p in z.chunks_exact_mut(3) {
            let moved = turn * Vector3::new(p[0], p[1], p[2]) + shift;
            p.copy_from_slice(moved.as_slice());
        }
    }
    let mut finite = true;
    for (out, z) in out.iter_mut().zip(z) {
        *out = *z as f32;
        finite &= out.is_finite();
    }
    finite
}

fn beyond(at: &str) -> Box<Diagnostic> {
    let error = Diagnostic::error(format!(
        "the shape at {at} is too large for single precision"
    ));
    Box::new(error.hint("an edit or an extension has taken the motion very far out"))
}

#[cfg(test)]
pub(crate) mod test_looms;
#[cfg(test)]
mod tests;
