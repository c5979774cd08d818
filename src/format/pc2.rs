//! PC2, the point cache of 3ds Max and Blender: no faces, no frames per second.
//!
//! ```text
//! 12 bytes  POINTCACHE2\0
//! i32       version, 1
//! i32       V, points a frame
//! f32       the frame that the first one stands for
//! f32       frames between two of them
//! i32       n, frames
//! n V 3 f32 coordinates, frame after frame; everything little endian
//! ```

use super::cache::{CacheFormat, CacheHeader, CacheSource, check_length};
use crate::diag::{Diagnostic, Result};

/// PC2.
pub struct Pc2;

const MAGIC: &[u8; 12] = b"POINTCACHE2\0";
const HEADER: u64 = 32;

/// Whether these are the first bytes of a PC2 file.
pub(super) fn recognises(head: &[u8]) -> bool {
    head.starts_with(MAGIC)
}

impl CacheFormat for Pc2 {
    fn header(&self, source: &dyn CacheSource) -> Result<CacheHeader> {
        let mut head = [0; HEADER as usize];
        if source.length() < HEADER {
            let length = source.length();
            return Diagnostic::error(format!("not a PC2 file: {length} bytes are too few"))
                .hint("the file may be cut short")
                .err();
        }
        source.read(0, &mut head)?;
        if !recognises(&head) {
            return Diagnostic::error("not a PC2 file: it does not begin with POINTCACHE2")
                .hint("check the ending of the file")
                .err();
        }
        let number = |at: usize| {
            let bytes = [head[at], head[at + 1], head[at + 2], head[at + 3]];
            i32::from_le_bytes(bytes)
        };
        if number(12) != 1 {
            return Diagnostic::error(format!("version {} of PC2 is not known", number(12))).err();
        }
        let header = CacheHeader {
            vertices: count(number(16), "points")?,
            frames: count(number(28), "frames")?,
            fps: None,
            start: HEADER,
        };
        check_length(&header, source.length())?;
        Ok(header)
    }

    fn decode(&self, bytes: &[u8], positions: &mut [f32]) {
        for (value, bytes) in positions.iter_mut().zip(bytes.as_chunks().0) {
            *value = f32::from_le_bytes(*bytes);
        }
    }

    fn encode_header(&self, header: &CacheHeader) -> Result<Vec<u8>> {
        let mut head = MAGIC.to_vec();
        head.extend(1_i32.to_le_bytes());
        head.extend(super::cache::small(header.vertices)?.to_le_bytes());
        head.extend(0_f32.to_le_bytes());
        head.extend(1_f32.to_le_bytes());
        head.extend(super::cache::small(header.frames)?.to_le_bytes());
        Ok(head)
    }

    fn encode(&self, positions: &[f32], bytes: &mut Vec<u8>) {
        bytes.clear();
        bytes.extend(positions.iter().flat_map(|value| value.to_le_bytes()));
    }
}

fn count(number: i32, what: &str) -> Result<usize> {
    match usize::try_from(number) {
        Ok(number) if number > 0 => Ok(number),
        _ => Diagnostic::error(format!("the header promises {number} {what}"))
            .hint("the header is damaged")
            .err(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_layout_is_blenders() {
        let header = CacheHeader {
            vertices: 2,
            frames: 3,
            fps: Some(24.0),
            start: 0,
        };
        let head = Pc2.encode_header(&header).unwrap();
        let expected = [
            b"POINTCACHE2\0".as_slice(),
            &[1, 0, 0, 0, 2, 0, 0, 0],
            &[0, 0, 0, 0, 0, 0, 0x80, 0x3f],
            &[3, 0, 0, 0],
        ];
        assert_eq!(head, expected.concat());
    }
}
