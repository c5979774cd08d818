//! One table binds the keys and documents them.

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
    Unmark ["u"] "forget the loop's marks",
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
    /// Keys of an answer so far.
    taken: Option<usize>,
}

/// No answer is longer.
const LONGEST_ANSWER: usize = 64;

impl LateAnswer {
    /// Whether this key belongs to an answer.
    pub(super) fn takes(&mut self, key: KeyEvent) -> bool {
        let escaped = key.modifiers.contains(KeyModifiers::ALT);
        let bell = key.code == KeyCode::Char('g') && key.modifiers == KeyModifiers::CONTROL;
        match (self.taken, key.code) {
            (None, KeyCode::Char(']' | '_' | 'P')) if escaped => self.taken = Some(1),
            (None, _) => return false,
            (Some(_), KeyCode::Char('\\')) if escaped => self.taken = None,
            (Some(_), _) if bell => self.taken = None,
            (Some(LONGEST_ANSWER..), _) => {
                self.taken = None;
                return false;
            }
            (Some(taken), _) => self.taken = Some(taken + 1),
        }
        true
    }
}

/// Actions whose words contain all letters of `typed` in order, those that have them closest together
/// first.
pub(super) fn find(typed: &str) -> Vec<&'static Binding> {
    let mut found: Vec<(usize, &Binding)> = ACTIONS
        .iter()
        .filter_map(|binding| Some((spread(binding.about, typed)?, binding)))
        .collect();
    found.sort_by_key(|&(spread, _)| spread);
    found.into_iter().map(|(_, binding)| binding).collect()
}

/// How many letters of `text` are skipped between those of `typed`; none if they are not there in order.
fn spread(text: &str, typed: &str) -> Option<usize> {
    let lower = text.to_lowercase();
    let wanted = typed.to_lowercase();
    let starts = lower.char_indices().map(|(at, _)| at);
    starts.filter_map(|at| skipped(&lower[at..], &wanted)).min()
}

fn skipped(text: &str, wanted: &str) -> Option<usize> {
    let mut letters = text.chars();
    let mut passed = 0;
    for (index, letter) in wanted.chars().enumerate() {
        let before = letters
            .by_ref()
            .take_while(|&other| other != letter)
            .count();
        let missed = letters.as_str().is_empty() && !text.ends_with(letter);
        if missed || (index == 0 && before > 0) {
            return None;
        }
        passed += before;
    }
    Some(passed)
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
        assert!(find("zzzz").is_empty());
    }
}
