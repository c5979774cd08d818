//! Changed cells as bytes, few of them: over a slow link they are what is waited for.
//!
//! A half or quarter block in two colours looks the same as its complement with the colours exchanged:
//! whichever has more in common with the cell before is sent.

use std::fmt::Write as _;

use ratatui::buffer::Cell;
use ratatui::style::{Color, Modifier};

/// Blocks and their complements.
const COMPLEMENTS: [(&str, &str); 8] = [
    (" ", "█"),
    ("▀", "▄"),
    ("▌", "▐"),
    ("▘", "▟"),
    ("▝", "▙"),
    ("▖", "▜"),
    ("▗", "▛"),
    ("▚", "▞"),
];

/// Modifiers and their codes.
const MODIFIERS: [(Modifier, u8); 7] = [
    (Modifier::BOLD, 1),
    (Modifier::DIM, 2),
    (Modifier::ITALIC, 3),
    (Modifier::UNDERLINED, 4),
    (Modifier::SLOW_BLINK, 5),
    (Modifier::REVERSED, 7),
    (Modifier::CROSSED_OUT, 9),
];

/// The terminal's state while cells are written.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Pen {
    front: Color,
    back: Color,
    modifier: Modifier,
}

const PLAIN: Pen = Pen {
    front: Color::Reset,
    back: Color::Reset,
    modifier: Modifier::empty(),
};

/// Up to this many changed cells both orders are tried.
const FEW: usize = 1000;

/// The bytes that write these cells (column, row, cell) of a terminal of `width` columns, in rows from
/// left to right, and leave the terminal's colours as they were. A few cells are written in columns
/// where that is shorter: a cursor that moved is two columns of one colour each.
pub(super) fn write_cells(changes: &[(u16, u16, &Cell)], width: u16) -> Vec<u8> {
    let rows = written(changes, width);
    // The half of a wide letter is written over from the left only.
    if changes.len() > FEW || !changes.iter().all(|change| is_narrow(change.2.symbol())) {
        return rows;
    }
    let mut downwards = changes.to_vec();
    downwards.sort_by_key(|&(column, row, _)| (column, row));
    let columns = written(&downwards, width);
    if columns.len() < rows.len() {
        columns
    } else {
        rows
    }
}

/// The same in the order given.
fn written(changes: &[(u16, u16, &Cell)], width: u16) -> Vec<u8> {
    let (mut text, mut pen, mut next) = (String::new(), PLAIN, None);
    for &(column, row, cell) in changes {
        move_to(&mut text, next, (column, row));
        let (symbol, wanted) = cheapest(cell, pen);
        change(&mut text, pen, wanted);
        pen = wanted;
        text.push_str(symbol);
        // The place after a letter that may be wide, or after a row's last, is not relied on.
        let sure = is_narrow(cell.symbol()) && column + 1 < width;
        next = sure.then_some((column + 1, row));
    }
    if pen != PLAIN {
        text.push_str("\x1b[m");
    }
    text.into_bytes()
}

fn move_to(text: &mut String, from: Option<(u16, u16)>, to: (u16, u16)) {
    let absolute = format!("\x1b[{};{}H", to.1 + 1, to.0 + 1);
    let steps = from.and_then(|from| relative(from, to));
    text.push_str(
        &steps
            .filter(|steps| steps.len() < absolute.len())
            .unwrap_or(absolute),
    );
}

/// The way along a row, or to the row below.
fn relative(from: (u16, u16), to: (u16, u16)) -> Option<String> {
    let down = match to.1.checked_sub(from.1)? {
        0 => "",
        1 => "\x1b[B",
        _ => return None,
    };
    let aside = if to.0 < from.0 { 'D' } else { 'C' };
    Some(match to.0.abs_diff(from.0) {
        0 => down.to_string(),
        1 => format!("{down}\x1b[{aside}"),
        by => format!("{down}\x1b[{by}{aside}"),
    })
}

/// ASCII, boxes, blocks and braille.
fn is_narrow(symbol: &str) -> bool {
    symbol.chars().all(
        |letter| matches!(letter, ' '..='~' | '\u{2500}'..='\u{259F}' | '\u{2800}'..='\u{28FF}'),
    )
}

