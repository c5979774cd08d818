//! What can be done to a loom: one verb a file, each pure.

pub mod transfer;
