//! The connected parts of a mesh.

/// Which part each vertex belongs to. Vertices of one triangle are in one part; a vertex without a
/// triangle is a part of its own.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Components {
    part: Vec<u32>,
    first: Vec<u32>,
    sizes: Vec<u32>,
}

impl Components {
    /// Parts are numbered by their lowest vertex.
    pub fn new(vertices: usize, triangles: &[[u32; 3]]) -> Self {
        Components::joined(
            vertices,
            triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c]]),
        )
    }

    /// The parts of any graph over nodes 0..`nodes`: what `links` join is one part.
    pub fn joined(nodes: usize, links: impl Iterator<Item = [u32; 2]>) -> Self {
        let mut parent: Vec<u32> = (0..nodes as u32).collect();
        for [a, b] in links {
            let (a, b) = (root(&mut parent, a), root(&mut parent, b));
            parent[a.max(b) as usize] = a.min(b);
        }
        let mut parts = Components {
            part: vec![0; nodes],
            first: Vec::new(),
            sizes: Vec::new(),
        };
        for node in 0..nodes {
            let root = root(&mut parent, node as u32) as usize;
            if root == node {
                parts.part[node] = parts.first.len() as u32;
                parts.first.push(node as u32);
                parts.sizes.push(0);
            }
            parts.part[node] = parts.part[root];
            parts.sizes[parts.part[node] as usize] += 1;
        }
        parts
    }

    /// How many parts there are.
    pub fn count(&self) -> usize {
        self.first.len()
    }

    /// The part of each vertex.
    pub fn part(&self) -> &[u32] {
        &self.part
    }

    /// The lowest vertex of each part.
    pub fn first(&self) -> &[u32] {
        &self.first
    }

    /// The number of vertices of each part.
    pub fn sizes(&self) -> &[u32] {
        &self.sizes
    }

    /// The part with the most vertices; among equals the first. None without vertices.
    pub fn largest(&self) -> Option<usize> {
        (0..self.count()).rev().max_by_key(|&part| self.sizes[part])
    }
}

/// The node that stands for all joined with `node` (disjoint sets); paths are halved on the way.
pub(super) fn root(parent: &mut [u32], mut node: u32) -> u32 {
    while parent[node as usize] != node {
        parent[node as usize] = parent[parent[node as usize] as usize];
        node = parent[node as usize];
    }
    node
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_are_numbered_by_their_lowest_vertex() {
        let parts = Components::new(9, &[[7, 1, 2], [4, 6, 5], [2, 8, 1]]);
        assert_eq!(parts.part(), [0, 1, 1, 2, 3, 3, 3, 1, 1]);
        assert_eq!(parts.first(), [0, 1, 3, 4]);
        assert_eq!(parts.sizes(), [1, 4, 1, 3]);
        assert_eq!(parts.largest(), Some(1));
        assert_eq!(Components::new(0, &[]).largest(), None);
    }
}
