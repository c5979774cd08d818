//! Symmetric systems of 3 x 3 blocks: what couples points of space, or rotation vectors, along the links
//! of a graph. The entries are those of a [`Pattern`]; blocks are found once and added to without a search.

use std::sync::Arc;

use nalgebra::Matrix3;

use super::sparse::{Analysis, Pattern, SparseError};

/// The analysed pattern of n x n blocks, with a block for each node and for each link.
#[derive(Debug, Clone)]
pub struct BlockPattern {
    analysis: Arc<Analysis>,
    diagonal: Arc<[Place]>,
    links: Arc<[Place]>,
}

/// Where the block of two nodes stands among the entries.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Place {
    /// Where the lower part of each column starts.
    columns: [u32; 3],
    /// A node with itself: of column c only rows c.. are stored.
    diagonal: bool,
    /// The link's first node is the larger: its block is stored as it is, else transposed.
    upright: bool,
}

impl BlockPattern {
    /// Analyses the blocks of `nodes` nodes and of these links; links may repeat, and join a node to
    /// itself.
    ///
    /// # Errors
    /// The factor would be too large.
    ///
    /// # Panics
    /// A link names a node that is not in 0..`nodes`.
    pub fn new(nodes: usize, links: &[[u32; 2]]) -> Result<Self, SparseError> {
        let own = (0..nodes as u32).map(|node| [node, node]);
        let pairs = own.chain(links.iter().copied());
        let entries = pairs
            .flat_map(|[a, b]| (0..9).map(move |entry| [3 * a + entry / 3, 3 * b + entry % 3]));
        let analysis = Analysis::new(Pattern::new(3 * nodes, entries))?;
        let places = |pairs: &mut dyn Iterator<Item = [u32; 2]>| {
            let found: Option<Arc<[Place]>> = pairs.map(|pair| place(&analysis, pair)).collect();
            found.unwrap_or_default()
        };
        let diagonal = places(&mut (0..nodes as u32).map(|node| [node, node]));
        let links = places(&mut links.iter().copied());
        Ok(BlockPattern {
            diagonal,
            links,
            analysis,
        })
    }

    /// The same pattern and symbolic factor with other links; none when one of them has no block.
    pub fn with_links(&self, links: &[[u32; 2]]) -> Option<Self> {
        let found: Option<Arc<[Place]>> = links
            .iter()
            .map(|&link| place(&self.analysis, link))
            .collect();
        Some(BlockPattern {
            links: found?,
            ..self.clone()
        })
    }

    /// The number of nodes.
    pub fn nodes(&self) -> usize {
        self.diagonal.len()
    }

    /// The pattern with its symbolic factor.
    pub fn analysis(&self) -> &Arc<Analysis> {
        &self.analysis
    }

    /// Adds `block` to that of `node` with itself; only its lower triangle counts.
    pub fn add_node(&self, entries: &mut [f64], node: usize, block: &Matrix3<f64>) {
        add(entries, self.diagonal[node], block);
    }

    /// Adds `block` to that of the nodes of a link: rows belong to its first node, columns to its second.
    /// A link of a node with itself adds the block and its transpose.
    pub fn add_link(&self, entries: &mut [f64], link: usize, block: &Matrix3<f64>) {
        let place = self.links[link];
        match (place.diagonal, place.upright) {
            (true, _) => add(entries, place, &(block + block.transpose())),
            (false, true) => add(entries, place, block),
            (false, false) => add(entries, place, &block.transpose()),
        }
    }

    /// The mean of the diagonal; 1 where that is zero.
    pub fn mean_diagonal(&self, entries: &[f64]) -> f64 {
        let each = |place: &Place| place.columns.map(|at| entries[at as usize]);
        let sum: f64 = self.diagonal.iter().flat_map(each).sum();
        match sum > 0.0 {
            true => sum / (3 * self.nodes()) as f64,
            false => 1.0,
        }
    }

    /// Adds a number to the whole diagonal.
    pub fn shift(&self, entries: &mut [f64], by: f64) {
        for place in self.diagonal.iter() {
            place
                .columns
                .iter()
                .for_each(|&at| entries[at as usize] += by);
        }
    }
}

fn place(analysis: &Analysis, [a, b]: [u32; 2]) -> Option<Place> {
    let (high, low) = (a.max(b) as usize, a.min(b) as usize);
    let column = |c: usize| {
        let first = if a == b { c } else { 0 };
        let entry = analysis.pattern().entry(3 * high + first, 3 * low + c);
        entry.map(|at| at as u32)
    };
    Some(Place {
        columns: [column(0)?, column(1)?, column(2)?],
        diagonal: a == b,
        upright: a >= b,
    })
}

fn add(entries: &mut [f64], place: Place, block: &Matrix3<f64>) {
    for column in 0..3 {
        let first = if place.diagonal { column } else { 0 };
        let start = place.columns[column] as usize;
        for row in first..3 {
            entries[start + row - first] += block[(row, column)];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_land_where_a_dense_matrix_has_them() {
        let links = [[2, 0], [0, 1], [1, 1], [0, 2]];
        let pattern = BlockPattern::new(3, &links).unwrap();
        let block = |seed: usize| Matrix3::from_fn(|i, j| (seed * 9 + 3 * i + j) as f64 * 0.01);
        let mut entries = vec![0.0; pattern.analysis().pattern().entries()];
        let mut dense = nalgebra::DMatrix::zeros(9, 9);
        for node in 0..3 {
            let own = Matrix3::from_diagonal_element(4.0);
            pattern.add_node(&mut entries, node, &own);
            dense.view_mut((3 * node, 3 * node), (3, 3)).copy_from(&own);
        }
        for (link, &[a, b]) in links.iter().enumerate() {
            let block = block(link);
            pattern.add_link(&mut entries, link, &block);
            let (a, b) = (3 * a as usize, 3 * b as usize);
            let mut part = dense.view_mut((a, b), (3, 3));
            part += block;
            let mut part = dense.view_mut((b, a), (3, 3));
            part += block.transpose();
        }
        assert!((pattern.mean_diagonal(&entries) - dense.trace() / 9.0).abs() < 1e-14);
        pattern.shift(&mut entries, 1.0);
        let factor = pattern.analysis().factor(&entries).unwrap();
        let mut side: Vec<f64> = (0..9).map(|i| (i as f64).sin()).collect();
        let wanted = (dense + nalgebra::DMatrix::identity(9, 9))
            .cholesky()
            .unwrap();
        let wanted = wanted.solve(&nalgebra::DVector::from_column_slice(&side));
        factor.solve(1, &mut side);
        // a well-conditioned 9 x 9 system
        assert!(
            side.iter()
                .zip(wanted.iter())
                .all(|(a, b)| (a - b).abs() < 1e-13)
        );
    }
}
