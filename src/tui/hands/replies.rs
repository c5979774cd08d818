//! What the workers' answers mean.

use std::path::PathBuf;

use super::act::{changed_line, page_shown, replace, run};
use super::held::{Held, cancel};
use super::runner::Ran;
use super::{Errand, Reply};
use crate::diag::{Diagnostic, Severity};
use crate::recipe::Recipe;
use crate::recipe::gesture::write;
use crate::tui::event::Command;
use crate::tui::state::{Content, Notice, State};

fn say(state: &mut State, text: impl Into<String>, bad: bool) {
    let text = text.into();
    state.notice = Some(Notice { text, bad });
}

/// Decides what an answer means.
pub(in crate::tui) fn reply(state: &mut State, reply: Reply) -> Vec<Command> {
    match reply {
        Reply::Found(recipe, saved, offered) => found(state, recipe, saved, offered),
        Reply::Ready => {
            state.hands.ready = true;
            return run(state, false, Vec::new());
        }
        Reply::Ran(number, _) if number != state.hands.runs => {}
        Reply::Ran(_, ran) => done(state, ran),
        Reply::Written(path) | Reply::Edited(Ok(path)) => in_file(state, path),
        Reply::NotWritten(error) => {
            say(state, error.to_string().replace("\n  ", "; "), true);
            let text = state.hands.page.text().to_string();
            return vec![Command::Hands(Errand::Keep(Some(text)))];
        }
        Reply::Overtaken(text) => {
            let commands = changed(state, text);
            say(
                state,
                "the recipe was changed by somebody else: the gesture was not written",
                true,
            );
            return commands;
        }
        Reply::Changed(Some(text)) => return changed(state, text),
        Reply::Changed(None) => return run(state, false, Vec::new()),
        Reply::Tried(number, tried) => shown(state, number, tried),
        Reply::Edited(Err(error)) => say(state, error.to_string().replace("\n  ", "; "), true),
    }
    Vec::new()
}

fn found(state: &mut State, recipe: Recipe, saved: bool, offered: Option<String>) {
    let page = &mut state.hands.page;
    page.saved = saved;
    page.lacks_file = !saved;
    page.offered = offered.filter(|text| *text != recipe.text);
    let waits = page.offered.is_some();
    page.recipe = Some(recipe);
    if waits {
        say(
            state,
            "a lost session left gestures: y takes them up, Y forgets them",
            false,
        );
    }
}

/// The recipe's text is in this file.
fn in_file(state: &mut State, path: PathBuf) {
    let page = &mut state.hands.page;
    let first = !std::mem::replace(&mut page.saved, true) && page.lacks_file;
    page.lacks_file = false;
    if first {
        let text = format!("recipe: {}", path.display());
        say(state, text, false);
    }
    if let Some(recipe) = &mut state.hands.page.recipe {
        recipe.path = path;
    }
}

/// A run has ended.
fn done(state: &mut State, ran: Result<Box<Ran>, Box<Diagnostic>>) {
    state.hands.page.running = false;
    state.work = None;
    match ran {
        Ok(ran) => {
            let page = &mut state.hands.page;
            page.error = None;
            page.told = ran.told;
            page.params = ran.params;
            page.chosen = page.chosen.min(page.params.len().saturating_sub(1));
            state.hands.pinning = ran.pinning;
            if let Some(content) = ran.content {
                let content = known(&state.content, content);
                state.hands.good = Some(content.clone());
                if state
                    .hands
                    .held
                    .as_ref()
                    .is_none_or(|held| matches!(held, Held::Slider(..)))
                {
                    show(state, content);
                }
            }
        }
        Err(error) if error.severity == Severity::Cancelled => {}
        Err(error) => {
            if !page_shown(state) {
                let line = error.place.line.map(|line| format!("line {line}: "));
                let text = format!("{}{}", line.unwrap_or_default(), error.message);
                say(state, text, true);
            }
            state.hands.page.error = Some(error);
            state.hands.page.scroll = None;
            if let Some(good) = &state.hands.good {
                state.content = good.clone();
            }
        }
    }
}

/// What is shown already, if it is the same loom: its pictures stay.
fn known(shown: &Content, content: Content) -> Content {
    match (shown, &content) {
        (Content::Loom(before, _), Content::Loom(now, _)) if before == now => shown.clone(),
        _ => content,
    }
}

fn show(state: &mut State, content: Content) {
    state.content = content;
    let last = state.frames() as f64;
    state.playback.t = state.playback.t.min(last);
    for mark in state.playback.marks.iter_mut().flatten() {
        *mark = mark.min(last);
    }
}

/// A preview is there.
fn shown(state: &mut State, number: u64, tried: Result<Content, Box<Diagnostic>>) {
    let hands = &mut state.hands;
    if hands.held.is_none() || number < hands.first_try || number <= hands.shown_try {
        return;
    }
    hands.shown_try = number;
    match tried {
        Ok(content) => show(state, content),
        Err(error) => say(state, error.message, true),
    }
}

/// The recipe's file holds another text.
fn changed(state: &mut State, text: String) -> Vec<Command> {
    if text == state.hands.page.text() {
        state.hands.page.saved = true;
        return Vec::new();
    }
    cancel(state);
    state.hands.page.touched = changed_line(state.hands.page.text(), &text);
    let commands = replace(state, text, false);
    state.hands.page.saved = true;
    commands
}

/// What is to be kept when the studio ends; `lost` with its terminal, what is in hand too.
pub(in crate::tui) fn leave(state: &State, lost: bool) -> Vec<Command> {
    let page = &state.hands.page;
    let held = state
        .hands
        .held
        .as_ref()
        .filter(|held| lost && held.moved());
    let gesture = held.and_then(Held::gesture);
    let with_held = gesture.and_then(|gesture| write(page.text(), &gesture).ok());
    let unsaved = !page.saved && state.hands.history.is_begun();
    match with_held {
        Some(written) => vec![Command::Hands(Errand::Keep(Some(written.text)))],
        None if unsaved => vec![Command::Hands(Errand::Keep(Some(page.text().to_string())))],
        None => Vec::new(),
    }
}
