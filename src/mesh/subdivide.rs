//! Finer copies of a mesh, the same surface.

use super::{FrameSource, Hinges, NO_EDGE, Sequence, Topology, VertexCorners};
use std::sync::Arc;

/// Every triangle cut into four at the middles of its sides, in all frames. New vertices follow the old,
/// edge by edge; polygons become triangles first. A triangle that names a vertex twice stays as it is.
pub fn subdivide(sequence: &Sequence) -> Sequence {
    let topology = sequence.topology();
    let (vertices, triangles) = (topology.vertices(), topology.triangles());
    let corners = VertexCorners::new(vertices, triangles);
    let hinges = Hinges::new(vertices, triangles, &corners);
    let middle = |face: usize, side: usize| match hinges.side_edges()[3 * face + side] {
        NO_EDGE => None,
        edge => Some(vertices as u32 + edge),
    };
    let cut = |(face, &[a, b, c]): (usize, &[u32; 3])| {
        let middles = [0, 1, 2].map(|side| middle(face, side));
        match middles {
            [Some(ab), Some(bc), Some(ca)] => {
                vec![[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
            }
            _ => vec![[a, b, c]],
        }
    };
    let finer: Vec<[u32; 3]> = triangles.iter().enumerate().flat_map(cut).collect();
    let mut positions = Vec::new();
    for frame in 0..sequence.frames() {
        let old = sequence.frame(frame);
        positions.extend_from_slice(old);
        for &[a, b] in hinges.edges() {
            let point = |vertex: u32, axis: usize| old[3 * vertex as usize + axis];
            positions.extend([0, 1, 2].map(|axis| 0.5 * (point(a, axis) + point(b, axis))));
        }
    }
    let all = vertices + hinges.edges().len();
    // vertices that stand in no triangle of more than 2^32 corners are counted by the caller's memory
    let topology = Topology::from_triangles(all, &finer).unwrap_or_else(|_| Topology::points(all));
    Sequence::new(Arc::new(topology), positions, sequence.fps())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_surface_is_the_same_with_four_times_the_triangles() {
        let triangles = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];
        let topology = Arc::new(Topology::from_triangles(4, &triangles).unwrap());
        let points = [0.0, 0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 4.0];
        let fine = subdivide(&Sequence::new(topology, points.to_vec(), None));
        assert_eq!(fine.topology().triangles().len(), 16);
        assert_eq!(fine.topology().vertices(), 4 + 6);
        assert_eq!(&fine.frame(0)[..12], &points);
        let edges = crate::mesh::Edges::new(fine.topology());
        assert!(edges.faces().iter().all(|&count| count == 2));
        assert_eq!(edges.ends().len(), 24);
    }
}
