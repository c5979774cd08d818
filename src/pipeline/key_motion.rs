//! A motion through key poses as a person handles it: the keys in the plane in which they lie farthest
//! apart, the spline through them, their tangents, and the same motion with a key at another time or with
//! other tangents, at once.

use std::sync::Arc;

use super::complete::{CompleteRequest, motion};
use super::key_path::dense;
use super::key_plane::KeyPlane;
use super::tangents::Tangents;
use super::value::Frames;
use crate::diag::{Diagnostic, Result};
use crate::inbetween::{Handle, Motion};
use crate::math::cubic_spline::Ends;
use crate::math::key_spline::{Controls, KeySpline};
use crate::mesh::Topology;
use crate::plot::{MapNames, PoseSpace, TimeSignals};
use crate::task::Task;

/// A completion: what went in, and what was asked.
#[derive(Debug, Clone)]
pub struct Completion {
    /// The key poses.
    pub keys: Frames,
    /// How they were completed.
    pub request: CompleteRequest,
}

/// What a hand can change about a motion: one time and one handle a key.
#[derive(Debug, Clone, PartialEq)]
pub struct KeyControls {
    /// When each key is reached, rising.
    pub times: Vec<f64>,
    /// How it is passed.
    pub handles: Vec<Handle>,
}

/// A motion and what is needed to change it.
pub struct KeyMotion {
    completion: Completion,
    controls: KeyControls,
    motion: Motion,
    plane: Arc<KeyPlane>,
    /// The spline along all components of the plane's analysis.
    course: KeySpline,
    /// Whether that is the motion's own spline: not where a bound or given velocities shape it too.
    exact: bool,
    /// The spline in the plane, without handles.
    smooth: KeySpline,
    /// The time of each frame.
    frames: Vec<f64>,
}

/// Room for keys beyond the first and the last time, as a share of the time between.
const ROOM: f64 = 0.12;

impl KeyMotion {
    /// The motion of a completion.
    ///
    /// # Errors
    /// As [`motion`].
    pub fn new(completion: Completion, task: &Task) -> Result<Self> {
        let Completion { keys, request } = &completion;
        let controls = request.controls(&keys.value)?;
        let motion = motion(&keys.value, request, task)?.output;
        let plane = Arc::new(KeyPlane::of(&motion, task)?);
        Self::in_plane(completion, controls, motion, plane)
    }

    /// The same keys with other controls. What does not depend on those is shared, so this is as fast as a
    /// hand wherever the ends have no given velocities and no drift was split off.
    ///
    /// # Errors
    /// Times that do not rise, handles out of their range, another number of either than keys.
    pub fn with(&self, controls: &KeyControls, task: &Task) -> Result<Self> {
        let completion = Completion {
            keys: self.completion.keys.clone(),
            request: self.completion.request.with(controls),
        };
        self.after(completion, task)
    }

    /// The motion of a completion that comes after this one: what both have in common is shared.
    ///
    /// # Errors
    /// As [`motion`].
    pub fn after(&self, completion: Completion, task: &Task) -> Result<Self> {
        let (before, next) = (&self.completion, &completion);
        let same =
            before.keys.key == next.keys.key && before.request.differs_in_controls(&next.request);
        if !same {
            return Self::new(completion, task);
        }
        let controls = completion.request.controls(&completion.keys.value)?;
        let again = Controls {
            handles: &controls.handles,
            overshoot: completion.request.overshoot,
        };
        match self.motion.again(&controls.times, again) {
            Some(motion) if handles_hold(&controls.handles) => {
                Self::in_plane(completion, controls, motion, Arc::clone(&self.plane))
            }
            // It says what does not hold.
            _ => Self::new(completion, task),
        }
    }

    fn in_plane(
        completion: Completion,
        controls: KeyControls,
        motion: Motion,
        plane: Arc<KeyPlane>,
    ) -> Result<Self> {
        let request = &completion.request;
        let frames = request.times_of(&completion.keys.value)?;
        let (course, smooth) = splines(request, &controls, &motion, &plane)?;
        Ok(KeyMotion {
            exact: request.overshoot.is_none() && !request.is_hermite(),
            completion,
            controls,
            motion,
            plane,
            course,
            smooth,
            frames,
        })
    }

    /// The keys and what was asked.
    pub fn completion(&self) -> &Completion {
        &self.completion
    }

    /// Times and handles of the keys.
    pub fn controls(&self) -> &KeyControls {
        &self.controls
    }

    /// The motion.
    pub fn motion(&self) -> &Motion {
        &self.motion
    }

    /// The connectivity.
    pub fn topology(&self) -> &Arc<Topology> {
        self.motion.topology()
    }

