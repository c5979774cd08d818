//! Looms: fitted, edited, laid out anew, sampled, and shown.

use std::path::Path;
use std::sync::Arc;

use super::Workbench;
use crate::diag::{Diagnostic, Result, Warned};
use crate::edit::{Edit, add_loop, find_loop};
use crate::loom::Loom;
use crate::loom::fit::fit;
use crate::mesh::FrameSource;
use crate::pipeline::frames::in_memory;
use crate::pipeline::key::Key;
use crate::pipeline::memory::Remembered;
use crate::pipeline::value::{Frames, Keyed, LoomValue, Picture, Shape, ShapeValue, Source};
use crate::pipeline::{FitRequest, PictureFormat, contact_sheet, plot};
use crate::plot::Theme;
use crate::sample::{Sampled, Times};

/// Units of a recipe's figure, across and down.
const FIGURE: [f32; 2] = [1200.0, 560.0];
/// Frames of a recipe's contact sheet at most.
const SHEET_FRAMES: usize = 48;
/// Where a contact sheet is looked at from: yaw and pitch in radians.
const VIEW: [f64; 2] = [0.6, 0.3];

/// A loom that took work, and what should be known about it.
pub(in crate::pipeline) struct Found {
    pub(in crate::pipeline) loom: Loom,
    pub(in crate::pipeline) warnings: Vec<Diagnostic>,
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
        let loom = Keyed::new(fitted.loom.clone(), key);
        let source = Source {
            frames: frames.clone(),
            request: request.clone(),
            fitted: Arc::clone(&loom.value),
        };
        let output = LoomValue {
            loom,
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
        let edited = edit
            .apply(&loom.loom.value, &self.task)?
            .unpack(&mut warnings);
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

    pub(in crate::pipeline) fn shape(
        &self,
        loom: &Loom,
        positions: Vec<f32>,
        key: Key,
    ) -> Result<ShapeValue> {
        let topology = Arc::clone(loom.topology());
        self.held_shape(
            Shape {
                topology,
                positions,
            },
            key,
        )
    }

    /// How a loop of [from, to] would show at its seam: the ratios of [`crate::edit::Seam`], and the worst
    /// of them.
    ///
    /// # Errors
    /// The stretch leaves the loom or has no length.
    pub fn seam(&self, loom: &LoomValue, from: f64, to: f64) -> Result<serde_json::Value> {
        let seam = add_loop(&loom.loom.value, from, to, 1, None, &self.task)?.seam;
        Ok(serde_json::json!({
            "step": seam.step,
            "velocity": seam.velocity,
            "acceleration": seam.acceleration,
            "worst": seam.worst(),
        }))
    }

    /// The ends of the loop of `shortest` to `longest` frames that shows least: from, to.
    ///
    /// # Errors
    /// As [`find_loop`].
    pub fn find_loop(&self, loom: &LoomValue, shortest: usize, longest: usize) -> Result<[f64; 2]> {
        let (from, to) = find_loop(&loom.loom.value, shortest, longest, &self.task)?.stretch;
        Ok([from, to])
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
}
