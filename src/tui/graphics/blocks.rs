//! Halves and quarters of cells: two colours a cell, the best split of its four quarters between them.

use ratatui::buffer::Buffer;
use ratatui::layout::Rect;
use ratatui::style::Color;

use super::{Aside, Painter, pixel};
use crate::image::Image;
use crate::tui::theme::Look;

/// Colours are rounded to this step: shading that changes less sends nothing.
const STEP: u16 = 8;
/// Quarters whose squared distances from their mean stay below this sum are one colour.
const ALIKE: u32 = 4 * 3 * 36;

/// What can be in front of the other colour: letter, and which quarters it fills (upper left, upper
/// right, lower left, lower right). The halves come first: of equals the first is taken.
const SPLITS: [(&str, [bool; 4]); 7] = [
    ("▀", [true, true, false, false]),
    ("▌", [true, false, true, false]),
    ("▘", [true, false, false, false]),
    ("▝", [false, true, false, false]),
    ("▖", [false, false, true, false]),
    ("▗", [false, false, false, true]),
    ("▚", [true, false, false, true]),
];

/// Pictures of blocks, from 2 x 4 pixels a cell: a quarter is the mean of two.
pub(super) struct Blocks(pub(super) Look);

impl Painter for Blocks {
    fn paint(&mut self, _: usize, image: &Image, area: Rect, buffer: &mut Buffer, _: &mut Aside) {
        for at in area.positions() {
            let Some(cell) = buffer.cell_mut(at) else {
                continue;
            };
            let (x, y) = (
                2 * usize::from(at.x - area.x),
                4 * usize::from(at.y - area.y),
            );
            let quarter = |i: usize| {
                let (x, y) = (x + i % 2, y + 2 * (i / 2));
                mean([pixel(image, x, y), pixel(image, x, y + 1)].into_iter())
            };
            let (symbol, front, back) = split(std::array::from_fn(quarter));
            let (front, back) = (self.colour(front), self.colour(back));
            if front == back {
                // One colour less to send.
                cell.set_symbol(" ").set_fg(Color::Reset).set_bg(back);
            } else {
                cell.set_symbol(symbol).set_fg(front).set_bg(back);
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

/// The letter and the two colours that come closest to four quarters.
fn split(quarters: [[u8; 3]; 4]) -> (&'static str, [u8; 3], [u8; 3]) {
    let all = mean(quarters.into_iter());
    if quarters
        .iter()
        .map(|&quarter| distance(quarter, all))
        .sum::<u32>()
        < ALIKE
    {
        return (" ", all, all);
    }
    let options = SPLITS.map(|(symbol, filled)| {
        let of = |side: bool| {
            (0..4)
                .filter(move |&i| filled[i] == side)
                .map(|i| quarters[i])
        };
        let (front, back) = (mean(of(true)), mean(of(false)));
        let missed = |side, colour| {
            of(side)
                .map(|quarter| distance(quarter, colour))
                .sum::<u32>()
        };
        (
            missed(true, front) + missed(false, back),
            symbol,
            front,
            back,
        )
    });
    let best = options.into_iter().min_by_key(|option| option.0);
    best.map_or((" ", all, all), |(_, symbol, front, back)| {
        (symbol, front, back)
    })
}

fn mean(colours: impl Iterator<Item = [u8; 3]>) -> [u8; 3] {
    let (mut sum, mut count) = ([0_u32; 3], 0);
    for colour in colours {
        (0..3).for_each(|i| sum[i] += u32::from(colour[i]));
        count += 1;
    }
    sum.map(|sum| (sum / count.max(1)) as u8)
}

fn distance(a: [u8; 3], b: [u8; 3]) -> u32 {
    (0..3).map(|i| u32::from(a[i].abs_diff(b[i])).pow(2)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tui::theme::Depth;

    const RED: [u8; 3] = [255, 0, 0];
    const BLUE: [u8; 3] = [0, 0, 255];

    #[test]
    fn every_split_into_two_colours_is_shown_exactly() {
        for filled in 0..16_u32 {
            let wanted: [[u8; 3]; 4] =
                std::array::from_fn(|i| if filled >> i & 1 == 1 { RED } else { BLUE });
            let (symbol, front, back) = split(wanted);
            let shown = SPLITS.iter().find(|(known, _)| *known == symbol);
            let shown = shown.map_or([back; 4], |(_, of)| {
                of.map(|side| if side { front } else { back })
            });
            assert_eq!(shown, wanted, "{filled:04b} {symbol}");
        }
    }

    #[test]
    fn cells_show_their_quarters_and_nearly_equal_ones_are_one() {
        // Two cells: the upper half red over blue, and noise.
        let rgba = (0..16_u8).flat_map(|i| match (i % 4 < 2, i / 8) {
            (true, 0) => [255, 0, 0, 255],
            (true, _) => [0, 0, 255, 255],
            (false, _) => [96 + i % 2, 96, 96, 255],
        });
        let image = Image {
            width: 4,
            height: 4,
            rgba: rgba.collect(),
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
        assert_eq!(buffer[(0, 0)].bg, Color::Rgb(0, 0, 255));
        let (symbol, colour) = (buffer[(1, 0)].symbol(), buffer[(1, 0)].bg);
        assert_eq!((symbol, colour), (" ", Color::Rgb(96, 96, 96)));
    }
}
