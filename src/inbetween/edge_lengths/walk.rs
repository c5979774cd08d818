//! Closed walks: their error (equations 2 and 3 of Rojas et al. 2014) and how it changes with the
//! dihedral angles.
//!
//! Rotations are unit quaternions. With q = (w, v) the product Z0 X0 .. Zk Xk of a walk, w >= 0, the
//! rotation vector r = 2 v has |Z0 X0 .. Zk Xk - I|_F^2 = 2 |r|^2: equation (3) is a sum of squares, and
//! its derivatives are exact, not only near a solution.

use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use rayon::prelude::*;

use super::fans::{Fan, Fans, NO_HINGE};

/// Fans that one thread takes at a time.
const CHUNK: usize = 512;

/// Half of an angle as a rotation about one axis: its cosine and sine.
type Half = [f64; 2];

/// cos and sin of half an angle.
pub(super) fn half(angle: f64) -> Half {
    let (sine, cosine) = libm::sincos(0.5 * angle);
    [cosine, sine]
}

/// The errors of all walks, and the columns of their Jacobian.
#[derive(Debug, Clone, Default)]
pub(super) struct Errors {
    /// r of each fan; zero where it is open.
    pub(super) residuals: Vec<Vector3<f64>>,
    /// For each step of a closed fan dr / d(angle of its hinge).
    pub(super) columns: Vec<Vector3<f64>>,
}

impl Errors {
    /// E(A), equation (3).
    pub(super) fn energy(&self) -> f64 {
        2.0 * self
            .residuals
            .iter()
            .map(Vector3::norm_squared)
            .sum::<f64>()
    }
}

/// Corner angles as rotations about z.
pub(super) fn corner_halves(angles: &[f64]) -> Vec<Half> {
    let each = angles.par_iter().with_min_len(CHUNK);
    each.map(|&angle| half(angle)).collect()
}

impl Fans {
    /// Walks around every closed fan.
    pub(super) fn errors(&self, corners: &[Half], dihedrals: &[f64]) -> Errors {
        let turns: Vec<Half> = dihedrals
            .par_iter()
            .with_min_len(CHUNK)
            .map(|&a| half(a))
            .collect();
        let parts: Vec<Errors> = self
            .fans
            .par_chunks(CHUNK)
            .map(|fans| {
                let mut columns = Vec::new();
                let errors = fans
                    .iter()
                    .map(|fan| self.error(fan, corners, &turns, &mut columns));
                Errors {
                    residuals: errors.collect(),
                    columns,
                }
            })
            .collect();
        let mut errors = Errors::default();
        for part in parts {
            errors.residuals.extend(part.residuals);
            errors.columns.extend(part.columns);
        }
        errors
    }

    /// The error of one walk; appends a column for each of its steps.
    fn error(
        &self,
        fan: &Fan,
        corners: &[Half],
        turns: &[Half],
        columns: &mut Vec<Vector3<f64>>,
    ) -> Vector3<f64> {
        let first = columns.len();
        if !fan.closed {
            columns.resize(first + fan.steps().len(), Vector3::zeros());
            return Vector3::zeros();
        }
        let mut walked = Quaternion::identity();
        for step in &self.steps[fan.steps()] {
            walked = about_z(&walked, corners[step.corner as usize]);
            columns.push(first_axis(&walked) * if step.negated { 1.0 } else { -1.0 });
            walked = about_x(&walked, signed(turns[step.hinge as usize], !step.negated));
        }
        if walked.w < 0.0 {
            walked = -walked;
        }
        let (w, v) = (walked.w, walked.imag());
        // turning by d about a before everything walked: d(2 v) = w a + a x v
        for column in &mut columns[first..] {
            *column = *column * w + column.cross(&v);
        }
        v * 2.0
    }

    /// The frame at the beginning of each step, relative to its fan's first: x along the spoke, z the
    /// triangle's normal.
    pub(super) fn frames(&self, corners: &[Half], dihedrals: &[f64]) -> Vec<UnitQuaternion<f64>> {
        let mut frames = Vec::with_capacity(self.steps.len());
        for fan in &self.fans {
            let mut walked = Quaternion::identity();
            for step in &self.steps[fan.steps()] {
                frames.push(UnitQuaternion::new_normalize(walked));
                walked = about_z(&walked, corners[step.corner as usize]);
                if step.hinge != NO_HINGE {
                    let turn = half(dihedrals[step.hinge as usize]);
                    walked = about_x(&walked, signed(turn, !step.negated));
                }
            }
        }
        frames
    }
}

/// The turn, or its inverse.
fn signed([cosine, sine]: Half, inverse: bool) -> Half {
    [cosine, if inverse { -sine } else { sine }]
}

/// q times a rotation about x.
fn about_x(q: &Quaternion<f64>, [c, s]: Half) -> Quaternion<f64> {
    Quaternion::new(
        q.w * c - q.i * s,
        q.i * c + q.w * s,
        q.j * c + q.k * s,
        q.k * c - q.j * s,
    )
}

/// q times a rotation about z.
fn about_z(q: &Quaternion<f64>, [c, s]: Half) -> Quaternion<f64> {
    Quaternion::new(
        q.w * c - q.k * s,
        q.i * c + q.j * s,
        q.j * c - q.i * s,
        q.k * c + q.w * s,
    )
}

/// Where q takes the first axis.
fn first_axis(q: &Quaternion<f64>) -> Vector3<f64> {
    let (w, x, y, z) = (q.w, q.i, q.j, q.k);
    Vector3::new(
        w * w + x * x - y * y - z * z,
        2.0 * (x * y + w * z),
        2.0 * (x * z - w * y),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn products_with_axis_rotations_are_quaternion_products() {
        let q = Quaternion::new(0.5, -0.1, 0.7, 0.3).normalize();
        let [c, s] = half(1.1);
        assert!((about_x(&q, [c, s]) - q * Quaternion::new(c, s, 0.0, 0.0)).norm() < 1e-15);
        assert!((about_z(&q, [c, s]) - q * Quaternion::new(c, 0.0, 0.0, s)).norm() < 1e-15);
        let axis = UnitQuaternion::new_unchecked(q) * Vector3::x();
        assert!((first_axis(&q) - axis).norm() < 1e-15);
    }
}
