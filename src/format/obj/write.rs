//! Writing: what all frames share is formatted once, the coordinates of each frame as the shortest
//! digits that read back as the same f32.

use std::io::Write;
use std::sync::Arc;

use crate::format::{FrameWriter, shortest};
use crate::mesh::{GroupKind, Topology, vertex_normals};

/// Writes frames of one connectivity.
pub(super) struct ObjWriter {
    topology: Arc<Topology>,
    head: Vec<u8>,
    tail: Vec<u8>,
}

impl ObjWriter {
    pub(super) fn new(topology: &Arc<Topology>, fps: Option<f64>) -> Self {
        ObjWriter {
            topology: Arc::clone(topology),
            head: head(topology, fps),
            tail: tail(topology),
        }
    }
}

impl FrameWriter for ObjWriter {
    fn write(&self, positions: &[f32], out: &mut Vec<u8>) {
        const LONGEST_LINE: usize = "v ".len() + 3 * 17;
        out.clear();
        out.reserve(self.head.len() + self.tail.len() + positions.len() / 3 * LONGEST_LINE);
        out.extend_from_slice(&self.head);
        let mut digits = zmij::Buffer::new();
        for point in positions.chunks_exact(3) {
            out.push(b'v');
            for &value in point {
                out.push(b' ');
                out.extend_from_slice(shortest(&mut digits, value));
            }
            out.push(b'\n');
        }
        if self.topology.attributes().normals {
            normals(&self.topology, positions, out);
        }
        out.extend_from_slice(&self.tail);
    }
}

/// One `vn` a vertex, to six decimals.
fn normals(topology: &Topology, positions: &[f32], out: &mut Vec<u8>) {
    let mut normals = Vec::new();
    let mut digits = zmij::Buffer::new();
    vertex_normals(topology.triangles(), positions, &mut normals);
    for normal in normals {
        out.extend_from_slice(b"vn");
        for value in normal {
            out.push(b' ');
            let value = (value * 1e6).round() / 1e6;
            out.extend_from_slice(shortest(&mut digits, value));
        }
        out.push(b'\n');
    }
}

fn head(topology: &Topology, fps: Option<f64>) -> Vec<u8> {
    let mut head = Vec::new();
    if let Some(fps) = fps {
        let _ = writeln!(head, "# fps {fps}");
    }
    for library in &topology.attributes().material_libraries {
        let _ = writeln!(head, "mtllib {library}");
    }
    head
}

/// Texture coordinates, then the faces with the names that hold for them.
fn tail(topology: &Topology) -> Vec<u8> {
    let attributes = topology.attributes();
    let mut tail = Vec::new();
    for [u, v] in &attributes.texture_coordinates {
        let _ = writeln!(tail, "vt {u} {v}");
    }
    let mut groups = attributes.groups.iter().peekable();
    let mut corner = 0;
    for (face, polygon) in topology.polygons().enumerate() {
        while let Some(group) = groups.next_if(|group| group.first_face <= face) {
            let _ = writeln!(tail, "{} {}", keyword(group.kind), group.name);
        }
        tail.push(b'f');
        for &vertex in polygon {
            let _ = write!(tail, " {}", u64::from(vertex) + 1);
            let texture = attributes.corner_texture.get(corner);
            let texture = texture.filter(|texture| **texture != u32::MAX);
            if let Some(&texture) = texture {
                let _ = write!(tail, "/{}", u64::from(texture) + 1);
            }
            if attributes.normals {
                let between = if texture.is_some() { "/" } else { "//" };
                let _ = write!(tail, "{between}{}", u64::from(vertex) + 1);
            }
            corner += 1;
        }
        tail.push(b'\n');
    }
    tail
}

fn keyword(kind: GroupKind) -> &'static str {
    match kind {
        GroupKind::Object => "o",
        GroupKind::Group => "g",
        GroupKind::Material => "usemtl",
        GroupKind::Smoothing => "s",
    }
}
