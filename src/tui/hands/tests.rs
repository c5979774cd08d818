use std::path::PathBuf;
use std::sync::Arc;

use ratatui::crossterm::event::{
    KeyCode, KeyEvent, KeyModifiers, MouseButton, MouseEvent, MouseEventKind,
};

use super::trial::{Pinning, Trials};
use super::{Errand, Held, Ran, Reply, Run};
use crate::diag::Diagnostic;
use crate::loom::test_looms::ring;
use crate::recipe::{Param, Recipe, Setting};
use crate::tui::event::{Answer, Command, Event};
use crate::tui::graphics::CellSize;
use crate::tui::panels::{MAP, PANELS, RECIPE, TIME};
use crate::tui::stage;
use crate::tui::state::{Content, Same, State};
use crate::tui::theme::{Depth, Look};
use crate::tui::update::update;
use crate::tui::work::Brush;

const START: &str = "fit(input())\n";

fn result(frames: usize) -> Result<Box<Ran>, Box<Diagnostic>> {
    let loom = Arc::new(ring(20, frames, false));
    let pinning = Pinning {
        fitted: Same(Arc::clone(&loom)),
        edits: Vec::new(),
    };
    Ok(Box::new(Ran {
        content: Some(stage::loom(loom).unwrap()),
        pinning: Some(pinning),
        params: Vec::new(),
        told: vec!["a loom".into()],
    }))
}

/// A studio with this recipe, and the commands that its first run is among.
pub(super) fn open_recipe(text: &str) -> (State, Vec<Command>) {
    let cell = CellSize {
        width: 2,
        height: 4,
        fine: 2,
        shades: false,
        scales: false,
    };
    let look = Look {
        dark: true,
        depth: Depth::Mono,
    };
    let mut state = State::new("ring".into(), (120, 36), cell, look);
    let recipe = Recipe {
        path: PathBuf::from("r.rhai"),
        text: text.into(),
    };
    tell(&mut state, Reply::Found(recipe, true, None));
    let commands = tell(&mut state, Reply::Ready);
    (state, commands)
}

/// A studio whose recipe has been run once, with all pictures drawn.
fn studio() -> State {
    let (mut state, commands) = open_recipe(START);
    let number = run_of(&commands).unwrap().number;
    tell(&mut state, Reply::Ran(number, result(15)));
    state
}

pub(super) fn tell(state: &mut State, reply: Reply) -> Vec<Command> {
    send(state, Event::Answer(Answer::Hands(reply)))
}

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

pub(super) fn letter(state: &mut State, letter: char) -> Vec<Command> {
    press(state, KeyCode::Char(letter))
}

pub(super) fn mouse(
    state: &mut State,
    kind: MouseEventKind,
    (column, row): (u16, u16),
) -> Vec<Command> {
    let modifiers = KeyModifiers::NONE;
    let event = MouseEvent {
        kind,
        column,
        row,
        modifiers,
    };
    send(state, Event::Mouse(event))
}

/// The run that was asked for.
pub(super) fn run_of(commands: &[Command]) -> Option<&Run> {
    commands.iter().find_map(|command| match command {
        Command::Hands(Errand::Run(run)) => Some(run),
        _ => None,
    })
}

/// The text that was asked to be written.
pub(super) fn written(commands: &[Command]) -> String {
    let run = run_of(commands).expect("a run");
    assert!(run.save);
    run.recipe.text.clone()
}

/// The cell of a panel on which a point of its first plane lies.
pub(super) fn cell(state: &State, panel: usize, point: [f64; 2]) -> (u16, u16) {
    let places = state.places();
    let (_, area) = places.iter().find(|(at, _)| *at == panel).unwrap();
    let area = state.canvas(panel, *area);
    let picture = state.slots[panel].shown.as_ref().unwrap();
    let [x, y] = picture.planes[0].pixel(point);
    let share = [
        x / picture.image.width as f32,
        y / picture.image.height as f32,
    ];
    (
        area.x + (share[0] * f32::from(area.width)) as u16,
        area.y + (share[1] * f32::from(area.height)) as u16,
    )
}

