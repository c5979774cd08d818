//! The data of a PLY file: vertices and faces, in whatever order the header has them.

use std::sync::Arc;

use super::header::{Element, Header, Layout, Type};
use super::scalars::Scalars;
use crate::diag::{Diagnostic, Result};
use crate::format::{Encoding, FaceRun, FirstFrame};
use crate::mesh::{Attributes, Topology};

/// See [`super::Ply`].
pub(super) fn first(bytes: &[u8], name: &str) -> Result<FirstFrame> {
    let header = Header::read(bytes)?;
    let mut first = First::default();
    walk(bytes, &header, &mut first)?;
    let vertices = first.positions.len() / 3;
    if vertices == 0 {
        return Diagnostic::error("no vertices").err();
    }
    if first.arities.is_empty() {
        return Diagnostic::error(no_faces(&header))
            .hint("a capture needs faces")
            .err();
    }
    let topology = Topology::new(vertices, &first.arities, first.corners);
    let topology = topology.map_err(|error| {
        let told = Diagnostic::error(error.to_string());
        Box::new(told.hint("PLY counts from 0, this message from 1"))
    })?;
    let mut attributes = attributes(&topology, first.vertex_texture, first.corner_texture);
    attributes.normals = has_normals(&header);
    Ok(FirstFrame {
        name: name.to_string(),
        topology: Arc::new(topology.with_attributes(attributes)),
        positions: first.positions,
        fps: header.fps,
        layout: face_layout(&header),
        runs: vec![FaceRun {
            vertices,
            start: 0,
            faces: first.arities.len(),
            bytes: bytes[first.face_bytes].to_vec(),
        }],
    })
}

/// See [`super::Ply`].
pub(super) fn next(bytes: &[u8], first: &FirstFrame, positions: &mut [f32]) -> Result<()> {
    let header = Header::read(bytes)?;
    let count = |name: &str| {
        let found = header.elements.iter().find(|element| element.name == name);
        found.map_or(0, |element| element.count)
    };
    first.check_counts(count("vertex"), count("face"))?;
    let mut next = Next {
        first,
        positions,
        same_layout: face_layout(&header) == first.layout,
        text: header.encoding == Encoding::Ascii,
    };
    walk(bytes, &header, &mut next)
}

fn no_faces(header: &Header) -> &'static str {
    let strips = header.elements.iter().any(|one| one.name == "tristrips");
    if strips {
        "triangle strips cannot be read"
    } else {
        "no faces"
    }
}

fn has_normals(header: &Header) -> bool {
    let vertex = header.elements.iter().find(|one| one.name == "vertex");
    vertex.is_some_and(|element| element.property(&["nx"]).is_some())
}

/// Whatever must be equal for equal bytes to mean equal faces.
fn face_layout(header: &Header) -> String {
    let face = header.elements.iter().find(|one| one.name == "face");
    let properties = face.map(|element| &element.properties);
    format!("{:?} {properties:?}", header.encoding)
}

/// Texture coordinates of corners go before those of vertices.
fn attributes(
    topology: &Topology,
    vertex_texture: Vec<[f32; 2]>,
    corner_texture: Vec<[f32; 2]>,
) -> Attributes {
    let corners = topology.corners().len();
    let (texture_coordinates, corner_texture) = if corner_texture.len() == corners {
        (corner_texture, (0..corners as u32).collect())
    } else if vertex_texture.is_empty() {
        (Vec::new(), Vec::new())
    } else {
        (vertex_texture, topology.corners().to_vec())
    };
    Attributes {
        texture_coordinates,
        corner_texture,
        ..Attributes::default()
    }
}

/// Takes the elements of a file as they come.
trait Sink {
    /// There will be this many vertices.
    fn vertices(&mut self, count: usize, texture: bool);
    /// Vertex `at` (from 0).
    fn vertex(&mut self, at: usize, position: [f32; 3], texture: Option<[f32; 2]>);
    /// If the faces that start here need not be looked at: how many bytes they are.
    fn skip_faces(&self, rest: &[u8]) -> Option<usize>;
    /// The corners of face `at` (from 0).
    fn face(&mut self, at: usize, corners: &[u32], texture: &[f32]) -> Result<()>;
    /// The faces stood at these bytes.
    fn face_bytes(&mut self, bytes: std::ops::Range<usize>);
}

fn walk(bytes: &[u8], header: &Header, sink: &mut dyn Sink) -> Result<()> {
    let mut data = Scalars {
        bytes,
        at: header.length,
        encoding: header.encoding,
    };
    for element in &header.elements {
        element.check_count(header.encoding, bytes.len() - data.at)?;
        let walked = match element.name.as_str() {
            "vertex" => walk_vertices(element, &mut data, sink),
            "face" => walk_faces(element, &mut data, sink),
            _ => pass_over(element, &mut data),
        };
        walked.map_err(|error| placed(error, &data))?;
    }
    Ok(())
}

