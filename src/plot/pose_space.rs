//! The pose space as a map: the time signal's curve coloured by time, the frames on it, sites, control
//! points and pins. Both axes have the same unit, for distances in the map are distances of shapes.

use std::sync::Arc;

use super::axes::{Axis, Plane, Ticks, bottom_margin, nice_step, range_of, with_margin};
use super::labels::Labels;
use super::legend::{Legend, Mark, arrow};
use super::scene::{Path, Point, Rect, Scene, Stroke};
use super::text::CAP_HEIGHT;
use super::theme::Theme;
use super::{Anchor, Color, Item, Scale};
use crate::image::Image;

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

/// Most numbered frames on a map, besides pins and shown frames.
const MOST_NUMBERS: f64 = 12.0;

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

    fn draw(&self, scene: &mut Scene, plane: &Plane, theme: &Theme) {
        let marks = Marks::of(theme);
        self.draw_controls(scene, plane, theme);
        let steps = self.steps(plane);
        self.draw_curve(scene, &steps, theme);
        self.draw_links(scene, plane, theme);
        draw_all(scene, plane, theme, marks.site, &self.sites);
        self.draw_dots(scene, plane, theme);
        self.draw_arrows(scene, &steps, theme);
        self.draw_marked(scene, plane, theme);
        self.draw_arms(scene, plane, theme);
        for (_, at) in self.pins.iter().filter(|(_, at)| finite(at)) {
            marks.pin.draw(scene, theme, plane.pixel(*at));
        }
        self.draw_advised(scene, plane, theme);
        self.draw_numbers(scene, plane, theme);
    }

    fn draw_pictures(&self, scene: &mut Scene, plane: &Plane) {
        for (at, wide, image) in self.pictures.iter().filter(|(at, ..)| finite(at)) {
            let low = plane.pixel([at[0] - 0.5 * wide, at[1]]);
            let high = plane.pixel([at[0] + 0.5 * wide, at[1]]);
            let width = high[0] - low[0];
            let tall = width * image.height as f32 / image.width.max(1) as f32;
            scene.items.push(Item::Picture {
                rect: Rect::new(low[0], low[1] - 0.5 * tall, width, tall),
                image: image.clone(),
            });
        }
    }

    fn draw_controls(&self, scene: &mut Scene, plane: &Plane, theme: &Theme) {
        let mark = Marks::of(theme).control;
        let color = theme.series[1].with_alpha(0.7);
        let stroke = Stroke::new(color, 0.9 * theme.unit());
        let corners = pixels(plane, &self.controls);
        let dashed = stroke.dashed(3.0 * theme.unit(), 2.5 * theme.unit());
        scene.stroke(Path::polyline(&corners), dashed);
        corners.iter().for_each(|&at| mark.draw(scene, theme, at));
    }

    /// The curve in pixels with its times, in steps that can be seen.
    fn steps(&self, plane: &Plane) -> Vec<(Point, f64)> {
        let both = self.curve.iter().zip(&self.times);
        let finite = both.filter(|(at, _)| finite(at));
        let mut steps: Vec<_> = finite.map(|(at, &t)| (plane.pixel(*at), t)).collect();
        steps.dedup_by(|next, kept| distance(next.0, kept.0) < 0.8);
        steps
    }

    /// The colour of a time on this map.
    fn colors(&self, theme: &Theme) -> impl Fn(f64) -> Color {
        let [first, last] = self.time_range().unwrap_or([0.0, 1.0]);
        move |t| theme.time((t - first) / (last - first))
    }

    fn draw_curve(&self, scene: &mut Scene, steps: &[(Point, f64)], theme: &Theme) {
        if let Some([from, to]) = self.span {
            let inside = steps.iter().filter(|(_, t)| (from..=to).contains(t));
            let inside: Vec<Point> = inside.map(|(at, _)| *at).collect();
            let wide = Stroke::new(theme.ink.with_alpha(0.85), 6.5 * theme.unit());
            scene.stroke(Path::polyline(&inside), wide);
        }
        for [from, to] in &self.advice {
            let inside = steps.iter().filter(|(_, t)| (from..=to).contains(&t));
            let inside: Vec<Point> = inside.map(|(at, _)| *at).collect();
            let wide = Stroke::new(theme.warning(), 8.0 * theme.unit());
            scene.stroke(Path::polyline(&inside), wide);
        }
        let color = self.colors(theme);
        scene.items.push(Item::Curve {
            points: steps.iter().map(|(at, _)| *at).collect(),
            colors: steps.iter().map(|(_, t)| color(*t)).collect(),
            width: 2.2 * theme.unit(),
        });
    }

    /// From a frame to where it had better be pinned.
    fn draw_advised(&self, scene: &mut Scene, plane: &Plane, theme: &Theme) {
        let mark = Marks::of(theme).advised;
        let stroke = Stroke::new(theme.warning(), 1.2 * theme.unit());
        for &(frame, at) in &self.advised {
            let Some(from) = self.place(frame).filter(|_| finite(&at)) else {
                continue;
            };
            let ends = [plane.pixel(from), plane.pixel(at)];
            let dashed = stroke.dashed(4.0 * theme.unit(), 3.0 * theme.unit());
            scene.stroke(Path::polyline(&ends), dashed);
            mark.draw(scene, theme, ends[1]);
        }
    }

    /// A line and a square at its end.
    fn draw_arms(&self, scene: &mut Scene, plane: &Plane, theme: &Theme) {
        let (unit, colour) = (theme.unit(), theme.series[3]);
        for ends in self.arms.iter().filter(|ends| ends.iter().all(finite)) {
            let [from, to] = ends.map(|at| plane.pixel(at));
            scene.line(from, to, Stroke::new(colour, 1.6 * unit));
            let rim = Stroke::new(theme.background, unit);
            scene.ring(to, 3.6 * unit, Some(colour), rim);
        }
    }

    fn draw_arrows(&self, scene: &mut Scene, steps: &[(Point, f64)], theme: &Theme) {
        let points: Vec<Point> = steps.iter().map(|(at, _)| *at).collect();
        let color = self.colors(theme);
        for (i, at, direction) in arrows(&points, theme) {
            arrow(scene, at, direction, color(steps[i].1), theme);
        }
    }

    fn draw_links(&self, scene: &mut Scene, plane: &Plane, theme: &Theme) {
        let stroke = Stroke::new(theme.muted, 0.8 * theme.unit());
        let pairs = self.frames.iter().zip(&self.reached);
        for (from, to) in pairs.filter(|(from, to)| finite(from) && finite(to)) {
            let (from, to) = (plane.pixel(*from), plane.pixel(*to));
            if (from[0] - to[0]).hypot(from[1] - to[1]) > 1.5 * theme.unit() {
                scene.line(from, to, stroke);
            }
        }
    }

    /// Shown frames, marked points, and the last frame.
    fn draw_marked(&self, scene: &mut Scene, plane: &Plane, theme: &Theme) {
        let marks = Marks::of(theme);
        let shown = self.shown.iter().filter_map(|&frame| self.place(frame));
        let marked = self.marked.iter().filter(|at| finite(at)).copied();
        for at in shown.chain(marked) {
            let rim = Stroke::new(theme.background, theme.unit());
            scene.ring(
                plane.pixel(at),
                4.4 * theme.unit(),
                Some(theme.series[1]),
                rim,
            );
        }
        if let (true, Some(&last)) = (self.ends(), self.frames.last()) {
            draw_all(scene, plane, theme, marks.end, &[last]);
        }
    }

    /// Whether the last frame is an end.
    fn ends(&self) -> bool {
        self.frames.len() > 1 && !self.names.last.is_empty()
    }

    /// A dot each frame, all rims below all dots; smaller where they stand close.
    fn draw_dots(&self, scene: &mut Scene, plane: &Plane, theme: &Theme) {
        let (unit, places) = (theme.unit(), pixels(plane, &self.frames));
        let mut gaps: Vec<f32> = places
            .windows(2)
            .map(|pair| distance(pair[0], pair[1]))
            .collect();
        gaps.sort_by(f32::total_cmp);
        let gap = gaps.get(gaps.len() / 2).copied().unwrap_or(f32::INFINITY);
        let radius = (0.2 * gap).clamp(1.2 * unit, 2.4 * unit);
        for &at in &places {
            scene.disc(at, 1.33 * radius, theme.background);
        }
        for &at in &places {
            scene.disc(at, radius, theme.ink);
        }
    }

    /// Place of a frame counted from 1.
    fn place(&self, frame: usize) -> Option<[f64; 2]> {
        let at = self.frames.get(frame.checked_sub(1)?)?;
        finite(at).then_some(*at)
    }

    /// Numbers frames: pins and shown ones, the first and the last, then every few.
    fn draw_numbers(&self, scene: &mut Scene, plane: &Plane, theme: &Theme) {
        let unit = theme.unit();
        let mut obstacles = spaced(pixels(plane, &self.curve), 3.0 * unit);
        for [x, y] in pixels(plane, &self.frames) {
            let reach = 3.5 * unit; // a dot is an obstacle of some size
            let around = [
                [x - reach, y],
                [x + reach, y],
                [x, y - reach],
                [x, y + reach],
            ];
            obstacles.extend(around);
        }
        let mut labels = Labels::new(plane.area, obstacles);
        for frame in self.numbered() {
            if let Some(at) = self.place(frame) {
                let place = (plane.pixel(at), 7.5 * unit);
                labels.write(scene, theme, place, (&frame.to_string(), theme.ink));
            }
        }
    }

    /// Frames to number, the most important first, none twice.
    fn numbered(&self) -> Vec<usize> {
        let count = self.frames.len();
        let step = nice_step((count as f64 / MOST_NUMBERS).max(1.0)) as usize;
        let pins = self.advised.iter().chain(&self.pins);
        let pinned = pins.map(|(frame, _)| *frame);
        let ends = [1, count];
        let every = (step..count).step_by(step.max(1));
        let all = pinned
            .chain(self.shown.iter().copied())
            .chain(ends)
            .chain(every);
        let mut order: Vec<usize> = Vec::new();
        for frame in all {
            if !order.contains(&frame) {
                order.push(frame);
            }
        }
        order
    }
}

