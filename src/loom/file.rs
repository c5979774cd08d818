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

use std::collections::BTreeMap;
use std::sync::Arc;

use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

use super::{FitReport, Layout, Loom, Parts};
use crate::diag::{Diagnostic, Result};
use crate::math::b_spline::{Curve, Place, Point};
use crate::math::thin_plate::ThinPlate;
use crate::mesh::{Attributes, Group, GroupKind, Topology};
use crate::signal::pose::PoseSignal;
use crate::signal::root::{RootFrame, RootKind, RootSignal};
use crate::signal::shape::ShapeSignal;
use crate::signal::time::TimeSignal;
use crate::signal::warp::{Keys, Warp};
use crate::space::{ShapeSpace, Spaces, State};

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

/// The arrays of a loom and its text (JSON).
pub fn to_tensors(loom: &Loom) -> (Vec<Tensor>, String) {
    let mut writer = Writer::default();
    writer.topology(loom.topology());
    writer.space(loom.space().state());
    let fps: Vec<f64> = loom.fps().into_iter().collect();
    writer.f64("fps", &[fps.len()], fps);
    let (d, m) = (loom.shape().dimension(), loom.shape().modes());
    writer.f64("shape/offset", &[d], loom.shape().offset().to_vec());
    writer.f64("shape/vectors", &[m, d], loom.shape().vectors().to_vec());
    writer.pose(loom.pose());
    writer.time(loom.time());
    if let Some(root) = loom.root() {
        writer.root(root);
    }
    writer.layout(loom.layout(), m);
    (writer.tensors, metadata(loom))
}

fn metadata(loom: &Loom) -> String {
    let attributes = loom.topology().attributes();
    let named = |group: &Group| {
        let kind = GROUP_KINDS.iter().find(|(kind, _)| *kind == group.kind);
        let kind = kind.map_or("group", |(_, name)| name);
        (kind.to_string(), group.name.clone(), group.first_face)
    };
    let root_name = |root: &Arc<RootSignal>| {
        let kind = ROOT_KINDS.iter().find(|(kind, _)| *kind == root.kind());
        kind.map(|(_, name)| (*name).to_string())
    };
    let metadata = Metadata {
        format: "meshloom".to_string(),
        version: VERSION,
        program: env!("CARGO_PKG_VERSION").to_string(),
        processor: processor().to_string(),
        space: loom.space().name().to_string(),
        vertices: loom.topology().vertices(),
        warps: loom.time().warps().len(),
        root: loom.root().and_then(root_name),
        normals: attributes.normals,
        groups: attributes.groups.iter().map(named).collect(),
        material_libraries: attributes.material_libraries.clone(),
        report: loom.report().as_ref().clone(),
    };
    // Strings and finite numbers only: this cannot fail.
    serde_json::to_string(&metadata).unwrap_or_default()
}

/// Which vector instructions fits use here: refits agree to the bit where it is the same.
#[cfg(target_arch = "x86_64")]
fn processor() -> &'static str {
    if std::arch::is_x86_feature_detected!("avx512f") {
        "x86_64 avx512"
    } else if std::arch::is_x86_feature_detected!("avx2") {
        "x86_64 avx2"
    } else {
        "x86_64"
    }
}

/// Which kind of processor this is.
#[cfg(not(target_arch = "x86_64"))]
fn processor() -> &'static str {
    match cfg!(target_arch = "aarch64") {
        true => "aarch64",
        false => "other",
    }
}

#[derive(Default)]
struct Writer {
    tensors: Vec<Tensor>,
}

impl Writer {
    fn put(&mut self, name: &str, shape: &[usize], data: TensorData) {
        self.tensors.push(Tensor {
            name: name.to_string(),
            shape: shape.to_vec(),
            data,
        });
    }

    fn f64(&mut self, name: &str, shape: &[usize], data: Vec<f64>) {
        self.put(name, shape, TensorData::F64(data));
    }

    /// Indices and counts of things in memory: those of a topology fit 32 bits, and so do frames.
    fn u32(&mut self, name: &str, data: impl Iterator<Item = usize>) {
        let data: Vec<u32> = data.map(|x| x as u32).collect();
        self.put(name, &[data.len()], TensorData::U32(data));
    }