/// Adds the line, if the data is text.
fn placed(error: Box<Diagnostic>, data: &Scalars) -> Box<Diagnostic> {
    if data.encoding != Encoding::Ascii {
        return error;
    }
    let breaks = memchr::memchr_iter(b'\n', &data.bytes[..data.at]).count();
    Box::new(error.at_line(breaks + 1))
}

fn pass_over(element: &Element, data: &mut Scalars) -> Result<()> {
    if let (Some(stride), true) = (element.stride(), data.encoding != Encoding::Ascii) {
        return data.advance(stride.saturating_mul(element.count));
    }
    if element.properties.is_empty() {
        return Ok(());
    }
    for _ in 0..element.count {
        for property in &element.properties {
            data.skip(property)?;
        }
    }
    Ok(())
}

/// Which property is which, by its place in the element.
struct VertexPlaces {
    position: [usize; 3],
    texture: Option<[usize; 2]>,
}

impl VertexPlaces {
    fn of(element: &Element) -> Result<Self> {
        let scalar = |names: &[&str]| {
            let at = element.property(names)?;
            matches!(element.properties[at].layout, Layout::Scalar(_)).then_some(at)
        };
        let (Some(x), Some(y), Some(z)) = (scalar(&["x"]), scalar(&["y"]), scalar(&["z"])) else {
            return Diagnostic::error("the vertices have no x, y and z").err();
        };
        let texture = scalar(&["s", "u", "texture_u"]).zip(scalar(&["t", "v", "texture_v"]));
        Ok(VertexPlaces {
            position: [x, y, z],
            texture: texture.map(|(s, t)| [s, t]),
        })
    }
}

fn walk_vertices(element: &Element, data: &mut Scalars, sink: &mut dyn Sink) -> Result<()> {
    let places = VertexPlaces::of(element)?;
    sink.vertices(element.count, places.texture.is_some());
    if let Some(plain) = plain_vertices(element, &places, data)? {
        return plain_positions(&plain, data.encoding, sink);
    }
    for at in 0..element.count {
        let mut position = [0.0; 3];
        let mut texture = [0.0; 2];
        for (place, property) in element.properties.iter().enumerate() {
            let Layout::Scalar(kind) = property.layout else {
                data.skip(property)?;
                continue;
            };
            if let Some(axis) = places.position.iter().position(|&one| one == place) {
                let value = data.coordinate(kind);
                position[axis] = value.map_err(|error| Box::new(error.at_vertex(at + 1)))?;
            } else if let Some(axis) = texture_axis(&places, place) {
                texture[axis] = data.number(kind)? as f32;
            } else {
                data.skip(property)?;
            }
        }
        sink.vertex(at, position, places.texture.map(|_| texture));
    }
    Ok(())
}

fn texture_axis(places: &VertexPlaces, place: usize) -> Option<usize> {
    places.texture?.iter().position(|&one| one == place)
}

/// The bytes of vertices that begin with three f32 x y z in a binary file and have no texture.
struct Plain<'a> {
    bytes: &'a [u8],
    stride: usize,
}

fn plain_vertices<'a>(
    element: &Element,
    places: &VertexPlaces,
    data: &mut Scalars<'a>,
) -> Result<Option<Plain<'a>>> {
    let floats = element.properties.iter().take(3);
    let floats = floats.filter(|one| one.layout == Layout::Scalar(Type::F32));
    let leading = places.position == [0, 1, 2] && floats.count() == 3;
    let stride = element
        .stride()
        .filter(|_| leading && places.texture.is_none() && data.encoding != Encoding::Ascii);
    let Some(stride) = stride else {
        return Ok(None);
    };
    let start = data.at;
    data.advance(stride.saturating_mul(element.count))?;
    let bytes = &data.bytes[start..data.at];
    Ok(Some(Plain { bytes, stride }))
}

fn plain_positions(plain: &Plain, encoding: Encoding, sink: &mut dyn Sink) -> Result<()> {
    let float = |bytes: &[u8]| {
        let bytes: [u8; 4] = bytes.try_into().unwrap_or_default();
        match encoding {
            Encoding::BigEndian => f32::from_be_bytes(bytes),
            _ => f32::from_le_bytes(bytes),
        }
    };
    for (at, vertex) in plain.bytes.chunks_exact(plain.stride).enumerate() {
        let position = [
            float(&vertex[..4]),
            float(&vertex[4..8]),
            float(&vertex[8..12]),
        ];
        if position.iter().any(|value| !value.is_finite()) {
            return Diagnostic::error("a coordinate is not a finite number")
                .at_vertex(at + 1)
                .err();
        }
        sink.vertex(at, position, None);
    }
    Ok(())
}

