//! PLY, ascii and binary, little and big endian.
//!
//! Read are the elements `vertex` (x y z of any type; texture coordinates `s t`, `u v` or
//! `texture_u texture_v`; of normals only that they are there) and `face` (the list `vertex_indices` or `vertex_index`; the list `texcoord`);
//! other elements and properties are passed over. A comment `fps 24` gives the frames per second.
//! Written are f32 coordinates, in binary little endian unless asked otherwise; normals anew for every
//! frame if the first one read had any.

mod header;
mod read;
mod scalars;
mod write;

use std::sync::Arc;

use super::{FirstFrame, FrameWriter, MeshFormat, WriteOptions};
use crate::diag::Result;
use crate::mesh::Topology;

/// PLY.
pub struct Ply;

impl MeshFormat for Ply {
    fn read_first(&self, bytes: &[u8], name: &str) -> Result<FirstFrame> {
        read::first(bytes, name)
    }

    fn read_next(&self, bytes: &[u8], first: &FirstFrame, positions: &mut [f32]) -> Result<()> {
        read::next(bytes, first, positions)
    }

    fn writer(&self, topology: &Arc<Topology>, options: WriteOptions) -> Box<dyn FrameWriter> {
        Box::new(write::PlyWriter::new(topology, options))
    }
}
