//! A loom's signals as the plain series that plots are drawn from, and the figure of both.

use super::output::Output;
use super::picture::save_picture;
use super::save::Saved;
use crate::diag::Result;
use crate::loom::Loom;
use crate::loom::report::{Change, Span};
use crate::math::b_spline::Point;
use crate::plot::{Anchor, PoseSpace, Scene, Theme, TimeSignals, pose_space, time_signals};
use crate::signal::pose::PoseSignal;
use crate::signal::time::TimeSignal;
use crate::world::World;

/// What is known about the frames that signals were fitted to; any of it may be missing.
#[derive(Debug, Clone, Copy, Default)]
pub struct Fitted<'a> {
    /// p_i, where the frames lie in pose space.
    pub positions: &'a [Point],
    /// Pinned frames, counted from 0, and where.
    pub pins: &'a [(usize, Point)],
    /// |z_i - psi(i)| over the root mean square distance of the frames from their mean.
    pub errors: &'a [f64],
    /// Frames, from 1, between which the curve leaves their way.
    pub astray: &'a [[f64; 2]],
}

/// The curve is sampled this often between frames, if it can be afforded.
const SMOOTH: usize = 24;

/// So many stretches that go astray are told in words.
const NAMED: usize = 3;

/// Samples of the whole curve: beyond, a picture shows no difference.
const SAMPLES: usize = 2400;

/// Map and time signals of a loom, as [`series`].
pub fn plot_loom(loom: &Loom) -> (PoseSpace, TimeSignals) {
    let spans = loom.report().spans.iter();
    let astray: Vec<_> = spans
        .map(|span| [span.first as f64, span.last as f64])
        .collect();
    let fitted = Fitted {
        positions: &loom.layout().positions,
        pins: &loom.layout().pins,
        errors: &loom.frame_errors(),
        astray: &astray,
    };
    let (mut map, signals) = series(loom.time(), loom.pose(), &fitted);
    if map.frames.len() == loom.layout().positions.len() && loom.time().warps().is_empty() {
        advise(&mut map, &loom.report().spans);
    }
    (map, signals)
}

/// Adds what would mend the worst spans: words, and arrows where that is a pin.
fn advise(map: &mut PoseSpace, spans: &[Span]) {
    for span in spans.iter().take(NAMED) {
        map.notes.push(span.advice());
        if let Some(Change::Pins(pins)) = span.mends.first().map(|mend| &mend.change) {
            map.advised
                .extend(pins.first().map(|pin| (pin.frame, pin.at)));
        }
    }
}

/// Size of the figure in a file, in pixels at scale 1.
const FIGURE: [f32; 2] = [1280.0, 560.0];

/// Pixels to the figure's unit in a PNG file: sharp where it is printed or shown at its size.
const SHARP: f32 = 2.0;

/// Writes the figure of a loom to a file, PNG or SVG by its ending.
///
/// # Errors
/// As [`save_picture`].
pub fn save_plot(world: &dyn World, loom: &Loom, output: &Output, theme: &Theme) -> Result<Saved> {
    let (map, signals) = plot_loom(loom);
    let scene = figure(&map, &signals, &caption(loom), FIGURE, theme);
    save_picture(world, &scene, output, SHARP)
}

/// One line about a loom: what it has and how well it fits.
pub fn caption(loom: &Loom) -> String {
    let (k, l) = (loom.time().controls().len(), loom.pose().sites().len());
    let (n, m) = (loom.frames(), loom.shape().modes());
    let error = 100.0 * loom.report().error.total;
    let frames = if n == 1 { "frame" } else { "frames" };
    format!("{n} {frames}, k = {k}, l = {l}, m = {m}; total error {error:.3} %")
}