fn walk_faces(element: &Element, data: &mut Scalars, sink: &mut dyn Sink) -> Result<()> {
    let list = |names: &[&str]| {
        let at = element.property(names)?;
        matches!(element.properties[at].layout, Layout::List { .. }).then_some(at)
    };
    let Some(indices) = list(&["vertex_indices", "vertex_index"]) else {
        return Diagnostic::error("the faces have no list vertex_indices").err();
    };
    let texcoord = list(&["texcoord"]);
    data.skip_blanks();
    let start = data.at;
    if let Some(length) = sink.skip_faces(&data.bytes[start..]) {
        return data.advance(length);
    }
    let (mut corners, mut texture) = (Vec::new(), Vec::new());
    for at in 0..element.count {
        texture.clear();
        for (place, property) in element.properties.iter().enumerate() {
            let read = match property.layout {
                Layout::List { count, item } if place == indices => {
                    corner_list(data, count, item, &mut corners)
                }
                Layout::List { count, item } if Some(place) == texcoord => {
                    float_list(data, count, item, &mut texture)
                }
                _ => data.skip(property),
            };
            read.map_err(|error| Box::new(error.at_face(at + 1)))?;
        }
        sink.face(at, &corners, &texture)?;
    }
    sink.face_bytes(start..data.at);
    Ok(())
}

fn corner_list(data: &mut Scalars, count: Type, item: Type, corners: &mut Vec<u32>) -> Result<()> {
    corners.clear();
    for _ in 0..data.whole(count, "number of corners")? {
        corners.push(data.whole(item, "vertex number")?);
    }
    Ok(())
}

fn float_list(data: &mut Scalars, count: Type, item: Type, values: &mut Vec<f32>) -> Result<()> {
    for _ in 0..data.whole(count, "length of a list")? {
        values.push(data.number(item)? as f32);
    }
    Ok(())
}

#[derive(Default)]
struct First {
    positions: Vec<f32>,
    vertex_texture: Vec<[f32; 2]>,
    arities: Vec<u32>,
    corners: Vec<u32>,
    corner_texture: Vec<[f32; 2]>,
    face_bytes: std::ops::Range<usize>,
}

impl Sink for First {
    fn vertices(&mut self, count: usize, _: bool) {
        self.positions.reserve_exact(3 * count);
    }

    fn vertex(&mut self, _: usize, position: [f32; 3], texture: Option<[f32; 2]>) {
        self.positions.extend(position);
        self.vertex_texture.extend(texture);
    }

    fn skip_faces(&self, _: &[u8]) -> Option<usize> {
        None
    }

    fn face(&mut self, at: usize, corners: &[u32], texture: &[f32]) -> Result<()> {
        if corners.len() < 3 {
            let corners = corners.len();
            return Diagnostic::error(format!("a face with {corners} corners"))
                .at_face(at + 1)
                .err();
        }
        self.arities.push(corners.len() as u32);
        self.corners.extend_from_slice(corners);
        if texture.len() == 2 * corners.len() {
            let pairs = texture.chunks_exact(2).map(|pair| [pair[0], pair[1]]);
            self.corner_texture.extend(pairs);
        }
        Ok(())
    }

    fn face_bytes(&mut self, bytes: std::ops::Range<usize>) {
        self.face_bytes = bytes;
    }
}

struct Next<'a> {
    first: &'a FirstFrame,
    positions: &'a mut [f32],
    same_layout: bool,
    text: bool,
}

impl Sink for Next<'_> {
    fn vertices(&mut self, _: usize, _: bool) {}

    fn vertex(&mut self, at: usize, position: [f32; 3], _: Option<[f32; 2]>) {
        if let Some(target) = self.positions.get_mut(3 * at..3 * at + 3) {
            target.copy_from_slice(&position);
        }
    }

    fn skip_faces(&self, rest: &[u8]) -> Option<usize> {
        let known = &self.first.runs.first()?.bytes;
        let same = self.same_layout && rest.starts_with(known);
        let ends = !self.text || rest.get(known.len()).is_none_or(u8::is_ascii_whitespace);
        (same && ends).then_some(known.len())
    }

    fn face(&mut self, at: usize, corners: &[u32], _: &[f32]) -> Result<()> {
        self.first.check_face(at, corners)
    }

    fn face_bytes(&mut self, _: std::ops::Range<usize>) {}
}