/// The letter and the state for a cell, as itself or as its complement.
fn cheapest(cell: &Cell, pen: Pen) -> (&str, Pen) {
    let plain = Pen {
        front: cell.fg,
        back: cell.bg,
        modifier: cell.modifier,
    };
    let symbol = cell.symbol();
    if !cell.modifier.is_empty() || pen.modifier != cell.modifier {
        return (symbol, plain);
    }
    let pair = COMPLEMENTS.iter().find_map(|&(a, b)| match symbol {
        _ if symbol == a => Some(b),
        _ if symbol == b => Some(a),
        _ => None,
    });
    let blank = symbol == " ";
    // The letter's colour of a space is not seen.
    let plain = Pen {
        front: if blank { pen.front } else { plain.front },
        ..plain
    };
    let swapped = Pen {
        front: cell.bg,
        back: if blank { pen.back } else { cell.fg },
        modifier: cell.modifier,
    };
    match pair {
        // The default background cannot be a letter's colour, nor the other way round.
        Some(other)
            if swapped.front != Color::Reset
                && (blank || cell.fg != Color::Reset)
                && cost(pen, swapped) < cost(pen, plain) =>
        {
            (other, swapped)
        }
        _ => (symbol, plain),
    }
}

/// How many bytes a change takes, roughly.
fn cost(from: Pen, to: Pen) -> usize {
    let one = |a: Color, b: Color| if a == b { 0 } else { code(b, 38).len() + 1 };
    one(from.front, to.front) + one(from.back, to.back)
}

fn change(text: &mut String, from: Pen, to: Pen) {
    if from == to {
        return;
    }
    let mut codes: Vec<String> = Vec::new();
    let mut from = from;
    if from.modifier != to.modifier {
        codes.push("0".into());
        from = PLAIN;
        let set = MODIFIERS
            .iter()
            .filter(|(one, _)| to.modifier.contains(*one));
        codes.extend(set.map(|(_, code)| code.to_string()));
    }
    if from.front != to.front {
        codes.push(code(to.front, 38));
    }
    if from.back != to.back {
        codes.push(code(to.back, 48));
    }
    let _ = write!(text, "\x1b[{}m", codes.join(";"));
}

/// The code of a colour, as letter (`base` 38) or background (48).
fn code(colour: Color, base: u8) -> String {
    match colour {
        Color::Rgb(red, green, blue) => format!("{base};2;{red};{green};{blue}"),
        Color::Indexed(index) => format!("{base};5;{index}"),
        other => match named(other) {
            Some(index) => format!("{base};5;{index}"),
            None => (base + 1).to_string(),
        },
    }
}

/// The first 16 colours by name.
fn named(colour: Color) -> Option<u8> {
    const NAMES: [Color; 16] = [
        Color::Black,
        Color::Red,
        Color::Green,
        Color::Yellow,
        Color::Blue,
        Color::Magenta,
        Color::Cyan,
        Color::Gray,
        Color::DarkGray,
        Color::LightRed,
        Color::LightGreen,
        Color::LightYellow,
        Color::LightBlue,
        Color::LightMagenta,
        Color::LightCyan,
        Color::White,
    ];
    let index = NAMES.iter().position(|&name| name == colour)?;
    Some(index as u8)
}

#[cfg(test)]
mod tests {
    use std::num::NonZero;

    use ratatui::buffer::Buffer;
    use ratatui::layout::Rect;
    use ratatui::style::Style;

    use super::*;

    /// What a terminal of 40 x 6 shows after these bytes.
    fn terminal(bytes: &[u8]) -> vt100::Parser {
        let size = |count| NonZero::new(count).unwrap();
        let mut parser = vt100::Parser::new(size(6), size(40), 0);
        parser.process(bytes);
        parser
    }

    fn sent(buffer: &Buffer) -> Vec<u8> {
        write_cells(&Buffer::empty(buffer.area).diff(buffer), buffer.area.width)
    }

    fn seen(cell: &vt100::Cell) -> (String, vt100::Color, vt100::Color) {
        (cell.contents().to_string(), cell.fgcolor(), cell.bgcolor())
    }

    /// The colours that the four quarters of a cell show.
    fn quarters(symbol: &str, front: vt100::Color, back: vt100::Color) -> [vt100::Color; 4] {
        let filled = match symbol {
            "▀" => [true, true, false, false],
            "▄" => [false, false, true, true],
            "▌" => [true, false, true, false],
            "▐" => [false, true, false, true],
            "▘" => [true, false, false, false],
            "▟" => [false, true, true, true],
            "█" => [true; 4],
            _ => [false; 4],
        };
        filled.map(|front_side| if front_side { front } else { back })
    }

