//! Poses in a plane: key poses with the motion through them, or poses with their principal components.

use std::sync::Arc;

use super::state::{Content, Same, Scene, Signals};
use crate::diag::{Diagnostic, Result};
use crate::mesh::{Bounds, FrameSource, Sequence};
use crate::pipeline::{
    Completion, KeyControls, KeyMotion, Statistics, StatisticsRequest, statistics,
};
use crate::task::Task;

/// Frames that are no motion through keys are shown as poses up to so many, and so many numbers.
const MOST_POSES: usize = 64;
const MOST_NUMBERS: usize = 1 << 25;

/// Key poses and the motion through them.
#[derive(Debug, Clone)]
pub(super) struct KeyScene {
    pub(super) motion: Scene<KeyMotion>,
    /// Its plane, and its course over time.
    pub(super) signals: Same<Signals>,
    /// The frames that the recipe gives; none while the motion is in hand.
    pub(super) frames: Option<Scene<Sequence>>,
    /// What the keys are called; empty where they have no names.
    pub(super) names: Vec<String>,
}

impl PartialEq for KeyScene {
    fn eq(&self, other: &Self) -> bool {
        self.motion == other.motion
    }
}

/// Poses and their principal components.
#[derive(Debug, Clone)]
pub(super) struct PoseScene {
    pub(super) found: Scene<Statistics>,
    /// The plane of the first two modes.
    pub(super) signals: Same<Signals>,
    /// The poses as they are shown.
    pub(super) poses: Scene<Sequence>,
    /// What they are called; empty where they have no names.
    pub(super) names: Vec<String>,
}

impl KeyScene {
    /// The motion, in hand.
    pub(super) fn motion(&self) -> &KeyMotion {
        &self.motion.of.0
    }

    /// Frames per second, where known.
    pub(super) fn fps(&self) -> Option<f64> {
        let completion = self.motion().completion();
        completion.request.fps.or(completion.keys.fps())
    }

    /// The same keys with other controls, for as long as they are in hand.
    ///
    /// # Errors
    /// As [`KeyMotion::with`].
    pub(super) fn with(&self, controls: &KeyControls, task: &Task) -> Result<Content> {
        let motion = self.motion().with(controls, task)?;
        let (map, mut times) = motion.plots();
        // What lies under the hand stays there.
        times.window = self.signals.0.times.window;
        Ok(Content::Keys(KeyScene {
            motion: Scene {
                of: Same::new(motion),
                bounds: self.motion.bounds,
            },
            signals: Same::new(Signals { map, times }),
            frames: None,
            names: self.names.clone(),
        }))
    }
}

/// A motion through keys and the frames that it was sampled at. What `last` and it have in common is
/// shared; none for a mesh without vertices.
///
/// # Errors
/// As [`KeyMotion::new`].
pub(super) fn keys(
    completion: Completion,
    names: Vec<String>,
    frames: Sequence,
    last: &mut Option<Arc<KeyMotion>>,
    task: &Task,
) -> Result<Option<Content>> {
    let Some(bounds) = box_of(&frames)? else {
        return Ok(None);
    };
    let motion = Arc::new(match last {
        Some(last) => last.after(completion, task)?,
        None => KeyMotion::new(completion, task)?,
    });
    *last = Some(Arc::clone(&motion));
    let (map, times) = motion.plots();
    Ok(Some(Content::Keys(KeyScene {
        motion: Scene {
            of: Same(motion),
            bounds,
        },
        signals: Same::new(Signals { map, times }),
        frames: Some(Scene {
            of: Same::new(frames),
            bounds,
        }),
        names,
    })))
}

/// Poses and what was found about them; none for a mesh without vertices.
///
/// # Errors
/// None that finite poses can cause.
pub(super) fn poses(found: Arc<Statistics>, names: Vec<String>) -> Result<Option<Content>> {
    let poses = found.aligned_poses();
    shown(found, poses, names)
}

/// Frames that nothing is known about: as poses where they are few, else as a capture.
///
/// # Errors
/// A frame cannot be fetched; cancellation.
pub(super) fn frames(
    sequence: Sequence,
    names: Vec<String>,
    task: &Task,
) -> Result<Option<Content>> {
    let n = sequence.frames();
    let numbers = 3 * n * n * sequence.topology().vertices();
    if !(2..=MOST_POSES).contains(&n) || numbers > MOST_NUMBERS {
        return super::stage::frames(sequence);
    }
    let request = StatisticsRequest {
        space: "vertices".into(),
        ..StatisticsRequest::default()
    };
    let found = statistics(&sequence, &request, task)?;
    shown(Arc::new(found), sequence, names)
}

fn shown(found: Arc<Statistics>, poses: Sequence, names: Vec<String>) -> Result<Option<Content>> {
    let Some(bounds) = box_of(&poses)? else {
        return Ok(None);
    };
    let map = found.map();
    Ok(Some(Content::Poses(PoseScene {
        found: Scene {
            of: Same(found),
            bounds,
        },
        signals: Same::new(Signals {
            map,
            ..Signals::default()
        }),
        poses: Scene {
            of: Same::new(poses),
            bounds,
        },
        names,
    })))
}

fn box_of(frames: &Sequence) -> Result<Option<Bounds>> {
    Bounds::of_frames(frames)
        .map_err(|error| Diagnostic::error(format!("a frame cannot be fetched: {error}")).into())
}

#[cfg(test)]
pub(super) mod test_scenes {
    use super::*;
    use crate::mesh::Topology;
    use crate::pipeline::{CompleteRequest, Key, Keyed, complete};

    /// Shapes of one triangle whose last corner is at these places.
    pub(in crate::tui) fn shapes(places: &[[f32; 2]]) -> Sequence {
        let topology = Arc::new(Topology::from_triangles(3, &[[0, 1, 2]]).unwrap());
        let shape = |&[x, y]: &[f32; 2]| [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, x, y, 0.0];
        Sequence::new(topology, places.iter().flat_map(shape).collect(), None)
    }

    /// A motion through three such shapes.
    pub(in crate::tui) fn three_keys(times: [f64; 3], tension: Vec<f64>) -> Content {
        let keys = shapes(&[[0.0, 1.0], [2.0, 1.5], [1.0, 4.0]]);
        let request = CompleteRequest {
            times: Some(times.to_vec()),
            tension,
            ..CompleteRequest::default()
        };
        motion(keys, request)
    }

    /// A motion through these shapes, in the space of vertices.
    pub(in crate::tui) fn motion(keys: Sequence, request: CompleteRequest) -> Content {
        let request = CompleteRequest {
            space: Some("vertices".into()),
            ..request
        };
        let task = Task::default();
        let made = complete(&keys, &request, &task).unwrap().output;
        let width = 3 * keys.topology().vertices();
        let mut positions = vec![0.0; width * made.frames()];
        for (frame, shape) in positions.chunks_exact_mut(width).enumerate() {
            made.read_frame(frame, shape).unwrap();
        }
        let frames = Sequence::new(Arc::clone(keys.topology()), positions, None);
        let keys = Keyed::new(keys, Key::of("test").finish());
        let completion = Completion { keys, request };
        super::keys(completion, vec![], frames, &mut None, &task)
            .unwrap()
            .unwrap()
    }

    /// Four such shapes as poses.
    pub(in crate::tui) fn four_poses() -> Content {
        let poses = shapes(&[[0.0, 1.0], [2.0, 1.5], [1.0, 4.0], [0.2, 2.0]]);
        let names = ["one", "two", "three", "four"].map(String::from);
        frames(poses, names.to_vec(), &Task::default())
            .unwrap()
            .unwrap()
    }
}
