//! Edge lengths and dihedral angles, R^(2E+6) (Winkler et al. 2010, Froehlich & Botsch 2011; CH12 §5):
//! the length of each edge, the angle between the two triangles at each, then the shape's placement. A
//! border edge has no angle, one with m triangles m - 1 of them; parts that no edge joins add to the
//! placement as in [`super::PatchLri`].
//!
//! Right for blends that must keep a shape's own lengths and folds; half the numbers of lri, the
//! slowest to decode, and it cannot extrapolate far: lengths turn negative.
//!
//! Decoding: lengths give each triangle its shape, angles the rotation between neighbours; all
//! rotations follow from these ([`RotationGraph`]), positions from one Poisson solve. Lengths and
//! angles of a shape are met by that already. Those between shapes contradict each other: then
//! Gauss-Newton steps on the positions (sparse Cholesky, analysed once) bring both residuals down. Where
//! slivers fold, their angles are so far from linear in the positions that such steps are refused; after
//! two of them the linear solution stays.
//!
//! Degenerate input: a triangle without a plane takes a normal as in [`super::Gradients`]; an edge of
//! no length has no angle, and where nothing else joins its triangles the rotation between them is lost.

use std::f64::consts::TAU;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use nalgebra::{UnitQuaternion, Vector3};
use rayon::prelude::*;

use super::orientation::{group_rotations, polar_factors};
use super::placement::{Placement, blocks_from, triple};
use super::refine::{Fold, Refine, Span, Wanted};
use super::registry::State;
use super::scales::Scales;
use super::{Block, Invariance, LARGE_TURN, ShapeSpace, SpaceError};
use crate::math::rotation::exp;
use crate::math::rotation_graph::RotationGraph;
use crate::mesh::dihedral::{heading, signed_angle, triangle_of_lengths};
use crate::mesh::{Components, Hinges, NO_EDGE, Poisson, Polar};

/// Triangles or edges that one thread takes at a time.
const CHUNK: usize = 1024;

/// Edges shorter than this part of the typical length count as this long in the weights.
const SHORT: f64 = 1e-3;

/// The space of edge lengths and dihedral angles.
pub struct LengthsAngles {
    poisson: Arc<Poisson>,
    reference: Arc<[f64]>,
    hinges: Arc<Hinges>,
    graph: RotationGraph,
    /// The part of each triangle, triangles being joined across edges.
    group: Components,
    length: f64,
    angle: f64,
    /// Factor of each hinge's angle besides the block's: its edge's length over the typical length.
    shares: Vec<f64>,
    /// Each hinge's angle in the reference pose; those of shapes are taken within a half turn of it.
    rest: Vec<f64>,
    placement: Placement,
    refine: OnceLock<Option<Refine>>,
    pool: Mutex<Vec<Workspace>>,
}

#[derive(Default)]
struct Workspace {
    polars: Vec<Polar>,
    shapes: Vec<[f64; 3]>,
    relative: Vec<UnitQuaternion<f64>>,
    certain: Vec<bool>,
    frames: Vec<UnitQuaternion<f64>>,
}

