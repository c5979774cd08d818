//! A rabbit of jelly, lifted by its back and dropped: it hangs, falls, flattens, bounces and comes to
//! rest (after the elastic cow of Fig. 6 of Cashman & Hormann 2012).

mod rabbit;
mod solid;

use std::sync::Arc;

use nalgebra::Vector3;

use crate::demo::surface_nets::polygonise;
use crate::mesh::{Sequence, Topology};
use crate::task::{Cancelled, Task};

use solid::Solid;

const FRAMES: usize = 200;
const FPS: f64 = 30.0;
const STEPS_A_FRAME: usize = 16;
/// Frames that pass before the first one is kept: the rabbit settles under its weight.
const BEFORE: usize = 30;
/// Frames, counted from the first one kept, at which the hand grasps, is at the top, and lets go.
const GRASP: usize = 10;
const TOP: usize = 55;
const RELEASE: usize = 80;
/// How high the hand goes, in metres.
const LIFT: f64 = 1.1;

/// Two hundred frames.
pub(super) fn generate(task: &Task) -> Result<Sequence, Cancelled> {
    let mut mesh = polygonise(&rabbit::Rabbit::new(), &rabbit::grid(), task)?;
    mesh.relax(&rabbit::Rabbit::new(), 6, task)?;
    let mut solid = Solid::around(&mesh.points);
    let mut positions = Vec::with_capacity(3 * mesh.points.len() * FRAMES);
    for frame in 0..BEFORE + FRAMES {
        task.check()?;
        if frame >= BEFORE {
            solid
                .surface()
                .for_each(|p| positions.extend([p.x as f32, p.y as f32, p.z as f32]));
        }
        let now = frame.saturating_sub(BEFORE);
        if now == GRASP {
            solid.grasp(Vector3::from(rabbit::SCRUFF), rabbit::HANDFUL);
        }
        if now == RELEASE {
            solid.release();
        }
        for step in 0..STEPS_A_FRAME {
            let part = now as f64 + step as f64 / STEPS_A_FRAME as f64;
            solid.step(hand(part), 1.0 / (FPS * STEPS_A_FRAME as f64));
        }
    }
    let topology = Topology::from_triangles(mesh.points.len(), &mesh.triangles());
    let topology = topology.expect("faces name their own points");
    Ok(Sequence::new(Arc::new(topology), positions, Some(FPS)))
}

/// How far the hand has moved: up with a smooth start and end.
fn hand(frame: f64) -> Vector3<f64> {
    let share = ((frame - GRASP as f64) / (TOP - GRASP) as f64).clamp(0.0, 1.0);
    Vector3::new(0.0, LIFT * share * share * (3.0 - 2.0 * share), 0.0)
}
