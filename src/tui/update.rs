//! What an event means: the state changes, and commands say what is to be done. Nothing is drawn here.

use std::time::Duration;

use ratatui::crossterm::event::{KeyCode, KeyEvent, MouseButton, MouseEvent, MouseEventKind};
use ratatui::layout::Rect;

use super::event::{Answer, Command, Event};
use super::graphics::{Choice, Protocol};
use super::hands;
use super::keys::{self, Action};
use super::layout::{tabbed, tabs};
use super::panels::{MAP, MESH, PANELS, TIME, map, mesh};
use super::state::{Aspect, Content, Drag, Front, Notice, State};

/// Slowest and fastest playback.
const SPEEDS: [f64; 8] = [0.1, 0.125, 0.25, 0.5, 1.0, 2.0, 4.0, 8.0];
/// A key press turns the mesh by this, in radians.
const TURN: f64 = 0.15;
/// A column that the mouse passes turns the mesh by this.
const TURN_PER_CELL: f64 = 0.04;
/// A step closer.
const CLOSER: f64 = 0.8;
/// A key press moves the map's view or a roaming cursor by this share of what is shown.
const SHARES: [f64; 2] = [0.1, 0.02];

/// Decides what `event` means.
pub(super) fn update(state: &mut State, event: Event) -> Vec<Command> {
    let mut commands = match event {
        Event::Key(key) => on_key(state, key),
        Event::Mouse(mouse) => on_mouse(state, mouse),
        Event::Resize(columns, rows) => {
            state.size = (columns, rows);
            vec![Command::Redraw]
        }
        Event::Tick(passed) => {
            advance(state, passed);
            Vec::new()
        }
        Event::Still => {
            state.rough = false;
            for slot in &mut state.slots {
                slot.before = None;
            }
            Vec::new()
        }
        Event::Answer(answer) => match answer {
            Answer::Hands(reply) => hands::reply(state, reply),
            Answer::Terminal(choice, dark) => present(state, choice, dark),
            answer => {
                on_answer(state, answer);
                Vec::new()
            }
        },
        Event::Signal => quit(state, true),
    };
    if let (None, Content::Loom(scene, _)) = (&state.fitted, &state.content) {
        state.fitted = Some(scene.clone());
    }
    commands.extend(questions(state));
    commands
}

/// The terminal has said what it can show.
fn present(state: &mut State, choice: Box<Choice>, dark: bool) -> Vec<Command> {
    state.look.dark = dark;
    state.cell = choice.cell;
    state.plain_letters = choice.protocol == Protocol::Ascii;
    for slot in &mut state.slots {
        (slot.shown, slot.asked) = (None, None);
    }
    vec![Command::Present(choice)]
}

/// The end; what is not saved is kept.
fn quit(state: &State, lost: bool) -> Vec<Command> {
    let mut commands = hands::leave(state, lost);
    commands.push(Command::Quit);
    commands
}

/// Pictures that are wanted now and have not been asked for.
fn questions(state: &mut State) -> Vec<Command> {
    let mut commands = Vec::new();
    for (index, area) in state.places() {
        let wish = PANELS[index].wish(state, state.canvas(index, area));
        if wish.is_none() || wish == state.slots[index].asked {
            continue;
        }
        state.asked += 1;
        let number = state.asked;
        state.slots[index].asked.clone_from(&wish);
        commands.extend(wish.map(|wish| Command::Draw {
            panel: index,
            number,
            wish,
        }));
    }
    commands.extend(thumbs_question(state));
    commands
}

/// Small meshes for the map that is shown, unless they have been asked for.
fn thumbs_question(state: &mut State) -> Option<Command> {
    // What is in hand goes first: the small meshes follow when it is let go.
    if state.hands.held.is_some() && state.thumbs.asked.is_some() {
        return None;
    }
    let wish = map::thumbs(state)?;
    if state.thumbs.asked.as_ref() == Some(&wish) {
        return None;
    }
    state.asked += 1;
    state.thumbs.asked = Some(wish.clone());
    Some(Command::DrawThumbs(state.asked, wish))
}

