//! What moves a face: smooth fields over the head at rest, left and right alike (after the action
//! units of Ekman & Friesen 1978). Lengths in decimetres as in `head`.

use nalgebra::Vector3;

use super::expression::Expression;
use super::head::{EYE, EYE_RADIUS, MOUTH, MOUTH_WIDTH, lid_height};

/// Where a point of the head at rest goes.
pub(super) fn moved(rest: Vector3<f64>, by: &Expression) -> Vector3<f64> {
    let side = if rest.z < 0.0 { -1.0 } else { 1.0 };
    // as if on the right
    let point = Vector3::new(rest.x, rest.y, rest.z.abs());
    let (point, below) = (point, below_mouth(point));
    let mut shift = brow(point, by) + lips(point, below, by) + cheek(point, by);
    // nothing crosses the middle
    shift.z *= (point.z / 0.1).min(1.0);
    let lidded = lids(point, by);
    let jawed = jaw(lidded, point, below, by.jaw);
    let moved = jawed + shift;
    Vector3::new(moved.x, moved.y, side * moved.z)
}

/// exp(-1/2 of the squared offset, each axis in units of its size).
fn bump(point: Vector3<f64>, middle: [f64; 3], sizes: [f64; 3]) -> f64 {
    let offset = (point - Vector3::from(middle)).component_div(&Vector3::from(sizes));
    libm::exp(-0.5 * offset.norm_squared())
}

/// 0 below `from`, 1 above `to`, smooth between.
fn ramp(value: f64, from: f64, to: f64) -> f64 {
    let share = ((value - from) / (to - from)).clamp(0.0, 1.0);
    share * share * (3.0 - 2.0 * share)
}

/// 1 for what hangs on the lower lip, 0 for what hangs on the upper: sharp in the mouth, wide beside it.
fn below_mouth(point: Vector3<f64>) -> f64 {
    let beside = (point.z - 0.5 * MOUTH_WIDTH).max(0.0) + (0.45 - point.x).max(0.0);
    let blur = 0.024 + 0.9 * beside;
    ramp(MOUTH[1] - point.y, -blur, blur)
}

/// The jaw turns down about a hinge before the ears.
fn jaw(point: Vector3<f64>, rest: Vector3<f64>, below: f64, amount: f64) -> Vector3<f64> {
    let hinge = Vector3::new(0.0, -0.15, 0.0);
    let weight = below * ramp(rest.x, -0.1, 0.55) * ramp(rest.y, -1.35, -0.95);
    let angle = -amount * weight;
    let (sin, cos) = (libm::sin(angle), libm::cos(angle));
    let arm = point - hinge;
    hinge + Vector3::new(cos * arm.x - sin * arm.y, sin * arm.x + cos * arm.y, arm.z)
}

fn brow(point: Vector3<f64>, by: &Expression) -> Vector3<f64> {
    let inner = bump(point, [0.88, 0.44, 0.13], [0.25, 0.16, 0.13]);
    let outer = bump(point, [0.75, 0.48, 0.42], [0.25, 0.16, 0.15]);
    let forward = 0.25 * (by.brow_inner * inner + by.brow_outer * outer);
    Vector3::new(
        -forward.abs() * 0.3,
        by.brow_inner * inner + by.brow_outer * outer,
        -by.brow_knit * inner,
    )
}

fn cheek(point: Vector3<f64>, by: &Expression) -> Vector3<f64> {
    let apple = bump(point, [0.68, -0.20, 0.40], [0.20, 0.15, 0.16]);
    let nostril = bump(point, [0.97, -0.22, 0.14], [0.10, 0.09, 0.07]);
    let up = Vector3::new(0.6, 0.8, 0.25) * (by.cheek * apple);
    up + Vector3::new(0.0, 0.7, 0.6) * (by.nostril * nostril)
}

fn lips(point: Vector3<f64>, below: f64, by: &Expression) -> Vector3<f64> {
    let corner = bump(point, [0.80, MOUTH[1], MOUTH_WIDTH], [0.24, 0.19, 0.14]);
    let lip = bump(point, MOUTH, [0.28, 0.16, 0.19]);
    let whole = bump(point, MOUTH, [0.30, 0.17, 0.26]);
    // corners run along the cheek: outwards is also backwards
    let corners = Vector3::new(-0.55 * by.corner_out, by.corner_up, by.corner_out) * corner;
    let raised = Vector3::new(0.05, 1.0, 0.0) * (by.upper_lip * lip * (1.0 - below));
    let lowered = Vector3::new(0.15, -1.0, 0.0) * (by.lower_lip * lip * below);
    let pout = Vector3::new(by.pucker, 0.0, -1.3 * by.pucker * point.z / MOUTH_WIDTH) * whole;
    // the slit that the mouth is cut as closes
    let close = Vector3::new(0.0, 0.028 * (2.0 * below - 1.0), 0.0) * (by.press * whole);
    corners + raised + lowered + pout + close
}

/// Lids slide over the eyeball, which stays: each goes its share of the way to where they meet, and
/// takes the skin above or below it along.
fn lids(point: Vector3<f64>, by: &Expression) -> Vector3<f64> {
    let eye = Vector3::from(EYE);
    let offset = point - eye;
    let distance = offset.norm();
    let flat = (offset.x * offset.x + offset.z * offset.z).sqrt();
    let (turn, height) = (libm::atan2(offset.z, offset.x), libm::atan2(offset.y, flat));
    let [upper, lower] = [1.0, -1.0].map(|side| lid_height(turn, side));
    let meeting = 0.3 * upper + 0.7 * lower;
    let falls = by.upper_lid
        * (meeting - upper)
        * ramp(height, meeting, upper - 0.05)
        * ramp(-height, -upper - 0.8, -upper);
    let rises = by.lower_lid
        * (meeting - lower)
        * ramp(-height, -meeting, -lower - 0.05)
        * ramp(height, lower - 0.8, lower);
    let free = ramp(distance, EYE_RADIUS + 0.002, EYE_RADIUS + 0.03);
    let depth = (distance - EYE_RADIUS) / 0.12;
    let near = libm::exp(-0.5 * depth * depth);
    let height = height + free * near * (falls + rises);
    let (sin, cos) = (libm::sin(height), libm::cos(height));
    let around = if flat > 0.0 {
        cos * distance / flat
    } else {
        0.0
    };
    eye + Vector3::new(offset.x * around, distance * sin, offset.z * around)
}
