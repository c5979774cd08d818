//! psi = h o g o f: a shape space and three signals, fitted, measured, evaluated at any time.

pub mod ch12;
pub mod fidelity;
pub mod fit;
pub mod frames;
pub mod left_out;
pub mod pins;
pub mod report;
pub mod subspace;
pub mod warnings;
