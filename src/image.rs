//! Pixels, and pixels as a PNG file.

use std::io;

/// A picture: rows from the top, red green blue alpha, alpha not multiplied in.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Image {
    /// Pixels in a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// 4 bytes a pixel.
    pub rgba: Vec<u8>,
}

impl Image {
    /// A transparent picture; either side may be 0.
    pub fn new(width: usize, height: usize) -> Self {
        Image {
            width,
            height,
            rgba: vec![0; 4 * width * height],
        }
    }

    /// Another size; what it showed is lost, memory is kept.
    pub fn resize(&mut self, width: usize, height: usize) {
        (self.width, self.height) = (width, height);
        self.rgba.clear();
        self.rgba.resize(4 * width * height, 0);
    }

    /// One colour everywhere.
    pub fn fill(&mut self, colour: [u8; 4]) {
        for pixel in self.rgba.as_chunks_mut::<4>().0 {
            *pixel = colour;
        }
    }

    /// The picture at half its size, every pixel the mean of four: draw at twice the size and halve
    /// for smooth outlines. An odd last row or column is dropped.
    #[must_use]
    pub fn halved(&self) -> Image {
        let mut half = Image::new(self.width / 2, self.height / 2);
        let pixels = self.rgba.as_chunks::<4>().0;
        for (index, out) in half.rgba.as_chunks_mut::<4>().0.iter_mut().enumerate() {
            let (x, y) = (2 * (index % half.width), 2 * (index / half.width));
            let at = |dx, dy| pixels[(y + dy) * self.width + x + dx];
            *out = mean([at(0, 0), at(1, 0), at(0, 1), at(1, 1)]);
        }
        half
    }

    /// The bytes of a PNG file.
    ///
    /// # Errors
    /// `rgba` has another length than `width` and `height` ask for, or one of them is 0.
    pub fn png(&self) -> io::Result<Vec<u8>> {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, side(self.width)?, side(self.height)?);
        encoder.set_color(png::ColorType::Rgba);
        encoder.set_depth(png::BitDepth::Eight);
        let mut writer = encoder.write_header()?;
        writer.write_image_data(&self.rgba)?;
        writer.finish()?;
        Ok(bytes)
    }
}

fn side(pixels: usize) -> io::Result<u32> {
    u32::try_from(pixels).map_err(io::Error::other)
}

/// The mean of four colours, each counting by its alpha.
fn mean(pixels: [[u8; 4]; 4]) -> [u8; 4] {
    let alpha: u32 = pixels.iter().map(|pixel| u32::from(pixel[3])).sum();
    if alpha == 0 {
        return [0; 4];
    }
    let channel = |i: usize| {
        let sum: u32 = pixels
            .iter()
            .map(|p| u32::from(p[i]) * u32::from(p[3]))
            .sum();
        ((sum + alpha / 2) / alpha) as u8
    };
    [channel(0), channel(1), channel(2), ((alpha + 2) / 4) as u8]
}

/// `colour` with `alpha` in \[0, 1\] laid over `under`.
pub(crate) fn blend(under: &mut [u8; 4], colour: [f32; 3], alpha: f32) {
    if alpha >= 1.0 {
        let [red, green, blue] = colour.map(|value| (value + 0.5) as u8);
        *under = [red, green, blue, 255];
        return;
    }
    let below = f32::from(under[3]) / 255.0 * (1.0 - alpha);
    let total = alpha + below;
    if total <= 0.0 {
        return;
    }
    for (byte, value) in under.iter_mut().zip(colour) {
        *byte = ((value * alpha + f32::from(*byte) * below) / total + 0.5) as u8;
    }
    under[3] = (total * 255.0 + 0.5) as u8;
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
