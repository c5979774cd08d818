//! The three signals of CH12 §2 and how each is fitted: shape (h), pose (g), time (f), and root motion.

pub mod pose;
pub mod pose_grid;
pub mod root;
pub mod shape;
pub mod time;
mod time_fit;
pub mod warp;

pub use time_fit::{control_bounds, uniform_design, uniform_intervals, uniform_place};
