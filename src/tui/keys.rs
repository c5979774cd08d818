//! One table binds the keys and documents them.

use nucleo_matcher::pattern::{CaseMatching, Normalization, Pattern};
use nucleo_matcher::{Config, Matcher};
use ratatui::crossterm::event::{KeyCode, KeyEvent, KeyModifiers};

/// What a person can ask for; [`ACTIONS`] says what each does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Action {
    Back,
    Forward,
    BackFar,
    ForwardFar,
    First,
    Last,
    Play,
    Slower,
    Faster,
    MarkStart,
    MarkEnd,
    Unmark,
    Undo,
    Redo,
    AddLoop,
    Trim,
    Reverse,
    HoldStill,
    Extend,
    SlowDown,
    SpeedUp,
    Smooth,
    Exaggerate,
    Attenuate,
    TakeMoment,
    TakeControl,
    NextControl,
    PreviousControl,
    InsertControl,
    TakePin,
    Unpin,
    Sketch,
    KeepPose,
    MakeLoom,
    MakeMotion,
    MakeStatistics,
    EditRecipe,
    TakeUp,
    Forget,
    NextPanel,
    PreviousPanel,
    Enlarge,
    ViewLeft,
    ViewRight,
    ViewUp,
    ViewDown,
    CloserIn,
    FartherOut,
    ShowAll,
    Roam,
    Wires,
    Onion,
    Thumbs,
    Errors,
    Before,
    SavePicture,
    Export,
    Help,
    Palette,
    Redraw,
    Suspend,
    Leave,
    Quit,
}

/// One line of the table.
#[derive(Debug, Clone, Copy)]
pub(super) struct Binding {
    /// What it does.
    pub(super) action: Action,
    /// Keys, as [`named`] writes them.
    pub(super) keys: &'static [&'static str],
    /// What it does, in words.
    pub(super) about: &'static str,
}

macro_rules! actions {
    ($($action:ident [$($key:literal),+] $about:literal,)*) => {
        /// Every action, its keys, and what it does, in the order of the help.
        pub(super) const ACTIONS: &[Binding] = &[
            $(Binding { action: Action::$action, keys: &[$($key),+], about: $about },)*
        ];
    };
}

actions! {
    Back ["left"] "a frame back; roaming: to the left",
    Forward ["right"] "a frame on; roaming: to the right",
    BackFar ["shift-left", "down"] "ten frames back; roaming: down",
    ForwardFar ["shift-right", "up"] "ten frames on; roaming: up",
    First ["home", "g"] "to the first frame",
    Last ["end", "G"] "to the last frame",
    Play ["space"] "play, or stop",
    Slower ["<"] "half the speed, down to 0.1x",
    Faster [">"] "twice the speed, up to 8x",
    MarkStart ["["] "the loop begins here",
    MarkEnd ["]"] "the loop ends here",
    Unmark ["backspace"] "forget the loop's marks",
    Undo ["u"] "undo; put back what is in hand",
    Redo ["ctrl-r"] "redo",
    AddLoop ["a"] "play what is between the marks once more (add_loop)",
    Trim ["T"] "keep what is between the marks (trim)",
    Reverse ["R"] "run backwards (reverse)",
    HoldStill ["H"] "stay here for five frames more (hold)",
    Extend ["X"] "ten frames more at the end (extend)",
    SlowDown ["{"] "the stretch between the marks, or all, slower (speed)",
    SpeedUp ["}"] "the same faster",
    Smooth ["S"] "the same straighter on the map (smooth)",
    Exaggerate [")"] "larger than life (exaggerate)",
    Attenuate ["("] "smaller than life",
    TakeMoment ["t"] "take this moment (retime) or key: arrows, enter",
    TakeControl ["d"] "take a control point, or a key's arms: arrows, enter",
    NextControl ["n"] "the next control point, or key",
    PreviousControl ["N"] "the one before",
    InsertControl ["v"] "a control point more, here (insert_control)",
    TakePin ["i"] "take this frame on the map: arrows, enter (pin)",
    Unpin ["I"] "let this frame's pin go",
    Sketch ["s"] "sketch a curve: mouse, or arrows, space, enter (path)",
    KeepPose ["K"] "keep the shape at the cursor as a pose (add_pose)",
    MakeLoom ["F"] "a loom of these frames (fit)",
    MakeMotion ["C"] "a motion through these poses (complete)",
    MakeStatistics ["A"] "these poses by their principal components (pca)",
    EditRecipe ["e"] "the recipe in your editor ($VISUAL, $EDITOR)",
    TakeUp ["y"] "take up the gestures of a lost session",
    Forget ["Y"] "forget them",
    NextPanel ["tab"] "next panel",
    PreviousPanel ["shift-tab"] "panel before",
    Enlarge ["f", "enter"] "the panel fills the screen, or no longer",
    ViewLeft ["h"] "move the panel's view, or turn the mesh, to the left",
    ViewRight ["l"] "the same to the right",
    ViewUp ["k"] "the same up",
    ViewDown ["j"] "the same down",
    CloserIn ["+", "="] "closer",
    FartherOut ["-"] "farther",
    ShowAll ["0"] "show everything",
    Roam ["c"] "the cursor leaves the curve, or returns to it",
    Wires ["w"] "edges of the mesh",
    Onion ["o"] "onion skin: the frames before and after",
    Thumbs ["m"] "small meshes behind the map",
    Errors ["E"] "the mesh by its distance from the capture, as colour",
    Before ["b"] "the capture, or the loom as opened, beside the mesh",
    SavePicture ["P"] "the panel to a PNG file",
    Export ["x"] "the frames between the marks (or all) to files",
    Help ["?"] "these keys",
    Palette [":"] "find an action by its words",
    Redraw ["ctrl-l"] "draw the screen anew",
    Suspend ["ctrl-z"] "back to the shell; fg returns",
    Leave ["esc"] "close what is in front; back to the curve",
    Quit ["q", "ctrl-c"] "quit",
}

