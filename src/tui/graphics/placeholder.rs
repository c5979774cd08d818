//! Unicode placeholders of the kitty protocol: a cell that holds U+10EEEE with two diacritics shows the part
//! of a picture in the row and column that these stand for; its letter's colour is the picture's number.
//! They are text, so that tmux moves them with their pane.

use ratatui::buffer::Cell;
use ratatui::style::{Color, Style};

const PLACEHOLDER: char = '\u{10EEEE}';

/// First code point and number of consecutive ones: the protocol's 297 diacritics, in order. They are
/// those of class 230 in Unicode 6.0 without the common accents.
const DIACRITICS: &[(u32, u32)] = &[
    (0x0305, 1),
    (0x030D, 2),
    (0x0310, 1),
    (0x0312, 1),
    (0x033D, 3),
    (0x0346, 1),
    (0x034A, 3),
    (0x0350, 3),
    (0x0357, 1),
    (0x035B, 1),
    (0x0363, 13),
    (0x0483, 5),
    (0x0592, 4),
    (0x0597, 3),
    (0x059C, 6),
    (0x05A8, 2),
    (0x05AB, 2),
    (0x05AF, 1),
    (0x05C4, 1),
    (0x0610, 8),
    (0x0657, 5),
    (0x065D, 2),
    (0x06D6, 7),
    (0x06DF, 4),
    (0x06E4, 1),
    (0x06E7, 2),
    (0x06EB, 2),
    (0x0730, 1),
    (0x0732, 2),
    (0x0735, 2),
    (0x073A, 1),
    (0x073D, 1),
    (0x073F, 3),
    (0x0743, 1),
    (0x0745, 1),
    (0x0747, 1),
    (0x0749, 2),
    (0x07EB, 7),
    (0x07F3, 1),
    (0x0816, 4),
    (0x081B, 9),
    (0x0825, 3),
    (0x0829, 5),
    (0x0951, 1),
    (0x0953, 2),
    (0x0F82, 2),
    (0x0F86, 2),
    (0x135D, 3),
    (0x17DD, 1),
    (0x193A, 1),
    (0x1A17, 1),
    (0x1A75, 8),
    (0x1B6B, 1),
    (0x1B6D, 7),
    (0x1CD0, 3),
    (0x1CDA, 2),
    (0x1CE0, 1),
    (0x1DC0, 2),
    (0x1DC3, 7),
    (0x1DCB, 2),
    (0x1DD1, 22),
    (0x1DFE, 1),
    (0x20D0, 2),
    (0x20D4, 4),
    (0x20DB, 2),
    (0x20E1, 1),
    (0x20E7, 1),
    (0x20E9, 1),
    (0x20F0, 1),
    (0x2CEF, 3),
    (0x2DE0, 32),
    (0xA66F, 1),
    (0xA67C, 2),
    (0xA6F0, 2),
    (0xA8E0, 18),
    (0xAAB0, 1),
    (0xAAB2, 2),
    (0xAAB7, 2),
    (0xAABE, 2),
    (0xAAC1, 1),
    (0xFE20, 7),
    (0x10A0F, 1),
    (0x10A38, 1),
    (0x1D185, 5),
    (0x1D1AA, 4),
    (0x1D242, 3),
];

/// The diacritic that stands for a row or column, from 0.
fn diacritic(mut index: u32) -> Option<char> {
    for &(first, count) in DIACRITICS {
        if index < count {
            return char::from_u32(first + index);
        }
        index -= count;
    }
    None
}

/// Makes `cell` show the part of picture `id` in that row and column. Columns beyond the last diacritic
/// continue from their left neighbour; rows beyond it stay empty.
pub(super) fn place(cell: &mut Cell, id: u32, row: u16, column: u16) {
    let Some(down) = diacritic(u32::from(row)) else {
        cell.reset();
        return;
    };
    let across = diacritic(u32::from(column));
    let symbol: String = match across {
        Some(across) => [PLACEHOLDER, down, across].iter().collect(),
        None => PLACEHOLDER.to_string(),
    };
    let [_, red, green, blue] = id.to_be_bytes();
    cell.reset();
    cell.set_symbol(&symbol)
        .set_style(Style::new().fg(Color::Rgb(red, green, blue)));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn diacritics_grow_and_are_as_many_as_the_protocol_has() {
        let all: Vec<char> = (0..).map_while(diacritic).collect();
        assert_eq!(all.len(), 297);
        assert!(all.is_sorted());
        assert_eq!(
            (all[0], all[1], all[296]),
            ('\u{305}', '\u{30D}', '\u{1D244}')
        );
    }

    #[test]
    fn cells_name_picture_row_and_column() {
        let mut cell = Cell::EMPTY;
        place(&mut cell, 0x01_02_03, 1, 0);
        assert_eq!(cell.symbol(), "\u{10EEEE}\u{30D}\u{305}");
        assert_eq!(cell.fg, Color::Rgb(1, 2, 3));
        place(&mut cell, 0x01_02_03, 0, 400);
        assert_eq!(cell.symbol(), "\u{10EEEE}");
        place(&mut cell, 0x01_02_03, 400, 0);
        assert_eq!(cell, Cell::EMPTY);
    }
}