/// The marks of the map.
struct Marks {
    curve: Mark,
    frame: Mark,
    site: Mark,
    control: Mark,
    pin: Mark,
    advised: Mark,
    end: Mark,
    astray: Mark,
}

impl Marks {
    fn of(theme: &Theme) -> Self {
        Marks {
            curve: Mark::TimeLine,
            frame: Mark::Dot(theme.ink),
            site: Mark::Ring(theme.series[0]),
            control: Mark::Polygon(theme.series[1]),
            pin: Mark::Diamond(theme.series[3]),
            advised: Mark::Diamond(theme.warning()),
            end: Mark::Square(theme.ink),
            astray: Mark::Line(theme.warning()),
        }
    }
}

fn finite(point: &[f64; 2]) -> bool {
    point.iter().all(|value| value.is_finite())
}

fn pixels(plane: &Plane, points: &[[f64; 2]]) -> Vec<Point> {
    let finite = points.iter().filter(|point| finite(point));
    finite.map(|point| plane.pixel(*point)).collect()
}

fn draw_all(scene: &mut Scene, plane: &Plane, theme: &Theme, mark: Mark, points: &[[f64; 2]]) {
    let places = pixels(plane, points);
    if let Mark::Dot(_) = mark {
        let rim = 3.2 * theme.unit(); // all rims below all dots
        places
            .iter()
            .for_each(|&at| scene.disc(at, rim, theme.background));
    }
    places.iter().for_each(|&at| mark.draw(scene, theme, at));
}

