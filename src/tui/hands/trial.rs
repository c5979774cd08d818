//! What is in hand, shown before it is written: the last good result with the gesture applied, fast
//! enough to follow the hand.

use std::sync::Arc;

use crate::diag::Result;
use crate::edit::Edit;
use crate::loom::Loom;
use crate::loom::session::Session;
use crate::pipeline::KeyControls;
use crate::signal::time::TimeSignal;
use crate::task::Task;
use crate::tui::posed::KeyScene;
use crate::tui::stage;
use crate::tui::state::{Content, Same, Scene};

/// A preview that is wanted.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::tui) struct Try {
    pub(in crate::tui) number: u64,
    /// What it is done to.
    pub(in crate::tui) base: Base,
    pub(in crate::tui) what: What,
}

/// What something is done to.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::tui) enum Base {
    /// A loom.
    Loom(Scene<Loom>),
    /// A motion through key poses.
    Keys(KeyScene),
}

/// What is done.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::tui) enum What {
    /// An edit.
    Edit(Edit),
    /// A retime in place of the one that the loom ends in.
    RetimeAgain(Vec<[f64; 2]>),
    /// A frame (from 0) held at a place of the map.
    Pin(usize, [f64; 2]),
    /// Other times and handles of key poses.
    Keys(KeyControls),
}

/// Previews, and the session of the pin that is being dragged.
#[derive(Default)]
pub(super) struct Trials {
    session: Option<(Same<Loom>, Session)>,
}

impl Trials {
    /// The base after what is done to it.
    ///
    /// # Errors
    /// Those of the edit.
    pub(super) fn show(&mut self, question: Try) -> Result<Content> {
        let (base, what) = match (question.base, question.what) {
            (Base::Keys(keys), What::Keys(controls)) => {
                return keys.with(&controls, &Task::default());
            }
            (Base::Keys(keys), _) => return Ok(Content::Keys(keys)),
            (Base::Loom(base), what) => (base, what),
        };
        let loom = &*base.of.0;
        let shown = match &what {
            What::Edit(edit) => edit.apply(loom)?.output,
            What::RetimeAgain(keys) => {
                let keys = keys.clone();
                Edit::Retime { keys }
                    .apply(&without_last_warp(loom)?)?
                    .output
            }
            What::Pin(frame, to) => self.pinned(&base.of, *frame, *to)?,
            What::Keys(_) => loom.clone(),
        };
        Ok(stage::loom_within(Arc::new(shown), base.bounds))
    }

    fn pinned(&mut self, base: &Same<Loom>, frame: usize, to: [f64; 2]) -> Result<Loom> {
        let mut session = match self.session.take() {
            Some((of, session)) if of == *base => session,
            _ => Session::of(&base.0)?,
        };
        let signals = session.drag(frame, to, &Task::default())?;
        let loom = session.loom(&base.0, signals);
        self.session = Some((base.clone(), session));
        loom
    }
}

/// The loom before its last retime.
fn without_last_warp(loom: &Loom) -> Result<Loom> {
    let time = loom.time();
    let Some((_, earlier)) = time.warps().split_last() else {
        return Ok(loom.clone());
    };
    let (curve, places) = (time.curve().clone(), time.places().to_vec());
    match TimeSignal::new(curve, places, time.slopes().to_vec(), earlier.to_vec()) {
        Ok(time) => loom.with_time(time),
        // What stood with one warp more stands without it.
        Err(_) => Ok(loom.clone()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::loom::test_looms::ring;
    use crate::mesh::Bounds;

    fn tried(loom: &Loom, what: What) -> Arc<Loom> {
        let base = Scene {
            of: Same::new(loom.clone()),
            bounds: Bounds {
                min: [0.0; 3],
                max: [1.0; 3],
            },
        };
        let question = Try {
            number: 1,
            base: Base::Loom(base),
            what,
        };
        match Trials::default().show(question).unwrap() {
            Content::Loom(scene, _) => scene.of.0,
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn a_preview_is_what_the_edit_gives() {
        let loom = ring(20, 15, false);
        let edit = Edit::MoveControl {
            control: 4,
            to: [0.5, 0.25],
        };
        let shown = tried(&loom, What::Edit(edit.clone()));
        assert_eq!(shown.time(), edit.apply(&loom).unwrap().output.time());
    }

    #[test]
    fn retiming_again_replaces_the_last_retime() {
        let loom = ring(20, 15, false);
        let retimed = |keys: &[[f64; 2]]| {
            let keys = keys.to_vec();
            Edit::Retime { keys }.apply(&loom).unwrap().output
        };
        let once = retimed(&[[1.0, 1.0], [9.0, 15.0]]);
        let keys = vec![[1.0, 1.0], [4.0, 9.0], [20.0, 15.0]];
        let again = tried(&once, What::RetimeAgain(keys.clone()));
        assert_eq!(again.time(), retimed(&keys).time());
    }
}
