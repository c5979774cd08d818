use std::sync::Arc;

use ratatui::buffer::Buffer;
use ratatui::crossterm::event::{
    KeyCode, KeyEvent, KeyModifiers, MouseButton, MouseEvent, MouseEventKind,
};
use ratatui::layout::Rect;

use super::{MAP, MESH, TIME};
use crate::loom::test_looms::ring;
use crate::mesh::Bounds;
use crate::pipeline::plot::plot_loom;
use crate::tui::event::{Answer, Command, Event};
use crate::tui::graphics::{Answers, Aside, CellSize, Protocol, choose, painter};
use crate::tui::screen;
use crate::tui::state::{Content, Front, Same, Scene, Signals, State};
use crate::tui::theme::{Depth, Look};
use crate::tui::update::update;
use crate::tui::work::Brush;

const LOOK: Look = Look {
    dark: true,
    depth: Depth::Mono,
};

/// As letters have them.
const CELL: CellSize = CellSize {
    width: 2,
    height: 4,
    fine: 2,
};

/// A studio with a loom open on a screen of that size, all of its pictures drawn.
fn studio(size: (u16, u16)) -> State {
    let mut state = State::new("ring".into(), size, CELL, LOOK);
    let loom = ring(20, 15, false);
    let bounds = Bounds::of(&loom.at(1.0).unwrap()).unwrap();
    let (map, times) = plot_loom(&loom);
    let scene = Scene {
        of: Same::new(loom),
        bounds,
    };
    let content = Content::Loom(scene, Same::new(Signals { map, times }));
    let opened = Answer::Opened(Box::new(content), Vec::new());
    send(&mut state, Event::Answer(opened));
    state
}

/// An event, and answers to all questions that it raises; the other commands.
fn send(state: &mut State, event: Event) -> Vec<Command> {
    let mut others = Vec::new();
    for command in update(state, event) {
        match command {
            Command::Draw {
                panel,
                number,
                wish,
            } => {
                let picture = Arc::new(Brush::default().paint(&wish));
                let drawn = Answer::Drawn {
                    panel,
                    number,
                    picture,
                };
                others.extend(send(state, Event::Answer(drawn)));
            }
            other => others.push(other),
        }
    }
    others
}

fn press(state: &mut State, code: KeyCode) -> Vec<Command> {
    send(state, Event::Key(KeyEvent::new(code, KeyModifiers::NONE)))
}

fn mouse(state: &mut State, kind: MouseEventKind, column: u16, row: u16) {
    let modifiers = KeyModifiers::NONE;
    let event = MouseEvent {
        kind,
        column,
        row,
        modifiers,
    };
    send(state, Event::Mouse(event));
}

fn screen_text(state: &State) -> String {
    let area = Rect::new(0, 0, state.size.0, state.size.1);
    let mut buffer = Buffer::empty(area);
    let choice = choose(Some(Protocol::Ascii), &Answers::default(), false, true);
    let mut painter = painter(&choice, LOOK);
    screen::draw(state, &mut *painter, &mut buffer, &mut Aside::default());
    let rows = buffer.content.chunks(usize::from(area.width).max(1));
    let row = |cells: &[ratatui::buffer::Cell]| -> String {
        let text: String = cells.iter().map(ratatui::buffer::Cell::symbol).collect();
        text.trim_end().to_string()
    };
    rows.map(row).collect::<Vec<_>>().join("\n")
}

#[test]
fn the_help_lists_every_key_on_a_large_screen() {
    let mut state = studio((120, 50));
    press(&mut state, KeyCode::Char('?'));
    let text = screen_text(&state);
    for binding in crate::tui::keys::ACTIONS {
        assert!(text.contains(binding.about), "{}", binding.about);
    }
    press(&mut state, KeyCode::Esc);
    assert_eq!(state.front, None);
}

#[test]
fn every_size_and_state_is_drawn_without_a_panic() {
    for size in [
        (1, 1),
        (2, 2),
        (3, 40),
        (80, 1),
        (80, 24),
        (120, 36),
        (240, 70),
    ] {
        let mut state = studio(size);
        for key in ['?', 'x', ':', 'o'] {
            screen_text(&state);
            press(&mut state, KeyCode::Char(key));
        }
        screen_text(&state);
    }
}

#[test]
fn arrows_go_from_frame_to_frame_and_stop_at_the_ends() {
    let mut state = studio((80, 24));
    press(&mut state, KeyCode::Left);
    assert_eq!(state.playback.t, 1.0);
    press(&mut state, KeyCode::Right);
    assert_eq!(state.playback.t, 2.0);
    state.playback.t = 4.5;
    press(&mut state, KeyCode::Right);
    assert_eq!(state.playback.t, 5.0);
    press(&mut state, KeyCode::End);
    assert_eq!(state.playback.t, 15.0);
}

