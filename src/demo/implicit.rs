//! Smooth bodies as level sets: blobs that melt into each other.
//!
//! A blob is a segment with a radius at either end, made narrower or wider along z by a factor. Its
//! distance d_i is measured to first order, (distance in the stretched space) / (length of its
//! gradient). Bodies are where
//!
//! ```text
//! f(p) = -k log(sum_i exp(-d_i(p) / k)) < 0
//! ```
//!
//! a smooth union in any order: k is about the radius of the fillets, and the weights
//! exp(-d_i / k) / sum are a partition of unity that the gradient is mixed with. Two equal blobs in one
//! place swell by k log 2; so blobs in a row, a limb, are first united with a small k, and the limbs
//! then with a large one.

use nalgebra::Vector3;

/// A body as a function that is negative inside.
pub(super) trait Field: Sync {
    /// Value, in about the unit of lengths near the surface, and gradient.
    fn at(&self, point: Vector3<f64>) -> (f64, Vector3<f64>);
}

/// A segment with a radius at either end.
#[derive(Debug, Clone, Copy)]
pub(super) struct Blob {
    /// Which bone moves it.
    pub(super) bone: usize,
    /// The two ends.
    pub(super) ends: [Vector3<f64>; 2],
    /// The radii there.
    pub(super) radii: [f64; 2],
    /// How wide it is along z, times the radius.
    pub(super) width: f64,
}

impl Blob {
    /// The same blob on the other side of the plane z = 0, moved by another bone.
    pub(super) fn mirrored(&self, bone: usize) -> Self {
        let ends = self.ends.map(|end| Vector3::new(end.x, end.y, -end.z));
        Blob {
            bone,
            ends,
            ..*self
        }
    }

    /// The same with radii of at least `least`.
    pub(super) fn thickened(&self, least: f64) -> Self {
        let radii = self.radii.map(|radius| radius.max(least));
        let width = self.width.max((least / radii[0].min(radii[1])).min(1.0));
        Blob {
            radii,
            width,
            ..*self
        }
    }

    /// Distance to first order and its gradient.
    pub(super) fn distance(&self, point: Vector3<f64>) -> (f64, Vector3<f64>) {
        let narrow = |p: Vector3<f64>| Vector3::new(p.x, p.y, p.z / self.width);
        let (a, b, p) = (narrow(self.ends[0]), narrow(self.ends[1]), narrow(point));
        let axis = b - a;
        let square = axis.norm_squared();
        let along = if square > 0.0 {
            ((p - a).dot(&axis) / square).clamp(0.0, 1.0)
        } else {
            0.0
        };
        let away = p - a - axis * along;
        let length = away.norm().max(1e-9);
        let radius = self.radii[0] + along * (self.radii[1] - self.radii[0]);
        let gradient = narrow(away / length);
        let slope = gradient.norm().max(1e-9);
        ((length - radius) / slope, gradient / slope)
    }
}

/// Blobs in a row, united with hardly a swelling at the joints.
#[derive(Debug, Clone)]
pub(super) struct Part {
    blobs: Vec<Blob>,
    blend: f64,
    centre: Vector3<f64>,
    radius: f64,
}

impl Part {
    /// Fillets inside a part, times its mean radius.
    const BLEND: f64 = 0.07;

    pub(super) fn new(blobs: Vec<Blob>) -> Self {
        let ends = || blobs.iter().flat_map(|blob| blob.ends);
        let centre = ends().sum::<Vector3<f64>>() / ends().count().max(1) as f64;
        let far = |blob: &Blob| {
            let end =
                |i: usize| (blob.ends[i] - centre).norm() + blob.radii[i] * blob.width.max(1.0);
            end(0).max(end(1))
        };
        let radius = blobs.iter().map(far).fold(0.0, f64::max);
        let sum: f64 = blobs.iter().map(|blob| blob.radii[0] + blob.radii[1]).sum();
        let blend = Part::BLEND * sum / (2 * blobs.len()).max(1) as f64;
        Part {
            blobs,
            blend,
            centre,
            radius,
        }
    }

    pub(super) fn blobs(&self) -> &[Blob] {
        &self.blobs
    }

