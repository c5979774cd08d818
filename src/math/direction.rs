//! Directions in space and the arcs between them.

use nalgebra::Vector3;

/// Directions whose angle is within this of a half turn, in radians, have no shortest arc: rounding
/// decides which way it goes.
pub const OPPOSITE: f64 = 1e-7;

/// An arc of a great circle from one direction to another, run through at constant speed (slerp).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Arc {
    from: Vector3<f64>,
    /// The unit vector a quarter turn ahead of `from`; zero where the arc has no length.
    ahead: Vector3<f64>,
    angle: f64,
}

impl Arc {
    /// The shorter arc between two unit vectors; none where they are opposite.
    pub fn between(from: &Vector3<f64>, to: &Vector3<f64>) -> Option<Self> {
        let chord = to - from;
        let side = chord - from * from.dot(&chord);
        let (sine, cosine) = (side.norm(), from.dot(to));
        let angle = libm::atan2(sine, cosine);
        (angle < std::f64::consts::PI - OPPOSITE).then(|| Arc {
            from: *from,
            ahead: if sine > 0.0 { side / sine } else { side },
            angle,
        })
    }

    /// The half circle from a unit vector to its opposite about `axis`, or, where that is along `from`,
    /// about the coordinate axis least along it.
    pub fn half_circle(from: &Vector3<f64>, axis: &Vector3<f64>) -> Self {
        let side = axis.cross(from);
        let side = match side.norm() > 1e-9 * axis.norm() {
            true => side,
            false => Vector3::ith(from.iamin(), 1.0).cross(from),
        };
        Arc {
            from: *from,
            ahead: side.normalize(),
            angle: std::f64::consts::PI,
        }
    }

    /// The arc that stays at a unit vector.
    pub fn still(at: &Vector3<f64>) -> Self {
        Arc {
            from: *at,
            ahead: Vector3::zeros(),
            angle: 0.0,
        }
    }

    /// Its length in radians, at most pi.
    pub fn angle(&self) -> f64 {
        self.angle
    }

    /// The direction a fraction `t` of the way; t outside \[0, 1\] goes on around the circle.
    pub fn at(&self, t: f64) -> Vector3<f64> {
        let (sine, cosine) = libm::sincos(self.angle * t);
        self.from * cosine + self.ahead * sine
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn unit(x: f64, y: f64, z: f64) -> Vector3<f64> {
        Vector3::new(x, y, z).normalize()
    }

    #[test]
    fn arcs_run_at_constant_speed_and_end_where_they_should() {
        for (a, b) in [
            (unit(1.0, 2.0, 3.0), unit(-2.0, 0.5, 1.0)),
            (unit(0.0, 0.0, 1.0), unit(1e-9, 0.0, 1.0)),
            (unit(1.0, 0.0, 0.0), unit(-1.0, 1e-3, 0.0)),
        ] {
            let arc = Arc::between(&a, &b).unwrap();
            // rounding of a unit vector, enlarged by at most the arc's own length
            assert!((arc.at(0.0) - a).norm() < 1e-15 && (arc.at(1.0) - b).norm() < 1e-14);
            for t in [0.1, 0.5, 0.8] {
                let d = arc.at(t);
                assert!((d.norm() - 1.0).abs() < 1e-15);
                let turned = libm::atan2(a.cross(&d).norm(), a.dot(&d));
                assert!((turned - t * arc.angle()).abs() < 1e-15);
            }
        }
    }

    #[test]
    fn opposite_directions_have_no_shortest_arc_but_one_about_an_axis() {
        let a = unit(1.0, 1.0, 0.0);
        assert_eq!(Arc::between(&a, &-a), None);
        for axis in [Vector3::z(), a, Vector3::zeros()] {
            let arc = Arc::half_circle(&a, &axis);
            assert!((arc.at(1.0) + a).norm() < 1e-15 && arc.at(0.5).dot(&a).abs() < 1e-15);
        }
        assert!(Arc::half_circle(&a, &Vector3::z()).at(0.5).z.abs() < 1e-15);
        let same = Arc::between(&a, &a).unwrap();
        assert_eq!((same.angle(), same.at(0.3)), (0.0, a));
    }
}
