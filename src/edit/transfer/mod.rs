//! Deformation transfer (CH12 §4.3): the shape signal of a loom is replaced so that example shapes of
//! one mesh become example shapes of another; time and pose edits stay.
//!
//! With examples (q_j, r_j), j = 0..m, each in a shape space of the same kind about q_0 and about r_0,
//! and H = [q_1 - q_0, .., q_m - q_0] = Q R by column-pivoted QR, a shape z of the source is
//! q_0 + H y + rest with y = H^+ (z - q_0). The target's shape is r_0 + sum_j y_j (r_j - r_0): so h
//! becomes that, and g becomes p -> H^+ (h(g(p)) - q_0). Where the loom's own coordinates are those
//! about q_0 this is an affine change of g's coefficients; else the coordinates about q_0 of the loom's
//! shapes at its frames and sites are fitted again with the same sites, the branches of their rotations
//! drawn from frame to frame as in a sequence. f is not touched.

mod sight;
mod sites;

use std::sync::Arc;

use nalgebra::Vector3;

use self::sight::{Sight, take_branches_of};
use self::sites::{between, sites_by_frame};
use crate::diag::{Diagnostic, Result, Warned};
use crate::loom::{FitReport, Layout, Loom, Parts};
use crate::math::b_spline::Point;
use crate::math::pivoted_qr::PivotedQr;
use crate::math::rotation::nearest_branch;
use crate::math::thin_plate::{self, Rows};
use crate::mesh::{FrameSource, Sequence, Topology};
use crate::signal::pose::PoseSignal;
use crate::signal::root::{RootFrame, RootSignal};
use crate::signal::shape::ShapeSignal;
use crate::space::{MEAN_ROTATION, ShapeSpace, Spaces};
use crate::task::Task;

/// An example whose difference from the reference is reached by the others but for this part adds
/// nothing: single precision does not tell more.
const SAME: f64 = 1e-6;

/// An example is reported as nearly a blend of the others below this.
const NEARLY_SAME: f64 = 0.02;

/// Frames farther than this from what the examples span, relative to their distance from the reference,
/// are reported.
const OUTSIDE: f64 = 0.5;

/// Where the loom's sites miss the shapes that the examples see by more than this (relative), the new map
/// takes sites at frames too: the sites of an ordered fit serve its own coordinates.
const MISSED: f64 = 1e-3;

/// Distances from the reference pose below this part of the farthest example's are none.
const AT_REST: f64 = 1e-3;

/// Shapes of two meshes that correspond, pair by pair; the first pair is the reference pose.
#[derive(Debug, Clone)]
pub struct Examples {
    sources: Sequence,
    targets: Sequence,
}

impl Examples {
    /// Pairs of shapes: frame j of one belongs to frame j of the other.
    ///
    /// # Errors
    /// The numbers of shapes differ, or there are fewer than two.
    pub fn new(sources: Sequence, targets: Sequence) -> Result<Self> {
        let (n, m) = (sources.frames(), targets.frames());
        if n != m {
            return Diagnostic::error(format!("{n} source examples and {m} target examples"))
                .hint("the examples pair up in order, the first pair being the reference pose")
                .err();
        }
        if n < 2 {
            return Diagnostic::error("transfer needs two pairs of examples or more").err();
        }
        Ok(Examples { sources, targets })
    }

    /// How many pairs there are.
    pub fn pairs(&self) -> usize {
        self.sources.frames()
    }
}

/// What a transfer makes.
#[derive(Clone)]
pub struct Transferred {
    /// The loom of the target.
    pub loom: Loom,
    /// For each frame of the source its distance to what the examples span, relative to its distance
    /// from the reference pose (at least a thousandth of the farthest example's): 0 is reproduced, 1 is
    /// lost.
    pub coverage: Vec<f64>,
}

