//! Shapes without two colours a cell: braille dots, and letters by their darkness. Both take 2 x 4
//! pixels a cell and set what stands out from the background.

use ratatui::buffer::Buffer;
use ratatui::layout::Rect;
use ratatui::style::Color;

use super::{Aside, Painter, lightness, pixel};
use crate::image::Image;
use crate::tui::theme::{Depth, Look};

/// From nothing to all of a cell.
const LETTERS: &[u8] = b" .:-=+*#%@";
/// Bits of the dots, by row and column.
const DOTS: [[u32; 2]; 4] = [[0x01, 0x08], [0x02, 0x10], [0x04, 0x20], [0x40, 0x80]];
/// A pixel whose lightness differs by as much from the background gets a dot, ordered by a 2 x 2 pattern
/// so that shading shows as density.
const THRESHOLDS: [[u32; 2]; 2] = [[24, 120], [168, 72]];

/// Pictures of braille dots.
pub(super) struct Braille(pub(super) Look);

/// Pictures of letters.
pub(super) struct Ascii(pub(super) Look);

impl Painter for Braille {
    fn paint(&mut self, _: usize, image: &Image, area: Rect, buffer: &mut Buffer, _: &mut Aside) {
        let ground = ground(self.0);
        cells(area, buffer, |column, row, cell| {
            let mut bits = 0;
            let mut colour = None;
            for (dy, bits_of_row) in DOTS.iter().enumerate() {
                for (dx, bit) in bits_of_row.iter().enumerate() {
                    let rgb = pixel(image, 2 * column + dx, 4 * row + dy);
                    let contrast = lightness(rgb).abs_diff(ground);
                    if contrast > THRESHOLDS[dy % 2][dx] {
                        bits |= bit;
                        let best = colour.get_or_insert((contrast, rgb));
                        *best = (*best).max((contrast, rgb));
                    }
                }
            }
            let symbol = char::from_u32(0x2800 + bits)
                .filter(|_| bits > 0)
                .unwrap_or(' ');
            cell.set_char(symbol);
            tint(cell, self.0, colour.map(|(_, rgb)| rgb));
        });
    }
}

impl Painter for Ascii {
    fn paint(&mut self, _: usize, image: &Image, area: Rect, buffer: &mut Buffer, _: &mut Aside) {
        let ground = ground(self.0);
        cells(area, buffer, |column, row, cell| {
            let mut sum = 0;
            let mut strongest = (0, [0; 3]);
            for index in 0..8 {
                let rgb = pixel(image, 2 * column + index % 2, 4 * row + index / 2);
                let contrast = lightness(rgb).abs_diff(ground);
                sum += contrast;
                strongest = strongest.max((contrast, rgb));
            }
            // Lines are thin: half of a cell's dots make its darkest letter.
            let share = (sum as usize * LETTERS.len()) / (8 * 160);
            let letter = LETTERS[share.min(LETTERS.len() - 1)];
            cell.set_char(char::from(letter));
            tint(cell, self.0, (letter != b' ').then_some(strongest.1));
        });
    }
}

/// What does not stand out: the lightness of a picture's background.
fn ground(look: Look) -> u32 {
    let [red, green, blue, _] = look.plot(0.0).background.0;
    lightness([red, green, blue])
}

fn cells(
    area: Rect,
    buffer: &mut Buffer,
    mut draw: impl FnMut(usize, usize, &mut ratatui::buffer::Cell),
) {
    for row in 0..area.height {
        for column in 0..area.width {
            if let Some(cell) = buffer.cell_mut((area.x + column, area.y + row)) {
                draw(usize::from(column), usize::from(row), cell);
            }
        }
    }
}

fn tint(cell: &mut ratatui::buffer::Cell, look: Look, rgb: Option<[u8; 3]>) {
    let colour = match rgb {
        Some(rgb) if look.depth != Depth::Mono => look.colour(rgb.map(|value| value & 0xf0)),
        _ => Color::Reset,
    };
    cell.set_fg(colour).set_bg(Color::Reset);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn drawn(painter: &mut dyn Painter, lit: &[(usize, usize)]) -> String {
        let mut image = Image::new(4, 4);
        let look = Look {
            dark: true,
            depth: Depth::Mono,
        };
        image.fill(look.plot(0.0).background.0);
        for (x, y) in lit {
            image.rgba[4 * (y * 4 + x)..][..3].fill(255);
        }
        let area = Rect::new(0, 0, 2, 1);
        let mut buffer = Buffer::empty(area);
        painter.paint(0, &image, area, &mut buffer, &mut Aside::default());
        buffer.content.iter().map(|cell| cell.symbol()).collect()
    }

    #[test]
    fn lit_pixels_are_dots_and_dark_letters() {
        let look = Look {
            dark: true,
            depth: Depth::Mono,
        };
        assert_eq!(drawn(&mut Braille(look), &[(1, 0), (3, 3)]), "⠈⢀");
        assert_eq!(drawn(&mut Braille(look), &[]), "  ");
        let all: Vec<(usize, usize)> = (0..4).flat_map(|y| [(2, y), (3, y)]).collect();
        assert_eq!(drawn(&mut Ascii(look), &all), " @");
    }
}