    fn points(&mut self, name: &str, points: &[Point]) {
        self.f64(name, &[points.len(), 2], points.concat());
    }

    fn topology(&mut self, topology: &Topology) {
        self.u32("faces/arities", topology.polygons().map(<[u32]>::len));
        let corners = topology.polygons().flatten().map(|&corner| corner as usize);
        self.u32("faces/corners", corners);
        let attributes = topology.attributes();
        if !attributes.texture_coordinates.is_empty() {
            let uv = attributes.texture_coordinates.concat();
            self.put(
                "texture/coordinates",
                &[uv.len() / 2, 2],
                TensorData::F32(uv),
            );
            self.u32(
                "texture/corners",
                attributes.corner_texture.iter().map(|&c| c as usize),
            );
        }
    }

    fn space(&mut self, state: State) {
        self.f64("space/reference", &[state.reference.len()], state.reference);
        self.f64("space/weights", &[state.weights.len()], state.weights);
        self.u32("space/patches", state.patches.iter().map(|&p| p as usize));
    }

    fn pose(&mut self, pose: &PoseSignal) {
        let plate = pose.plate();
        let (origin, scale) = plate.frame();
        let (l, m) = (plate.sites().len(), plate.width());
        self.f64("pose/frame", &[3], vec![origin[0], origin[1], scale]);
        self.points("pose/sites", plate.sites());
        self.f64("pose/weights", &[l, m], plate.weights().to_vec());
        self.f64("pose/affine", &[3, m], plate.affine().to_vec());
        self.u32("pose/site_frames", pose.site_frames().iter().copied());
    }

    fn time(&mut self, time: &TimeSignal) {
        let curve = time.curve();
        let intervals = curve.intervals().to_vec();
        self.f64("time/intervals", &[intervals.len()], intervals);
        self.points("time/controls", curve.controls());
        self.u32("time/spans", time.places().iter().map(|place| place.span));
        let offsets: Vec<f64> = time.places().iter().map(|place| place.offset).collect();
        self.f64("time/offsets", &[offsets.len()], offsets);
        self.f64(
            "time/slopes",
            &[time.slopes().len()],
            time.slopes().to_vec(),
        );
        for (i, warp) in time.warps().iter().enumerate() {
            let name = format!("time/warp/{i}");
            match warp {
                Warp::Reverse { frames } => self.u32(&name, [*frames].into_iter()),
                Warp::Keys(keys) => {
                    let rows = keys.times().iter().zip(keys.values()).zip(keys.slopes());
                    let rows: Vec<f64> = rows.flat_map(|((t, v), s)| [*t, *v, *s]).collect();
                    self.f64(&name, &[rows.len() / 3, 3], rows);
                }
            }
        }
    }

    fn root(&mut self, root: &RootSignal) {
        self.f64("root/pivot", &[3], root.pivot().as_slice().to_vec());
        let turn = |frame: &RootFrame| {
            let q = frame.rotation.quaternion();
            [q.w, q.i, q.j, q.k]
        };
        let turns: Vec<f64> = root.frames().iter().flat_map(turn).collect();
        self.f64("root/rotations", &[turns.len() / 4, 4], turns);
        let mut vectors = |name: &str, of: &dyn Fn(&RootFrame) -> Vector3<f64>| {
            let all: Vec<f64> = root
                .frames()
                .iter()
                .flat_map(|frame| of(frame).as_slice().to_vec())
                .collect();
            self.f64(name, &[all.len() / 3, 3], all);
        };
        vectors("root/positions", &|frame| frame.position);
        vectors("root/spins", &|frame| frame.spin);
        vectors("root/slopes", &|frame| frame.slope);
    }

    fn layout(&mut self, layout: &Layout, m: usize) {
        self.points("layout/positions", &layout.positions);
        let n = layout.positions.len();
        self.f64("layout/coordinates", &[n, m], layout.coordinates.clone());
        self.f64("layout/residuals", &[n], layout.residuals.clone());
        self.u32("layout/pins", layout.pins.iter().map(|(frame, _)| *frame));
        let pinned: Vec<Point> = layout.pins.iter().map(|(_, p)| *p).collect();
        self.points("layout/pinned", &pinned);
    }
}