/// Arrows just inside the edge of `area`, each towards a site beyond it.
fn draw_beyond(scene: &mut Scene, area: Rect, beyond: &[Point], theme: &Theme) {
    let middle = [area.left + 0.5 * area.width, area.top + 0.5 * area.height];
    let inset = 6.0 * theme.unit();
    let reach = [area.width, area.height].map(|size| (0.5 * size - inset).max(0.0));
    for site in beyond {
        let way = [site[0] - middle[0], site[1] - middle[1]];
        let share = (reach[0] / way[0].abs()).min(reach[1] / way[1].abs());
        let at = [middle[0] + share * way[0], middle[1] + share * way[1]];
        let length = way[0].hypot(way[1]);
        let direction = [way[0] / length, way[1] / length];
        arrow(scene, at, direction, theme.series[0], theme);
    }
}

/// Points of a dense row that lie at least `gap` from the last one kept.
fn spaced(mut points: Vec<Point>, gap: f32) -> Vec<Point> {
    points.dedup_by(|next, kept| distance(*next, *kept) < gap);
    points
}

/// Arrowheads at even distances along a polyline, away from its ends: index of the segment, place,
/// direction.
fn arrows(points: &[Point], theme: &Theme) -> Vec<(usize, Point, Point)> {
    let lengths = points.windows(2).map(|ends| distance(ends[0], ends[1]));
    let total: f32 = lengths.sum();
    let spacing = 110.0 * theme.unit();
    let wanted = (total / spacing).round().min(9.0);
    let mut found = Vec::new();
    let mut walked = 0.0;
    for (i, ends) in points.windows(2).enumerate() {
        let length = distance(ends[0], ends[1]);
        let next = (found.len() as f32 + 0.5) * total / wanted;
        if length > 0.0 && walked + length > next && (found.len() as f32) < wanted {
            let share = (next - walked) / length;
            let [dx, dy] = [ends[1][0] - ends[0][0], ends[1][1] - ends[0][1]];
            let at = [ends[0][0] + share * dx, ends[0][1] + share * dy];
            found.push((i, at, [dx / length, dy / length]));
        }
        walked += length;
    }
    found
}