/// The action of a key, if it has one.
pub(super) fn action(key: KeyEvent) -> Option<Action> {
    let name = named(key)?;
    let bound = |binding: &&Binding| binding.keys.contains(&name.as_str());
    ACTIONS.iter().find(bound).map(|binding| binding.action)
}

/// A key as the table writes it; none for keys without a name.
pub(super) fn named(key: KeyEvent) -> Option<String> {
    let name = match key.code {
        KeyCode::Char(' ') => "space".to_string(),
        KeyCode::Char(letter) => letter.to_string(),
        KeyCode::Left => "left".to_string(),
        KeyCode::Right => "right".to_string(),
        KeyCode::Up => "up".to_string(),
        KeyCode::Down => "down".to_string(),
        KeyCode::Home => "home".to_string(),
        KeyCode::End => "end".to_string(),
        KeyCode::Tab => "tab".to_string(),
        KeyCode::BackTab => return Some("shift-tab".to_string()),
        KeyCode::Enter => "enter".to_string(),
        KeyCode::Esc => "esc".to_string(),
        KeyCode::Backspace => "backspace".to_string(),
        _ => return None,
    };
    // A letter's case says it already.
    let letter = matches!(key.code, KeyCode::Char(_));
    let mut prefix = String::new();
    for (modifier, word) in [
        (KeyModifiers::CONTROL, "ctrl-"),
        (KeyModifiers::ALT, "alt-"),
        (KeyModifiers::SHIFT, "shift-"),
    ] {
        if key.modifiers.contains(modifier) && !(letter && word == "shift-") {
            prefix.push_str(word);
        }
    }
    Some(format!("{prefix}{name}"))
}

/// Tells keys from what a slow terminal still answers, which arrives as keys: ESC ], ESC _ or ESC P up to ESC \
/// or BEL.
#[derive(Debug, Default)]
pub(super) struct LateAnswer {
    /// An answer so far.
    taken: Option<String>,
    /// One that is complete.
    whole: Option<String>,
}

/// No answer is longer.
const LONGEST_ANSWER: usize = 64;

impl LateAnswer {
    /// Whether this key belongs to an answer.
    pub(super) fn takes(&mut self, key: KeyEvent) -> bool {
        let escaped = key.modifiers.contains(KeyModifiers::ALT);
        let bell = key.code == KeyCode::Char('g') && key.modifiers == KeyModifiers::CONTROL;
        let Some(mut taken) = self.taken.take() else {
            let KeyCode::Char(first @ (']' | '_' | 'P')) = key.code else {
                return false;
            };
            self.taken = escaped.then(|| format!("\x1b{first}"));
            return escaped;
        };
        match key.code {
            KeyCode::Char('\\') if escaped => self.whole = Some(taken + "\x1b\\"),
            _ if bell => self.whole = Some(taken + "\x07"),
            _ if taken.len() > LONGEST_ANSWER => return false,
            code => {
                taken.extend(code.as_char());
                self.taken = Some(taken);
            }
        }
        true
    }

