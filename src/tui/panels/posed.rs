//! Key poses and poses with their modes, in the panels of the map and of time.

use ratatui::buffer::Buffer;
use ratatui::layout::Rect;
use ratatui::style::{Modifier, Style};

use super::cell_of;
use super::time::upright;
use crate::pipeline::{Handle, Side};
use crate::tui::posed::KeyScene;
use crate::tui::state::State;
use crate::tui::theme::Role;
use crate::tui::work::{Picture, Pose};

/// What the map is called where it shows poses.
pub(super) fn map_title(state: &State) -> Option<&'static str> {
    let keys = state.keys().map(|_| "keys");
    keys.or(state.poses().map(|_| "poses by their first modes"))
}

/// What the panel of time is called where it shows something of poses.
pub(super) fn time_title(state: &State) -> Option<&'static str> {
    let keys = state.keys().map(|_| "keys in time");
    keys.or(state.poses().map(|_| "shares of the modes"))
}

/// The pose at the cursor, from 0.
pub(super) fn pose(state: &State) -> usize {
    (state.playback.t.round() as usize).clamp(1, state.frames()) - 1
}

/// The shape of a motion at the cursor: the recipe's own frame where there is one or frames pass, else what
/// the motion is between them.
pub(super) fn motion(state: &State, keys: &KeyScene, place: Option<[f64; 2]>) -> Pose {
    let t = state.playback.t;
    let whole = state.playback.playing || t.fract() == 0.0;
    match (place, &keys.frames) {
        (Some(at), _) => Pose::KeyPlace(keys.motion.clone(), at),
        (None, Some(frames)) if whole => Pose::Frame(frames.clone(), pose(state)),
        _ => Pose::Motion(keys.motion.clone(), keys.motion().time_at(t)),
    }
}

/// The arms of the chosen key.
pub(super) fn arms(state: &State) -> Vec<[[f64; 2]; 2]> {
    let arms = |key| {
        let at = state.keys()?.signals.0.map.frames.get(key).copied()?;
        Some(
            ends(state, key)
                .into_iter()
                .map(|(_, end)| [at, end])
                .collect(),
        )
    };
    state.hands.key.and_then(arms).unwrap_or_default()
}

/// Where the arms of a key end, each with its side.
pub(in crate::tui) fn ends(state: &State, key: usize) -> Vec<(Side, [f64; 2])> {
    let Some(motion) = state.keys().map(KeyScene::motion) else {
        return Vec::new();
    };
    let Some(handle) = motion.controls().handles.get(key) else {
        return Vec::new();
    };
    let tangents = motion.tangents(key);
    let sides = [Side::Before, Side::After].into_iter();
    sides
        .filter_map(|side| Some((side, tangents.arm(*handle, side)?)))
        .collect()
}

/// Numbers of keys or poses, and the ends of arms, as letters where there are few pixels.
pub(super) fn draw_numbers(state: &State, picture: &Picture, canvas: Rect, buffer: &mut Buffer) {
    let (Some(plane), Some(signals)) = (picture.planes.first(), state.signals()) else {
        return;
    };
    if state.loom().is_some() {
        return;
    }
    let chosen = chosen(state);
    if !state.lettered() {
        for (index, &point) in signals.0.map.frames.iter().enumerate() {
            if let Some((x, y)) = cell_of(picture, plane, point, canvas) {
                let number = (index + 1).to_string();
                let room = usize::from(canvas.right() - x);
                let style = number_style(state, chosen == Some(index));
                buffer.set_stringn(x, y, number, room, style);
            }
        }
    }
    for [_, end] in arms(state) {
        let cell = cell_of(picture, plane, end, canvas);
        if let Some(cell) = cell.and_then(|at| buffer.cell_mut(at)) {
            let symbol = if state.plain_letters { "%" } else { "□" };
            cell.set_symbol(symbol)
                .set_style(state.look.style(Role::Mark));
        }
    }
}

/// The key that is chosen, or the pose at the cursor.
fn chosen(state: &State) -> Option<usize> {
    match state.poses() {
        Some(_) if state.roaming.is_none() => Some(pose(state)),
        _ => state.hands.key,
    }
}

fn number_style(state: &State, chosen: bool) -> Style {
    match chosen {
        true => state.look.style(Role::Accent).add_modifier(Modifier::BOLD),
        false => state.look.style(Role::Mark),
    }
}

