//! The operations that the command line, recipes and the studio all call, over a World and a Task.

mod complete;
mod deliver;
mod describe;
mod find;
mod frames;
mod held;
mod input;
mod key;
mod key_motion;
mod key_path;
mod key_plane;
mod lanes;
mod loom;
mod memory;
mod morph;
mod names;
mod numbering;
mod open;
mod output;
mod picture;
pub mod plot;
mod poses;
mod request;
mod save;
mod separate;
mod sheet;
mod spaces;
mod statistics;
mod tangents;
mod transfer;
mod value;
mod workbench;

pub use complete::{CompleteRequest, Velocities, complete, motion};
pub use deliver::{deliver, plan_delivery};
pub use describe::{Description, compared, describe};
pub use find::{Listing, files};
pub use input::{FrameRange, InputSpec};
pub use key::{Key, KeyBuilder};
pub use key_motion::{Completion, KeyControls, KeyMotion};
pub use key_path::{KeyPath, key_map, key_path, plot_motion};
pub use loom::{check_loom_output, is_loom, open_loom, save_loom};
pub use memory::{Made, Memory, Remembered};
pub use morph::{
    AlignmentEffect, AlignmentReport, ConformalReport, EdgeReport, EmbeddingReport,
    ImpossibleVertex, JumpReport, MissedEdge, Morph, MorphMethod, MorphPath, MorphReport,
    MorphRequest, SkeletonMorphed, Strain, is_skeleton, morph, morph_frames, morph_skeletons,
    open_skeletons, plan_skeletons, save_skeletons,
};
pub use names::pose_names;
pub use open::{Capture, Content, Origin, open};
pub use output::{Output, Plan, plan};
pub use picture::{PictureFormat, save_picture};
pub use request::FitRequest;
pub use save::{Saved, save};
pub use separate::separate;
pub use sheet::contact_sheet;
pub use spaces::{SpaceReport, best_space, compare_spaces, why as why_best_space};
pub use statistics::{
    Found, ReturnedReport, SAMPLES, Statistics, StatisticsReport, StatisticsRequest,
    add_difference, statistics,
};
pub use tangents::{Side, Tangents};
pub use transfer::open_examples;
pub use value::{
    Frames, Keyed, LoomValue, Picture, Shape, ShapeValue, Source, StatisticsValue, Value,
};
pub use workbench::{Step, Workbench};

pub use crate::edit::transfer::Examples;
pub use crate::edit::{Edit, Sketch};
pub use crate::inbetween::Handle;
pub use crate::sample::Times;