#[test]
fn a_control_point_follows_the_mouse_and_becomes_a_line() {
    let mut state = studio();
    let window = crate::tui::panels::map::window(&state);
    let at = state.loom().unwrap().time().controls()[7];
    let from = cell(&state, MAP, at);
    mouse(&mut state, MouseEventKind::Down(MouseButton::Left), from);
    let to = (from.0 + 6, from.1 + 3);
    let tries = mouse(&mut state, MouseEventKind::Drag(MouseButton::Left), to);
    assert!(
        matches!(&tries[..], [Command::Hands(Errand::Try(_))]),
        "{tries:?}"
    );
    // The view stays where it is, however far the point goes.
    assert_eq!(state.window, Some(window));
    let commands = mouse(&mut state, MouseEventKind::Up(MouseButton::Left), to);
    let text = written(&commands);
    assert!(
        text.starts_with("fit(input())\n    .move_control("),
        "{text}"
    );
    assert_eq!((state.window, &state.hands.held), (None, &None));
}

#[test]
fn a_click_on_a_control_point_moves_nothing() {
    let mut state = studio();
    let at = state.loom().unwrap().time().controls()[7];
    let place = cell(&state, MAP, at);
    mouse(&mut state, MouseEventKind::Down(MouseButton::Left), place);
    let commands = mouse(&mut state, MouseEventKind::Up(MouseButton::Left), place);
    assert!(run_of(&commands).is_none());
    assert_eq!(state.hands.page.text(), START);
    assert!(state.playback.t > 1.0);
}

#[test]
fn keys_move_a_control_point_and_undo_takes_the_line_back() {
    let mut state = studio();
    letter(&mut state, 'd');
    press(&mut state, KeyCode::Right);
    let commands = press(&mut state, KeyCode::Enter);
    assert!(written(&commands).contains(".move_control("));
    let commands = letter(&mut state, 'u');
    assert_eq!(written(&commands), START);
    let redo = KeyEvent::new(KeyCode::Char('r'), KeyModifiers::CONTROL);
    let commands = send(&mut state, Event::Key(redo));
    assert!(written(&commands).contains(".move_control("));
    letter(&mut state, 'd');
    press(&mut state, KeyCode::Right);
    press(&mut state, KeyCode::Esc);
    assert_eq!(state.hands.held, None);
}

#[test]
fn loops_need_marks_and_repeat_on_their_line() {
    let mut state = studio();
    assert!(letter(&mut state, 'a').is_empty());
    assert!(state.notice.as_ref().unwrap().bad);
    state.playback.marks = [Some(3.0), Some(9.0)];
    let once = written(&letter(&mut state, 'a'));
    assert_eq!(once, "fit(input())\n    .add_loop(3, 9)\n");
    let twice = written(&letter(&mut state, 'a'));
    assert_eq!(twice, "fit(input())\n    .add_loop(3, 9, #{ times: 2 })\n");
}

#[test]
fn speed_over_all_of_time_repeats_on_its_line_though_time_has_grown() {
    let mut state = studio();
    let commands = letter(&mut state, '{');
    assert!(written(&commands).contains(".speed(1, 15, 0.8)"));
    let number = run_of(&commands).unwrap().number;
    tell(&mut state, Reply::Ran(number, result(18)));
    assert!(written(&letter(&mut state, '{')).contains(".speed(1, 15, 0.64)"));
}

#[test]
fn a_moment_is_dragged_to_another_time() {
    let mut state = studio();
    let t = |state: &State, t| (cell(state, TIME, [t, 0.0]).0, state.places()[2].1.y + 3);
    let (from, to) = (t(&state, 6.0), t(&state, 9.0));
    mouse(&mut state, MouseEventKind::Down(MouseButton::Right), from);
    mouse(&mut state, MouseEventKind::Drag(MouseButton::Right), to);
    let commands = mouse(&mut state, MouseEventKind::Up(MouseButton::Right), to);
    let text = written(&commands);
    assert!(text.contains(".retime([[1, 1], ["), "{text}");
    assert!(text.trim_end().ends_with("[15, 15]])"), "{text}");
}

