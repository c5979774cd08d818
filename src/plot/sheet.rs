//! A contact sheet: pictures in rows, each with a line of text below it.

use std::sync::Arc;

use super::scene::{Anchor, Item, Rect, Scene};
use super::text::{CAP_HEIGHT, text_width};
use super::theme::Theme;
use crate::image::Image;

/// Pictures in rows of `columns` (0: as many as make the sheet about half as wide again as high), each
/// in a cell as large as the largest of them, one pixel to a unit; the texts below them, shortened
/// where they are wider than the cell. Without pictures, an empty sheet.
pub fn sheet(pictures: &[(String, Arc<Image>)], columns: usize, theme: &Theme) -> Scene {
    let largest = |side: fn(&Image) -> usize| pictures.iter().map(|(_, one)| side(one)).max();
    let wide = largest(|image| image.width).unwrap_or(1) as f32;
    let tall = largest(|image| image.height).unwrap_or(1) as f32;
    let gap = (0.5 * theme.text).round();
    let cell = [wide + gap, tall + (1.6 * theme.text).round() + gap];
    let columns = if columns == 0 {
        balanced(pictures.len(), cell)
    } else {
        columns
    };
    let columns = columns.clamp(1, pictures.len().max(1));
    let rows = pictures.len().div_ceil(columns);
    let (width, height) = (columns as f32 * cell[0] + gap, rows as f32 * cell[1] + gap);
    let mut scene = Scene::new(width, height, theme.background);
    for (i, (text, image)) in pictures.iter().enumerate() {
        let left = gap + (i % columns) as f32 * cell[0];
        let top = gap + (i / columns) as f32 * cell[1];
        scene.items.push(Item::Picture {
            rect: centred(Rect::new(left, top, wide, tall), image),
            image: image.clone(),
        });
        let base = top + tall + (0.45 + CAP_HEIGHT) * theme.text;
        let text = shortened(text, wide, theme.text);
        scene.write(&text, [left + 0.5 * wide, base], Anchor::Middle, theme);
    }
    scene
}

/// Columns for which `count` cells fill a sheet of about 3 : 2.
fn balanced(count: usize, cell: [f32; 2]) -> usize {
    (1.5 * count as f32 * cell[1] / cell[0]).sqrt().round() as usize
}

/// The image in its own size in the middle of the cell, on whole pixels.
fn centred(cell: Rect, image: &Image) -> Rect {
    let (width, height) = (image.width as f32, image.height as f32);
    let left = cell.left + (0.5 * (cell.width - width)).floor();
    let top = cell.top + (0.5 * (cell.height - height)).floor();
    Rect::new(left, top, width, height)
}

fn shortened(text: &str, width: f32, size: f32) -> String {
    let mut short: String = text.into();
    while text_width(&short, size) > width && short.pop().is_some() {
        short = short.trim_end_matches('…').to_string();
        short.pop();
        short.push('…');
    }
    short
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plot::raster;

    fn picture(i: u8) -> (String, Arc<Image>) {
        let rgba = [i, 0, 200, 255].repeat(20 * 10);
        let image = Image {
            width: 20,
            height: 10,
            rgba,
        };
        (format!("frame number {i}"), Arc::new(image))
    }

    #[test]
    fn pictures_keep_their_pixels_and_do_not_meet() {
        let pictures: Vec<_> = (0..7).map(picture).collect();
        for columns in [0, 1, 3, 100] {
            let scene = sheet(&pictures, columns, &Theme::light());
            let image = raster(&scene, 1.0);
            let mut seen: Vec<Rect> = Vec::new();
            for item in &scene.items {
                if let Item::Picture { rect, image: own } = item {
                    assert!(seen.iter().all(|other| !other.intersects(rect)));
                    let at = 4 * ((rect.top as usize + 5) * image.width + rect.left as usize + 10);
                    assert_eq!(image.rgba[at..at + 4], own.rgba[..4]);
                    seen.push(*rect);
                }
            }
            assert_eq!(seen.len(), 7);
        }
    }

    #[test]
    fn texts_are_no_wider_than_their_cell() {
        let scene = sheet(&[picture(1)], 0, &Theme::light());
        let texts = scene.items.iter().filter_map(|item| match item {
            Item::Text(label) => Some(label),
            _ => None,
        });
        assert!(
            texts
                .into_iter()
                .all(|label| text_width(&label.text, label.size) <= 20.0)
        );
        assert_eq!(shortened("frame 12", 1000.0, 12.0), "frame 12");
        assert!(sheet(&[], 0, &Theme::dark()).items.is_empty());
    }
}
