//! Root motion: where the body is and how it is turned, split off so that a walk that travels can loop in
//! place. One rigid motion a frame, on the time of f before its changes of time.
//!
//! A frame's motion takes the shape without root motion to its place: v -> R (v - c) + q, c a fixed
//! pivot. Between frames q is a cubic with given slopes, and R the cumulative cubic of Kim, Kim & Shin
//! (1995), R_i exp(b_1 w_1) exp(b_2 w_2) exp(b_3 w_3): both C1. Only `+ - * / sqrt` and `libm` are used.

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};

use crate::math::{monotone, rotation};

/// What was split off.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RootKind {
    /// Translation over the ground and turns about the up axis.
    Ground,
    /// The whole rigid motion.
    Rigid,
}

/// One frame's root motion and how it changes there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RootFrame {
    /// R.
    pub rotation: UnitQuaternion<f64>,
    /// q, where the pivot is.
    pub position: Vector3<f64>,
    /// Angular velocity in the body's own axes, radians per frame.
    pub spin: Vector3<f64>,
    /// Velocity of q, units per frame.
    pub slope: Vector3<f64>,
}

/// Why frames are not root motion: this frame, from 0, has a number that is not finite, or there are none.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RootError {
    /// The frame.
    pub frame: usize,
}

/// Rigid motions on the time of f before its changes of time, frames counted from 1.
#[derive(Debug, Clone, PartialEq)]
pub struct RootSignal {
    kind: RootKind,
    pivot: Vector3<f64>,
    frames: Vec<RootFrame>,
}

impl RootSignal {
    /// Of frames with their velocities.
    ///
    /// # Errors
    /// No frames, or a number that is not finite.
    pub fn new(
        kind: RootKind,
        pivot: Vector3<f64>,
        frames: Vec<RootFrame>,
    ) -> Result<Self, RootError> {
        let finite = |frame: &RootFrame| {
            let vectors = [&frame.position, &frame.spin, &frame.slope];
            let rotation = frame.rotation.coords.iter().all(|x| x.is_finite());
            rotation && vectors.into_iter().flatten().all(|x| x.is_finite())
        };
        if frames.is_empty() || !pivot.iter().all(|x| x.is_finite()) {
            return Err(RootError { frame: 0 });
        }
        match frames.iter().position(|frame| !finite(frame)) {
            Some(frame) => Err(RootError { frame }),
            None => Ok(RootSignal {
                kind,
                pivot,
                frames,
            }),
        }
    }

    /// Of one motion a frame, each taking the shape without root motion (about `pivot`, the mean of the
    /// reference pose) to the frame. Velocities are central differences.
    ///
    /// # Errors
    /// No frames, or a number that is not finite.
    pub fn through(
        kind: RootKind,
        pivot: Vector3<f64>,
        motions: &[Isometry3<f64>],
    ) -> Result<Self, RootError> {
        let turns: Vec<_> = motions
            .windows(2)
            .map(|m| turn(&m[0].rotation, &m[1].rotation))
            .collect();
        let place = |m: &Isometry3<f64>| m.rotation * pivot + m.translation.vector;
        let steps: Vec<_> = motions
            .windows(2)
            .map(|m| place(&m[1]) - place(&m[0]))
            .collect();
        let frames = motions.iter().enumerate().map(|(i, motion)| RootFrame {
            rotation: motion.rotation,
            position: place(motion),
            spin: middle(&turns, i),
            slope: middle(&steps, i),
        });
        RootSignal::new(kind, pivot, frames.collect())
    }

    /// What was split off.
    pub fn kind(&self) -> RootKind {
        self.kind
    }

    /// The point of the shape that q follows.
    pub fn pivot(&self) -> Vector3<f64> {
        self.pivot
    }

    /// The frames.
    pub fn frames(&self) -> &[RootFrame] {
        &self.frames
    }

    /// The motion at time `t`, in frames from 1; kept within the frames.
    pub fn at(&self, t: f64) -> Isometry3<f64> {
        let (rotation, position, _, _) = self.state(t);
        self.motion(rotation, position)
    }

    /// The motion of frame `index`, from 0.
    ///
    /// # Panics
    /// There is no such frame.
    pub fn frame_motion(&self, index: usize) -> Isometry3<f64> {
        let frame = &self.frames[index];
        self.motion(frame.rotation, frame.position)
    }

