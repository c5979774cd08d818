//! Triangles of given lengths, put together to a shape as well as they fit: the two halves of a step are
//! to lay each triangle onto the shape that was found, and to find the shape whose gradients come nearest
//! those of the triangles (Sorkine & Alexa 2007, with the lengths of the triangles in place of a rigid
//! reference). The matrix stays, so it is factored once.

use nalgebra::{Point3, UnitQuaternion, Vector3};

use super::isometric::{Connectivity, gathered};
use super::polygon::{apex, perpendicular, point, put};
use crate::math::sparse::SparseError;
use crate::mesh::rigid_align::rigid;
use crate::mesh::{NO_EDGE, Poisson, ReferenceTriangle, reference_triangles};

/// The system of one reference pose.
#[derive(Debug)]
pub(super) struct Fitting {
    triangles: Vec<[u32; 3]>,
    poisson: Poisson,
}

impl Fitting {
    pub(super) fn new(connectivity: &Connectivity, pose: &[f64]) -> Result<Self, SparseError> {
        let triangles = connectivity.triangles.clone();
        let reference = reference_triangles(&triangles, pose);
        Ok(Fitting {
            poisson: Poisson::new(connectivity.analysis.clone(), reference)?,
            triangles,
        })
    }

    /// The shape of triangles that are turned like this against the reference.
    pub(super) fn turned(
        &self,
        targets: &[Target],
        turns: &[UnitQuaternion<f64>],
        positions: &mut [f64],
    ) {
        let reference = self.poisson.reference();
        self.poisson.solve(
            |face| targets[face].turned(&reference[face], &turns[face]),
            positions,
        );
    }

    /// The shape of triangles laid onto the shape `found`.
    pub(super) fn fit(&self, targets: &[Target], found: &[f64], positions: &mut [f64]) {
        let reference = self.poisson.reference();
        self.poisson.solve(
            |face| {
                let corners = self.triangles[face].map(|vertex| point(found, vertex));
                targets[face].laid_onto(&reference[face], corners)
            },
            positions,
        );
    }
}

/// How much of the last step is gone once more before triangles are laid on: steps of this kind shrink
/// slowly in one direction, and with it six do what ten do without.
const MOMENTUM: f64 = 0.7;

/// Writes to `ahead` where `now` goes on to, coming from `before`.
pub(super) fn forward(before: &[f64], now: &[f64], ahead: &mut [f64]) {
    for ((ahead, now), before) in ahead.iter_mut().zip(now).zip(before) {
        *ahead = now + MOMENTUM * (now - before);
    }
}

/// Shapes of given edge lengths in the neighbourhood of a pose.
#[derive(Debug)]
pub struct Layout<'a> {
    connectivity: &'a Connectivity,
    fitting: Fitting,
    pose: Vec<f64>,
}

/// Steps of [`Layout::laid_out`] at most, and the share of the largest step below which it ends: edges
/// then change by less than single precision shows.
const STEPS: usize = 300;
const SETTLED: f64 = 1e-7;

impl<'a> Layout<'a> {
    /// Prepares the neighbourhood of a pose of 3V positions.
    ///
    /// # Errors
    /// The pose has sizes beyond double precision.
    pub fn new(connectivity: &'a Connectivity, pose: &[f64]) -> Result<Self, SparseError> {
        Ok(Layout {
            fitting: Fitting::new(connectivity, pose)?,
            pose: pose.to_vec(),
            connectivity,
        })
    }

