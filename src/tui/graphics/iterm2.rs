//! iTerm2's inline images: a PNG file in an escape, scaled to a number of cells.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;

use super::inline::Encoder;
use super::palette::Indexed;
use crate::image::Image;

/// The encoder of iTerm2's inline images.
pub(super) struct Iterm2;

impl Encoder for Iterm2 {
    fn encode(&self, part: &Image, columns: u16, rows: u16) -> Vec<u8> {
        let png = Indexed::of(part).png();
        let head = format!(
            "\x1b]1337;File=inline=1;size={};width={columns};height={rows};preserveAspectRatio=0;doNotMoveCursor=1:",
            png.len()
        );
        [head.as_bytes(), STANDARD.encode(png).as_bytes(), b"\x07"].concat()
    }

    /// Cells of a picture hold no text, whatever its alpha.
    fn transparent(&self) -> bool {
        false
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_sent_decodes_to_the_picture_in_its_cells() {
        let rgba = (0..32 * 16_u32).flat_map(|i| [(i % 32) as u8 * 8, (i / 32) as u8 * 8, 0, 255]);
        let image = Image {
            width: 32,
            height: 16,
            rgba: rgba.map(|value| value & 0xf0).collect(),
        };
        let text = String::from_utf8(Iterm2.encode(&image, 4, 1)).unwrap();
        let (head, data) = text.split_once(':').unwrap();
        assert!(head.starts_with("\x1b]1337;File=inline=1;") && head.contains("width=4;height=1"));
        let png = STANDARD.decode(data.strip_suffix('\x07').unwrap()).unwrap();
        assert!(head.contains(&format!("size={};", png.len())));
        let mut decoder = png::Decoder::new(std::io::Cursor::new(png));
        decoder.set_transformations(png::Transformations::EXPAND);
        let mut reader = decoder.read_info().unwrap();
        let mut rgb = vec![0; reader.output_buffer_size().unwrap()];
        reader.next_frame(&mut rgb).unwrap();
        let wanted: Vec<u8> = image
            .rgba
            .chunks(4)
            .flat_map(|p| [p[0], p[1], p[2]])
            .collect();
        assert_eq!(rgb, wanted);
    }
}
