//! Series to pictures: a figure is composed as a [`Scene`] (plain primitives in pixels), which
//! [`raster`] fills with tiny-skia and [`svg`] writes as text. Pure: numbers in, pixels or text out.

mod axes;
mod chart;
mod labels;
mod legend;
mod pose_space;
mod raster;
mod scatter;
mod scene;
mod sheet;
mod spectrum;
mod stamp;
mod svg;
mod text;
mod theme;
mod time_signal;

pub use axes::{Axis, Plane, Scale, Tick, Ticks};
pub use chart::{Chart, Panel, Series, Style, chart};
pub use pose_space::{MapNames, PoseSpace, pose_space};
pub use raster::raster;
pub use scatter::{Group, Scatter, scatter};
pub use scene::{Anchor, Color, Item, Label, Path, Point, Rect, Scene, Segment, Stroke};
pub use sheet::sheet;
pub use spectrum::{Spectrum, spectrum};
pub use svg::svg;
pub use text::{CAP_HEIGHT, text_width};
pub use theme::{Theme, Tint};
pub use time_signal::{TimeSignals, time_signals};
