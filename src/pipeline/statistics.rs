//! Statistics of poses: mean, principal components, expression transfer, and their picture.

use std::sync::Arc;

use rayon::prelude::*;
use serde::Serialize;

use super::value::Shape;
use crate::diag::{Diagnostic, Result, Warned};
use crate::mesh::{Edges, FrameSource, Sequence, Topology};
use crate::plot::{
    Group, MapNames, PoseSpace, Scatter, Scene, Spectrum, Theme, Tint, scatter, spectrum,
};
use crate::space::SPACES;
use crate::statistics::{
    ByLengths, EDGE_LENGTHS, Ground, Population, Returned, Way, aligned, scale_free,
};
use crate::task::Task;

/// What is asked of statistics.
#[derive(Debug, Clone, PartialEq)]
pub struct StatisticsRequest {
    /// The shape space's name, or `edge-lengths`.
    pub space: String,
    /// Whether size is no difference of shape.
    pub scale_free: bool,
}

impl Default for StatisticsRequest {
    fn default() -> Self {
        StatisticsRequest {
            space: "gradients".to_string(),
            scale_free: false,
        }
    }
}

/// Poses of one mesh, their mean and the directions in which they differ most.
pub struct Statistics {
    topology: Arc<Topology>,
    poses: Vec<Vec<f64>>,
    ground: Ground,
    population: Population,
    request: StatisticsRequest,
}

/// What was found, as the command line's JSON has it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StatisticsReport {
    /// How many poses there are.
    pub poses: usize,
    /// The shape space's name, or `edge-lengths`.
    pub space: String,
    /// How many coordinates a shape has.
    pub dimension: usize,
    /// Whether size was taken off.
    pub scale_free: bool,
    /// The share of each mode in the variance, largest first; together 1.
    pub explained: Vec<f64>,
    /// The standard deviation along each mode, in units of the space.
    pub sigmas: Vec<f64>,
    /// Where each pose lies along each mode, from the mean.
    pub coordinates: Vec<Vec<f64>>,
}

/// How edge lengths became a shape again, as the command line's JSON has it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ReturnedReport {
    /// Which shape: `mean`, or `mode 1, -2 sigma`.
    pub shape: String,
    /// `embedding` (R14 §2), or `layout` where triangles laid out as they fit do better.
    pub by: &'static str,
    /// Root mean square error of the lengths over their mean, in percent.
    pub edge_rms_percent: f64,
    /// The largest error of an edge, in percent of its length.
    pub edge_worst_percent: f64,
}

impl ReturnedReport {
    fn new(shape: String, by: ByLengths) -> Self {
        ReturnedReport {
            shape,
            by: by.way.name(),
            edge_rms_percent: by.rms_percent,
            edge_worst_percent: by.worst_percent,
        }
    }
}

/// Shapes found from their coordinates.
#[derive(Debug, Clone)]
pub struct Found<T> {
    /// The shape or shapes.
    pub output: T,
    /// How lengths became them; none in a shape space.
    pub returned: Vec<ReturnedReport>,
}

/// Samples along a mode: from -2 to 2 standard deviations in steps of a half.
pub const SAMPLES: usize = 9;

/// Size of the figure, in units.
const FIGURE: [f32; 2] = [1200.0, 620.0];

/// The part of its width that the scatter plot takes.
const SCATTER: f32 = 0.66;

/// Analyses the frames of `poses`, aligned rigidly.
///
/// # Errors
/// Fewer than two poses, an unknown space, a mesh that the space does not suit, cancellation.
pub fn statistics(
    poses: &Sequence,
    request: &StatisticsRequest,
    task: &Task,
) -> Result<Statistics> {
    let n = poses.frames();
    if n < 2 {
        return Diagnostic::error(format!("statistics need two poses, here is {n}"))
            .hint("name several meshes, or a folder or file that holds several frames")
            .err();
    }
    known(&request.space)?;
    task.phase("statistics", n);
    let topology = Arc::clone(poses.topology());
    let mut shapes: Vec<Vec<f64>> = (0..n).map(|pose| doubles(poses.frame(pose))).collect();
    if request.scale_free {
        shapes = scale_free(&shapes, Edges::new(&topology).ends());
    }
    let shapes = aligned(&shapes);
    let ground = Ground::open(&request.space, &topology, &shapes)?;
    let population = Population::new(&ground, &shapes, task)?;
    Ok(Statistics {
        topology,
        poses: shapes,
        ground,
        population,
        request: request.clone(),
    })
}

