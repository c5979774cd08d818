//! The pose space as a map: the time signal's curve coloured by time, the frames on it, sites, control
//! points and pins. Both axes have the same unit, for distances in the map are distances of shapes.

mod draw;
mod time_bar;

use std::sync::Arc;

use super::axes::{Plane, bottom_margin, range_of, with_margin};
use super::legend::{Legend, Mark};
use super::scene::{Point, Rect, Scene};
use super::theme::Theme;
use crate::image::Image;
use draw::{Marks, draw_beyond, pixels};
use time_bar::TimeBar;

/// What the map shows; any of the lists may be empty. Points that are not finite are left out.
#[derive(Debug, Clone, Default)]
pub struct PoseSpace {
    /// Points f(t) along the curve, dense enough to look smooth.
    pub curve: Vec<[f64; 2]>,
    /// The times t of these points in frames, growing; as many as points.
    pub times: Vec<f64>,
    /// Positions p_i of the frames 1, 2, ..
    pub frames: Vec<[f64; 2]>,
    /// Where the curve passes the frames, f(i); drawn as a link from p_i where they differ visibly.
    pub reached: Vec<[f64; 2]>,
    /// Sites s_j of the pose signal.
    pub sites: Vec<[f64; 2]>,
    /// Control points f_j of the time signal, in order.
    pub controls: Vec<[f64; 2]>,
    /// Pinned frames, from 1, and their places.
    pub pins: Vec<(usize, [f64; 2])>,
    /// Frames, from 1, that are numbered before all others and drawn larger.
    pub shown: Vec<usize>,
    /// Tangents at a point of the curve: from where to where.
    pub arms: Vec<[[f64; 2]; 2]>,
    /// Points set off from all others, without numbers.
    pub marked: Vec<[f64; 2]>,
    /// Times between which the curve is set off, the first below the second.
    pub span: Option<[f64; 2]>,
    /// Times between which the curve leaves the way of the frames; set off as a warning.
    pub advice: Vec<[f64; 2]>,
    /// Frames, from 1, that had better be pinned, and where; an arrow leads there.
    pub advised: Vec<(usize, [f64; 2])>,
    /// Sentences about the map, for who has room for them.
    pub notes: Vec<String>,
    /// Small pictures behind everything, cut at the frame: where their middles lie, and how wide they are
    /// in data units.
    pub pictures: Vec<([f64; 2], f64, Arc<Image>)>,
    /// Which part of the plane to show: x range, y range. `None` shows everything.
    pub window: Option<[[f64; 2]; 2]>,
    /// What things are called.
    pub names: MapNames,
}

/// What a map calls what it shows: by default a loom's curve and frames.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MapNames {
    /// The curve.
    pub curve: &'static str,
    /// The points that the curve passes.
    pub points: &'static str,
    /// The last of them, which is set off; empty where it is no end of anything.
    pub last: &'static str,
    /// The horizontal axis.
    pub x: String,
    /// The vertical axis.
    pub y: String,
}

impl Default for MapNames {
    fn default() -> Self {
        MapNames {
            curve: "f(t)",
            points: "frames",
            last: "last frame",
            x: "p₁ (layout units)".into(),
            y: "p₂ (layout units)".into(),
        }
    }
}

impl MapNames {
    /// Of key poses and the spline through them.
    #[must_use]
    pub fn keys() -> Self {
        MapNames {
            curve: "spline",
            points: "keys",
            last: "last key",
            x: "p₁ (units of the space)".into(),
            y: "p₂ (units of the space)".into(),
        }
    }
}

/// A site farther from the motion than this share of the motion's box is not framed, for it would make
/// everything else small; an arrow at the edge points to it.
const NEAR: f64 = 0.3;

