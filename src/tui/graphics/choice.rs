//! Which protocol: what the terminal answers decides, with half blocks where it says nothing.

use super::{CellSize, Protocol};

/// What is asked: kitty pictures, the background's colour, pixels of a cell, and last what every terminal
/// answers (its attributes), so that nobody waits for those that are silent on the rest.
pub const QUERY: &str = "\x1b_Gi=31,s=1,v=1,a=q,t=d,f=24;AAAA\x1b\\\x1b]11;?\x1b\\\x1b[16t\x1b[c";

/// What a terminal answered.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Answers {
    /// The bytes as they came.
    pub bytes: Vec<u8>,
    /// It shows kitty pictures.
    pub kitty: bool,
    /// Red, green, blue of its background.
    pub background: Option<[u8; 3]>,
    /// Columns and rows of a cell in pixels.
    pub cell: Option<(u16, u16)>,
}

/// A protocol, and why.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Choice {
    /// How pictures are shown.
    pub protocol: Protocol,
    /// Why, in words.
    pub reason: String,
}

/// Reads the answers to [`QUERY`]; whatever else stands between them is passed over.
pub fn read_answers(bytes: &[u8]) -> Answers {
    let text = String::from_utf8_lossy(bytes);
    Answers {
        kitty: text.contains("\x1b_Gi=31;OK"),
        background: background(&text),
        cell: cell(&text),
        bytes: bytes.to_vec(),
    }
}

/// Whether the last of the answers is there: the terminal's attributes.
pub(in crate::tui) fn complete(bytes: &[u8]) -> bool {
    let text = String::from_utf8_lossy(bytes);
    text.split("\x1b[?").skip(1).any(|rest| {
        let digits = rest.trim_start_matches(|c: char| c.is_ascii_digit() || c == ';');
        digits.starts_with('c')
    })
}

/// `ESC ] 11 ; rgb:RRRR/GGGG/BBBB`, with one to four digits each.
fn background(text: &str) -> Option<[u8; 3]> {
    let (_, rest) = text.split_once("\x1b]11;rgb:")?;
    let end = rest.find(|c: char| !c.is_ascii_hexdigit() && c != '/')?;
    let mut parts = rest[..end].split('/').map(|part| {
        let most = (1_u32 << (4 * part.len().clamp(1, 4))) - 1;
        let value = u32::from_str_radix(part, 16)
            .ok()
            .filter(|&value| value <= most)?;
        Some((255 * value / most) as u8)
    });
    let colour = [parts.next()??, parts.next()??, parts.next()??];
    parts.next().is_none().then_some(colour)
}

/// `ESC [ 6 ; HEIGHT ; WIDTH t`.
fn cell(text: &str) -> Option<(u16, u16)> {
    let (_, rest) = text.split_once("\x1b[6;")?;
    let (sizes, _) = rest.split_once('t')?;
    let (height, width) = sizes.split_once(';')?;
    let side = |text: &str| text.parse().ok().filter(|side| (1..=200).contains(side));
    Some((side(width)?, side(height)?))
}

/// The protocol for a terminal that answered so; within tmux pictures would not move with their pane.
pub fn choose(wanted: Option<Protocol>, answers: &Answers, tmux: bool, colour: bool) -> Choice {
    let (protocol, reason) = match wanted {
        Some(protocol) => (protocol, "it was asked for".to_string()),
        None if !colour => (Protocol::Braille, "colours are not wanted".to_string()),
        None if tmux => (
            Protocol::Blocks,
            "tmux keeps no pictures in their place".to_string(),
        ),
        None if !answers.kitty => {
            let silent = answers.bytes.is_empty();
            let what = if silent {
                "nothing within 200 ms"
            } else {
                "no word of kitty pictures"
            };
            (Protocol::Blocks, format!("the terminal answered {what}"))
        }
        None if answers.cell.is_none() => {
            let reason = "the terminal did not say how large a cell is".to_string();
            (Protocol::Blocks, reason)
        }
        None => (
            Protocol::Kitty,
            "the terminal said that it shows kitty pictures".to_string(),
        ),
    };
    Choice { protocol, reason }
}

/// The pixels of a cell in pictures of a protocol. A terminal that does not say how large its cells are is
/// taken to have common ones; it scales what it shows.
pub(in crate::tui) fn cell_size(protocol: Protocol, answers: &Answers) -> CellSize {
    let (width, height) = match protocol {
        Protocol::Kitty => answers.cell.unwrap_or((8, 16)),
        Protocol::Blocks => (1, 2),
        Protocol::Braille | Protocol::Ascii => (2, 4),
    };
    CellSize { width, height }
}

#[cfg(test)]
mod tests {
    use super::*;

    const KITTY: &[u8] =
        b"\x1b_Gi=31;OK\x1b\\\x1b]11;rgb:ffff/8080/0000\x1b\\\x1b[6;18;9t\x1b[?62;c";

    #[test]
    fn answers_are_read_from_between_anything() {
        let noisy = [b"q\x1b[A", KITTY, b"zz"].concat();
        for bytes in [KITTY, &noisy] {
            let answers = read_answers(bytes);
            assert!(answers.kitty && complete(bytes));
            assert_eq!(answers.background, Some([255, 128, 0]));
            assert_eq!(answers.cell, Some((9, 18)));
        }
        assert_eq!(
            read_answers(b"\x1b]11;rgb:f/0/8\x07").background,
            Some([255, 0, 136])
        );
    }

    #[test]
    fn garbage_and_parts_of_answers_are_nothing() {
        for length in 0..KITTY.len() - 1 {
            assert!(!complete(&KITTY[..length]));
            read_answers(&KITTY[..length]);
        }
        let garbage = b"\x1b]11;rgb:zz//\x1b[6;0;99999t\x1b[?1;2x\xff\xfe";
        let answers = read_answers(garbage);
        assert!(!answers.kitty && answers.background.is_none() && answers.cell.is_none());
        assert!(!complete(garbage));
    }

    #[test]
    fn the_choice_and_its_reason() {
        let (kitty, silent) = (read_answers(KITTY), Answers::default());
        let plain = read_answers(b"\x1b[?62;c");
        let chosen = |answers, tmux, colour| choose(None, answers, tmux, colour).protocol;
        assert_eq!(chosen(&kitty, false, true), Protocol::Kitty);
        assert_eq!(chosen(&kitty, true, true), Protocol::Blocks);
        assert_eq!(chosen(&kitty, false, false), Protocol::Braille);
        assert_eq!(chosen(&plain, false, true), Protocol::Blocks);
        assert!(choose(None, &silent, false, true).reason.contains("200 ms"));
        for protocol in Protocol::ALL {
            assert_eq!(
                choose(Some(protocol), &silent, true, false).protocol,
                protocol
            );
        }
    }
}
