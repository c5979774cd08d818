//! The captures of a watched folder and where each stands: a list that fills as they land. One that is
//! chosen is opened in the studio.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, TryRecvError};
use std::time::Duration;

use ratatui::buffer::Buffer;
use ratatui::crossterm::event::{self as keyboard, Event, KeyCode, KeyEvent, KeyEventKind};
use ratatui::crossterm::event::{KeyModifiers, MouseButton, MouseEvent, MouseEventKind};
use ratatui::crossterm::terminal::size;
use ratatui::layout::Rect;
use ratatui::style::Modifier;

use super::hands::Desk;
use super::studio::{Files, Options, is_dark, lost, run};
use super::terminal;
use super::theme::{Look, Role};
use super::wire::write_cells;
use crate::diag::Result;
use crate::inbox;
use crate::task::{Cancelled, Task};

/// News is looked for this often while no key is pressed.
const LOOK: Duration = Duration::from_millis(50);
/// Rows above the list and below it.
const HEAD: u16 = 2;
const FOOT: u16 = 1;
/// Columns of a state's name.
const STATE: u16 = 10;

/// A capture that landed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Landing {
    /// Its name.
    pub name: String,
    /// Where it stands.
    pub state: inbox::State,
    /// What became of it, in words.
    pub note: String,
    /// What it consists of, relative to the watched folder.
    pub inputs: Vec<PathBuf>,
}

/// What the watched folder has to say.
#[derive(Debug)]
pub enum News {
    /// All captures.
    Landings(Vec<Landing>),
    /// The watch has ended, and why.
    Ended(String),
}

/// What of a capture is to be looked at.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    /// The frames that landed.
    Capture,
    /// What the recipe made of them.
    Results,
}

/// The files of what is looked at, and the recipe that is made of it.
pub type Shown = (Arc<dyn Files>, Arc<dyn Desk>);

/// Shows what lands until it is quit. `open` gives the files of a capture or of its results; `task` is
/// cancelled when the program is to end.
///
/// # Errors
/// There is no terminal, or it is gone; cancellation.
pub fn watch(
    options: &Options,
    news: &Receiver<News>,
    open: &dyn Fn(&Landing, Part) -> Shown,
    task: &Task,
) -> Result<()> {
    let mut list = List {
        title: options.name.clone(),
        ..List::default()
    };
    loop {
        match look(&mut list, options, news, task)? {
            None => return Ok(()),
            Some((chosen, part)) => {
                let options = Options {
                    name: chosen.name.clone(),
                    ..options.clone()
                };
                let (files, desk) = open(&chosen, part);
                run(&options, files, &desk, task)?;
            }
        }
    }
}

/// Takes the terminal for the list; what was chosen, or nothing at the end.
fn look(
    list: &mut List,
    options: &Options,
    news: &Receiver<News>,
    task: &Task,
) -> Result<Option<(Landing, Part)>> {
    terminal::take().map_err(lost)?;
    let answers = terminal::ask(options.tmux);
    let look = Look {
        dark: answers.background.is_none_or(is_dark),
        depth: options.depth(),
    };
    let chosen = follow(list, look, news, task);
    terminal::restore();
    chosen
}

