//! From data to pixels: ranges, ticks, and the frame, grid and numbers around a plot.

use super::scene::{Anchor, Label, Path, Point, Rect, Scene, Stroke};
use super::text::{CAP_HEIGHT, text_width};
use super::theme::Theme;

/// How values are spread along an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Scale {
    /// Evenly.
    #[default]
    Linear,
    /// By their decimal logarithm; values must be above 0.
    Log,
}

/// One axis: `range` of the data falls on `pixels`, the first on the first.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Axis {
    /// Ends of the data, the first below the second.
    pub range: [f64; 2],
    /// Where these ends lie.
    pub pixels: [f32; 2],
    /// What lies between.
    pub scale: Scale,
}

/// A number on an axis.
#[derive(Debug, Clone, PartialEq)]
pub struct Tick {
    /// Its place in the data.
    pub value: f64,
    /// How it is written.
    pub text: String,
}

/// The ticks of an axis, and the power of ten that their texts leave out.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Ticks {
    /// From the lowest to the highest.
    pub marks: Vec<Tick>,
    /// Texts times 10^`exponent` are the values.
    pub exponent: i32,
}

/// The rectangle in which data is drawn and both its axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plane {
    /// In pixels.
    pub area: Rect,
    /// To the right.
    pub x: Axis,
    /// Upwards.
    pub y: Axis,
}

impl Axis {
    /// Where `value` lies.
    pub fn pixel(&self, value: f64) -> f32 {
        let [low, high] = self.range.map(|end| self.spread(end));
        let share = (self.spread(value) - low) / (high - low);
        self.pixels[0] + share as f32 * (self.pixels[1] - self.pixels[0])
    }

    /// The value that lies at `pixel`: undoes [`Axis::pixel`].
    pub fn value(&self, pixel: f32) -> f64 {
        let [low, high] = self.range.map(|end| self.spread(end));
        let share = (pixel - self.pixels[0]) / (self.pixels[1] - self.pixels[0]);
        let spread = low + f64::from(share) * (high - low);
        match self.scale {
            Scale::Linear => spread,
            Scale::Log => 10f64.powf(spread),
        }
    }

    fn spread(&self, value: f64) -> f64 {
        match self.scale {
            Scale::Linear => value,
            Scale::Log => value.log10(),
        }
    }

    /// As many ticks as stand clear of each other along `length` pixels, each text taking `across`
    /// ems if it is not written along the axis; not more than one per `spacing` ems, but five if
    /// they fit.
    pub(super) fn fitting(
        &self,
        length: f32,
        spacing: f32,
        across: Option<f32>,
        theme: &Theme,
    ) -> Ticks {
        let size = if theme.text > 0.0 { theme.text } else { 12.0 };
        let most = ((length / (spacing * size)) as usize).max(5);
        let clear = |ticks: &Ticks| {
            let wide = across.map_or_else(|| ticks.width(size) + 0.9 * size, |ems| ems * size);
            let places: Vec<f32> = ticks
                .marks
                .iter()
                .map(|tick| self.pixel(tick.value))
                .collect();
            places
                .windows(2)
                .all(|pair| (pair[1] - pair[0]).abs() >= wide)
        };
        let fewer = (1..=most).rev().map(|most| self.ticks(most));
        fewer.into_iter().find(clear).unwrap_or_default()
    }

    /// At most `most` round numbers within the range.
    pub fn ticks(&self, most: usize) -> Ticks {
        match self.scale {
            Scale::Linear => linear_ticks(self.range, most),
            Scale::Log => log_ticks(self.range, most),
        }
    }
}

impl Plane {
    /// A plane whose axes cover `x` and `y` exactly.
    pub fn new(area: Rect, x: [f64; 2], y: [f64; 2]) -> Self {
        let axis = |range, pixels| Axis {
            range,
            pixels,
            scale: Scale::Linear,
        };
        Plane {
            area,
            x: axis(x, [area.left, area.right()]),
            y: axis(y, [area.bottom(), area.top]),
        }
    }

