use super::*;
use faer::linalg::solvers::SolveLstsq;

/// Numbers in \[-1, 1\] from a fixed seed.
pub(crate) fn noise(seed: u64) -> impl FnMut() -> f64 {
    let mut state = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1;
    move || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }
}

struct Small {
    spline: UniformDesign,
    targets: Mat<f64>,
    weights: Vec<f64>,
    controls: Mat<f64>,
    sites: Mat<f64>,
    zero: Mat<f64>,
    none: Mat<f64>,
}

/// 31 samples of a closed wave in R^4, 9 control points near a circle, 7 sites beside it.
fn small() -> Small {
    let length = 10.0;
    let times: Vec<f64> = (0..31).map(|i| i as f64 / 3.0).collect();
    let spline = UniformDesign::new(9, length, &times);
    let mut random = noise(3);
    let angle = |i: usize, n: usize| i as f64 / n as f64 * 5.0;
    let targets = Mat::from_fn(31, 4, |i, c| (angle(i, 31) * (1.0 + c as f64)).sin());
    let mut around = |n: usize, radius: f64| {
        Mat::from_fn(n, 2, |i, a| {
            let angle = angle(i, n);
            radius * [angle.cos(), angle.sin()][a] + 0.1 * random()
        })
    };
    Small {
        spline,
        targets,
        weights: (0..31).map(|i| 1.0 + (i % 3) as f64).collect(),
        controls: around(9, 1.0),
        sites: around(7, 0.9),
        zero: Mat::zeros(9, 9),
        none: Mat::zeros(0, 9),
    }
}

impl Small {
    fn problem(&self) -> Problem<'_> {
        Problem {
            spline: &self.spline,
            targets: self.targets.as_ref(),
            weights: &self.weights,
            anchor: self.controls.as_ref(),
            hold: self.zero.as_ref(),
            bending: self.zero.as_ref(),
            fixed: self.none.as_ref(),
            site_hold: 0.0,
        }
    }

    /// Squared residual with control points and sites moved by `step` (in the order of H).
    fn value(&self, step: &[f64], ridge: f64) -> f64 {
        let (k, l) = (9, 7);
        let controls = Mat::from_fn(k, 2, |i, a| self.controls[(i, a)] + step[a * k + i]);
        let sites = Mat::from_fn(l, 2, |j, a| self.sites[(j, a)] + step[2 * k + a * l + j]);
        let mut design = Design::new(&self.weights, l, 4, ridge);
        let points = self.spline.apply(controls.as_ref());
        design.solve(points.as_ref(), sites.as_ref(), self.targets.as_ref())
    }
}

#[test]
fn the_gradient_is_the_derivative_of_the_projected_residual() {
    let small = small();
    let mut state = State::new(
        &small.problem(),
        small.controls.as_ref(),
        small.sites.as_ref(),
        0.0,
    );
    let mut normal = Normal::new(&small.spline, 7, 4);
    state.linearise(&small.problem(), &mut normal);
    let scale = normal
        .descent
        .iter()
        .fold(0.0f64, |max, x| max.max(x.abs()));
    for unknown in 0..32 {
        let h = 1e-5;
        let mut step = vec![0.0; 32];
        step[unknown] = h;
        let ahead = small.value(&step, 0.0);
        step[unknown] = -h;
        let behind = small.value(&step, 0.0);
        let difference = -0.25 * (ahead - behind) / h;
        // Central differences: h^2 of truncation, 1e-16 / h of rounding.
        assert!(
            (difference - normal.descent[unknown]).abs() < 1e-7 * scale,
            "{unknown}: {difference} against {}",
            normal.descent[unknown]
        );
    }
}

/// Kaufman's Jacobian -M D v column by column: differences of the plate with its coefficients kept,
/// except for what the side conditions at moved sites take from them.
#[test]
fn the_hessian_is_that_of_the_explicit_jacobian() {
    let small = small();
    let problem = small.problem();
    let mut state = State::new(&problem, small.controls.as_ref(), small.sites.as_ref(), 0.0);
    let mut normal = Normal::new(&small.spline, 7, 4);
    state.linearise(&problem, &mut normal);
    let mut basis = Mat::zeros(31 + 7, 7);
    state.design.orthonormal(&mut basis);
    let basis = basis.as_ref().subrows(0, 31).to_owned();
    let (k, l, m) = (9, 7, 4);
    let mut jacobian = Mat::<f64>::zeros(31 * m, 2 * (k + l));
    for unknown in 0..2 * (k + l) {
        let moved = |h: f64| {
            let mut controls = small.controls.clone();
            let mut plate = state.plate.clone();
            if unknown < 2 * k {
                controls[(unknown % k, unknown / k)] += h;
            } else {
                plate.sites[((unknown - 2 * k) % l, (unknown - 2 * k) / l)] += h;
                let sides = Mat::from_fn(l, 3, |j, c| match c {
                    0 => 1.0,
                    c => plate.sites[(j, c - 1)],
                });
                let broken = sides.qr().solve_lstsq(&plate.weights);
                plate.weights -= &sides * broken;
            }
            plate.at(small.spline.apply(controls.as_ref()).as_ref())
        };
        let change = (moved(1e-6) - moved(-1e-6)) * faer::Scale(0.5e6);
        let column = Mat::from_fn(31, m, |i, c| small.weights[i] * change[(i, c)]);
        let free = &column - &basis * (basis.transpose() * &column);
        for c in 0..m {
            for i in 0..31 {
                jacobian[(c * 31 + i, unknown)] = free[(i, c)];
            }
        }
    }
    let mut expected = jacobian.transpose() * &jacobian;
    let scale = expected.norm_max();
    expected -= &normal.hessian;
    // Central differences with h = 1e-6: 1e-10 of rounding, squared sums of 124 terms.
    assert!(expected.norm_max() < 1e-7 * scale);
}

