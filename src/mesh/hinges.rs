//! The edges of a mesh's triangles and the pairs of triangles that meet at them.

use super::VertexCorners;

/// Two triangles that share an edge.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Hinge {
    /// The edge, an index into [`Hinges::edges`].
    pub edge: u32,
    /// The sides of the two triangles at the edge. Side s is that of triangle s / 3 from its corner
    /// s % 3 to the next.
    pub sides: [u32; 2],
}

impl Hinge {
    /// The two triangles.
    pub fn triangles(&self) -> [u32; 2] {
        self.sides.map(|side| side / 3)
    }
}

/// Undirected edges of triangles (the diagonals that cut polygons are edges too) and hinges between
/// triangles. An edge with one triangle has no hinge; one with m has m - 1, between triangles
/// consecutive in order. A side from a vertex to itself is no edge.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Hinges {
    edges: Vec<[u32; 2]>,
    hinges: Vec<Hinge>,
    side_edges: Vec<u32>,
}

/// In [`Hinges::side_edges`]: a side from a vertex to itself.
pub const NO_EDGE: u32 = u32::MAX;

impl Hinges {
    /// Collects edges and hinges, edges ascending by their smaller, then their larger vertex.
    pub fn new(vertices: usize, triangles: &[[u32; 3]], corners: &VertexCorners) -> Self {
        let mut found = Hinges {
            edges: Vec::with_capacity(triangles.len() * 3 / 2),
            hinges: Vec::with_capacity(triangles.len() * 3 / 2),
            side_edges: vec![NO_EDGE; 3 * triangles.len()],
        };
        let mut sides: Vec<(u32, u32)> = Vec::new();
        for vertex in 0..vertices {
            sides.clear();
            for &corner in corners.at(vertex) {
                let (triangle, k) = (corner / 3, corner % 3);
                let points = triangles[triangle as usize];
                let (next, before) = ((k + 1) % 3, (k + 2) % 3);
                sides.push((points[next as usize], corner));
                sides.push((points[before as usize], 3 * triangle + before));
            }
            sides.retain(|(other, _)| *other as usize > vertex);
            sides.sort_unstable();
            for run in sides.chunk_by(|a, b| a.0 == b.0) {
                found.push(vertex as u32, run);
            }
        }
        found
    }

    fn push(&mut self, vertex: u32, run: &[(u32, u32)]) {
        let edge = self.edges.len() as u32;
        self.edges.push([vertex, run[0].0]);
        for (_, side) in run {
            self.side_edges[*side as usize] = edge;
        }
        self.hinges.extend(run.windows(2).map(|pair| Hinge {
            edge,
            sides: [pair[0].1, pair[1].1],
        }));
    }

    /// The two vertices of each edge, the smaller first.
    pub fn edges(&self) -> &[[u32; 2]] {
        &self.edges
    }

    /// The hinges, in the order of their edges.
    pub fn hinges(&self) -> &[Hinge] {
        &self.hinges
    }

    /// The edge of each side (see [`Hinge::sides`]), or [`NO_EDGE`].
    pub fn side_edges(&self) -> &[u32] {
        &self.side_edges
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn hinges(vertices: usize, triangles: &[[u32; 3]]) -> Hinges {
        Hinges::new(
            vertices,
            triangles,
            &VertexCorners::new(vertices, triangles),
        )
    }

    #[test]
    fn a_tetrahedron_has_a_hinge_at_each_edge() {
        let found = hinges(4, &[[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]);
        assert_eq!(
            found.edges(),
            [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]]
        );
        assert_eq!(found.hinges().len(), 6);
        assert_eq!(found.hinges()[0].triangles(), [0, 1]);
        assert!(found.side_edges().iter().all(|&edge| edge != NO_EDGE));
    }

    #[test]
    fn three_triangles_at_an_edge_make_two_hinges() {
        let found = hinges(5, &[[0, 1, 2], [0, 1, 3], [1, 0, 4]]);
        let joined: Vec<_> = found.hinges().iter().map(Hinge::triangles).collect();
        assert_eq!(joined, [[0, 1], [1, 2]]);
    }

    #[test]
    fn a_vertex_named_twice_makes_a_hinge_of_a_triangle_with_itself() {
        let found = hinges(2, &[[0, 0, 1]]);
        assert_eq!(found.edges(), [[0, 1]]);
        assert_eq!(found.side_edges(), [NO_EDGE, 0, 0]);
        assert_eq!(found.hinges()[0].triangles(), [0, 0]);
    }
}