    /// The shape that the pose becomes when its edges take these lengths, one for each edge of
    /// [`Connectivity::edges`]; its parts lie nearest those of the pose. Lengths that no shape has are
    /// met as well as they can; a triangle that they do not close is a line.
    ///
    /// # Panics
    /// There is not a length for each edge.
    pub fn laid_out(&self, lengths: &[f64]) -> Vec<f64> {
        let sides = self.connectivity.hinges.side_edges().as_chunks::<3>().0;
        let length = |side: u32| match side {
            NO_EDGE => 0.0,
            side => lengths[side as usize].max(0.0),
        };
        let targets = sides.iter().map(|sides| Target::new(sides.map(length)));
        let targets: Vec<Target> = targets.collect();
        let [mut before, mut found, mut ahead] = [(); 3].map(|()| self.pose.clone());
        let mut largest = 0.0_f64;
        for _ in 0..STEPS {
            forward(&before, &found, &mut ahead);
            std::mem::swap(&mut before, &mut found);
            self.fitting.fit(&targets, &ahead, &mut found);
            self.settle(&mut found);
            let pairs = before.iter().zip(&found);
            let moved = pairs.map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt();
            largest = largest.max(moved);
            if moved <= SETTLED * largest {
                break;
            }
        }
        found
    }

    /// Lays each part onto that of the pose.
    fn settle(&self, positions: &mut [f64]) {
        for members in &self.connectivity.members {
            let (from, to) = (gathered(positions, members), gathered(&self.pose, members));
            let motion = rigid(&from, &to);
            for &vertex in members {
                let at = motion * Point3::from(point(positions, vertex));
                put(positions, vertex, &at.coords);
            }
        }
    }
}

/// A triangle of given lengths in a plane of its own: corner 1 at (length, 0), corner 2 at
/// (offset, height).
#[derive(Debug, Clone, Copy)]
pub(super) struct Target {
    length: f64,
    offset: f64,
    height: f64,
}

/// Below this ratio of area to squared sides a triangle counts as a line.
const FLAT: f64 = 1e-12;

impl Target {
    /// With sides 01, 12, 20 of these lengths.
    pub(super) fn new(sides: [f64; 3]) -> Self {
        let [offset, height] = apex(sides);
        Target {
            length: sides[0],
            offset,
            height,
        }
    }

    /// Where its gradient takes the reference's basis when `turn` is the rotation in its polar factors.
    fn turned(&self, rest: &ReferenceTriangle, turn: &UnitQuaternion<f64>) -> [Vector3<f64>; 2] {
        // the gradient in the two planes is (a, b; 0, d); the rotation nearest it turns by -(sine, cosine)
        let a = self.length / rest.length;
        let b = (self.offset - rest.offset * a) / rest.height;
        let d = self.height / rest.height;
        let size = ((a + d) * (a + d) + b * b).sqrt();
        let (cosine, sine) = match size > 0.0 {
            true => ((a + d) / size, b / size),
            false => (1.0, 0.0),
        };
        let (u, v) = (turn * rest.along, turn * rest.across());
        let along = u * cosine + v * sine;
        let across = v * cosine - u * sine;
        self.images(rest, &along, &across)
    }

    /// The same when the triangle is laid onto one with these corners as well as it can be: of all turns
    /// in its plane the one that brings the gradients nearest, of a triangle that is a line its sides.
    fn laid_onto(
        &self,
        rest: &ReferenceTriangle,
        [p, q, r]: [Vector3<f64>; 3],
    ) -> [Vector3<f64>; 2] {
        let (e1, e2) = (q - p, r - p);
        let cross = e1.cross(&e2);
        let flat = cross.norm() <= FLAT * (e1.norm_squared() + e2.norm_squared());
        let normal = match flat {
            true => perpendicular(&(e1 + e2)),
            false => cross.normalize(),
        };
        let (l, x, y) = (self.length, self.offset, self.height);
        let along = if l * y > FLAT * (l * l + x * x + y * y) {
            // both gradients times twice the area
            e1 * y - normal.cross(&(e2 * l - e1 * x))
        } else {
            e1 * l + e2 * x - normal.cross(&e2) * y
        };
        let along = along.try_normalize(0.0);
        let along = along.unwrap_or_else(|| perpendicular(&normal));
        self.images(rest, &along, &normal.cross(&along))
    }

    fn images(
        &self,
        rest: &ReferenceTriangle,
        along: &Vector3<f64>,
        across: &Vector3<f64>,
    ) -> [Vector3<f64>; 2] {
        let (e1, e2) = (
            along * self.length,
            along * self.offset + across * self.height,
        );
        rest.images(&e1, &e2)
    }
}
