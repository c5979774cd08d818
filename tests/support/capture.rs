//! Small captures, generated, and the bytes of their files.

use std::fmt::Write;
use std::path::Path;

/// A deforming mesh: positions of every frame and triangles, vertices from 0.
#[derive(Clone)]
pub struct Capture {
    pub frames: Vec<Vec<[f32; 3]>>,
    pub faces: Vec<[u32; 3]>,
}

/// A sheet of `side` by `side` vertices in two waves of unequal speed: it never repeats, and its shapes
/// span as many dimensions as there are frames to see.
pub fn sheet(side: usize, frames: usize) -> Capture {
    let at = |frame: usize, i: usize| {
        let (x, y, t) = ((i % side) as f64, (i / side) as f64, frame as f64);
        let z = (0.9 * x + 0.5 * t).sin() + 0.4 * (1.1 * y - 0.83 * t).cos() * (0.1 * x * t).sin();
        [x as f32, y as f32, z as f32]
    };
    let corner = |x: usize, y: usize| (y * side + x) as u32;
    let mut faces = Vec::new();
    for (x, y) in (0..side - 1).flat_map(|y| (0..side - 1).map(move |x| (x, y))) {
        let (a, b) = (corner(x, y), corner(x + 1, y));
        let (c, d) = (corner(x + 1, y + 1), corner(x, y + 1));
        faces.extend([[a, b, c], [a, c, d]]);
    }
    Capture {
        frames: (0..frames)
            .map(|frame| (0..side * side).map(|i| at(frame, i)).collect())
            .collect(),
        faces,
    }
}

impl Capture {
    pub fn vertices(&self) -> usize {
        self.frames[0].len()
    }

    /// One frame as OBJ, from 0.
    pub fn obj(&self, frame: usize) -> String {
        let mut text = String::new();
        for [x, y, z] in &self.frames[frame] {
            writeln!(text, "v {x} {y} {z}").unwrap();
        }
        for [a, b, c] in &self.faces {
            writeln!(text, "f {} {} {}", a + 1, b + 1, c + 1).unwrap();
        }
        text
    }

    /// One frame as ASCII PLY.
    pub fn ply(&self, frame: usize) -> String {
        let mut text = format!(
            "ply\nformat ascii 1.0\nelement vertex {}\nproperty float x\nproperty float y\n\
             property float z\nelement face {}\nproperty list uchar int vertex_indices\nend_header\n",
            self.vertices(),
            self.faces.len()
        );
        for [x, y, z] in &self.frames[frame] {
            writeln!(text, "{x} {y} {z}").unwrap();
        }
        for [a, b, c] in &self.faces {
            writeln!(text, "3 {a} {b} {c}").unwrap();
        }
        text
    }

    /// All frames as a PC2 cache: header of 32 bytes, then little-endian floats.
    pub fn pc2(&self) -> Vec<u8> {
        let mut bytes = b"POINTCACHE2\0".to_vec();
        bytes.extend(1i32.to_le_bytes());
        bytes.extend((self.vertices() as i32).to_le_bytes());
        bytes.extend(0f32.to_le_bytes());
        bytes.extend(1f32.to_le_bytes());
        bytes.extend((self.frames.len() as i32).to_le_bytes());
        let numbers = self.frames.iter().flatten().flatten();
        bytes.extend(numbers.flat_map(|number| number.to_le_bytes()));
        bytes
    }

    /// All frames as an MDD cache at 24 frames a second: big-endian counts, times, floats.
    pub fn mdd(&self) -> Vec<u8> {
        let mut bytes = (self.frames.len() as u32).to_be_bytes().to_vec();
        bytes.extend((self.vertices() as u32).to_be_bytes());
        let times = (0..self.frames.len()).map(|frame| frame as f32 / 24.0);
        bytes.extend(times.flat_map(f32::to_be_bytes));
        let numbers = self.frames.iter().flatten().flatten();
        bytes.extend(numbers.flat_map(|number| number.to_be_bytes()));
        bytes
    }

    /// Writes `frame_0001.obj` and so on into `folder`, which is created.
    pub fn write_objs(&self, folder: &Path) {
        std::fs::create_dir_all(folder).unwrap();
        for frame in 0..self.frames.len() {
            let name = format!("frame_{:04}.obj", frame + 1);
            std::fs::write(folder.join(name), self.obj(frame)).unwrap();
        }
    }
}
