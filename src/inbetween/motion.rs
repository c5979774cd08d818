//! A completed motion: a shape at any time.

use std::io;
use std::sync::{Arc, Mutex, PoisonError};

use serde::Serialize;

use super::drift::Drift;
use super::ghost::{Following, GhostReport};
use crate::math::key_spline::{Controls, KeySpline};
use crate::mesh::{FrameSource, Topology};
use crate::space::ShapeSpace;

/// What is known about a motion.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MotionReport {
    /// J, the number of keys.
    pub keys: usize,
    /// The shape space.
    pub space: &'static str,
    /// Its dimension: the number of splines.
    pub dimension: usize,
    /// Rotations that turn by more than 150 degrees from one key to the next.
    pub large_turns: usize,
    /// Triangles that are torn between keys ([`crate::mesh::torn`]).
    pub torn: usize,
    /// The ghost that the splines run on, if they do.
    pub ghost: Option<GhostReport>,
}

/// Shapes of one mesh by time. Evaluating takes `&self` and may be done from many threads at once.
pub struct Motion {
    topology: Arc<Topology>,
    space: Arc<dyn ShapeSpace>,
    spline: KeySpline,
    following: Option<Following>,
    drift: Option<Drift>,
    report: MotionReport,
    idle: Mutex<Vec<Scratch>>,
}

/// Memory of one evaluation.
#[derive(Default)]
struct Scratch {
    coordinates: Vec<f64>,
    ghost: Vec<f64>,
    positions: Vec<f64>,
}

impl Motion {
    pub(super) fn new(
        topology: Arc<Topology>,
        (space, spline): (Arc<dyn ShapeSpace>, KeySpline),
        following: Option<Following>,
        drift: Option<Drift>,
        report: MotionReport,
    ) -> Self {
        Motion {
            topology,
            space,
            spline,
            following,
            drift,
            report,
            idle: Mutex::default(),
        }
    }

    /// The motion through the same keys at other times and with other controls: the keys' coordinates, the
    /// space and all factors are shared. None where there is more to do: at ends with given velocities,
    /// with a drift that was split off, for times that do not rise.
    #[must_use]
    pub fn again(&self, times: &[f64], controls: Controls<'_>) -> Option<Self> {
        if self.drift.is_some() {
            return None;
        }
        let following = match &self.following {
            Some(following) => Some(following.again(times, controls)?),
            None => None,
        };
        let (space, spline) = (Arc::clone(&self.space), self.spline.again(times, controls)?);
        let (topology, report) = (Arc::clone(&self.topology), self.report.clone());
        Some(Motion::new(
            topology,
            (space, spline),
            following,
            None,
            report,
        ))
    }

    /// The connectivity.
    pub fn topology(&self) -> &Arc<Topology> {
        &self.topology
    }

    /// The space that the splines run in: that of the ghost, where there is one.
    pub fn space(&self) -> &dyn ShapeSpace {
        &*self.space
    }

    /// The splines, one a coordinate of the space.
    pub fn spline(&self) -> &KeySpline {
        &self.spline
    }

    /// What is known about it.
    pub fn report(&self) -> &MotionReport {
        &self.report
    }

    /// The time of the first key and of the last.
    pub fn ends(&self) -> [f64; 2] {
        let times = self.spline.times();
        [times[0], times[times.len() - 1]]
    }

    /// Writes the 3V positions at time `t`, in frames; any time is allowed.
    ///
    /// # Panics
    /// `positions` is not 3V long.
    pub fn evaluate(&self, t: f64, positions: &mut [f64]) {
        let mut scratch = self.lock().pop().unwrap_or_default();
        self.evaluate_in(t, &mut scratch, positions);
        self.lock().push(scratch);
    }

    /// The 3V positions at time `t`.
    pub fn at(&self, t: f64) -> Vec<f64> {
        let mut positions = vec![0.0; 3 * self.topology.vertices()];
        self.evaluate(t, &mut positions);
        positions
    }

    /// The ghost at time `t`: its connectivity and 3G positions. None for a motion without one.
    pub fn ghost_at(&self, t: f64) -> Option<(Arc<Topology>, Vec<f64>)> {
        let ghost = self.following.as_ref()?.ghost();
        let mut coordinates = vec![0.0; self.spline.width()];
        self.spline.evaluate(t, &mut coordinates);
        let mut positions = vec![0.0; 3 * ghost.vertices()];
        self.space.decode(&coordinates, &mut positions);
        if let Some(drift) = &self.drift {
            drift.apply(t, &mut positions);
        }
        Some((Arc::clone(ghost), positions))
    }

    fn evaluate_in(&self, t: f64, scratch: &mut Scratch, positions: &mut [f64]) {
        let Scratch {
            coordinates, ghost, ..
        } = scratch;
        coordinates.resize(self.spline.width(), 0.0);
        self.spline.evaluate(t, coordinates);
        match &self.following {
            None => self.space.decode(coordinates, positions),
            Some(following) => {
                ghost.resize(3 * following.ghost().vertices(), 0.0);
                self.space.decode(coordinates, ghost);
                following.place(t, ghost, positions);
            }
        }
        if let Some(drift) = &self.drift {
            drift.apply(t, positions);
        }
    }

    /// As [`Motion::evaluate`], in single precision.
    fn write(&self, t: f64, positions: &mut [f32]) {
        let mut scratch = self.lock().pop().unwrap_or_default();
        let mut wide = std::mem::take(&mut scratch.positions);
        wide.resize(positions.len(), 0.0);
        self.evaluate_in(t, &mut scratch, &mut wide);
        for (narrow, wide) in positions.iter_mut().zip(&wide) {
            *narrow = *wide as f32;
        }
        scratch.positions = wide;
        self.lock().push(scratch);
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, Vec<Scratch>> {
        self.idle.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl std::fmt::Debug for Motion {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Motion")
            .field("report", &self.report)
            .finish_non_exhaustive()
    }
}

/// A motion as the frames at chosen times. Nothing is computed before a frame is asked for, and frames
/// may be asked for from several threads.
#[derive(Debug, Clone)]
pub struct MotionFrames {
    motion: Arc<Motion>,
    times: Vec<f64>,
    fps: Option<f64>,
}

impl MotionFrames {
    /// `motion` at `times`, played at `fps`.
    pub fn new(motion: Arc<Motion>, times: Vec<f64>, fps: Option<f64>) -> Self {
        MotionFrames { motion, times, fps }
    }

    /// The motion.
    pub fn motion(&self) -> &Motion {
        &self.motion
    }

    /// The time of every frame.
    pub fn times(&self) -> &[f64] {
        &self.times
    }
}

impl FrameSource for MotionFrames {
    fn topology(&self) -> &Arc<Topology> {
        self.motion.topology()
    }

    fn frames(&self) -> usize {
        self.times.len()
    }

    fn fps(&self) -> Option<f64> {
        self.fps
    }

    fn read_frame(&self, frame: usize, positions: &mut [f32]) -> io::Result<()> {
        self.motion.write(self.times[frame], positions);
        Ok(())
    }
}