fn on_answer(state: &mut State, answer: Answer) {
    match answer {
        Answer::Opened(content, warnings) => {
            if let Content::Capture(scene) = &*content {
                state.capture = Some(scene.clone());
            }
            state.content = *content;
            state.playback.t = state.playback.t.min(state.frames() as f64);
            if let Some(warning) = warnings.first() {
                say(state, warning.message.clone(), false);
            }
        }
        Answer::Progress(phase, done, steps) => state.work = Some((phase, done, steps)),
        Answer::Failed(error) => {
            state.work = None;
            say(state, error.to_string().replace("\n  ", "; "), true);
        }
        Answer::Drawn {
            panel,
            number,
            picture,
        } => {
            let slot = &mut state.slots[panel];
            if number > slot.number {
                slot.number = number;
                slot.show(picture);
            }
        }
        Answer::Thumbs { number, thumbs } => {
            if number >= state.thumbs.number {
                state.thumbs.number = number;
                state.thumbs.shown = Some(thumbs);
            }
        }
        Answer::Saved(path) => {
            state.work = None;
            say(state, format!("written: {}", path.display()), false);
        }
        Answer::NotSaved(error) => {
            state.work = None;
            say(state, error.to_string().replace("\n  ", "; "), true);
        }
        Answer::Hands(_) | Answer::Terminal(..) => {}
    }
}

fn say(state: &mut State, text: String, bad: bool) {
    state.notice = Some(Notice { text, bad });
}

/// Time passes: around the loop.
fn advance(state: &mut State, passed: Duration) {
    if !state.playback.playing {
        return;
    }
    let span = state.span();
    let step = passed.as_secs_f64() * state.fps() * state.playback.speed;
    let next = state.playback.t + step;
    let length = span.to - span.from;
    state.playback.t = if next <= span.to && next >= span.from {
        next
    } else if length > 0.0 {
        span.from + (next - span.from).rem_euclid(length)
    } else {
        span.from
    };
}

fn on_key(state: &mut State, key: KeyEvent) -> Vec<Command> {
    state.notice = None;
    match state.front.take() {
        Some(Front::Help(line)) => on_help_key(state, key, line),
        Some(Front::Palette(typed, chosen)) => on_palette_key(state, key, typed, chosen),
        None => match hands::key(state, key) {
            Some(commands) => commands,
            None => keys::action(key).map_or_else(Vec::new, |action| act(state, action)),
        },
    }
}

fn on_help_key(state: &mut State, key: KeyEvent, line: u16) -> Vec<Command> {
    let last = keys::ACTIONS.len() as u16 - 1;
    let line = match key.code {
        KeyCode::Down | KeyCode::Char('j') => (line + 1).min(last),
        KeyCode::Up | KeyCode::Char('k') => line.saturating_sub(1),
        _ => return Vec::new(),
    };
    state.front = Some(Front::Help(line));
    Vec::new()
}

fn on_palette_key(
    state: &mut State,
    key: KeyEvent,
    mut typed: String,
    mut chosen: usize,
) -> Vec<Command> {
    let found = keys::find(&typed);
    match key.code {
        KeyCode::Esc => return Vec::new(),
        KeyCode::Enter => {
            let action = found.get(chosen).map(|binding| binding.action);
            return action.map_or_else(Vec::new, |action| act(state, action));
        }
        KeyCode::Down => chosen = (chosen + 1).min(found.len().saturating_sub(1)),
        KeyCode::Up => chosen = chosen.saturating_sub(1),
        KeyCode::Backspace => {
            typed.pop();
            chosen = 0;
        }
        KeyCode::Char(letter) => {
            typed.push(letter);
            chosen = 0;
        }
        _ => {}
    }
    state.front = Some(Front::Palette(typed, chosen));
    Vec::new()
}

