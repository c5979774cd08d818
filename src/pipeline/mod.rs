//! The operations that the command line, recipes and the studio all call, over a World and a Task.

mod frames;
mod input;
mod key;
mod lanes;
mod loom;
mod memory;
mod open;
mod output;
mod picture;
pub mod plot;
mod save;
mod sheet;

pub use input::{FrameRange, InputSpec};
pub use key::{Key, KeyBuilder};
pub use loom::{is_loom, open_loom, save_loom};
pub use memory::{Made, Memory, Remembered};
pub use open::{Capture, Content, Origin, open};
pub use output::{Output, Plan, plan};
pub use picture::{PictureFormat, save_picture};
pub use save::{Saved, save};
pub use sheet::contact_sheet;
