//! What recipes pass around: frames, looms and shapes, each with the key of what it was made from.

use std::sync::Arc;

use super::key::{Key, KeyBuilder};
use super::memory::Remembered;
use super::request::FitRequest;
use super::statistics::Statistics;
use crate::edit::Edit;
use crate::format;
use crate::loom::Loom;
use crate::mesh::{FrameSource, Sequence, Topology};

/// A value and its key. Clones share the value.
#[derive(Debug)]
pub struct Keyed<T> {
    /// The value.
    pub value: Arc<T>,
    /// What it was made from.
    pub key: Key,
}

impl<T> Clone for Keyed<T> {
    fn clone(&self) -> Self {
        Keyed {
            value: Arc::clone(&self.value),
            key: self.key,
        }
    }
}

impl<T> Keyed<T> {
    /// `value` under `key`.
    pub fn new(value: T, key: Key) -> Self {
        Keyed {
            value: Arc::new(value),
            key,
        }
    }

    /// Begins the key of what `operation` makes of this value.
    pub fn then(&self, operation: &str) -> KeyBuilder {
        Key::of(operation).key(self.key)
    }
}

/// A capture.
pub type Frames = Keyed<Sequence>;

/// One mesh.
pub type ShapeValue = Keyed<Shape>;

/// Poses, their mean and their principal components.
pub type StatisticsValue = Keyed<Statistics>;

impl Frames {
    /// How many frames there are.
    pub fn frames(&self) -> usize {
        self.value.frames()
    }

    /// Frames per second, where known.
    pub fn fps(&self) -> Option<f64> {
        self.value.fps()
    }

    /// V.
    pub fn vertices(&self) -> usize {
        self.value.topology().vertices()
    }
}

impl ShapeValue {
    /// V.
    pub fn vertices(&self) -> usize {
        self.value.topology.vertices()
    }
}

/// A loom, and what is needed to lay it out anew.
#[derive(Clone)]
pub struct LoomValue {
    /// The loom.
    pub loom: Keyed<Loom>,
    /// What it was fitted to; `None` for a loom from a file.
    pub source: Option<Arc<Source>>,
    /// What was done to it since it was fitted, in order.
    pub edits: Vec<Edit>,
}

/// What a loom was fitted to, and how.
#[derive(Debug)]
pub struct Source {
    /// The frames.
    pub frames: Frames,
    /// What was asked of the fit.
    pub request: FitRequest,
    /// What it gave, before all edits.
    pub fitted: Arc<Loom>,
}

impl std::fmt::Debug for LoomValue {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("LoomValue")
            .field("key", &self.loom.key)
            .field("edits", &self.edits)
            .finish_non_exhaustive()
    }
}

impl LoomValue {
    /// A loom of which only itself is known.
    pub fn bare(loom: Keyed<Loom>) -> Self {
        LoomValue {
            loom,
            source: None,
            edits: Vec::new(),
        }
    }

    /// n.
    pub fn frames(&self) -> usize {
        self.loom.value.frames()
    }

    /// Frames per second, where known.
    pub fn fps(&self) -> Option<f64> {
        self.loom.value.fps()
    }

    /// k, control points of the time signal.
    pub fn controls(&self) -> usize {
        self.loom.value.time().controls().len()
    }

    /// l, sites of the pose signal.
    pub fn sites(&self) -> usize {
        self.loom.value.pose().sites().len()
    }

    /// m, modes of the shape signal.
    pub fn modes(&self) -> usize {
        self.loom.value.shape().modes()
    }

    /// The shape space's name.
    pub fn space(&self) -> &str {
        self.loom.value.space().name()
    }

    /// Its report as the command line's JSON.
    pub fn report(&self) -> serde_json::Value {
        serde_json::to_value(&**self.loom.value.report()).unwrap_or_default()
    }
}

/// One mesh.
#[derive(Debug, Clone)]
pub struct Shape {
    /// Its connectivity.
    pub topology: Arc<Topology>,
    /// 3V coordinates, x y z interleaved.
    pub positions: Vec<f32>,
}

impl Shape {
    /// A capture of this one frame.
    pub fn sequence(&self) -> Sequence {
        Sequence::new(Arc::clone(&self.topology), self.positions.clone(), None)
    }
}

/// What a recipe results in.
#[derive(Debug, Clone, Default)]
pub enum Value {
    /// Nothing to show or to save.
    #[default]
    Nothing,
    /// Frames.
    Sequence(Keyed<Sequence>),
    /// A loom.
    Loom(LoomValue),
    /// One mesh.
    Shape(Keyed<Shape>),
    /// Poses and their principal components.
    Statistics(StatisticsValue),
    /// A text or a number, as it is told to people.
    Text(String),
    /// A picture, as the bytes of a PNG or SVG file.
    Picture(Arc<Picture>),
}

/// A picture made by a recipe.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Picture {
    /// The whole file.
    pub bytes: Vec<u8>,
}

impl Value {
    /// What kind of value it is, for people.
    pub fn kind(&self) -> &'static str {
        match self {
            Value::Nothing => "nothing",
            Value::Sequence(_) => "a sequence",
            Value::Loom(_) => "a loom",
            Value::Shape(_) => "a mesh",
            Value::Statistics(_) => "principal components",
            Value::Text(_) => "a text",
            Value::Picture(_) => "a picture",
        }
    }
}

impl Remembered for Sequence {
    fn size(&self) -> usize {
        4 * self.positions().len()
    }
}

impl Remembered for Statistics {
    fn size(&self) -> usize {
        self.bytes()
    }
}

impl Remembered for Loom {
    fn size(&self) -> usize {
        8 * (self.shape().modes() + 1) * self.shape().dimension()
    }

    fn to_bytes(&self) -> Option<Vec<u8>> {
        format::loom::write(self).ok()
    }

    fn from_bytes(bytes: &[u8]) -> Option<Self> {
        format::loom::read(bytes).ok()
    }
}

/// The key of a sequence by what it holds.
pub(super) fn content_key(sequence: &Sequence) -> Key {
    let topology = sequence.topology();
    let corners: Vec<u8> = topology
        .corners()
        .iter()
        .chain(topology.offsets())
        .flat_map(|index| index.to_le_bytes())
        .collect();
    let builder = Key::of("sequence")
        .number(topology.vertices() as f64)
        .bytes(&corners);
    builder
        .number(sequence.fps().unwrap_or(0.0))
        .coordinates(sequence.positions())
        .finish()
}

/// What it is, for people: `a loom of 48 frames`.
impl std::fmt::Display for Value {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Value::Loom(loom) => write!(f, "a loom of {} frames", loom.frames()),
            Value::Sequence(frames) => write!(f, "a sequence of {} frames", frames.frames()),
            Value::Statistics(found) => found.value.fmt(f),
            Value::Text(text) => f.write_str(text),
            other => f.write_str(other.kind()),
        }
    }
}
