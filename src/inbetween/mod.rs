//! Key poses to motion: what lies between a few shapes of one mesh, or between skeletons.
//!
//! [`mod@complete`] runs splines through the keys' coordinates in a shape space (X19); [`isometric`],
//! [`polygon`] and [`skeleton`] keep lengths (IM). [`edge_lengths`] interpolates lengths and finds the shapes
//! that have them (R14); [`conformal`] gives such lengths by one factor a vertex.

pub mod complete;
pub mod conformal;
mod drift;
pub mod edge_lengths;
mod ends;
mod fitting;
pub mod ghost;
pub mod isometric;
pub mod keys;
pub mod motion;
pub mod polygon;
pub mod skeleton;
mod track;

pub use complete::{CompleteOptions, complete};
pub use ends::{Boundary, Velocity};
pub use fitting::Layout;
pub use ghost::{GHOST_FACES, GhostOptions, GhostReport, GhostSize, Lift};
pub use keys::{Keys, SPACING};
pub use motion::{Motion, MotionFrames, MotionReport};

pub use crate::math::key_spline::Handle;