#[test]
fn a_sketch_is_drawn_by_keys() {
    let mut state = studio();
    letter(&mut state, 's');
    for _ in 0..3 {
        press(&mut state, KeyCode::Right);
        letter(&mut state, ' ');
    }
    let text = written(&press(&mut state, KeyCode::Enter));
    assert!(text.contains(".path([["), "{text}");
    assert_eq!(text.matches('[').count(), 4);
}

#[test]
fn the_curve_of_a_sketch_is_shown_while_it_is_drawn() {
    let mut state = studio();
    letter(&mut state, 's');
    let window = crate::tui::panels::map::window(&state);
    // The view stays, for the curve that comes may lie elsewhere.
    assert_eq!(state.window, Some(window));
    let before = state.loom().unwrap().time().clone();
    let mut asked = Vec::new();
    for _ in 0..3 {
        press(&mut state, KeyCode::Right);
        asked = letter(&mut state, ' ');
    }
    let [Command::Hands(Errand::Try(question))] = &asked[..] else {
        panic!("{asked:?}");
    };
    let number = question.number;
    let curve = Trials::default().show(question.clone()).unwrap();
    let Content::Loom(expected, _) = curve.clone() else {
        panic!("no loom");
    };
    tell(&mut state, Reply::Tried(number, Ok(curve)));
    assert_eq!(state.loom().unwrap().time(), expected.of.0.time());
    assert_ne!(*state.loom().unwrap().time(), before);
    press(&mut state, KeyCode::Esc);
    assert_eq!(*state.loom().unwrap().time(), before);
}

#[test]
fn frames_are_pinned_though_time_is_edited() {
    let mut state = studio();
    let number = run_of(&letter(&mut state, 'R')).unwrap().number;
    // The recipe gives a longer motion than what was fitted.
    let (longer, fitted) = (result(30).unwrap(), result(15).unwrap());
    let ran = Ran {
        pinning: fitted.pinning,
        ..*longer
    };
    tell(&mut state, Reply::Ran(number, Ok(Box::new(ran))));
    assert_eq!(state.frames(), 30);
    let places = ring(20, 15, false).layout().positions.clone();
    let from = cell(&state, MAP, places[9]);
    let middle = MouseEventKind::Down(MouseButton::Middle);
    mouse(&mut state, middle, from);
    assert!(
        matches!(state.hands.held, Some(Held::Pin(..))),
        "{:?}",
        state.hands.held
    );
    let drag = MouseEventKind::Drag(MouseButton::Middle);
    let asked = mouse(&mut state, drag, (from.0 + 2, from.1));
    assert!(matches!(&asked[..], [Command::Hands(Errand::Try(_))]));
    let up = MouseEventKind::Up(MouseButton::Middle);
    let text = written(&mouse(&mut state, up, (from.0 + 2, from.1)));
    assert!(text.contains(".reverse()\n    .pin("), "{text}");
    // By key, the frame whose place is nearest to the cursor.
    let there = state.cursor().unwrap();
    letter(&mut state, 'i');
    let Some(Held::Pin(frame, _)) = state.hands.held else {
        panic!("{:?}", state.hands.held);
    };
    let away = |at: [f64; 2]| (at[0] - there[0]).hypot(at[1] - there[1]);
    assert!(places.iter().all(|&at| away(places[frame]) <= away(at)));
}

#[test]
fn pictures_are_coarse_while_the_hand_moves_and_fine_when_it_rests() {
    let mut state = studio();
    state.cell.scales = true;
    let sizes = |commands: Vec<Command>| -> Vec<(usize, usize)> {
        let drawn = commands.into_iter().filter_map(|command| match command {
            Command::Draw {
                panel: MAP, wish, ..
            } => Some(wish.size),
            _ => None,
        });
        drawn.collect()
    };
    let whole = state.slots[MAP].asked.as_ref().unwrap().size;
    letter(&mut state, 'd');
    let right = KeyEvent::new(KeyCode::Right, KeyModifiers::NONE);
    let moved = sizes(update(&mut state, Event::Key(right)));
    assert_eq!(moved, [(whole.0 / 2, whole.1 / 2)]);
    assert!(state.is_unsettled());
    assert_eq!(sizes(update(&mut state, Event::Still)), [whole]);
    assert!(!state.is_unsettled());
}

