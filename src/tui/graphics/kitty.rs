//! The kitty graphics protocol: pictures as palette PNG below the text, so that cursors and read-outs
//! are cells on top of them. Only pictures that changed are sent. Within tmux the pictures pass through
//! it, and placeholders stand for them in the cells.

use std::collections::HashMap;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use ratatui::buffer::Buffer;
use ratatui::layout::Rect;

use super::palette::Indexed;
use super::{Aside, Painter, placeholder};
use crate::image::Image;

/// The longest payload of one escape.
const CHUNK: usize = 4096;
/// Identifiers of our pictures start here, so that other programs' pictures are left alone.
const FIRST_ID: u32 = 0x4D_4C_00;

/// Pictures by the kitty protocol.
#[derive(Debug, Default)]
pub(super) struct Kitty {
    /// Whether tmux stands between us and the terminal.
    tmux: bool,
    shown: HashMap<usize, (Image, Rect)>,
    painted: Vec<usize>,
}

impl Kitty {
    pub(super) fn new(tmux: bool) -> Self {
        Kitty {
            tmux,
            ..Kitty::default()
        }
    }

    /// Sends a picture: to lie where the cursor is, or where placeholders name it.
    fn transmit(&self, id: u32, image: &Image, area: Rect, bytes: &mut Vec<u8>) {
        let (columns, rows) = (area.width, area.height);
        let place = if self.tmux {
            "U=1".to_string()
        } else {
            let (column, row) = (area.x + 1, area.y + 1);
            bytes.extend(format!("\x1b[{row};{column}H").as_bytes());
            // z: below the text and below cells that have a background. C=1: the cursor stays.
            "p=1,z=-1073741825,C=1".to_string()
        };
        // q=2: no answers.
        let control = format!("a=T,f=100,i={id},q=2,{place},c={columns},r={rows}");
        let png = Indexed::of(image).png();
        self.escape(&control, &png, bytes);
    }

    fn remove(&self, slot: usize, bytes: &mut Vec<u8>) {
        let id = FIRST_ID + slot as u32;
        self.pass(format!("\x1b_Ga=d,d=I,i={id},q=2\x1b\\").as_bytes(), bytes);
    }

    /// Control data and a payload, in escapes that are not too long.
    fn escape(&self, control: &str, payload: &[u8], bytes: &mut Vec<u8>) {
        let encoded = STANDARD.encode(payload);
        let mut chunks = encoded.as_bytes().chunks(CHUNK).peekable();
        let mut head = format!("{control},");
        while let Some(chunk) = chunks.next() {
            let more = u8::from(chunks.peek().is_some());
            let start = format!("\x1b_G{head}m={more};");
            self.pass(&[start.as_bytes(), chunk, b"\x1b\\"].concat(), bytes);
            head.clear();
        }
    }

    fn pass(&self, escape: &[u8], bytes: &mut Vec<u8>) {
        if self.tmux {
            bytes.extend(through_tmux(escape));
        } else {
            bytes.extend(escape);
        }
    }
}

/// Wraps an escape so that tmux hands it on to its terminal, if it is allowed to.
pub(super) fn through_tmux(escape: &[u8]) -> Vec<u8> {
    let mut wrapped = b"\x1bPtmux;".to_vec();
    for &byte in escape {
        // Each ESC is doubled.
        wrapped.extend(std::iter::repeat_n(byte, if byte == 0x1b { 2 } else { 1 }));
    }
    wrapped.extend(b"\x1b\\");
    wrapped
}

impl Painter for Kitty {
    fn paint(
        &mut self,
        slot: usize,
        image: &Image,
        area: Rect,
        buffer: &mut Buffer,
        aside: &mut Aside,
    ) {
        self.painted.push(slot);
        let id = FIRST_ID + slot as u32;
        if self.tmux {
            for at in area.positions() {
                if let Some(cell) = buffer.cell_mut(at) {
                    placeholder::place(cell, id, at.y - area.y, at.x - area.x);
                }
            }
        }
        let same = |(last, place): &(Image, Rect)| *place == area && last == image;
        if !self.shown.get(&slot).is_some_and(same) {
            self.transmit(id, image, area, &mut aside.before);
            self.shown.insert(slot, (image.clone(), area));
        }
    }

    fn finish(&mut self, _: &mut Buffer, aside: &mut Aside) {
        let painted = std::mem::take(&mut self.painted);
        let mut gone: Vec<usize> = self.shown.keys().copied().collect();
        gone.retain(|slot| !painted.contains(slot));
        for slot in gone {
            self.remove(slot, &mut aside.before);
            self.shown.remove(&slot);
        }
    }

