//! Curves over a common horizontal axis, one panel below the other.

use super::axes::{Axis, Plane, Scale, Tick, Ticks, bottom_margin, left_margin, padded, range_of};
use super::legend::{Legend, Mark};
use super::scene::{Path, Point, Rect, Scene, Stroke};
use super::theme::{Theme, Tint};

/// How the points of a series are drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Style {
    /// Joined by a line.
    Line,
    /// Joined by a dashed line.
    Dashed,
    /// A disc each.
    Dots,
    /// Discs joined by a line.
    Both,
    /// A disc each, on a vertical line from the lower end of the axis.
    Stems,
}

/// One series of a panel.
#[derive(Debug, Clone)]
pub struct Series {
    /// Its name in the legend; empty: not in the legend.
    pub name: String,
    /// Its colour.
    pub tint: Tint,
    /// How it is drawn.
    pub style: Style,
    /// (x, y); lines have a gap at points that are not finite.
    pub points: Vec<[f64; 2]>,
}

/// Series that share a vertical axis.
#[derive(Debug, Clone, Default)]
pub struct Panel {
    /// Name of the vertical axis, with its unit.
    pub name: String,
    /// How the vertical axis is divided. Values that a logarithmic axis cannot show are left out.
    pub scale: Scale,
    /// Whether the vertical axis begins at 0 (only if linear and no value is below).
    pub from_zero: bool,
    /// The series, the lowest first.
    pub series: Vec<Series>,
    /// Height relative to the other panels; 0 counts as 1.
    pub share: f32,
}

/// Panels over one horizontal axis.
#[derive(Debug, Clone, Default)]
pub struct Chart {
    /// Name of the horizontal axis, with its unit.
    pub name: String,
    /// How it is divided.
    pub scale: Scale,
    /// Its ends; `None`: as the data asks for.
    pub range: Option<[f64; 2]>,
    /// What is written at which values of x; `None`: round numbers.
    pub names: Option<Vec<Tick>>,
    /// From top to bottom.
    pub panels: Vec<Panel>,
    /// Values of x marked by short strokes at the foot of the first panel, and what they are.
    pub rug: Option<(String, Vec<f64>)>,
    /// Ranges of x set off in all panels.
    pub bands: Vec<[f64; 2]>,
}

/// The chart in a picture of `width` x `height` pixels, and the plane of each panel. The legend stands
/// above the data and is left out where there is no room. A panel without values shows [0, 1].
pub fn chart(chart: &Chart, width: f32, height: f32, theme: &Theme) -> (Scene, Vec<Plane>) {
    let mut scene = Scene::new(width, height, theme.background);
    let size = theme.text;
    let legend = chart
        .legend(theme, width - 2.0 * size)
        .unless_crowded(height, theme);
    let top = legend.height(theme).max(0.8 * size + 1.0);
    let planes = chart.planes(Rect::new(0.0, top, width, height - top), theme);
    let last = planes.len().saturating_sub(1);
    for (i, (panel, (plane, y))) in chart.panels.iter().zip(&planes).enumerate() {
        let x = chart.ticks(plane, theme);
        chart.draw_bands(&mut scene, plane, theme);
        plane.draw_grid(&mut scene, theme, &x, y);
        if i == 0 {
            chart.draw_rug(&mut scene, plane, theme);
        }
        panel.draw(&mut scene, plane, theme, chart.range.is_some());
        plane.draw_frame(&mut scene, theme);
        plane.draw_y(&mut scene, theme, y, &panel.name);
        if i == last {
            plane.draw_x(&mut scene, theme, &x, &chart.name);
        }
    }
    let left = planes.first().map_or(0.0, |(plane, _)| plane.area.left);
    legend.draw(&mut scene, theme, left);
    (scene, planes.into_iter().map(|(plane, _)| plane).collect())
}

impl Chart {
    fn legend(&self, theme: &Theme, width: f32) -> Legend {
        let series = self.panels.iter().flat_map(|panel| &panel.series);
        let named = series.filter(|series| !series.name.is_empty());
        let mut entries: Vec<(Mark, &str)> = named
            .map(|series| (series.mark(theme), series.name.as_str()))
            .collect();
        if let Some((name, _)) = self.rug.as_ref().filter(|(_, values)| !values.is_empty()) {
            entries.push((Mark::Line(theme.series[1]), name));
        }
        Legend::new(&entries, width, theme)
    }

