//! The recipe that the studio works on: its file, its runs, who else changes it, and the user's editor.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, SystemTime};

use super::reading::{Reading, entries, identity, saved};
use super::runs::{Runs, cache_folder};
use crate::diag::{Diagnostic, Result};
use crate::io::{Disk, Wake};
use crate::mesh::{FrameSource, Sequence};
use crate::pipeline::{self, Key, Value};
use crate::recipe::{Failure, Outcome, Recipe, Request};
use crate::task::Task;
use crate::tui::{Desk, Kept};
use crate::world::{World, folder_of};

/// How often it is looked whether other files are to be watched, or none any more.
const LOOK: Duration = Duration::from_millis(250);

/// What a capture begins with.
const FIT: &str = "fit(input())\n";
/// Poses up to so many begin as keys of a motion, more by what they have in common.
const MOST_KEYS: usize = 16;

/// A recipe on disk, or one that will be.
pub(super) struct RecipeDesk {
    runs: Arc<Runs>,
    request: Request,
    /// Frames per second of what is shown, where the user said so.
    fps: Option<f64>,
    file: Mutex<File>,
    /// What the last run read.
    seen: Mutex<Reading>,
}

/// The recipe's file as it is known.
struct File {
    /// Where it is, or where it will be.
    path: PathBuf,
    /// Its text, once there is one.
    known: Option<String>,
    /// What a recipe without a file begins with.
    first: String,
}

impl RecipeDesk {
    /// A recipe: its file's, if that holds this text, else one that has no file yet.
    pub(super) fn on(runs: Arc<Runs>, request: Request, recipe: Recipe, fps: Option<f64>) -> Self {
        let known = read(&recipe.path).ok().filter(|text| *text == recipe.text);
        RecipeDesk {
            runs,
            request,
            fps,
            file: Mutex::new(File {
                path: recipe.path,
                known,
                first: recipe.text,
            }),
            seen: Mutex::default(),
        }
    }

    fn file(&self) -> MutexGuard<'_, File> {
        // A panic elsewhere leaves the fields whole: they are set one by one, each at once.
        self.file.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn seen(&self) -> MutexGuard<'_, Reading> {
        self.seen.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// What has changed since it was last seen: the recipe's text, or (none) another file.
    fn changed(&self) -> Result<Option<Option<String>>> {
        let mut file = self.file();
        let there = file.known.is_some() && identity(&file.path).is_some();
        if there {
            let text = read(&file.path)?;
            if file.known.as_deref() != Some(&text) {
                file.known = Some(text.clone());
                return Ok(Some(Some(text)));
            }
        }
        let own = file.path.clone();
        drop(file);
        Ok(self.seen().changed(Some(&own)).then_some(None))
    }

    /// The folders of the recipe and of all that it read.
    fn folders(&self) -> BTreeSet<PathBuf> {
        let own = folder_of(&self.file().path).to_path_buf();
        let mut folders = self.seen().folders();
        if own.is_dir() {
            folders.insert(own);
        }
        folders
    }

    /// Where texts that could not be saved are kept for the next session.
    fn keeping(&self) -> Option<PathBuf> {
        let own = std::path::absolute(&self.file().path).ok()?;
        let name = Key::of("recovery").text(&own.to_string_lossy()).finish();
        Some(
            cache_folder()?
                .join("recovery")
                .join(format!("{name}.rhai")),
        )
    }
}

impl Desk for RecipeDesk {
    fn suited(&self, frames: &Sequence) -> Option<Recipe> {
        let mut file = self.file();
        if file.known.is_some() || file.first != FIT || !pipeline::separate(frames) {
            return None;
        }
        file.first = match frames.frames() <= MOST_KEYS {
            true => "complete(input())\n".to_string(),
            false => "pca(input())\n".to_string(),
        };
        Some(Recipe {
            path: file.path.clone(),
            text: file.first.clone(),
        })
    }

    fn recipe(&self) -> Result<(Recipe, bool)> {
        let file = self.file();
        let text = file.known.clone().unwrap_or_else(|| file.first.clone());
        let recipe = Recipe {
            path: file.path.clone(),
            text,
        };
        Ok((recipe, file.known.is_some()))
    }

