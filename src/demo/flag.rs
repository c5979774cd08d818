//! A flag in the wind: cloth as particles that keep their distances.
//!
//! Extended position-based dynamics in small steps (Macklin et al. 2019): in each step every particle
//! moves with its speed, then every distance between neighbours is corrected once, in a fixed order,
//! and speeds follow from where particles came to be. The wind presses on each quad along its normal,
//! 1/2 rho A |u.n| (u.n) n with u the wind against the cloth (Wejchert & Haumann 1991), and comes in
//! gusts that travel along the flag, so that it waves in circles that never quite repeat.

use std::f64::consts::PI;
use std::sync::Arc;

use nalgebra::Vector3;

use crate::mesh::{Sequence, Topology};
use crate::task::{Cancelled, Task};

/// Quads along the flag and along the pole.
const QUADS: [usize; 2] = [48, 32];
/// Metres along the flag and along the pole.
const SIZE: [f64; 2] = [1.5, 1.0];
const FRAMES: usize = 100;
const FPS: f64 = 30.0;
/// Frames that pass before the first one is kept: the flag starts flat.
const BEFORE: usize = 60;
const STEPS_A_FRAME: usize = 30;
/// Kilograms a square metre: light nylon.
const DENSITY: f64 = 0.12;
/// Kilograms a cubic metre of air.
const AIR: f64 = 1.2;
/// Share of its speed that the cloth loses in a second.
const DRAG: f64 = 0.8;

/// One hundred frames, flying.
pub(super) fn generate(task: &Task) -> Result<Sequence, Cancelled> {
    let mut cloth = Cloth::new();
    let mut positions = Vec::with_capacity(3 * cloth.points.len() * FRAMES);
    for frame in 0..BEFORE + FRAMES {
        task.check()?;
        if frame >= BEFORE {
            positions.extend(
                cloth
                    .points
                    .iter()
                    .flat_map(|p| [p.x as f32, p.y as f32, p.z as f32]),
            );
        }
        for step in 0..STEPS_A_FRAME {
            let seconds = (frame as f64 + step as f64 / STEPS_A_FRAME as f64) / FPS;
            cloth.step(seconds, 1.0 / (FPS * STEPS_A_FRAME as f64));
        }
    }
    let topology = Arc::new(topology());
    Ok(Sequence::new(topology, positions, Some(FPS)))
}

fn topology() -> Topology {
    let corners: Vec<u32> = quads().flatten().map(|corner| corner as u32).collect();
    let vertices = (QUADS[0] + 1) * (QUADS[1] + 1);
    let faces = vec![4; QUADS[0] * QUADS[1]];
    Topology::new(vertices, &faces, corners).expect("quads name the grid's points")
}

/// The vertex in column `i` from the pole and row `j` from below.
fn vertex(i: usize, j: usize) -> usize {
    j * (QUADS[0] + 1) + i
}

fn quads() -> impl Iterator<Item = [usize; 4]> {
    (0..QUADS[1]).flat_map(|j| {
        (0..QUADS[0]).map(move |i| {
            [
                vertex(i, j),
                vertex(i + 1, j),
                vertex(i + 1, j + 1),
                vertex(i, j + 1),
            ]
        })
    })
}

/// A distance to keep: the two ends, how long, and its give in metres a newton.
#[derive(Debug, Clone, Copy)]
struct Thread {
    ends: [usize; 2],
    length: f64,
    give: f64,
}

#[derive(Debug)]
struct Cloth {
    points: Vec<Vector3<f64>>,
    speeds: Vec<Vector3<f64>>,
    /// 1 / mass; 0 along the pole.
    lightness: Vec<f64>,
    threads: Vec<Thread>,
}

