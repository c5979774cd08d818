//! Arrays and text to a loom: nothing that they claim is trusted.

use std::collections::BTreeMap;
use std::sync::Arc;

use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use serde::Deserialize;

use super::{GROUP_KINDS, Metadata, ROOT_KINDS, Tensor, TensorData, VERSION};
use crate::diag::{Diagnostic, Result};
use crate::loom::{Layout, Loom, Parts, reach};
use crate::math::b_spline::{Curve, Place, Point};
use crate::math::thin_plate::ThinPlate;
use crate::mesh::{Attributes, Group, Topology};
use crate::signal::pose::PoseSignal;
use crate::signal::root::{RootFrame, RootSignal};
use crate::signal::shape::ShapeSignal;
use crate::signal::time::TimeSignal;
use crate::signal::warp::{Keys, Warp};
use crate::space::{ShapeSpace, Spaces, State};

/// The loom of arrays and text.
///
/// # Errors
/// Text that is not a loom's or of a newer version; an array that is missing, of another kind or shape;
/// numbers that are not finite or make frames that are not; parts that do not fit each other.
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
    let loom = Loom::new(Parts {
        fps: fps.first().copied(),
        space,
        shape: Arc::new(shape),
        pose: Arc::new(reader.pose(m)?),
        time: Arc::new(reader.time(metadata.warps)?),
        root,
        layout: Arc::new(reader.layout(m)?),
        report: Arc::new(metadata.report),
        topology,
    })?;
    // What is no number lies in no range.
    if !(0.0..=reach::FARTHEST).contains(&reach::bound(&loom)?) {
        return Err(faulty(
            "signals",
            "their frames lie beyond single precision",
        ));
    }
    Ok(loom)
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