    fn write(&self, text: &str) -> Result<Kept> {
        let mut file = self.file();
        let Some(known) = &file.known else {
            let path = free(&file.path);
            store(&path, text)?;
            (file.path, file.known) = (path.clone(), Some(text.to_string()));
            return Ok(Kept::At(path));
        };
        if identity(&file.path).is_some() {
            let present = read(&file.path)?;
            if present != *known {
                file.known = Some(present.clone());
                return Ok(Kept::Overtaken(present));
            }
        }
        store(&file.path, text)?;
        file.known = Some(text.to_string());
        Ok(Kept::At(file.path.clone()))
    }

    fn run(
        &self,
        recipe: &Recipe,
        settings: &[(String, String)],
        task: &Task,
    ) -> Result<Outcome, Failure> {
        let request = Request {
            settings: settings.to_vec(),
            ..self.request.clone()
        };
        let (begun, before) = (SystemTime::now(), self.seen().again());
        let run = self.runs.run(recipe, &request, None, task);
        let (reads, listings) = match &run {
            Ok(outcome) => (&outcome.reads, &outcome.listings),
            Err(failure) => (&failure.reads, &failure.listings),
        };
        *self.seen() = before.after(reads, listings, begun);
        let mut outcome = run?;
        if let (Value::Loom(loom), Some(fps)) = (&mut outcome.value, self.fps)
            && loom.source.is_none()
            && let Ok(faster) = loom.loom.value.with_fps(Some(fps))
        {
            loom.loom.value = Arc::new(faster);
        }
        Ok(outcome)
    }

    fn change(&self, task: &Task) -> Result<Option<Option<String>>> {
        loop {
            let folders = self.folders();
            let watch = entries(&folders)?.output;
            // Also what has changed before the watch was set up.
            let mut look = true;
            loop {
                if task.cancelled() {
                    return Ok(None);
                }
                if look && let Some(change) = self.changed()? {
                    return Ok(Some(change));
                }
                look = match watch.wait(LOOK) {
                    Wake::Changed(_) => {
                        saved(&watch);
                        true
                    }
                    Wake::Quiet if self.folders() != folders => break,
                    Wake::Quiet => false,
                };
            }
        }
    }

    fn edit(&self) -> Result<PathBuf> {
        if self.file().known.is_none() {
            let first = self.file().first.clone();
            self.write(&first)?;
        }
        let path = self.file().path.clone();
        let editor = editor();
        // The variable may hold arguments: `code --wait`.
        let run = Command::new("sh")
            .arg("-c")
            .arg(format!("{editor} \"$1\""))
            .arg("sh")
            .arg(&path)
            .status();
        let error = match run {
            Ok(status) if status.success() => return Ok(path),
            Ok(status) => format!("`{editor}` ended with {status}"),
            Err(error) => format!("`{editor}` cannot be started: {error}"),
        };
        Diagnostic::error(error)
            .hint("VISUAL or EDITOR names the editor")
            .err()
    }

    fn kept(&self) -> Option<String> {
        let text = read(&self.keeping()?).ok()?;
        let known = self.file().known.clone();
        (known.as_deref() != Some(&text)).then_some(text)
    }

    fn keep(&self, text: Option<&str>) -> Result<()> {
        let Some(path) = self.keeping() else {
            return Ok(());
        };
        match text {
            Some(text) => store(&path, text),
            None if identity(&path).is_some() => {
                Disk.stage(&path)?.commit(&[], std::slice::from_ref(&path))
            }
            None => Ok(()),
        }
    }
}

/// The editor that the user has set.
fn editor() -> String {
    let set = |name| std::env::var(name).ok().filter(|value| !value.is_empty());
    set("VISUAL")
        .or_else(|| set("EDITOR"))
        .unwrap_or_else(|| "vi".to_string())
}

fn read(path: &Path) -> Result<String> {
    String::from_utf8(Disk.read(path)?).or_else(|_| {
        Diagnostic::error("the recipe is not UTF-8 text")
            .in_file(path)
            .hint("save it as UTF-8")
            .err()
    })
}

/// Writes a file whole; a link stays one.
fn store(path: &Path, text: &str) -> Result<()> {
    let target = Disk.resolve(path)?;
    let stage = Disk.stage(&target)?;
    stage.write("text", text.as_bytes())?;
    stage.commit(&[("text".to_string(), target)], &[])
}

/// `walk.rhai`, or the first of `walk-2.rhai`, `walk-3.rhai`, .. that is not there yet.
fn free(path: &Path) -> PathBuf {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let numbered = (2..1000).map(|number| path.with_file_name(format!("{stem}-{number}.rhai")));
    std::iter::once(path.to_path_buf())
        .chain(numbered)
        .find(|path| identity(path).is_none())
        .unwrap_or_else(|| path.to_path_buf())
}

