//! Writing PLY: the header and the faces are the same for all frames and formatted once.

use std::io::Write;
use std::sync::Arc;

use crate::format::{Encoding, FrameWriter, WriteOptions, shortest};
use crate::mesh::{Topology, vertex_normals};

/// Writes frames of one connectivity.
pub(super) struct PlyWriter {
    topology: Arc<Topology>,
    encoding: Encoding,
    head: Vec<u8>,
    /// Texture coordinates s t of each vertex; empty if there are none or a vertex has several.
    texture: Vec<[f32; 2]>,
    tail: Vec<u8>,
}

impl PlyWriter {
    pub(super) fn new(topology: &Arc<Topology>, options: WriteOptions) -> Self {
        let texture = vertex_texture(topology).unwrap_or_default();
        let corner_texture = texture.is_empty() && !topology.attributes().corner_texture.is_empty();
        let longest = topology.polygons().map(<[u32]>::len).max().unwrap_or(0);
        let shape = Shape {
            encoding: options.encoding,
            vertex_texture: !texture.is_empty(),
            corner_texture,
            // a list of texture coordinates is twice as long as the polygon
            wide: 2 * longest > usize::from(u8::MAX),
        };
        PlyWriter {
            topology: Arc::clone(topology),
            encoding: options.encoding,
            head: head(topology, options, &shape),
            texture,
            tail: tail(topology, &shape),
        }
    }
}

impl FrameWriter for PlyWriter {
    fn write(&self, positions: &[f32], out: &mut Vec<u8>) {
        out.clear();
        let digits = if self.encoding == Encoding::Ascii {
            17
        } else {
            4
        };
        out.reserve(self.head.len() + self.tail.len() + digits * positions.len());
        out.extend_from_slice(&self.head);
        let mut normals = Vec::new();
        if self.topology.attributes().normals {
            vertex_normals(self.topology.triangles(), positions, &mut normals);
        }
        for (vertex, point) in positions.chunks_exact(3).enumerate() {
            let normal = normals.get(vertex).map_or(&[][..], |normal| &normal[..]);
            let texture = self.texture.get(vertex).map_or(&[][..], |pair| &pair[..]);
            floats(
                out,
                self.encoding,
                point.iter().chain(normal).chain(texture),
            );
            end_line(out, self.encoding);
        }
        out.extend_from_slice(&self.tail);
    }
}

/// Which properties the file has.
struct Shape {
    encoding: Encoding,
    vertex_texture: bool,
    corner_texture: bool,
    wide: bool,
}

/// The texture coordinates of each vertex, if no vertex has two.
fn vertex_texture(topology: &Topology) -> Option<Vec<[f32; 2]>> {
    let attributes = topology.attributes();
    if attributes.corner_texture.is_empty() {
        return None;
    }
    let mut texture = vec![None; topology.vertices()];
    for (&vertex, &corner) in topology.corners().iter().zip(&attributes.corner_texture) {
        let pair = *attributes.texture_coordinates.get(corner as usize)?;
        let known = texture[vertex as usize].get_or_insert(pair);
        if *known != pair {
            return None;
        }
    }
    let or_zero = texture.into_iter().map(Option::unwrap_or_default);
    Some(or_zero.collect())
}

fn head(topology: &Topology, options: WriteOptions, shape: &Shape) -> Vec<u8> {
    let format = match shape.encoding {
        Encoding::Ascii => "ascii",
        Encoding::LittleEndian => "binary_little_endian",
        Encoding::BigEndian => "binary_big_endian",
    };
    let mut head = format!("ply\nformat {format} 1.0\n");
    if let Some(fps) = options.fps {
        head += &format!("comment fps {fps}\n");
    }
    head += &format!("element vertex {}\n", topology.vertices());
    let given = |yes: bool, names: &'static [&str]| if yes { names } else { &[] };
    let normals = given(topology.attributes().normals, &["nx", "ny", "nz"]);
    let texture = given(shape.vertex_texture, &["s", "t"]);
    for name in ["x", "y", "z"].iter().chain(normals).chain(texture) {
        head += &format!("property float {name}\n");
    }
    let count = if shape.wide { "uint" } else { "uchar" };
    head += &format!("element face {}\n", topology.faces());
    head += &format!("property list {count} int vertex_indices\n");
    if shape.corner_texture {
        head += &format!("property list {count} float texcoord\n");
    }
    head += "end_header\n";
    head.into_bytes()
}

fn tail(topology: &Topology, shape: &Shape) -> Vec<u8> {
    let attributes = topology.attributes();
    let mut tail = Vec::new();
    for (face, polygon) in topology.polygons().enumerate() {
        length(&mut tail, shape, polygon.len());
        for &vertex in polygon {
            match shape.encoding {
                Encoding::Ascii => {
                    let _ = write!(tail, "{vertex} ");
                }
                Encoding::LittleEndian => tail.extend_from_slice(&vertex.to_le_bytes()),
                Encoding::BigEndian => tail.extend_from_slice(&vertex.to_be_bytes()),
            }
        }
        if shape.corner_texture {
            let start = topology.offsets()[face] as usize;
            length(&mut tail, shape, 2 * polygon.len());
            for corner in start..start + polygon.len() {
                let texture = attributes.corner_texture[corner] as usize;
                let pair = attributes.texture_coordinates.get(texture);
                let pair = pair.copied().unwrap_or_default();
                floats(&mut tail, shape.encoding, pair.iter());
            }
        }
        end_line(&mut tail, shape.encoding);
    }
    tail
}

fn length(out: &mut Vec<u8>, shape: &Shape, items: usize) {
    match (shape.encoding, shape.wide) {
        (Encoding::Ascii, _) => {
            let _ = write!(out, "{items} ");
        }
        (_, false) => out.push(items as u8),
        (Encoding::LittleEndian, true) => out.extend_from_slice(&(items as u32).to_le_bytes()),
        (Encoding::BigEndian, true) => out.extend_from_slice(&(items as u32).to_be_bytes()),
    }
}

fn floats<'a>(out: &mut Vec<u8>, encoding: Encoding, values: impl Iterator<Item = &'a f32>) {
    let mut digits = zmij::Buffer::new();
    for &value in values {
        match encoding {
            Encoding::Ascii => {
                out.extend_from_slice(shortest(&mut digits, value));
                out.push(b' ');
            }
            Encoding::LittleEndian => out.extend_from_slice(&value.to_le_bytes()),
            Encoding::BigEndian => out.extend_from_slice(&value.to_be_bytes()),
        }
    }
}

/// Text lines end where the last blank stands.
fn end_line(out: &mut [u8], encoding: Encoding) {
    if let (Encoding::Ascii, Some(last)) = (encoding, out.last_mut()) {
        *last = b'\n';
    }
}