/// Map and time signals of f and g. What was `fitted` is shown where it still belongs to the frames: an
/// edit that changes their number, or leads the curve another way, leaves positions f(i) and no errors.
pub fn series(time: &TimeSignal, pose: &PoseSignal, fitted: &Fitted) -> (PoseSpace, TimeSignals) {
    let n = time.frames();
    let times = dense_times(n);
    let curve: Vec<Point> = times.iter().filter_map(|&t| time.at(t)).collect();
    let reached: Vec<Point> = (1..=n).filter_map(|i| time.at(i as f64)).collect();
    let speed = |&t: &f64| time.velocity(t).map(|[x, y]| x.hypot(y));
    let rho: Vec<f64> = times.iter().filter_map(|&t| parameter(time, t)).collect();
    let known = time.warps().is_empty() && belong(fitted.positions, &reached);
    let frames = if known {
        fitted.positions.to_vec()
    } else {
        reached.clone()
    };
    let astray = if known {
        fitted.astray.to_vec()
    } else {
        Vec::new()
    };
    let signals = TimeSignals {
        position: curve.clone(),
        speed: times.iter().filter_map(speed).collect(),
        knots: knot_times(time, &times, &rho),
        rho,
        frames: frames.clone(),
        parameters: (1..=n).filter_map(|i| parameter(time, i as f64)).collect(),
        error: if known {
            fitted.errors.to_vec()
        } else {
            Vec::new()
        },
        times: times.clone(),
        advice: astray.clone(),
        window: None,
    };
    let pins = fitted.pins.iter().filter(|_| known);
    let map = PoseSpace {
        curve,
        times,
        frames,
        reached,
        sites: pose.sites().to_vec(),
        controls: time.controls().to_vec(),
        pins: pins.map(|&(frame, at)| (frame + 1, at)).collect(),
        advice: astray,
        ..PoseSpace::default()
    };
    (map, signals)
}

/// A curve farther from its frames than this share of their spread, root mean square, is no longer theirs: it
/// was sketched, or runs backwards.
const FARTHEST: f64 = 0.7;

/// Whether the curve, which reaches these points at its frames, goes by the frames' positions.
fn belong(positions: &[Point], reached: &[Point]) -> bool {
    let squared = |a: &Point, b: &Point| (a[0] - b[0]).powi(2) + (a[1] - b[1]).powi(2);
    let count = positions.len() as f64;
    let sum = |axis: usize| positions.iter().map(|p| p[axis]).sum::<f64>();
    let mean = [0, 1].map(|axis| sum(axis) / count);
    let spread: f64 = positions.iter().map(|p| squared(p, &mean)).sum();
    let away: f64 = positions
        .iter()
        .zip(reached)
        .map(|(p, f)| squared(p, f))
        .sum();
    positions.len() == reached.len() && away <= FARTHEST * FARTHEST * spread
}

/// Times in frames, every frame among them.
fn dense_times(frames: usize) -> Vec<f64> {
    let spans = frames.saturating_sub(1);
    let between = (SAMPLES / spans.max(1)).clamp(4, SMOOTH);
    let inner = (0..spans * between).map(|i| 1.0 + i as f64 / between as f64);
    inner.chain((frames > 0).then_some(frames as f64)).collect()
}

/// rho at a time, from the start of the domain.
fn parameter(time: &TimeSignal, t: f64) -> Option<f64> {
    let (place, _) = time.place_at(t)?;
    let from = crate::math::b_spline::Place::default();
    Some(time.curve().distance(from, place))
}

/// Times at which the curve passes its interior knots, from samples of rho: between two samples rho is
/// taken as straight.
fn knot_times(time: &TimeSignal, times: &[f64], rho: &[f64]) -> Vec<f64> {
    let spans = time.curve().spans();
    let lengths = (0..spans).map(|span| time.curve().span_length(span));
    let knots = lengths.scan(0.0, |sum, length| {
        *sum += length;
        Some(*sum)
    });
    let interior: Vec<f64> = knots.take(spans.saturating_sub(1)).collect();
    let mut found = Vec::new();
    for (t, u) in times.windows(2).zip(rho.windows(2)) {
        let (low, high) = (u[0].min(u[1]), u[0].max(u[1]));
        let first = interior.partition_point(|&knot| knot <= low);
        let passed = interior[first..].iter().take_while(|&&knot| knot <= high);
        found.extend(passed.map(|knot| t[0] + (t[1] - t[0]) * (knot - u[0]) / (u[1] - u[0])));
    }
    found
}

