//! Bytes to frames and back, one file a format. Sees no path: errors name lines, frames, vertices and
//! faces; whoever opened the file adds its name.
//!
//! To add a format: a file here, a line in [`FORMATS`]; `tests/format_round_trip.rs` runs over it.

pub mod cache;
mod face_check;
pub mod gltf;
pub mod loom;
pub mod mdd;
pub mod obj;
pub mod pc2;
pub mod ply;
mod rate;
pub mod skeleton;

use std::sync::Arc;

use crate::diag::{Diagnostic, Result, Warned};
use crate::mesh::{Sequence, Topology};

pub use cache::CacheFormat;
pub use face_check::{FaceRun, FirstFrame};

/// A file format: its name, its endings, and what it can hold.
pub struct Format {
    /// The name for people.
    pub name: &'static str,
    /// The endings of its files, in lower case, without the dot; the first is the usual one.
    pub endings: &'static [&'static str],
    /// Whether the first bytes of a file show that it is of this format (never for formats without a
    /// mark of their own).
    pub recognises: fn(head: &[u8]) -> bool,
    /// What a file holds, and how it is read and written.
    pub kind: Kind,
}

/// What one file of a [`Format`] holds.
#[derive(Clone, Copy)]
pub enum Kind {
    /// One frame with its faces: a sequence is one file a frame.
    Mesh(&'static dyn MeshFormat),
    /// Frames without faces.
    Cache(&'static dyn CacheFormat),
    /// A scene that moves: frames with faces, read only.
    Scene(&'static dyn SceneFormat),
    /// A loom: [`loom::read`], [`loom::write`].
    Loom,
}

/// All formats.
pub const FORMATS: &[Format] = &[
    Format {
        name: "OBJ",
        endings: &["obj"],
        recognises: |_| false,
        kind: Kind::Mesh(&obj::Obj),
    },
    Format {
        name: "PLY",
        endings: &["ply"],
        recognises: |head| head.starts_with(b"ply\n") || head.starts_with(b"ply\r\n"),
        kind: Kind::Mesh(&ply::Ply),
    },
    Format {
        name: "PC2",
        endings: &["pc2"],
        recognises: pc2::recognises,
        kind: Kind::Cache(&pc2::Pc2),
    },
    Format {
        name: "MDD",
        endings: &["mdd"],
        recognises: |_| false,
        kind: Kind::Cache(&mdd::Mdd),
    },
    Format {
        name: "glTF",
        endings: &["glb", "gltf"],
        recognises: |head| head.starts_with(b"glTF"),
        kind: Kind::Scene(&gltf::Gltf),
    },
    Format {
        name: "loom",
        endings: &["loom"],
        recognises: loom::recognises,
        kind: Kind::Loom,
    },
];

/// Formats that are asked for and not there yet: ending and name.
pub const NOT_YET: &[(&str, &str)] = &[
    ("usd", "USD"),
    ("usda", "USD"),
    ("usdc", "USD"),
    ("usdz", "USD"),
    ("abc", "Alembic"),
];

/// One frame a file, with faces.
pub trait MeshFormat: Sync {
    /// The first frame: connectivity, attributes, positions. `name` is what later messages call it.
    ///
    /// # Errors
    /// The file is not whole, a coordinate is not finite, a face names a vertex that is not there, or
    /// there are no faces.
    fn read_first(&self, bytes: &[u8], name: &str) -> Result<FirstFrame>;

    /// A later frame: its 3V coordinates into `positions`, after checking that its faces are those of
    /// `first`, in the same order.
    ///
    /// # Errors
    /// As [`MeshFormat::read_first`], another number of vertices, or other faces.
    fn read_next(&self, bytes: &[u8], first: &FirstFrame, positions: &mut [f32]) -> Result<()>;

    /// Whatever writes frames of this connectivity; what all frames share is formatted once, here.
    fn writer(&self, topology: &Arc<Topology>, options: WriteOptions) -> Box<dyn FrameWriter>;
}

/// A file, and files that it names, to frames.
pub trait SceneFormat: Sync {
    /// All frames of one animation; the first if `animation` is none. `resource` fetches a file by the
    /// name that the scene gives it, relative to the scene.
    ///
    /// # Errors
    /// The file is damaged, there is no such animation, or nothing in it has faces.
    fn read(
        &self,
        bytes: &[u8],
        animation: Option<&str>,
        resource: &dyn Fn(&str) -> Result<Vec<u8>>,
    ) -> Result<Warned<Sequence>>;
}

/// How to write.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct WriteOptions {
    /// Frames per second, where known.
    pub fps: Option<f64>,
    /// How numbers are laid out, in formats that leave the choice (PLY).
    pub encoding: Encoding,
}

/// How numbers are laid out in a file.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Encoding {
    /// As text.
    Ascii,
    /// In binary, the lowest byte first.
    #[default]
    LittleEndian,
    /// In binary, the highest byte first.
    BigEndian,
}

/// Writes frames of one connectivity.
pub trait FrameWriter: Send + Sync {
    /// Replaces `out` by the bytes of a file with these 3V coordinates.
    fn write(&self, positions: &[f32], out: &mut Vec<u8>);
}

/// The format of an ending (without the dot, any case).
pub fn by_ending(ending: &str) -> Option<&'static Format> {
    let ending = ending.to_ascii_lowercase();
    FORMATS
        .iter()
        .find(|format| format.endings.contains(&ending.as_str()))
}

/// The format that the first bytes of a file show, if they show one.
pub fn by_content(head: &[u8]) -> Option<&'static Format> {
    FORMATS.iter().find(|format| (format.recognises)(head))
}

/// The shortest digits that read back as `value`, without `.0`.
fn shortest(digits: &mut zmij::Buffer, value: f32) -> &[u8] {
    let text = digits.format(value).as_bytes();
    text.strip_suffix(b".0").unwrap_or(text)
}

/// What is said about a file that is empty.
fn nothing_in_it() -> Diagnostic {
    Diagnostic::error("the file is empty (0 bytes)").hint("it may still be being written")
}