    /// The time of each frame.
    pub fn frames(&self) -> &[f64] {
        &self.frames
    }

    /// The share of the keys' spread that the plane shows.
    pub fn share(&self) -> f64 {
        self.plane.share
    }

    /// The key (from 0) whose time is nearest.
    pub fn nearest_key(&self, time: f64) -> usize {
        nearest(&self.controls.times, time)
    }

    /// The time of a place between frames, which count from 1.
    pub fn time_at(&self, frame: f64) -> f64 {
        let last = self.frames.len() - 1;
        let before = ((frame - 1.0).max(0.0) as usize).min(last.saturating_sub(1));
        let (from, to) = (self.frames[before], self.frames[(before + 1).min(last)]);
        from + (to - from) * (frame - 1.0 - before as f64).clamp(0.0, 1.0)
    }

    /// The place between frames, from 1, that has a time; the nearest frame where frames do not rise or
    /// none is there.
    pub fn frame_at(&self, time: f64) -> f64 {
        let pair = |pair: &[f64]| pair[0] <= time && time <= pair[1] && pair[0] < pair[1];
        match self.frames.windows(2).position(pair) {
            Some(before) => {
                let (from, to) = (self.frames[before], self.frames[before + 1]);
                before as f64 + 1.0 + (time - from) / (to - from)
            }
            None => nearest(&self.frames, time) as f64 + 1.0,
        }
    }

    /// Where the motion is at a time, in the plane.
    pub fn place(&self, time: f64) -> [f64; 2] {
        self.course_at(time).0
    }

    /// The shape of a point of the plane, 3V positions; none where the splines run on a ghost, whose
    /// coordinates say nothing of the mesh between its keys.
    pub fn shape_of(&self, place: [f64; 2]) -> Option<Vec<f64>> {
        if self.motion.report().ghost.is_some() {
            return None;
        }
        let mut positions = vec![0.0; 3 * self.topology().vertices()];
        self.motion
            .space()
            .decode(&self.plane.code(place), &mut positions);
        Some(positions)
    }

    /// The tangents at a key, from 0.
    pub fn tangents(&self, key: usize) -> Tangents {
        let times = &self.controls.times;
        let last = times.len() - 1;
        let span = |from: usize| times[from + 1] - times[from];
        let periodic = self.completion.request.is_periodic();
        let before = key.checked_sub(1).or(periodic.then(|| last - 1));
        let after = (key < last).then_some(key).or(periodic.then_some(0));
        let line = |from: usize| {
            let ends = [self.plane.key(from), self.plane.key(from + 1)];
            [0, 1].map(|axis| (ends[1][axis] - ends[0][axis]) / span(from))
        };
        let mut own = [0.0; 2];
        self.smooth.derivative(times[key], &mut own);
        Tangents {
            at: self.plane.key(key),
            own,
            around: before.zip(after).map(|(b, a)| [line(b), line(a)]),
            spans: [before.map(span), after.map(span)],
        }
    }

    /// Where it is at a time, and how fast it goes, in units of the space a frame.
    fn course_at(&self, time: f64) -> ([f64; 2], f64) {
        if !self.exact {
            let spline = self.motion.spline();
            let mut numbers = vec![0.0; spline.width()];
            spline.evaluate(time, &mut numbers);
            let place = self.plane.place(&numbers);
            spline.derivative(time, &mut numbers);
            return (place, norm(&numbers));
        }
        let mut numbers = vec![0.0; self.course.width()];
        self.course.evaluate(time, &mut numbers);
        let place = [numbers[0], numbers[1]];
        self.course.derivative(time, &mut numbers);
        (place, norm(&numbers))
    }

    /// The plane as a map, its times in frames, and the course over time.
    pub fn plots(&self) -> (PoseSpace, TimeSignals) {
        let width = match self.exact {
            true => self.course.width(),
            false => self.motion.spline().width(),
        };
        let times = dense(&self.controls.times, width);
        let (curve, speed): (Vec<_>, Vec<_>) = times.iter().map(|&t| self.course_at(t)).unzip();
        let map = PoseSpace {
            times: times.iter().map(|&time| self.frame_at(time)).collect(),
            frames: self.plane.keys(),
            shown: (1..=self.controls.times.len()).collect(),
            curve: curve.clone(),
            names: MapNames::keys(),
            ..PoseSpace::default()
        };
        let [first, last] = self.motion.ends();
        let room = ROOM * (last - first);
        let signals = TimeSignals {
            times,
            position: curve,
            speed,
            knots: self.controls.times.clone(),
            window: Some([first - room, last + room]),
            ..TimeSignals::default()
        };
        (map, signals)
    }
}

impl std::fmt::Debug for KeyMotion {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("KeyMotion")
            .field("controls", &self.controls)
            .finish_non_exhaustive()
    }
}

