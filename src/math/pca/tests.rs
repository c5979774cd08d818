//! What the decomposition has to keep, against closed forms and a direct one.

use nalgebra::DMatrix;

use super::*;

/// Rows with singular values 1, ratio, ratio^2, .. and `count` modes, plus a common offset.
fn graded(n: usize, d: usize, count: usize, ratio: f64, offset: f64) -> Vec<f64> {
    let mut values = vec![offset; n * d];
    for mode in 0..count {
        let size = ratio.powi(mode as i32);
        for (at, value) in values.iter_mut().enumerate() {
            let (i, c) = ((at / d) as f64, (at % d) as f64);
            let time = std::f64::consts::PI * (i + 0.5) / n as f64;
            let place = 12.9898 * (c + 1.0) * (mode as f64 + 1.0);
            *value += size * (time * (mode as f64 + 1.0)).cos() * place.sin();
        }
    }
    values
}

fn decompose(values: &[f64], d: usize, modes: usize) -> (Pca, Basis) {
    let (rows, task) = (Table::new(values, d), Task::default());
    let pca = Pca::new(&rows, &task).unwrap();
    let basis = pca.basis(&rows, modes, &task).unwrap();
    (pca, basis)
}

fn orthonormality(basis: &Basis, d: usize) -> f64 {
    let h = DMatrix::from_column_slice(d, basis.modes, &basis.vectors);
    (h.transpose() * &h - DMatrix::identity(basis.modes, basis.modes)).amax()
}

/// ||Y - X H^T|| / ||Y||, from the parts.
fn defect(values: &[f64], d: usize, pca: &Pca, basis: &Basis) -> f64 {
    let m = basis.modes;
    let error = |at: usize| {
        let (i, c) = (at / d, at % d);
        let modes = (0..m).map(|j| basis.coordinates[i * m + j] * basis.vectors[j * d + c]);
        values[at] - pca.mean()[c] - modes.sum::<f64>()
    };
    let squares: f64 = (0..values.len()).map(|at| error(at).powi(2)).sum();
    squares.sqrt() / pca.spread()
}

#[test]
fn agrees_with_a_direct_svd() {
    let (n, d) = (12, 50);
    let values = graded(n, d, 6, 0.3, 2.0);
    let (pca, basis) = decompose(&values, d, 3);
    let z = DMatrix::from_row_slice(n, d, &values);
    let mean = z.row_mean();
    let y = DMatrix::from_fn(n, d, |i, c| z[(i, c)] - mean[c]);
    let svd = y.clone().svd(true, true);
    for (j, value) in pca.singular_values().iter().take(6).enumerate() {
        // eigenvalues of the Gram matrix err by about 1e-15 of the largest
        let expected = svd.singular_values[j];
        assert!((value - expected).abs() <= 1e-13 * pca.spread().powi(2) / expected);
    }
    let v = svd.v_t.unwrap();
    for j in 0..3 {
        let dot: f64 = (0..d).map(|c| v[(j, c)] * basis.vectors[j * d + c]).sum();
        assert!(dot.abs() > 1.0 - 1e-12, "mode {j}: {dot}");
    }
    let left_out: f64 = svd.singular_values.iter().skip(3).map(|s| s * s).sum();
    assert!((basis.residual - left_out.sqrt()).abs() < 1e-12 * pca.spread());
    for (i, residual) in basis.residuals.iter().enumerate() {
        let rest = |c: usize| {
            let kept = |j: usize| basis.coordinates[i * 3 + j] * basis.vectors[j * d + c];
            y[(i, c)] - (0..3).map(kept).sum::<f64>()
        };
        let left_out = (0..d).map(|c| rest(c).powi(2)).sum::<f64>().sqrt();
        // squares differ by rounding of the whole, their roots by at most its root
        assert!((residual - left_out).abs() < 1e-7 * pca.spread());
    }
    assert!((pca.residual(3) - left_out.sqrt()).abs() < 1e-12 * pca.spread());
}