    /// Divides `room` into the panels' areas, left margins alike; with each its vertical ticks.
    fn planes(&self, room: Rect, theme: &Theme) -> Vec<(Plane, Ticks)> {
        let gap = 0.9 * theme.text + 2.0;
        let gaps = gap * self.panels.len().saturating_sub(1) as f32;
        let free = (room.height - bottom_margin(theme) - 1.0 - gaps).max(0.0);
        let share = |panel: &Panel| if panel.share > 0.0 { panel.share } else { 1.0 };
        let whole: f32 = self.panels.iter().map(share).sum();
        let heights: Vec<f32> = self
            .panels
            .iter()
            .map(|p| free * share(p) / whole)
            .collect();
        let ticks = |(panel, &height): (&Panel, &f32)| {
            panel
                .axis([height, 0.0])
                .fitting(height, 1.8, Some(1.3), theme)
        };
        let ticks: Vec<Ticks> = self.panels.iter().zip(&heights).map(ticks).collect();
        let margins = ticks.iter().map(|ticks| left_margin(theme, ticks));
        let left = margins.fold(0.0, f32::max) + 1.0;
        let wide = room.width - left - 1.2 * theme.text - 1.0;
        let mut top = room.top;
        let each = self.panels.iter().zip(heights).zip(ticks);
        each.map(|((panel, height), ticks)| {
            let area = Rect::new(left, top, wide, height);
            top += height + gap;
            let x = self.axis([area.left, area.right()]);
            let y = panel.axis([area.bottom(), area.top]);
            (Plane { area, x, y }, ticks)
        })
        .collect()
    }

    fn ticks(&self, plane: &Plane, theme: &Theme) -> Ticks {
        match &self.names {
            Some(names) => Ticks {
                marks: names.clone(),
                exponent: 0,
            },
            None => plane.x.fitting(plane.area.width, 4.5, None, theme),
        }
    }

    fn axis(&self, pixels: [f32; 2]) -> Axis {
        let series = self.panels.iter().flat_map(|panel| &panel.series);
        let values = series.flat_map(|series| series.points.iter().map(|point| point[0]));
        let range = self
            .range
            .unwrap_or_else(|| range_for(self.scale, values, 0.02));
        Axis {
            range,
            pixels,
            scale: self.scale,
        }
    }

    fn draw_bands(&self, scene: &mut Scene, plane: &Plane, theme: &Theme) {
        let Plane { area, x, .. } = plane;
        for [from, to] in &self.bands {
            let inside = |at: f64| x.pixel(at).clamp(area.left, area.right());
            let (left, right) = (inside(*from), inside(*to));
            // Never so narrow that it is not seen.
            let wide = (right - left).max(theme.unit());
            let band = Rect::new(left, area.top, wide, area.height);
            scene.fill(Path::rect(band), theme.warning().with_alpha(0.25));
        }
    }

    fn draw_rug(&self, scene: &mut Scene, plane: &Plane, theme: &Theme) {
        let Some((_, values)) = &self.rug else {
            return;
        };
        let stroke = Stroke::new(theme.series[1], 1.2 * theme.unit());
        let (foot, tall) = (plane.area.bottom(), 4.5 * theme.unit());
        for at in values.iter().map(|&value| plane.x.pixel(value)) {
            scene.line([at, foot], [at, foot - tall], stroke);
        }
    }
}

/// The range of the values that the scale can show, padded; where there are none, 0 to 1, or 0.1 to 10.
fn range_for(scale: Scale, values: impl Iterator<Item = f64>, share: f64) -> [f64; 2] {
    match scale {
        Scale::Linear => range_of(values).map_or([0.0, 1.0], |range| padded(range, share)),
        Scale::Log => {
            let powers = range_of(values.filter(|value| *value > 0.0).map(f64::log10));
            let padded = powers.map_or([-1.0, 1.0], |range| padded(range, share));
            padded.map(|power| 10f64.powf(power))
        }
    }
}

impl Panel {
    fn axis(&self, pixels: [f32; 2]) -> Axis {
        let values = || {
            self.series
                .iter()
                .flat_map(|s| s.points.iter().map(|point| point[1]))
        };
        let mut range = range_for(self.scale, values(), 0.07);
        let lowest = range_of(values()).map_or(0.0, |ends| ends[0]);
        if self.from_zero && self.scale == Scale::Linear && lowest >= 0.0 {
            range = [0.0, range[1]];
        }
        Axis {
            range,
            pixels,
            scale: self.scale,
        }
    }

