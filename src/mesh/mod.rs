//! One topology, many positions. Connectivity is held once ([`Topology`]); a shape is a slice of 3V
//! coordinates, x y z interleaved, in the units of the file it came from.

mod bounds;
pub mod collapse;
mod components;
mod corners;
pub mod dihedral;
mod dual_tree;
mod edges;
mod gradients;
mod hinges;
mod normals;
mod patches;
mod poisson;
mod polar_block;
pub mod rigid_align;
mod sequence;
mod skeleton;
mod subdivide;
mod topology;
mod torn;

pub use bounds::Bounds;
pub use components::Components;
pub use corners::VertexCorners;
pub use dual_tree::{Cost, DualTree, Step, dual_trees};
pub use edges::Edges;
pub use gradients::{Polar, ReferenceTriangle, stretch_in_space};
pub use hinges::{Hinge, Hinges, NO_EDGE};
pub use normals::{unit_vector, vertex_normals};
pub use patches::{grow_patches, usual_patches};
pub use poisson::{Poisson, PoissonAnalysis, reference_triangles};
pub use polar_block::PolarBlock;
pub use sequence::{FrameSource, Sequence};
pub use skeleton::{Joint, Mismatch, Skeleton, SkeletonError, SkeletonPoses};
pub use subdivide::subdivide;
pub use topology::{Attributes, Group, GroupKind, Topology, TopologyError};
pub use torn::torn;
