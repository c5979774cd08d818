//! Numerics that have never heard of a mesh. Deterministic: the same bits on any number of threads.

pub mod b_spline;
pub mod banded;
pub mod banded_cholesky;
pub mod block_sparse;
pub mod columns;
pub mod cubic_spline;
pub mod curve_join;
pub mod direction;
pub mod growing_qr;
pub mod key_spline;
pub mod layout;
pub mod least_squares;
pub mod monotone;
pub mod order_graph;
pub mod ordered;
pub mod pca;
pub mod pivoted_qr;
pub mod rotation;
pub mod rotation_graph;
pub mod sparse;
pub mod symmetric;
pub mod thin_plate;
pub mod uniform_spline;
pub mod variable_projection;
