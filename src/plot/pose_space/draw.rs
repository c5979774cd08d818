//! The marks of the map, from the pictures behind it to the numbers on top.

use super::PoseSpace;
use crate::plot::axes::{Plane, nice_step};
use crate::plot::labels::Labels;
use crate::plot::legend::{Mark, arrow};
use crate::plot::scene::{Path, Point, Rect, Scene, Stroke};
use crate::plot::theme::Theme;
use crate::plot::{Color, Item};

/// Most numbered frames on a map, besides pins and shown frames.
const MOST_NUMBERS: f64 = 12.0;

impl PoseSpace {
    pub(super) fn draw(&self, scene: &mut Scene, plane: &Plane, theme: &Theme) {
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

    pub(super) fn draw_pictures(&self, scene: &mut Scene, plane: &Plane) {
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
    pub(super) fn ends(&self) -> bool {
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
    pub(super) fn numbered(&self) -> Vec<usize> {
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
pub(super) struct Marks {
    pub(super) curve: Mark,
    pub(super) frame: Mark,
    pub(super) site: Mark,
    pub(super) control: Mark,
    pub(super) pin: Mark,
    pub(super) advised: Mark,
    pub(super) end: Mark,
    pub(super) astray: Mark,
}

impl Marks {
    pub(super) fn of(theme: &Theme) -> Self {
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

pub(super) fn pixels(plane: &Plane, points: &[[f64; 2]]) -> Vec<Point> {
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
pub(super) fn draw_beyond(scene: &mut Scene, area: Rect, beyond: &[Point], theme: &Theme) {
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
