//! The disk: [`crate::world::World`] on std::fs, whole files by rename.

mod alive;
mod cache;
mod disk;
mod outbox;
mod watch;

pub use alive::abandon_stages;
pub use cache::Cache;
pub use disk::Disk;
pub use outbox::{Outbox, listing};
pub use watch::{Depth, Wake, Watch};
