//! What curves through keys keep, and how handles and bounds bend them.

use proptest::prelude::*;

use super::super::cubic_spline::CubicSpline;
use super::*;

const TIMES: [f64; 6] = [0.0, 1.0, 1.5, 4.0, 5.0, 7.0];
const ROWS: [f64; 6] = [0.3, -2.0, 1.0, 1.2, -0.5, 0.3];

fn spline(ends: Ends<'_>, handles: &[Handle], overshoot: Option<f64>) -> KeySpline {
    let controls = Controls { handles, overshoot };
    KeySpline::new(&TIMES, &ROWS, 1, ends, controls).unwrap()
}

fn one(of: impl Fn(&mut [f64])) -> f64 {
    let mut out = [0.0];
    of(&mut out);
    out[0]
}

fn value(spline: &KeySpline, t: f64) -> f64 {
    one(|out| spline.evaluate(t, out))
}

fn slope(spline: &KeySpline, t: f64) -> f64 {
    one(|out| spline.derivative(t, out))
}

fn second(spline: &KeySpline, t: f64) -> f64 {
    one(|out| spline.second(t, out))
}

fn handle(tension: f64, continuity: f64, bias: f64) -> Handle {
    Handle {
        tension,
        continuity,
        bias,
    }
}

const CLAMPED: Ends<'static> = Ends::Clamped {
    first: &[0.7],
    last: &[-3.0],
};

#[test]
fn without_handles_it_is_the_cubic_spline() {
    for ends in [Ends::Natural, Ends::NotAKnot, Ends::Periodic, CLAMPED] {
        let expected = CubicSpline::new(&TIMES, &ROWS, 1, ends).unwrap();
        let found = spline(ends, &[], None);
        for step in 0..=70 {
            let t = 0.1 * f64::from(step);
            let known = one(|out| expected.evaluate(t, out));
            // a few roundings of numbers up to 30
            assert!((value(&found, t) - known).abs() < 1e-13, "{ends:?} {t}");
            let known = one(|out| expected.derivative(t, out));
            assert!((slope(&found, t) - known).abs() < 1e-12, "{ends:?} {t}");
        }
    }
}

#[test]
fn derivatives_are_those_of_the_values() {
    let handles = [handle(0.0, 0.0, 0.0), handle(0.2, 0.0, -0.4)];
    let handles: Vec<Handle> = handles.iter().cycle().take(6).copied().collect();
    let spline = spline(Ends::Natural, &handles, None);
    let step = 1e-5;
    for t in [-1.0, 0.2, 1.2, 3.0, 4.5, 6.9, 8.0] {
        let rise = (value(&spline, t + step) - value(&spline, t - step)) / (2.0 * step);
        // the third derivative times step^2, and rounding over step
        assert!((rise - slope(&spline, t)).abs() < 1e-8, "{t}");
        let bend = (slope(&spline, t + step) - slope(&spline, t - step)) / (2.0 * step);
        assert!((bend - second(&spline, t)).abs() < 1e-8, "{t}");
    }
}

/// Jumps of slope and second derivative at a key.
fn jumps(spline: &KeySpline, t: f64) -> [f64; 2] {
    let before = t - 1e-9;
    [
        (slope(spline, t) - slope(spline, before)).abs(),
        (second(spline, t) - second(spline, before)).abs(),
    ]
}

#[test]
fn a_handle_leaves_the_curve_twice_smooth_at_the_other_keys() {
    for ends in [Ends::Natural, Ends::Periodic, CLAMPED] {
        for turned in [1, 2, 4] {
            let mut handles = [Handle::default(); 6];
            handles[turned] = handle(0.5, 0.0, 0.3);
            let spline = spline(ends, &handles, None);
            for i in 1..5 {
                let [slope, second] = jumps(&spline, TIMES[i]);
                // 1e-9 of derivatives up to 100
                assert!(slope < 1e-6, "{ends:?} {turned} {i}");
                assert!(second < 1e-6 || i == turned, "{ends:?} {turned} {i}");
            }
        }
    }
}

#[test]
fn handles_are_those_of_kochanek_and_bartels_about_the_curve_s_own_slope() {
    let own = slope(&spline(Ends::Natural, &[], None), TIMES[2]);
    let secant = |i: usize| (ROWS[i + 1] - ROWS[i]) / (TIMES[i + 1] - TIMES[i]);
    let (before, after) = (secant(1), secant(2));
    let turned = |handle: Handle| {
        let mut handles = [Handle::default(); 6];
        handles[2] = handle;
        let spline = spline(Ends::Natural, &handles, None);
        [slope(&spline, TIMES[2] - 1e-12), slope(&spline, TIMES[2])]
    };
    let near = |found: [f64; 2], known: [f64; 2]| {
        assert!((found[0] - known[0]).abs() < 1e-9, "{found:?} {known:?}");
        assert!((found[1] - known[1]).abs() < 1e-9, "{found:?} {known:?}");
    };
    near(turned(handle(1.0, 0.0, 0.0)), [0.0, 0.0]);
    near(turned(handle(0.5, 0.0, 0.0)), [0.5 * own; 2]);
    let shift = 0.5 * (before - after);
    near(turned(handle(0.0, 0.0, 1.0)), [own + shift; 2]);
    near(turned(handle(0.0, -1.0, 0.0)), [own + shift, own - shift]);
}

#[test]
fn full_tension_everywhere_stays_between_the_keys() {
    let handles = [handle(1.0, 0.0, 0.0); 6];
    for ends in [Ends::Natural, Ends::Periodic, CLAMPED] {
        let spline = spline(ends, &handles, None);
        for step in 0..=700 {
            let t = 0.01 * f64::from(step);
            let i = TIMES.partition_point(|&time| time <= t).clamp(1, 5) - 1;
            let (low, high) = (ROWS[i].min(ROWS[i + 1]), ROWS[i].max(ROWS[i + 1]));
            assert!((low - 1e-15..=high + 1e-15).contains(&value(&spline, t)));
        }
    }
}