    fn draw(&self, scene: &mut Scene, plane: &Plane, theme: &Theme, clip: bool) {
        let all = |scene: &mut Scene| {
            self.series
                .iter()
                .for_each(|series| series.draw(scene, plane, theme));
        };
        if clip {
            scene.clipped(plane.area, all);
        } else {
            all(scene);
        }
    }
}

impl Series {
    /// A series joined by a line.
    pub fn line(name: impl Into<String>, tint: Tint, points: Vec<[f64; 2]>) -> Self {
        Series {
            name: name.into(),
            tint,
            style: Style::Line,
            points,
        }
    }

    /// The same series in another style.
    #[must_use]
    pub fn styled(mut self, style: Style) -> Self {
        self.style = style;
        self
    }

    fn mark(&self, theme: &Theme) -> Mark {
        let color = theme.tint(self.tint);
        match self.style {
            Style::Line | Style::Both => Mark::Line(color),
            Style::Dashed => Mark::Dashed(color),
            Style::Dots => Mark::Dot(color),
            Style::Stems => Mark::Stem(color),
        }
    }

    fn draw(&self, scene: &mut Scene, plane: &Plane, theme: &Theme) {
        let pixels: Vec<Point> = self
            .points
            .iter()
            .map(|point| plane.pixel(*point))
            .collect();
        match self.style {
            Style::Line | Style::Dashed => self.draw_line(scene, &pixels, theme),
            Style::Dots => self.draw_dots(scene, &pixels, plane, theme),
            Style::Both => {
                self.draw_line(scene, &pixels, theme);
                self.draw_dots(scene, &pixels, plane, theme);
            }
            Style::Stems => {
                self.draw_stems(scene, &pixels, plane, theme);
                self.draw_dots(scene, &pixels, plane, theme);
            }
        }
    }

    fn draw_line(&self, scene: &mut Scene, pixels: &[Point], theme: &Theme) {
        let unit = theme.unit();
        let full = Stroke::new(theme.tint(self.tint), 1.6 * unit);
        let dashed = full.dashed(5.0 * unit, 4.0 * unit);
        let stroke = if self.style == Style::Dashed {
            dashed
        } else {
            full
        };
        for part in pixels.split(|point| !visible(point)) {
            let mut part = part.to_vec();
            part.dedup_by(|next, kept| (next[0] - kept[0]).hypot(next[1] - kept[1]) < 0.8);
            scene.stroke(Path::polyline(&part), stroke);
        }
    }

    fn draw_stems(&self, scene: &mut Scene, pixels: &[Point], plane: &Plane, theme: &Theme) {
        let foot = plane.area.bottom();
        let thin = Stroke::new(theme.tint(self.tint), 1.1 * theme.unit());
        for at in pixels.iter().filter(|point| visible(point)) {
            scene.line(*at, [at[0], foot], thin);
        }
    }

    fn draw_dots(&self, scene: &mut Scene, pixels: &[Point], plane: &Plane, theme: &Theme) {
        let radius = self.radius(plane, theme);
        for at in pixels.iter().filter(|point| visible(point)) {
            scene.disc(*at, radius, theme.tint(self.tint));
        }
    }

    /// Discs become smaller where many stand side by side.
    fn radius(&self, plane: &Plane, theme: &Theme) -> f32 {
        let spacing = plane.area.width / self.points.len().max(1) as f32;
        let largest = if spacing > 60.0 * theme.unit() {
            4.0
        } else {
            2.4
        };
        (0.35 * spacing).clamp(1.1 * theme.unit(), largest * theme.unit())
    }
}