/// Refuses the name of no space.
fn known(space: &str) -> Result<()> {
    let names = SPACES.iter().map(|kind| kind.name).chain([EDGE_LENGTHS]);
    let names: Vec<&str> = names.collect();
    match names.contains(&space) {
        true => Ok(()),
        false => Diagnostic::error(format!("there is no space `{space}`"))
            .hint(format!("there are {}", names.join(", ")))
            .err(),
    }
}

impl Statistics {
    /// How many modes there are: at most the poses but one.
    pub fn modes(&self) -> usize {
        self.population.modes()
    }

    /// Bytes that it holds.
    pub(super) fn bytes(&self) -> usize {
        let d = self.ground.dimension();
        // in edge lengths the poses are held with their dihedral angles
        8 * (d * (self.modes() + 1) + self.poses.len() * (6 * self.topology.vertices() + 2 * d))
    }

    /// What was found.
    pub fn report(&self) -> StatisticsReport {
        let coordinates =
            (0..self.poses.len()).map(|pose| self.population.coordinates(pose).to_vec());
        StatisticsReport {
            poses: self.poses.len(),
            space: self.request.space.clone(),
            dimension: self.ground.dimension(),
            scale_free: self.request.scale_free,
            explained: self.population.explained().to_vec(),
            sigmas: self.population.sigmas().to_vec(),
            coordinates: coordinates.collect(),
        }
    }

    /// The mean shape; it lies where the first pose lies.
    ///
    /// # Errors
    /// None that finite poses can cause.
    pub fn mean(&self) -> Result<Warned<Found<Shape>>> {
        self.shape("mean", &self.population.along(0, 0.0))
    }

    /// The shape `sigmas` standard deviations along a mode, counted from 1.
    ///
    /// # Errors
    /// There is no such mode.
    pub fn sample(&self, mode: usize, sigmas: f64) -> Result<Warned<Found<Shape>>> {
        if mode == 0 || mode > self.modes() {
            return Diagnostic::error(format!(
                "there is no mode {mode}: {} poses",
                self.poses.len()
            ))
            .hint(format!("choose within 1:{}", self.modes()))
            .err();
        }
        let name = format!("mode {mode}, {sigmas} sigma");
        self.shape(&name, &self.population.along(mode - 1, sigmas))
    }

    /// [`SAMPLES`] shapes along a mode, counted from 1, from -2 to 2 standard deviations.
    ///
    /// # Errors
    /// There is no such mode; cancellation.
    pub fn along(&self, mode: usize, task: &Task) -> Result<Warned<Found<Sequence>>> {
        let sampled = |step: usize| {
            task.check()?;
            self.sample(mode, step as f64 * 4.0 / (SAMPLES - 1) as f64 - 2.0)
        };
        let samples: Result<Vec<_>> = (0..SAMPLES).into_par_iter().map(sampled).collect();
        let (mut positions, mut returned) = (Vec::new(), Vec::new());
        let mut warnings = Vec::new();
        for sample in samples? {
            let found = sample.unpack(&mut warnings);
            positions.extend(found.output.positions);
            returned.extend(found.returned);
        }
        Ok(Warned {
            output: Found {
                output: Sequence::new(Arc::clone(&self.topology), positions, None),
                returned,
            },
            warnings,
        })
    }

    /// The shape `along` the first modes from the mean.
    fn shape(&self, name: &str, along: &[f64]) -> Result<Warned<Found<Shape>>> {
        let code = self.population.at(along);
        let found = self.ground.decode(&code, &self.population.weights(along))?;
        let told = told_of(&self.ground, &code, &found);
        Ok(Warned {
            output: Found {
                output: shape(&self.topology, &found.positions),
                returned: found
                    .by
                    .map(|by| ReturnedReport::new(name.to_string(), by))
                    .into_iter()
                    .collect(),
            },
            warnings: told
                .map(|warning| Diagnostic {
                    message: format!("{name}: {}", warning.message),
                    ..warning
                })
                .into_iter()
                .collect(),
        })
    }

    /// The connectivity.
    pub fn topology(&self) -> &Arc<Topology> {
        &self.topology
    }

    /// The poses as they were compared: aligned rigidly, of one size where that was asked.
    pub fn aligned_poses(&self) -> Sequence {
        let positions = self.poses.iter().flatten().map(|&x| x as f32);
        Sequence::new(Arc::clone(&self.topology), positions.collect(), None)
    }

    /// The shape of a point of the plane of the first two modes: the mean and that much of each.
    ///
    /// # Errors
    /// None that finite places can cause.
    pub fn shape_of(&self, place: [f64; 2]) -> Result<Warned<Shape>> {
        let modes = self.modes().min(2);
        let found = self.shape("the shape there", &place[..modes])?;
        Ok(found.map(|found| found.output))
    }

