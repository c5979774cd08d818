//! Pictures in a terminal: one file a protocol.
//!
//! A [`Painter`] turns an [`Image`] into cells of the buffer and into bytes beside them. Nothing is sent
//! for a picture that has not changed.

mod blocks;
mod choice;
mod dots;
mod inline;
mod iterm2;
mod kitty;
mod palette;
mod placeholder;
mod sixel;

use ratatui::buffer::Buffer;
use ratatui::layout::Rect;

pub(super) use choice::complete;
pub use choice::{Answers, Choice, choose, query, read_answers};

use super::theme::Look;
use crate::image::Image;

/// How pictures are shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Protocol {
    /// Kitty's: pixels below the text.
    Kitty,
    /// iTerm2's inline images: pixels.
    Iterm2,
    /// Sixel: pixels, as DEC's terminals had them.
    Sixel,
    /// Halves and quarters of cells: two colours a cell.
    Blocks,
    /// Braille: eight dots a cell.
    Braille,
    /// Letters by their darkness.
    Ascii,
}

impl Protocol {
    /// All of them.
    pub const ALL: [Protocol; 6] = [
        Protocol::Kitty,
        Protocol::Iterm2,
        Protocol::Sixel,
        Protocol::Blocks,
        Protocol::Braille,
        Protocol::Ascii,
    ];

    /// Whether it shows pixels, not characters.
    pub(super) fn has_pixels(self) -> bool {
        matches!(self, Protocol::Kitty | Protocol::Iterm2 | Protocol::Sixel)
    }

    /// Its name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Protocol::Kitty => "kitty",
            Protocol::Iterm2 => "iterm2",
            Protocol::Sixel => "sixel",
            Protocol::Blocks => "blocks",
            Protocol::Braille => "braille",
            Protocol::Ascii => "ascii",
        }
    }
}

/// Bytes that go with a frame besides its cells.
#[derive(Debug, Default, Clone, PartialEq, Eq)]
pub(super) struct Aside {
    /// To be sent before the cells.
    pub(super) before: Vec<u8>,
}

/// How many pixels a cell has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct CellSize {
    /// Pixels across.
    pub(super) width: u16,
    /// Pixels down.
    pub(super) height: u16,
    /// Plots are drawn so many times finer, then averaged: lines half a pixel thick show more of few
    /// pixels.
    pub(super) fine: u16,
    /// Whether surfaces show by their shades, not lines only.
    pub(super) shades: bool,
    /// Whether the terminal scales a picture to its cells: a coarse one will do while things move.
    pub(super) scales: bool,
}

impl CellSize {
    /// The pixels of a cell in pictures of a protocol that has none of its own.
    pub(super) fn of(protocol: Protocol) -> Self {
        let (width, height, fine) = match protocol {
            // Common cells; the terminal scales what it shows.
            Protocol::Kitty | Protocol::Iterm2 | Protocol::Sixel => (8, 16, 1),
            Protocol::Blocks | Protocol::Braille => (2, 4, 2),
            Protocol::Ascii => (2, 4, 1),
        };
        CellSize {
            width,
            height,
            fine,
            shades: !matches!(protocol, Protocol::Braille | Protocol::Ascii),
            scales: protocol == Protocol::Kitty,
        }
    }
}

/// Puts pictures into one area of the screen after another, and remembers what it has sent.
pub(super) trait Painter {
    /// Shows `image` in `area` as picture number `slot`: one number a panel. An image of another size
    /// than the area has is scaled or cut.
    fn paint(
        &mut self,
        slot: usize,
        image: &Image,
        area: Rect,
        buffer: &mut Buffer,
        aside: &mut Aside,
    );

    /// All pictures of a frame are painted, and all text on them: pictures that are not among them leave the
    /// screen.
    fn finish(&mut self, _: &mut Buffer, _: &mut Aside) {}

    /// The terminal is cleared, or given back: nothing that was sent is there any more.
    fn forget(&mut self, _: &mut Aside) {}
}

/// The painter of a choice.
pub(super) fn painter(choice: &Choice, look: Look) -> Box<dyn Painter> {
    let registers = choice.registers;
    let [red, green, blue, _] = look.plot(0.0).background.0;
    let ground = look.colour([red, green, blue]);
    match choice.protocol {
        Protocol::Kitty => Box::new(kitty::Kitty::new(choice.tmux)),
        Protocol::Iterm2 => Box::new(inline::Inline::new(iterm2::Iterm2, choice.cell, ground)),
        Protocol::Sixel => Box::new(inline::Inline::new(
            sixel::Sixel { registers },
            choice.cell,
            ground,
        )),
        Protocol::Blocks => Box::new(blocks::Blocks(look)),
        Protocol::Braille => Box::new(dots::Braille(look)),
        Protocol::Ascii => Box::new(dots::Ascii(look)),
    }
}

/// The colour of a pixel; black outside.
fn pixel(image: &Image, x: usize, y: usize) -> [u8; 3] {
    if x >= image.width || y >= image.height {
        return [0; 3];
    }
    let start = 4 * (y * image.width + x);
    [
        image.rgba[start],
        image.rgba[start + 1],
        image.rgba[start + 2],
    ]
}

/// How light a colour looks, in \[0, 255\] (BT.601).
fn lightness([red, green, blue]: [u8; 3]) -> u32 {
    (299 * u32::from(red) + 587 * u32::from(green) + 114 * u32::from(blue)) / 1000
}
