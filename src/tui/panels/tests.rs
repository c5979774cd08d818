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
use crate::tui::thumbs::Bench;
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
    shades: false,
    scales: false,
};

/// A studio with nothing open yet.
pub(super) fn studio_of(name: &str, size: (u16, u16), cell: CellSize) -> State {
    State::new(name.into(), size, cell, LOOK)
}

/// A studio with a loom open on a screen of that size, all of its pictures drawn.
fn studio(size: (u16, u16)) -> State {
    let mut state = studio_of("ring", size, CELL);
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
pub(super) fn send(state: &mut State, event: Event) -> Vec<Command> {
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

pub(super) fn press(state: &mut State, code: KeyCode) -> Vec<Command> {
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
    screen(state, Protocol::Ascii)
}

/// The screen as text, by a protocol of letters.
pub(super) fn screen(state: &State, protocol: Protocol) -> String {
    let choice = choose(Some(protocol), &Answers::default(), false, true);
    let mut painter = painter(&choice, state.look);
    let area = Rect::new(0, 0, state.size.0, state.size.1);
    let (mut buffer, mut aside) = (Buffer::empty(area), Aside::default());
    screen::draw(state, &mut *painter, &mut buffer, &mut aside);
    painter.finish(&mut buffer, &mut aside);
    let rows = buffer.content.chunks(usize::from(area.width).max(1));
    let row = |cells: &[ratatui::buffer::Cell]| -> String {
        let text: String = cells.iter().map(ratatui::buffer::Cell::symbol).collect();
        text.trim_end().to_string()
    };
    rows.map(row).collect::<Vec<_>>().join("\n")
}

#[test]
fn the_help_lists_every_key_on_a_large_screen() {
    let mut state = studio((120, 90));
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
        (500, 200),
    ] {
        let mut state = studio(size);
        for key in ['?', 'x', ':', 'o', 'b', 'E'] {
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
    // It goes on behind, and says how far it has come.
    send(&mut state, Event::Answer(Answer::Progress("save", 3, 6)));
    assert!(screen_text(&state).contains("save ━━━━━╌╌╌╌╌ 3/6"));
    send(&mut state, Event::Answer(Answer::Saved("frames-1".into())));
    let text = screen_text(&state);
    assert!(text.contains("written: frames-1") && !text.contains("3/6"));
    assert_eq!(press(&mut state, KeyCode::Char('q')), [Command::Quit]);
}

/// A studio in blocks, as a terminal with colours has it.
fn coloured(dark: bool) -> State {
    let look = Look {
        dark,
        depth: Depth::True,
    };
    let cell = CellSize::of(Protocol::Blocks);
    let mut state = State::new("ring".into(), (120, 36), cell, look);
    let loom = ring(20, 15, false);
    let bounds = Bounds::of(&loom.at(1.0).unwrap()).unwrap();
    let (map, times) = plot_loom(&loom);
    let scene = Scene {
        of: Same::new(loom),
        bounds,
    };
    let content = Content::Loom(scene, Same::new(Signals { map, times }));
    let opened = Answer::Opened(Box::new(content), Vec::new());
    for command in send(&mut state, Event::Answer(opened)) {
        if let Command::DrawThumbs(number, wish) = command {
            let thumbs = Same::new(Bench::default().all(&wish));
            send(&mut state, Event::Answer(Answer::Thumbs { number, thumbs }));
        }
    }
    state
}

#[test]
fn small_meshes_cover_the_map_and_are_asked_for_once() {
    let mut state = coloured(true);
    let thumbs = state.thumbs.shown.clone().expect("small meshes");
    assert!(thumbs.0.len() >= 6, "{}", thumbs.0.len());
    let lit = |image: &crate::image::Image| image.rgba.chunks(4).any(|pixel| pixel[3] > 0);
    assert!(thumbs.0.iter().filter(|(_, _, image)| lit(image)).count() > thumbs.0.len() / 2);
    let again = update(&mut state, Event::Tick(std::time::Duration::ZERO));
    assert!(again.is_empty(), "{again:?}");
    let scrubbed = update(
        &mut state,
        Event::Key(KeyEvent::new(KeyCode::Right, KeyModifiers::NONE)),
    );
    assert!(matches!(scrubbed[..], [Command::Draw { panel: MESH, .. }]));
}

#[test]
fn turning_the_mesh_turns_the_small_ones() {
    let mut state = coloured(true);
    state.focus = MESH;
    let turned = press(&mut state, KeyCode::Char('l'));
    let [Command::DrawThumbs(_, wish)] = &turned[..] else {
        panic!("{turned:?}");
    };
    assert_eq!(wish.view.yaw, state.mesh.yaw);
    let off = press(&mut state, KeyCode::Char('m'));
    assert!(off.is_empty() && state.thumbs.off, "{off:?}");
}

#[test]
fn light_and_dark_terminals_get_their_own_colours() {
    use ratatui::style::Color;
    for dark in [true, false] {
        let state = coloured(dark);
        let image = &state.slots[MAP].shown.as_ref().unwrap().image;
        assert_eq!(image.rgba[0] < 128, dark);
        let style = state.look.style(crate::tui::theme::Role::Accent);
        let Some(Color::Rgb(red, green, blue)) = style.fg else {
            panic!("{style:?}");
        };
        let light = u32::from(red) + u32::from(green) + u32::from(blue);
        assert_eq!(light > 380, dark);
    }
}

#[test]
fn the_mouse_names_the_frame_below_it() {
    let mut state = coloured(true);
    let (_, area) = *state.places().iter().find(|place| place.0 == MAP).unwrap();
    let canvas = state.canvas(MAP, area);
    let picture = state.slots[MAP].shown.clone().unwrap();
    let place = state.signals().unwrap().0.map.frames[6];
    let at = super::cell_of(&picture, &picture.planes[0], place, canvas).unwrap();
    mouse(&mut state, MouseEventKind::Moved, at.0, at.1);
    assert!(screen(&state, Protocol::Ascii).contains(" frame 7 "));
}
