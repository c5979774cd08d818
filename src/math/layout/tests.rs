use super::*;

/// Points on a bent, twisted curve in R^4: not embeddable in the plane.
fn curve(n: usize) -> Vec<f64> {
    let point = |i: usize| {
        let t = i as f64 * 6.0 / n as f64;
        [t.cos(), (2.0 * t).sin(), 0.4 * (3.0 * t).cos(), 0.1 * t]
    };
    (0..n).flat_map(point).collect()
}

fn leading(points: &[f64], dimension: usize) -> Vec<Point> {
    points.chunks(dimension).map(|p| [p[0], p[1]]).collect()
}

fn run(distances: &Distances, start: &[Point], pins: &[(usize, Point)], steps: usize) -> Layout {
    let stop = Stop {
        steps,
        ..Stop::default()
    };
    solve(distances, start, pins, &stop, &Task::default()).unwrap()
}

#[test]
fn planar_distances_are_met() {
    let points: Vec<f64> = (0..40)
        .flat_map(|i| {
            let t = f64::from(i);
            [t.sin() * t, t.cos() + t]
        })
        .collect();
    let distances = Distances::between(&points, 2);
    let start: Vec<Point> = (0..40)
        .map(|i| [f64::from(i), f64::from(i * i % 17)])
        .collect();
    let layout = run(&distances, &start, &[], 2000);
    // the stop is at a relative change of the stress, whose root is quadratically flat
    assert!(layout.relative_stress < 1e-4, "{}", layout.relative_stress);
    let exact = run(&distances, &leading(&points, 2), &[], 2000);
    assert!(exact.converged && exact.relative_stress < 1e-14 && exact.steps < 5);
}

#[test]
fn the_stress_never_rises() {
    let points = curve(60);
    let distances = Distances::between(&points, 4);
    for pins in [
        vec![],
        vec![(3, [0.0, 0.0]), (40, [1.0, 0.5]), (50, [-1.0, 0.5])],
    ] {
        let mut last = f64::INFINITY;
        for steps in 1..60 {
            let stress = run(&distances, &leading(&points, 4), &pins, steps).stress;
            assert!(
                stress <= last * (1.0 + 1e-14),
                "step {steps}: {last} to {stress}"
            );
            last = stress;
        }
    }
}

#[test]
fn the_end_is_a_stationary_point() {
    let points = curve(50);
    let distances = Distances::between(&points, 4);
    let weights: Vec<f64> = (0..50 * 49 / 2).map(|at| 1.0 + f64::from(at % 7)).collect();
    let pins = [(0, [0.2, 0.1]), (20, [-0.5, 0.7])];
    for (weights, pins) in [
        (None, &[][..]),
        (None, &pins[..]),
        (Some(&weights[..]), &[][..]),
        (Some(&weights[..]), &pins[..]),
    ] {
        let start = leading(&points, 4);
        let stop = Stop {
            change: 1e-14,
            steps: 5000,
        };
        let layout = majorise(&distances, weights, &start, pins, &stop, &Task::default()).unwrap();
        let mut gradient = vec![[0.0, 0.0]; 50];
        for i in 0..50 {
            for j in (0..50).filter(|&j| j != i) {
                let (p, q) = (layout.positions[i], layout.positions[j]);
                let length = (p[0] - q[0]).hypot(p[1] - q[1]);
                let weight =
                    weights.map_or(1.0, |w| w[row_start(50, i.min(j)) + i.abs_diff(j) - 1]);
                let factor = weight * (1.0 - distances.get(i, j) / length);
                (0..2).for_each(|a| gradient[i][a] += factor * (p[a] - q[a]));
            }
        }
        for (i, g) in gradient
            .iter()
            .enumerate()
            .filter(|(i, _)| pins.iter().all(|pin| pin.0 != *i))
        {
            // a change of 1e-14 of the stress leaves a gradient of about its root, times 50 pairs
            assert!(g[0].hypot(g[1]) < 1e-5, "{i}: {g:?}");
        }
    }
}