fn visible(point: &Point) -> bool {
    point.iter().all(|value| value.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plot::Item;

    fn waves(styles: &[Style]) -> Chart {
        let wave = |(i, &style): (usize, &Style)| {
            let points = (1..=40).map(|x| [f64::from(x), (f64::from(x) * 0.3).sin() + i as f64]);
            Panel {
                name: "height (m)".into(),
                series: vec![Series::line("wave", Tint::Series(i), points.collect()).styled(style)],
                ..Panel::default()
            }
        };
        Chart {
            name: "t (frames)".into(),
            panels: styles.iter().enumerate().map(wave).collect(),
            rug: Some(("knots".into(), vec![3.0, 9.5])),
            ..Chart::default()
        }
    }

    #[test]
    fn panels_share_the_horizontal_axis_and_do_not_meet() {
        let styles = [
            Style::Line,
            Style::Dots,
            Style::Stems,
            Style::Both,
            Style::Dashed,
        ];
        let (scene, planes) = chart(&waves(&styles), 640.0, 700.0, &Theme::light());
        for (i, plane) in planes.iter().enumerate() {
            assert_eq!(plane.x, planes[0].x);
            assert!(
                scene
                    .bounds()
                    .contains([plane.area.right(), plane.area.bottom()])
            );
            assert!(
                planes[..i]
                    .iter()
                    .all(|other| !other.area.intersects(&plane.area))
            );
        }
    }

    #[test]
    fn dots_and_the_feet_of_stems_lie_where_the_plane_says() {
        let figure = waves(&[Style::Stems]);
        let (scene, planes) = chart(&figure, 640.0, 300.0, &Theme::dark());
        for point in &figure.panels[0].series[0].points {
            let at = planes[0].pixel(*point);
            let foot = [at[0], planes[0].area.bottom()];
            let stem = Path::polyline(&[at, foot]);
            let found = |wanted: &dyn Fn(&Item) -> bool| scene.items.iter().any(wanted);
            assert!(found(
                &|item| matches!(item, Item::Circle { centre, .. } if *centre == at)
            ));
            assert!(found(
                &|item| matches!(item, Item::Path { path, .. } if *path == stem)
            ));
        }
    }

    #[test]
    fn texts_do_not_meet_at_any_size() {
        for (width, height, size) in [
            (200.0, 150.0, 9.0),
            (640.0, 480.0, 12.0),
            (2400.0, 1600.0, 30.0),
        ] {
            let theme = Theme::light().with_text(size);
            let (scene, _) = chart(&waves(&[Style::Line; 4]), width, height, &theme);
            let label = |item: &Item| match item {
                Item::Text(label) => Some(label.bounds()),
                _ => None,
            };
            let boxes: Vec<Rect> = scene.items.iter().filter_map(label).collect();
            for (i, one) in boxes.iter().enumerate() {
                assert!(
                    scene.bounds().contains([one.left, one.top]),
                    "{width} {one:?}"
                );
                assert!(
                    boxes[..i].iter().all(|other| !other.intersects(one)),
                    "{width} {one:?}"
                );
            }
        }
    }

    #[test]
    fn gaps_in_the_data_are_gaps_in_the_line() {
        let points = vec![
            [0.0, 0.0],
            [1.0, 1.0],
            [2.0, f64::NAN],
            [3.0, 1.0],
            [4.0, 0.0],
        ];
        let panel = Panel {
            series: vec![Series::line("", Tint::Ink, points)],
            ..Panel::default()
        };
        let figure = Chart {
            panels: vec![panel],
            ..Chart::default()
        };
        let theme = Theme::light();
        let (scene, _) = chart(&figure, 300.0, 200.0, &theme);
        let lines = scene.items.iter().filter(|item| {
            matches!(item, Item::Path { stroke: Some(stroke), .. } if stroke.color == theme.ink)
        });
        assert_eq!(lines.count(), 2);
    }

    #[test]
    fn empty_and_constant_data_are_drawn() {
        let constant = |value: f64, scale| Chart {
            panels: vec![Panel {
                scale,
                from_zero: true,
                series: vec![Series::line("c", Tint::Ink, vec![[1.0, value]; 3])],
                ..Panel::default()
            }],
            ..Chart::default()
        };
        let cases = [
            Chart::default(),
            waves(&[]),
            constant(0.0, Scale::Linear),
            constant(-5e9, Scale::Linear),
            constant(0.0, Scale::Log),
            constant(f64::NAN, Scale::Log),
        ];
        for figure in cases {
            let (_, planes) = chart(&figure, 300.0, 200.0, &Theme::light());
            for plane in planes {
                let at = plane.pixel([1.0, plane.y.range[1]]);
                assert!(at.iter().all(|value| value.is_finite()), "{plane:?}");
            }
        }
    }
}
