//! Shapes of one mesh: completed to motions, morphed, their statistics.

use std::path::Path;

use super::{Opened, Workbench};
use crate::diag::{Result, Warned};
use crate::pipeline::frames::in_memory;
use crate::pipeline::key::Key;
use crate::pipeline::value::{Frames, Keyed, Picture, Shape, ShapeValue};
use crate::pipeline::{
    CompleteRequest, Completion, MorphRequest, PictureFormat, StatisticsRequest, StatisticsValue,
    add_difference, complete, morph, morph_frames, statistics,
};
use crate::plot::Theme;

impl Workbench {
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
        let mean = found.value.mean()?.map(|found| found.output);
        self.keyed_shape(mean, found.then("mean").finish())
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
        let sample = found.value.sample(mode, sigmas)?;
        self.keyed_shape(sample.map(|found| found.output), key.finish())
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
}