fn act(state: &mut State, action: Action) -> Vec<Command> {
    match action {
        Action::Back => go(state, [-1.0, 0.0], -1.0),
        Action::Forward => go(state, [1.0, 0.0], 1.0),
        Action::BackFar => go(state, [0.0, -1.0], -10.0),
        Action::ForwardFar => go(state, [0.0, 1.0], 10.0),
        Action::First => scrub(state, 1.0),
        Action::Last => scrub(state, f64::INFINITY),
        Action::Play => {
            state.roaming = None;
            state.playback.playing = !state.playback.playing && state.frames() > 1;
        }
        Action::Slower => change_speed(state, -1),
        Action::Faster => change_speed(state, 1),
        Action::MarkStart => state.playback.marks[0] = Some(state.playback.t),
        Action::MarkEnd => state.playback.marks[1] = Some(state.playback.t),
        Action::Unmark => state.playback.marks = [None; 2],
        Action::NextPanel => state.focus = (state.focus + 1) % PANELS.len(),
        Action::PreviousPanel => state.focus = (state.focus + PANELS.len() - 1) % PANELS.len(),
        Action::Enlarge => state.enlarged = !state.enlarged,
        Action::ViewLeft => move_view(state, [-1.0, 0.0]),
        Action::ViewRight => move_view(state, [1.0, 0.0]),
        Action::ViewUp => move_view(state, [0.0, 1.0]),
        Action::ViewDown => move_view(state, [0.0, -1.0]),
        Action::CloserIn => zoom(state, state.focus, CLOSER, None),
        Action::FartherOut => zoom(state, state.focus, 1.0 / CLOSER, None),
        Action::ShowAll => show_all(state),
        Action::Roam => roam(state),
        Action::Wires => state.mesh.wires = !state.mesh.wires,
        Action::Onion => state.mesh.onion = !state.mesh.onion,
        Action::Thumbs => state.thumbs.off = !state.thumbs.off,
        Action::Errors => toggle(state, Aspect::Errors),
        Action::Before => toggle(state, Aspect::Before),
        Action::Help => state.front = Some(Front::Help(0)),
        Action::Palette => state.front = Some(Front::Palette(String::new(), 0)),
        Action::Leave => {
            state.roaming = None;
            state.hands.key = None;
        }
        Action::SavePicture => return save_picture(state),
        Action::Export => return export(state),
        Action::Redraw => return vec![Command::Redraw],
        Action::Suspend => return vec![Command::Suspend],
        Action::Quit => return quit(state, false),
        by_hand => return hands::act(state, by_hand),
    }
    Vec::new()
}

/// A step: of time on the curve, of place off it.
fn go(state: &mut State, direction: [f64; 2], frames: f64) {
    let Some(at) = state.roaming else {
        // Between frames, to the next one.
        let t = state.playback.t + frames;
        let whole = if frames < 0.0 { t.ceil() } else { t.floor() };
        return scrub(state, whole);
    };
    let [x, y] = map::window(state);
    let step = [x, y].map(|range| SHARES[1] * (range[1] - range[0]));
    state.roaming = Some([0, 1].map(|i| at[i] + direction[i] * step[i]));
}

/// To a time, as near as there is one; the cursor is on the curve.
pub(super) fn scrub(state: &mut State, t: f64) {
    state.roaming = None;
    state.playback.playing = false;
    state.playback.t = t.clamp(1.0, state.frames() as f64);
}

fn change_speed(state: &mut State, by: isize) {
    let speed = state.playback.speed;
    let nearest = |&index: &usize| (100.0 * (SPEEDS[index] / speed).ln().abs()) as u64;
    let index = (0..SPEEDS.len()).min_by_key(nearest).unwrap_or(0);
    state.playback.speed = SPEEDS[index.saturating_add_signed(by).min(SPEEDS.len() - 1)];
}

/// Leaves the curve where it is, or returns to it.
fn roam(state: &mut State) {
    if state.roaming.take().is_none() && state.roams() {
        state.playback.playing = false;
        state.roaming = state.cursor();
    }
}

fn move_view(state: &mut State, [right, up]: [f64; 2]) {
    if state.focus == MAP && state.signals().is_some() {
        let window = map::window(state);
        let shift = [right, up];
        state.window = Some([0, 1].map(|i| {
            let step = SHARES[0] * shift[i] * (window[i][1] - window[i][0]);
            window[i].map(|end| end + step)
        }));
    } else if state.focus == MESH {
        orbit(state, right * TURN, up * TURN);
    }
}