    #[test]
    fn blocks_show_their_colours_whichever_way_they_are_sent() {
        let mut buffer = Buffer::empty(Rect::new(0, 0, 40, 6));
        let colour = |seed: u32| Color::Rgb((seed % 3 * 100) as u8, (seed % 2 * 200) as u8, 7);
        let symbols = ["▀", "▌", "▘", " "];
        for (i, cell) in buffer.content.iter_mut().enumerate() {
            let seed = (i as u32).wrapping_mul(2_654_435_761) >> 7;
            cell.set_symbol(symbols[seed as usize % 4])
                .set_fg(colour(seed / 4))
                .set_bg(colour(seed / 24));
        }
        let bytes = sent(&buffer);
        let parser = terminal(&bytes);
        for (i, cell) in buffer.content.iter().enumerate() {
            let shown = parser
                .screen()
                .cell((i / 40) as u16, (i % 40) as u16)
                .unwrap();
            let (symbol, front, back) = seen(shown);
            let rgb = |colour| match colour {
                Color::Rgb(r, g, b) => vt100::Color::Rgb(r, g, b),
                _ => vt100::Color::Default,
            };
            let wanted = quarters(cell.symbol(), rgb(cell.fg), rgb(cell.bg));
            assert_eq!(quarters(&symbol, front, back), wanted, "{i}");
        }
    }

    #[test]
    fn exchanged_colours_cost_one_letter() {
        let mut buffer = Buffer::empty(Rect::new(0, 0, 40, 6));
        let (a, b) = (Color::Rgb(1, 2, 3), Color::Rgb(4, 5, 6));
        buffer[(0, 0)].set_symbol("▀").set_fg(a).set_bg(b);
        buffer[(1, 0)].set_symbol("▀").set_fg(b).set_bg(a);
        buffer[(2, 0)].set_symbol(" ").set_bg(a);
        let text = String::from_utf8(sent(&buffer)).unwrap();
        assert_eq!(text, "\x1b[1;1H\x1b[38;2;1;2;3;48;2;4;5;6m▀▄█\x1b[m");
    }

    #[test]
    fn columns_are_written_downwards_and_edges_are_not_left_behind() {
        let mut buffer = Buffer::empty(Rect::new(0, 0, 40, 6));
        for row in 0..6 {
            buffer[(20, row)].set_symbol("│");
            buffer[(23, row)].set_symbol("┃");
            buffer[(39, row)].set_symbol("x");
        }
        let rows = vec![format!("{:20}│  ┃{:15}x", "", ""); 6];
        assert_eq!(
            terminal(&sent(&buffer)).screen().contents(),
            rows.join("\n")
        );
        let two: Vec<(u16, u16, &Cell)> = [(20, 0), (20, 1)]
            .map(|(column, row)| (column, row, &buffer[(column, row)]))
            .to_vec();
        assert_eq!(write_cells(&two, 40), "\x1b[1;21H│\x1b[B\x1b[D│".as_bytes());
    }

    #[test]
    fn text_arrives_with_its_style_and_its_place() {
        let mut buffer = Buffer::empty(Rect::new(0, 0, 40, 6));
        let bold = Style::new()
            .add_modifier(Modifier::BOLD)
            .fg(Color::Indexed(208));
        buffer.set_string(3, 1, "héllo 字 x", bold);
        buffer.set_string(20, 1, "a", Style::new().add_modifier(Modifier::REVERSED));
        buffer.set_string(0, 5, "end", Style::new().fg(Color::Red));
        let parser = terminal(&sent(&buffer));
        let screen = parser.screen();
        assert_eq!(
            screen.contents().trim_end(),
            "\n   héllo 字 x       a\n\n\n\nend"
        );
        let cell = screen.cell(1, 4).unwrap();
        assert!(cell.bold() && cell.fgcolor() == vt100::Color::Idx(208));
        assert!(screen.cell(1, 20).unwrap().inverse());
        assert_eq!(screen.cell(5, 1).unwrap().fgcolor(), vt100::Color::Idx(1));
        assert_eq!(screen.fgcolor(), vt100::Color::Default);
    }

    #[test]
    fn nothing_is_nothing() {
        assert!(write_cells(&[], 80).is_empty());
    }
}
