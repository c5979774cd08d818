//! An elastic solid: a lattice of particles around a surface that follows them.
//!
//! The lattice is moved by extended position-based dynamics in small steps (Macklin et al. 2019) with
//! springs along the sides and diagonals of its cells, and with the volume kept of five tetrahedra in
//! each cell, which makes it bulge when pressed and turns it out again when turned in. A surface point is the mean of the 27 nearest
//! particles weighted by quadratic B-splines, which reproduce linear maps: at rest it is where it
//! was, and the surface stays smooth however the lattice moves. The floor pushes surface points, and
//! through the same weights the particles.

use nalgebra::Vector3;

/// Side of a lattice cell in metres.
const CELL: f64 = 0.12;
/// Kilograms a particle.
const MASS: f64 = 0.1;
/// Give of a spring in metres a newton.
const GIVE: f64 = 3e-3;
/// Share of its lost volume that a tetrahedron gets back in a step.
const VOLUME_SHARE: f64 = 0.3;
/// Share of the difference between neighbours' speeds that is lost in a second, times the springs of
/// a particle.
const FRICTION: f64 = 0.8;
/// Height over the floor under which the floor slows points down along it.
const TOUCH: f64 = 1e-3;

/// The 27 particles of a surface point and their weights.
type Anchor = [(u32, f64); 27];

#[derive(Debug, Clone, Copy)]
struct Spring {
    ends: [usize; 2],
    length: f64,
}

/// Four particles and the volume of their tetrahedron at rest.
#[derive(Debug, Clone, Copy)]
struct Cell {
    corners: [usize; 4],
    volume: f64,
}

#[derive(Debug)]
pub(super) struct Solid {
    points: Vec<Vector3<f64>>,
    speeds: Vec<Vector3<f64>>,
    springs: Vec<Spring>,
    cells: Vec<Cell>,
    anchors: Vec<Anchor>,
    /// Particles in the hand, and where they were when it took them.
    held: Vec<(usize, Vector3<f64>)>,
}

impl Solid {
    /// A lattice around `surface`, at rest.
    pub(super) fn around(surface: &[Vector3<f64>]) -> Self {
        let mut lattice = Particles::default();
        let anchors = surface.iter().map(|&point| lattice.anchor(point)).collect();
        lattice.fill();
        let points = lattice.points();
        Solid {
            speeds: vec![Vector3::zeros(); points.len()],
            springs: lattice.springs(&points),
            cells: lattice.cells(&points),
            points,
            anchors,
            held: Vec::new(),
        }
    }

    /// The surface now.
    pub(super) fn surface(&self) -> impl Iterator<Item = Vector3<f64>> {
        self.anchors.iter().map(|anchor| mean(&self.points, anchor))
    }

    /// Takes the particles within `radius` of a point of the surface.
    pub(super) fn grasp(&mut self, place: Vector3<f64>, radius: f64) {
        let near = |(_, point): &(usize, &Vector3<f64>)| (*point - place).norm() < radius;
        let held = self.points.iter().enumerate().filter(near);
        self.held = held.map(|(index, &point)| (index, point)).collect();
    }

    /// Lets them go.
    pub(super) fn release(&mut self) {
        self.held.clear();
    }

    /// `dt` seconds with the hand moved by `hand` since it took hold.
    pub(super) fn step(&mut self, hand: Vector3<f64>, dt: f64) {
        self.smooth_speeds(dt);
        let before = self.points.clone();
        for (point, speed) in self.points.iter_mut().zip(&mut self.speeds) {
            speed.y -= 9.81 * dt;
            *point += *speed * dt;
        }
        self.hold(hand);
        self.springs
            .iter()
            .for_each(|spring| spring.correct(&mut self.points, dt));
        self.cells
            .iter()
            .for_each(|cell| cell.correct(&mut self.points));
        self.hold(hand);
        self.stand(&before);
        for v in 0..self.points.len() {
            self.speeds[v] = (self.points[v] - before[v]) / dt;
        }
    }

    fn hold(&mut self, hand: Vector3<f64>) {
        for &(index, start) in &self.held {
            self.points[index] = start + hand;
        }
    }

    /// Friction inside: ends of a spring come closer in speed.
    fn smooth_speeds(&mut self, dt: f64) {
        for spring in &self.springs {
            let [a, b] = spring.ends;
            let change = (self.speeds[b] - self.speeds[a]) * (0.5 * FRICTION * dt);
            self.speeds[a] += change;
            self.speeds[b] -= change;
        }
    }

    /// Lifts surface points out of the floor and keeps those on it from sliding.
    fn stand(&mut self, before: &[Vector3<f64>]) {
        for anchor in &self.anchors {
            let (nearest, _) = anchor[13];
            if self.points[nearest as usize].y > 2.0 * CELL {
                continue;
            }
            let place = mean(&self.points, anchor);
            if place.y < TOUCH {
                let slide = place - mean(before, anchor);
                let push = Vector3::new(-0.5 * slide.x, (-place.y).max(0.0), -0.5 * slide.z);
                let square: f64 = anchor.iter().map(|(_, weight)| weight * weight).sum();
                for &(index, weight) in anchor {
                    self.points[index as usize] += push * (weight / square);
                }
            }
        }
    }
}

impl Spring {
    fn correct(&self, points: &mut [Vector3<f64>], dt: f64) {
        let [a, b] = self.ends;
        let away = points[b] - points[a];
        let length = away.norm().max(1e-9);
        let step = away * ((length - self.length) / (length * (2.0 + MASS * GIVE / (dt * dt))));
        points[a] += step;
        points[b] -= step;
    }
}