impl LengthsAngles {
    /// The space over a factored system; `reference` is the pose it was made for.
    pub(super) fn new(
        poisson: Arc<Poisson>,
        reference: Arc<[f64]>,
        hinges: Arc<Hinges>,
    ) -> Result<Self, SpaceError> {
        let scales = Scales::new(&reference);
        let lengths: Vec<f64> = hinges
            .edges()
            .iter()
            .map(|&edge| length(&reference, edge))
            .collect();
        let squares: f64 = lengths.iter().map(|l| l * l).sum();
        let typical = match squares > 0.0 {
            true => (squares / lengths.len() as f64).sqrt(),
            false => 1.0,
        };
        let share = |edge: u32| (lengths[edge as usize] / typical).max(SHORT);
        let shares: Vec<f64> = hinges.hinges().iter().map(|h| share(h.edge)).collect();
        let links: Vec<[u32; 2]> = hinges.hinges().iter().map(|h| h.triangles()).collect();
        let faces = poisson.reference().len();
        let group = Components::joined(faces, links.iter().copied());
        let mut areas = vec![0.0; group.count()];
        for (triangle, &group) in poisson.reference().iter().zip(group.part()) {
            areas[group as usize] += triangle.area();
        }
        let total: f64 = areas.iter().sum();
        areas.iter_mut().for_each(|area| *area /= total);
        let weights = shares.iter().map(|share| share * share).collect();
        let components = poisson.analysis().components().clone();
        let mut space = LengthsAngles {
            graph: RotationGraph::new(faces, links, weights)
                .map_err(|error| SpaceError::of_rotations(error, "triangle"))?,
            placement: Placement::new(components, &areas, &scales),
            length: scales.size() / (typical * (lengths.len().max(1) as f64).sqrt()),
            angle: scales.rotation(),
            shares,
            group,
            poisson,
            reference,
            hinges,
            rest: Vec::new(),
            refine: OnceLock::new(),
            pool: Mutex::default(),
        };
        let mut polars = Vec::new();
        let (triangles, pose) = (space.triangles(), &space.reference);
        polar_factors(space.poisson.reference(), triangles, pose, &mut polars);
        space.rest = (0..space.shares.len())
            .map(|hinge| space.angle_of(hinge, pose, &polars))
            .collect();
        Ok(space)
    }

    /// Where angles and placement start.
    fn starts(&self) -> [usize; 2] {
        let lengths = self.hinges.edges().len();
        [lengths, lengths + self.hinges.hinges().len()]
    }

    fn triangles(&self) -> &[[u32; 3]] {
        self.poisson.analysis().triangles()
    }

    /// The angle of a hinge in a shape with these polar factors, in (-pi, pi].
    fn angle_of(&self, hinge: usize, positions: &[f64], polars: &[Polar]) -> f64 {
        let hinge = self.hinges.hinges()[hinge];
        let [a, b] = self.hinges.edges()[hinge.edge as usize];
        let e = triple(positions, b as usize) - triple(positions, a as usize);
        let size = e.norm();
        if size == 0.0 {
            return 0.0;
        }
        let [n, m] = hinge.triangles().map(|face| {
            let face = face as usize;
            polars[face].rotation * self.poisson.reference()[face].normal
        });
        signed_angle(&(e / size), &n, &m)
    }

    /// The lengths of the sides 01, 12, 20 of a triangle.
    fn sides(&self, coordinates: &[f64], face: usize) -> [f64; 3] {
        std::array::from_fn(|k| match self.hinges.side_edges()[3 * face + k] {
            NO_EDGE => 0.0,
            edge => (coordinates[edge as usize] / self.length).max(0.0),
        })
    }

    /// In the plane of a triangle, the heading of its side at a hinge, from the smaller vertex to the
    /// larger.
    fn side_heading(&self, side: u32, shapes: &[[f64; 3]]) -> Option<UnitQuaternion<f64>> {
        let (face, k) = ((side / 3) as usize, (side % 3) as usize);
        let [length, offset, height] = shapes[face];
        let corners = [[0.0, 0.0], [length, 0.0], [offset, height]];
        let (from, to) = (k, (k + 1) % 3);
        let points = self.triangles()[face];
        let sign = if points[from] < points[to] { 1.0 } else { -1.0 };
        let [x, y] = [0, 1].map(|axis| sign * (corners[to][axis] - corners[from][axis]));
        heading(x, y)
    }

    /// The rotation from the frame of the hinge's first triangle to that of its second, and whether it
    /// is known.
    fn across(
        &self,
        angles: &[f64],
        hinge: usize,
        shapes: &[[f64; 3]],
    ) -> (UnitQuaternion<f64>, bool) {
        let sides = self.hinges.hinges()[hinge].sides;
        let headings = sides.map(|side| self.side_heading(side, shapes));
        let [Some(first), Some(second)] = headings else {
            return (UnitQuaternion::identity(), false);
        };
        let angle = angles[hinge] / (self.angle * self.shares[hinge]);
        let fold = exp(&Vector3::new(angle, 0.0, 0.0));
        (first * fold * second.inverse(), true)
    }

