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
    /// A frame (from 0) held at a place of the map that was laid out before the edits.
    Pin(usize, [f64; 2], Pinning),
    /// Other times and handles of key poses.
    Keys(KeyControls),
}

/// What a pin changes: the loom as it was fitted, and what was done to it since.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::tui) struct Pinning {
    pub(in crate::tui) fitted: Same<Loom>,
    pub(in crate::tui) edits: Vec<Edit>,
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
            What::Edit(edit) => edit.apply(loom, &Task::default())?.output,
            What::RetimeAgain(keys) => {
                let keys = keys.clone();
                Edit::Retime { keys }
                    .apply(&without_last_warp(loom)?, &Task::default())?
                    .output
            }
            What::Pin(frame, to, of) => self.pinned(of, *frame, *to)?,
            What::Keys(_) => loom.clone(),
        };
        Ok(stage::loom_within(Arc::new(shown), base.bounds))
    }

    /// The layout with the pin moved, and the edits done again.
    fn pinned(&mut self, of: &Pinning, frame: usize, to: [f64; 2]) -> Result<Loom> {
        let fitted = &of.fitted;
        let mut session = match self.session.take() {
            Some((known, session)) if known == *fitted => session,
            _ => Session::of(&fitted.0)?,
        };
        let signals = session.drag(frame, to, &Task::default())?;
        let loom = session.loom(&fitted.0, signals);
        self.session = Some((fitted.clone(), session));
        of.edits.iter().try_fold(loom?, |loom, edit| {
            Ok(edit.apply(&loom, &Task::default())?.output)
        })
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
    use crate::loom::fit::{FitOptions, fit};
    use crate::loom::test_looms::ring;
    use crate::mesh::{Bounds, Sequence, Topology};

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
        assert_eq!(
            shown.time(),
            edit.apply(&loom, &Task::default()).unwrap().output.time()
        );
    }

    /// A strip that bends and comes back, fitted by the method whose layout is the plain one.
    fn fitted() -> Loom {
        let vertices = 8_u32;
        let faces: Vec<[u32; 3]> = (2..vertices).map(|i| [i - 2, i - 1, i]).collect();
        let topology = Topology::from_triangles(vertices as usize, &faces).unwrap();
        let bend = |frame: usize| 0.4 * (frame as f32 * 0.6).sin();
        let lift = |frame: usize| 0.3 * (frame as f32 * 0.6).cos();
        let place = |frame: usize, i: u32| {
            let x = i as f32;
            [x, bend(frame) * x * x, lift(frame) * x]
        };
        let frames = (0..14).flat_map(|frame| (0..vertices).flat_map(move |i| place(frame, i)));
        let sequence = Sequence::new(Arc::new(topology), frames.collect(), None);
        let options = FitOptions {
            left_out: false,
            ..FitOptions::default()
        };
        let fitted = fit(&sequence, &options, &Task::default());
        fitted.unwrap().output
    }

    #[test]
    fn a_pin_is_shown_below_the_edits_of_the_recipe() {
        let fitted = fitted();
        let edit = Edit::Hold {
            time: 5.0,
            frames: 3,
        };
        let edited = edit.apply(&fitted, &Task::default()).unwrap().output;
        let at = fitted.layout().positions[6];
        let to = [1.1 * at[0] + 0.01, 1.1 * at[1]];
        let pinning = |edits: &[Edit]| Pinning {
            fitted: Same::new(fitted.clone()),
            edits: edits.to_vec(),
        };
        let bare = tried(&fitted, What::Pin(6, to, pinning(&[])));
        assert_eq!(bare.layout().pins, [(6, to)]);
        let shown = tried(
            &edited,
            What::Pin(6, to, pinning(std::slice::from_ref(&edit))),
        );
        assert_eq!(shown.frames(), fitted.frames() + 3);
        assert_eq!(shown.layout().pins, [(6, to)]);
        assert_eq!(
            shown.time(),
            edit.apply(&bare, &Task::default()).unwrap().output.time()
        );
    }

    #[test]
    fn retiming_again_replaces_the_last_retime() {
        let loom = ring(20, 15, false);
        let retimed = |keys: &[[f64; 2]]| {
            let keys = keys.to_vec();
            Edit::Retime { keys }
                .apply(&loom, &Task::default())
                .unwrap()
                .output
        };
        let once = retimed(&[[1.0, 1.0], [9.0, 15.0]]);
        let keys = vec![[1.0, 1.0], [4.0, 9.0], [20.0, 15.0]];
        let again = tried(&once, What::RetimeAgain(keys.clone()));
        assert_eq!(again.time(), retimed(&keys).time());
    }
}
