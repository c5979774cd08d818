//! Bend and twist of a straight axis, exactly.

/// The point at arc length `s` along the axis and (u, v) across it, after the axis has been bent to a
/// circle of that curvature towards +u, in radians a unit of length, and its cross-sections turned
/// about it by `twist` radians a unit of length from u to v. With (u, v) the turned coordinates and
/// a = curvature s
///
/// ```text
/// along = sin(a) / curvature - u sin(a)      across = (1 - cos(a)) / curvature + u cos(a)      v
/// ```
///
/// and its limit, a straight axis, for curvature 0.
pub(super) fn bent([s, u, v]: [f64; 3], curvature: f64, twist: f64) -> [f64; 3] {
    let (sin, cos) = (libm::sin(twist * s), libm::cos(twist * s));
    let (u, v) = (cos * u - sin * v, sin * u + cos * v);
    let angle = curvature * s;
    // the chord of the arc, in the direction of half the angle
    let chord = s * sinc(0.5 * angle);
    [
        chord * libm::cos(0.5 * angle) - u * libm::sin(angle),
        chord * libm::sin(0.5 * angle) + u * libm::cos(angle),
        v,
    ]
}

/// sin(x) / x, also at 0.
fn sinc(x: f64) -> f64 {
    if x.abs() < 1e-8 {
        1.0
    } else {
        libm::sin(x) / x
    }
}