/// The loom of arrays and text.
///
/// # Errors
/// Text that is not a loom's or of a newer version; an array that is missing, of another kind or shape;
/// numbers that are not finite; parts that do not fit each other.
pub fn from_tensors(tensors: Vec<Tensor>, metadata: &str) -> Result<Loom> {
    let metadata = read_metadata(metadata)?;
    let mut reader = Reader::new(tensors)?;
    let topology = Arc::new(reader.topology(&metadata)?);
    let offset = reader.list("shape/offset")?;
    let m = reader
        .shape("shape/vectors")
        .and_then(|s| s.first().copied())
        .unwrap_or(0);
    let vectors = reader.f64("shape/vectors", &[m, offset.len()])?;
    let shape = ShapeSignal::new(offset, vectors, m).map_err(|e| faulty("shape", e))?;
    let space = reader.space(&metadata.space, &topology, shape.dimension())?;
    let fps = reader.list("fps")?;
    let root = match &metadata.root {
        Some(kind) => Some(Arc::new(reader.root(kind)?)),
        None => None,
    };
    Loom::new(Parts {
        fps: fps.first().copied(),
        space,
        shape: Arc::new(shape),
        pose: Arc::new(reader.pose(m)?),
        time: Arc::new(reader.time(metadata.warps)?),
        root,
        layout: Arc::new(reader.layout(m)?),
        report: Arc::new(metadata.report),
        topology,
    })
}

fn read_metadata(text: &str) -> Result<Metadata> {
    #[derive(Deserialize)]
    struct Header {
        format: String,
        version: u32,
    }
    let broken = |e: serde_json::Error| {
        Box::new(
            Diagnostic::error(format!("the loom's description cannot be read: {e}"))
                .hint("looms are written by `meshloom fit -o F.loom`"),
        )
    };
    let header: Header = serde_json::from_str(text).map_err(broken)?;
    if header.format != "meshloom" {
        return Diagnostic::error(format!("this is a `{}` file, not a loom", header.format)).err();
    }
    if header.version > VERSION {
        let message = format!(
            "the loom has version {}, known are 1 to {VERSION}",
            header.version
        );
        return Diagnostic::error(message)
            .hint("it needs a newer meshloom")
            .err();
    }
    serde_json::from_str(text).map_err(broken)
}

fn faulty(part: &str, why: impl std::fmt::Debug) -> Box<Diagnostic> {
    Box::new(Diagnostic::error(format!(
        "the loom's {part} is damaged: {why:?}"
    )))
}

/// Arrays by name, each taken once.
struct Reader {
    tensors: BTreeMap<String, Tensor>,
}

impl Reader {
    fn new(tensors: Vec<Tensor>) -> Result<Self> {
        let mut all = BTreeMap::new();
        for tensor in tensors {
            let count = tensor
                .shape
                .iter()
                .try_fold(1_usize, |all, &n| all.checked_mul(n));
            if count != Some(tensor.data.len()) {
                let message = format!(
                    "the loom's array `{}` has not the length it claims",
                    tensor.name
                );
                return Diagnostic::error(message).err();
            }
            all.insert(tensor.name.clone(), tensor);
        }
        Ok(Reader { tensors: all })
    }

    fn shape(&self, name: &str) -> Option<&[usize]> {
        Some(&self.tensors.get(name)?.shape)
    }

    fn take(&mut self, name: &str) -> Result<Tensor> {
        self.tensors
            .remove(name)
            .ok_or_else(|| Box::new(Diagnostic::error(format!("the loom has no array `{name}`"))))
    }

    fn f64(&mut self, name: &str, shape: &[usize]) -> Result<Vec<f64>> {
        let tensor = self.take(name)?;
        match tensor.data {
            TensorData::F64(data) if tensor.shape == shape => Ok(data),
            _ => Diagnostic::error(format!(
                "the loom's array `{name}` is not of {shape:?} double-precision numbers"
            ))
            .err(),
        }
    }

    /// Numbers in a row, however many.
    fn list(&mut self, name: &str) -> Result<Vec<f64>> {
        let count = self.shape(name).map_or(0, |shape| shape.iter().product());
        self.f64(name, &[count])
    }