/// Shows that aspect of the mesh, or no longer.
fn toggle(state: &mut State, aspect: Aspect) {
    let lacking = match aspect {
        Aspect::Errors if state.capture.is_none() => {
            "a loom keeps no frames: open its capture to see the errors"
        }
        Aspect::Errors if mesh::comparable(state).is_none() => {
            "the frames are no longer the capture's"
        }
        Aspect::Before if state.fitted.is_none() => "there is no loom yet",
        _ => "",
    };
    if state.aspect == aspect {
        state.aspect = Aspect::Plain;
    } else if lacking.is_empty() {
        state.aspect = aspect;
    } else {
        say(state, lacking.to_string(), true);
    }
}

fn orbit(state: &mut State, yaw: f64, pitch: f64) {
    let quarter = std::f64::consts::FRAC_PI_2;
    state.mesh.yaw = (state.mesh.yaw + yaw) % (4.0 * quarter);
    state.mesh.pitch = (state.mesh.pitch + pitch).clamp(-quarter, quarter);
}

/// Shows `factor` times as much of a panel; what lies at `about` stays there (none: the cursor).
fn zoom(state: &mut State, panel: usize, factor: f64, about: Option<[f64; 2]>) {
    if panel == MESH {
        state.mesh.zoom = (state.mesh.zoom * factor).clamp(0.02, 10.0);
    } else if panel == MAP && state.signals().is_some() {
        let window = map::window(state);
        let middle = window.map(|range| 0.5 * (range[0] + range[1]));
        let about = about.or(state.cursor()).unwrap_or(middle);
        let zoomed = [0, 1].map(|i| window[i].map(|end| about[i] + factor * (end - about[i])));
        let width = zoomed[0][1] - zoomed[0][0];
        let scale = about[0].abs().max(about[1].abs()).max(f64::MIN_POSITIVE);
        // Closer, neighbouring numbers could no longer be told apart on the axes.
        if width.is_finite() && width > 1e-9 * scale {
            state.window = Some(zoomed);
        }
    }
}

fn show_all(state: &mut State) {
    state.window = None;
    state.mesh.zoom = 1.0;
    let fresh = super::state::MeshView::default();
    if state.focus == MESH {
        (state.mesh.yaw, state.mesh.pitch) = (fresh.yaw, fresh.pitch);
    }
}

fn save_picture(state: &mut State) -> Vec<Command> {
    let panel = &PANELS[state.focus];
    let Some(wish) = panel.picture(state) else {
        say(
            state,
            format!("the {} panel has no picture yet", panel.title_of(state)),
            true,
        );
        return Vec::new();
    };
    let frame = state.playback.t;
    let name = format!("{}-{frame:.0}.png", panel.title_of(state).replace(' ', "-"));
    vec![Command::SavePicture(name, wish)]
}

fn export(state: &mut State) -> Vec<Command> {
    match state.content {
        Content::Capture(_) | Content::Loom(..) | Content::Keys(_) | Content::Poses(_) => {
            say(state, "writing frames ..".to_string(), false);
            vec![Command::Export(state.span())]
        }
        _ => {
            say(state, "nothing to write yet".to_string(), true);
            Vec::new()
        }
    }
}

fn on_mouse(state: &mut State, mouse: MouseEvent) -> Vec<Command> {
    if state.front.is_some() {
        if matches!(mouse.kind, MouseEventKind::Down(_)) {
            state.front = None;
        }
        return Vec::new();
    }
    state.hover = Some((mouse.column, mouse.row));
    if let Some(commands) = hands::mouse(state, mouse) {
        return commands;
    }
    match mouse.kind {
        MouseEventKind::Down(button) => press(state, mouse, button),
        MouseEventKind::Drag(_) => drag(state, mouse),
        MouseEventKind::Up(_) => state.drag = None,
        MouseEventKind::ScrollUp => turn_wheel(state, mouse, CLOSER),
        MouseEventKind::ScrollDown => turn_wheel(state, mouse, 1.0 / CLOSER),
        _ => {}
    }
    Vec::new()
}