/// What lies under the mouse on the map: a key or a pose, from 1.
pub(super) fn named(state: &State, index: usize) -> Option<String> {
    let name = |names: &[String]| match names.get(index - 1) {
        Some(name) => format!(" {name}"),
        None => String::new(),
    };
    if let Some(poses) = state.poses() {
        return Some(format!(" pose {index}{} ", name(&poses.names)));
    }
    let name = name(&state.keys()?.names);
    let controls = state.keys()?.motion().controls();
    let (time, handle) = (
        controls.times.get(index - 1)?,
        controls.handles.get(index - 1)?,
    );
    Some(format!(
        " key {index}{name} at {time:.4}{} ",
        turned(*handle)
    ))
}

/// The handle of a key in words; nothing where it has none.
fn turned(handle: Handle) -> String {
    if handle == Handle::default() {
        return String::new();
    }
    let Handle {
        tension,
        continuity,
        bias,
    } = handle;
    format!("  tension {tension:.2}  continuity {continuity:.2}  bias {bias:.2}")
}

/// Keys as upright lines, their numbers on top.
pub(super) fn draw_times(state: &State, picture: &Picture, area: Rect, buffer: &mut Buffer) {
    let Some(keys) = state.keys() else { return };
    for (index, &time) in keys.motion().controls().times.iter().enumerate() {
        let style = number_style(state, state.hands.key == Some(index));
        let line = if state.plain_letters { ":" } else { "┊" };
        let mut top = None;
        upright(picture, time, area, |x, y| {
            if let Some(cell) = buffer.cell_mut((x, y)) {
                cell.set_symbol(line).set_style(style);
            }
            top = top.or(Some((x, y)));
        });
        if let Some((x, y)) = top {
            let room = usize::from(area.right() - x);
            buffer.set_stringn(x, y, (index + 1).to_string(), room, style);
        }
    }
}

/// The course of a motion at a time, in words.
pub(super) fn values(keys: &KeyScene, time: f64) -> String {
    let motion = keys.motion();
    let [x, y] = motion.place(time);
    let key = motion.nearest_key(time);
    let controls = motion.controls();
    let turned = turned(controls.handles[key]);
    let (number, at) = (key + 1, controls.times[key]);
    format!(" time {time:.2}  p₁ {x:.4}  p₂ {y:.4}  key {number} at {at:.4}{turned} ")
}

/// What is open, for the status line.
pub(in crate::tui) fn words(state: &State) -> Option<String> {
    if let Some(keys) = state.keys() {
        let report = keys.motion().motion().report();
        return Some(format!("{} keys in {} ", report.keys, report.space));
    }
    let poses = state.poses()?;
    let (report, pose) = (poses.found.of.0.report(), pose(state));
    let name = poses.names.get(pose).map(|name| format!(" {name}"));
    let (name, number) = (name.unwrap_or_default(), pose + 1);
    Some(format!(
        "pose {number} of {}{name} in {} ",
        report.poses, report.space
    ))
}

/// What is known about it: names and values.
pub(super) fn facts(state: &State) -> Option<Vec<(String, String)>> {
    let percent = |value: f64| format!("{:.1} %", 100.0 * value);
    let fact = |name: &str, value: String| (name.to_string(), value);
    if let Some(keys) = state.keys() {
        let (motion, report) = (keys.motion(), keys.motion().motion().report());
        let controls = motion.controls();
        let mut facts = vec![
            fact("keys", report.keys.to_string()),
            fact("shape space", report.space.to_string()),
            fact("coordinates", report.dimension.to_string()),
            fact("in the plane", percent(motion.share())),
            fact("frames", motion.frames().len().to_string()),
        ];
        if let Some(ghost) = &report.ghost {
            facts.push(fact("faces of the ghost", ghost.faces.to_string()));
        }
        let each = controls.times.iter().zip(&controls.handles).enumerate();
        facts.extend(each.map(|(key, (time, handle))| {
            let value = format!("at {time:.4}{}", turned(*handle));
            (format!("key {}", key + 1), value)
        }));
        return Some(facts);
    }
    let report = state.poses()?.found.of.0.report();
    let mut facts = vec![
        fact("poses", report.poses.to_string()),
        fact("shape space", report.space),
        fact("coordinates", report.dimension.to_string()),
    ];
    let shares = report.explained.iter().enumerate();
    facts.extend(shares.map(|(mode, share)| (format!("mode {}", mode + 1), percent(*share))));
    Some(facts)
}