    /// The sides of every triangle from corner 0, turned as the placement's groups say.
    fn turned_sides(&self, placement: &[f64], workspace: &mut Workspace) {
        let Workspace {
            polars,
            shapes,
            frames,
            ..
        } = workspace;
        let sides = |face: usize, frame: &UnitQuaternion<f64>| {
            let [length, offset, height] = shapes[face];
            [
                frame * Vector3::new(length, 0.0, 0.0),
                frame * Vector3::new(offset, height, 0.0),
            ]
        };
        let reference = self.poisson.reference();
        let turn = |face: usize| {
            let [e1, e2] = sides(face, &frames[face]);
            match reference[face].polar(&e1, &e2) {
                Some(polar) => polar.rotation,
                None => polars[face].rotation,
            }
        };
        let turns = (0..shapes.len()).map(turn);
        let groups = self.group.count();
        let (means, _) = group_rotations(reference, turns, self.group.part(), groups);
        let back: Vec<_> = means
            .iter()
            .enumerate()
            .map(|(group, mean)| self.placement.group_rotation(placement, group) * mean.inverse())
            .collect();
        for (frame, &group) in frames.iter_mut().zip(self.group.part()) {
            *frame = back[group as usize] * *frame;
        }
    }

    /// Positions from lengths and angles, turned back by the mean rotation.
    fn linear(&self, coordinates: &[f64], positions: &mut [f64]) {
        let [lengths, placement] = self.starts();
        let mut workspace = self.lock().pop().unwrap_or_default();
        let faces = self.triangles().len();
        let Workspace {
            polars,
            shapes,
            relative,
            certain,
            frames,
        } = &mut workspace;
        (0..faces)
            .into_par_iter()
            .with_min_len(CHUNK)
            .map(|face| triangle_of_lengths(self.sides(coordinates, face)))
            .collect_into_vec(shapes);
        (0..placement - lengths)
            .into_par_iter()
            .with_min_len(CHUNK)
            .map(|hinge| self.across(&coordinates[lengths..placement], hinge, shapes))
            .unzip_into_vecs(relative, certain);
        frames.resize(faces, UnitQuaternion::identity());
        let identity = Polar {
            rotation: UnitQuaternion::identity(),
            stretch: [0.0; 3],
        };
        polars.clear();
        polars.resize(faces, identity);
        self.graph.solve(relative, &|hinge| certain[hinge], frames);
        self.turned_sides(&coordinates[placement..], &mut workspace);
        let Workspace { shapes, frames, .. } = &workspace;
        self.poisson.solve(
            |face| {
                let [length, offset, height] = shapes[face];
                let e1 = frames[face] * Vector3::new(length, 0.0, 0.0);
                let e2 = frames[face] * Vector3::new(offset, height, 0.0);
                self.poisson.reference()[face].images(&e1, &e2)
            },
            positions,
        );
        self.lock().push(workspace);
    }

    /// Gauss-Newton on what the linear solution leaves, where it leaves something.
    fn polish(&self, coordinates: &[f64], positions: &mut [f64]) {
        let [lengths, placement] = self.starts();
        let refine = self.refine.get_or_init(|| self.residuals().ok());
        let Some(refine) = refine else { return };
        let (bare, weight) = (&coordinates[..lengths], self.length);
        let length = |edge: usize| (bare[edge] / weight).max(0.0);
        let angles = &coordinates[lengths..placement];
        let angle = |hinge: usize| angles[hinge] / (self.angle * self.shares[hinge]);
        let wanted = Wanted {
            length: &length,
            angle: &angle,
        };
        if !refine.run(&wanted, positions) {
            return;
        }
        let mut polars = Vec::new();
        let reference = self.poisson.reference();
        let mean = polar_factors(reference, self.triangles(), positions, &mut polars);
        let back = mean.inverse();
        for place in positions.chunks_exact_mut(3) {
            let turned = back * Vector3::from_column_slice(place);
            place.copy_from_slice(turned.as_slice());
        }
    }

