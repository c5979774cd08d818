//! Wavefront OBJ. Vertices keep the order of the file, polygons stay polygons; texture coordinates,
//! objects, groups, materials and smoothing of the first frame are kept and written again.
//!
//! Read are `v` (x y z; a weight or a colour after them is dropped), `vt`, `vn` (only that there are
//! normals: they are computed anew for every frame that is written), `f`, `o`, `g`, `usemtl`, `s`,
//! `mtllib` and a comment `# fps 24`; other statements (lines, curves) are passed over. A number of
//! frames per second is written as that comment.

mod first;
mod next;
mod statement;
mod write;

use std::sync::Arc;

use super::{FirstFrame, FrameWriter, MeshFormat, WriteOptions};
use crate::diag::Result;
use crate::mesh::Topology;

/// Wavefront OBJ.
pub struct Obj;

impl MeshFormat for Obj {
    fn read_first(&self, bytes: &[u8], name: &str) -> Result<FirstFrame> {
        first::read(bytes, name)
    }

    fn read_next(&self, bytes: &[u8], first: &FirstFrame, positions: &mut [f32]) -> Result<()> {
        next::read(bytes, first, positions)
    }

    fn writer(&self, topology: &Arc<Topology>, options: WriteOptions) -> Box<dyn FrameWriter> {
        Box::new(write::ObjWriter::new(topology, options.fps))
    }
}