    /// Where a pose (from 0) lies in the plane of the first two modes.
    pub fn place(&self, pose: usize) -> [f64; 2] {
        let along = self.population.coordinates(pose);
        [0, 1].map(|mode| along.get(mode).copied().unwrap_or(0.0))
    }

    /// The share of each mode in the variance, largest first.
    pub fn explained(&self) -> &[f64] {
        self.population.explained()
    }

    /// What an axis of the plane is called, counted from 0; nothing where there is no such mode.
    fn axis(&self, mode: usize) -> String {
        match self.explained().get(mode) {
            Some(share) => format!("mode {} ({:.0} %)", mode + 1, 100.0 * share),
            None => String::new(),
        }
    }

    /// The plane of the first two modes as a map: the poses in it.
    pub fn map(&self) -> PoseSpace {
        PoseSpace {
            frames: (0..self.poses.len()).map(|pose| self.place(pose)).collect(),
            shown: (1..=self.poses.len()).collect(),
            names: MapNames {
                curve: "",
                points: "poses",
                last: "",
                x: self.axis(0),
                y: self.axis(1),
            },
            ..PoseSpace::default()
        }
    }

    /// The shares of the modes as a plot's data, in percent.
    pub fn shares(&self) -> Spectrum {
        let shares = self.explained();
        Spectrum {
            values: shares.iter().map(|share| 100.0 * share).collect(),
            kept: shares.len(),
            name: "share of the variance, %".into(),
        }
    }

    /// The poses by their first two modes, with their names, and the shares of all modes.
    pub fn figure(&self, names: &[String], theme: &Theme) -> Scene {
        let [width, height] = FIGURE;
        let place = |pose: usize| {
            let name = names.get(pose).cloned();
            (
                self.place(pose),
                name.unwrap_or_else(|| (pose + 1).to_string()),
            )
        };
        let points = Scatter {
            x: self.axis(0),
            y: self.axis(1),
            groups: vec![
                Group {
                    name: "mean".into(),
                    tint: Tint::Muted,
                    points: vec![([0.0, 0.0], String::new())],
                },
                Group {
                    name: "poses".into(),
                    tint: Tint::Series(0),
                    points: (0..self.poses.len()).map(place).collect(),
                },
            ],
        };
        let first = (SCATTER * width).round();
        let mut scene = Scene::new(width, height, theme.background);
        scene.place(scatter(&points, first, height, theme).0, [0.0, 0.0]);
        let rest = spectrum(&self.shares(), width - first, height, theme).0;
        scene.place(rest, [first, 0.0]);
        scene
    }
}

impl std::fmt::Debug for Statistics {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Statistics")
            .field("poses", &self.poses.len())
            .field("request", &self.request)
            .finish_non_exhaustive()
    }
}

/// For people: how many poses, and the shares of the first modes.
impl std::fmt::Display for Statistics {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let shares = self.population.explained().iter().take(5);
        let shares: Vec<String> = shares
            .map(|share| format!("{:.1} %", 100.0 * share))
            .collect();
        write!(
            f,
            "{} poses; variance by mode {}",
            self.poses.len(),
            shares.join(", ")
        )
    }
}

/// The shape that `pose` becomes when the difference between two other shapes of the mesh is added to
/// it; it lies where `pose` lies. The three are the frames of `shapes`: pose, from, to.
///
/// # Errors
/// Not three shapes; as [`statistics`].
pub fn add_difference(shapes: &Sequence, space: &str) -> Result<Warned<Shape>> {
    if shapes.frames() != 3 {
        return Diagnostic::error("a difference is added to one shape and taken between two")
            .hint("`add_difference(pose, from, to)` takes three meshes")
            .err();
    }
    known(space)?;
    let shapes_of = |frame| doubles(shapes.frame(frame));
    let poses = aligned(&[shapes_of(0), shapes_of(1), shapes_of(2)]);
    // the difference between the two is none of place: each lies nearest the other
    let pair = aligned(&poses[1..]);
    let topology = shapes.topology();
    let ground = Ground::open(
        space,
        topology,
        &[poses[0].clone(), pair[0].clone(), pair[1].clone()],
    )?;
    let code = ground.moved(&poses[0], &pair[0], &pair[1]);
    let found = ground.decode(&code, &[1.0, -1.0, 1.0])?;
    Ok(Warned {
        warnings: told_of(&ground, &code, &found).into_iter().collect(),
        output: shape(topology, &found.positions),
    })
}