#[test]
fn all_modes_reproduce_every_row_however_fast_they_decay() {
    for ratio in [0.9, 0.3, 0.03] {
        for (scale, offset) in [(1.0, 0.0), (1e8, 0.0), (1e-8, 0.0), (1.0, 100.0)] {
            let (n, d) = (20, 90);
            let mut values = graded(n, d, 19, ratio, offset);
            values.iter_mut().for_each(|z| *z *= scale);
            let (pca, basis) = decompose(&values, d, n - 1);
            // the QR's bound is rounding; the rank cut adds 1e-13 a mode
            assert!(orthonormality(&basis, d) < 1e-13, "ratio {ratio}");
            assert!(defect(&values, d, &pca, &basis) < 1e-11, "ratio {ratio}");
            assert!(basis.residual < 1e-11 * pca.spread());
            let squares: f64 = basis
                .residuals
                .iter()
                .map(|residual| residual.powi(2))
                .sum();
            assert!((squares.sqrt() - basis.residual).abs() <= 1e-12 * basis.residual);
        }
    }
}

#[test]
fn rank_is_found_and_modes_above_it_are_not_made() {
    for (rank, ratio) in [(1, 1.0), (3, 0.1), (3, 1e-4), (2, 1e-10)] {
        let (n, d) = (10, 60);
        let values = graded(n, d, rank, ratio, 0.0);
        let (pca, basis) = decompose(&values, d, n - 1);
        assert_eq!((basis.rank, basis.modes), (rank, rank), "ratio {ratio}");
        assert!(orthonormality(&basis, d) < 1e-13);
        assert!(defect(&values, d, &pca, &basis) < 1e-12);
    }
}

#[test]
fn rows_that_do_not_differ_have_no_modes() {
    for n in [1, 2, 7] {
        let values: Vec<f64> = (0..n * 30).map(|at| (at % 30) as f64 * 0.1).collect();
        let (pca, basis) = decompose(&values, 30, n - 1);
        assert_eq!((pca.spread(), basis.rank, basis.modes), (0.0, 0, 0));
        assert_eq!(basis.residual, 0.0);
        assert!(basis.coordinates.is_empty());
    }
}

#[test]
fn the_largest_entry_of_each_coordinate_is_positive() {
    let (_, basis) = decompose(&graded(9, 40, 5, 0.5, 0.0), 40, 5);
    for j in 0..5 {
        let column = basis.coordinates.iter().skip(j).step_by(5);
        let largest = column.fold(0.0_f64, |a, &x| if x.abs() > a.abs() { x } else { a });
        assert!(largest > 0.0);
    }
}

#[test]
fn reduced_rows_keep_distances() {
    let (n, d) = (15, 80);
    let values = graded(n, d, 8, 0.4, 1.0);
    let pca = Pca::new(&Table::new(&values, d), &Task::default()).unwrap();
    let reduced = pca.reduced();
    let distance = |values: &[f64], d: usize, i: usize, j: usize| {
        let pairs = values[i * d..(i + 1) * d].iter().zip(&values[j * d..]);
        pairs.map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt()
    };
    for (i, j) in [(0, 1), (3, 14), (7, 8)] {
        let difference = distance(&values, d, i, j) - distance(&reduced, n, i, j);
        // the root of the Gram matrix's rounding
        assert!(difference.abs() < 1e-8 * pca.spread());
    }
}

#[test]
fn the_number_of_threads_does_not_show() {
    let (n, d) = (7, 70_000);
    let values = graded(n, d, 6, 0.2, 3.0);
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        let (pca, basis) = pool.unwrap().install(|| decompose(&values, d, 6));
        (pca.mean, pca.singular, basis)
    };
    assert_eq!(run(1), run(2));
}

#[test]
fn cancelled_work_and_infinite_numbers_are_errors() {
    let task = Task::default();
    let values = [1.0, f64::INFINITY, 0.0, 1.0];
    let error = Pca::new(&Table::new(&values, 2), &task).unwrap_err();
    assert_eq!(error, PcaError::NotFinite);
    task.cancel();
    let error = Pca::new(&Table::new(&[1.0, 2.0], 1), &task).unwrap_err();
    assert_eq!(error, PcaError::Cancelled);
}