/// The panel under the mouse, and where.
pub(super) fn under(state: &State, mouse: MouseEvent) -> Option<(usize, Rect)> {
    let at = (mouse.column, mouse.row).into();
    state
        .places()
        .into_iter()
        .find(|(_, area)| area.contains(at))
}

fn press(state: &mut State, mouse: MouseEvent, button: MouseButton) {
    if mouse.row == 0 && tabbed(state.size) && !state.enlarged {
        let hit = |(_, column, text): &(usize, u16, String)| {
            (*column..column + text.chars().count() as u16).contains(&mouse.column)
        };
        if let Some((index, ..)) = tabs().into_iter().find(hit) {
            state.focus = index;
        }
        return;
    }
    let Some((panel, area)) = under(state, mouse) else {
        return;
    };
    state.focus = panel;
    let view = button != MouseButton::Left;
    state.drag = Some(Drag {
        panel,
        column: mouse.column,
        row: mouse.row,
        view,
    });
    if !view {
        point(state, panel, area, mouse);
    }
}

fn drag(state: &mut State, mouse: MouseEvent) {
    let Some(held) = state.drag else { return };
    let moved = [
        f64::from(mouse.column) - f64::from(held.column),
        f64::from(mouse.row) - f64::from(held.row),
    ];
    state.drag = Some(Drag {
        column: mouse.column,
        row: mouse.row,
        ..held
    });
    let Some((_, area)) = state
        .places()
        .into_iter()
        .find(|(panel, _)| *panel == held.panel)
    else {
        return;
    };
    if held.panel == MESH {
        orbit(
            state,
            -TURN_PER_CELL * moved[0],
            2.0 * TURN_PER_CELL * moved[1],
        );
    } else if held.view && held.panel == MAP {
        let inside = state.canvas(MAP, area);
        let window = map::window(state);
        let cells = [
            f64::from(inside.width.max(1)),
            -f64::from(inside.height.max(1)),
        ];
        state.window = Some([0, 1].map(|i| {
            let step = moved[i] / cells[i] * (window[i][1] - window[i][0]);
            window[i].map(|end| end - step)
        }));
    } else {
        point(state, held.panel, area, mouse);
    }
}

/// The left button at a place of the map or of time.
fn point(state: &mut State, panel: usize, area: Rect, mouse: MouseEvent) {
    let Some(picture) = state.slots[panel].shown.clone() else {
        return;
    };
    let canvas = state.canvas(panel, area);
    let at = picture.pixel(canvas, (mouse.column, mouse.row));
    if panel == TIME && state.poses().is_none() {
        let t = picture.planes.first().map(|plane| plane.x.value(at[0]));
        if let Some(t) = t.filter(|t| t.is_finite()) {
            scrub(state, state.off_axis(t));
        }
    } else if panel == MAP
        && let Some(plane) = picture.planes.first()
    {
        let reach = 2.0 * picture.image.width as f32 / f32::from(canvas.width.max(1));
        match map::nearest_time(&picture, plane, at, reach) {
            Some(t) => scrub(state, t),
            None => {
                state.playback.playing = false;
                state.roaming = Some(plane.data(at)).filter(|_| state.roams());
            }
        }
    }
}

fn turn_wheel(state: &mut State, mouse: MouseEvent, factor: f64) {
    let Some((panel, area)) = under(state, mouse) else {
        return;
    };
    if panel == TIME {
        let t = state.playback.t + if factor < 1.0 { -1.0 } else { 1.0 };
        return scrub(state, t);
    }
    let about = state.slots[panel].shown.as_ref().and_then(|picture| {
        let plane = picture.planes.first()?;
        let canvas = state.canvas(panel, area);
        Some(plane.data(picture.pixel(canvas, (mouse.column, mouse.row))))
    });
    zoom(state, panel, factor, about);
}
