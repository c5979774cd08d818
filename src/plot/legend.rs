//! The marks that stand for data, and the legend that names them: rows above the plot, never over
//! data.

use super::scene::{Color, Path, Point, Rect, Scene, Stroke};
use super::text::{CAP_HEIGHT, text_width};
use super::theme::Theme;
use super::{Anchor, Item};

/// How a point or a line of the data looks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Mark {
    /// A full line.
    Line(Color),
    /// A dashed line.
    Dashed(Color),
    /// A line in the colours of time.
    TimeLine,
    /// A disc.
    Dot(Color),
    /// A circle, open.
    Ring(Color),
    /// A filled square.
    Square(Color),
    /// Small squares joined by a dashed line.
    Polygon(Color),
    /// A diamond with a rim.
    Diamond(Color),
    /// A disc on a vertical line.
    Stem(Color),
}

/// A legend laid out in rows.
#[derive(Debug, Clone, Default)]
pub(super) struct Legend {
    /// Marks, names, and left ends with the row counted from 0.
    entries: Vec<(Mark, String, f32, usize)>,
    rows: usize,
    width: f32,
}

impl Legend {
    /// Breaks `entries` into rows of at most `width` pixels. Without text, or where a name is wider
    /// than the row, there is no legend.
    pub(super) fn new(entries: &[(Mark, &str)], width: f32, theme: &Theme) -> Self {
        let size = theme.text;
        let mut legend = Legend::default();
        let (mut left, mut row) = (0.0, 0);
        for &(mark, name) in entries {
            let wide = 2.3 * size + text_width(name, size);
            if size <= 0.0 || wide > width {
                return Legend::default();
            }
            if left + wide > width {
                (left, row) = (0.0, row + 1);
            }
            legend.entries.push((mark, name.into(), left, row));
            legend.rows = row + 1;
            legend.width = legend.width.max(left + wide);
            left += wide + 1.5 * size;
        }
        legend
    }

    /// Itself, or nothing where it would take more than 15 % of `height`.
    #[must_use]
    pub(super) fn unless_crowded(self, height: f32, theme: &Theme) -> Self {
        if self.height(theme) > 0.15 * height {
            Legend::default()
        } else {
            self
        }
    }

    /// Its height in pixels with the space that sets it off; 0 if it is empty.
    pub(super) fn height(&self, theme: &Theme) -> f32 {
        if self.rows == 0 {
            0.0
        } else {
            (1.55 * self.rows as f32 + 0.5) * theme.text
        }
    }

    /// Draws it at the top, beginning at `left` or as far to the left of it as it must.
    pub(super) fn draw(&self, scene: &mut Scene, theme: &Theme, left: f32) {
        let size = theme.text;
        let at = [left.min(scene.width - self.width - 0.5 * size), 0.4 * size];
        for (mark, name, left, row) in &self.entries {
            let middle = at[1] + (1.55 * *row as f32 + 0.8) * size;
            let start = at[0] + left;
            mark.sample(scene, theme, [start + 0.9 * size, middle]);
            let text = [start + 2.3 * size, middle + 0.5 * CAP_HEIGHT * size];
            scene.write(name, text, Anchor::Start, theme);
        }
    }
}

impl Mark {
    /// Draws the mark of one point.
    pub(super) fn draw(self, scene: &mut Scene, theme: &Theme, at: Point) {
        let unit = theme.unit();
        let rim = Stroke::new(theme.background, 0.8 * unit);
        match self {
            Mark::Dot(color) | Mark::Stem(color) => {
                scene.disc(at, 2.4 * unit, color);
            }
            Mark::Ring(color) => {
                scene.ring(at, 4.4 * unit, None, Stroke::new(color, 1.1 * unit));
            }
            Mark::Square(color) | Mark::Polygon(color) => {
                let half = if self == Mark::Square(color) {
                    4.0
                } else {
                    2.2
                } * unit;
                let square = Rect::new(at[0] - half, at[1] - half, 2.0 * half, 2.0 * half);
                scene.items.push(Item::Path {
                    path: Path::rect(square),
                    fill: Some(color),
                    stroke: Some(rim),
                });
            }
            Mark::Diamond(color) => scene.items.push(Item::Path {
                path: Path::polygon(&diamond(at, 5.4 * unit)),
                fill: Some(color),
                stroke: Some(Stroke::new(theme.ink, unit)),
            }),
            Mark::Line(_) | Mark::Dashed(_) | Mark::TimeLine => {}
        }
    }

