//! The first frame: tobj makes the mesh, from a stream in which the order of the file survives.
//!
//! tobj numbers vertices by their first use in a face and leaves unused ones out. So it is given all
//! `v` lines, then one polygon `f 1 2 .. V` that uses each vertex in order, then the faces cut down to
//! their positions; its first face is dropped again. Checks that need a line number, and whatever is
//! only carried along ([`Attributes`]), are done in the pass that writes this stream.

use std::io::Write;
use std::sync::Arc;

use super::statement::{Statements, coordinate, index, words};
use crate::diag::{Diagnostic, Result};
use crate::format::{FaceRun, FirstFrame, nothing_in_it};
use crate::mesh::{Attributes, Group, GroupKind, Topology};

/// See [`super::Obj`].
pub(super) fn read(bytes: &[u8], name: &str) -> Result<FirstFrame> {
    if bytes.is_empty() {
        return nothing_in_it().err();
    }
    let mut scan = Scan::default();
    for statement in Statements::new(bytes, 0) {
        scan.statement(&statement.text, statement.line)
            .map_err(|mut error| {
                error.place.line = Some(statement.line);
                error
            })?;
        scan.follow_run(&statement.text, statement.start, statement.end);
    }
    scan.finish()?;
    let (topology, positions) = mesh(&scan)?;
    let runs = scan.runs.iter().map(|run| run.of(bytes)).collect();
    Ok(FirstFrame {
        name: name.to_string(),
        topology: Arc::new(topology.with_attributes(scan.attributes)),
        positions,
        fps: scan.fps,
        layout: String::new(),
        runs,
    })
}

/// What one pass over the file gathers.
#[derive(Default)]
struct Scan {
    /// `v x y z` of all vertices.
    vertex_lines: Vec<u8>,
    /// `f a b c ..` of all faces, positions only, counted from 1.
    face_lines: Vec<u8>,
    vertices: usize,
    faces: usize,
    /// The highest vertex (from 0) that a face names, and the line of that face.
    highest: (i64, usize),
    /// The same for texture coordinates.
    highest_texture: (i64, usize),
    corner_texture: Vec<u32>,
    attributes: Attributes,
    fps: Option<f64>,
    runs: Vec<Run>,
    open: bool,
}

/// A [`FaceRun`] by its place in the file.
struct Run {
    vertices: usize,
    start: usize,
    faces: usize,
    bytes: std::ops::Range<usize>,
}

impl Run {
    fn of(&self, file: &[u8]) -> FaceRun {
        FaceRun {
            vertices: self.vertices,
            start: self.start,
            faces: self.faces,
            bytes: file[self.bytes.clone()].to_vec(),
        }
    }
}

impl Scan {
    fn statement(&mut self, text: &[u8], line: usize) -> Result<()> {
        let mut words = words(text);
        match words.next() {
            Some(b"v") => self.vertex(words),
            Some(b"vt") => self.texture(words),
            Some(b"vn") => {
                self.attributes.normals = true;
                Ok(())
            }
            Some(b"f") => self.face(words, line),
            Some(b"o") => self.group(GroupKind::Object, text),
            Some(b"g") => self.group(GroupKind::Group, text),
            Some(b"usemtl") => self.group(GroupKind::Material, text),
            Some(b"s") => self.group(GroupKind::Smoothing, text),
            Some(b"mtllib") => {
                self.attributes.material_libraries.push(argument(text));
                Ok(())
            }
            None => {
                self.comment(text);
                Ok(())
            }
            Some(_) => not_text(text),
        }
    }

