//! Frames after the first: positions only, straight into their place, and a check that the faces are
//! those of the first frame.

use memchr::memchr;

use super::statement::{Statements, coordinate, index, line_of, words};
use crate::diag::{Diagnostic, Result};
use crate::format::{FirstFrame, nothing_in_it};

/// See [`super::Obj`].
pub(super) fn read(bytes: &[u8], first: &FirstFrame, positions: &mut [f32]) -> Result<()> {
    if bytes.is_empty() {
        return nothing_in_it().err();
    }
    let mut frame = Frame {
        bytes,
        at: 0,
        first,
        vertices: 0,
        faces: 0,
        corners: Vec::new(),
    };
    while frame.at < bytes.len() {
        let start = frame.at;
        frame.statement(positions).map_err(|mut error| {
            error.place.line = Some(line_of(bytes, start));
            // A frame of another mesh: its faces differ because its vertices do.
            let counts = error.place.face.and_then(|_| other_count(bytes, first));
            counts.unwrap_or(error)
        })?;
    }
    first.check_counts(frame.vertices, frame.faces)
}

/// What is to be said if the file has another number of vertices than the first frame.
fn other_count(bytes: &[u8], first: &FirstFrame) -> Option<Box<Diagnostic>> {
    let vertices = Statements::new(bytes, 0)
        .filter(|statement| words(&statement.text).next() == Some(b"v"))
        .count();
    let faces = first.topology.faces();
    first.check_counts(vertices, faces).err()
}

/// A file being read: where in it, and what has been seen.
struct Frame<'a> {
    bytes: &'a [u8],
    at: usize,
    first: &'a FirstFrame,
    vertices: usize,
    faces: usize,
    corners: Vec<u32>,
}

impl Frame<'_> {
    fn statement(&mut self, positions: &mut [f32]) -> Result<()> {
        match &self.bytes[self.at..] {
            [b'v', b' ' | b'\t', ..] => self.vertex(positions),
            [b'f', b' ' | b'\t', ..] => {
                if !self.skip_run() {
                    self.any(positions)?;
                }
                Ok(())
            }
            [b' ' | b'\t', ..] => self.any(positions),
            _ => self.skip_line(positions),
        }
    }

    /// `v x y z`, as nearly all files have it; anything else is left to [`Frame::any`].
    fn vertex(&mut self, positions: &mut [f32]) -> Result<()> {
        let Some(target) = place(positions, self.vertices) else {
            return self.any(positions);
        };
        let mut at = self.at + 1;
        for value in target.iter_mut() {
            at += self.bytes[at..]
                .iter()
                .take_while(|&&byte| byte == b' ' || byte == b'\t')
                .count();
            match fast_float2::parse_partial::<f32, _>(&self.bytes[at..]) {
                Ok((number, length)) if number.is_finite() => {
                    *value = number;
                    at += length;
                }
                _ => return self.any(positions),
            }
            if !matches!(
                self.bytes.get(at),
                None | Some(b' ' | b'\t' | b'\r' | b'\n')
            ) {
                return self.any(positions);
            }
        }
        match self.bytes.get(at) {
            None | Some(b'\n') => self.at = at + 1,
            Some(_) => {
                let end = memchr(b'\n', &self.bytes[at..]).map_or(self.bytes.len(), |n| at + n);
                if self.bytes[at..end].contains(&b'\\') {
                    return self.any(positions);
                }
                self.at = end + 1;
            }
        }
        self.vertices += 1;
        Ok(())
    }

    /// Skips the faces that are, byte for byte, those of the first frame.
    fn skip_run(&mut self) -> bool {
        let rest = &self.bytes[self.at..];
        let Some(run) = self.first.run_at(self.vertices, self.faces, rest) else {
            return false;
        };
        let length = run.bytes.len();
        if !matches!(rest.get(length), None | Some(b'\n' | b'\r')) {
            return false;
        }
        self.faces += run.faces;
        self.at += length;
        true
    }

    /// Any statement, slowly.
    fn any(&mut self, positions: &mut [f32]) -> Result<()> {
        let Some(statement) = Statements::new(self.bytes, self.at).next() else {
            return Ok(());
        };
        let mut words = words(&statement.text);
        match words.next() {
            Some(b"v") => {
                if let Some(target) = place(positions, self.vertices) {
                    for value in target {
                        *value = coordinate(words.next())
                            .map_err(|error| Box::new(error.at_vertex(self.vertices + 1)))?;
                    }
                }
                self.vertices += 1;
            }
            Some(b"f") => self.face(words)?,
            _ => {}
        }
        self.at = statement.end + 1;
        Ok(())
    }

    fn face<'a>(&mut self, words: impl Iterator<Item = &'a [u8]>) -> Result<()> {
        self.corners.clear();
        for word in words {
            let vertex = word.split(|&byte| byte == b'/').next().unwrap_or_default();
            let vertex = index(vertex, self.vertices, "vertex")?;
            self.corners.push(u32::try_from(vertex).unwrap_or(u32::MAX));
        }
        self.first.check_face(self.faces, &self.corners)?;
        self.faces += 1;
        Ok(())
    }

    /// A line that is neither vertex nor face.
    fn skip_line(&mut self, positions: &mut [f32]) -> Result<()> {
        let rest = &self.bytes[self.at..];
        let length = memchr(b'\n', rest).unwrap_or(rest.len());
        if rest[..length].contains(&0) {
            return Diagnostic::error("not an OBJ file: it holds bytes that are no text").err();
        }
        if rest[..length].trim_ascii_end().ends_with(b"\\") {
            return self.any(positions);
        }
        self.at += length + 1;
        Ok(())
    }
}

fn place(positions: &mut [f32], vertex: usize) -> Option<&mut [f32]> {
    positions.get_mut(3 * vertex..3 * vertex + 3)
}