    fn distance(&self, point: Vector3<f64>) -> (f64, Vector3<f64>) {
        let mut sum = SmoothMin::new(self.blend);
        for blob in &self.blobs {
            sum.add(blob.distance(point));
        }
        sum.value()
    }
}

/// Parts that melt into each other.
#[derive(Debug, Clone)]
pub(super) struct Flesh {
    pub(super) parts: Vec<Part>,
    /// About the radius of the fillets between parts.
    pub(super) blend: f64,
}

impl Flesh {
    /// All blobs.
    pub(super) fn blobs(&self) -> impl Iterator<Item = &Blob> {
        self.parts.iter().flat_map(|part| &part.blobs)
    }

    /// The same with radii of at least `least`.
    pub(super) fn thickened(&self, least: f64) -> Self {
        let thick = |part: &Part| {
            Part::new(
                part.blobs()
                    .iter()
                    .map(|blob| blob.thickened(least))
                    .collect(),
            )
        };
        Flesh {
            parts: self.parts.iter().map(thick).collect(),
            blend: self.blend,
        }
    }
}

impl Field for Flesh {
    fn at(&self, point: Vector3<f64>) -> (f64, Vector3<f64>) {
        let mut sum = SmoothMin::new(self.blend);
        for part in &self.parts {
            if (point - part.centre).norm() - part.radius
                < sum.least + SmoothMin::REACH * self.blend
            {
                sum.add(part.distance(point));
            }
        }
        sum.value()
    }
}

/// A running -k log(sum exp(-d / k)) with its gradient.
struct SmoothMin {
    blend: f64,
    least: f64,
    /// In units of exp(-least / blend), which keeps it at 1 or above.
    sum: f64,
    gradient: Vector3<f64>,
}

impl SmoothMin {
    /// Terms this many k above the least are below 1e-7 of the sum and left out.
    const REACH: f64 = 16.0;

    fn new(blend: f64) -> Self {
        SmoothMin {
            blend,
            least: f64::INFINITY,
            sum: 0.0,
            gradient: Vector3::zeros(),
        }
    }

    fn add(&mut self, (distance, direction): (f64, Vector3<f64>)) {
        if distance < self.least {
            let scale = libm::exp((distance - self.least) / self.blend);
            self.least = distance;
            self.sum *= scale;
            self.gradient *= scale;
        }
        if distance - self.least < SmoothMin::REACH * self.blend {
            let weight = libm::exp((self.least - distance) / self.blend);
            self.sum += weight;
            self.gradient += direction * weight;
        }
    }

    fn value(&self) -> (f64, Vector3<f64>) {
        (
            self.least - self.blend * libm::log(self.sum),
            self.gradient / self.sum,
        )
    }
}

/// The smaller of two values with a fillet of about `blend`: 0.5 (a + b - sqrt((a - b)^2 + blend^2)).
pub(super) fn smooth_min(a: f64, b: f64, blend: f64) -> f64 {
    0.5 * (a + b - ((a - b) * (a - b) + blend * blend).sqrt())
}

/// `field` minus `tool`, with a rounded rim of about `blend`.
pub(super) fn carve(
    field: (f64, Vector3<f64>),
    tool: (f64, Vector3<f64>),
    blend: f64,
) -> (f64, Vector3<f64>) {
    let (a, b) = (-field.0, tool.0);
    let root = ((a - b) * (a - b) + blend * blend).sqrt();
    let share = 0.5 * (1.0 - (a - b) / root);
    (
        -smooth_min(a, b, blend),
        field.1 * share - tool.1 * (1.0 - share),
    )
}

/// Both, with a fillet of about `blend`.
pub(super) fn smooth_union(
    one: (f64, Vector3<f64>),
    other: (f64, Vector3<f64>),
    blend: f64,
) -> (f64, Vector3<f64>) {
    let (a, b) = (one.0, other.0);
    let root = ((a - b) * (a - b) + blend * blend).sqrt();
    let share = 0.5 * (1.0 - (a - b) / root);
    (
        0.5 * (a + b - root),
        one.1 * share + other.1 * (1.0 - share),
    )
}