/// Transfers a loom to the mesh of the target examples, in the kind of shape space that the loom is in.
/// Root motion goes along, its lengths scaled by the ratio of the two meshes' sizes. Phases of `task`:
/// "examples", "transfer".
///
/// # Errors
/// The source examples have not the loom's connectivity; all examples are alike; the space does not suit
/// the target; the task was cancelled.
pub fn transfer(loom: &Loom, examples: &Examples, task: &Task) -> Result<Warned<Transferred>> {
    task.phase("examples", 2);
    same_faces(loom, &examples.sources)?;
    let sources = positions(&examples.sources);
    let sight = Sight::new(loom, &sources)?;
    let map = Map::new(&sight, &sources, examples, task)?;
    let mut warnings = map.warnings();
    task.phase("transfer", loom.frames());
    let frames = map.frames(&sight, task)?;
    let pose = map.pose(&sight, &frames)?;
    warnings.extend(outside(&frames.coverage));
    let loom = map.loom(loom, pose)?;
    Ok(Warned {
        output: Transferred {
            loom,
            coverage: frames.coverage,
        },
        warnings,
    })
}

/// From coordinates of the source to those of the target.
struct Map {
    topology: Arc<Topology>,
    target: Arc<dyn ShapeSpace>,
    q0: Vec<f64>,
    differences: PivotedQr,
    /// The largest |q_j - q_0|.
    reach: f64,
    r0: Vec<f64>,
    /// r_j - r_0, one after another.
    vectors: Vec<f64>,
    /// Mean vertex and size of the reference poses.
    bodies: [(Vector3<f64>, f64); 2],
}

/// The frames of the loom as seen from the examples.
struct Frames {
    positions: Vec<Point>,
    /// y, m numbers a frame.
    coordinates: Vec<f64>,
    coverage: Vec<f64>,
    /// The sites where the loom's own coordinates are others, and their y.
    beside: Vec<Point>,
    of_beside: Vec<f64>,
}

impl Map {
    fn new(sight: &Sight, sources: &[Vec<f64>], examples: &Examples, task: &Task) -> Result<Self> {
        let source = &*sight.space;
        task.step();
        let targets = positions(&examples.targets);
        let topology = Arc::clone(examples.targets.topology());
        let target = open(&topology, source.name(), &targets)?;
        task.check()?;
        task.step();
        let mut q: Vec<Vec<f64>> = sources.iter().map(|q| encoded(source, q)).collect();
        take_branches_of(sight, &mut q, task)?;
        let mut r: Vec<Vec<f64>> = targets.iter().map(|r| encoded(&*target, r)).collect();
        for (q, r) in q.iter().zip(&mut r) {
            align_mean_rotation((source, q), (&*target, r));
        }
        let moved = minus_first(&q);
        let differences = PivotedQr::new(&moved, SAME);
        if differences.rank() == 0 {
            return Diagnostic::error("all source examples are the reference pose").err();
        }
        Ok(Map {
            topology,
            reach: moved.iter().map(|q| norm(q)).fold(0.0, f64::max),
            bodies: [body(&sources[0]), body(&targets[0])],
            vectors: minus_first(&r).concat(),
            q0: q.into_iter().next().unwrap_or_default(),
            r0: r.into_iter().next().unwrap_or_default(),
            differences,
            target,
        })
    }

    fn warnings(&self) -> Vec<Diagnostic> {
        let novelty = self.differences.novelty().iter().enumerate();
        novelty
            .filter(|(_, new)| **new < NEARLY_SAME)
            .map(|(example, new)| {
                let percent = 100.0 * new;
                Diagnostic::warning(format!(
                    "source example {} is a blend of the others but for {percent:.2} %",
                    example + 2
                ))
            })
            .collect()
    }

    /// y of coordinates of the source about q_0, and how far they lie from what the examples span.
    fn coordinates(&self, z: &[f64]) -> (Vec<f64>, f64) {
        let from: Vec<f64> = z.iter().zip(&self.q0).map(|(z, q)| z - q).collect();
        let (y, distance) = self.differences.solve(&from);
        (y, distance / norm(&from).max(AT_REST * self.reach))
    }

    fn frames(&self, sight: &Sight, task: &Task) -> Result<Frames> {
        let positions: Result<Vec<Point>> = (0..sight.loom.frames())
            .map(|frame| sight.place(frame))
            .collect();
        let positions = positions?;
        let sites = sites_by_frame(sight.loom.pose().sites(), &positions);
        let width = self.differences.novelty().len();
        let mut frames = Frames {
            coordinates: vec![0.0; positions.len() * width],
            coverage: vec![0.0; positions.len()],
            positions,
            beside: Vec::new(),
            of_beside: Vec::new(),
        };
        sight.each_frame(task, |frame, z| {
            let (y, coverage) = self.coordinates(z);
            frames.coordinates[frame * width..][..width].copy_from_slice(&y);
            frames.coverage[frame] = coverage;
            if !sight.own {
                for &site in &sites[frame] {
                    let seen = sight.at(site, Some(z));
                    frames.beside.push(site);
                    frames.of_beside.extend(self.coordinates(&seen).0);
                }
            }
            task.step();
        })?;
        Ok(frames)
    }