/// The recipe that a capture or a loom begins with, and where it would be written: beside it.
pub(super) fn beginning(inputs: &[PathBuf], loom: bool) -> Recipe {
    let first = inputs.first().map_or(Path::new(""), PathBuf::as_path);
    let name = first.file_name().unwrap_or_default().to_string_lossy();
    let stem = name
        .split(['.', '#', '%', '*', '?'])
        .next()
        .unwrap_or_default();
    let stem = stem.trim_end_matches(['_', '-']);
    let stem = if stem.is_empty() { "recipe" } else { stem };
    let text = if loom {
        format!("load({name:?})\n")
    } else {
        FIT.to_string()
    };
    Recipe {
        path: first.with_file_name(format!("{stem}.rhai")),
        text,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_recipe_begins_beside_its_capture() {
        let begun = |input: &str, loom| {
            let recipe = beginning(&[PathBuf::from(input)], loom);
            (recipe.path.display().to_string(), recipe.text)
        };
        for (input, path) in [
            ("shots/walk", "shots/walk.rhai"),
            ("shots/walk/", "shots/walk.rhai"),
            ("f/frame_####.obj", "f/frame.rhai"),
            ("f/*.obj", "f/recipe.rhai"),
            ("walk.pc2", "walk.rhai"),
        ] {
            assert_eq!(begun(input, false), (path.into(), "fit(input())\n".into()));
        }
        let loom = ("a/walk.rhai".into(), "load(\"walk.loom\")\n".into());
        assert_eq!(begun("a/walk.loom", true), loom);
    }

    fn desk(folder: &Path) -> RecipeDesk {
        let recipe = Recipe {
            path: folder.join("r.rhai"),
            text: "1\n".into(),
        };
        RecipeDesk::on(Arc::new(Runs::new()), Request::default(), recipe, None)
    }

    #[test]
    fn poses_begin_as_keys_and_many_by_what_they_have_in_common() {
        let folder = tempfile::tempdir().unwrap();
        let poses = crate::demo::Demo::find("cactus").unwrap().generate();
        let many = (0..18).flat_map(|i| poses.frame(i % 3).to_vec()).collect();
        let many = Sequence::new(Arc::clone(poses.topology()), many, None);
        let begun = |frames: &Sequence| {
            let recipe = beginning(&[folder.path().join("keys")], false);
            let desk = RecipeDesk::on(Arc::new(Runs::new()), Request::default(), recipe, None);
            let suited = desk.suited(frames).map(|recipe| recipe.text);
            assert_eq!(
                desk.recipe().unwrap().0.text,
                suited.clone().unwrap_or(FIT.into())
            );
            suited
        };
        assert_eq!(begun(&poses).unwrap(), "complete(input())\n");
        assert_eq!(begun(&many).unwrap(), "pca(input())\n");
        assert_eq!(begun(&poses.slice(0..1)), None);
        let own = desk(folder.path());
        assert_eq!(own.suited(&poses), None);
    }

    #[test]
    fn a_gesture_never_overwrites_what_somebody_else_wrote() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("r.rhai");
        let desk = desk(folder.path());
        assert_eq!(desk.write("2\n").unwrap(), Kept::At(path.clone()));
        assert_eq!(desk.changed().unwrap(), None);
        store(&path, "3\n").unwrap();
        assert_eq!(desk.write("4\n").unwrap(), Kept::Overtaken("3\n".into()));
        assert_eq!(desk.write("5\n").unwrap(), Kept::At(path.clone()));
        assert_eq!(read(&path).unwrap(), "5\n");
    }

    #[test]
    fn a_recipe_without_a_file_never_takes_anothers() {
        let folder = tempfile::tempdir().unwrap();
        let desk = desk(folder.path());
        store(&folder.path().join("r.rhai"), "not ours\n").unwrap();
        let second = folder.path().join("r-2.rhai");
        assert_eq!(desk.write("2\n").unwrap(), Kept::At(second));
    }

    #[test]
    fn saves_by_truncating_and_by_renaming_are_one_change_each() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("r.rhai");
        store(&path, "1\n").unwrap();
        let desk = desk(folder.path());
        let task = Task::default();
        std::thread::scope(|scope| {
            let waits = scope.spawn(|| desk.change(&task));
            store(&path, "2\n").unwrap();
            assert_eq!(waits.join().unwrap().unwrap(), Some(Some("2\n".into())));
        });
        assert_eq!(desk.changed().unwrap(), None);
    }
}