    /// The answer that has just come to its end, as the terminal sent it; once.
    pub(super) fn answer(&mut self) -> Option<String> {
        self.whole.take()
    }
}

/// Actions whose words or keys match what was typed, fuzzily; the best first.
pub(super) fn find(typed: &str) -> Vec<&'static Binding> {
    let pattern = Pattern::parse(typed, CaseMatching::Smart, Normalization::Smart);
    let mut matcher = Matcher::new(Config::DEFAULT);
    let words = ACTIONS.iter().map(|binding| Words {
        text: format!("{} {}", binding.about, binding.keys.join(" ")),
        binding,
    });
    let found = pattern.match_list(words, &mut matcher);
    found.into_iter().map(|(words, _)| words.binding).collect()
}

/// What a search looks through.
struct Words {
    text: String,
    binding: &'static Binding,
}

impl AsRef<str> for Words {
    fn as_ref(&self) -> &str {
        &self.text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_key_has_one_meaning_and_every_action_words() {
        let mut keys: Vec<&str> = ACTIONS.iter().flat_map(|b| b.keys).copied().collect();
        let all = keys.len();
        keys.sort_unstable();
        keys.dedup();
        assert_eq!(keys.len(), all);
        assert!(ACTIONS.iter().all(|binding| !binding.about.is_empty()));
    }

    #[test]
    fn keys_are_found_by_their_names() {
        let press = |code, modifiers| action(KeyEvent::new(code, modifiers));
        let none = KeyModifiers::NONE;
        assert_eq!(press(KeyCode::Right, none), Some(Action::Forward));
        assert_eq!(
            press(KeyCode::Right, KeyModifiers::SHIFT),
            Some(Action::ForwardFar)
        );
        assert_eq!(
            press(KeyCode::Char('G'), KeyModifiers::SHIFT),
            Some(Action::Last)
        );
        assert_eq!(
            press(KeyCode::Char('c'), KeyModifiers::CONTROL),
            Some(Action::Quit)
        );
        assert_eq!(
            press(KeyCode::BackTab, KeyModifiers::SHIFT),
            Some(Action::PreviousPanel)
        );
        assert_eq!(press(KeyCode::Char('z'), none), None);
    }

    #[test]
    fn late_answers_are_no_keys_and_keys_after_them_are() {
        let none = KeyModifiers::NONE;
        let key = |letter, modifiers| KeyEvent::new(KeyCode::Char(letter), modifiers);
        let ends = [
            key('\\', KeyModifiers::ALT),
            key('g', KeyModifiers::CONTROL),
        ];
        for (start, end) in [(']', ends[0]), (']', ends[1]), ('_', ends[0])] {
            let mut late = LateAnswer::default();
            assert!(!late.takes(key('x', none)));
            assert!(late.takes(key(start, KeyModifiers::ALT)));
            assert!(
                "11;rgb:0000/0000/0000"
                    .chars()
                    .all(|letter| late.takes(key(letter, none)))
            );
            assert!(late.takes(end));
            let answer = late.answer().unwrap();
            assert!(
                answer.starts_with(&format!("\x1b{start}11;rgb:0000/")),
                "{answer:?}"
            );
            assert!(answer.ends_with(['\\', '\x07']) && late.answer().is_none());
            assert!(!late.takes(key('q', none)));
        }
        let mut late = LateAnswer::default();
        assert!(late.takes(key(']', KeyModifiers::ALT)));
        assert!(!(0..100).all(|_| late.takes(key('x', none))));
    }

    #[test]
    fn actions_are_found_by_some_of_their_letters() {
        assert_eq!(find("onion")[0].action, Action::Onion);
        assert_eq!(find("png")[0].action, Action::SavePicture);
        assert_eq!(find("").len(), ACTIONS.len());
        assert_eq!(find("frst frame")[0].action, Action::First);
        assert!(find("zzzz").is_empty());
    }
}
