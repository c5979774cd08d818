//! Quadratic forms that measure squared distances from planes.

use nalgebra::Vector3;

/// A quadric x^T A x - 2 b^T x + c about a vertex's own place: A as xx xy xz yy yz zz, b, c.
pub(super) type Quadric = [f64; 10];

/// The squared distance from the plane with this unit normal through `offset` along it, times `weight`.
pub(super) fn plane(normal: &Vector3<f64>, offset: f64, weight: f64) -> Quadric {
    let (n, b) = (normal, normal * offset);
    [
        n.x * n.x,
        n.x * n.y,
        n.x * n.z,
        n.y * n.y,
        n.y * n.z,
        n.z * n.z,
        b.x,
        b.y,
        b.z,
        offset * offset,
    ]
    .map(|x| x * weight)
}

/// The value at a place.
pub(super) fn at(q: &Quadric, p: &Vector3<f64>) -> f64 {
    let square = q[0] * p.x * p.x
        + q[3] * p.y * p.y
        + q[5] * p.z * p.z
        + 2.0 * (q[1] * p.x * p.y + q[2] * p.x * p.z + q[4] * p.y * p.z);
    square - 2.0 * (q[6] * p.x + q[7] * p.y + q[8] * p.z) + q[9]
}

/// Adds a quadric that is about another origin: `other` is the other origin seen from this one.
pub(super) fn add(sum: &mut Quadric, q: &Quadric, other: &Vector3<f64>) {
    // x - o in the place of x
    let o = other;
    let a = [
        q[0] * o.x + q[1] * o.y + q[2] * o.z,
        q[1] * o.x + q[3] * o.y + q[4] * o.z,
        q[2] * o.x + q[4] * o.y + q[5] * o.z,
    ];
    for entry in 0..6 {
        sum[entry] += q[entry];
    }
    for axis in 0..3 {
        sum[6 + axis] += q[6 + axis] + a[axis];
    }
    let square = a[0] * o.x + a[1] * o.y + a[2] * o.z;
    sum[9] += q[9] + 2.0 * (q[6] * o.x + q[7] * o.y + q[8] * o.z) + square;
}