#[test]
fn a_press_aimed_at_the_map_of_a_moment_ago_takes_what_was_there() {
    let mut state = studio();
    state.thumbs.off = true;
    let at = state.loom().unwrap().time().controls()[7];
    let place = cell(&state, MAP, at);
    // The same motion in another view: the point is somewhere else now.
    let [x, y] = crate::tui::panels::map::window(&state);
    let aside = |range: [f64; 2]| range.map(|end| end + 0.4 * (range[1] - range[0]));
    state.window = Some([aside(x), y]);
    send(&mut state, Event::Tick(std::time::Duration::ZERO));
    assert_ne!(cell(&state, MAP, at), place);
    let down = MouseEventKind::Down(MouseButton::Left);
    mouse(&mut state, down, place);
    assert!(matches!(state.hands.held, Some(Held::Control(7, _))));
    press(&mut state, KeyCode::Esc);
    send(&mut state, Event::Still);
    mouse(&mut state, down, place);
    assert_eq!(state.hands.held, None);
}

#[test]
fn answers_to_older_runs_are_dropped_and_errors_keep_the_last_result() {
    let mut state = studio();
    let first = run_of(&letter(&mut state, 'R')).unwrap().number;
    let second = run_of(&letter(&mut state, 'R')).unwrap().number;
    tell(&mut state, Reply::Ran(first, result(30)));
    assert_eq!(state.frames(), 15);
    let error = Diagnostic::error("wrong").in_file("r.rhai").at_line(1);
    tell(&mut state, Reply::Ran(second, Err(Box::new(error))));
    assert_eq!(state.frames(), 15);
    assert_eq!(state.hands.page.error.as_ref().unwrap().message, "wrong");
    let third = run_of(&letter(&mut state, 'R')).unwrap().number;
    tell(&mut state, Reply::Ran(third, result(30)));
    assert!(state.frames() == 30 && state.hands.page.error.is_none());
}

#[test]
fn what_somebody_else_wrote_goes_before_a_gesture_and_undo_goes_over_both() {
    let mut state = studio();
    letter(&mut state, 'R');
    let commands = tell(&mut state, Reply::Overtaken("demo(\"bar\")".into()));
    let run = run_of(&commands).unwrap();
    assert!(!run.save && run.recipe.text == "demo(\"bar\")");
    assert_eq!(
        written(&letter(&mut state, 'u')),
        "fit(input())\n    .reverse()\n"
    );
    assert_eq!(written(&letter(&mut state, 'u')), START);
}

#[test]
fn a_lost_connection_keeps_what_is_in_hand_and_offers_it_again() {
    let mut state = studio();
    assert_eq!(update(&mut state, Event::Signal), [Command::Quit]);
    letter(&mut state, 'd');
    press(&mut state, KeyCode::Right);
    let commands = update(&mut state, Event::Signal);
    let [Command::Hands(Errand::Keep(Some(text))), Command::Quit] = &commands[..] else {
        panic!("{commands:?}");
    };
    assert!(text.contains(".move_control("));
    let mut next = studio();
    let recipe = next.hands.page.recipe.clone().unwrap();
    tell(&mut next, Reply::Found(recipe, true, Some(text.clone())));
    let commands = letter(&mut next, 'y');
    assert_eq!(written(&commands), *text);
    assert!(commands.contains(&Command::Hands(Errand::Keep(None))));
}

#[test]
fn a_text_that_could_not_be_written_is_kept() {
    let mut state = studio();
    letter(&mut state, 'R');
    let full = Diagnostic::error("the disk is full");
    let commands = tell(&mut state, Reply::NotWritten(Box::new(full)));
    assert!(matches!(
        &commands[..],
        [Command::Hands(Errand::Keep(Some(_)))]
    ));
    let left = letter(&mut state, 'q');
    assert!(matches!(
        &left[..],
        [Command::Hands(Errand::Keep(Some(_))), Command::Quit]
    ));
}

