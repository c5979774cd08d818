//! A few frames of the real captures, where they are at hand.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use meshloom::mesh::Topology;

use crate::meshes::Case;

/// The captures beside the project; says so when there are none.
pub(crate) fn folders() -> Vec<PathBuf> {
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data");
    let mut found: Vec<PathBuf> = fs::read_dir(&data)
        .map(|entries| entries.flatten().map(|entry| entry.path()).collect())
        .unwrap_or_default();
    found.retain(|path| path.join("frames.pc2").is_file());
    found.sort();
    if found.is_empty() {
        println!("skipped: no real captures");
    }
    found
}

/// The first frame and `more` others spread over the capture.
pub(crate) fn read(folder: &Path, more: usize) -> Case {
    let text = fs::read_to_string(folder.join("base.obj")).unwrap();
    let (mut arities, mut corners) = (Vec::new(), Vec::new());
    for line in text.lines().filter(|line| line.starts_with("f ")) {
        let before = corners.len();
        corners.extend(line.split_whitespace().skip(1).map(|corner| {
            let vertex = corner.split('/').next().unwrap();
            vertex.parse::<u32>().unwrap() - 1
        }));
        arities.push((corners.len() - before) as u32);
    }
    let bytes = fs::read(folder.join("frames.pc2")).unwrap();
    let number = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap());
    let (vertices, frames) = (number(16) as usize, number(28) as usize);
    let frame = |index: usize| -> Vec<f64> {
        let start = 32 + index * vertices * 12;
        bytes[start..start + vertices * 12]
            .chunks_exact(4)
            .map(|four| f64::from(f32::from_le_bytes(four.try_into().unwrap())))
            .collect()
    };
    Case {
        name: folder.file_name().unwrap().to_string_lossy().into_owned(),
        topology: Arc::new(Topology::new(vertices, &arities, corners).unwrap()),
        poses: (0..=more).map(|i| frame(i * (frames - 1) / more)).collect(),
    }
}
