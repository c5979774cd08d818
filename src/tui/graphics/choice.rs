//! Which protocol: what the terminal answers decides, with blocks where it says nothing.

use super::kitty::through_tmux;
use super::{CellSize, Protocol};

/// Asks for a kitty picture of one pixel to be checked and not shown.
const KITTY: &str = "\x1b_Gi=31,s=1,v=1,a=q,t=d,f=24;AAAA\x1b\\";
/// Asks for name and version.
const NAME: &str = "\x1b[>q";
/// Asks for the pixels of a cell.
const CELL: &str = "\x1b[16t";
/// Asks for the background's colour.
const BACKGROUND: &str = "\x1b]11;?\x1b\\";
/// Asks how many colours sixel pictures may have.
const REGISTERS_THERE: &str = "\x1b[?1;1;0S";
/// What every terminal answers: its attributes. Asked last, so that nobody waits for those that are silent
/// on the rest.
const ATTRIBUTES: &str = "\x1b[c";

/// Placeholders need kitty 0.28.
const PLACEHOLDERS: (u32, u32) = (0, 28);
/// Sixel pictures of a terminal that does not count its registers: as a VT340 had them.
const REGISTERS: u16 = 16;

/// What the terminal is asked; through tmux what tmux does not know itself, kitty pictures last: once they
/// are answered all is.
pub fn query(tmux: bool) -> String {
    let outer = [NAME, CELL, BACKGROUND, KITTY].map(|question| {
        if tmux {
            String::from_utf8_lossy(&through_tmux(question.as_bytes())).into_owned()
        } else {
            question.to_string()
        }
    });
    outer.concat() + REGISTERS_THERE + ATTRIBUTES
}

/// What a terminal answered.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Answers {
    /// The bytes as they came.
    pub bytes: Vec<u8>,
    /// It shows kitty pictures.
    pub kitty: bool,
    /// It shows sixel pictures.
    pub sixel: bool,
    /// How many colours these may have.
    pub registers: Option<u16>,
    /// Its name and version.
    pub name: Option<String>,
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
    /// Pixels of a cell.
    pub(in crate::tui) cell: CellSize,
    /// Colours of a sixel picture.
    pub(in crate::tui) registers: u16,
    /// Whether pictures go through tmux.
    pub(in crate::tui) tmux: bool,
}

/// Reads the answers to [`query`]; whatever else stands between them is passed over.
pub fn read_answers(bytes: &[u8]) -> Answers {
    let text = String::from_utf8_lossy(bytes);
    Answers {
        kitty: text.contains("\x1b_Gi=31;OK"),
        sixel: attributes(&text).is_some_and(|list| list.split(';').any(|one| one == "4")),
        registers: registers(&text),
        name: name(&text),
        background: background(&text),
        cell: cell(&text),
        bytes: bytes.to_vec(),
    }
}

/// Whether nothing more is to be waited for: the attributes are there, and through tmux, which gives its
/// own at once, the word on kitty pictures too.
pub(in crate::tui) fn complete(bytes: &[u8], tmux: bool) -> bool {
    let text = String::from_utf8_lossy(bytes);
    let outer = !tmux || text.contains("\x1b_Gi=31;");
    outer && attributes(&text).is_some()
}

/// `ESC [ ? 62 ; 4 c`: the numbers.
fn attributes(text: &str) -> Option<&str> {
    text.split("\x1b[?").skip(1).find_map(|rest| {
        let digits = rest.trim_start_matches(|c: char| c.is_ascii_digit() || c == ';');
        digits
            .starts_with('c')
            .then(|| &rest[..rest.len() - digits.len()])
    })
}

/// `ESC [ ? 1 ; 0 ; 256 S`.
fn registers(text: &str) -> Option<u16> {
    let (_, rest) = text.split_once("\x1b[?1;0;")?;
    rest.split_once('S')?
        .0
        .parse()
        .ok()
        .filter(|&count| count > 1)
}