    /// The residuals of lengths and angles as sparse least squares.
    fn residuals(&self) -> Result<Refine, SpaceError> {
        let spans = self.hinges.edges().iter().map(|&ends| Span {
            ends,
            weight: self.length,
        });
        let folds = self.hinges.hinges().iter().zip(&self.shares);
        let folds = folds.map(|(hinge, share)| {
            let ends = self.hinges.edges()[hinge.edge as usize];
            let wings = hinge.sides.map(|side| {
                let points = self.triangles()[side as usize / 3];
                (points[(side as usize % 3 + 2) % 3], forward(points, side))
            });
            Fold {
                ends,
                wings: wings.map(|(wing, _)| wing),
                flips: wings.map(|(_, forward)| !forward),
                weight: self.angle * share,
            }
        });
        let vertices = self.reference.len() / 3;
        Ok(Refine::new(vertices, spans.collect(), folds.collect())?)
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, Vec<Workspace>> {
        self.pool.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl ShapeSpace for LengthsAngles {
    fn name(&self) -> &'static str {
        "lengths-angles"
    }

    fn dimension(&self) -> usize {
        self.starts()[1] + self.placement.dimension()
    }

    fn invariance(&self) -> Invariance {
        match self.triangles().len() {
            0 => Invariance::None,
            _ => Invariance::Rigid,
        }
    }

    fn blocks(&self) -> Vec<Block> {
        let [lengths, placement] = self.starts();
        let bare = [
            ("edge length", lengths, self.length),
            ("dihedral angle", placement - lengths, self.angle),
        ];
        let mut blocks = blocks_from(0, &bare);
        blocks.extend(self.placement.blocks(placement));
        blocks
    }

    fn state(&self) -> State {
        State::new(self, &self.reference)
    }

    fn encode(&self, positions: &[f64], coordinates: &mut [f64]) {
        let [lengths, placement] = self.starts();
        let mut workspace = self.lock().pop().unwrap_or_default();
        let polars = &mut workspace.polars;
        let reference = self.poisson.reference();
        polar_factors(reference, self.triangles(), positions, polars);
        for (out, &edge) in coordinates.iter_mut().zip(self.hinges.edges()) {
            *out = length(positions, edge) * self.length;
        }
        coordinates[lengths..placement]
            .par_iter_mut()
            .enumerate()
            .with_min_len(CHUNK)
            .for_each(|(hinge, out)| {
                let rest = self.rest[hinge];
                let off = self.angle_of(hinge, positions, polars) - rest;
                let angle = rest + off - TAU * libm::round(off / TAU);
                *out = angle * self.angle * self.shares[hinge];
            });
        let turns = polars.iter().map(|polar| polar.rotation);
        let groups = self.group.count();
        let (groups, mean) = group_rotations(reference, turns, self.group.part(), groups);
        self.placement
            .encode(positions, &mean, &groups, &mut coordinates[placement..]);
        self.lock().push(workspace);
    }

    fn follow(&self, near: &[f64], coordinates: &mut [f64]) -> usize {
        let [lengths, placement] = self.starts();
        let mut turns = 0;
        for (hinge, share) in self.shares.iter().enumerate() {
            let at = lengths + hinge;
            let turn = TAU * self.angle * share;
            coordinates[at] += turn * libm::round((near[at] - coordinates[at]) / turn);
            let step = (near[at] - coordinates[at]).abs() / (self.angle * share);
            turns += usize::from(step > LARGE_TURN);
        }
        let rest = &mut coordinates[placement..];
        turns + self.placement.follow(&near[placement..], rest)
    }

    fn decode(&self, coordinates: &[f64], positions: &mut [f64]) {
        self.linear(coordinates, positions);
        self.polish(coordinates, positions);
        let placement = self.starts()[1];
        self.placement.decode(&coordinates[placement..], positions);
    }
}

/// The length of an edge.
fn length(positions: &[f64], [a, b]: [u32; 2]) -> f64 {
    (triple(positions, b as usize) - triple(positions, a as usize)).norm()
}

/// Whether a side runs from its smaller vertex to its larger.
fn forward(points: [u32; 3], side: u32) -> bool {
    let k = side as usize % 3;
    points[k] < points[(k + 1) % 3]
}
