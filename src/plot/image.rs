//! Pixels, and pixels as a PNG file.

use std::io;

/// Rows of RGBA pixels from the upper left corner, 8 bits a channel, sRGB, straight alpha.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Image {
    /// Pixels in a row, at least 1.
    pub width: u32,
    /// Rows, at least 1.
    pub height: u32,
    /// 4 * width * height bytes.
    pub rgba: Vec<u8>,
}

impl Image {
    /// The bytes of a PNG file.
    ///
    /// # Errors
    /// `rgba` has another length than `width` and `height` ask for, or one of them is 0.
    pub fn png(&self) -> io::Result<Vec<u8>> {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, self.width, self.height);
        encoder.set_color(png::ColorType::Rgba);
        encoder.set_depth(png::BitDepth::Eight);
        let mut writer = encoder.write_header()?;
        writer.write_image_data(&self.rgba)?;
        writer.finish()?;
        Ok(bytes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn png_files_decode_to_the_same_pixels() {
        let image = Image {
            width: 3,
            height: 2,
            rgba: (0..24).map(|i| i * 10).collect(),
        };
        let bytes = image.png().unwrap();
        let mut reader = png::Decoder::new(io::Cursor::new(bytes))
            .read_info()
            .unwrap();
        let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
        let info = reader.next_frame(&mut pixels).unwrap();
        assert_eq!((info.width, info.height), (3, 2));
        assert_eq!(pixels, image.rgba);
    }

    #[test]
    fn pixels_that_do_not_fit_the_size_are_an_error() {
        let image = Image {
            width: 3,
            height: 2,
            rgba: vec![0; 7],
        };
        assert!(image.png().is_err());
    }
}