/// Map and time signals side by side, or below each other where the picture is higher than wide, under a
/// line of text (none if it is empty) and the map's notes.
pub fn figure(
    map: &PoseSpace,
    signals: &TimeSignals,
    title: &str,
    [width, height]: [f32; 2],
    theme: &Theme,
) -> Scene {
    let mut scene = Scene::new(width, height, theme.background);
    let lines = std::iter::once(title).chain(map.notes.iter().map(String::as_str));
    let mut top = 0.0;
    for line in lines.filter(|line| !line.is_empty()) {
        let at = [0.8 * theme.text, top + 1.4 * theme.text];
        scene.write(line, at, Anchor::Start, theme);
        top += 1.4 * theme.text;
    }
    if top > 0.0 {
        top += 0.6 * theme.text;
    }
    let tall = height - top;
    let across = width >= tall;
    let first = if across {
        [0.52 * width, tall]
    } else {
        [width, 0.55 * tall]
    };
    let (second, at) = if across {
        ([width - first[0], tall], [first[0], top])
    } else {
        ([width, tall - first[1]], [0.0, top + first[1]])
    };
    scene.place(pose_space(map, first[0], first[1], theme).0, [0.0, top]);
    scene.place(time_signals(signals, second[0], second[1], theme).0, at);
    scene
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::edit::{Edit, Sketch};
    use crate::loom::report::{Held, Mend};
    use crate::loom::test_looms::ring;
    use crate::math::thin_plate::Rows;
    use crate::plot::Item;
    use crate::signal::warp::Warp;
    use crate::task::Task;
    use crate::world::MemoryWorld;

    fn circle(n: usize) -> Vec<Point> {
        let angle = |i: usize| 5.0 * i as f64 / n as f64;
        (0..n).map(|i| [angle(i).cos(), angle(i).sin()]).collect()
    }

    fn signals(positions: &[Point], controls: usize) -> (TimeSignal, PoseSignal) {
        let targets: Vec<f64> = positions.iter().flatten().copied().collect();
        let rows = Rows {
            positions,
            targets: &targets,
            width: 2,
            weights: None,
        };
        let pose = PoseSignal::fit(&rows, 6).unwrap().signal;
        (TimeSignal::fit(positions, controls, 0.5).unwrap(), pose)
    }

    #[test]
    fn series_are_the_signals_at_their_times() {
        let positions = circle(12);
        let (time, pose) = signals(&positions, 8);
        let fitted = Fitted {
            positions: &positions,
            pins: &[(2, positions[2])],
            errors: &[0.1; 12],
            astray: &[[3.0, 5.0]],
        };
        let (map, plots) = series(&time, &pose, &fitted);
        assert_eq!(
            (&map.advice, &plots.advice),
            (&vec![[3.0, 5.0]], &vec![[3.0, 5.0]])
        );
        assert_eq!(map.frames, positions);
        assert_eq!(map.pins, [(3, positions[2])]);
        assert_eq!((map.controls.len(), map.sites.len()), (8, 6));
        for (t, at) in map.times.iter().zip(&map.curve) {
            assert_eq!(time.at(*t), Some(*at));
        }
        assert_eq!((map.times[0], *map.times.last().unwrap()), (1.0, 12.0));
        for (frame, parameter) in plots.parameters.iter().zip(time.parameters()) {
            assert!((frame - parameter).abs() < 1e-12); // both are sums of the same intervals
        }
        assert_eq!(plots.rho.len(), plots.times.len());
        assert_eq!(plots.error.len(), 12);
    }

    #[test]
    fn frames_that_the_curve_has_left_are_not_linked_to_it() {
        let loom = ring(20, 15, false);
        let sketched = Edit::Path {
            points: vec![[0.1, 0.0], [0.2, 0.1], [0.1, 0.2]],
            sketch: Sketch::Through,
            frames: None,
        };
        let moved = Edit::MoveControl {
            control: 4,
            to: [0.2, 0.1],
        };
        let drawn = |edit: &Edit| plot_loom(&edit.apply(&loom, &Task::default()).unwrap().output).0;
        for edit in [sketched, Edit::Reverse] {
            let map = drawn(&edit);
            assert_eq!((map.frames.len(), &map.frames), (15, &map.reached));
            assert!(map.pins.is_empty());
        }
        assert_eq!(drawn(&moved).frames, loom.layout().positions);
    }

    #[test]
    fn a_loom_is_plotted_with_what_it_was_fitted_to() {
        let loom = ring(20, 15, false);
        let (map, plots) = plot_loom(&loom);
        assert_eq!(map.frames, loom.layout().positions);
        assert_eq!(map.sites, loom.pose().sites());
        assert_eq!(map.pins, [(3, [0.5, 0.25])]);
        assert_eq!(plots.frames.len(), loom.frames());
        assert!(caption(&loom).starts_with("15 frames, k = "));
        let world = MemoryWorld::new();
        save_plot(&world, &loom, &"a/pose.svg".into(), &Theme::dark()).unwrap();
        assert_eq!(world.paths(), [std::path::Path::new("a/pose.svg")]);
    }

    #[test]
    fn what_would_mend_a_span_is_told_and_shown() {
        let positions = circle(12);
        let (time, pose) = signals(&positions, 8);
        let (mut map, plots) = series(&time, &pose, &Fitted::default());
        let pin = Held {
            frame: 5,
            at: [2.0, 2.0],
        };
        let mend = Mend {
            change: Change::Pins(vec![pin]),
            left: 0.2,
        };
        let span = Span {
            first: 4,
            last: 6,
            mends: vec![mend],
            ..Span::default()
        };
        advise(&mut map, &[span]);
        assert_eq!(map.advised, [(5, [2.0, 2.0])]);
        let scene = figure(&map, &plots, "title", [900.0, 400.0], &Theme::light());
        let told = scene.items.iter().any(|item| match item {
            Item::Text(label) => label
                .text
                .contains("`--pin 5=2.0000,2.0000` would leave 20 %"),
            _ => false,
        });
        assert!(told, "{:?}", map.notes);
    }

    #[test]
    fn the_curve_passes_its_knots_at_the_marked_times() {
        let (time, pose) = signals(&circle(30), 11);
        let (_, plots) = series(&time, &pose, &Fitted::default());
        assert_eq!(plots.knots.len(), 11 - 4);
        let knots = time.curve().knots();
        for (t, knot) in plots.knots.iter().zip(&knots[3..]) {
            let rho = parameter(&time, *t).unwrap();
            let step = knots[knots.len() - 1] / 29.0; // rho bends little within a 24th of a frame
            assert!((rho - knot).abs() < step / 100.0, "{rho} {knot}");
        }
    }

    #[test]
    fn after_a_change_of_time_frames_lie_on_the_curve() {
        let positions = circle(12);
        let (time, pose) = signals(&positions, 8);
        let (curve, places) = (time.curve().clone(), time.places().to_vec());
        let warps = vec![Warp::Reverse { frames: 12 }];
        let back = TimeSignal::new(curve, places, time.slopes().to_vec(), warps).unwrap();
        let fitted = Fitted {
            positions: &positions,
            errors: &[0.1; 12],
            ..Fitted::default()
        };
        let (map, plots) = series(&back, &pose, &fitted);
        assert_eq!(map.frames, map.reached);
        assert!(plots.error.is_empty());
        assert!(plots.knots.is_sorted() && plots.knots.len() == 4);
    }

    #[test]
    fn still_and_lone_frames_give_a_figure_of_any_shape() {
        for n in [1, 2, 5] {
            let positions = vec![[2.0, 3.0]; n];
            let (time, pose) = signals(&positions, 4);
            let (map, plots) = series(&time, &pose, &Fitted::default());
            assert!(plots.knots.is_empty());
            for size in [[900.0, 400.0], [400.0, 900.0], [1.0, 1.0]] {
                let scene = figure(&map, &plots, "still", size, &Theme::dark());
                assert_eq!([scene.width, scene.height], size);
                assert!(scene.items.iter().any(|item| matches!(item, Item::Text(_))));
            }
        }
    }
}