impl Cloth {
    /// Flat in the plane z = 0, its pole along y.
    fn new() -> Self {
        let at = |i: usize, j: usize| {
            let share = |k: usize, axis: usize| SIZE[axis] * k as f64 / QUADS[axis] as f64;
            Vector3::new(share(i, 0), share(j, 1), 0.0)
        };
        let grid = || (0..=QUADS[1]).flat_map(|j| (0..=QUADS[0]).map(move |i| (i, j)));
        let points: Vec<_> = grid().map(|(i, j)| at(i, j)).collect();
        let mass = DENSITY * SIZE[0] * SIZE[1] / points.len() as f64;
        let lightness = grid()
            .map(|(i, _)| if i == 0 { 0.0 } else { 1.0 / mass })
            .collect();
        let speeds = vec![Vector3::zeros(); points.len()];
        let threads = threads(&points);
        Cloth {
            points,
            speeds,
            lightness,
            threads,
        }
    }

    fn step(&mut self, seconds: f64, dt: f64) {
        let before = self.points.clone();
        let forces = self.wind_forces(seconds);
        let keep = 1.0 - DRAG * dt;
        for v in 0..self.points.len() {
            if self.lightness[v] > 0.0 {
                let pull = Vector3::new(0.0, -9.81, 0.0) + forces[v] * self.lightness[v];
                self.speeds[v] = self.speeds[v] * keep + pull * dt;
                self.points[v] += self.speeds[v] * dt;
            }
        }
        for thread in &self.threads {
            correct(&mut self.points, &self.lightness, thread, dt);
        }
        for v in 0..self.points.len() {
            self.speeds[v] = (self.points[v] - before[v]) / dt;
        }
    }

    /// Each quad's force in equal parts on its corners.
    fn wind_forces(&self, seconds: f64) -> Vec<Vector3<f64>> {
        let mut forces = vec![Vector3::zeros(); self.points.len()];
        for corners in quads() {
            let [a, b, c, d] = corners.map(|corner| self.points[corner]);
            let area = (c - a).cross(&(d - b)) * 0.5;
            let size = area.norm();
            if size > 0.0 {
                let normal = area / size;
                let speed: Vector3<f64> = corners
                    .iter()
                    .map(|&v| self.speeds[v])
                    .sum::<Vector3<f64>>()
                    * 0.25;
                let along = (wind(seconds, (a + b + c + d) * 0.25) - speed).dot(&normal);
                let force = normal * (0.5 * AIR * size * along * along.abs() * 0.25);
                corners.iter().for_each(|&v| forces[v] += force);
            }
        }
        forces
    }
}

/// The air's speed: along the flag, with gusts from the side that travel with it.
fn wind(seconds: f64, point: Vector3<f64>) -> Vector3<f64> {
    let gust = |hertz: f64, late: f64| libm::sin(2.0 * PI * hertz * (seconds - late));
    let along = 7.0 + 0.5 * gust(0.31, 0.0);
    let late = point.x / along;
    let side = 1.6 * gust(1.1, late)
        + 0.4 * gust(0.47, late + 0.3)
        + 0.2 * gust(1.9, late + 0.2 * point.y);
    Vector3::new(along, 0.3 * gust(0.7, late), side)
}

/// Sides and diagonals of the quads hold, every second neighbour resists bending softly.
fn threads(points: &[Vector3<f64>]) -> Vec<Thread> {
    let mut threads = Vec::new();
    for (di, dj, give) in [
        (1, 0, 0.0),
        (0, 1, 0.0),
        (1, 1, 2e-4),
        (1, -1, 2e-4),
        (2, 0, 0.003),
        (0, 2, 0.003),
    ] {
        for j in 0..=QUADS[1] {
            for i in 0..=QUADS[0] - di {
                let Some(k) = j.checked_add_signed(dj).filter(|&k| k <= QUADS[1]) else {
                    continue;
                };
                let ends = [vertex(i, j), vertex(i + di, k)];
                let length = (points[ends[0]] - points[ends[1]]).norm();
                threads.push(Thread { ends, length, give });
            }
        }
    }
    threads
}

fn correct(points: &mut [Vector3<f64>], lightness: &[f64], thread: &Thread, dt: f64) {
    let [a, b] = thread.ends;
    let away = points[b] - points[a];
    let length = away.norm();
    let sum = lightness[a] + lightness[b] + thread.give / (dt * dt);
    if sum > 0.0 && length > 0.0 {
        let step = away * ((length - thread.length) / (length * sum));
        points[a] += step * lightness[a];
        points[b] -= step * lightness[b];
    }
}