    /// The motion from frame `from` to frame `to` (from 0), as seen in space: what one pass of a loop
    /// adds.
    ///
    /// # Panics
    /// There are no such frames.
    pub fn increment(&self, from: usize, to: usize) -> Isometry3<f64> {
        self.frame_motion(to) * self.frame_motion(from).inverse()
    }

    /// `frame` carried along by `motion`.
    pub fn carried(&self, frame: &RootFrame, motion: &Isometry3<f64>) -> RootFrame {
        RootFrame {
            rotation: motion.rotation * frame.rotation,
            position: motion.rotation * frame.position + motion.translation.vector,
            spin: frame.spin,
            slope: motion.rotation * frame.slope,
        }
    }

    /// The same kind and pivot with other frames.
    ///
    /// # Errors
    /// No frames, or a number that is not finite.
    pub fn with_frames(&self, frames: Vec<RootFrame>) -> Result<Self, RootError> {
        RootSignal::new(self.kind, self.pivot, frames)
    }

    /// Motion and velocities at time `t`, kept within the frames. A point p of the shape without root
    /// motion that moves with velocity v there moves with R (spin x (p - c) + v) + slope.
    pub fn frame_at(&self, t: f64) -> RootFrame {
        let (rotation, position, spin, slope) = self.state(t);
        RootFrame {
            rotation,
            position,
            spin,
            slope,
        }
    }

    fn motion(&self, rotation: UnitQuaternion<f64>, position: Vector3<f64>) -> Isometry3<f64> {
        Isometry3::from_parts(
            Translation3::from(position - rotation * self.pivot),
            rotation,
        )
    }

    /// Rotation, position, body angular velocity and velocity at `t`.
    fn state(
        &self,
        t: f64,
    ) -> (
        UnitQuaternion<f64>,
        Vector3<f64>,
        Vector3<f64>,
        Vector3<f64>,
    ) {
        let last = self.frames.len() - 1;
        let i = ((t - 1.0).max(0.0) as usize).min(last);
        let x = t - (i + 1) as f64;
        let a = &self.frames[i];
        if i == last || x <= 0.0 {
            return (a.rotation, a.position, a.spin, a.slope);
        }
        let b = &self.frames[i + 1];
        let (rotation, spin) = between(a, b, x);
        let axis = |k: usize| {
            let ends = [a.slope[k], b.slope[k]];
            monotone::piece(1.0, b.position[k] - a.position[k], ends, x)
        };
        let axes = [axis(0), axis(1), axis(2)];
        let position = a.position + Vector3::from(axes.map(|(y, _)| y));
        (
            rotation,
            position,
            spin,
            Vector3::from(axes.map(|(_, slope)| slope)),
        )
    }
}

/// Rotation and body angular velocity a part `x` of the way from `a` to `b`.
fn between(a: &RootFrame, b: &RootFrame, x: f64) -> (UnitQuaternion<f64>, Vector3<f64>) {
    let (first, last) = (a.spin / 3.0, b.spin / 3.0);
    let whole = a.rotation.inverse() * b.rotation;
    let middle = rotation::exp(&-first) * whole * rotation::exp(&-last);
    let second = rotation::log(&middle);
    let y = 1.0 - x;
    let weights = [1.0 - y * y * y, x * x * (3.0 - 2.0 * x), x * x * x];
    let rates = [3.0 * y * y, 6.0 * x * y, 3.0 * x * x];
    let turns = [
        rotation::exp(&(first * weights[0])),
        rotation::exp(&(second * weights[1])),
        rotation::exp(&(last * weights[2])),
    ];
    let mut spin = first * rates[0];
    for (turn, axis, rate) in [(turns[1], second, rates[1]), (turns[2], last, rates[2])] {
        spin = turn.inverse() * spin + axis * rate;
    }
    (a.rotation * turns[0] * turns[1] * turns[2], spin)
}

/// The shortest turn from one rotation to another, in the first's axes.
fn turn(from: &UnitQuaternion<f64>, to: &UnitQuaternion<f64>) -> Vector3<f64> {
    rotation::log(&(from.inverse() * to))
}