fn distance(a: Point, b: Point) -> f32 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

/// The colours of time and their numbers, right of the data.
struct TimeBar {
    axis: Axis,
    ticks: Ticks,
}

impl TimeBar {
    fn new(range: [f64; 2], height: f32, theme: &Theme) -> Self {
        let axis = Axis {
            range,
            pixels: [height, 0.0],
            scale: Scale::Linear,
        };
        let ticks = axis.fitting(height, 2.6, Some(1.3), theme);
        TimeBar { axis, ticks }
    }

    /// Space that it takes beside the data.
    fn width(&self, theme: &Theme) -> f32 {
        self.ticks.width(theme.text) + 3.9 * theme.text
    }

    fn draw(&self, scene: &mut Scene, theme: &Theme, area: Rect) {
        let size = theme.text;
        let bar = Rect::new(area.right() + 0.9 * size, area.top, 0.8 * size, area.height);
        scene.items.push(Item::Ramp {
            rect: bar,
            colors: (0..=32).map(|i| theme.time(f64::from(i) / 32.0)).collect(),
        });
        let left = bar.right() + 0.35 * size;
        for tick in &self.ticks.marks {
            let at = area.top + self.axis.pixel(tick.value) + 0.5 * CAP_HEIGHT * size;
            scene.write(&tick.text, [left, at], Anchor::Start, theme);
        }
        let name = left + self.ticks.width(size) + 1.15 * size;
        let middle = 0.5 * (bar.top + bar.bottom());
        scene.write_upward("t (frames)", [name, middle], theme);
    }
}

#[cfg(test)]
mod tests {
    use super::super::scene::Segment;
    use super::*;

    /// A spiral of `count` frames, everything on it.
    fn spiral(count: usize) -> PoseSpace {
        let at = |t: f64| [t * t.cos(), t * t.sin() + 100.0];
        let times: Vec<f64> = (0..=20 * count).map(|i| i as f64 / 20.0).collect();
        let frames: Vec<[f64; 2]> = (0..count).map(|i| at(i as f64)).collect();
        PoseSpace {
            curve: times.iter().map(|&t| at(t)).collect(),
            times,
            reached: frames.clone(),
            sites: frames.iter().step_by(2).copied().collect(),
            controls: frames.iter().step_by(3).copied().collect(),
            pins: vec![(2, at(1.0))],
            frames,
            ..PoseSpace::default()
        }
    }

