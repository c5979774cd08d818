//! Pictures to files: PNG or SVG, by the ending.

use std::path::Path;

use super::output::{Output, refuse_inputs};
use super::save::Saved;
use crate::diag::{Diagnostic, Result};
use crate::plot::{Scene, raster, svg};
use crate::world::World;

/// Which bytes a picture becomes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PictureFormat {
    /// Pixels.
    Png,
    /// Lines and text.
    Svg,
}

impl PictureFormat {
    /// The format that the ending of `path` names, in upper or lower case.
    ///
    /// # Errors
    /// Another ending, or none.
    pub fn of(path: &Path) -> Result<Self> {
        let ending = path.extension().unwrap_or_default();
        let message = match ending.to_string_lossy().to_ascii_lowercase().as_str() {
            "png" => return Ok(PictureFormat::Png),
            "svg" => return Ok(PictureFormat::Svg),
            "" => "a picture needs an ending".to_string(),
            other => format!("`.{other}` is no picture"),
        };
        Diagnostic::error(message)
            .in_file(path)
            .hint(".png gives pixels, .svg lines and text")
            .err()
    }

    /// The picture as the bytes of a file; PNG with `scale` pixels to the scene's unit.
    ///
    /// # Errors
    /// None that a scene can cause.
    pub fn encode(self, scene: &Scene, scale: f32) -> Result<Vec<u8>> {
        match self {
            PictureFormat::Svg => Ok(svg(scene).into_bytes()),
            PictureFormat::Png => raster(scene, scale).png().map_err(|error| {
                Box::new(Diagnostic::error(format!(
                    "the picture cannot be encoded: {error}"
                )))
            }),
        }
    }
}

/// Writes `scene` to one file, staged and then moved to its place.
///
/// # Errors
/// The ending names no picture, an input would be written over, or the file cannot be written.
pub fn save_picture(
    world: &dyn World,
    scene: &Scene,
    output: &Output,
    scale: f32,
) -> Result<Saved> {
    let format = PictureFormat::of(&output.path)?;
    refuse_inputs(world, [&output.path], &output.inputs)?;
    let bytes = format.encode(scene, scale)?;
    let stage = world.stage(&output.path)?;
    let name = "picture".to_string();
    stage.write(&name, &bytes)?;
    stage.commit(&[(name, output.path.clone())], &[])?;
    Ok(Saved {
        outputs: vec![output.path.clone()],
        removed: Vec::new(),
        frames: 1,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plot::Theme;
    use crate::world::MemoryWorld;

    fn empty() -> Scene {
        Scene::new(30.0, 20.0, Theme::light().background)
    }

    #[test]
    fn the_ending_decides_what_is_written() {
        let world = MemoryWorld::new();
        for (name, start) in [("out/a.png", &b"\x89PNG"[..]), ("b.SVG", b"<svg")] {
            let saved = save_picture(&world, &empty(), &name.into(), 2.0).unwrap();
            assert_eq!(saved.outputs, [Path::new(name)]);
            assert!(world.read(Path::new(name)).unwrap().starts_with(start));
        }
    }

    #[test]
    fn other_endings_are_refused_with_the_choices_and_nothing_is_written() {
        let world = MemoryWorld::new();
        for name in ["a.jpg", "a"] {
            let error = save_picture(&world, &empty(), &name.into(), 1.0).unwrap_err();
            assert!(error.hints[0].contains(".png") && error.place.file.is_some());
        }
        assert!(world.paths().is_empty());
    }

    #[test]
    fn an_input_is_never_written_over() {
        let world = MemoryWorld::new();
        world.insert("a.png", "mine");
        let output = Output::from("a.png").protecting(&["a.png".into()]);
        assert!(save_picture(&world, &empty(), &output, 1.0).is_err());
        assert_eq!(world.read(Path::new("a.png")).unwrap(), b"mine");
    }
}
