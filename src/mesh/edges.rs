//! The edges of a topology's polygons, and what can be read off them: its borders and its parts.

use super::Topology;
use super::components::root;

/// The undirected edges of all polygons, each once.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Edges {
    ends: Vec<[u32; 2]>,
    faces: Vec<u32>,
}

impl Edges {
    /// Collects the sides of the polygons. A side from a vertex to itself is no edge; a side that a
    /// polygon walks twice counts twice.
    pub fn new(topology: &Topology) -> Self {
        let mut sides: Vec<[u32; 2]> = topology
            .polygons()
            .flat_map(|polygon| {
                let next = polygon.iter().cycle().skip(1);
                polygon
                    .iter()
                    .zip(next)
                    .map(|(&a, &b)| [a.min(b), a.max(b)])
            })
            .filter(|[a, b]| a != b)
            .collect();
        sides.sort_unstable();
        let runs = || sides.chunk_by(|a, b| a == b);
        Edges {
            ends: runs().map(|run| run[0]).collect(),
            faces: runs().map(|run| run.len() as u32).collect(),
        }
    }

    /// The two vertices of each edge, the smaller first, in ascending order.
    pub fn ends(&self) -> &[[u32; 2]] {
        &self.ends
    }

    /// How many polygons lie at each edge: 1 on a border, 2 inside, more where the mesh is not a
    /// manifold.
    pub fn faces(&self) -> &[u32] {
        &self.faces
    }

    /// How many edges have one polygon only.
    pub fn boundary(&self) -> usize {
        self.faces.iter().filter(|&&faces| faces == 1).count()
    }

    /// How many connected parts the edges form; vertices without an edge belong to none.
    pub fn components(&self) -> usize {
        let vertices = self.ends.iter().map(|[_, b]| *b as usize + 1).max();
        let mut parent: Vec<u32> = (0..vertices.unwrap_or(0) as u32).collect();
        let mut joins = 0;
        for &[a, b] in &self.ends {
            let (a, b) = (root(&mut parent, a), root(&mut parent, b));
            if a != b {
                parent[a.max(b) as usize] = a.min(b);
                joins += 1;
            }
        }
        let mut used = vec![false; parent.len()];
        for &vertex in self.ends.as_flattened() {
            used[vertex as usize] = true;
        }
        used.iter().filter(|used| **used).count() - joins
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn edges(vertices: usize, arities: &[u32], corners: &[u32]) -> Edges {
        Edges::new(&Topology::new(vertices, arities, corners.to_vec()).unwrap())
    }

    #[test]
    fn a_cube_is_closed_and_satisfies_euler() {
        let corners = [
            0, 1, 2, 3, 7, 6, 5, 4, 0, 4, 5, 1, 1, 5, 6, 2, 2, 6, 7, 3, 3, 7, 4, 0,
        ];
        let cube = edges(8, &[4; 6], &corners);
        assert_eq!(8 + 6, cube.ends().len() + 2);
        assert_eq!((cube.boundary(), cube.components()), (0, 1));
    }

    #[test]
    fn parts_and_borders_are_counted_without_loose_vertices() {
        let two = edges(9, &[3, 4], &[0, 1, 2, 4, 5, 6, 7]);
        assert_eq!((two.boundary(), two.components()), (7, 2));
        let none = edges(3, &[], &[]);
        assert_eq!((none.ends().len(), none.components()), (0, 0));
    }

    #[test]
    fn a_fan_of_three_faces_shares_one_edge() {
        let fan = edges(5, &[3; 3], &[0, 1, 2, 0, 1, 3, 0, 1, 4]);
        assert_eq!(fan.faces()[0], 3);
        assert_eq!(fan.boundary(), 6);
    }

    #[test]
    fn a_degenerate_side_is_no_edge() {
        assert_eq!(edges(2, &[3], &[0, 0, 1]).ends(), [[0, 1]]);
    }
}