#[test]
fn unit_weights_are_no_weights() {
    let points = curve(30);
    let distances = Distances::between(&points, 4);
    let ones = vec![1.0; 30 * 29 / 2];
    let stop = Stop {
        steps: 12,
        ..Stop::default()
    };
    for pins in [
        vec![],
        vec![(2, [0.0, 1.0])],
        vec![(2, [0.0, 1.0]), (9, [1.0, 0.0])],
    ] {
        let start = leading(&points, 4);
        let with = majorise(
            &distances,
            Some(&ones),
            &start,
            &pins,
            &stop,
            &Task::default(),
        )
        .unwrap();
        let without = majorise(&distances, None, &start, &pins, &stop, &Task::default()).unwrap();
        for (p, q) in with.positions.iter().zip(&without.positions) {
            // a dozen steps of rounding
            assert!((p[0] - q[0]).hypot(p[1] - q[1]) < 1e-10);
        }
    }
}

#[test]
fn pinned_positions_stay_exactly() {
    let points = curve(45);
    let distances = Distances::between(&points, 4);
    let pins = [(44, [0.1, 0.2]), (7, [1.0 / 3.0, -0.7]), (20, [5.0, 5.0])];
    for count in 1..=3 {
        let layout = run(&distances, &leading(&points, 4), &pins[..count], 2000);
        for &(frame, pin) in &pins[..count] {
            assert_eq!(layout.positions[frame], pin);
        }
    }
}

#[test]
fn one_pin_only_translates() {
    let points = curve(45);
    let distances = Distances::between(&points, 4);
    let free = run(&distances, &leading(&points, 4), &[], 2000);
    let pinned = run(&distances, &leading(&points, 4), &[(5, [3.0, -2.0])], 2000);
    let [x, y] = free.positions[5];
    for (p, q) in free.positions.iter().zip(&pinned.positions) {
        assert!((p[0] - x + 3.0 - q[0]).hypot(p[1] - y - 2.0 - q[1]) < 1e-14);
    }
}

#[test]
fn turned_mirrored_and_scaled_starts_give_the_same_layout() {
    let points = curve(45);
    let distances = Distances::between(&points, 4);
    let layout = run(&distances, &leading(&points, 4), &[], 2000);
    let moved: Vec<Point> = leading(&points, 4)
        .iter()
        .map(|[x, y]| [7.0 + 0.8 * x - 0.6 * y, -(0.6 * x + 0.8 * y)])
        .collect();
    let turned = run(&distances, &moved, &[], 2000);
    for (p, q) in layout.positions.iter().zip(&turned.positions) {
        // both stop at a change of 1e-9 of the stress: its root, times the flatness of a ring
        assert!((p[0] - q[0]).hypot(p[1] - q[1]) < 1e-3, "{p:?} {q:?}");
    }
    for scale in [1e8, 1e-8] {
        let scaled: Vec<f64> = points.iter().map(|x| x * scale).collect();
        let again = run(
            &Distances::between(&scaled, 4),
            &leading(&scaled, 4),
            &[],
            2000,
        );
        assert!((again.relative_stress - layout.relative_stress).abs() < 1e-9);
    }
}

#[test]
fn coincident_and_few_positions_are_defined() {
    for n in 0..4 {
        let layout = run(
            &Distances::from_fn(n, |_, _| 0.0),
            &vec![[0.0, 0.0]; n],
            &[],
            2000,
        );
        assert_eq!(layout.positions, vec![[0.0, 0.0]; n]);
        assert!(layout.converged && layout.relative_stress == 0.0);
    }
    let layout = run(
        &Distances::from_fn(2, |_, _| 3.0),
        &[[0.0, 0.0], [1.0, 0.0]],
        &[],
        2000,
    );
    let [p, q] = [layout.positions[0], layout.positions[1]];
    assert!(((p[0] - q[0]).hypot(p[1] - q[1]) - 3.0).abs() < 1e-12);
}

#[test]
fn weights_that_fall_into_parts_are_an_error() {
    let distances = Distances::from_fn(4, |_, _| 1.0);
    let mut weights = vec![0.0; 6];
    (weights[0], weights[5]) = (1.0, 1.0);
    let start = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]];
    let result = majorise(
        &distances,
        Some(&weights),
        &start,
        &[],
        &Stop::default(),
        &Task::default(),
    );
    assert_eq!(result, Err(LayoutError::Loose));
}

#[test]
fn the_number_of_threads_does_not_show() {
    let points = curve(420);
    let distances = Distances::between(&points, 4);
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| run(&distances, &leading(&points, 4), &[], 40))
    };
    assert_eq!(run(1), run(2));
}