#[test]
fn periodic_curves_go_round_and_gain_what_a_period_gains() {
    let rows = [0.3, -2.0, 1.0, 1.2, -0.5, 2.3];
    let gaining = KeySpline::new(&TIMES, &rows, 1, Ends::Periodic, Controls::default()).unwrap();
    for t in [0.0, 0.4, 3.3, 6.99] {
        let (here, next) = (value(&gaining, t), value(&gaining, t + 7.0));
        assert!((next - here - 2.0).abs() < 1e-13);
        assert!((value(&gaining, t - 14.0) - here + 4.0).abs() < 1e-13);
        assert!((slope(&gaining, t + 7.0) - slope(&gaining, t)).abs() < 1e-12);
    }
    let [slope, second] = [slope, second].map(|of| of(&gaining, 7.0 - 1e-9) - of(&gaining, 0.0));
    assert!(slope.abs() < 1e-6 && second.abs() < 1e-6);
}

#[test]
fn beyond_the_ends_it_goes_on_straight() {
    let spline = spline(CLAMPED, &[], None);
    assert!((value(&spline, -2.0) - (0.3 - 2.0 * 0.7)).abs() < 1e-14);
    assert!((value(&spline, 9.0) - (0.3 - 2.0 * 3.0)).abs() < 1e-13);
    assert_eq!(second(&spline, 9.0), 0.0);
}

#[test]
fn one_key_is_a_constant_two_a_line_none_an_error() {
    let of = |n: usize, t: f64| {
        let rows = &ROWS[..n];
        KeySpline::new(&TIMES[..n], rows, 1, Ends::Natural, Controls::default())
            .map(|spline| value(&spline, t))
    };
    assert_eq!(of(1, 5.0), Ok(0.3));
    assert!((of(2, 0.25).unwrap() - (0.3 - 0.25 * 2.3)).abs() < 1e-15);
    assert_eq!(of(0, 0.0), Err(SplineError::Counts));
}

#[test]
fn the_same_rows_at_other_times_are_the_spline_of_those_times() {
    let times = [0.0, 2.0, 2.5, 4.0, 6.0, 8.0];
    let handles = [handle(0.5, 0.0, 0.3); 6];
    let controls = Controls {
        handles: &handles,
        overshoot: Some(0.1),
    };
    for ends in [Ends::Natural, Ends::Periodic] {
        let again = spline(ends, &[], None).again(&times, controls).unwrap();
        let known = KeySpline::new(&times, &ROWS, 1, ends, controls).unwrap();
        assert_eq!(again, known);
    }
    assert_eq!(spline(CLAMPED, &[], None).again(&times, controls), None);
    let natural = spline(Ends::Natural, &[], None);
    for times in [&times[1..], &[0.0, 2.0, 1.0, 4.0, 6.0, 8.0]] {
        assert_eq!(natural.again(times, controls), None);
    }
}

#[test]
fn many_columns_are_many_curves() {
    let width = 2 * COLUMNS + 7;
    let rows: Vec<f64> = (0..6 * width)
        .map(|at| ROWS[at / width] * (1.0 + (at % width) as f64))
        .collect();
    let many = KeySpline::new(&TIMES, &rows, width, Ends::Natural, Controls::default());
    let mut found = vec![0.0; width];
    many.unwrap().evaluate(2.2, &mut found);
    let known = value(&spline(Ends::Natural, &[], None), 2.2);
    for (j, found) in found.iter().enumerate() {
        let known = known * (1.0 + j as f64);
        assert!((found - known).abs() <= 1e-12 * known.abs());
    }
}

proptest! {
    /// The bound holds for any keys, handles, ends and shares; 0 keeps the shape.
    #[test]
    fn no_coordinate_leaves_its_range_by_more_than_the_share(
        rows in prop::collection::vec(-1.0..1.0_f64, 7),
        gaps in prop::collection::vec(0.01..3.0_f64, 6),
        handles in prop::collection::vec(prop::array::uniform3(-1.0..1.0_f64), 7),
        share in prop::sample::select(vec![0.0, 0.01, 0.1, 0.5, 3.0]),
        kind in 0..3,
        turned in any::<bool>(),
    ) {
        let mut times = vec![0.0];
        gaps.iter().for_each(|gap| times.push(times[times.len() - 1] + gap));
        let ends = [Ends::Natural, Ends::Periodic, CLAMPED][kind as usize];
        let handles: Vec<Handle> =
            handles.iter().map(|&[t, c, b]| handle(t, c, b)).collect();
        let handles = if turned { &handles[..] } else { &[] };
        let controls = Controls { handles, overshoot: Some(share) };
        let spline = KeySpline::new(&times, &rows, 1, ends, controls).unwrap();
        for i in 0..6 {
            let (low, high) = (rows[i].min(rows[i + 1]), rows[i].max(rows[i + 1]));
            let room = share * (high - low) + 1e-14; // rounding of sums of numbers below 3
            let mut before = rows[i];
            for step in 0..=40 {
                let t = times[i] + gaps[i] * f64::from(step) / 40.0;
                let here = value(&spline, t);
                prop_assert!((low - room..=high + room).contains(&here));
                if share == 0.0 {
                    let rising = (here - before) * (rows[i + 1] - rows[i]).signum();
                    prop_assert!(rising >= -1e-14);
                }
                before = here;
            }
        }
    }
}
