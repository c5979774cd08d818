//! A loom to its arrays and text.

use std::sync::Arc;

use nalgebra::Vector3;

use super::{GROUP_KINDS, Metadata, ROOT_KINDS, Tensor, TensorData, VERSION};
use crate::loom::{Layout, Loom};
use crate::math::b_spline::Point;
use crate::mesh::{Group, Topology};
use crate::signal::pose::PoseSignal;
use crate::signal::root::{RootFrame, RootSignal};
use crate::signal::time::TimeSignal;
use crate::signal::warp::Warp;
use crate::space::State;

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
