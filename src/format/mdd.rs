//! MDD, the point cache of LightWave, Houdini and Blender: no faces, a time in seconds for every frame.
//!
//! ```text
//! i32         n, frames
//! i32         V, points a frame
//! n f32       times in seconds
//! n V 3 f32   coordinates, frame after frame; everything big endian
//! ```
//!
//! The file has no mark of its own: it is known by its length.

use super::cache::{CacheFormat, CacheHeader, CacheSource, check_length, small};
use super::rate;
use crate::diag::{Diagnostic, Result};

/// MDD.
pub struct Mdd;

impl CacheFormat for Mdd {
    fn header(&self, source: &dyn CacheSource) -> Result<CacheHeader> {
        let mut head = [0; 8];
        if source.length() < 8 {
            let length = source.length();
            return Diagnostic::error(format!("not an MDD file: {length} bytes are too few"))
                .hint("the file may be cut short")
                .err();
        }
        source.read(0, &mut head)?;
        let [a, b, c, d, e, f, g, h] = head;
        let (frames, vertices) = (
            u32::from_be_bytes([a, b, c, d]),
            u32::from_be_bytes([e, f, g, h]),
        );
        let limit = i32::MAX as u32;
        if frames == 0 || vertices == 0 || frames > limit || vertices > limit {
            return Diagnostic::error(format!(
                "the header promises {frames} frames of {vertices} points"
            ))
            .hint("is this an MDD file? its header is damaged")
            .err();
        }
        let mut header = CacheHeader {
            vertices: vertices as usize,
            frames: frames as usize,
            fps: None,
            start: 8 + 4 * u64::from(frames),
        };
        check_length(&header, source.length())?;
        let mut times = vec![0; 4 * header.frames];
        source.read(8, &mut times)?;
        let times = times
            .as_chunks()
            .0
            .iter()
            .map(|bytes| f32::from_be_bytes(*bytes));
        header.fps = rate::of_times(&times.collect::<Vec<_>>());
        Ok(header)
    }

    fn decode(&self, bytes: &[u8], positions: &mut [f32]) {
        for (value, bytes) in positions.iter_mut().zip(bytes.as_chunks().0) {
            *value = f32::from_be_bytes(*bytes);
        }
    }

    fn encode_header(&self, header: &CacheHeader) -> Result<Vec<u8>> {
        let mut head = small(header.frames)?.to_be_bytes().to_vec();
        head.extend(small(header.vertices)?.to_be_bytes());
        // without a rate the times say so: all of them are 0
        let seconds = header.fps.map_or(0.0, |fps| 1.0 / fps);
        let times = (0..header.frames).map(|frame| (frame as f64 * seconds) as f32);
        head.extend(times.flat_map(f32::to_be_bytes));
        Ok(head)
    }

    fn encode(&self, positions: &[f32], bytes: &mut Vec<u8>) {
        bytes.clear();
        bytes.extend(positions.iter().flat_map(|value| value.to_be_bytes()));
    }
}