    fn texts(scene: &Scene) -> impl Iterator<Item = &super::super::Label> {
        scene.items.iter().filter_map(|item| match item {
            Item::Text(label) => Some(label),
            _ => None,
        })
    }

    fn circles(scene: &Scene) -> Vec<Point> {
        let circle = |item: &Item| match item {
            Item::Circle { centre, .. } => Some(*centre),
            _ => None,
        };
        scene.items.iter().filter_map(circle).collect()
    }

    #[test]
    fn frames_lie_where_the_plane_says() {
        let map = spiral(12);
        let (scene, plane) = pose_space(&map, 640.0, 400.0, &Theme::light());
        let circles = circles(&scene);
        for at in &map.frames {
            assert!(circles.contains(&plane.pixel(*at)));
            assert!(plane.area.contains(plane.pixel(*at)));
        }
    }

    #[test]
    fn a_site_far_out_is_told_by_an_arrow_at_the_edge_and_moves_nothing() {
        let near = spiral(12);
        let mut far = near.clone();
        far.sites.push([1e4, -2e4]);
        let arrows = |scene: &Scene| -> Vec<Point> {
            let tips = scene.items.iter().filter_map(|item| match item {
                Item::Path {
                    path,
                    fill: Some(color),
                    ..
                } if *color == Theme::light().series[0] => match path.0.first() {
                    Some(Segment::Move(tip)) => Some(*tip),
                    _ => None,
                },
                _ => None,
            });
            tips.collect()
        };
        let (without, plane) = pose_space(&near, 640.0, 400.0, &Theme::light());
        let (with, same) = pose_space(&far, 640.0, 400.0, &Theme::light());
        assert_eq!(plane.pixel([3.0, 98.0]), same.pixel([3.0, 98.0]));
        assert_eq!(arrows(&without).len(), 0);
        let tips = arrows(&with);
        assert_eq!(tips.len(), 1);
        assert!(plane.area.contains(tips[0]));
        let middle = 0.5 * (plane.area.top + plane.area.bottom());
        assert!(tips[0][1] > middle, "the site lies below the map");
    }

    #[test]
    fn stretches_off_the_way_are_set_off_below_the_curve() {
        let map = PoseSpace {
            advice: vec![[3.0, 5.0]],
            ..spiral(12)
        };
        let theme = Theme::light();
        let (scene, plane) = pose_space(&map, 640.0, 400.0, &theme);
        let strokes = |item: &Item| match item {
            Item::Path {
                path,
                stroke: Some(stroke),
                ..
            } if stroke.color == theme.warning() => Some(path.0.clone()),
            _ => None,
        };
        let found: Vec<_> = scene.items.iter().filter_map(strokes).collect();
        let wanted = map
            .curve
            .iter()
            .zip(&map.times)
            .find(|(_, t)| **t >= 3.0)
            .unwrap();
        let start =
            |path: &Vec<Segment>| path.first() == Some(&Segment::Move(plane.pixel(*wanted.0)));
        assert!(found.iter().any(start));
        assert!(texts(&scene).any(|label| label.text.starts_with("off the")));
    }

    #[test]
    fn no_two_texts_meet_and_none_leaves_the_picture() {
        for (width, height, size) in [
            (200.0, 150.0, 9.0),
            (640.0, 400.0, 12.0),
            (2400.0, 1600.0, 30.0),
        ] {
            for count in [5, 24, 204] {
                let theme = Theme::dark().with_text(size);
                let (scene, _) = pose_space(&spiral(count), width, height, &theme);
                let boxes: Vec<Rect> = texts(&scene).map(|label| label.bounds()).collect();
                for (i, one) in boxes.iter().enumerate() {
                    assert!(scene.bounds().contains([one.left, one.top]), "{one:?}");
                    assert!(
                        scene.bounds().contains([one.right(), one.bottom()]),
                        "{one:?}"
                    );
                    assert!(boxes[..i].iter().all(|other| !other.intersects(one)));
                }
            }
        }
    }

