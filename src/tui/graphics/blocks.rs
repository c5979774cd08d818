//! Half blocks: the upper pixel of a cell is its letter's colour, the lower one its background.

use ratatui::buffer::Buffer;
use ratatui::layout::Rect;
use ratatui::style::Color;

use super::{Aside, Painter, pixel};
use crate::image::Image;
use crate::tui::theme::Look;

/// Colours are rounded to this step: shading that changes less sends nothing.
const STEP: u16 = 8;

/// Pictures of half blocks.
pub(super) struct Blocks(pub(super) Look);

impl Painter for Blocks {
    fn paint(&mut self, _: usize, image: &Image, area: Rect, buffer: &mut Buffer, _: &mut Aside) {
        for row in 0..area.height {
            for column in 0..area.width {
                let Some(cell) = buffer.cell_mut((area.x + column, area.y + row)) else {
                    continue;
                };
                let (x, y) = (usize::from(column), 2 * usize::from(row));
                let [upper, lower] = [y, y + 1].map(|y| self.colour(pixel(image, x, y)));
                if upper == lower {
                    // One colour less to send.
                    cell.set_symbol(" ").set_fg(Color::Reset).set_bg(lower);
                } else {
                    cell.set_symbol("▀").set_fg(upper).set_bg(lower);
                }
            }
        }
    }
}

impl Blocks {
    fn colour(&self, rgb: [u8; 3]) -> Color {
        let rounded = |value: u8| ((u16::from(value) + STEP / 2) / STEP * STEP).min(255) as u8;
        self.0.colour(rgb.map(rounded))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tui::theme::Depth;

    #[test]
    fn cells_show_two_pixels_each() {
        let rgba = [
            [255, 0, 0, 255],
            [0, 0, 255, 255],
            [0, 255, 0, 255],
            [0, 0, 255, 255],
        ];
        let image = Image {
            width: 2,
            height: 2,
            rgba: rgba.concat(),
        };
        let area = Rect::new(0, 0, 2, 1);
        let mut buffer = Buffer::empty(area);
        let look = Look {
            dark: true,
            depth: Depth::True,
        };
        Blocks(look).paint(0, &image, area, &mut buffer, &mut Aside::default());
        assert_eq!(buffer[(0, 0)].symbol(), "▀");
        assert_eq!(buffer[(0, 0)].fg, Color::Rgb(255, 0, 0));
        assert_eq!(buffer[(0, 0)].bg, Color::Rgb(0, 255, 0));
        assert_eq!(
            (buffer[(1, 0)].symbol(), buffer[(1, 0)].bg),
            (" ", Color::Rgb(0, 0, 255))
        );
    }
}
