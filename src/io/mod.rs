//! The disk: [`crate::world::World`] on std::fs, whole files by rename.

mod disk;

pub use disk::Disk;