#[test]
fn a_cursor_move_asks_for_a_mesh_and_for_no_plot() {
    let mut state = studio((120, 36));
    let right = KeyEvent::new(KeyCode::Right, KeyModifiers::NONE);
    let asked = update(&mut state, Event::Key(right));
    assert!(
        matches!(asked[..], [Command::Draw { panel: MESH, .. }]),
        "{asked:?}"
    );
    let again = update(&mut state, Event::Tick(std::time::Duration::ZERO));
    assert!(again.is_empty(), "{again:?}");
}

#[test]
fn answers_to_older_questions_are_dropped() {
    let mut state = studio((120, 36));
    let shown = state.slots[MESH].shown.clone().unwrap();
    let number = state.slots[MESH].number - 1;
    let picture = Arc::new(shown.as_ref().clone());
    let late = Answer::Drawn {
        panel: MESH,
        number,
        picture,
    };
    update(&mut state, Event::Answer(late));
    assert!(Arc::ptr_eq(
        state.slots[MESH].shown.as_ref().unwrap(),
        &shown
    ));
}

#[test]
fn playback_runs_at_the_captures_rate_and_around_the_loop() {
    let mut state = studio((80, 24));
    press(&mut state, KeyCode::Char(' '));
    let second = std::time::Duration::from_secs(1);
    let frames_a_second = state.fps();
    update(&mut state, Event::Tick(second / 10));
    assert!((state.playback.t - (1.0 + frames_a_second / 10.0)).abs() < 1e-12);
    state.playback.marks = [Some(3.0), Some(5.0)];
    for _ in 0..100 {
        update(&mut state, Event::Tick(second / 30));
        assert!((3.0..=5.0).contains(&state.playback.t));
    }
    for _ in 0..10 {
        press(&mut state, KeyCode::Char('>'));
    }
    assert_eq!(state.playback.speed, 8.0);
}

#[test]
fn a_click_on_the_signals_goes_to_the_time_under_the_mouse() {
    let mut state = studio((120, 36));
    let (_, area) = state
        .places()
        .into_iter()
        .find(|place| place.0 == TIME)
        .unwrap();
    let middle = (area.x + area.width / 2, area.y + area.height / 2);
    mouse(
        &mut state,
        MouseEventKind::Down(MouseButton::Left),
        middle.0,
        middle.1,
    );
    let t = state.playback.t;
    // A column spans a tenth of a frame or so; the plane's left margin shifts the middle a little.
    assert!((6.5..9.5).contains(&t), "{t}");
    mouse(
        &mut state,
        MouseEventKind::Drag(MouseButton::Left),
        middle.0 + 20,
        middle.1,
    );
    assert!(state.playback.t > t);
    assert_eq!(state.focus, TIME);
}

#[test]
fn the_cursor_leaves_the_curve_and_returns() {
    let mut state = studio((120, 36));
    let on_curve = state.cursor();
    press(&mut state, KeyCode::Char('c'));
    assert_eq!(state.cursor(), on_curve);
    press(&mut state, KeyCode::Right);
    let (a, b) = (on_curve.unwrap(), state.cursor().unwrap());
    assert!(b[0] > a[0] && b[1] == a[1]);
    press(&mut state, KeyCode::Esc);
    assert_eq!(state.cursor(), on_curve);
}

#[test]
fn zooming_keeps_what_lies_under_the_cursor_and_undoes_itself() {
    let mut state = studio((120, 36));
    state.focus = MAP;
    let before = super::map::window(&state);
    press(&mut state, KeyCode::Char('+'));
    let closer = super::map::window(&state);
    let at = state.cursor().unwrap();
    for i in 0..2 {
        let share = |w: [[f64; 2]; 2]| (at[i] - w[i][0]) / (w[i][1] - w[i][0]);
        assert!((share(before) - share(closer)).abs() < 1e-9);
    }
    press(&mut state, KeyCode::Char('0'));
    let all = super::map::window(&state);
    assert!((0..4).all(|i| (all[i / 2][i % 2] - before[i / 2][i % 2]).abs() < 1e-9));
}

#[test]
fn actions_are_found_and_run_by_their_words() {
    let mut state = studio((80, 24));
    press(&mut state, KeyCode::Char(':'));
    for letter in "onion".chars() {
        press(&mut state, KeyCode::Char(letter));
    }
    assert!(matches!(&state.front, Some(Front::Palette(typed, 0)) if typed == "onion"));
    press(&mut state, KeyCode::Enter);
    assert!(state.mesh.onion && state.front.is_none());
}

#[test]
fn writing_asks_for_what_is_shown() {
    let mut state = studio((80, 24));
    let saved = press(&mut state, KeyCode::Char('P'));
    assert!(matches!(&saved[..], [Command::SavePicture(name, _)] if name == "pose-space-1.png"));
    state.playback.marks = [Some(9.0), Some(4.0)];
    let exported = press(&mut state, KeyCode::Char('x'));
    assert!(matches!(exported[..], [Command::Export(span)] if (span.from, span.to) == (4.0, 9.0)));
    assert_eq!(press(&mut state, KeyCode::Char('q')), [Command::Quit]);
}
