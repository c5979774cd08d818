//! Where recipes, command line and studio do their expensive work: open, fit, sample, each remembered by
//! content, each noted as a step.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use serde::Serialize;

use super::frames::in_memory;
use super::held::Held;
use super::key::Key;
use super::memory::{Made, Memory, Remembered};
use super::names::{Names, pose_names};
use super::request::FitRequest;
use super::value::{Frames, Keyed, LoomValue, Picture, Shape, ShapeValue, Source, content_key};
use super::{
    CompleteRequest, Completion, InputSpec, MorphRequest, PictureFormat, StatisticsRequest,
    StatisticsValue, add_difference, complete, contact_sheet, files, morph, morph_frames, open,
    open_loom, plot, statistics,
};
use crate::demo::{Demo, FACE_POSES};
use crate::diag::{Diagnostic, Result, Warned};
use crate::edit::{Edit, add_loop};
use crate::inbetween::keys::same_faces;
use crate::loom::Loom;
use crate::loom::fit::fit;
use crate::mesh::{FrameSource, Sequence};
use crate::metric;
use crate::plot::Theme;
use crate::sample::{Sampled, Times};
use crate::task::Task;
use crate::world::World;

/// Results that a recipe has made natively may hold this many bytes at one time.
const NATIVE_BYTES: usize = 8 << 30;

/// Units of a recipe's figure, across and down.
const FIGURE: [f32; 2] = [1200.0, 560.0];
/// Frames of a recipe's contact sheet at most.
const SHEET_FRAMES: usize = 48;
/// Where a contact sheet is looked at from: yaw and pitch in radians.
const VIEW: [f64; 2] = [0.6, 0.3];

/// An expensive step of a run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Step {
    /// What was done: `open`, `fit`, ..
    pub name: &'static str,
    /// On what, in words.
    pub detail: String,
    /// Whether it was computed now or remembered.
    pub made: Made,
}

/// A world, a memory and a task, and the log of what was done with them.
pub struct Workbench {
    world: Arc<dyn World>,
    memory: Arc<Memory>,
    task: Task,
    log: Mutex<Log>,
}

#[derive(Default)]
struct Log {
    steps: Vec<Step>,
    reads: BTreeSet<PathBuf>,
    /// Frames that were sampled, by their key, and the loom they came from.
    sampled: Vec<(Key, LoomValue)>,
    /// Frames that were completed, by their key, and what between.
    completed: Vec<(Key, Completion)>,
    names: Names,
    held: Held,
}

/// Frames that took work: what files held when they had the identities that are part of its key, a
/// morph.
struct Opened {
    sequence: Sequence,
    key: Key,
    warnings: Vec<Diagnostic>,
}

impl Remembered for Opened {
    fn size(&self) -> usize {
        self.sequence.size()
    }
}

/// A loom that took work, and what should be known about it.
pub(super) struct Found {
    pub(super) loom: Loom,
    pub(super) warnings: Vec<Diagnostic>,
}

impl Remembered for Found {
    fn size(&self) -> usize {
        self.loom.size()
    }

    /// The length of the warnings (JSON), the warnings, the loom.
    fn to_bytes(&self) -> Option<Vec<u8>> {
        let warnings = serde_json::to_vec(&self.warnings).ok()?;
        let length = (warnings.len() as u64).to_le_bytes();
        Some([&length[..], &warnings, &self.loom.to_bytes()?].concat())
    }

    fn from_bytes(bytes: &[u8]) -> Option<Self> {
        let (length, rest) = bytes.split_first_chunk::<8>()?;
        let length = usize::try_from(u64::from_le_bytes(*length)).ok()?;
        let (warnings, loom) = rest.split_at_checked(length)?;
        Some(Found {
            loom: Loom::from_bytes(loom)?,
            warnings: serde_json::from_slice(warnings).ok()?,
        })
    }
}

impl Workbench {
    /// Work over `world`, remembered in `memory`, cancelled and watched by `task`.
    pub fn new(world: Arc<dyn World>, memory: Arc<Memory>, task: Task) -> Self {
        Workbench {
            world,
            memory,
            task,
            log: Mutex::default(),
        }
    }

