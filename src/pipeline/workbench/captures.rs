//! Captures, looms from files, built-in captures, and parts of them.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::{Opened, Workbench};
use crate::demo::{Demo, FACE_POSES};
use crate::diag::{Diagnostic, Result, Warned};
use crate::inbetween::keys::same_faces;
use crate::mesh::{FrameSource, Sequence};
use crate::metric;
use crate::pipeline::key::Key;
use crate::pipeline::names::pose_names;
use crate::pipeline::value::{Frames, Keyed, LoomValue, Shape, ShapeValue, content_key};
use crate::pipeline::{FrameRange, InputSpec, Listing, compared, files, open, open_loom};

impl Workbench {
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
        self.hold_frames(&output)?;
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
        self.hold_loom(&loom)?;
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
        let (sequence, made) = self.memory.remember(key, || Ok((demo.make)(&self.task)?))?;
        self.note("demo", name, made);
        if demo.name == "face" {
            let names = FACE_POSES.iter().map(ToString::to_string).collect();
            self.log().names.set(key, names);
        }
        let frames = Keyed {
            value: sequence,
            key,
        };
        self.hold_frames(&frames)?;
        Ok(Warned::clean(frames))
    }

    /// Frames `first` to `last` of a capture, from 1, both included.
    ///
    /// # Errors
    /// They leave the capture.
    pub fn slice(&self, frames: &Frames, first: usize, last: usize) -> Result<Frames> {
        let range = FrameRange {
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
        Ok(compared(&found))
    }

    /// The key of what files hold, by their identities: they are not read.
    fn files_key(&self, operation: &str, spec: &InputSpec) -> Result<Key> {
        let mut key =
            Key::of(operation).text(&format!("{:?} {:?} {:?}", spec.mesh, spec.range, spec.fps));
        let (listing, files) = Listing::of(self.world(), spec);
        self.log().listings.push(listing);
        for file in files? {
            self.note_read(&file);
            let identity = self.world.identity(&file)?;
            key = key
                .text(&file.to_string_lossy())
                .text(&format!("{identity:?}"));
        }
        Ok(key.finish())
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
