//! All that can wake the studio, and all it can ask for.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use ratatui::crossterm::event::{KeyEvent, MouseEvent};

use super::graphics::Choice;
use super::hands::{Errand, Reply};
use super::state::{Content, Same};
use super::thumbs::{Thumb, ThumbWish};
use super::work::{Picture, Wish};
use crate::diag::Diagnostic;

/// What happened.
#[derive(Debug)]
pub(super) enum Event {
    /// A key was pressed.
    Key(KeyEvent),
    /// The mouse was moved, pressed, let go or turned.
    Mouse(MouseEvent),
    /// The terminal has these columns and rows now.
    Resize(u16, u16),
    /// Time has passed since the last tick.
    Tick(Duration),
    /// Nothing has happened for a moment since something moved.
    Still,
    /// A worker has an answer.
    Answer(Answer),
    /// A signal asks the program to end.
    Signal,
}

/// What workers answer. Pictures carry the number of the question, so that old ones can be dropped.
#[derive(Debug)]
pub(super) enum Answer {
    /// What the terminal can show, and whether its background is dark.
    Terminal(Box<Choice>, bool),
    /// What is open: first a single frame, then the capture, then the loom.
    Opened(Box<Content>, Vec<Diagnostic>),
    /// Work goes on: the phase, steps done, and of how many (0: not known).
    Progress(&'static str, usize, usize),
    /// Opening or fitting did not succeed.
    Failed(Box<Diagnostic>),
    /// A picture for the panel of that index.
    Drawn {
        /// Index of the panel.
        panel: usize,
        /// Number of the question.
        number: u64,
        /// The picture.
        picture: Arc<Picture>,
    },
    /// Small meshes for the map, so far.
    Thumbs {
        /// Number of the question.
        number: u64,
        /// What is drawn by now.
        thumbs: Same<Vec<Thumb>>,
    },
    /// Files were written.
    Saved(PathBuf),
    /// Files could not be written.
    NotSaved(Box<Diagnostic>),
    /// What the hands had asked for.
    Hands(Reply),
}

/// What the studio asks for.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Command {
    /// A picture for the panel of that index; a question not begun yet is replaced.
    Draw {
        /// Index of the panel.
        panel: usize,
        /// Number of the question.
        number: u64,
        /// What it shows.
        wish: Wish,
    },
    /// Small meshes for the map; an older question is replaced.
    DrawThumbs(u64, ThumbWish),
    /// A picture to a PNG file of that name.
    SavePicture(String, Wish),
    /// The shown frames to files.
    Export(super::state::Span),
    /// What the hands ask for.
    Hands(Errand),
    /// Pictures are shown so from now on.
    Present(Box<Choice>),
    /// The terminal is cleared and drawn anew.
    Redraw,
    /// The program is stopped until it is called back.
    Suspend,
    /// The end.
    Quit,
}