fn follow(
    list: &mut List,
    look: Look,
    news: &Receiver<News>,
    task: &Task,
) -> Result<Option<(Landing, Part)>> {
    let mut shown = Buffer::empty(Rect::ZERO);
    loop {
        task.check().map_err(|Cancelled| Cancelled)?;
        list.hear(news);
        let (columns, rows) = size().map_err(lost)?;
        let mut next = Buffer::empty(Rect::new(0, 0, columns, rows));
        list.draw(look, &mut next);
        let mut bytes = Vec::new();
        if shown.area != next.area {
            bytes.extend_from_slice(b"\x1b[0m\x1b[2J");
            shown = Buffer::empty(next.area);
        }
        bytes.extend(write_cells(&shown.diff(&next), columns));
        if !bytes.is_empty() {
            terminal::send(&bytes).map_err(lost)?;
        }
        shown = next;
        if !keyboard::poll(LOOK).map_err(lost)? {
            continue;
        }
        let wish = match keyboard::read().map_err(lost)? {
            Event::Key(key) if key.kind != KeyEventKind::Release => list.on_key(key),
            Event::Mouse(mouse) => list.on_mouse(mouse),
            _ => Wish::Stay,
        };
        match wish {
            Wish::Stay => {}
            Wish::Quit => return Ok(None),
            Wish::Open(part) => {
                if let Some(landing) = list.landings.get(list.chosen) {
                    return Ok(Some((landing.clone(), part)));
                }
            }
        }
    }
}

/// What a key asks for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Wish {
    Stay,
    Quit,
    Open(Part),
}

/// The list as it is shown.
#[derive(Debug, Default)]
struct List {
    title: String,
    landings: Vec<Landing>,
    /// Index of the chosen one, and of the first on the screen.
    chosen: usize,
    first: usize,
    /// Rows for the list, when it was last drawn.
    room: usize,
    ended: Option<String>,
}

impl List {
    /// Takes what is new. The chosen capture stays chosen.
    fn hear(&mut self, news: &Receiver<News>) {
        loop {
            match news.try_recv() {
                Ok(News::Landings(landings)) => self.replace(landings),
                Ok(News::Ended(why)) => self.ended = Some(why),
                Err(TryRecvError::Empty | TryRecvError::Disconnected) => return,
            }
        }
    }

    fn replace(&mut self, landings: Vec<Landing>) {
        let name = self.landings.get(self.chosen).map(|one| one.name.clone());
        self.landings = landings;
        let same = |one: &Landing| Some(&one.name) == name.as_ref();
        let last = self.landings.len().saturating_sub(1);
        self.chosen = self
            .landings
            .iter()
            .position(same)
            .unwrap_or(self.chosen)
            .min(last);
    }

    fn on_key(&mut self, key: KeyEvent) -> Wish {
        let last = self.landings.len().saturating_sub(1);
        match key.code {
            KeyCode::Char('c') if key.modifiers.contains(KeyModifiers::CONTROL) => {
                return Wish::Quit;
            }
            KeyCode::Char('q') | KeyCode::Esc => return Wish::Quit,
            KeyCode::Enter => return Wish::Open(Part::Capture),
            KeyCode::Char('r') => return Wish::Open(Part::Results),
            KeyCode::Down | KeyCode::Char('j') => self.chosen = (self.chosen + 1).min(last),
            KeyCode::Up | KeyCode::Char('k') => self.chosen = self.chosen.saturating_sub(1),
            KeyCode::PageDown => self.chosen = (self.chosen + self.room.max(1)).min(last),
            KeyCode::PageUp => self.chosen = self.chosen.saturating_sub(self.room.max(1)),
            KeyCode::Home | KeyCode::Char('g') => self.chosen = 0,
            KeyCode::End | KeyCode::Char('G') => self.chosen = last,
            _ => {}
        }
        Wish::Stay
    }

    /// A click chooses, a click on the chosen one opens; the wheel walks.
    fn on_mouse(&mut self, mouse: MouseEvent) -> Wish {
        let last = self.landings.len().saturating_sub(1);
        match mouse.kind {
            MouseEventKind::ScrollDown => self.chosen = (self.chosen + 1).min(last),
            MouseEventKind::ScrollUp => self.chosen = self.chosen.saturating_sub(1),
            MouseEventKind::Down(MouseButton::Left) if mouse.row >= HEAD => {
                let index = self.first + usize::from(mouse.row - HEAD);
                if index == self.chosen && index < self.landings.len() {
                    return Wish::Open(Part::Capture);
                }
                if index < self.landings.len() {
                    self.chosen = index;
                }
            }
            _ => {}
        }
        Wish::Stay
    }