    /// Draws the mark as the legend shows it: lines with a piece of line.
    fn sample(self, scene: &mut Scene, theme: &Theme, at: Point) {
        let (unit, half) = (theme.unit(), 0.9 * theme.text);
        let ends = [[at[0] - half, at[1]], [at[0] + half, at[1]]];
        match self {
            Mark::Line(color) => {
                scene.line(ends[0], ends[1], Stroke::new(color, 1.8 * unit));
            }
            Mark::Dashed(color) => {
                let stroke = Stroke::new(color, 1.8 * unit);
                scene.line(ends[0], ends[1], stroke.dashed(5.0 * unit, 4.0 * unit));
            }
            Mark::TimeLine => scene.items.push(time_sample(theme, ends)),
            Mark::Polygon(color) => {
                let stroke = Stroke::new(color.with_alpha(0.7), 0.9 * unit);
                scene.line(ends[0], ends[1], stroke.dashed(3.0 * unit, 2.5 * unit));
            }
            Mark::Stem(color) => {
                let foot = [at[0], at[1] + 0.5 * theme.text];
                scene.line(at, foot, Stroke::new(color, 1.2 * unit));
            }
            _ => {}
        }
        self.draw(scene, theme, at);
    }
}

fn diamond(at: Point, half: f32) -> [Point; 4] {
    let [x, y] = at;
    [[x, y - half], [x + half, y], [x, y + half], [x - half, y]]
}

fn time_sample(theme: &Theme, ends: [Point; 2]) -> Item {
    let steps = 16;
    let share = |i: usize| i as f32 / steps as f32;
    let along = |i| ends[0][0] + share(i) * (ends[1][0] - ends[0][0]);
    Item::Curve {
        points: (0..=steps).map(|i| [along(i), ends[0][1]]).collect(),
        colors: (0..=steps)
            .map(|i| theme.time(f64::from(share(i))))
            .collect(),
        width: 2.2 * theme.unit(),
    }
}

/// A triangle at `at` that points along `direction` (of length 1).
pub(super) fn arrow(scene: &mut Scene, at: Point, direction: Point, color: Color, theme: &Theme) {
    let unit = theme.unit();
    let [dx, dy] = direction;
    let corner = |along: f32, aside: f32| {
        let (along, aside) = (along * unit, aside * unit);
        [
            at[0] + along * dx - aside * dy,
            at[1] + along * dy + aside * dx,
        ]
    };
    scene.items.push(Item::Path {
        path: Path::polygon(&[corner(5.0, 0.0), corner(-3.5, 4.0), corner(-3.5, -4.0)]),
        fill: Some(color),
        stroke: Some(Stroke::new(theme.background, 0.8 * unit)),
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_hold_their_entries_and_names_do_not_meet() {
        let theme = Theme::light();
        let mark = Mark::Dot(theme.ink);
        let names = [
            "frames",
            "sites of the map",
            "control points",
            "pins",
            "start",
        ];
        let entries: Vec<(Mark, &str)> = names.iter().map(|&name| (mark, name)).collect();
        for width in [200.0, 250.0, 2000.0] {
            let legend = Legend::new(&entries, width - 20.0, &theme);
            let mut scene = Scene::new(width, 300.0, theme.background);
            legend.draw(&mut scene, &theme, 40.0);
            let boxes: Vec<Rect> = scene
                .items
                .iter()
                .filter_map(|item| match item {
                    Item::Text(label) => Some(label.bounds()),
                    _ => None,
                })
                .collect();
            assert_eq!(boxes.len(), names.len());
            for (i, one) in boxes.iter().enumerate() {
                assert!(scene.bounds().contains([one.left, one.top]));
                assert!(one.right() <= width && one.bottom() <= legend.height(&theme));
                assert!(boxes[..i].iter().all(|other| !one.intersects(other)));
            }
        }
    }

    #[test]
    fn a_legend_that_does_not_fit_is_left_out() {
        let theme = Theme::light();
        let entries = [(Mark::TimeLine, "a name wider than the picture")];
        assert_eq!(Legend::new(&entries, 60.0, &theme).height(&theme), 0.0);
        assert_eq!(Legend::new(&entries, 600.0, &theme.with_text(0.0)).rows, 0);
    }
}