    #[test]
    fn advised_pins_are_framed_and_named() {
        let mut map = spiral(24);
        map.advised = vec![(14, [60.0, 180.0])];
        let (scene, plane) = pose_space(&map, 640.0, 400.0, &Theme::light());
        assert!(plane.area.contains(plane.pixel([60.0, 180.0])));
        for text in ["pins advised", "14"] {
            assert!(texts(&scene).any(|label| label.text == text), "{text}");
        }
    }

    #[test]
    fn the_legend_stands_outside_the_data() {
        let (scene, plane) = pose_space(&spiral(24), 640.0, 400.0, &Theme::light());
        let names = [
            "f(t)",
            "frames",
            "sites",
            "control points",
            "pins",
            "last frame",
        ];
        for name in names {
            let label = texts(&scene).find(|label| label.text == name);
            let bounds = label.map(|label| label.bounds());
            assert!(
                bounds.is_some_and(|bounds| !bounds.intersects(&plane.area)),
                "{name}"
            );
        }
    }

    #[test]
    fn pins_ends_and_shown_frames_are_numbered_first() {
        let map = PoseSpace {
            shown: vec![7, 500, 0],
            ..spiral(24)
        };
        assert_eq!(map.numbered()[..6], [2, 7, 500, 0, 1, 24]);
        let (scene, _) = pose_space(&map, 640.0, 400.0, &Theme::light());
        for number in ["2", "7", "24"] {
            assert!(
                texts(&scene)
                    .any(|label| label.text == number && label.color == Theme::light().ink)
            );
        }
        assert!(!texts(&scene).any(|label| label.text == "500"));
    }

    #[test]
    fn degenerate_maps_are_drawn() {
        let still = |count: usize| PoseSpace {
            frames: vec![[3.0, -2.0]; count],
            curve: vec![[3.0, -2.0]; 50],
            times: vec![1.0; 50],
            ..PoseSpace::default()
        };
        let broken = PoseSpace {
            frames: vec![[f64::NAN, 0.0], [1.0, f64::INFINITY]],
            controls: vec![[f64::NAN; 2]; 4],
            pins: vec![(9, [f64::NAN; 2])],
            ..PoseSpace::default()
        };
        for map in [still(1), still(2), broken, PoseSpace::default()] {
            for (width, height) in [(640.0, 400.0), (1.0, 1.0)] {
                let (scene, plane) = pose_space(&map, width, height, &Theme::light());
                assert!(
                    circles(&scene)
                        .iter()
                        .flatten()
                        .all(|value| value.is_finite())
                );
                assert!(
                    plane
                        .pixel([3.0, -2.0])
                        .iter()
                        .all(|value| value.is_finite())
                );
                super::super::raster(&scene, 1.0);
            }
        }
    }

    #[test]
    fn the_whole_map_is_there_at_any_scale_and_place() {
        for unit in [1e-8, 1.0, 1e8] {
            let scaled = |points: &[[f64; 2]]| points.iter().map(|p| p.map(|v| v * unit)).collect();
            let map = spiral(12);
            let map = PoseSpace {
                curve: scaled(&map.curve),
                frames: scaled(&map.frames),
                times: map.times,
                ..PoseSpace::default()
            };
            let (_, plane) = pose_space(&map, 640.0, 400.0, &Theme::light());
            assert!(
                map.curve
                    .iter()
                    .all(|&at| plane.area.contains(plane.pixel(at)))
            );
            let (left, right) = (plane.x.pixel(-11.0 * unit), plane.x.pixel(11.0 * unit));
            assert!(right - left > 0.4 * plane.area.width, "{left} {right}");
        }
    }

    #[test]
    fn a_window_shows_its_part_and_clips_the_rest() {
        let map = PoseSpace {
            window: Some([[0.0, 2.0], [100.0, 101.0]]),
            ..spiral(24)
        };
        let (scene, plane) = pose_space(&map, 640.0, 400.0, &Theme::light());
        assert!(plane.x.range[0] <= 0.0 && plane.x.range[1] >= 2.0);
        assert!(scene.items.contains(&Item::Clip(Some(plane.area))));
    }
}