/// The splines of the keys' components: all of them with the handles, the plane's without.
fn splines(
    request: &CompleteRequest,
    controls: &KeyControls,
    motion: &Motion,
    plane: &KeyPlane,
) -> Result<(KeySpline, KeySpline)> {
    let KeyControls { times, handles } = controls;
    let width = plane.width();
    let mut slopes = [vec![0.0; width], vec![0.0; width]];
    if request.is_hermite() {
        for (slope, (time, handle)) in slopes.iter_mut().zip(ends(times, handles)) {
            let mut along = vec![0.0; motion.spline().width()];
            motion.spline().derivative(time, &mut along);
            let free = 1.0 - handle.tension;
            let own = plane
                .direction(&along)
                .map(|x| if free > 0.0 { x / free } else { 0.0 });
            slope[..2].copy_from_slice(&own);
        }
    }
    let given = |width: usize| match request {
        _ if request.is_hermite() => Ends::Clamped {
            first: &slopes[0][..width],
            last: &slopes[1][..width],
        },
        _ if request.is_periodic() => Ends::Periodic,
        _ => Ends::Natural,
    };
    let (all, none) = (
        Controls {
            handles,
            overshoot: None,
        },
        Controls::default(),
    );
    let flat: Vec<f64> = plane.keys().into_iter().flatten().collect();
    let course = KeySpline::new(times, plane.rows(), width, given(width), all);
    let smooth = KeySpline::new(times, &flat, 2, given(2), none);
    let told = |_| Diagnostic::error("the keys' times do not suit a spline");
    Ok((course.map_err(told)?, smooth.map_err(told)?))
}

/// Whether all numbers lie in their range.
fn handles_hold(handles: &[Handle]) -> bool {
    let numbers = |handle: &Handle| [handle.tension, handle.continuity, handle.bias];
    let holds = |number: f64| (-1.0..=1.0).contains(&number);
    handles.iter().flat_map(numbers).all(holds)
}

/// Time and handle of the first key and of the last.
fn ends(times: &[f64], handles: &[Handle]) -> [(f64, Handle); 2] {
    let last = times.len() - 1;
    [0, last].map(|key| (times[key], handles.get(key).copied().unwrap_or_default()))
}

fn nearest(times: &[f64], time: f64) -> usize {
    let distance = |index: &usize| (times[*index] - time).abs();
    let found = (0..times.len()).min_by(|a, b| distance(a).total_cmp(&distance(b)));
    found.unwrap_or(0)
}

