//! What hands do while the terminal is still being asked: keys and mouse among its answers, which are read
//! as bytes then. What is typed is not lost; what nobody typed is no key.

use ratatui::crossterm::event::{
    Event, KeyCode, KeyEvent, KeyModifiers, MouseButton, MouseEvent, MouseEventKind,
};

/// The keys and the mouse of these bytes, without answers. Behind something that is neither, nothing more is
/// believed.
pub(super) fn typed(bytes: &[u8]) -> Vec<Event> {
    let (mut events, mut rest) = (Vec::new(), bytes);
    while let Some(part) = next(rest) {
        events.extend(part.event);
        rest = &rest[part.length..];
    }
    events
}

/// The first part of some bytes: how long it is, and what it says if it is not an answer.
struct Part {
    length: usize,
    event: Option<Event>,
}

fn next(bytes: &[u8]) -> Option<Part> {
    match bytes {
        [] => None,
        [0x1b, b']' | b'P' | b'_', ..] => string(bytes),
        [0x1b, b'[', ..] => control(bytes),
        [0x1b, ..] => None,
        _ => letter(bytes),
    }
}

/// An answer that ends with ESC \\ or BEL.
fn string(bytes: &[u8]) -> Option<Part> {
    let bell = bytes.iter().position(|&byte| byte == 0x07).map(|at| at + 1);
    let escape = bytes.windows(2).position(|pair| pair == b"\x1b\\");
    let ends = [bell, escape.map(|at| at + 2)];
    let length = ends.into_iter().flatten().min()?;
    Some(Part {
        length,
        event: None,
    })
}

/// ESC \[ .. and a letter: an answer, a key or the mouse.
fn control(bytes: &[u8]) -> Option<Part> {
    let last = bytes[2..]
        .iter()
        .position(|byte| (0x40..=0x7e).contains(byte))?
        + 2;
    let inside = str::from_utf8(&bytes[2..last]).ok()?;
    let length = last + 1;
    let event = match bytes[last] {
        // Attributes, sizes, registers.
        b'c' | b't' | b'S' => None,
        b'M' | b'm' => Some(mouse(inside, bytes[last] == b'M')?),
        other => Some(Event::Key(named(inside, other)?)),
    };
    Some(Part { length, event })
}

/// A key with a name: its modifiers stand behind a semicolon.
fn named(inside: &str, last: u8) -> Option<KeyEvent> {
    let code = match last {
        b'A' => KeyCode::Up,
        b'B' => KeyCode::Down,
        b'C' => KeyCode::Right,
        b'D' => KeyCode::Left,
        b'H' => KeyCode::Home,
        b'F' => KeyCode::End,
        b'Z' => return Some(KeyEvent::new(KeyCode::BackTab, KeyModifiers::SHIFT)),
        _ => return None,
    };
    let modifiers = match inside.split_once(';') {
        None if inside.is_empty() => KeyModifiers::NONE,
        Some(("1", number)) => modifiers(number.parse::<u8>().ok()?.checked_sub(1)?),
        _ => return None,
    };
    Some(KeyEvent::new(code, modifiers))
}

/// Shift, alt and ctrl as terminals number them.
fn modifiers(bits: u8) -> KeyModifiers {
    let known = [
        (1, KeyModifiers::SHIFT),
        (2, KeyModifiers::ALT),
        (4, KeyModifiers::CONTROL),
    ];
    let set = known.into_iter().filter(|(bit, _)| bits & bit != 0);
    set.fold(KeyModifiers::NONE, |all, (_, one)| all | one)
}