/// A shape laid out with edges off by more than this (root mean square, percent) is told.
const NEAR: f64 = 0.5;

/// What is said of lengths that are those of no triangle, or that were not embedded.
fn told_of(ground: &Ground, code: &[f64], found: &Returned) -> Option<Diagnostic> {
    let by = found.by.filter(|by| by.way == Way::Layout)?;
    if let Some(face) = ground.broken(code) {
        let told = Diagnostic::warning("edge lengths that no triangle has: it becomes a line");
        let hint = "go less far from the mean, or use a shape space";
        return Some(told.at_face(face + 1).hint(hint));
    }
    (by.rms_percent > NEAR).then(|| {
        Diagnostic::warning(format!(
            "its triangles were laid out as they fit, edges being off by {:.2} % (root mean square): no embedding was found that meets them better",
            by.rms_percent
        ))
    })
}

fn shape(topology: &Arc<Topology>, positions: &[f64]) -> Shape {
    Shape {
        topology: Arc::clone(topology),
        positions: positions.iter().map(|&x| x as f32).collect(),
    }
}

fn doubles(row: &[f32]) -> Vec<f64> {
    row.iter().map(|&x| f64::from(x)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::demo::Demo;
    use crate::plot::Item;

    fn cactus() -> Sequence {
        Demo::find("cactus").unwrap().generate()
    }

    fn found(space: &str) -> Statistics {
        let request = StatisticsRequest {
            space: space.into(),
            ..StatisticsRequest::default()
        };
        statistics(&cactus(), &request, &Task::default()).unwrap()
    }

    #[test]
    fn the_figure_has_a_point_and_a_name_for_each_pose() {
        let names = ["left", "front", "right"].map(String::from);
        let scene = found("gradients").figure(&names, &Theme::light());
        for name in &names {
            let told = |item: &&Item| matches!(item, Item::Text(label) if label.text == *name);
            assert_eq!(scene.items.iter().filter(told).count(), 1, "{name}");
        }
    }

    #[test]
    fn a_pose_s_place_in_the_plane_of_all_modes_has_its_shape() {
        let found = found("gradients");
        let poses = found.aligned_poses();
        let map = found.map();
        assert!(map.names.x.contains("mode 1 (") && map.frames.len() == 3);
        for (pose, place) in map.frames.iter().enumerate() {
            let shape = found.shape_of(*place).unwrap().output;
            let pairs = shape.positions.iter().zip(poses.frame(pose));
            // three poses lie in a plane; f32 positions of a cactus about a metre high
            assert!(pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max) < 1e-5);
        }
        let mean = found.mean().unwrap().output.output;
        assert_eq!(
            found.shape_of([0.0; 2]).unwrap().output.positions,
            mean.positions
        );
    }

    #[test]
    fn modes_are_counted_from_one_and_sampled_about_the_mean() {
        let found = found("vertices");
        assert_eq!(found.modes(), 2);
        let line = found.along(1, &Task::default()).unwrap().output.output;
        let mean = found.mean().unwrap().output.output;
        assert_eq!(line.frames(), SAMPLES);
        let apart = line.frame(4).iter().zip(&mean.positions);
        assert!(apart.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max) == 0.0);
        assert!(found.sample(0, 1.0).is_err() && found.sample(3, 1.0).is_err());
    }

    #[test]
    fn an_unknown_space_is_told_with_the_others() {
        let request = StatisticsRequest {
            space: "angles".into(),
            ..StatisticsRequest::default()
        };
        let error = statistics(&cactus(), &request, &Task::default())
            .err()
            .unwrap();
        assert!(error.hints[0].contains("vertices") && error.hints[0].contains(EDGE_LENGTHS));
        let one = cactus().slice(0..1);
        assert!(statistics(&one, &StatisticsRequest::default(), &Task::default()).is_err());
    }

    #[test]
    fn a_difference_leads_from_one_pose_to_the_other() {
        let all = cactus();
        let frames = [0, 0, 2]
            .iter()
            .flat_map(|&frame| all.frame(frame).to_vec());
        let three = Sequence::new(Arc::clone(all.topology()), frames.collect(), None);
        let moved = add_difference(&three, "gradients").unwrap().output;
        let (from, to) = (doubles(all.frame(2)), doubles(&moved.positions));
        // f32 positions of a cactus about a metre high
        assert!(crate::statistics::aligned_rms(&from, &to) < 1e-5);
        assert!(add_difference(&all.slice(0..2), "gradients").is_err());
    }
}