    /// A plane that covers `x` and `y` with the same number of pixels to a unit in both directions:
    /// one of the ranges is widened about its middle.
    pub fn isometric(area: Rect, x: [f64; 2], y: [f64; 2]) -> Self {
        let (width, height) = (
            f64::from(area.width.max(1.0)),
            f64::from(area.height.max(1.0)),
        );
        let unit = ((x[1] - x[0]) / width).max((y[1] - y[0]) / height);
        let about = |range: [f64; 2], pixels: f64| {
            let (middle, half) = (0.5 * (range[0] + range[1]), 0.5 * unit * pixels);
            [middle - half, middle + half]
        };
        Plane::new(area, about(x, width), about(y, height))
    }

    /// A plane as [`Plane::isometric`] in `room` less what numbers and names need on its left and below
    /// it; with its ticks.
    pub(super) fn isometric_in(
        room: Rect,
        x: [f64; 2],
        y: [f64; 2],
        theme: &Theme,
    ) -> (Self, Ticks, Ticks) {
        let tall = room.height - bottom_margin(theme) - 1.0;
        let area = |left: f32| Rect::new(left, room.top, room.right() - left, tall);
        let ticks = |plane: &Plane| {
            let x = plane.x.fitting(plane.area.width, 4.5, None, theme);
            let y = plane.y.fitting(plane.area.height, 2.6, Some(1.3), theme);
            (x, y)
        };
        let first = Plane::isometric(area(4.0 * theme.text), x, y);
        let left = left_margin(theme, &ticks(&first).1) + 1.0;
        let plane = Plane::isometric(area(left), x, y);
        let (x, y) = ticks(&plane);
        (plane, x, y)
    }

    /// Where a point of the data lies in the picture.
    pub fn pixel(&self, point: [f64; 2]) -> Point {
        [self.x.pixel(point[0]), self.y.pixel(point[1])]
    }

    /// The point of the data that lies there: undoes [`Plane::pixel`].
    pub fn data(&self, pixel: Point) -> [f64; 2] {
        [self.x.value(pixel[0]), self.y.value(pixel[1])]
    }

    /// Draws background grid lines at the ticks.
    pub(super) fn draw_grid(&self, scene: &mut Scene, theme: &Theme, x: &Ticks, y: &Ticks) {
        let stroke = Stroke::new(theme.grid, theme.unit());
        let area = self.area;
        for tick in &x.marks {
            let at = self.x.pixel(tick.value);
            scene.line([at, area.top], [at, area.bottom()], stroke);
        }
        for tick in &y.marks {
            let at = self.y.pixel(tick.value);
            scene.line([area.left, at], [area.right(), at], stroke);
        }
    }

    /// Draws the frame around the data.
    pub(super) fn draw_frame(&self, scene: &mut Scene, theme: &Theme) {
        let stroke = Stroke::new(theme.muted.with_alpha(0.6), theme.unit());
        scene.stroke(Path::rect(self.area), stroke);
    }

    /// Writes numbers and the name below the area.
    pub(super) fn draw_x(&self, scene: &mut Scene, theme: &Theme, ticks: &Ticks, name: &str) {
        let size = theme.text;
        let base = self.area.bottom() + (0.45 + CAP_HEIGHT) * size;
        for tick in &ticks.marks {
            let at = [self.x.pixel(tick.value), base];
            scene.write(&tick.text, at, Anchor::Middle, theme);
        }
        let middle = 0.5 * (self.area.left + self.area.right());
        let name = ticks.named(name);
        let below = base + 1.45 * size;
        scene.write(&name, [middle, below], Anchor::Middle, theme);
    }