/// `ESC P > | kitty(0.26.5) ESC \`; tmux is nobody's name.
fn name(text: &str) -> Option<String> {
    let names = text.split("\x1bP>|").skip(1);
    let names = names.filter_map(|rest| Some(rest.split_once("\x1b\\")?.0));
    let mut names = names.filter(|name| !name.starts_with("tmux") && name.len() < 64);
    names.next().map(str::to_string)
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

/// The protocol for a terminal that answered so.
pub fn choose(wanted: Option<Protocol>, answers: &Answers, tmux: bool, colour: bool) -> Choice {
    let (protocol, reason) = match wanted {
        Some(protocol) => (protocol, "it was asked for".to_string()),
        None if !colour => (Protocol::Braille, "colours are not wanted".to_string()),
        None if tmux => within_tmux(answers),
        None => direct(answers),
    };
    let usual = CellSize::of(protocol);
    let cell = match answers.cell.filter(|_| protocol.has_pixels()) {
        Some((width, height)) => CellSize {
            width,
            height,
            ..usual
        },
        None => usual,
    };
    Choice {
        protocol,
        reason,
        cell,
        registers: answers.registers.unwrap_or(REGISTERS),
        tmux,
    }
}

fn direct(answers: &Answers) -> (Protocol, String) {
    let named = |names: &[&str]| {
        let name = answers.name.as_deref()?;
        names
            .iter()
            .any(|known| name.starts_with(known))
            .then_some(name)
    };
    // These know kitty's protocol in part only.
    if let Some(name) = named(&["iTerm2", "WezTerm", "mintty"]) {
        let reason = format!("{name} is known to show iTerm2's inline images");
        return (Protocol::Iterm2, reason);
    }
    let konsole = named(&["Konsole"]).is_some();
    if answers.cell.is_none() && (answers.kitty || answers.sixel) {
        let reason = "the terminal did not say how large a cell is".to_string();
        return (Protocol::Blocks, reason);
    }
    if answers.kitty && !konsole {
        let reason = "the terminal said that it shows kitty pictures";
        return (Protocol::Kitty, reason.to_string());
    }
    if answers.sixel {
        let colours = answers.registers.unwrap_or(REGISTERS);
        let reason = format!("the terminal said that it shows sixel pictures, {colours} colours");
        return (Protocol::Sixel, reason);
    }
    let what = if answers.bytes.is_empty() {
        "nothing within 200 ms"
    } else {
        "no word of kitty or sixel pictures"
    };
    (Protocol::Blocks, format!("the terminal answered {what}"))
}

/// Within tmux pictures would not move with their pane, unless placeholders stand for them; its own sixel
/// is too slow for moving pictures.
fn within_tmux(answers: &Answers) -> (Protocol, String) {
    let name = answers.name.as_deref().unwrap_or("the terminal");
    if !answers.kitty {
        let reason = "no kitty pictures through tmux: another terminal, or `tmux set -p allow-passthrough on` is missing";
        return (Protocol::Blocks, reason.to_string());
    }
    if !places_in_text(name) {
        let reason =
            format!("{name} is not known to place kitty pictures by text, as tmux needs it");
        return (Protocol::Blocks, reason);
    }
    let reason = format!("{name} shows kitty pictures through tmux");
    (Protocol::Kitty, reason)
}

/// Whether a terminal knows placeholders.
fn places_in_text(name: &str) -> bool {
    let Some(version) = name.strip_prefix("kitty(") else {
        return name.to_lowercase().starts_with("ghostty");
    };
    let mut numbers = version
        .split(['.', ')'])
        .map_while(|part| part.parse().ok());
    numbers.next().zip(numbers.next()) >= Some(PLACEHOLDERS)
}

#[cfg(test)]
mod tests {
    use super::*;

    const KITTY_SAYS: &[u8] = b"\x1b_Gi=31;OK\x1b\\\x1bP>|kitty(0.32.1)\x1b\\\x1b[6;18;9t\x1b]11;rgb:ffff/8080/0000\x1b\\\x1b[?1;0;1024S\x1b[?62;c";
    const XTERM_SAYS: &[u8] =
        b"\x1bP>|XTerm(379)\x1b\\\x1b[6;13;6t\x1b]11;rgb:0/0/0\x1b\\\x1b[?1;0;256S\x1b[?63;1;2;4;6;9;15;22c";

    #[test]
    fn answers_are_read_from_between_anything() {
        let noisy = [b"q\x1b[A", KITTY_SAYS, b"zz"].concat();
        for bytes in [KITTY_SAYS, &noisy] {
            let answers = read_answers(bytes);
            assert!(answers.kitty && !answers.sixel && complete(bytes, true));
            assert_eq!(answers.background, Some([255, 128, 0]));
            assert_eq!(answers.cell, Some((9, 18)));
            assert_eq!(answers.name.as_deref(), Some("kitty(0.32.1)"));
        }
        let xterm = read_answers(XTERM_SAYS);
        assert!(xterm.sixel && !xterm.kitty);
        assert_eq!(xterm.registers, Some(256));
        assert_eq!(
            read_answers(b"\x1b]11;rgb:f/0/8\x07").background,
            Some([255, 0, 136])
        );
    }

    #[test]
    fn garbage_and_parts_of_answers_are_nothing() {
        for length in 0..KITTY_SAYS.len() - 1 {
            assert!(!complete(&KITTY_SAYS[..length], false));
            read_answers(&KITTY_SAYS[..length]);
        }
        let garbage = b"\x1b]11;rgb:zz//\x1b[6;0;99999t\x1bP>|\x1b[?1;0;xS\x1b[?1;2x\xff\xfe";
        let answers = read_answers(garbage);
        let bytes = garbage.to_vec();
        assert_eq!(
            answers,
            Answers {
                bytes,
                ..Answers::default()
            }
        );
        assert!(!complete(garbage, false));
    }

    #[test]
    fn through_tmux_the_answer_of_tmux_alone_is_not_all() {
        let tmux = b"\x1bP>|tmux 3.3a\x1b\\\x1b[?1;2c";
        assert!(complete(tmux, false) && !complete(tmux, true));
        assert!(complete(&[tmux, KITTY_SAYS].concat(), true));
        assert_eq!(
            read_answers(&[tmux, KITTY_SAYS].concat()).name.unwrap(),
            "kitty(0.32.1)"
        );
        assert!(query(true).contains("\x1bPtmux;\x1b\x1b_G") && query(true).ends_with("\x1b[c"));
    }

    /// What is chosen for answers, (tmux, colour).
    #[test]
    fn the_choice_table() {
        let says = |text: &str| read_answers(text.as_bytes());
        let kitty = "\x1b_Gi=31;OK\x1b\\";
        let cell = "\x1b[6;18;9t";
        let end = "\x1b[?62;c";
        let with = |name: &str| says(&format!("{kitty}\x1bP>|{name}\x1b\\{cell}{end}"));
        let (direct, tmux, plain) = ((false, true), (true, true), (false, false));
        let table = [
            (
                with("kitty(0.26.5)"),
                direct,
                Protocol::Kitty,
                "kitty pictures",
            ),
            (
                with("ghostty 1.1"),
                direct,
                Protocol::Kitty,
                "kitty pictures",
            ),
            (
                with("WezTerm 20240203"),
                direct,
                Protocol::Iterm2,
                "WezTerm",
            ),
            (with("iTerm2 3.5"), direct, Protocol::Iterm2, "iTerm2"),
            (with("Konsole 23.08"), direct, Protocol::Blocks, "no word"),
            (
                says(&format!("{kitty}{end}")),
                direct,
                Protocol::Blocks,
                "how large",
            ),
            (
                read_answers(XTERM_SAYS),
                direct,
                Protocol::Sixel,
                "256 colours",
            ),
            (says("\x1b[?62;4c"), direct, Protocol::Blocks, "how large"),
            (says(end), direct, Protocol::Blocks, "no word"),
            (Answers::default(), direct, Protocol::Blocks, "200 ms"),
            (
                with("kitty(0.26.5)"),
                plain,
                Protocol::Braille,
                "not wanted",
            ),
            (with("kitty(0.28.0)"), tmux, Protocol::Kitty, "through tmux"),
            (with("kitty(1.2)"), tmux, Protocol::Kitty, "through tmux"),
            (with("kitty(0.26.5)"), tmux, Protocol::Blocks, "0.26.5"),
            (with("Ghostty 1.0"), tmux, Protocol::Kitty, "through tmux"),
            (with("foo"), tmux, Protocol::Blocks, "foo"),
            (
                read_answers(XTERM_SAYS),
                tmux,
                Protocol::Blocks,
                "allow-passthrough",
            ),
        ];
        for (answers, (tmux, colour), protocol, why) in table {
            let choice = choose(None, &answers, tmux, colour);
            assert_eq!(choice.protocol, protocol, "{answers:?}");
            assert!(choice.reason.contains(why), "{}", choice.reason);
        }
        for protocol in Protocol::ALL {
            let silent = Answers::default();
            let choice = choose(Some(protocol), &silent, true, false);
            assert_eq!(
                (choice.protocol, choice.cell),
                (protocol, CellSize::of(protocol))
            );
        }
    }

    #[test]
    fn cells_of_pixels_are_the_terminals() {
        let choice = choose(None, &read_answers(KITTY_SAYS), false, true);
        assert_eq!((choice.cell.width, choice.cell.height), (9, 18));
        let blocks = choose(
            Some(Protocol::Blocks),
            &read_answers(KITTY_SAYS),
            false,
            true,
        );
        assert_eq!(blocks.cell, CellSize::of(Protocol::Blocks));
    }
}