    fn draw(&mut self, look: Look, buffer: &mut Buffer) {
        let Rect { width, height, .. } = buffer.area;
        if width == 0 || height == 0 {
            return;
        }
        let bold = look.style(Role::Accent).add_modifier(Modifier::BOLD);
        buffer.set_stringn(
            1,
            0,
            &self.title,
            usize::from(width.saturating_sub(1)),
            bold,
        );
        self.room = usize::from(height.saturating_sub(HEAD + FOOT));
        self.first = self
            .first
            .min(self.chosen)
            .max((self.chosen + 1).saturating_sub(self.room));
        if self.landings.is_empty() && height > HEAD {
            let text = "nothing has landed yet";
            buffer.set_stringn(
                2,
                HEAD,
                text,
                usize::from(width.saturating_sub(2)),
                look.style(Role::Muted),
            );
        }
        let wide = self
            .landings
            .iter()
            .map(|one| one.name.chars().count())
            .max();
        let names = wide.unwrap_or(0).min(usize::from(width) / 2) as u16;
        let rows = self
            .landings
            .iter()
            .enumerate()
            .skip(self.first)
            .take(self.room);
        for (row, (index, landing)) in rows.enumerate() {
            let y = HEAD + row as u16;
            draw_landing(landing, look, names, y, buffer);
            if index == self.chosen {
                let line = Rect::new(0, y, width, 1);
                buffer.set_style(line, Modifier::REVERSED);
            }
        }
        let foot = Rect::new(0, height - 1, width, 1);
        buffer.set_style(foot, look.bar());
        let text = self.ended.clone().unwrap_or_else(|| self.counts());
        let text = format!(" {text}   enter the capture  r its results  q quit");
        buffer.set_stringn(0, height - 1, text, usize::from(width), look.bar());
    }

    /// How many there are of each state.
    fn counts(&self) -> String {
        use inbox::State::{Done, Failed, Queued, Running, Settling};
        let states = [Settling, Queued, Running, Done, Failed];
        let count = |state| {
            self.landings
                .iter()
                .filter(|one| one.state == state)
                .count()
        };
        let counts = states.map(|state| (count(state), name(state)));
        let present = counts.iter().filter(|(count, _)| *count > 0);
        let words: Vec<String> = present
            .map(|(count, name)| format!("{count} {name}"))
            .collect();
        if words.is_empty() {
            "watching".into()
        } else {
            words.join(", ")
        }
    }
}

fn draw_landing(landing: &Landing, look: Look, names: u16, y: u16, buffer: &mut Buffer) {
    let width = buffer.area.width;
    let left = |x: u16| usize::from(width.saturating_sub(x));
    let role = match landing.state {
        inbox::State::Done => Role::Mark,
        inbox::State::Failed => Role::Bad,
        inbox::State::Running => Role::Accent,
        inbox::State::Settling | inbox::State::Queued => Role::Muted,
    };
    buffer.set_stringn(2, y, name(landing.state), left(2), look.style(role));
    let at = 2 + STATE;
    if at < width {
        let plain = ratatui::style::Style::new();
        buffer.set_stringn(
            at,
            y,
            &landing.name,
            left(at).min(usize::from(names)),
            plain,
        );
    }
    let at = at + names + 2;
    if at < width {
        let note = landing.note.replace('\n', "; ");
        buffer.set_stringn(at, y, note, left(at), look.style(Role::Muted));
    }
}

