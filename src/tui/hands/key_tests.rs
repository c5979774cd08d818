//! Gestures on key poses and on poses with their modes.

use ratatui::crossterm::event::{KeyCode, KeyModifiers, MouseButton, MouseEvent, MouseEventKind};

use super::tests::{cell, letter, mouse, open_recipe, press, run_of, send, tell, written};
use super::trial::{Trials, What};
use super::{Errand, Ran, Reply};
use crate::pipeline::Side;
use crate::tui::event::{Command, Event};
use crate::tui::panels::{MAP, MESH, PANELS, TIME, arm_ends};
use crate::tui::posed::test_scenes::{four_poses, three_keys};
use crate::tui::state::{Content, State};
use crate::tui::work::{Pose, Subject};

const START: &str = "// ours\ncomplete(input(), #{ times: [1, 25, 49] }) // keys\n";

fn ran(state: &mut State, commands: &[Command], content: Content) {
    let number = run_of(commands).expect("a run").number;
    let ran = Ran {
        content: Some(content),
        pinning: None,
        params: Vec::new(),
        told: Vec::new(),
    };
    tell(state, Reply::Ran(number, Ok(Box::new(ran))));
}

/// A studio with three key poses.
fn studio() -> State {
    let (mut state, commands) = open_recipe(START);
    ran(&mut state, &commands, three_keys([1.0, 25.0, 49.0], vec![]));
    state
}

const LEFT: MouseButton = MouseButton::Left;

fn drag(state: &mut State, from: (u16, u16), to: (u16, u16)) -> Vec<Command> {
    mouse(state, MouseEventKind::Down(LEFT), from);
    let mut commands = mouse(state, MouseEventKind::Drag(LEFT), to);
    commands.extend(mouse(state, MouseEventKind::Up(LEFT), to));
    commands
}

/// What is shown of a preview that was asked for.
fn tried(commands: &[Command]) -> Content {
    let question = commands.iter().find_map(|command| match command {
        Command::Hands(Errand::Try(question)) => Some(question.clone()),
        _ => None,
    });
    let question = question.expect("a preview");
    assert!(matches!(question.what, What::Keys(_)));
    Trials::default().show(question).unwrap()
}

#[test]
fn a_key_dragged_in_time_is_one_number_of_its_line_and_undone() {
    let mut state = studio();
    let at = cell(&state, TIME, [25.0, 0.0]);
    let there = (at.0 + 4, at.1);
    mouse(&mut state, MouseEventKind::Down(LEFT), at);
    assert_eq!(state.hands.key, Some(1));
    let commands = mouse(&mut state, MouseEventKind::Drag(LEFT), there);
    let Content::Keys(shown) = tried(&commands) else {
        panic!("keys");
    };
    let time = shown.motion().controls().times[1];
    assert!(time > 25.0 && time.fract() == 0.0);
    // Frames go on to the last key; what is in hand has none of its own yet.
    assert!(shown.frames.is_none() && shown.motion().frames().len() == 49);
    let commands = mouse(&mut state, MouseEventKind::Up(LEFT), there);
    let text = written(&commands);
    assert_eq!(text, START.replace("25", &format!("{time}")));
    ran(&mut state, &commands, three_keys([1.0, time, 49.0], vec![]));
    assert_eq!(
        (
            state.hands.key,
            state.keys().unwrap().motion().controls().times[1]
        ),
        (Some(1), time)
    );
    assert_eq!(written(&letter(&mut state, 'u')), START);
}

#[test]
fn keys_do_what_the_mouse_does_with_times() {
    let mut state = studio();
    letter(&mut state, 'n');
    assert_eq!((state.hands.key, state.playback.t), (Some(0), 1.0));
    letter(&mut state, 'n');
    assert_eq!((state.hands.key, state.playback.t), (Some(1), 25.0));
    letter(&mut state, 't');
    for _ in 0..3 {
        press(&mut state, KeyCode::Right);
    }
    press(&mut state, KeyCode::Up);
    let commands = press(&mut state, KeyCode::Enter);
    assert_eq!(written(&commands), START.replace("25", "28.1"));
    // The other way, and never past a neighbour.
    let mut state = studio();
    letter(&mut state, 'N');
    letter(&mut state, 't');
    press(&mut state, KeyCode::Left);
    for _ in 0..9 {
        let shifted = KeyModifiers::SHIFT;
        let key = ratatui::crossterm::event::KeyEvent::new(KeyCode::Right, shifted);
        send(&mut state, Event::Key(key));
    }
    let commands = press(&mut state, KeyCode::Enter);
    assert_eq!(written(&commands), START.replace("[1,", "[24.95,"));
}