    /// p -> H^+ (h(g(p)) - q_0).
    fn pose(&self, sight: &Sight, frames: &Frames) -> Result<PoseSignal> {
        let loom = sight.loom;
        if sight.own {
            return Ok(self.affine(loom));
        }
        let rows = Rows {
            positions: &[&frames.positions[..], &frames.beside].concat(),
            targets: &[&frames.coordinates[..], &frames.of_beside].concat(),
            width: self.differences.novelty().len(),
            weights: None,
        };
        let sites = loom.pose().sites();
        let fitted = thin_plate::fit(&rows, sites)
            .and_then(|plate| PoseSignal::new(plate, loom.pose().site_frames().to_vec()))
            .and_then(|pose| match missed(&pose, &rows) > MISSED {
                true => {
                    let more = between(sites, &frames.positions);
                    PoseSignal::new(thin_plate::fit(&rows, &more)?, Vec::new())
                }
                false => Ok(pose),
            });
        fitted.map_err(|_| Box::new(Diagnostic::error("the loom's shapes are not finite")))
    }

    /// The same as an affine change of g's values: H^+ H_old g + H^+ (h_0 - q_0).
    fn affine(&self, loom: &Loom) -> PoseSignal {
        let shape = loom.shape();
        let (m, old) = (self.differences.novelty().len(), shape.modes());
        let mut a = vec![0.0; m * old];
        for mode in 0..old {
            let (column, _) = self.differences.solve(shape.vector(mode));
            for (row, value) in column.into_iter().enumerate() {
                a[row * old + mode] = value;
            }
        }
        let (b, _) = self.coordinates(shape.offset());
        loom.pose().map_values(&a, &b)
    }

    fn loom(&self, source: &Loom, pose: PoseSignal) -> Result<Loom> {
        let modes = self.differences.novelty().len();
        let shape = ShapeSignal::new(self.r0.clone(), self.vectors.clone(), modes);
        let shape = shape.map_err(|error| Diagnostic::error(error.to_string()))?;
        let root = source.root().map(|root| self.root(root)).transpose()?;
        Loom::new(Parts {
            topology: Arc::clone(&self.topology),
            space: Arc::clone(&self.target),
            layout: Arc::new(layout(source.layout(), &pose)),
            shape: Arc::new(shape),
            pose: Arc::new(pose),
            root: root.map(Arc::new),
            report: Arc::new(FitReport {
                vertices: self.topology.vertices(),
                faces: self.topology.faces(),
                dimension: self.target.dimension(),
                modes,
                ..FitReport::clone(source.report())
            }),
            ..source.parts()
        })
    }

    /// Root motion of a body of another size.
    fn root(&self, root: &RootSignal) -> Result<RootSignal> {
        let [(_, from), (pivot, to)] = self.bodies;
        let scale = if from > 0.0 { to / from } else { 1.0 };
        let frames = root.frames().iter().map(|frame| RootFrame {
            position: pivot + (frame.position - root.pivot()) * scale,
            slope: frame.slope * scale,
            ..*frame
        });
        let scaled = RootSignal::new(root.kind(), pivot, frames.collect());
        scaled.map_err(|_| Box::new(Diagnostic::error("the root motion is not finite")))
    }
}

/// Frames where they were, with their new coordinates.
fn layout(source: &Layout, pose: &PoseSignal) -> Layout {
    let mut coordinates = vec![0.0; source.positions.len() * pose.modes()];
    let rows = coordinates.chunks_exact_mut(pose.modes().max(1));
    for (&p, row) in source.positions.iter().zip(rows) {
        pose.evaluate(p, row);
    }
    Layout {
        coordinates,
        residuals: vec![0.0; source.positions.len()],
        ..source.clone()
    }
}

/// The frames of examples in f64.
fn positions(sequence: &Sequence) -> Vec<Vec<f64>> {
    let frame = |frame| {
        sequence
            .frame(frame)
            .iter()
            .map(|&x| f64::from(x))
            .collect()
    };
    (0..sequence.frames()).map(frame).collect()
}