    /// The files.
    pub fn world(&self) -> &dyn World {
        &*self.world
    }

    /// What was made before.
    pub(super) fn memory(&self) -> &Memory {
        &self.memory
    }

    /// Cancellation and progress.
    pub fn task(&self) -> &Task {
        &self.task
    }

    /// The expensive steps so far.
    pub fn steps(&self) -> Vec<Step> {
        self.log().steps.clone()
    }

    /// The files read so far.
    pub fn reads(&self) -> Vec<PathBuf> {
        self.log().reads.iter().cloned().collect()
    }

    /// Notes that `file` was read: a live run waits for it to change.
    pub fn note_read(&self, file: &Path) {
        self.log().reads.insert(file.to_path_buf());
    }

    /// A capture from files, of looms their frames.
    ///
    /// # Errors
    /// As [`open`].
    pub fn open_frames(&self, spec: &InputSpec) -> Result<Warned<Frames>> {
        let key = self.files_key("open", spec)?;
        let (opened, made) = self.memory.remember(key, || {
            let mut warnings = Vec::new();
            let capture = open(self.world(), spec, &self.task)?.unpack(&mut warnings);
            let sequence = capture.content.sequence(&self.task)?;
            let key = content_key(&sequence);
            Ok(Opened {
                sequence,
                key,
                warnings,
            })
        })?;
        self.note("open", named(&spec.paths), made);
        let names = pose_names(&files(self.world(), spec)?, opened.sequence.frames());
        self.log().names.set(opened.key, names);
        let output = Keyed::new(opened.sequence.clone(), opened.key);
        Ok(Warned {
            output,
            warnings: opened.warnings.clone(),
        })
    }

    /// A loom from its file.
    ///
    /// # Errors
    /// The file is not there, or not a loom.
    pub fn load(&self, path: &Path) -> Result<LoomValue> {
        let key = self.files_key("load", &InputSpec::new(path))?;
        let (loom, made) = self
            .memory
            .remember(key, || open_loom(self.world(), path, &self.task))?;
        self.note("load", path.display().to_string(), made);
        Ok(LoomValue::bare(Keyed { value: loom, key }))
    }

    /// A built-in capture.
    ///
    /// # Errors
    /// No demo has this name.
    pub fn demo(&self, name: &str) -> Result<Warned<Frames>> {
        let demo = Demo::find(name).ok_or_else(|| no_demo(name))?;
        let key = Key::of("demo").text(name).finish();
        let (sequence, made) = self.memory.remember(key, || Ok((demo.generate)()))?;
        self.note("demo", name, made);
        if demo.name == "face" {
            let names = FACE_POSES.iter().map(ToString::to_string).collect();
            self.log().names.set(key, names);
        }
        Ok(Warned::clean(Keyed {
            value: sequence,
            key,
        }))
    }

    /// Fits a loom.
    ///
    /// # Errors
    /// As [`fit`]; a word of the request is unknown.
    pub fn fit(&self, frames: &Frames, request: &FitRequest) -> Result<Warned<LoomValue>> {
        let options = request.options()?;
        let key = frames.then("fit").text(&format!("{options:?}")).finish();
        let (fitted, made) = self.memory.remember(key, || {
            let mut warnings = Vec::new();
            let loom = fit(&frames.value, &options, &self.task)?.unpack(&mut warnings);
            Ok(Found { loom, warnings })
        })?;
        self.hold_loom(&fitted.loom)?;
        self.note("fit", format!("{} frames", frames.value.frames()), made);
        let source = Source {
            frames: frames.clone(),
            request: request.clone(),
        };
        let output = LoomValue {
            loom: Keyed::new(fitted.loom.clone(), key),
            source: Some(Arc::new(source)),
            edits: Vec::new(),
        };
        Ok(Warned {
            output,
            warnings: fitted.warnings.clone(),
        })
    }

    /// The loom after an edit.
    ///
    /// # Errors
    /// Those of the edit.
    pub fn edit(&self, loom: &LoomValue, edit: &Edit) -> Result<Warned<LoomValue>> {
        self.task.check()?;
        let mut warnings = Vec::new();
        let edited = edit.apply(&loom.loom.value)?.unpack(&mut warnings);
        let key = loom.loom.then("edit").text(&format!("{edit:?}")).finish();
        let edits = loom.edits.iter().cloned().chain([edit.clone()]).collect();
        let output = LoomValue {
            loom: Keyed::new(edited, key),
            source: loom.source.clone(),
            edits,
        };
        Ok(Warned { output, warnings })
    }

