//! The triangle corners at each vertex.

/// For every vertex the corners that use it. Corner c is corner c % 3 of triangle c / 3; the corners of
/// a vertex ascend. A triangle that names a vertex twice has two corners there.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct VertexCorners {
    starts: Vec<u32>,
    corners: Vec<u32>,
}

impl VertexCorners {
    /// Collects the corners of `triangles` over vertices 0..`vertices`.
    pub fn new(vertices: usize, triangles: &[[u32; 3]]) -> Self {
        let used = triangles.as_flattened();
        let mut starts = vec![0_u32; vertices + 1];
        for &vertex in used {
            starts[vertex as usize + 1] += 1;
        }
        for vertex in 0..vertices {
            starts[vertex + 1] += starts[vertex];
        }
        let mut next = starts.clone();
        let mut corners = vec![0; used.len()];
        for (corner, &vertex) in used.iter().enumerate() {
            let place = &mut next[vertex as usize];
            corners[*place as usize] = corner as u32;
            *place += 1;
        }
        VertexCorners { starts, corners }
    }

    /// The corners at `vertex`.
    pub fn at(&self, vertex: usize) -> &[u32] {
        &self.corners[self.starts[vertex] as usize..self.starts[vertex + 1] as usize]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corners_are_found_from_their_vertices() {
        let corners = VertexCorners::new(5, &[[0, 1, 2], [2, 1, 3], [3, 3, 0]]);
        assert_eq!(corners.at(0), [0, 8]);
        assert_eq!(corners.at(1), [1, 4]);
        assert_eq!(corners.at(3), [5, 6, 7]);
        assert!(corners.at(4).is_empty());
    }
}