    fn vertex<'a>(&mut self, mut words: impl Iterator<Item = &'a [u8]>) -> Result<()> {
        self.vertex_lines.push(b'v');
        for _ in 0..3 {
            let word = words.next();
            coordinate(word).map_err(|error| Box::new(error.at_vertex(self.vertices + 1)))?;
            self.vertex_lines.push(b' ');
            self.vertex_lines
                .extend_from_slice(word.unwrap_or_default());
        }
        self.vertex_lines.push(b'\n');
        self.vertices += 1;
        Ok(())
    }

    fn texture<'a>(&mut self, mut words: impl Iterator<Item = &'a [u8]>) -> Result<()> {
        let u = coordinate(words.next())?;
        let v = words
            .next()
            .map_or(Ok(0.0), |word| coordinate(Some(word)))?;
        self.attributes.texture_coordinates.push([u, v]);
        Ok(())
    }

    fn face<'a>(&mut self, words: impl Iterator<Item = &'a [u8]>, line: usize) -> Result<()> {
        let mut corners = 0;
        let textures = self.attributes.texture_coordinates.len();
        let at_face = |mut error: Box<Diagnostic>| {
            error.place.face = Some(self.faces + 1);
            error
        };
        self.face_lines.push(b'f');
        for word in words {
            let mut parts = word.split(|&byte| byte == b'/');
            let vertex = index(parts.next().unwrap_or_default(), self.vertices, "vertex")
                .map_err(at_face)?;
            let texture = match parts.next() {
                Some(part) if !part.is_empty() => {
                    index(part, textures, "texture coordinate").map_err(at_face)?
                }
                _ => i64::from(u32::MAX),
            };
            if vertex > self.highest.0 {
                self.highest = (vertex, line);
            }
            if texture < i64::from(u32::MAX) && texture > self.highest_texture.0 {
                self.highest_texture = (texture, line);
            }
            self.corner_texture
                .push(u32::try_from(texture).unwrap_or(u32::MAX));
            let _ = write!(self.face_lines, " {}", vertex + 1);
            corners += 1;
        }
        self.face_lines.push(b'\n');
        self.faces += 1;
        if corners < 3 {
            return Diagnostic::error(format!("a face with {corners} corners"))
                .at_face(self.faces)
                .hint("the file may be cut short")
                .err();
        }
        Ok(())
    }

    fn group(&mut self, kind: GroupKind, text: &[u8]) -> Result<()> {
        self.attributes.groups.push(Group {
            kind,
            name: argument(text),
            first_face: self.faces,
        });
        Ok(())
    }

    fn comment(&mut self, text: &[u8]) {
        let text = String::from_utf8_lossy(text);
        let fps = text
            .trim()
            .strip_prefix("# fps ")
            .and_then(|fps| fps.trim().parse().ok());
        self.fps = fps
            .filter(|fps: &f64| fps.is_finite() && *fps > 0.0)
            .or(self.fps);
    }

    /// Keeps track of faces that follow each other without vertices between them.
    fn follow_run(&mut self, text: &[u8], start: usize, end: usize) {
        match text.trim_ascii_start() {
            [b'f', b' ' | b'\t', ..] if self.open => {
                if let Some(run) = self.runs.last_mut() {
                    run.faces += 1;
                    run.bytes.end = end;
                }
            }
            [b'f', b' ' | b'\t', ..] => {
                self.open = true;
                self.runs.push(Run {
                    vertices: self.vertices,
                    start: self.faces - 1,
                    faces: 1,
                    bytes: start..end,
                });
            }
            [b'v', ..] => self.open = false,
            _ => {}
        }
    }

    /// What can only be told at the end of the file.
    fn finish(&mut self) -> Result<()> {
        if self.vertices == 0 {
            return Diagnostic::error("no vertices")
                .hint("is this an OBJ file?")
                .err();
        }
        if self.faces == 0 {
            return Diagnostic::error(format!("{} vertices, but no faces", self.vertices))
                .hint("the file may be cut short")
                .err();
        }
        let textures = self.attributes.texture_coordinates.len();
        out_of_range("vertex", self.highest, self.vertices)?;
        out_of_range("texture coordinate", self.highest_texture, textures)?;
        if self.corner_texture.iter().any(|&corner| corner != u32::MAX) {
            self.attributes.corner_texture = std::mem::take(&mut self.corner_texture);
        }
        Ok(())
    }
}

fn out_of_range(what: &str, (highest, line): (i64, usize), count: usize) -> Result<()> {
    if line == 0 || highest < count as i64 {
        return Ok(());
    }
    Diagnostic::error(format!(
        "a face names {what} {}, but there are {count}",
        highest + 1
    ))
    .at_line(line)
    .hint("the file may be cut short")
    .err()
}

/// Everything after the first word.
fn argument(text: &[u8]) -> String {
    let text = String::from_utf8_lossy(text.trim_ascii());
    let rest = text.split_once(|letter: char| letter.is_ascii_whitespace());
    rest.map_or_else(String::new, |(_, rest)| rest.trim().to_string())
}

/// Statements that are not known are passed over, bytes that are no text are refused.
fn not_text(text: &[u8]) -> Result<()> {
    if text.contains(&0) {
        return Diagnostic::error("not an OBJ file: it holds bytes that are no text")
            .hint("check the ending of the file")
            .err();
    }
    Ok(())
}

/// tobj's mesh of the rewritten stream.
fn mesh(scan: &Scan) -> Result<(Topology, Vec<f32>)> {
    let mut stream =
        Vec::with_capacity(scan.vertex_lines.len() + scan.face_lines.len() + 8 * scan.vertices);
    stream.extend_from_slice(&scan.vertex_lines);
    stream.push(b'f');
    for vertex in 1..=scan.vertices {
        let _ = write!(stream, " {vertex}");
    }
    stream.push(b'\n');
    stream.extend_from_slice(&scan.face_lines);
    let options = tobj::LoadOptions::default();
    let loaded = tobj::load_obj_buf(&mut stream.as_slice(), &options, |_| {
        Ok((Vec::new(), Default::default()))
    });
    let mesh = match loaded {
        Ok((models, _)) => models.into_iter().next().map(|model| model.mesh),
        Err(error) => return Diagnostic::error(format!("not an OBJ file: {error}")).err(),
    };
    let mut mesh = mesh.unwrap_or_default();
    let arities = match mesh.face_arities.as_slice() {
        [] => vec![3; (mesh.indices.len() / 3).saturating_sub(1)],
        [_, faces @ ..] => faces.to_vec(),
    };
    let corners = mesh
        .indices
        .split_off(scan.vertices.min(mesh.indices.len()));
    let topology = Topology::new(scan.vertices, &arities, corners);
    let topology = topology.map_err(|error| Box::new(Diagnostic::error(error.to_string())))?;
    Ok((topology, mesh.positions))
}
