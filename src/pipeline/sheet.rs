//! A contact sheet: small shaded pictures of the frames of a capture or a loom.

use std::sync::Arc;

use crate::diag::{Diagnostic, Result};
use crate::image::Image;
use crate::mesh::{Bounds, FrameSource};
use crate::plot::{Scene, Theme, sheet};
use crate::task::Task;
use crate::view::{Camera, Renderer, Style, Surface};

/// Side of each picture in pixels.
const SIDE: usize = 192;

/// A sheet of at most `most` frames of `source`, evenly from the first to the last, all seen from the same
/// place, numbered from 1. `direction` is yaw and pitch of the camera in radians.
///
/// # Errors
/// A frame cannot be fetched, or the task was cancelled.
pub fn contact_sheet(
    source: &dyn FrameSource,
    most: usize,
    direction: [f64; 2],
    theme: &Theme,
    task: &Task,
) -> Result<Scene> {
    let chosen = even(source.frames(), most);
    task.phase("draw", chosen.len());
    let mut shapes = Vec::new();
    for &frame in &chosen {
        task.check()?;
        shapes.push(fetched(source, frame)?);
    }
    let mut camera = Camera {
        yaw: direction[0],
        pitch: direction[1],
        ..Camera::default()
    };
    if let Some(bounds) = Bounds::of(&shapes.concat()) {
        camera.frame(&bounds, 1.0);
    }
    let style = Style {
        background: theme.background.0,
        ..if theme.is_dark() {
            Style::DARK
        } else {
            Style::LIGHT
        }
    };
    let (mut renderer, mut large) = (Renderer::default(), Image::new(2 * SIDE, 2 * SIDE));
    let mut pictures = Vec::new();
    for (&frame, positions) in chosen.iter().zip(&shapes) {
        task.check()?;
        let surface = Surface {
            triangles: source.topology().triangles(),
            positions,
            colours: None,
        };
        renderer.render(surface, &camera, &style, &mut large);
        pictures.push(((frame + 1).to_string(), Arc::new(large.halved())));
        task.step();
    }
    Ok(sheet(&pictures, 0, theme))
}

/// At most `most` of `count` things from 0, evenly, both ends among them.
fn even(count: usize, most: usize) -> Vec<usize> {
    let most = most.min(count);
    let step = |i: usize| i * count.saturating_sub(1) / most.saturating_sub(1).max(1);
    (0..most).map(step).collect()
}

fn fetched(source: &dyn FrameSource, frame: usize) -> Result<Vec<f32>> {
    let mut positions = vec![0.0; 3 * source.topology().vertices()];
    match source.read_frame(frame, &mut positions) {
        Ok(()) => Ok(positions),
        Err(error) => Diagnostic::error(format!("the frame cannot be fetched: {error}"))
            .at_frame(frame + 1)
            .err(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{Sequence, Topology};
    use crate::plot::Item;

    fn triangles(frames: usize) -> Sequence {
        let topology = Arc::new(Topology::from_triangles(3, &[[0, 1, 2]]).unwrap());
        let positions = (0..frames).flat_map(|i| {
            let size = 1.0 + i as f32;
            [0.0, 0.0, 0.0, size, 0.0, 0.0, 0.0, size, 0.0]
        });
        Sequence::new(topology, positions.collect(), None)
    }

    #[test]
    fn frames_are_spread_evenly_and_numbered_from_one() {
        let (theme, task) = (Theme::light(), Task::default());
        let scene = contact_sheet(&triangles(11), 6, [0.0, 0.0], &theme, &task).unwrap();
        let text = |item: &Item| match item {
            Item::Text(label) => Some(label.text.clone()),
            _ => None,
        };
        let texts: Vec<String> = scene.items.iter().filter_map(text).collect();
        assert_eq!(texts, ["1", "3", "5", "7", "9", "11"]);
    }

    #[test]
    fn all_frames_are_seen_from_the_same_place() {
        let (theme, task) = (Theme::dark(), Task::default());
        let scene = contact_sheet(&triangles(3), 9, [0.0, 0.0], &theme, &task).unwrap();
        let covered = |item: &Item| match item {
            Item::Picture { image, .. } => {
                let pixels = image.rgba.chunks_exact(4);
                Some(pixels.filter(|pixel| **pixel != theme.background.0).count())
            }
            _ => None,
        };
        let covered: Vec<usize> = scene.items.iter().filter_map(covered).collect();
        assert!(covered[0] > 0 && covered[0] < covered[1] && covered[1] < covered[2]);
    }

    #[test]
    fn no_frames_give_an_empty_sheet_and_cancellation_ends() {
        let task = Task::default();
        let draw = |frames| contact_sheet(&triangles(frames), 4, [0.0; 2], &Theme::light(), &task);
        assert!(draw(0).unwrap().items.is_empty());
        assert!(draw(1).unwrap().items.len() >= 2);
        task.cancel();
        assert!(draw(2).is_err());
    }
}