#[test]
fn a_handle_is_turned_by_keys_put_back_and_dropped() {
    let mut state = studio();
    letter(&mut state, 'n');
    letter(&mut state, 'n');
    letter(&mut state, 'd');
    for _ in 0..4 {
        press(&mut state, KeyCode::Up);
    }
    press(&mut state, KeyCode::Left);
    let commands = letter(&mut state, '.');
    let Content::Keys(shown) = tried(&commands) else {
        panic!("keys");
    };
    let handle = shown.motion().controls().handles[1];
    assert!((handle.tension - 0.2).abs() < 1e-12 && (handle.bias + 0.05).abs() < 1e-12);
    let commands = press(&mut state, KeyCode::Enter);
    let wanted =
        "times: [1, 25, 49], tension: [0, 0.2, 0], continuity: [0, 0.05, 0], bias: [0, -0.05, 0] }";
    assert!(
        written(&commands).contains(wanted),
        "{}",
        written(&commands)
    );
    // Turned and turned back is nothing, and so is what is put back.
    for end in [vec!['0'], vec!['u']] {
        let mut state = studio();
        let shown = state.keys().unwrap().clone();
        letter(&mut state, 'd');
        press(&mut state, KeyCode::Up);
        for key in end {
            letter(&mut state, key);
        }
        assert_eq!(press(&mut state, KeyCode::Enter), []);
        assert_eq!(state.keys(), Some(&shown));
    }
}

#[test]
fn an_arm_is_pulled_by_the_mouse_and_the_curve_follows() {
    for aside in [false, true] {
        let mut state = studio();
        let key = cell(&state, MAP, state.signals().unwrap().0.map.frames[1]);
        mouse(&mut state, MouseEventKind::Down(LEFT), key);
        mouse(&mut state, MouseEventKind::Up(LEFT), key);
        assert_eq!((state.hands.key, state.playback.t), (Some(1), 25.0));
        let ends = arm_ends(&state, 1);
        assert_eq!(ends.len(), 2);
        let (side, end) = ends[1];
        assert_eq!(side, Side::After);
        let from = cell(&state, MAP, end);
        let to = (from.0 - 5, from.1 + 2);
        let modifiers = if aside {
            KeyModifiers::CONTROL
        } else {
            KeyModifiers::NONE
        };
        let mut act = |kind, (column, row)| {
            let event = MouseEvent {
                kind,
                column,
                row,
                modifiers,
            };
            send(&mut state, Event::Mouse(event))
        };
        act(MouseEventKind::Down(LEFT), from);
        let commands = act(MouseEventKind::Drag(LEFT), to);
        let Content::Keys(shown) = tried(&commands) else {
            panic!("keys");
        };
        let handle = shown.motion().controls().handles[1];
        assert_eq!(
            (handle.continuity != 0.0, handle.bias != 0.0),
            (aside, !aside)
        );
        let commands = act(MouseEventKind::Up(LEFT), to);
        let text = written(&commands);
        assert!(
            text.contains(if aside {
                "continuity: [0, "
            } else {
                "bias: [0, "
            }),
            "{text}"
        );
    }
}

#[test]
fn a_motion_becomes_a_loom_and_poses_a_motion_or_statistics() {
    let mut state = studio();
    let made = START
        .replace("complete(", "fit(complete(")
        .replace("})", "}))");
    assert_eq!(written(&letter(&mut state, 'F')), made);
    let (mut state, commands) = open_recipe("pca(input())\n");
    ran(&mut state, &commands, four_poses());
    assert_eq!(written(&letter(&mut state, 'C')), "complete(input())\n");
    assert_eq!(written(&letter(&mut state, 'A')), "pca(input())\n");
    letter(&mut state, 'A');
    assert!(state.notice.is_some_and(|notice| notice.bad));
}

#[test]
fn what_a_loom_has_and_keys_have_not_is_said() {
    let mut state = studio();
    for key in ['a', 'H', 'i', 's', 'K'] {
        state.notice = None;
        assert!(run_of(&letter(&mut state, key)).is_none());
        assert!(
            state.notice.as_ref().is_some_and(|notice| notice.bad),
            "{key}"
        );
    }
}

/// What the mesh panel shows.
fn shape(state: &State) -> Pose {
    match PANELS[MESH].picture(state).unwrap().subject {
        Subject::Mesh { pose, .. } => pose,
        other => panic!("{other:?}"),
    }
}

#[test]
fn poses_are_walked_through_and_between() {
    let (mut state, commands) = open_recipe("pca(input())\n");
    ran(&mut state, &commands, four_poses());
    press(&mut state, KeyCode::Right);
    assert!(matches!(shape(&state), Pose::Frame(_, 1)));
    let third = cell(&state, MAP, state.signals().unwrap().0.map.frames[2]);
    mouse(&mut state, MouseEventKind::Down(LEFT), third);
    mouse(&mut state, MouseEventKind::Up(LEFT), third);
    assert!(matches!(shape(&state), Pose::Frame(_, 2)));
    letter(&mut state, 'c');
    press(&mut state, KeyCode::Left);
    let Pose::Modes(_, at) = shape(&state) else {
        panic!("a place");
    };
    assert!(at[0] < state.signals().unwrap().0.map.frames[2][0]);
    let mut state = studio();
    letter(&mut state, 'c');
    assert!(matches!(shape(&state), Pose::KeyPlace(..)));
}

#[test]
fn a_click_beside_keys_goes_there_and_a_drag_of_the_map_s_plane_too() {
    let mut state = studio();
    let at = cell(&state, TIME, [13.0, 0.0]);
    drag(&mut state, at, at);
    assert!((state.playback.t - 13.0).abs() < 1.0 && state.hands.key.is_none());
    // Between frames the motion itself is shown, at a frame the frame.
    state.playback.t = 13.5;
    assert!(matches!(shape(&state), Pose::Motion(_, time) if time == 13.5));
    state.playback.t = 13.0;
    assert!(matches!(shape(&state), Pose::Frame(_, 12)));
}
