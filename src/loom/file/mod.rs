//! A loom as named arrays and a text, and back. The container around them (bytes, offsets) is a file
//! format's matter; here counts, shapes and numbers are checked, and nothing is trusted.
//!
//! ```text
//! faces/arities [F] u32      corners a face              faces/corners [C] u32     their vertices
//! texture/coordinates [T 2] f32, texture/corners [C] u32 (if there are any)
//! space/reference [3V or 0], space/weights [blocks] f64, space/patches [triangles or 0] u32;  fps [0 or 1] f64
//! shape/offset [d], shape/vectors [m d] f64              h_0; h_1 .. h_m
//! pose/frame [3]             origin and scale of the plane's unit, f64
//! pose/sites [l 2], pose/weights [l m], pose/affine [3 m] f64,  pose/site_frames [l or 0] u32, from 0
//! time/intervals [k+1], time/controls [k 2] f64          knot intervals; f_1 .. f_k
//! time/spans [n] u32, time/offsets [n], time/slopes [n]  rho: place and slope of every frame
//! time/warp/0 ..             [keys 3] f64: output time, source time, slope; [1] u32: reversed, n
//! root/pivot [3], root/rotations [n 4] (w x y z), root/positions [n 3], root/spins, root/slopes f64
//! layout/positions [N 2], layout/coordinates [N m], layout/residuals [N] f64
//! layout/pins [P] u32 (from 0), layout/pinned [P 2] f64
//! ```

mod read;
mod write;

use serde::{Deserialize, Serialize};

use super::FitReport;
use crate::mesh::GroupKind;
use crate::signal::root::RootKind;

pub use read::from_tensors;
pub use write::to_tensors;

/// Version of the arrays and the text.
pub const VERSION: u32 = 1;

/// The numbers of an array.
#[derive(Debug, Clone, PartialEq)]
pub enum TensorData {
    /// Double precision.
    F64(Vec<f64>),
    /// Single precision.
    F32(Vec<f32>),
    /// Whole numbers.
    U32(Vec<u32>),
}

impl TensorData {
    /// How many numbers there are.
    pub fn len(&self) -> usize {
        match self {
            TensorData::F64(data) => data.len(),
            TensorData::F32(data) => data.len(),
            TensorData::U32(data) => data.len(),
        }
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// A named array, its last index running fastest.
#[derive(Debug, Clone, PartialEq)]
pub struct Tensor {
    /// Its name.
    pub name: String,
    /// Its lengths.
    pub shape: Vec<usize>,
    /// Its numbers.
    pub data: TensorData,
}

/// What is not an array.
#[derive(Serialize, Deserialize)]
struct Metadata {
    format: String,
    version: u32,
    program: String,
    processor: String,
    space: String,
    vertices: usize,
    warps: usize,
    root: Option<String>,
    #[serde(default)]
    normals: bool,
    #[serde(default)]
    groups: Vec<(String, String, usize)>,
    #[serde(default)]
    material_libraries: Vec<String>,
    #[serde(default)]
    report: FitReport,
}

const GROUP_KINDS: [(GroupKind, &str); 4] = [
    (GroupKind::Object, "object"),
    (GroupKind::Group, "group"),
    (GroupKind::Material, "material"),
    (GroupKind::Smoothing, "smoothing"),
];

const ROOT_KINDS: [(RootKind, &str); 2] =
    [(RootKind::Ground, "ground"), (RootKind::Rigid, "rigid")];
#[cfg(test)]
mod tests {
    use super::super::Loom;
    use super::super::test_looms::{ring, travelling};
    use super::*;
    use crate::signal::time::TimeSignal;
    use crate::signal::warp::{Keys, Warp};

    fn looms() -> Vec<Loom> {
        let warped = {
            let loom = travelling(9, 10);
            let time = loom.time();
            let keys = Keys::monotone(vec![1.0, 4.0, 8.0], vec![2.0, 3.3, 9.5]).unwrap();
            let warps = vec![Warp::Keys(keys), Warp::Reverse { frames: 8 }];
            let (curve, places) = (time.curve().clone(), time.places().to_vec());
            let time = TimeSignal::new(curve, places, time.slopes().to_vec(), warps).unwrap();
            loom.with_time(time).unwrap()
        };
        vec![ring(7, 9, false), travelling(9, 12), warped]
    }

    #[test]
    fn a_loom_comes_back_to_the_bit() {
        for loom in looms() {
            let (tensors, text) = to_tensors(&loom);
            let back = from_tensors(tensors.clone(), &text).unwrap();
            assert_eq!(to_tensors(&back), (tensors, text));
            for t in [1.0, 2.7, 5.0, loom.frames() as f64] {
                assert_eq!(back.at(t).unwrap(), loom.at(t).unwrap());
            }
            assert_eq!((back.fps(), back.layout()), (loom.fps(), loom.layout()));
        }
    }

    #[test]
    fn an_array_that_is_missing_cut_short_or_not_finite_is_refused() {
        for loom in looms() {
            let (tensors, text) = to_tensors(&loom);
            for i in 0..tensors.len() {
                let mut missing = tensors.clone();
                let gone = missing.remove(i);
                assert!(
                    from_tensors(missing, &text).is_err(),
                    "without {}",
                    gone.name
                );
                let mut longer = tensors.clone();
                longer[i].shape[0] += 1;
                assert!(from_tensors(longer, &text).is_err(), "longer {}", gone.name);
                let mut broken = tensors.clone();
                match &mut broken[i].data {
                    TensorData::F64(data) if !data.is_empty() => data[0] = f64::NAN,
                    TensorData::U32(data) if !data.is_empty() => data[0] = u32::MAX,
                    _ => continue,
                }
                assert!(from_tensors(broken, &text).is_err(), "broken {}", gone.name);
            }
        }
    }

    #[test]
    fn shapes_that_overflow_and_false_counts_do_not_allocate() {
        let (mut tensors, text) = to_tensors(&ring(4, 5, true));
        tensors[0].shape = vec![usize::MAX, 2];
        assert!(from_tensors(tensors, &text).is_err());
        let (tensors, text) = to_tensors(&ring(4, 5, true));
        let text = text.replace("\"warps\":0", "\"warps\":4000000000");
        assert!(from_tensors(tensors, &text).is_err());
    }

    #[test]
    fn other_texts_are_refused_and_newer_versions_named() {
        let (tensors, text) = to_tensors(&ring(4, 5, true));
        let refused = |text: &str| from_tensors(tensors.clone(), text).map(|_| ()).unwrap_err();
        assert!(refused("").message.contains("cannot be read"));
        assert!(
            refused(&text.replace("meshloom", "weaver"))
                .message
                .contains("weaver")
        );
        let newer = refused(&text.replace("\"version\":1", "\"version\":7"));
        assert!(newer.message.contains("version 7"));
        assert!(
            refused(&text.replace(":\"vertices\"", ":\"smoke\""))
                .message
                .contains("smoke")
        );
    }
}