    /// The loom fitted again with frame `frame` (from 1) held at `place`, or let go, and its edits done
    /// again. The new fit stays near the first: an ordered one keeps its tau and theta.
    ///
    /// # Errors
    /// The loom was loaded: what it was fitted to is not known. Those of the fit and of the edits.
    pub fn pin(
        &self,
        loom: &LoomValue,
        frame: usize,
        place: Option<[f64; 2]>,
    ) -> Result<Warned<LoomValue>> {
        let Some(source) = &loom.source else {
            return Diagnostic::error(
                "this loom cannot be laid out anew: its frames are not in the file",
            )
            .hint("fit the capture in the recipe: `fit(input()).pin(..)`")
            .err();
        };
        let mut request = source.request.clone();
        let ordered = loom.loom.value.report().ordered;
        request.near = ordered.map(|ordered| (ordered.tau, ordered.theta));
        request.pins.retain(|(pinned, _)| *pinned != frame);
        request.pins.extend(place.map(|place| (frame, place)));
        let mut warned = self.fit(&source.frames, &request)?;
        for edit in &loom.edits {
            let Warned { output, warnings } = self.edit(&warned.output, edit)?;
            warned.output = output;
            warned.warnings.extend(warnings);
        }
        Ok(warned)
    }

    /// Frames of a loom at chosen times.
    ///
    /// # Errors
    /// Times outside of the loom.
    pub fn sample(&self, loom: &LoomValue, times: &Times) -> Result<Frames> {
        let key = loom
            .loom
            .then("sample")
            .text(&format!("{times:?}"))
            .finish();
        let value = &loom.loom.value;
        let sampling = times.over(value.frames(), value.fps())?;
        let sampled = Sampled::new((**value).clone(), sampling);
        let bytes = 12 * sampled.topology().vertices() * sampled.frames();
        let (frames, made) = self.memory.remember(key, || {
            self.has_room(bytes)?;
            in_memory(&sampled, &self.task)
        })?;
        self.log().held.add(&frames, bytes);
        self.note("sample", format!("{} frames", frames.frames()), made);
        self.log().sampled.push((key, loom.clone()));
        Ok(Keyed { value: frames, key })
    }

    /// The loom that frames were sampled from in this run.
    pub fn sampled_from(&self, frames: &Frames) -> Option<LoomValue> {
        let log = self.log();
        let (_, loom) = log.sampled.iter().find(|(key, _)| *key == frames.key)?;
        Some(loom.clone())
    }

    /// Frames of a loom at its integers.
    ///
    /// # Errors
    /// Cancellation.
    pub fn frames_of(&self, loom: &LoomValue) -> Result<Frames> {
        self.sample(loom, &Times::Integers)
    }

    /// psi(t) as a mesh.
    ///
    /// # Errors
    /// `t` is outside of the loom.
    pub fn shape_at(&self, loom: &LoomValue, t: f64) -> Result<ShapeValue> {
        let positions = loom.loom.value.at(t)?;
        self.shape(
            &loom.loom.value,
            positions,
            loom.loom.then("at").number(t).finish(),
        )
    }

    /// The shape at a point of the map as a mesh.
    ///
    /// # Errors
    /// The point is not finite.
    pub fn pose(&self, loom: &LoomValue, point: [f64; 2]) -> Result<ShapeValue> {
        let positions = loom.loom.value.pose_at(point)?;
        self.shape(
            &loom.loom.value,
            positions,
            loom.loom
                .then("pose")
                .number(point[0])
                .number(point[1])
                .finish(),
        )
    }

    pub(super) fn shape(&self, loom: &Loom, positions: Vec<f32>, key: Key) -> Result<ShapeValue> {
        let topology = Arc::clone(loom.topology());
        self.held_shape(
            Shape {
                topology,
                positions,
            },
            key,
        )
    }

