//! A few frames of the real captures, where they are at hand.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Arc;

use meshloom::mesh::Topology;

use crate::meshes::Case;

/// Checks the first frame and `more` others of every capture beside the project.
pub(crate) fn each(more: usize, check: impl Fn(&Case)) {
    for folder in folders() {
        check(&read(&folder, more));
    }
    skinned().iter().for_each(check);
}

/// Where the captures are.
fn data() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data")
}

/// The captures beside the project; says so when there are none.
fn folders() -> Vec<PathBuf> {
    let data = data();
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
fn read(folder: &Path, more: usize) -> Case {
    let text = fs::read_to_string(folder.join("base.obj")).unwrap();
    let (arities, corners) = faces(&text);
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

/// Of each face of an OBJ file how many corners it has, and the corners.
fn faces(text: &str) -> (Vec<u32>, Vec<u32>) {
    let (mut arities, mut corners) = (Vec::new(), Vec::new());
    for line in text.lines().filter(|line| line.starts_with("f ")) {
        let before = corners.len();
        corners.extend(line.split_whitespace().skip(1).map(|corner| {
            let vertex = corner.split('/').next().unwrap();
            vertex.parse::<u32>().unwrap() - 1
        }));
        arities.push((corners.len() - before) as u32);
    }
    (arities, corners)
}

/// A skinned animation, three of its frames as the program itself writes them.
fn skinned() -> Option<Case> {
    let file = data().join("fox/Fox.glb");
    if !file.is_file() {
        return None;
    }
    let folder = tempfile::tempdir().unwrap();
    let run = Command::new(env!("CARGO_BIN_EXE_meshloom"))
        .args(["convert", "--quiet", "--range", "1:3", "-o", "fox_#.obj"])
        .arg(&file)
        .current_dir(folder.path())
        .status();
    assert!(run.unwrap().success());
    let texts = [1, 2, 3]
        .map(|frame| fs::read_to_string(folder.path().join(format!("fox_{frame}.obj"))).unwrap());
    let points = |text: &String| -> Vec<f64> {
        let lines = text.lines().filter_map(|line| line.strip_prefix("v "));
        lines
            .flat_map(|line| line.split_whitespace().take(3))
            .map(|number| number.parse().unwrap())
            .collect()
    };
    let poses: Vec<Vec<f64>> = texts.iter().map(points).collect();
    let (arities, corners) = faces(&texts[0]);
    Some(Case {
        name: "fox".to_string(),
        topology: Arc::new(Topology::new(poses[0].len() / 3, &arities, corners).unwrap()),
        poses,
    })
}