#[test]
fn refinement_decreases_and_keeps_fixed_points() {
    let small = small();
    let fixed = Mat::from_fn(1, 9, |_, j| {
        let (first, weights) = small.spline.row(12);
        j.checked_sub(first)
            .and_then(|a| weights.get(a))
            .copied()
            .unwrap_or(0.0)
    });
    let problem = Problem {
        fixed: fixed.as_ref(),
        ..small.problem()
    };
    let before = small.spline.apply(small.controls.as_ref());
    let refined = refine(
        &problem,
        small.controls.as_ref(),
        small.sites.as_ref(),
        &Options::default(),
        &Task::default(),
    )
    .unwrap();
    assert!(refined.history.is_sorted_by(|a, b| a > b));
    assert!(refined.history.last().unwrap() < &(0.2 * refined.history[0]));
    let after = small.spline.apply(refined.controls.as_ref());
    for a in 0..2 {
        assert!((after[(12, a)] - before[(12, a)]).abs() < 1e-10);
    }
}

/// Squared weighted residual of the plate of least squares over `sites`.
fn missed(small: &Small, points: &Mat<f64>, sites: &Mat<f64>) -> f64 {
    let (targets, weights) = (small.targets.as_ref(), &small.weights[..]);
    let plate = fit_plate(points.as_ref(), targets, weights, sites.as_ref());
    let left = &small.targets - plate.at(points.as_ref());
    (0..left.nrows())
        .map(|i| (weights[i] * left.row(i).norm_l2()).powi(2))
        .sum()
}

#[test]
fn the_exchanged_site_is_the_one_missed_least_and_comes_where_it_gains_most() {
    let small = small();
    let points = small.spline.apply(small.controls.as_ref());
    let sites = &small.sites;
    let count = sites.nrows();
    let rows = |rows: Vec<[f64; 2]>| Mat::from_fn(rows.len(), 2, |j, a| rows[j][a]);
    let place = |of: &Mat<f64>, j: usize| [of[(j, 0)], of[(j, 1)]];
    let others = |gone: usize| -> Vec<[f64; 2]> {
        let stay = (0..count).filter(|&j| j != gone);
        stay.map(|j| place(sites, j)).collect()
    };
    // All that can be tried, tried.
    let without = |gone: &usize| missed(&small, &points, &rows(others(*gone)));
    let gone = (0..count)
        .min_by(|a, b| without(a).total_cmp(&without(b)))
        .unwrap();
    let with = |i: usize| {
        let mut all = others(gone);
        all.push(place(&points, i));
        missed(&small, &points, &rows(all))
    };
    let least = (0..points.nrows()).map(with).fold(f64::INFINITY, f64::min);
    let moved = exchange(
        points.as_ref(),
        small.targets.as_ref(),
        &small.weights,
        sites.as_ref(),
        1,
        points.as_ref(),
    );
    for (j, stays) in others(gone).into_iter().enumerate() {
        assert_eq!(place(&moved, j), stays);
    }
    // The same sums in another order, of a problem whose condition is some thousands.
    let found = missed(&small, &points, &moved);
    assert!((found / least - 1.0).abs() < 1e-8, "{found} {least}");
}

#[test]
fn of_two_sites_in_one_place_one_goes_where_it_is_wanted() {
    let small = small();
    let points = small.spline.apply(small.controls.as_ref());
    let plate = fit_plate(
        points.as_ref(),
        small.targets.as_ref(),
        &small.weights,
        small.sites.as_ref(),
    );
    let targets = plate.at(points.as_ref());
    let mut crowded = small.sites.clone();
    for a in 0..2 {
        crowded[(2, a)] = crowded[(3, a)];
    }
    let moved = exchange(
        points.as_ref(),
        targets.as_ref(),
        &small.weights,
        crowded.as_ref(),
        1,
        small.sites.as_ref(),
    );
    let found = fit_plate(
        points.as_ref(),
        targets.as_ref(),
        &small.weights,
        moved.as_ref(),
    );
    let left = (&targets - found.at(points.as_ref())).norm_l2();
    // The ridge of 1e-12 leaves its square root.
    assert!(left < 1e-5 * targets.norm_l2(), "{left}");
}

#[test]
fn four_sites_and_fewer_stay_and_so_do_sites_without_a_candidate() {
    let small = small();
    let points = small.spline.apply(small.controls.as_ref());
    let with = |sites: MatRef<'_, f64>, candidates: MatRef<'_, f64>| {
        let (points, targets) = (points.as_ref(), small.targets.as_ref());
        exchange(points, targets, &small.weights, sites, 3, candidates)
    };
    let four = small.sites.as_ref().subrows(0, 4);
    assert_eq!(with(four, points.as_ref()), four);
    let sites = small.sites.as_ref();
    let none = with(sites, sites.subrows(0, 0));
    for j in 0..sites.nrows() {
        let same = |i: usize| none.row(i) == sites.row(j);
        assert!((0..sites.nrows()).any(same));
    }
}
