//! Pictures with at most 256 colours: a third of the bytes, which is what counts over SSH.

use std::collections::HashMap;

use crate::image::Image;

/// Colours of a PNG or sixel palette.
const COLOURS: usize = 256;

/// A picture whose pixels name colours.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Indexed {
    pub(super) width: usize,
    pub(super) height: usize,
    /// Red, green, blue; at most 256.
    pub(super) palette: Vec<[u8; 3]>,
    /// One byte a pixel, rows from the top.
    pub(super) pixels: Vec<u8>,
}

impl Indexed {
    /// The picture with its own colours where there are at most 256, else rounded to 7 or 6 bits a channel
    /// where that makes it so, else with the 256 most frequent of those rounded to 5 bits. Alpha is
    /// ignored: panels are opaque.
    pub(super) fn of(image: &Image) -> Self {
        let pixels = image.rgba.as_chunks::<4>().0.iter();
        let colours = pixels.map(|pixel| [pixel[0], pixel[1], pixel[2]]);
        (0..3)
            .find_map(|bits| {
                let rounded = colours
                    .clone()
                    .map(|rgb| rgb.map(|value| round(value, bits)));
                exact(image, rounded)
            })
            .unwrap_or_else(|| reduced(image, colours))
    }
}

/// A value without its last `bits` bits, in the middle of those that become the same.
fn round(value: u8, bits: u32) -> u8 {
    (value >> bits << bits) + (1_u8 << bits) / 2
}

impl Indexed {
    /// The bytes of a PNG file; empty for a picture without pixels.
    pub(super) fn png(&self) -> Vec<u8> {
        let mut bytes = Vec::new();
        // Writing to memory fails for empty pictures only.
        if self.write(&mut bytes).is_err() {
            bytes.clear();
        }
        bytes
    }

    fn write(&self, bytes: &mut Vec<u8>) -> Result<(), png::EncodingError> {
        let mut encoder = png::Encoder::new(bytes, self.width as u32, self.height as u32);
        encoder.set_color(png::ColorType::Indexed);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_palette(self.palette.as_flattened().to_vec());
        let mut writer = encoder.write_header()?;
        writer.write_image_data(&self.pixels)?;
        writer.finish()
    }
}

fn exact(image: &Image, colours: impl Iterator<Item = [u8; 3]>) -> Option<Indexed> {
    let mut known: HashMap<[u8; 3], u8> = HashMap::new();
    let mut palette = Vec::new();
    let mut pixels = Vec::with_capacity(image.width * image.height);
    let mut last = None;
    for colour in colours {
        // Neighbours mostly share their colour.
        if let Some((same, index)) = last
            && same == colour
        {
            pixels.push(index);
            continue;
        }
        let index = match known.get(&colour) {
            Some(index) => *index,
            None if palette.len() == COLOURS => return None,
            None => {
                let index = palette.len() as u8;
                palette.push(colour);
                known.insert(colour, index);
                index
            }
        };
        last = Some((colour, index));
        pixels.push(index);
    }
    Some(Indexed {
        width: image.width,
        height: image.height,
        palette,
        pixels,
    })
}

/// Cells of the colour cube with 5 bits a channel.
const CELLS: usize = 1 << 15;

fn cell([red, green, blue]: [u8; 3]) -> usize {
    usize::from(red >> 3) << 10 | usize::from(green >> 3) << 5 | usize::from(blue >> 3)
}

fn reduced(image: &Image, colours: impl Iterator<Item = [u8; 3]> + Clone) -> Indexed {
    let mut counts = vec![0_u32; CELLS];
    let mut sums = vec![[0_u64; 3]; CELLS];
    for colour in colours.clone() {
        let cell = cell(colour);
        counts[cell] += 1;
        (0..3).for_each(|i| sums[cell][i] += u64::from(colour[i]));
    }
    let mut used: Vec<usize> = (0..CELLS).filter(|&cell| counts[cell] > 0).collect();
    used.sort_by_key(|&cell| (std::cmp::Reverse(counts[cell]), cell));
    let mean = |cell: usize| sums[cell].map(|sum| (sum / u64::from(counts[cell])) as u8);
    let palette: Vec<[u8; 3]> = used.iter().take(COLOURS).map(|&cell| mean(cell)).collect();
    let mut index_of = vec![0_u8; CELLS];
    for (rank, &cell) in used.iter().enumerate() {
        index_of[cell] = if rank < COLOURS {
            rank as u8
        } else {
            nearest(&palette, mean(cell))
        };
    }
    let pixels = colours.map(|colour| index_of[cell(colour)]).collect();
    Indexed {
        width: image.width,
        height: image.height,
        palette,
        pixels,
    }
}

fn nearest(palette: &[[u8; 3]], colour: [u8; 3]) -> u8 {
    let distance = |other: &[u8; 3]| -> u32 {
        (0..3)
            .map(|i| u32::from(other[i].abs_diff(colour[i])).pow(2))
            .sum()
    };
    (0..palette.len())
        .min_by_key(|&index| distance(&palette[index]))
        .unwrap_or(0) as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(colours: impl Iterator<Item = [u8; 3]>) -> Image {
        let rgba: Vec<u8> = colours.flat_map(|[r, g, b]| [r, g, b, 255]).collect();
        Image {
            width: rgba.len() / 4,
            height: 1,
            rgba,
        }
    }

    #[test]
    fn few_colours_are_kept() {
        let picture = image((0..=255).map(|i| [i, 0, 255 - i]));
        let indexed = Indexed::of(&picture);
        for (pixel, index) in picture.rgba.as_chunks::<4>().0.iter().zip(&indexed.pixels) {
            assert_eq!(pixel[..3], indexed.palette[usize::from(*index)]);
        }
    }

    #[test]
    fn many_colours_come_close() {
        let picture = image((0..4096_u32).map(|i| [(i >> 4) as u8, (i >> 3) as u8, 7]));
        let indexed = Indexed::of(&picture);
        for (pixel, index) in picture.rgba.as_chunks::<4>().0.iter().zip(&indexed.pixels) {
            let colour = indexed.palette[usize::from(*index)];
            // 128 of them differ in their upper 6 bits; the middle of 4 values is at most 2 away.
            assert!(
                (0..3).all(|i| pixel[i].abs_diff(colour[i]) <= 2),
                "{pixel:?} {colour:?}"
            );
        }
    }

    #[test]
    fn noise_has_256_colours() {
        let noise = |i: u32, by: u32| (i.wrapping_mul(by) >> 7) as u8;
        let picture =
            image((0..65_536).map(|i| [noise(i, 7919), noise(i, 104_729), noise(i, 613)]));
        assert_eq!(Indexed::of(&picture).palette.len(), 256);
    }
}