#[test]
fn sliders_write_the_default_or_set_it_for_the_session() {
    let mut state = studio();
    let param = |value: i64| Param {
        name: "times".into(),
        default: Setting::Integer(value),
        range: Some((1.0, 6.0)),
        value: Setting::Integer(value),
        line: 1,
    };
    state.hands.page.params = vec![param(2)];
    state.hands.page.recipe.as_mut().unwrap().text = "let t = param(\"times\", 2, 1, 6);\na".into();
    state.focus = RECIPE;
    let text = written(&press(&mut state, KeyCode::Right));
    assert!(text.starts_with("let t = param(\"times\", 3, 1, 6);"));
    state.hands.page.recipe.as_mut().unwrap().text = "let t = param(\"times\", n, 1, 6);\na".into();
    let commands = press(&mut state, KeyCode::Right);
    let run = run_of(&commands).unwrap();
    assert!(!run.save && run.settings == [("times".to_string(), "4".to_string())]);
}

#[test]
fn the_panel_shows_the_error_at_its_line_at_any_size() {
    let mut state = studio();
    let error = Diagnostic::error("no function `fot` that anybody here has ever heard of")
        .in_file("r.rhai")
        .at_line(1)
        .at_column(5)
        .hint("did you mean `fit`?");
    letter(&mut state, 'R');
    let number = state.hands.runs;
    tell(&mut state, Reply::Ran(number, Err(Box::new(error))));
    state.hands.page.params = vec![Param {
        name: "a rather long name of a parameter".into(),
        default: Setting::Flag(true),
        range: None,
        value: Setting::Flag(true),
        line: 1,
    }];
    let drawn = |width: u16, height: u16| -> Vec<String> {
        let area = ratatui::layout::Rect::new(0, 0, width, height);
        let mut buffer = ratatui::buffer::Buffer::empty(area);
        PANELS[RECIPE].draw(&state, area, &mut buffer);
        let rows = buffer.content.chunks(usize::from(width));
        rows.map(|row| row.iter().map(|cell| cell.symbol()).collect())
            .collect()
    };
    let rows = drawn(40, 12);
    assert!(rows[1].starts_with("  1 fit(input())"), "{rows:#?}");
    assert!(rows[2].starts_with("        ^"), "{rows:#?}");
    assert!(rows[3].trim().starts_with("no function"), "{rows:#?}");
    assert!(rows.iter().any(|row| row.contains("hint: did you mean")));
    assert!(rows[11].contains("●"), "{rows:#?}");
    // A line too long is broken, and the caret stands below its part.
    let rows = drawn(12, 20);
    assert!(rows[1].starts_with("  1 fit(inpu"), "{rows:#?}");
    assert!(rows[2].starts_with("        ^") && rows[3].starts_with("    t())"));
    for (width, height) in [(1, 1), (2, 3), (5, 2), (200, 60)] {
        drawn(width, height);
    }
}

#[test]
fn a_small_screen_says_what_the_recipe_panel_would_show() {
    let mut state = studio();
    send(&mut state, Event::Resize(80, 24));
    let commands = letter(&mut state, 'R');
    assert_eq!(state.notice.as_ref().unwrap().text, "2: .reverse()");
    let number = run_of(&commands).unwrap().number;
    let error = Diagnostic::error("wrong").in_file("r.rhai").at_line(2);
    tell(&mut state, Reply::Ran(number, Err(Box::new(error))));
    let notice = state.notice.as_ref().unwrap();
    assert!(notice.bad && notice.text == "line 2: wrong");
}

#[test]
fn nothing_can_be_edited_before_the_recipe_has_given_a_loom() {
    let mut state = studio();
    state.hands.good = None;
    state.content = Content::Nothing;
    for key in ['d', 'i', 's', 't', 'R', 'H', '{'] {
        assert!(run_of(&letter(&mut state, key)).is_none());
        assert_eq!(state.hands.held, None);
    }
}
