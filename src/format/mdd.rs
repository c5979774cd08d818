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
        header.fps = rate(&times.collect::<Vec<_>>());
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

/// Frames per second of equally spaced times, `None` if they are not. The times are f32, so the rate is
/// known to about 2^-23; the roundest number within that is taken (24, 29.97, 24000/1001, ..).
pub(super) fn rate(times: &[f32]) -> Option<f64> {
    let (first, last) = (f64::from(*times.first()?), f64::from(*times.last()?));
    let steps = (times.len() - 1) as f64;
    let span = last - first;
    if !(span > 0.0 && span.is_finite()) {
        return None;
    }
    let half_ulp = f64::from(f32::EPSILON) / 2.0 * first.abs().max(last.abs());
    let step = span / steps;
    let even = times.iter().enumerate().all(|(at, &time)| {
        let expected = first + at as f64 * step;
        (f64::from(time) - expected).abs() <= (0.01 * step).max(3.0 * half_ulp)
    });
    let fps = steps / span;
    let known = fps * 2.0 * half_ulp / span;
    even.then(|| round_rate(fps, known))
}

/// The roundest rate within `error` of `fps`: whole, with three decimals, a whole one times 1000/1001,
/// else as it is.
fn round_rate(fps: f64, error: f64) -> f64 {
    let error = error.max(4.0 * f64::EPSILON * fps);
    let candidates = [
        fps.round(),
        (fps * 100.0).round() / 100.0,
        (fps * 1000.0).round() / 1000.0,
        (fps * 1.001).round() * 1000.0 / 1001.0,
    ];
    let near = candidates
        .into_iter()
        .find(|rate| *rate > 0.0 && (rate - fps).abs() <= error);
    near.unwrap_or(fps)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rates_come_back_from_times() {
        let ntsc = |fps: f64| fps * 1000.0 / 1001.0;
        for fps in [
            24.0, 25.0, 30.0, 48.0, 50.0, 60.0, 120.0, 23.976, 29.97, 59.94, 12.5,
        ] {
            for frames in [2, 3, 48, 1000, 100_000] {
                let times: Vec<f32> = (0..frames).map(|i| (f64::from(i) / fps) as f32).collect();
                let found = rate(&times).unwrap();
                // with few frames NTSC rates and their three decimals are closer than an f32 can tell
                assert!(
                    (found - fps).abs() <= 2e-6 * fps,
                    "{frames} frames: {found}, not {fps}"
                );
                if fps.fract() == 0.0 {
                    assert_eq!(found, fps);
                }
            }
        }
        let times: Vec<f32> = (0..500)
            .map(|i| (f64::from(i) / ntsc(24.0)) as f32)
            .collect();
        assert_eq!(rate(&times), Some(ntsc(24.0)));
    }

    #[test]
    fn times_that_tell_no_rate_tell_none() {
        assert_eq!(rate(&[0.0, 0.0, 0.0]), None);
        assert_eq!(rate(&[0.0]), None);
        assert_eq!(rate(&[0.0, 1.0, 3.0]), None);
        assert_eq!(rate(&[0.0, f32::NAN, 1.0]), None);
        assert_eq!(rate(&[0.0, f32::INFINITY]), None);
        assert_eq!(rate(&[1.0, 0.5, 0.0]), None);
    }
}
