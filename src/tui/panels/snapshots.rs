//! What a person sees, as text that a person can read: whole screens in letters, kept beside this file.

use std::sync::Arc;

use ratatui::crossterm::event::KeyCode;

use super::tests::{press, screen, send, studio_of};
use crate::loom::fit::{FitOptions, fit};
use crate::mesh::{Bounds, FrameSource, Sequence, Topology};
use crate::pipeline::CompleteRequest;
use crate::pipeline::plot::plot_loom;
use crate::recipe::Recipe;
use crate::task::Task;
use crate::tui::event::{Answer, Event};
use crate::tui::graphics::{CellSize, Protocol};
use crate::tui::hands::Reply;
use crate::tui::posed::frames;
use crate::tui::posed::test_scenes::motion;
use crate::tui::state::{Content, Same, Scene, Signals, State};

/// Frames of the bar's swing.
const FRAMES: usize = 16;
/// Rings of the bar.
const RINGS: usize = 12;

/// A square bar that bends from side to side and back a little higher.
fn bar(frames: usize) -> Sequence {
    let mut positions = Vec::new();
    for frame in 0..frames {
        let phase = std::f64::consts::TAU * frame as f64 / FRAMES as f64;
        let (bend, lift) = (0.9 * libm::sin(phase), 0.4 * libm::cos(phase));
        for ring in 0..=RINGS {
            let along = ring as f64 / RINGS as f64 - 0.5;
            let (turn, high) = (bend * along, lift * along * along);
            for corner in 0..4 {
                let (side, up) = (
                    [-0.12, 0.12, 0.12, -0.12][corner],
                    [-0.12, -0.12, 0.12, 0.12][corner],
                );
                let x = 2.0 * along + side * libm::sin(turn);
                let y = up + high - 1.2 * bend * along * along;
                positions.extend([x, y, side * libm::cos(turn)].map(|at| at as f32));
            }
        }
    }
    let mut faces = Vec::new();
    for ring in 0..RINGS as u32 {
        for corner in 0..4 {
            let (a, b) = (4 * ring + corner, 4 * ring + (corner + 1) % 4);
            faces.extend([[a, b, a + 4], [b, b + 4, a + 4]]);
        }
    }
    let topology = Topology::from_triangles(4 * (RINGS + 1), &faces).unwrap();
    Sequence::new(topology.into(), positions, Some(24.0))
}

/// The studio in letters with the bar open.
fn studio(size: (u16, u16), frames: usize) -> State {
    studio_by(Protocol::Ascii, size, frames)
}

/// The studio with the bar open: its frames, then the loom.
fn studio_by(protocol: Protocol, size: (u16, u16), frames: usize) -> State {
    let mut state = studio_of("bar", size, CellSize::of(protocol));
    state.plain_letters = protocol == Protocol::Ascii;
    let capture = bar(frames);
    let bounds = Bounds::of_frames(&capture).unwrap().unwrap();
    let options = FitOptions {
        left_out: false,
        // What it finds does not change as the other method learns.
        ..FitOptions::ch12()
    };
    let loom = fit(&capture, &options, &Task::default()).unwrap().output;
    let scene = Scene {
        of: Same::new(capture),
        bounds,
    };
    let opened = |content| Event::Answer(Answer::Opened(Box::new(content), Vec::new()));
    send(&mut state, opened(Content::Capture(scene)));
    let (map, times) = plot_loom(&loom);
    let scene = Scene {
        of: Same::new(loom),
        bounds,
    };
    let content = Content::Loom(scene, Same::new(Signals { map, times }));
    send(&mut state, opened(content));
    let recipe = Recipe {
        path: "bar.rhai".into(),
        text: "// to and fro\nfit(input())\n".into(),
    };
    let found = Reply::Found(recipe, false, None);
    send(&mut state, Event::Answer(Answer::Hands(found)));
    state
}

fn keys(state: &mut State, keys: &str) {
    for key in keys.chars() {
        press(state, KeyCode::Char(key));
    }
}

fn letters(state: &State) -> String {
    screen(state, Protocol::Ascii)
}

