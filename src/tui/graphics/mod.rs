//! Pictures in a terminal: one file a protocol.
//!
//! A [`Painter`] turns an [`Image`] into cells of the buffer and into bytes beside them. Nothing is sent
//! for a picture that has not changed.

mod blocks;
mod choice;
mod dots;
mod kitty;
mod palette;

use ratatui::buffer::Buffer;
use ratatui::layout::Rect;

pub use choice::{Answers, Choice, QUERY, choose, read_answers};
pub(super) use choice::{cell_size, complete};

use super::theme::Look;
use crate::image::Image;

/// How pictures are shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Protocol {
    /// Kitty's: pixels.
    Kitty,
    /// Half blocks: two colours a cell.
    Blocks,
    /// Braille: eight dots a cell.
    Braille,
    /// Letters by their darkness.
    Ascii,
}

impl Protocol {
    /// All of them.
    pub const ALL: [Protocol; 4] = [
        Protocol::Kitty,
        Protocol::Blocks,
        Protocol::Braille,
        Protocol::Ascii,
    ];

    /// Its name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Protocol::Kitty => "kitty",
            Protocol::Blocks => "blocks",
            Protocol::Braille => "braille",
            Protocol::Ascii => "ascii",
        }
    }
}

/// Bytes that go with a frame besides its cells.
#[derive(Debug, Default, Clone, PartialEq, Eq)]
pub(super) struct Aside {
    /// To be sent before the cells: transmissions that cells refer to.
    pub(super) before: Vec<u8>,
    /// To be sent after the cells: pictures that are put on top of them.
    pub(super) after: Vec<u8>,
}

/// How many pixels a cell has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct CellSize {
    /// Pixels across.
    pub(super) width: u16,
    /// Pixels down.
    pub(super) height: u16,
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

    /// All pictures of a frame are painted: those that are not among them leave the screen.
    fn finish(&mut self, _: &mut Aside) {}

    /// The terminal is cleared, or given back: nothing that was sent is there any more.
    fn forget(&mut self, _: &mut Aside) {}
}

/// The painter of a protocol.
pub(super) fn painter(protocol: Protocol, look: Look) -> Box<dyn Painter> {
    match protocol {
        Protocol::Kitty => Box::new(kitty::Kitty::default()),
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
