//! Whether a later frame has the faces of the first. Files of one sequence usually repeat the same
//! bytes, so those are compared first; only where they differ are faces parsed and compared.

use std::sync::Arc;

use crate::diag::{Diagnostic, Result};
use crate::mesh::Topology;

/// The first frame of a sequence of files, and what later frames are held against.
#[derive(Debug)]
pub struct FirstFrame {
    /// What messages call it, usually its path.
    pub name: String,
    /// The connectivity of the sequence.
    pub topology: Arc<Topology>,
    /// Its 3V coordinates.
    pub positions: Vec<f32>,
    /// Frames per second, where the file says so.
    pub fps: Option<f64>,
    /// How the bytes of its faces are to be read: equal bytes mean equal faces only if this is equal too.
    pub layout: String,
    /// The bytes of its faces.
    pub runs: Vec<FaceRun>,
}

/// Faces that follow each other in a file.
#[derive(Debug, Default)]
pub struct FaceRun {
    /// How many vertices stand before them (indices may be relative to that).
    pub vertices: usize,
    /// How many faces stand before them.
    pub start: usize,
    /// How many faces they are.
    pub faces: usize,
    /// Their bytes.
    pub bytes: Vec<u8>,
}

impl FirstFrame {
    /// The run that starts after these vertices and faces, if `rest` begins with its bytes.
    pub(super) fn run_at(&self, vertices: usize, faces: usize, rest: &[u8]) -> Option<&FaceRun> {
        let run = &self.runs[self
            .runs
            .binary_search_by_key(&faces, |run| run.start)
            .ok()?];
        (run.vertices == vertices && rest.starts_with(&run.bytes)).then_some(run)
    }

    /// Checks one face (from 0) of a later frame.
    pub(super) fn check_face(&self, face: usize, corners: &[u32]) -> Result<()> {
        if face >= self.topology.faces() {
            return Ok(()); // counted by `check_counts`
        }
        if self.topology.face(face) == corners {
            return Ok(());
        }
        let text = |corners: &[u32]| {
            let numbers: Vec<String> = corners
                .iter()
                .map(|&v| (u64::from(v) + 1).to_string())
                .collect();
            numbers.join(" ")
        };
        Diagnostic::error(format!(
            "the face joins vertices {}, in {} it joins {}",
            text(corners),
            self.name,
            text(self.topology.face(face))
        ))
        .at_face(face + 1)
        .hint("all frames of a capture have the same faces in the same order")
        .err()
    }

    /// Checks how many vertices and faces a later frame has.
    pub(super) fn check_counts(&self, vertices: usize, faces: usize) -> Result<()> {
        let (expected, known) = (self.topology.vertices(), self.topology.faces());
        let differs = if vertices != expected {
            format!("{vertices} vertices, but {} has {expected}", self.name)
        } else if faces != known {
            format!("{faces} faces, but {} has {known}", self.name)
        } else {
            return Ok(());
        };
        Diagnostic::error(differs)
            .hint("all frames of a capture share one connectivity; the file may be cut short")
            .err()
    }
}