    fn held_shape(&self, shape: Shape, key: Key) -> Result<ShapeValue> {
        let bytes = 4 * shape.positions.len();
        self.has_room(bytes)?;
        let shape = Keyed::new(shape, key);
        self.log().held.add(&shape.value, bytes);
        Ok(shape)
    }

    /// Counts what a loom holds; an error where that is too much.
    pub(super) fn hold_loom(&self, loom: &Loom) -> Result<()> {
        // The vectors of h are nearly all of a loom, and what edited looms share.
        self.log().held.add(loom.shape(), loom.size());
        self.has_room(0)
    }

    /// Frames `first` to `last` of a capture, from 1, both included.
    ///
    /// # Errors
    /// They leave the capture.
    pub fn slice(&self, frames: &Frames, first: usize, last: usize) -> Result<Frames> {
        let range = super::FrameRange {
            first: Some(first),
            last: Some(last),
        }
        .within(frames.value.frames())?;
        let key = frames
            .then("slice")
            .number(first as f64)
            .number(last as f64)
            .finish();
        let names = self.names_of(frames.key);
        let some = names.get(range.clone()).unwrap_or_default().to_vec();
        self.log().names.set(key, some);
        Ok(Keyed::new(frames.value.slice(range), key))
    }

    /// One frame of a capture, from 1.
    ///
    /// # Errors
    /// There is no such frame.
    pub fn frame(&self, frames: &Frames, frame: usize) -> Result<ShapeValue> {
        let one = self.slice(frames, frame, frame)?;
        let shape = Shape {
            topology: Arc::clone(one.value.topology()),
            positions: one.value.frame(0).to_vec(),
        };
        self.held_shape(shape, one.key)
    }

    /// Shapes of one mesh as a capture of so many frames.
    ///
    /// # Errors
    /// No shapes; shapes of another mesh than the first.
    pub fn gather(&self, shapes: &[ShapeValue]) -> Result<Frames> {
        let Some(first) = shapes.first() else {
            return Diagnostic::error("no shapes are given")
                .hint("name one or more: `[mesh(\"a.obj\"), mesh(\"b.obj\")]`")
                .err();
        };
        let mut key = Key::of("gather");
        let mut positions = Vec::new();
        for (at, shape) in shapes.iter().enumerate() {
            same_faces(&first.value.topology, &shape.value.topology, at + 1)?;
            positions.extend_from_slice(&shape.value.positions);
            key = key.key(shape.key);
        }
        let topology = Arc::clone(&first.value.topology);
        let gathered = Keyed::new(Sequence::new(topology, positions, None), key.finish());
        self.hold_frames(&gathered)?;
        let keys: Vec<Key> = shapes.iter().map(|shape| shape.key).collect();
        let names = self.log().names.joined(&keys);
        self.log().names.set(gathered.key, names);
        Ok(gathered)
    }

    /// Key poses completed to a motion, at the times asked for.
    ///
    /// # Errors
    /// As [`complete`].
    pub fn complete(&self, keys: &Frames, request: &CompleteRequest) -> Result<Warned<Frames>> {
        let key = request.key(keys);
        let frames = request.times_of(&keys.value)?.len();
        self.has_room(12 * keys.vertices() * frames)?;
        let (completed, made) = self.memory.remember(key, || {
            let mut warnings = Vec::new();
            let frames = complete(&keys.value, request, &self.task)?.unpack(&mut warnings);
            let sequence = in_memory(&frames, &self.task)?;
            Ok(Opened {
                sequence,
                key,
                warnings,
            })
        })?;
        self.note("complete", format!("{} keys", keys.frames()), made);
        let output = Keyed::new(completed.sequence.clone(), key);
        self.hold_frames(&output)?;
        let completion = Completion {
            keys: keys.clone(),
            request: request.clone(),
        };
        self.log().completed.push((key, completion));
        Ok(Warned {
            output,
            warnings: completed.warnings.clone(),
        })
    }

    /// The names of the frames, or of the poses, that the value of a key holds; empty where they have none.
    pub fn names_of(&self, key: Key) -> Vec<String> {
        self.log().names.of(key)
    }

