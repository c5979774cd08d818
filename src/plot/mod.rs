//! Series to pictures: a figure is composed as a [`Scene`] (plain primitives in pixels), which
//! [`raster`] fills with tiny-skia and [`svg`] writes as text. Pure: numbers in, pixels or text out.

mod image;
mod raster;
mod scene;
mod svg;
mod text;
mod theme;

pub use image::Image;
pub use raster::raster;
pub use scene::{Anchor, Color, Item, Label, Path, Point, Rect, Scene, Segment, Stroke};
pub use svg::svg;
pub use text::{CAP_HEIGHT, text_width};
pub use theme::Theme;