    /// Writes numbers left of the area and, where it fits, the name at the left side of the picture.
    pub(super) fn draw_y(&self, scene: &mut Scene, theme: &Theme, ticks: &Ticks, name: &str) {
        let size = theme.text;
        let right = self.area.left - 0.4 * size;
        for tick in &ticks.marks {
            let at = [right, self.y.pixel(tick.value) + 0.5 * CAP_HEIGHT * size];
            scene.write(&tick.text, at, Anchor::End, theme);
        }
        let middle = 0.5 * (self.area.top + self.area.bottom());
        let name = ticks.named(name);
        if text_width(&name, size) <= self.area.height + size {
            scene.write_upward(&name, [1.05 * size, middle], theme);
        }
    }
}

impl Ticks {
    /// The name with the power of ten that the texts leave out.
    pub(super) fn named(&self, name: &str) -> String {
        if self.exponent == 0 {
            return name.into();
        }
        let digits = self.exponent.to_string();
        let raised: String = digits.chars().map(superscript).collect();
        format!("{name} × 10{raised}").trim_start().into()
    }

    /// Width of the widest text.
    pub(super) fn width(&self, size: f32) -> f32 {
        let widths = self.marks.iter().map(|tick| text_width(&tick.text, size));
        widths.fold(0.0, f32::max)
    }
}

fn superscript(digit: char) -> char {
    match digit {
        '-' => '⁻',
        '1' => '¹',
        '2' => '²',
        '3' => '³',
        digit => char::from_u32(0x2070 + digit.to_digit(10).unwrap_or(0)).unwrap_or(digit),
    }
}

/// Space to the left of an area for numbers and the name of the axis.
pub(super) fn left_margin(theme: &Theme, ticks: &Ticks) -> f32 {
    ticks.width(theme.text) + 2.2 * theme.text
}

/// Space below an area for numbers and the name of the axis.
pub(super) fn bottom_margin(theme: &Theme) -> f32 {
    3.1 * theme.text
}

/// Multiples of 1, 2 or 5 times a power of ten.
fn linear_ticks(range: [f64; 2], most: usize) -> Ticks {
    let extent = range[1] - range[0];
    if most == 0 || extent.is_nan() || extent <= 0.0 || !extent.is_finite() {
        return Ticks::default();
    }
    let step = nice_step(extent / most as f64);
    let first = (range[0] / step - 1e-9).ceil(); // a tick on the end itself survives rounding
    let values = (0..=most).map(|i| (first + i as f64) * step);
    let values = values.take_while(|value| *value <= range[1] + 1e-9 * step);
    let exponent = exponent_of(range[0].abs().max(range[1].abs()));
    let unit = 10f64.powi(exponent);
    let decimals = (-((step / unit).log10() + 1e-9).floor()).max(0.0) as usize;
    let marks = values.map(|value| Tick {
        value,
        text: written(value / unit, decimals),
    });
    Ticks {
        marks: marks.collect(),
        exponent,
    }
}

/// The smallest of 1, 2, 5 times a power of ten that is not below `least` > 0.
pub(super) fn nice_step(least: f64) -> f64 {
    let power = 10f64.powf(least.log10().floor());
    let factor = [1.0, 2.0, 5.0, 10.0]
        .into_iter()
        .find(|factor| factor * power >= least * (1.0 - 1e-9));
    factor.unwrap_or(10.0) * power
}

/// The power of ten to leave out, 0 where numbers are short without.
fn exponent_of(largest: f64) -> i32 {
    let exponent = largest.log10().floor();
    if (-3.0..5.0).contains(&exponent) || !exponent.is_finite() {
        0
    } else {
        exponent as i32
    }
}

fn written(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    let zero = text
        .trim_start_matches('-')
        .chars()
        .all(|c| c == '0' || c == '.');
    match text.strip_prefix('-') {
        Some(digits) if zero => digits.into(),
        Some(digits) => format!("−{digits}"),
        None => text,
    }
}