    fn u32(&mut self, name: &str) -> Result<Vec<u32>> {
        let tensor = self.take(name)?;
        match tensor.data {
            TensorData::U32(data) if tensor.shape.len() == 1 => Ok(data),
            _ => Diagnostic::error(format!(
                "the loom's array `{name}` is not a row of whole numbers"
            ))
            .err(),
        }
    }

    fn indices(&mut self, name: &str) -> Result<Vec<usize>> {
        Ok(self.u32(name)?.into_iter().map(|x| x as usize).collect())
    }

    fn points(&mut self, name: &str) -> Result<Vec<Point>> {
        let count = self
            .shape(name)
            .and_then(|s| s.first().copied())
            .unwrap_or(0);
        let numbers = self.f64(name, &[count, 2])?;
        Ok(numbers.chunks_exact(2).map(|p| [p[0], p[1]]).collect())
    }

    fn topology(&mut self, metadata: &Metadata) -> Result<Topology> {
        let arities = self.u32("faces/arities")?;
        let corners = self.u32("faces/corners")?;
        let mut attributes = Attributes {
            normals: metadata.normals,
            ..Attributes::default()
        };
        if self.shape("texture/coordinates").is_some() {
            let tensor = self.take("texture/coordinates")?;
            let TensorData::F32(uv) = tensor.data else {
                return Err(faulty("texture", "not single-precision numbers"));
            };
            attributes.texture_coordinates = uv.chunks_exact(2).map(|uv| [uv[0], uv[1]]).collect();
            attributes.corner_texture = self.u32("texture/corners")?;
            let known =
                |&c: &u32| c == u32::MAX || (c as usize) < attributes.texture_coordinates.len();
            let whole = attributes.corner_texture.len() == corners.len();
            if !whole || !attributes.corner_texture.iter().all(known) {
                return Err(faulty("texture", "corners without coordinates"));
            }
        }
        for (kind, name, first_face) in &metadata.groups {
            let kind = GROUP_KINDS.iter().find(|(_, known)| known == kind);
            let kind = kind.ok_or_else(|| faulty("groups", kind))?.0;
            attributes.groups.push(Group {
                kind,
                name: name.clone(),
                first_face: *first_face,
            });
        }
        attributes
            .material_libraries
            .clone_from(&metadata.material_libraries);
        let topology =
            Topology::new(metadata.vertices, &arities, corners).map_err(|e| faulty("faces", e))?;
        Ok(topology.with_attributes(attributes))
    }

    /// The space over the faces, of `dimension` coordinates.
    fn space(
        &mut self,
        name: &str,
        topology: &Arc<Topology>,
        dimension: usize,
    ) -> Result<Arc<dyn ShapeSpace>> {
        let state = State {
            name: name.to_string(),
            reference: self.list("space/reference")?,
            patches: self.u32("space/patches")?,
            weights: self.list("space/weights")?,
        };
        if !state.reference.iter().all(|x| x.is_finite()) {
            return Err(faulty("reference pose", "a number is not finite"));
        }
        // The count of vertices is only claimed: something that is here must bear it out.
        let known = [state.reference.len(), dimension];
        if !known.contains(&topology.vertices().saturating_mul(3)) {
            return Err(faulty(
                "shape space",
                "the positions are not those of its vertices",
            ));
        }
        let spaces = Spaces::of_state(Arc::clone(topology), &state);
        let space = spaces.and_then(|spaces| spaces.restore(&state));
        space.map_err(|e| Box::new(Diagnostic::error(format!("the loom's shape space: {e}"))))
    }

    fn pose(&mut self, m: usize) -> Result<PoseSignal> {
        let frame = self.f64("pose/frame", &[3])?;
        let sites = self.points("pose/sites")?;
        let weights = self.f64("pose/weights", &[sites.len(), m])?;
        let affine = self.f64("pose/affine", &[3, m])?;
        let plate = ThinPlate::new(([frame[0], frame[1]], frame[2]), sites, weights, affine);
        let frames = self.indices("pose/site_frames")?;
        plate
            .and_then(|plate| PoseSignal::new(plate, frames))
            .map_err(|e| faulty("pose signal", e))
    }