    fn forget(&mut self, aside: &mut Aside) {
        for slot in std::mem::take(&mut self.shown).into_keys() {
            self.remove(slot, &mut aside.before);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Keys of the first escape, and the payload of all of them together.
    fn decoded(bytes: &[u8]) -> (String, Vec<u8>) {
        let text = String::from_utf8(bytes.to_vec()).unwrap();
        let escapes: Vec<&str> = text.split("\x1b_G").skip(1).collect();
        let parts = escapes.iter().map(|escape| escape.split_once(';').unwrap());
        let payload: String = parts
            .clone()
            .map(|(_, data)| data.trim_end_matches("\x1b\\"))
            .collect();
        let first = parts.clone().next().unwrap().0.to_string();
        (first, STANDARD.decode(payload).unwrap())
    }

    fn picture() -> Image {
        let rgba = (0..64 * 48_u32)
            .flat_map(|i| [(i % 64) as u8, (i / 64) as u8, 9, 255])
            .collect();
        Image {
            width: 64,
            height: 48,
            rgba,
        }
    }

    fn painted(kitty: &mut Kitty, image: &Image) -> Vec<u8> {
        let area = Rect::new(2, 3, 8, 3);
        let (mut aside, mut buffer) = (Aside::default(), Buffer::empty(Rect::new(0, 0, 20, 10)));
        kitty.paint(1, image, area, &mut buffer, &mut aside);
        kitty.finish(&mut buffer, &mut aside);
        aside.before
    }

    #[test]
    fn what_is_sent_decodes_to_the_picture_in_its_cells() {
        let mut image = picture();
        // Few colours, so that the palette is exact.
        image.rgba.iter_mut().for_each(|value| *value &= 0xf8);
        let bytes = painted(&mut Kitty::default(), &image);
        assert!(bytes.starts_with(b"\x1b[4;3H"));
        let (keys, png) = decoded(&bytes);
        assert!(keys.contains("a=T") && keys.contains("c=8,r=3"), "{keys}");
        let mut decoder = png::Decoder::new(std::io::Cursor::new(png));
        decoder.set_transformations(png::Transformations::EXPAND);
        let mut reader = decoder.read_info().unwrap();
        let mut rgb = vec![0; reader.output_buffer_size().unwrap()];
        reader.next_frame(&mut rgb).unwrap();
        let wanted: Vec<u8> = image
            .rgba
            .as_chunks::<4>()
            .0
            .iter()
            .flat_map(|p| [p[0], p[1], p[2]])
            .collect();
        assert_eq!(rgb, wanted);
    }

    #[test]
    fn a_picture_that_is_there_is_not_sent_again_and_one_that_left_is_removed() {
        let mut kitty = Kitty::default();
        assert!(!painted(&mut kitty, &picture()).is_empty());
        assert_eq!(painted(&mut kitty, &picture()), b"");
        let (mut aside, mut buffer) = (Aside::default(), Buffer::empty(Rect::new(0, 0, 20, 10)));
        kitty.finish(&mut buffer, &mut aside);
        assert_eq!(aside.before, b"\x1b_Ga=d,d=I,i=5065729,q=2\x1b\\");
    }

    #[test]
    fn through_tmux_escapes_are_wrapped_and_cells_hold_placeholders() {
        let area = Rect::new(2, 3, 8, 3);
        let (mut aside, mut buffer) = (Aside::default(), Buffer::empty(Rect::new(0, 0, 20, 10)));
        Kitty::new(true).paint(1, &picture(), area, &mut buffer, &mut aside);
        let text = String::from_utf8(aside.before).unwrap();
        let wrapped: Vec<&str> = text.split("\x1bPtmux;").skip(1).collect();
        let bare: String = wrapped
            .iter()
            .map(|part| part.replace("\x1b\x1b", "\x1b"))
            .collect();
        for part in wrapped {
            assert!(part.starts_with("\x1b\x1b_G") && part.ends_with("\x1b\x1b\\\x1b\\"));
            assert!(part.len() < 2 * CHUNK);
        }
        assert!(
            bare.contains("a=T,f=100,i=5065729,q=2,U=1,c=8,r=3"),
            "{bare}"
        );
        for at in area.positions() {
            assert!(buffer[at].symbol().starts_with('\u{10EEEE}'));
            assert_eq!(buffer[at].fg, ratatui::style::Color::Rgb(0x4D, 0x4C, 1));
        }
        assert_eq!(buffer[(1, 3)].symbol(), " ");
    }
}