fn norm(numbers: &[f64]) -> f64 {
    libm::sqrt(numbers.iter().map(|x| x * x).sum())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::demo::Demo;
    use crate::pipeline::tangents::Side;
    use crate::pipeline::{Key, Keyed};
    use crate::sample::Times;

    fn cactus(request: CompleteRequest) -> KeyMotion {
        let keys = Demo::find("cactus").unwrap().generate();
        let keys = Keyed::new(keys, Key::of("cactus").finish());
        let completion = Completion { keys, request };
        KeyMotion::new(completion, &Task::default()).unwrap()
    }

    fn bent() -> CompleteRequest {
        CompleteRequest {
            times: Some(vec![0.0, 10.0, 30.0]),
            tension: vec![0.0, 0.5, 0.0],
            bias: vec![0.3],
            ..CompleteRequest::default()
        }
    }

    /// The largest difference of two shapes.
    fn apart(a: &[f64], b: &[f64]) -> f64 {
        let pairs = a.iter().zip(b);
        pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    }

    #[test]
    fn changed_by_hand_it_is_the_motion_that_the_recipe_gives() {
        let hermite = |request: CompleteRequest| {
            let keys = Demo::find("cactus").unwrap().generate();
            let keys = Keyed::new(keys, Key::of("cactus").finish());
            let velocities = crate::pipeline::Velocities {
                both: Some(keys),
                ..Default::default()
            };
            CompleteRequest {
                boundary: Some("hermite".into()),
                velocities,
                ..request
            }
        };
        let limited = |request: CompleteRequest| CompleteRequest {
            overshoot: Some(0.1),
            ..request
        };
        for of in [&|request| request, &hermite, &limited] as [&dyn Fn(_) -> CompleteRequest; 3] {
            let known = cactus(of(bent()));
            let start = cactus(of(CompleteRequest::default()));
            let found = start.with(known.controls(), &Task::default()).unwrap();
            assert_eq!(found.frames(), known.frames());
            for time in [0.0, 4.0, 17.5, 30.0] {
                assert_eq!(found.motion().at(time), known.motion().at(time));
                assert_eq!(found.place(time), known.place(time));
            }
        }
    }

    #[test]
    fn the_course_in_the_plane_is_the_spline_of_the_space_seen_there() {
        let motion = cactus(bent());
        assert!(motion.exact);
        let spline = motion.motion().spline();
        let size = norm(motion.plane.rows());
        for time in [0.0, 3.0, 10.0, 22.2, 31.0] {
            let mut code = vec![0.0; spline.width()];
            spline.evaluate(time, &mut code);
            let seen = motion.plane.place(&code);
            spline.derivative(time, &mut code);
            let (place, speed) = motion.course_at(time);
            // rounding of a principal component analysis
            assert!(apart(&place, &seen) < 1e-9 * size);
            assert!((speed - norm(&code)).abs() < 1e-9 * size);
        }
    }

    #[test]
    fn arms_are_tangents_of_the_course() {
        let motion = cactus(bent());
        let step = 1e-6;
        for (key, side) in [
            (0, Side::After),
            (1, Side::Before),
            (1, Side::After),
            (2, Side::Before),
        ] {
            let sign = if side == Side::Before { -1.0 } else { 1.0 };
            let (time, handle) = (motion.controls().times[key], motion.controls().handles[key]);
            let tangents = motion.tangents(key);
            let arm = tangents.arm(handle, side).unwrap();
            let third = tangents.spans[side as usize].unwrap() / 3.0;
            let ahead = motion.place(time + sign * step);
            for axis in [0, 1] {
                let slope = sign * (ahead[axis] - tangents.at[axis]) / step;
                let known = sign * (arm[axis] - tangents.at[axis]) / third;
                // second derivatives below 1 times the step
                assert!(
                    (slope - known).abs() < 1e-4 * (1.0 + known.abs()),
                    "{key} {side:?}"
                );
            }
        }
        assert_eq!(
            motion.tangents(0).arm(Handle::default(), Side::Before),
            None
        );
    }

    #[test]
    fn frames_and_times_are_told_from_each_other() {
        let motion = cactus(bent());
        for (frame, time) in [(1.0, 0.0), (2.5, 1.5), (31.0, 30.0)] {
            assert_eq!(
                (motion.time_at(frame), motion.frame_at(time)),
                (time, frame)
            );
        }
        assert_eq!([motion.frame_at(-3.0), motion.frame_at(99.0)], [1.0, 31.0]);
        let listed = cactus(CompleteRequest {
            at: Times::List(vec![25.0, 1.0, 49.0]),
            ..CompleteRequest::default()
        });
        assert_eq!(listed.time_at(1.5), 13.0);
        assert_eq!([listed.frame_at(13.0), listed.frame_at(1.0)], [2.25, 2.0]);
        let one = cactus(CompleteRequest {
            at: Times::List(vec![7.0]),
            ..CompleteRequest::default()
        });
        assert_eq!((one.time_at(1.0), one.frame_at(30.0)), (7.0, 1.0));
    }

    #[test]
    fn a_key_s_own_place_has_its_shape_and_a_ghost_has_none() {
        let motion = cactus(CompleteRequest::default());
        let keys = &motion.completion().keys.value;
        let shape = motion.shape_of(motion.plane.key(1)).unwrap();
        let known: Vec<f64> = keys.frame(1).iter().map(|&x| f64::from(x)).collect();
        // three keys lie in a plane; f32 positions of a cactus about a metre high
        assert!(apart(&shape, &known) < 1e-5);
        let ghost = cactus(CompleteRequest {
            ghost: Some("500".into()),
            ..CompleteRequest::default()
        });
        assert_eq!(ghost.shape_of([0.0; 2]), None);
        let moved = KeyControls {
            times: vec![1.0, 9.0, 20.0],
            ..ghost.controls().clone()
        };
        let known = CompleteRequest {
            times: Some(moved.times.clone()),
            ..ghost.completion().request.clone()
        };
        let found = ghost.with(&moved, &Task::default()).unwrap();
        assert_eq!(found.motion().at(5.0), cactus(known).motion().at(5.0));
    }

    #[test]
    fn controls_that_suit_no_keys_are_refused() {
        let motion = cactus(CompleteRequest::default());
        let with = |times: &[f64], tension: f64| {
            let handle = Handle {
                tension,
                ..Handle::default()
            };
            let controls = KeyControls {
                times: times.to_vec(),
                handles: vec![handle; 3],
            };
            motion.with(&controls, &Task::default()).is_err()
        };
        assert!(!with(&[1.0, 2.0, 3.0], 0.0));
        assert!(with(&[1.0, 1.0, 3.0], 0.0) && with(&[1.0, 3.0], 0.0));
        assert!(with(&[1.0, 2.0, 3.0], 1.5));
    }
}
