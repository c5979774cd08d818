//! One damped step: (H + mu diag H) v = descent, the fixed curve points staying where they are.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt;
use faer::prelude::{Reborrow, Solve};
use faer::{Mat, MatMut, Par, Side};

use super::Problem;
use super::normal::Normal;

/// A workspace for damped steps of one problem.
pub(super) struct Steps {
    /// The last step, in the order of H.
    pub(super) step: Vec<f64>,
    damped: Mat<f64>,
    right: Mat<f64>,
    /// Rows of the constraints over all unknowns, transposed; one column each.
    constraints: Mat<f64>,
    scratch: MemBuffer,
}

impl Steps {
    pub(super) fn new(problem: &Problem<'_>, sites: usize) -> Self {
        let controls = problem.spline.controls();
        let unknowns = 2 * (controls + sites);
        let fixed = problem.fixed.nrows();
        let mut constraints = Mat::zeros(unknowns, 2 * fixed);
        for a in 0..2 {
            for q in 0..fixed {
                for j in 0..controls {
                    constraints[(a * controls + j, a * fixed + q)] = problem.fixed[(q, j)];
                }
            }
        }
        let request =
            llt::factor::cholesky_in_place_scratch::<f64>(unknowns, Par::Seq, Default::default());
        Steps {
            step: vec![0.0; unknowns],
            damped: Mat::zeros(unknowns, unknowns),
            right: Mat::zeros(unknowns, 1 + 2 * fixed),
            constraints,
            scratch: MemBuffer::new(request),
        }
    }

    /// Solves for damping `mu`; the decrease that the model predicts, or nothing when H + mu diag H
    /// is not positive definite.
    pub(super) fn solve(&mut self, normal: &Normal, mu: f64) -> Option<f64> {
        let unknowns = self.step.len();
        let diagonal = |i: usize| normal.hessian[(i, i)];
        let largest = (0..unknowns).map(diagonal).fold(0.0, f64::max);
        let weight = |i: usize| mu * diagonal(i).max(1e-9 * largest);
        self.damped.copy_from(&normal.hessian);
        for i in 0..unknowns {
            self.damped[(i, i)] += weight(i);
            self.right[(i, 0)] = normal.descent[i];
        }
        let held = self.constraints.ncols();
        self.right
            .as_mut()
            .subcols_mut(1, held)
            .copy_from(&self.constraints);
        llt::factor::cholesky_in_place(
            self.damped.as_mut(),
            Default::default(),
            Par::Seq,
            MemStack::new(&mut self.scratch),
            Default::default(),
        )
        .ok()?;
        llt::solve::solve_in_place(
            self.damped.as_ref(),
            self.right.as_mut(),
            Par::Seq,
            MemStack::new(&mut self.scratch),
        );
        if held > 0 {
            self.hold_fixed();
        }
        let mut predicted = 0.0;
        for i in 0..unknowns {
            let step = self.right[(i, 0)];
            self.step[i] = step;
            predicted += step * normal.descent[i] + weight(i) * step * step;
        }
        predicted.is_finite().then_some(predicted)
    }

    /// Takes from the free step what would move the fixed points: v - H^-1 J^T (J H^-1 J^T)^-1 J v.
    fn hold_fixed(&mut self) {
        let held = self.constraints.ncols();
        let (step, images) = self.right.as_mut().split_at_col_mut(1);
        let images = images.rb();
        let mut gram = self.constraints.transpose() * images;
        let mut moved: Mat<f64> = self.constraints.transpose() * &step;
        let shift = 1e-13 * (0..held).map(|q| gram[(q, q)]).fold(0.0, f64::max);
        for q in 0..held {
            gram[(q, q)] += shift;
        }
        if let Ok(factor) = gram.llt(Side::Lower) {
            factor.solve_in_place(moved.as_mut());
            let mut step: MatMut<'_, f64> = step;
            step -= images * moved;
        }
    }
}
