//! The kitty graphics protocol: pictures as palette PNG below the text, so that cursors and read-outs
//! are cells on top of them. Only pictures that changed are sent.

use std::collections::HashMap;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use ratatui::buffer::Buffer;
use ratatui::layout::Rect;

use super::palette::Indexed;
use super::{Aside, Painter};
use crate::image::Image;

/// The longest payload of one escape.
const CHUNK: usize = 4096;
/// Identifiers of our pictures start here, so that other programs' pictures are left alone.
const FIRST_ID: u32 = 0x4D_4C_00;

/// Pictures by the kitty protocol.
#[derive(Debug, Default)]
pub(super) struct Kitty {
    shown: HashMap<usize, (Image, Rect)>,
    painted: Vec<usize>,
}

impl Painter for Kitty {
    fn paint(&mut self, slot: usize, image: &Image, area: Rect, _: &mut Buffer, aside: &mut Aside) {
        self.painted.push(slot);
        let same = |(last, place): &(Image, Rect)| *place == area && last == image;
        if self.shown.get(&slot).is_some_and(same) {
            return;
        }
        let id = FIRST_ID + slot as u32;
        let (column, row) = (area.x + 1, area.y + 1);
        let place = format!("\x1b[{row};{column}H");
        aside.before.extend(place.as_bytes());
        // z: below the text and below cells that have a background. C=1: the cursor stays. q=2: no answers.
        let control = format!(
            "a=T,f=100,i={id},p=1,z=-1073741825,C=1,q=2,c={},r={}",
            area.width, area.height
        );
        let png = Indexed::of(image).png();
        send(&control, &png, &mut aside.before);
        self.shown.insert(slot, (image.clone(), area));
    }

    fn finish(&mut self, aside: &mut Aside) {
        let painted = std::mem::take(&mut self.painted);
        self.shown.retain(|slot, _| {
            let kept = painted.contains(slot);
            if !kept {
                aside.before.extend(remove(*slot));
            }
            kept
        });
    }

    fn forget(&mut self, aside: &mut Aside) {
        for slot in self.shown.drain().map(|(slot, _)| slot) {
            aside.before.extend(remove(slot));
        }
    }
}

fn remove(slot: usize) -> Vec<u8> {
    let id = FIRST_ID + slot as u32;
    format!("\x1b_Ga=d,d=I,i={id},q=2\x1b\\").into_bytes()
}

fn send(control: &str, payload: &[u8], bytes: &mut Vec<u8>) {
    let encoded = STANDARD.encode(payload);
    let mut chunks = encoded.as_bytes().chunks(CHUNK).peekable();
    let mut head = format!("{control},");
    while let Some(chunk) = chunks.next() {
        let more = u8::from(chunks.peek().is_some());
        bytes.extend(format!("\x1b_G{head}m={more};").as_bytes());
        bytes.extend(chunk);
        bytes.extend(b"\x1b\\");
        head.clear();
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
        let mut aside = Aside::default();
        kitty.paint(
            1,
            image,
            area,
            &mut Buffer::empty(Rect::new(0, 0, 20, 10)),
            &mut aside,
        );
        kitty.finish(&mut aside);
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
        let mut aside = Aside::default();
        kitty.finish(&mut aside);
        assert_eq!(aside.before, remove(1));
    }
}