impl Cell {
    fn correct(&self, points: &mut [Vector3<f64>]) {
        let [a, b, c, d] = self.corners;
        let [u, v, w] = [b, c, d].map(|corner| points[corner] - points[a]);
        // six times the volume and its gradients
        let (at_b, at_c, at_d) = (v.cross(&w), w.cross(&u), u.cross(&v));
        let at_a = -(at_b + at_c + at_d);
        let squares = [at_a, at_b, at_c, at_d]
            .iter()
            .map(|one| one.norm_squared())
            .sum::<f64>();
        let excess = u.dot(&at_b) - 6.0 * self.volume;
        let share = VOLUME_SHARE * excess / squares.max(1e-12);
        for (corner, gradient) in [(a, at_a), (b, at_b), (c, at_c), (d, at_d)] {
            points[corner] -= gradient * share;
        }
    }
}

fn mean(points: &[Vector3<f64>], anchor: &Anchor) -> Vector3<f64> {
    anchor
        .iter()
        .map(|&(index, weight)| points[index as usize] * weight)
        .sum()
}

/// Lattice places in use, in the order in which they were first asked for.
#[derive(Debug, Default)]
struct Particles {
    places: Vec<[i32; 3]>,
    index: std::collections::BTreeMap<[i32; 3], u32>,
}

impl Particles {
    fn at(&mut self, place: [i32; 3]) -> u32 {
        let next = self.places.len() as u32;
        let index = *self.index.entry(place).or_insert(next);
        if index == next {
            self.places.push(place);
        }
        index
    }

    /// The particles and weights of a point.
    fn anchor(&mut self, point: Vector3<f64>) -> Anchor {
        let scaled = point / CELL;
        let nearest: [i32; 3] = std::array::from_fn(|i| libm::round(scaled[i]) as i32);
        let weights: [[f64; 3]; 3] =
            std::array::from_fn(|i| quadratic_b_spline(scaled[i] - f64::from(nearest[i])));
        std::array::from_fn(|n| {
            let step = [n / 9, n / 3 % 3, n % 3];
            let place = std::array::from_fn(|i| nearest[i] + step[i] as i32 - 1);
            let weight = weights[0][step[0]] * weights[1][step[1]] * weights[2][step[2]];
            (self.at(place), weight)
        })
    }

    /// Adds what lies between the lowest and the highest particle of each column.
    fn fill(&mut self) {
        let mut columns = std::collections::BTreeMap::new();
        for &[i, j, k] in &self.places {
            let range = columns.entry([i, k]).or_insert((j, j));
            *range = (range.0.min(j), range.1.max(j));
        }
        for ([i, k], (low, high)) in columns {
            (low..=high).for_each(|j| {
                self.at([i, j, k]);
            });
        }
    }

    fn points(&self) -> Vec<Vector3<f64>> {
        let point = |place: &[i32; 3]| Vector3::from(place.map(f64::from)) * CELL;
        self.places.iter().map(point).collect()
    }

    /// The tetrahedra of all cells whose eight corners are there.
    fn cells(&self, points: &[Vector3<f64>]) -> Vec<Cell> {
        let mut cells = Vec::new();
        for place in &self.places {
            let corner = |bits: usize| {
                let step = |i: usize| (bits >> i & 1) as i32;
                let other = std::array::from_fn(|i| place[i] + step(i));
                self.index.get(&other).map(|&index| index as usize)
            };
            for tetrahedron in TETRAHEDRA {
                if let [Some(a), Some(b), Some(c), Some(d)] = tetrahedron.map(corner) {
                    let sides = [b, c, d].map(|end| points[end] - points[a]);
                    let volume = sides[0].dot(&sides[1].cross(&sides[2])) / 6.0;
                    cells.push(Cell {
                        corners: [a, b, c, d],
                        volume,
                    });
                }
            }
        }
        cells
    }

    /// Sides, face diagonals and space diagonals of the cells, each once.
    fn springs(&self, points: &[Vector3<f64>]) -> Vec<Spring> {
        let steps: Vec<[i32; 3]> = (0..27)
            .map(|n| [n / 9 - 1, n / 3 % 3 - 1, n % 3 - 1])
            .filter(|step| *step > [0, 0, 0])
            .collect();
        let mut springs = Vec::new();
        for (a, place) in self.places.iter().enumerate() {
            for step in &steps {
                let other = std::array::from_fn(|i| place[i] + step[i]);
                if let Some(&b) = self.index.get(&other) {
                    let ends = [a, b as usize];
                    let length = (points[ends[0]] - points[ends[1]]).norm();
                    springs.push(Spring { ends, length });
                }
            }
        }
        springs
    }
}

/// Five tetrahedra of a cube with corners (bits x, y, z), positively oriented.
const TETRAHEDRA: [[usize; 4]; 5] = [
    [0, 1, 2, 4],
    [3, 2, 1, 7],
    [5, 4, 7, 1],
    [6, 7, 4, 2],
    [1, 2, 4, 7],
];

/// Weights of the places before, at and after the nearest one, for an offset in \[-1/2, 1/2\].
fn quadratic_b_spline(offset: f64) -> [f64; 3] {
    let (before, after) = (0.5 - offset, 0.5 + offset);
    [
        0.5 * before * before,
        0.75 - offset * offset,
        0.5 * after * after,
    ]
}