/// The map in a picture of `width` x `height` pixels, and where its data lies in it. Without any point
/// it shows the unit square; a single point lies in the middle. Legend and colour bar stand outside
/// the data and are left out where there is no room for them.
pub fn pose_space(map: &PoseSpace, width: f32, height: f32, theme: &Theme) -> (Scene, Plane) {
    let mut scene = Scene::new(width, height, theme.background);
    let roomy = width >= 24.0 * theme.text && height >= 18.0 * theme.text;
    let legend = map.legend(theme, if roomy { width - 2.0 * theme.text } else { 0.0 });
    let tall = height - legend.height(theme) - bottom_margin(theme) - 1.0;
    let range = map.time_range().filter(|_| roomy && theme.text > 0.0);
    let bar = range.map(|range| TimeBar::new(range, tall, theme));
    let right = bar
        .as_ref()
        .map_or(1.2 * theme.text + 1.0, |bar| bar.width(theme));
    let top = legend.height(theme).max(0.8 * theme.text + 1.0);
    let room = Rect::new(0.0, top, width - right, height - top);
    let [x, y] = map.window.unwrap_or_else(|| map.ranges());
    let (plane, x, y) = Plane::isometric_in(room, x, y, theme);
    if !map.pictures.is_empty() {
        scene.clipped(plane.area, |scene| map.draw_pictures(scene, &plane));
    }
    plane.draw_grid(&mut scene, theme, &x, &y);
    let beyond = map.sites_beyond(&plane);
    if map.window.is_some() || !beyond.is_empty() || !map.arms.is_empty() {
        scene.clipped(plane.area, |scene| map.draw(scene, &plane, theme));
    } else {
        map.draw(&mut scene, &plane, theme);
    }
    if map.window.is_none() {
        draw_beyond(&mut scene, plane.area, &beyond, theme);
    }
    plane.draw_frame(&mut scene, theme);
    plane.draw_x(&mut scene, theme, &x, &map.names.x);
    plane.draw_y(&mut scene, theme, &y, &map.names.y);
    legend.draw(&mut scene, theme, plane.area.left);
    if let Some(bar) = bar {
        bar.draw(&mut scene, theme, plane.area);
    }
    (scene, plane)
}

impl PoseSpace {
    /// Everything that is always framed: all but the sites.
    fn points(&self) -> impl Iterator<Item = [f64; 2]> + '_ {
        let pins = self.pins.iter().map(|(_, at)| at);
        let lists = [&self.curve, &self.frames, &self.controls, &self.marked];
        let advised = self.advised.iter().map(|(_, at)| at);
        let points = lists.into_iter().flatten().chain(pins);
        points.chain(advised).copied()
    }

    fn time_range(&self) -> Option<[f64; 2]> {
        range_of(self.times.iter().copied()).filter(|range| range[0] < range[1])
    }

    fn legend(&self, theme: &Theme, width: f32) -> Legend {
        let marks = Marks::of(theme);
        let entries = [
            (marks.curve, self.names.curve, self.curve.len() > 1),
            (marks.frame, self.names.points, !self.frames.is_empty()),
            (marks.site, "sites", !self.sites.is_empty()),
            (marks.control, "control points", !self.controls.is_empty()),
            (marks.pin, "pins", !self.pins.is_empty()),
            (marks.advised, "pins advised", !self.advised.is_empty()),
            (marks.end, self.names.last, self.ends()),
            (marks.astray, "off the frames’ way", !self.advice.is_empty()),
        ];
        let present = entries.into_iter().filter(|entry| entry.2);
        let present: Vec<(Mark, &str)> = present.map(|(mark, name, _)| (mark, name)).collect();
        Legend::new(&present, width, theme)
    }

    /// Ranges of everything shown, with a margin for marks; equal centres for lone points.
    #[must_use]
    pub fn ranges(&self) -> [[f64; 2]; 2] {
        let box_of = |points: &[[f64; 2]]| {
            let along = |axis: usize| range_of(points.iter().map(|point| point[axis]));
            Some([along(0)?, along(1)?])
        };
        let mut points: Vec<[f64; 2]> = self.points().collect();
        let Some(motion) = box_of(&points).or_else(|| box_of(&self.sites)) else {
            return [[0.0, 1.0]; 2];
        };
        let near = with_margin(motion, NEAR);
        let inside = |point: &&[f64; 2]| {
            let mut axes = near.iter().zip(point.iter());
            axes.all(|(range, at)| (range[0]..=range[1]).contains(at))
        };
        points.extend(self.sites.iter().filter(inside));
        with_margin(box_of(&points).unwrap_or(motion), 0.06)
    }

    /// Sites outside the plane's area, in pixels.
    fn sites_beyond(&self, plane: &Plane) -> Vec<Point> {
        let mut sites = pixels(plane, &self.sites);
        sites.retain(|at| !plane.area.contains(*at));
        sites
    }
}

#[cfg(test)]
mod tests;