    /// The keys and the request that frames were completed from in this run.
    pub fn completed_from(&self, frames: &Frames) -> Option<Completion> {
        let log = self.log();
        let (_, completion) = log.completed.iter().find(|(key, _)| *key == frames.key)?;
        Some(completion.clone())
    }

    /// The frames between poses.
    ///
    /// # Errors
    /// As [`morph`].
    pub fn morph(&self, poses: &Frames, request: &MorphRequest) -> Result<Warned<Frames>> {
        let frames = morph_frames(&poses.value, request)?;
        self.has_room(12 * poses.vertices() * frames)?;
        let key = poses.then("morph").text(&format!("{request:?}")).finish();
        let (found, made) = self.memory.remember(key, || {
            let mut warnings = Vec::new();
            let morph = morph(&poses.value, request, &self.task)?.unpack(&mut warnings);
            Ok(Opened {
                sequence: morph.frames,
                key,
                warnings,
            })
        })?;
        self.note("morph", format!("{} poses", poses.frames()), made);
        let output = Keyed::new(found.sequence.clone(), key);
        self.hold_frames(&output)?;
        Ok(Warned {
            output,
            warnings: found.warnings.clone(),
        })
    }

    /// Mean and principal components of poses.
    ///
    /// # Errors
    /// As [`statistics`].
    pub fn statistics(
        &self,
        poses: &Frames,
        request: &StatisticsRequest,
    ) -> Result<StatisticsValue> {
        let key = poses
            .then("statistics")
            .text(&format!("{request:?}"))
            .finish();
        let compute = || statistics(&poses.value, request, &self.task);
        let (value, made) = self.memory.remember(key, compute)?;
        self.note("statistics", format!("{} poses", poses.frames()), made);
        let names = self.names_of(poses.key);
        self.log().names.set(key, names);
        Ok(Keyed { value, key })
    }

    /// The mean of poses.
    ///
    /// # Errors
    /// None that finite poses can cause.
    pub fn mean_shape(&self, found: &StatisticsValue) -> Result<Warned<ShapeValue>> {
        self.keyed_shape(found.value.mean()?, found.then("mean").finish())
    }

    /// The shape so many standard deviations along a mode, from 1.
    ///
    /// # Errors
    /// There is no such mode.
    pub fn sample_mode(
        &self,
        found: &StatisticsValue,
        mode: usize,
        sigmas: f64,
    ) -> Result<Warned<ShapeValue>> {
        let key = found.then("mode").number(mode as f64).number(sigmas);
        self.keyed_shape(found.value.sample(mode, sigmas)?, key.finish())
    }

    /// A pose with the difference between two others added: pose, from, to.
    ///
    /// # Errors
    /// As [`add_difference`]; the meshes differ.
    pub fn add_difference(
        &self,
        shapes: &[ShapeValue; 3],
        space: &str,
    ) -> Result<Warned<ShapeValue>> {
        let joined = self.gather(shapes)?;
        let key = joined.then("add_difference").text(space).finish();
        self.keyed_shape(add_difference(&joined.value, space)?, key)
    }

    fn keyed_shape(&self, shape: Warned<Shape>, key: Key) -> Result<Warned<ShapeValue>> {
        Ok(Warned {
            output: self.held_shape(shape.output, key)?,
            warnings: shape.warnings,
        })
    }

    /// Poses by their first two modes, as a file that ends like `path`.
    ///
    /// # Errors
    /// The ending names no picture.
    pub fn plot_statistics(&self, found: &StatisticsValue, path: &str) -> Result<Picture> {
        let format = PictureFormat::of(Path::new(path))?;
        let scene = found
            .value
            .figure(&self.names_of(found.key), &Theme::light());
        Ok(Picture {
            bytes: format.encode(&scene, 2.0)?,
        })
    }

    /// A mesh as a capture of one frame.
    pub fn single(&self, shape: &ShapeValue) -> Frames {
        Keyed::new(shape.value.sequence(), shape.key)
    }