/// Source examples are shapes of the loom's own mesh.
fn same_faces(loom: &Loom, sources: &Sequence) -> Result<()> {
    let found = sources.topology();
    if found.same_connectivity(loom.topology()) {
        return Ok(());
    }
    let (v, w) = (found.vertices(), loom.topology().vertices());
    Diagnostic::error(format!(
        "the source examples have other faces than the loom ({v} and {w} vertices)"
    ))
    .hint("source examples are shapes of the loom's own mesh; are the lists the right way round?")
    .err()
}

/// The space about the first of some shapes.
fn open(topology: &Arc<Topology>, name: &str, shapes: &[Vec<f64>]) -> Result<Arc<dyn ShapeSpace>> {
    let rows: Vec<&[f64]> = shapes.iter().map(Vec::as_slice).collect();
    let spaces = Spaces::new(Arc::clone(topology), &shapes[0]);
    Ok(spaces.open(name, &rows)?)
}

fn encoded(space: &dyn ShapeSpace, shape: &[f64]) -> Vec<f64> {
    let mut coordinates = vec![0.0; space.dimension()];
    space.encode(shape, &mut coordinates);
    coordinates
}

/// The root mean square by which a pose signal misses rows, relative to the rows.
fn missed(pose: &PoseSignal, rows: &Rows) -> f64 {
    let mut y = vec![0.0; rows.width];
    let (mut off, mut size) = (0.0, 0.0);
    for (&p, wanted) in rows
        .positions
        .iter()
        .zip(rows.targets.chunks_exact(rows.width))
    {
        pose.evaluate(p, &mut y);
        off += distance(&y, wanted).powi(2);
        size += norm(wanted).powi(2);
    }
    if size > 0.0 { (off / size).sqrt() } else { 0.0 }
}

fn distance(a: &[f64], b: &[f64]) -> f64 {
    let squares = a.iter().zip(b).map(|(a, b)| (a - b) * (a - b));
    squares.sum::<f64>().sqrt()
}

/// Takes the branch of the target's mean rotation that is nearest the source's.
fn align_mean_rotation(
    (source, q): (&dyn ShapeSpace, &[f64]),
    (target, r): (&dyn ShapeSpace, &mut [f64]),
) {
    let find = |space: &dyn ShapeSpace| {
        let blocks = space.blocks();
        blocks.into_iter().find(|block| block.name == MEAN_ROTATION)
    };
    if let (Some(from), Some(to)) = (find(source), find(target)) {
        let near = Vector3::from_column_slice(&q[from.range]) / from.weight;
        let place = &mut r[to.range];
        let turn = nearest_branch(&(Vector3::from_column_slice(place) / to.weight), &near);
        place.copy_from_slice((turn * to.weight).as_slice());
    }
}

fn norm(v: &[f64]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// All but the first, less the first.
fn minus_first(rows: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let minus = |row: &Vec<f64>| row.iter().zip(&rows[0]).map(|(a, b)| a - b).collect();
    rows[1..].iter().map(minus).collect()
}

/// Mean vertex and root mean square distance from it.
fn body(shape: &[f64]) -> (Vector3<f64>, f64) {
    let points = || shape.chunks_exact(3).map(Vector3::from_column_slice);
    let count = points().len().max(1) as f64;
    let mean = points().sum::<Vector3<f64>>() / count;
    let squares: f64 = points().map(|point| (point - mean).norm_squared()).sum();
    (mean, (squares / count).sqrt())
}

/// Names the frames that the examples do not reach.
fn outside(coverage: &[f64]) -> Option<Diagnostic> {
    let far: Vec<usize> = (0..coverage.len())
        .filter(|&i| coverage[i] > OUTSIDE)
        .collect();
    let worst = *far
        .iter()
        .max_by(|&&a, &&b| coverage[a].total_cmp(&coverage[b]))?;
    Some(
        Diagnostic::warning(format!(
            "{} of {} frames are mostly outside of what the examples span, this one by {:.0} %",
            far.len(),
            coverage.len(),
            100.0 * coverage[worst]
        ))
        .at_frame(worst + 1)
        .hint("add a pair of examples like it"),
    )
}