/// Whole powers of ten; where fewer than two fall into the range, round numbers.
fn log_ticks(range: [f64; 2], most: usize) -> Ticks {
    let [low, high] = range.map(f64::log10);
    let stride = ((high - low) / most.max(1) as f64).ceil().max(1.0);
    let first = (low - 1e-9).ceil();
    let powers = (0..=most).map(|i| first + stride * i as f64);
    let powers: Vec<f64> = powers.take_while(|power| *power <= high + 1e-9).collect();
    if powers.len() < 2 {
        return linear_ticks(range, most);
    }
    let marks = powers.into_iter().map(|power| Tick {
        value: 10f64.powf(power),
        text: power_of_ten(power as i32),
    });
    Ticks {
        marks: marks.collect(),
        exponent: 0,
    }
}

fn power_of_ten(power: i32) -> String {
    match power {
        0..4 => format!("{}", 10i64.pow(power as u32)),
        -3..0 => written(10f64.powi(power), -power as usize),
        _ => format!(
            "10{}",
            power
                .to_string()
                .chars()
                .map(superscript)
                .collect::<String>()
        ),
    }
}

/// Ends of the finite values, `None` if there are none.
pub(super) fn range_of(values: impl IntoIterator<Item = f64>) -> Option<[f64; 2]> {
    let finite = values.into_iter().filter(|value| value.is_finite());
    finite.fold(None, |range, value| match range {
        None => Some([value, value]),
        Some([low, high]) => Some([low.min(value), high.max(value)]),
    })
}

/// The range with `share` of its extent added at both ends. A range without extent, or with so little
/// that rounding eats it, gets half a unit (or half its value, if that is more) at both ends.
pub(super) fn padded(range: [f64; 2], share: f64) -> [f64; 2] {
    let size = range[0].abs().max(range[1].abs());
    let extent = range[1] - range[0];
    let margin = if extent <= 1e-9 * size || extent == 0.0 {
        0.5 * if size > 0.0 { size } else { 1.0 }
    } else {
        share * extent
    };
    [range[0] - margin, range[1] + margin]
}

/// Both ranges with `share` of the larger extent added at all ends; where both have none, as [`padded`].
pub(super) fn with_margin([x, y]: [[f64; 2]; 2], share: f64) -> [[f64; 2]; 2] {
    let extent = (x[1] - x[0]).max(y[1] - y[0]);
    let ends = [x, y];
    let size = ends
        .iter()
        .flatten()
        .fold(0.0f64, |size, end| size.max(end.abs()));
    if extent <= 1e-9 * size || extent == 0.0 {
        return ends.map(|range| padded(range, share));
    }
    ends.map(|[low, high]| [low - share * extent, high + share * extent])
}

impl Scene {
    /// Writes horizontal text in the theme's secondary colour; nothing if the theme has no text.
    pub fn write(&mut self, text: &str, at: Point, anchor: Anchor, theme: &Theme) {
        self.label(text, at, anchor, theme, false);
    }

    /// Writes text upwards, its middle at `at`.
    pub(super) fn write_upward(&mut self, text: &str, at: Point, theme: &Theme) {
        self.label(text, at, Anchor::Middle, theme, true);
    }

