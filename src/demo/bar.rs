//! A square bar whose bend and twist are known exactly.
//!
//! The rest pose is the box \[0, 4\] x \[-1/4, 1/4\]^2 along x. Under a bend by angle b and a twist by
//! angle w the axis becomes an arc of length 4 that turns by b towards +y, its cross-sections stay
//! squares at right angles to it, and the section at arc length s is turned by w s / 4 about the
//! axis.

use std::f64::consts::PI;
use std::sync::Arc;

use crate::mesh::{Sequence, Topology};
use crate::task::{Cancelled, Task};

use super::bend::bent;
use super::lattice::Lattice;

const LENGTH: f64 = 4.0;
const WIDTH: f64 = 0.5;
const LATTICE: Lattice = Lattice { cells: [64, 8, 8] };
const FRAMES_A_PART: usize = 40;
const FPS: f64 = 30.0;

/// Bend to 170 degrees and back, twist to 180 degrees and back, both at once and back.
pub(super) fn generate(task: &Task) -> Result<Sequence, Cancelled> {
    task.check()?;
    let quads = LATTICE.surface_quads();
    let vertices = LATTICE.surface_points().len();
    let topology = Topology::new(vertices, &vec![4; quads.len()], quads.concat());
    let topology = Arc::new(topology.expect("quads of the lattice name its points"));
    let positions = (0..3 * FRAMES_A_PART).flat_map(|frame| {
        let (bend, twist) = angles(frame);
        pose(bend, twist)
    });
    Ok(Sequence::new(topology, positions.collect(), Some(FPS)))
}

/// Bend and twist, in radians, of `frame`.
fn angles(frame: usize) -> (f64, f64) {
    let (part, step) = (frame / FRAMES_A_PART, frame % FRAMES_A_PART);
    let amount = 0.5 - 0.5 * libm::cos(2.0 * PI * step as f64 / FRAMES_A_PART as f64);
    let bend = if part == 1 {
        0.0
    } else {
        amount * 170.0 / 180.0 * PI
    };
    let twist = if part == 0 { 0.0 } else { amount * PI };
    (bend, twist)
}

/// The exact 3V coordinates of the demo `bar` under a bend and a twist in radians; (0, 0) is the
/// straight bar. Bends of any size are allowed, beyond 2 pi the bar meets itself.
pub fn pose(bend: f64, twist: f64) -> Vec<f32> {
    let points = LATTICE.surface_points();
    let place = |point: [usize; 3]| {
        bent(rest(point), bend / LENGTH, twist / LENGTH).map(|value| value as f32)
    };
    points.into_iter().flat_map(place).collect()
}

fn rest(point: [usize; 3]) -> [f64; 3] {
    let share = |i: usize| point[i] as f64 / LATTICE.cells[i] as f64;
    [
        LENGTH * share(0),
        WIDTH * (share(1) - 0.5),
        WIDTH * (share(2) - 0.5),
    ]
}