/// Mean of the steps before and after a frame; the one there is at the ends, 0 without steps.
fn middle(steps: &[Vector3<f64>], frame: usize) -> Vector3<f64> {
    let before = frame.checked_sub(1).and_then(|i| steps.get(i));
    match (before, steps.get(frame)) {
        (Some(a), Some(b)) => (a + b) * 0.5,
        (Some(one), None) | (None, Some(one)) => *one,
        (None, None) => Vector3::zeros(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn path(n: usize, at: impl Fn(f64) -> (Vector3<f64>, Vector3<f64>)) -> RootSignal {
        let pivot = Vector3::new(1.0, 2.0, -1.0);
        let motions: Vec<_> = (0..n)
            .map(|i| {
                let (w, q) = at(i as f64);
                let turn = rotation::exp(&w);
                Isometry3::from_parts(Translation3::from(q - turn * pivot), turn)
            })
            .collect();
        RootSignal::through(RootKind::Rigid, pivot, &motions).unwrap()
    }

    fn tumbling() -> RootSignal {
        path(12, |i| {
            (
                Vector3::new(0.4 * i, libm::sin(i), 0.3),
                Vector3::new(i * i * 0.1, libm::cos(i), 5.0),
            )
        })
    }

    #[test]
    fn frames_are_met_exactly() {
        let root = tumbling();
        for (i, frame) in root.frames().iter().enumerate() {
            let motion = root.at((i + 1) as f64);
            assert_eq!(motion.rotation, frame.rotation);
            // two roundings of numbers of size 10
            let place = motion * nalgebra::Point3::from(root.pivot());
            assert!((place.coords - frame.position).norm() < 1e-14);
        }
    }

    #[test]
    fn uniform_turning_and_travel_are_reproduced() {
        // many whole turns: only steps are ever taken as logarithms
        let root = path(30, |i| {
            (
                Vector3::new(0.0, 0.9 * i, 0.0),
                Vector3::new(2.0 * i, 0.0, i),
            )
        });
        for i in 0..=290 {
            let s = f64::from(i) * 0.1;
            let motion = root.at(1.0 + s);
            let expected = rotation::exp(&Vector3::new(0.0, 0.9 * s, 0.0));
            assert!(motion.rotation.angle_to(&expected) < 1e-7);
            let q = motion * nalgebra::Point3::from(root.pivot());
            assert!((q.coords - Vector3::new(2.0 * s, 0.0, s)).norm() < 1e-12);
        }
    }

    #[test]
    fn velocities_match_central_differences_and_do_not_jump() {
        let root = tumbling();
        let (point, h) = (Vector3::new(0.3, -0.7, 2.0), 1e-5);
        let at = |t: f64| root.at(t) * nalgebra::Point3::from(point);
        for i in 0..100 {
            let t = 1.05 + 0.1 * f64::from(i);
            let difference = (at(t + h) - at(t - h)) / (2.0 * h);
            let frame = root.frame_at(t);
            let turned = frame.spin.cross(&(point - root.pivot()));
            let velocity = frame.rotation * turned + frame.slope;
            assert!((difference - velocity).norm() < 1e-7 * (1.0 + velocity.norm()));
        }
        for frame in 2..12 {
            let t = f64::from(frame);
            let (before, after) = (root.frame_at(t - 1e-9), root.frame_at(t + 1e-9));
            assert!((before.spin - after.spin).norm() < 1e-6);
            assert!((before.slope - after.slope).norm() < 1e-6);
        }
    }

    #[test]
    fn an_increment_carries_one_frame_to_the_other() {
        let root = tumbling();
        let carried = root.carried(&root.frames()[3], &root.increment(3, 8));
        let target = &root.frames()[8];
        assert!(carried.rotation.angle_to(&target.rotation) < 1e-7);
        assert!((carried.position - target.position).norm() < 1e-12);
    }

    #[test]
    fn one_frame_stays_and_none_is_refused() {
        let root = path(1, |_| (Vector3::zeros(), Vector3::x()));
        assert_eq!(root.at(1.0), root.frame_motion(0));
        assert_eq!(root.frame_at(9.0), root.frames()[0]);
        assert!(RootSignal::through(RootKind::Ground, Vector3::zeros(), &[]).is_err());
    }
}