    fn label(&mut self, text: &str, at: Point, anchor: Anchor, theme: &Theme, upward: bool) {
        if theme.text > 0.0 && !text.is_empty() {
            self.items.push(super::Item::Text(Label {
                text: text.into(),
                at,
                size: theme.text,
                anchor,
                color: theme.muted,
                upward,
                halo: None,
            }));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn linear(range: [f64; 2]) -> Axis {
        Axis {
            range,
            pixels: [10.0, 210.0],
            scale: Scale::Linear,
        }
    }

    #[test]
    fn ticks_cover_the_range_in_round_steps_at_any_scale() {
        for unit in [1e-8, 1.0, 1e8] {
            for (low, high) in [(0.0, 1.0), (-3.7, 12.1), (1.0, 24.0), (999.0, 1001.0)] {
                for most in [1, 3, 7, 20] {
                    let range = [low * unit, high * unit];
                    let ticks = linear(range).ticks(most).marks;
                    assert!(ticks.len() <= most + 1, "{range:?} {most} {ticks:?}");
                    let step = nice_step((range[1] - range[0]) / most as f64);
                    let slack = 1e-6 * step; // ticks on the ends may lie 1e-9 of a step outside
                    for tick in &ticks {
                        let multiple = tick.value / step;
                        assert!((multiple - multiple.round()).abs() < 1e-6);
                        assert!((range[0] - slack..=range[1] + slack).contains(&tick.value));
                    }
                    if let (Some(first), Some(last)) = (ticks.first(), ticks.last()) {
                        assert!(first.value - range[0] < step + slack);
                        assert!(range[1] - last.value < step + slack);
                    }
                }
            }
        }
    }

    #[test]
    fn texts_say_the_values() {
        for range in [
            [0.0, 1.0],
            [-3.7, 12.1],
            [1e6, 3e6],
            [2e-7, 9e-7],
            [-250.0, 99.0],
        ] {
            let ticks = linear(range).ticks(6);
            for tick in &ticks.marks {
                let number: f64 = tick.text.replace('−', "-").parse().unwrap();
                let value = number * 10f64.powi(ticks.exponent);
                assert!(
                    (value - tick.value).abs() <= 1e-9 * range[1].abs(),
                    "{tick:?}"
                );
            }
        }
        assert_eq!(linear([1e6, 3e6]).ticks(4).named("p"), "p × 10⁶");
        assert_eq!(power_of_ten(-5), "10⁻⁵");
        assert_eq!(power_of_ten(-2), "0.01");
    }

    #[test]
    fn pixels_and_values_undo_each_other() {
        let log = Axis {
            range: [1e-3, 10.0],
            scale: Scale::Log,
            ..linear([0.0, 1.0])
        };
        for axis in [linear([-2.0, 7.0]), log] {
            assert_eq!(axis.pixel(axis.range[0]), 10.0);
            assert_eq!(axis.pixel(axis.range[1]), 210.0);
            for value in [0.01, 0.5, 3.0] {
                let back = axis.value(axis.pixel(value));
                assert!((back / value - 1.0).abs() < 1e-4); // f32 pixels over a range of 1e4
            }
        }
    }

    #[test]
    fn an_isometric_plane_has_square_units_and_holds_its_data() {
        let area = Rect::new(5.0, 7.0, 300.0, 100.0);
        let plane = Plane::isometric(area, [-1.0, 3.0], [10.0, 12.0]);
        let a = plane.pixel([0.0, 10.0]);
        let b = plane.pixel([1.0, 11.0]);
        assert!(((b[0] - a[0]) - (a[1] - b[1])).abs() < 1e-3);
        for corner in [[-1.0, 10.0], [3.0, 12.0]] {
            assert!(area.grown(1e-3).contains(plane.pixel(corner)));
        }
        assert!(b[1] < a[1], "y grows upwards");
    }

    #[test]
    fn powers_of_ten_mark_a_logarithmic_axis() {
        let axis = |range| Axis {
            range,
            scale: Scale::Log,
            ..linear([0.0, 1.0])
        };
        let texts = |ticks: Ticks| ticks.marks.into_iter().map(|t| t.text).collect::<Vec<_>>();
        assert_eq!(
            texts(axis([1e-2, 10.0]).ticks(8)),
            ["0.01", "0.1", "1", "10"]
        );
        assert_eq!(
            texts(axis([1e-9, 1e3]).ticks(4)),
            ["10⁻⁹", "10⁻⁶", "0.001", "1", "1000"]
        );
        assert_eq!(texts(axis([2.0, 8.0]).ticks(4)), ["2", "4", "6", "8"]);
    }

    #[test]
    fn ranges_without_extent_are_given_one() {
        for range in [[0.0, 0.0], [5.0, 5.0], [-1e9, -1e9], [1.0, 1.0 + 1e-15]] {
            let [low, high] = padded(range, 0.05);
            assert!(low < range[0] && high > range[1]);
            assert!(linear([low, high]).pixel(range[0]).is_finite());
        }
        assert_eq!(range_of([f64::NAN, f64::INFINITY]), None);
        assert!(linear([2.0, 2.0]).ticks(5).marks.is_empty());
    }
}