    fn time(&mut self, warps: usize) -> Result<TimeSignal> {
        let intervals = self.list("time/intervals")?;
        let curve = Curve::new(intervals, self.points("time/controls")?);
        let curve = curve.map_err(|e| faulty("time signal", e))?;
        let (spans, offsets) = (self.indices("time/spans")?, self.list("time/offsets")?);
        let slopes = self.list("time/slopes")?;
        if spans.len() != offsets.len() {
            return Err(faulty("time signal", "spans and offsets differ in number"));
        }
        let place = |(span, offset)| Place { span, offset };
        let places = spans.into_iter().zip(offsets).map(place).collect();
        // Each warp takes an array away: a false count ends at the first that is missing.
        let mut all = Vec::new();
        for i in 0..warps {
            all.push(self.warp(&format!("time/warp/{i}"))?);
        }
        TimeSignal::new(curve, places, slopes, all).map_err(|e| faulty("time signal", e))
    }

    fn warp(&mut self, name: &str) -> Result<Warp> {
        if self
            .tensors
            .get(name)
            .is_some_and(|t| matches!(t.data, TensorData::U32(_)))
        {
            return match self.indices(name)?[..] {
                [frames] => Ok(Warp::Reverse { frames }),
                _ => Err(faulty("time signal", "a reversal without its frames")),
            };
        }
        let count = self
            .shape(name)
            .and_then(|s| s.first().copied())
            .unwrap_or(0);
        let rows = self.f64(name, &[count, 3])?;
        let column = |j: usize| rows.iter().skip(j).step_by(3).copied().collect();
        let keys = Keys::new(column(0), column(1), column(2));
        Ok(Warp::Keys(keys.map_err(|e| faulty("time signal", e))?))
    }

    fn root(&mut self, kind: &str) -> Result<RootSignal> {
        let known = ROOT_KINDS.iter().find(|(_, name)| *name == kind);
        let kind = known.ok_or_else(|| faulty("root motion", kind))?.0;
        let pivot = Vector3::from_column_slice(&self.f64("root/pivot", &[3])?);
        let n = self
            .shape("root/positions")
            .and_then(|s| s.first().copied())
            .unwrap_or(0);
        let turns = self.f64("root/rotations", &[n, 4])?;
        let [positions, spins, slopes] = [
            self.f64("root/positions", &[n, 3])?,
            self.f64("root/spins", &[n, 3])?,
            self.f64("root/slopes", &[n, 3])?,
        ];
        let vector = |all: &[f64], i: usize| Vector3::from_column_slice(&all[3 * i..3 * i + 3]);
        let mut frames = Vec::new();
        for i in 0..n {
            let q = &turns[4 * i..4 * i + 4];
            let q = Quaternion::new(q[0], q[1], q[2], q[3]);
            // Within the rounding of a unit quaternion; kept as it is, to the bit.
            if !(-1e-6..1e-6).contains(&(q.norm() - 1.0)) {
                return Err(faulty(
                    "root motion",
                    format!("frame {} has no rotation", i + 1),
                ));
            }
            frames.push(RootFrame {
                rotation: UnitQuaternion::new_unchecked(q),
                position: vector(&positions, i),
                spin: vector(&spins, i),
                slope: vector(&slopes, i),
            });
        }
        RootSignal::new(kind, pivot, frames).map_err(|e| faulty("root motion", e))
    }

    fn layout(&mut self, m: usize) -> Result<Layout> {
        let positions = self.points("layout/positions")?;
        let coordinates = self.f64("layout/coordinates", &[positions.len(), m])?;
        let residuals = self.f64("layout/residuals", &[positions.len()])?;
        let (pins, pinned) = (self.indices("layout/pins")?, self.points("layout/pinned")?);
        if pins.len() != pinned.len() {
            return Err(faulty(
                "layout",
                "pins and their positions differ in number",
            ));
        }
        let numbers = positions
            .iter()
            .chain(&pinned)
            .flatten()
            .chain(&coordinates)
            .chain(&residuals);
        if !numbers.into_iter().all(|x| x.is_finite()) {
            return Err(faulty("layout", "a number is not finite"));
        }
        Ok(Layout {
            positions,
            coordinates,
            residuals,
            pins: pins.into_iter().zip(pinned).collect(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::test_looms::{ring, travelling};
    use super::*;

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
