//! Sixel pictures, with as many colours as the terminal has registers.

use icy_sixel::{EncodeOptions, SixelImage};

use super::inline::Encoder;
use crate::image::Image;

/// More colours cost bytes that nobody sees: shading has one hue, curves a few.
const MOST_COLOURS: u16 = 128;

/// The sixel encoder.
pub(super) struct Sixel {
    /// Colour registers of the terminal.
    pub(super) registers: u16,
}

impl Encoder for Sixel {
    fn encode(&self, part: &Image, _: u16, _: u16) -> Vec<u8> {
        let options = EncodeOptions {
            max_colors: self.registers.clamp(2, MOST_COLOURS),
            // Without dithering neighbouring frames differ in what has moved only.
            diffusion: 0.0,
            ..EncodeOptions::default()
        };
        let image = SixelImage::try_from_rgba(part.rgba.clone(), part.width, part.height);
        // Fails for pictures without pixels, which have no cells either.
        let text = image.and_then(|image| image.encode_with(&options));
        text.unwrap_or_default().into_bytes()
    }

    fn transparent(&self) -> bool {
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn blocks() -> Image {
        let colour = |x: u32, y: u32| match (x / 10, y / 10) {
            (0, 0) => [255, 0, 0, 255],
            (1, 0) => [0, 0, 0, 0],
            (0, _) => [255, 255, 255, 255],
            _ => [0, 0, 255, 255],
        };
        Image {
            width: 20,
            height: 20,
            rgba: (0..400).flat_map(|i| colour(i % 20, i / 20)).collect(),
        }
    }

    #[test]
    fn what_is_sent_decodes_to_the_picture() {
        let image = blocks();
        for registers in [16, 256, u16::MAX] {
            let bytes = Sixel { registers }.encode(&image, 2, 1);
            let decoded = SixelImage::decode(&bytes).unwrap();
            // Bands of six rows; what the last has below the picture is transparent.
            assert_eq!((decoded.width, decoded.height), (20, 24));
            let blank = [0; 4 * 20 * 4];
            let padded = image.rgba.chunks(4).chain(blank.chunks(4));
            for (shown, wanted) in decoded.pixels.chunks(4).zip(padded) {
                assert_eq!(shown[3], wanted[3]);
                // Sixel colours are whole percents: half of one is 1.3 of 255.
                let near = |i: usize| shown[i].abs_diff(wanted[i]) <= 2;
                assert!(wanted[3] == 0 || (0..3).all(near), "{shown:?} {wanted:?}");
            }
        }
    }

    #[test]
    fn no_more_colours_are_named_than_there_are_registers() {
        let rgba = (0..64 * 64).flat_map(|i: u32| [i as u8, (i / 64) as u8 * 4, 9, 255]);
        let image = Image {
            width: 64,
            height: 64,
            rgba: rgba.collect(),
        };
        let text = String::from_utf8(Sixel { registers: 16 }.encode(&image, 8, 4)).unwrap();
        assert_eq!(text.matches(";2;").count(), 16);
    }

    #[test]
    fn a_picture_without_pixels_is_nothing() {
        assert!(
            Sixel { registers: 16 }
                .encode(&Image::new(0, 3), 0, 1)
                .is_empty()
        );
    }
}
