//! Meshloom: deforming mesh sequences as three small editable signals.
//!
//! ```text
//! time t --f--> pose space R^2 --g--> shape subspace R^m --h--> shape space S --decode--> mesh
//!         B-spline        thin-plate spline         mean + basis           (five spaces)
//! ```
//!
//! psi = h o g o f is a *loom*. The modules below stand in reading order, from what everything else
//! speaks in, through the mathematics, to the people at the terminal. Each may import only what
//! `tests/architecture.rs` lists for it; that table is the map.
//!
//! # Invariants, mostly absences
//!
//! - `math` has never heard of a mesh, `signal` of a vertex, `space` of time.
//! - `format` sees bytes and never a path; only `io` touches the disk.
//! - `loom` knows no edit, no script, no file format.
//! - nothing below `cli` and `tui` knows a terminal, a clock, an environment variable or `println!`.
//! - errors a user can cause are [`diag::Diagnostic`]s with a place and a hint; nothing panics on input.
//! - long work takes a [`task::Task`]: it can be cancelled and reports its phases, without a clock.
//! - results do not depend on the number of threads: sums are taken in a fixed order.
//! - frames are counted from 1 for people (messages, recipes, time t in \[1, n\]) and from 0 in arrays.

pub mod diag;
pub mod image;
pub mod task;
pub mod world;

pub mod edit;
pub mod inbetween;
pub mod loom;
pub mod math;
pub mod mesh;
pub mod metric;
pub mod sample;
pub mod signal;
pub mod space;
pub mod statistics;

pub mod demo;
pub mod format;
pub mod plot;
pub mod view;

pub mod cli;
pub mod inbox;
pub mod io;
pub mod pipeline;
pub mod recipe;
pub mod script;
pub mod tui;
