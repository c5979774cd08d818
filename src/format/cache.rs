//! Point caches: many frames in one file, without faces. What they share.

use crate::diag::{Diagnostic, Result};

/// Many frames in one file, without faces; they come from a mesh beside it.
pub trait CacheFormat: Sync {
    /// What the header says, held against the length of the file: nothing is allocated by what it claims.
    ///
    /// # Errors
    /// It is no such file, or it is shorter than its header promises.
    fn header(&self, source: &dyn CacheSource) -> Result<CacheHeader>;

    /// The 3V coordinates of a frame from its 12V bytes.
    fn decode(&self, bytes: &[u8], positions: &mut [f32]);

    /// The bytes before the first frame.
    ///
    /// # Errors
    /// More frames or vertices than the format can count.
    fn encode_header(&self, header: &CacheHeader) -> Result<Vec<u8>>;

    /// Replaces `bytes` by those of one frame.
    fn encode(&self, positions: &[f32], bytes: &mut Vec<u8>);
}

/// The bytes of a cache, wherever they are.
pub trait CacheSource {
    /// How many there are.
    fn length(&self) -> u64;

    /// Fills `bytes` from `offset` on.
    ///
    /// # Errors
    /// They cannot be read.
    fn read(&self, offset: u64, bytes: &mut [u8]) -> Result<()>;
}

/// What the header of a cache says.
#[derive(Debug, Clone, PartialEq)]
pub struct CacheHeader {
    /// V, at least 1.
    pub vertices: usize,
    /// n, at least 1.
    pub frames: usize,
    /// Frames per second, where the file says so.
    pub fps: Option<f64>,
    /// Where the first frame starts, in bytes.
    pub start: u64,
}

impl CacheHeader {
    /// Bytes of one frame.
    pub fn frame_bytes(&self) -> u64 {
        12 * self.vertices as u64
    }
}

/// Refuses a file whose length is not what its header promises.
pub(super) fn check_length(header: &CacheHeader, length: u64) -> Result<()> {
    let frames = u128::from(header.frame_bytes()) * header.frames as u128;
    let promised = u128::from(header.start) + frames;
    if u128::from(length) == promised {
        return Ok(());
    }
    let told = Diagnostic::error(format!(
        "the header promises {} frames of {} points, {promised} bytes; the file has {length}",
        header.frames, header.vertices
    ));
    if u128::from(length) > promised {
        return told
            .hint("the header is damaged, or the file is of another kind")
            .err();
    }
    let whole = length.saturating_sub(header.start) / header.frame_bytes();
    told.hint(format!(
        "the file is cut short: {whole} frames of it are whole"
    ))
    .err()
}

/// A count that fits into the i32 of a header.
pub(super) fn small(count: usize) -> Result<i32> {
    i32::try_from(count).map_err(|_| {
        let told = Diagnostic::error(format!("{count} is more than the format can count"));
        Box::new(told)
    })
}