#[test]
fn a_small_screen_has_tabs() {
    let mut state = studio((80, 24), FRAMES);
    press(&mut state, KeyCode::Right);
    insta::assert_snapshot!("tabs_80x24", letters(&state));
}

#[test]
fn a_usual_screen_has_four_panels() {
    let mut state = studio((120, 36), FRAMES);
    keys(&mut state, "[");
    for _ in 0..5 {
        press(&mut state, KeyCode::Right);
    }
    keys(&mut state, "]");
    insta::assert_snapshot!("panels_120x36", letters(&state));
}

#[test]
fn a_large_screen_has_words_too() {
    let state = studio((240, 70), FRAMES);
    insta::assert_snapshot!("panels_240x70", letters(&state));
}

#[test]
fn without_colours_there_is_braille() {
    let mut state = studio_by(Protocol::Braille, (120, 36), FRAMES);
    keys(&mut state, "w");
    insta::assert_snapshot!("braille_120x36", screen(&state, Protocol::Braille));
}

#[test]
fn the_cursor_off_the_curve_and_a_closer_look() {
    let mut state = studio((80, 24), FRAMES);
    keys(&mut state, "++c");
    for _ in 0..6 {
        press(&mut state, KeyCode::Left);
    }
    insta::assert_snapshot!("roaming_80x24", letters(&state));
}

#[test]
fn before_and_after_stand_side_by_side() {
    let mut state = studio((80, 24), FRAMES);
    keys(&mut state, "b");
    for _ in 0..3 {
        press(&mut state, KeyCode::BackTab);
    }
    insta::assert_snapshot!("before_80x24", letters(&state));
}

#[test]
fn the_palette_finds_actions() {
    let mut state = studio((80, 24), FRAMES);
    keys(&mut state, ":loop");
    insta::assert_snapshot!("palette_80x24", letters(&state));
}

#[test]
fn one_frame_is_a_point_and_no_curve() {
    let state = studio((120, 36), 1);
    insta::assert_snapshot!("one_frame_120x36", letters(&state));
}

/// Four of the bar's frames, far from each other.
fn poses() -> Sequence {
    let all = bar(FRAMES);
    let frames = [0, 4, 10, 13].iter();
    let some = frames.flat_map(|&frame| all.frame(frame).to_vec());
    Sequence::new(Arc::clone(all.topology()), some.collect(), None)
}

/// The studio in letters with something that a recipe made.
fn studio_with(recipe: &str, size: (u16, u16), content: Content) -> State {
    let mut state = studio_of("poses", size, CellSize::of(Protocol::Ascii));
    state.plain_letters = true;
    let recipe = Recipe {
        path: "poses.rhai".into(),
        text: recipe.into(),
    };
    let found = Reply::Found(recipe, true, None);
    send(&mut state, Event::Answer(Answer::Hands(found)));
    state.hands.good = Some(content.clone());
    let opened = Answer::Opened(Box::new(content), Vec::new());
    send(&mut state, Event::Answer(opened));
    state
}

#[test]
fn key_poses_are_points_with_the_spline_through_them() {
    let request = CompleteRequest {
        times: Some(vec![1.0, 20.0, 30.0, 49.0]),
        bias: vec![0.0, 0.4, 0.0, 0.0],
        ..CompleteRequest::default()
    };
    let recipe = "complete(input(), #{ times: [1, 20, 30, 49], bias: [0, 0.4, 0, 0] })\n";
    let mut state = studio_with(recipe, (120, 36), motion(poses(), request));
    keys(&mut state, "nn");
    insta::assert_snapshot!("keys_120x36", letters(&state));
    keys(&mut state, "t");
    for _ in 0..5 {
        press(&mut state, KeyCode::Right);
    }
    insta::assert_snapshot!("key_in_hand_120x36", letters(&state));
}

#[test]
fn poses_are_points_by_their_first_modes() {
    let content = frames(poses(), vec![], &Task::default()).unwrap().unwrap();
    let mut state = studio_with("pca(input())\n", (240, 70), content);
    press(&mut state, KeyCode::Right);
    insta::assert_snapshot!("poses_240x70", letters(&state));
}