/// `<BUTTON;COLUMN;ROW`, from 1.
fn mouse(inside: &str, down: bool) -> Option<Event> {
    let mut numbers = inside
        .strip_prefix('<')?
        .split(';')
        .map(|number| number.parse::<u16>());
    let mut number = || numbers.next()?.ok();
    let (button, column, row) = (number()?, number()?, number()?);
    let which = match button & 3 {
        0 => Some(MouseButton::Left),
        1 => Some(MouseButton::Middle),
        2 => Some(MouseButton::Right),
        _ => None,
    };
    let kind = match (button & 64 != 0, button & 32 != 0, which) {
        (true, _, Some(MouseButton::Left)) => MouseEventKind::ScrollUp,
        (true, _, Some(MouseButton::Middle)) => MouseEventKind::ScrollDown,
        (true, ..) => return None,
        (false, true, None) => MouseEventKind::Moved,
        (false, true, Some(which)) => MouseEventKind::Drag(which),
        (false, false, Some(which)) if down => MouseEventKind::Down(which),
        (false, false, which) => MouseEventKind::Up(which?),
    };
    let bits = (button >> 2 & 7) as u8;
    Some(Event::Mouse(MouseEvent {
        kind,
        column: column.checked_sub(1)?,
        row: row.checked_sub(1)?,
        modifiers: modifiers(bits),
    }))
}

/// A letter, or a key that is one.
fn letter(bytes: &[u8]) -> Option<Part> {
    let valid = match str::from_utf8(bytes) {
        Ok(text) => text,
        Err(error) => str::from_utf8(&bytes[..error.valid_up_to()]).ok()?,
    };
    let letter = valid.chars().next()?;
    let plain = |code| KeyEvent::new(code, KeyModifiers::NONE);
    let key = match letter {
        '\r' => plain(KeyCode::Enter),
        '\t' => plain(KeyCode::Tab),
        '\x7f' => plain(KeyCode::Backspace),
        '\x01'..='\x1a' => {
            let letter = char::from(letter as u8 - 1 + b'a');
            KeyEvent::new(KeyCode::Char(letter), KeyModifiers::CONTROL)
        }
        letter if letter.is_control() => return None,
        letter => plain(KeyCode::Char(letter)),
    };
    Some(Part {
        length: letter.len_utf8(),
        event: Some(Event::Key(key)),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn key(code: KeyCode, modifiers: KeyModifiers) -> Event {
        Event::Key(KeyEvent::new(code, modifiers))
    }

    #[test]
    fn keys_are_told_from_answers() {
        let (none, shift) = (KeyModifiers::NONE, KeyModifiers::SHIFT);
        let bytes = "g\x1b]11;rgb:0000/0000/0000\x1b\\\t\x1b[1;2C\x1b[6;20;10t\x1b[D\x1b_Gi=31;OK\x1b\\\x1b[?62cé\x03";
        let expected = [
            key(KeyCode::Char('g'), none),
            key(KeyCode::Tab, none),
            key(KeyCode::Right, shift),
            key(KeyCode::Left, none),
            key(KeyCode::Char('é'), none),
            key(KeyCode::Char('c'), KeyModifiers::CONTROL),
        ];
        assert_eq!(typed(bytes.as_bytes()), expected);
    }

    #[test]
    fn the_mouse_is_read_as_terminals_tell_it() {
        let at = |kind, modifiers| {
            let (column, row) = (4, 9);
            Event::Mouse(MouseEvent {
                kind,
                column,
                row,
                modifiers,
            })
        };
        let none = KeyModifiers::NONE;
        let left = MouseButton::Left;
        let bytes =
            b"\x1b[<0;5;10M\x1b[<32;5;10M\x1b[<0;5;10m\x1b[<65;5;10M\x1b[<9;5;10M\x1b[<35;5;10M";
        let expected = [
            at(MouseEventKind::Down(left), none),
            at(MouseEventKind::Drag(left), none),
            at(MouseEventKind::Up(left), none),
            at(MouseEventKind::ScrollDown, none),
            at(MouseEventKind::Down(MouseButton::Middle), KeyModifiers::ALT),
            at(MouseEventKind::Moved, none),
        ];
        assert_eq!(typed(bytes), expected);
    }

    #[test]
    fn garbage_and_parts_of_answers_are_no_keys() {
        let garbage: [&[u8]; 7] = [
            b"\x1b[?1;0;xSS",
            b"\x1bPqqq",
            b"\x1b]11;rgb:00",
            b"\x1b[?6",
            b"\x1b[<0;0;0Mq",
            b"\xff\xfeq",
            b"\x1b",
        ];
        for bytes in garbage {
            assert_eq!(typed(bytes), [], "{bytes:?}");
        }
    }
}