    /// Distances of `second` from `first`, as the command line's JSON has them.
    ///
    /// # Errors
    /// Different numbers of vertices or frames.
    pub fn compare(&self, first: &Frames, second: &Frames) -> Result<serde_json::Value> {
        let found = metric::compare(&*first.value, &*second.value, &self.task);
        let found = found.map_err(|error| Diagnostic::error(error.to_string()))?;
        Ok(serde_json::json!({
            "frames": found.frames,
            "kg_percent": found.vertices.kg_percent,
            "rms": found.vertices.rms,
            "max": found.vertices.max,
            "edge_rms_percent": found.edges.rms_percent,
            "edge_max_percent": found.edges.max_percent,
        }))
    }

    /// How a loop of [from, to] would show at its seam: step, velocity and acceleration there over the
    /// largest elsewhere, and the worst of them.
    ///
    /// # Errors
    /// The stretch leaves the loom or has no length.
    pub fn seam(&self, loom: &LoomValue, from: f64, to: f64) -> Result<serde_json::Value> {
        let seam = add_loop(&loom.loom.value, from, to, 1, None)?.seam;
        Ok(serde_json::json!({
            "step": seam.step,
            "velocity": seam.velocity,
            "acceleration": seam.acceleration,
            "worst": seam.worst(),
        }))
    }

    /// The map and the time signals of a loom, as a file that ends like `path`.
    ///
    /// # Errors
    /// The ending names no picture.
    pub fn plot(&self, loom: &LoomValue, path: &str) -> Result<Picture> {
        let format = PictureFormat::of(Path::new(path))?;
        let (map, signals) = plot::plot_loom(&loom.loom.value);
        let title = plot::caption(&loom.loom.value);
        let scene = plot::figure(&map, &signals, &title, FIGURE, &Theme::light());
        Ok(Picture {
            bytes: format.encode(&scene, 2.0)?,
        })
    }

    /// A contact sheet of shaded frames, as a file that ends like `path`.
    ///
    /// # Errors
    /// The ending names no picture.
    pub fn sheet(&self, frames: &Frames, path: &str) -> Result<Picture> {
        let format = PictureFormat::of(Path::new(path))?;
        let scene = contact_sheet(
            &*frames.value,
            SHEET_FRAMES,
            VIEW,
            &Theme::light(),
            &self.task,
        )?;
        Ok(Picture {
            bytes: format.encode(&scene, 1.0)?,
        })
    }

    /// The key of what files hold, by their identities: they are not read.
    fn files_key(&self, operation: &str, spec: &InputSpec) -> Result<Key> {
        let mut key =
            Key::of(operation).text(&format!("{:?} {:?} {:?}", spec.mesh, spec.range, spec.fps));
        for file in files(self.world(), spec)? {
            self.note_read(&file);
            let identity = self.world.identity(&file)?;
            key = key
                .text(&file.to_string_lossy())
                .text(&format!("{identity:?}"));
        }
        Ok(key.finish())
    }

    fn log(&self) -> MutexGuard<'_, Log> {
        // Entries are pushed whole; a panic elsewhere cannot tear them.
        self.log.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(super) fn note(&self, name: &'static str, detail: impl Into<String>, made: Made) {
        self.log().steps.push(Step {
            name,
            detail: detail.into(),
            made,
        });
    }

    /// Whether so many bytes more may be held; scripts' own values have limits of their own.
    pub(super) fn has_room(&self, bytes: usize) -> Result<()> {
        if self.log().held.has_room(bytes, NATIVE_BYTES) {
            return Ok(());
        }
        Diagnostic::error(format!(
            "the results of this recipe would take more than {} GiB",
            NATIVE_BYTES >> 30
        ))
        .hint("sample fewer frames, or save looms instead of frames")
        .err()
    }

    /// Counts frames; an error where they are too many.
    pub(super) fn hold_frames(&self, frames: &Frames) -> Result<()> {
        self.log().held.add(&frames.value, frames.value.size());
        self.has_room(0)
    }
}

fn named(paths: &[PathBuf]) -> String {
    paths
        .first()
        .map(|path| path.display().to_string())
        .unwrap_or_default()
}

fn no_demo(name: &str) -> Box<Diagnostic> {
    let names: Vec<_> = crate::demo::DEMOS.iter().map(|demo| demo.name).collect();
    Box::new(
        Diagnostic::error(format!("no built-in capture `{name}`"))
            .hint(format!("there are {}", names.join(", "))),
    )
}