/// A state for people.
fn name(state: inbox::State) -> &'static str {
    match state {
        inbox::State::Settling => "settling",
        inbox::State::Queued => "queued",
        inbox::State::Running => "running",
        inbox::State::Done => "done",
        inbox::State::Failed => "failed",
    }
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc;

    use super::*;
    use crate::tui::theme::Depth;

    const LOOK: Look = Look {
        dark: true,
        depth: Depth::Mono,
    };

    fn landing(name: &str, state: inbox::State, note: &str) -> Landing {
        Landing {
            name: name.into(),
            state,
            note: note.into(),
            inputs: vec![name.into()],
        }
    }

    fn list() -> List {
        let mut list = List {
            title: "captures -> results".into(),
            ..List::default()
        };
        list.replace(vec![
            landing("jump", inbox::State::Done, "48 frames"),
            landing(
                "run_0412",
                inbox::State::Failed,
                "error: changed faces\n  in f3.obj",
            ),
            landing("turn", inbox::State::Running, ""),
            landing("walk", inbox::State::Settling, ""),
        ]);
        list
    }

    fn text(list: &mut List, width: u16, height: u16) -> String {
        let mut buffer = Buffer::empty(Rect::new(0, 0, width, height));
        list.draw(LOOK, &mut buffer);
        let rows = buffer.content.chunks(usize::from(width));
        let row = |cells: &[ratatui::buffer::Cell]| -> String {
            let text: String = cells.iter().map(|cell| cell.symbol()).collect();
            text.trim_end().to_string()
        };
        rows.map(row).collect::<Vec<_>>().join("\n")
    }

    fn press(list: &mut List, code: KeyCode) -> Wish {
        list.on_key(KeyEvent::new(code, KeyModifiers::NONE))
    }

    #[test]
    fn captures_stand_with_their_states() {
        insta::assert_snapshot!(text(&mut list(), 80, 9), @r"
         captures -> results

          done      jump      48 frames
          failed    run_0412  error: changed faces;   in f3.obj
          running   turn
          settling  walk


         1 settling, 1 running, 1 done, 1 failed   enter the capture  r its results  q q
        ");
        insta::assert_snapshot!(text(&mut List::default(), 60, 5), @r"


          nothing has landed yet

         watching   enter the capture  r its results  q quit
        ");
    }

    #[test]
    fn the_chosen_capture_stays_chosen_as_others_land() {
        let mut list = list();
        press(&mut list, KeyCode::Down);
        press(&mut list, KeyCode::Down);
        let mut more = list.landings.clone();
        more.insert(0, landing("before", inbox::State::Queued, ""));
        let (send, receive) = mpsc::channel();
        send.send(News::Landings(more)).unwrap();
        list.hear(&receive);
        assert_eq!(list.landings[list.chosen].name, "turn");
        send.send(News::Landings(Vec::new())).unwrap();
        list.hear(&receive);
        assert_eq!(list.chosen, 0);
        assert_eq!(press(&mut list, KeyCode::Enter), Wish::Open(Part::Capture));
    }

    #[test]
    fn keys_and_clicks_walk_and_open() {
        let mut list = list();
        text(&mut list, 60, 5);
        press(&mut list, KeyCode::End);
        assert_eq!(list.chosen, 3);
        // Two rows of list are left: the last two captures.
        assert!(text(&mut list, 60, 5).contains("turn\n  settling  walk"));
        let click = |row| MouseEvent {
            kind: MouseEventKind::Down(MouseButton::Left),
            column: 5,
            row,
            modifiers: KeyModifiers::NONE,
        };
        assert_eq!(list.on_mouse(click(2)), Wish::Stay);
        assert_eq!(list.chosen, 2);
        assert_eq!(list.on_mouse(click(2)), Wish::Open(Part::Capture));
        assert_eq!(list.on_mouse(click(4)), Wish::Stay);
        assert_eq!(
            press(&mut list, KeyCode::Char('r')),
            Wish::Open(Part::Results)
        );
        assert_eq!(press(&mut list, KeyCode::Char('q')), Wish::Quit);
    }

    #[test]
    fn every_size_is_drawn() {
        for (width, height) in [(1, 1), (2, 2), (13, 3), (80, 24), (500, 200)] {
            text(&mut list(), width, height);
        }
    }
}
