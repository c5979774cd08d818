//! Four numbers worked on side by side. Written as plain loops over arrays: compilers make vector
//! instructions of them where there are any, and the results are those of the plain operations, bit by bit.

use std::ops::{Add, Mul, Sub};

/// How many there are.
pub const LANES: usize = 4;

/// The same quantity of four things.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lanes(pub [f64; LANES]);

/// x, y and z of four vectors.
pub type Vectors = [Lanes; 3];

impl Lanes {
    /// One number four times.
    #[inline(always)]
    pub fn splat(x: f64) -> Self {
        Lanes([x; LANES])
    }

    /// The numbers of lanes 0 to 3.
    #[inline(always)]
    pub fn of(mut number: impl FnMut(usize) -> f64) -> Self {
        let mut numbers = [0.0; LANES];
        for (lane, out) in numbers.iter_mut().enumerate() {
            *out = number(lane);
        }
        Lanes(numbers)
    }

    /// Their roots.
    #[inline(always)]
    pub fn sqrt(self) -> Self {
        let mut roots = self.0;
        for root in &mut roots {
            *root = root.sqrt();
        }
        Lanes(roots)
    }

    /// One over each.
    #[inline(always)]
    pub fn recip(self) -> Self {
        let mut inverses = self.0;
        for inverse in &mut inverses {
            *inverse = 1.0 / *inverse;
        }
        Lanes(inverses)
    }

    /// The sum of the four, from the first on.
    pub fn sum(self) -> f64 {
        self.0.iter().sum()
    }
}

impl Add for Lanes {
    type Output = Lanes;

    #[inline(always)]
    fn add(mut self, other: Lanes) -> Lanes {
        for lane in 0..LANES {
            self.0[lane] += other.0[lane];
        }
        self
    }
}

impl Sub for Lanes {
    type Output = Lanes;

    #[inline(always)]
    fn sub(mut self, other: Lanes) -> Lanes {
        for lane in 0..LANES {
            self.0[lane] -= other.0[lane];
        }
        self
    }
}

impl Mul for Lanes {
    type Output = Lanes;

    #[inline(always)]
    fn mul(mut self, other: Lanes) -> Lanes {
        for lane in 0..LANES {
            self.0[lane] *= other.0[lane];
        }
        self
    }
}

/// The vectors of lanes 0 to 3.
#[inline(always)]
pub fn vectors(vector: impl FnMut(usize) -> [f64; 3]) -> Vectors {
    let rows: [[f64; 3]; LANES] = std::array::from_fn(vector);
    [
        Lanes::of(|lane| rows[lane][0]),
        Lanes::of(|lane| rows[lane][1]),
        Lanes::of(|lane| rows[lane][2]),
    ]
}

/// a - b.
#[inline(always)]
pub fn minus(a: &Vectors, b: &Vectors) -> Vectors {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// a times s.
#[inline(always)]
pub fn times(a: &Vectors, s: Lanes) -> Vectors {
    [a[0] * s, a[1] * s, a[2] * s]
}

/// The scalar products.
#[inline(always)]
pub fn dot(a: &Vectors, b: &Vectors) -> Lanes {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// The vector products.
#[inline(always)]
pub fn cross(a: &Vectors, b: &Vectors) -> Vectors {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lanes_do_not_know_of_each_other() {
        let a = vectors(|lane| [lane as f64, 1.0, -2.0]);
        let b = vectors(|lane| [0.5, lane as f64, 3.0]);
        let (products, crossed) = (dot(&a, &b), cross(&a, &b));
        for lane in 0..LANES {
            let of = |v: &Vectors| nalgebra::Vector3::from(v.map(|x| x.0[lane]));
            assert_eq!(products.0[lane], of(&a).dot(&of(&b)));
            assert_eq!(of(&crossed), of(&a).cross(&of(&b)));
        }
        assert_eq!(Lanes([4.0, 9.0, 16.0, 25.0]).sqrt().sum(), 14.0);
        assert_eq!(Lanes::splat(4.0).recip(), Lanes([0.25; LANES]));
    }
}
