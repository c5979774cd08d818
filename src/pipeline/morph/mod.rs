//! Morphs: poses of one mesh to the frames between them, by any of the methods. To add a method: a file
//! beside this one and a line in [`MorphMethod`].

mod conformal;
mod edge_lengths;
mod edges;
mod isometric;
mod path;
mod skeleton;
mod spline;

use std::str::FromStr;
use std::sync::Arc;

use serde::Serialize;

use crate::diag::{Diagnostic, Result, Warned};
use crate::inbetween::edge_lengths::{Blend, Embedding};
use crate::mesh::{FrameSource, Sequence};
use crate::space::SpaceError;
use crate::task::Task;

pub use conformal::ConformalReport;
pub use edge_lengths::{EmbeddingReport, ImpossibleVertex, JumpReport, MissedEdge};
pub use edges::{EdgeReport, Strain};
pub use path::MorphPath;
pub use skeleton::{
    SkeletonMorphed, is_skeleton, morph_skeletons, open_skeletons, plan_skeletons, save_skeletons,
};

/// How shapes between poses are found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum MorphMethod {
    /// Lengths linear, triangles turned as their neighbours are: see [`crate::inbetween::isometric`].
    #[default]
    Isometric,
    /// One cubic spline through all poses in a shape space: see [`crate::inbetween::complete()`].
    Spline,
    /// Lengths linear and met exactly where a shape has them: see [`crate::inbetween::edge_lengths`].
    EdgeLengths,
    /// One factor a vertex scales the edges at it, between conformally equivalent poses or from one closed
    /// mesh to the sphere: see [`crate::inbetween::conformal`].
    Conformal,
}

impl MorphMethod {
    /// All of them.
    pub const ALL: &[MorphMethod] = &[
        MorphMethod::Isometric,
        MorphMethod::Spline,
        MorphMethod::EdgeLengths,
        MorphMethod::Conformal,
    ];

    /// Its name on the command line and in recipes.
    pub fn name(self) -> &'static str {
        match self {
            MorphMethod::Isometric => "isometric",
            MorphMethod::Spline => "spline",
            MorphMethod::EdgeLengths => "edge-lengths",
            MorphMethod::Conformal => "conformal",
        }
    }
}

impl FromStr for MorphMethod {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        let found = Self::ALL.iter().find(|method| method.name() == name);
        found.copied().ok_or_else(|| {
            let names: Vec<_> = Self::ALL.iter().map(|method| method.name()).collect();
            format!("no method `{name}`; there are {}", names.join(", "))
        })
    }
}

/// What is asked of a morph.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct MorphRequest {
    /// The method.
    pub method: MorphMethod,
    /// How many frames, both ends among them, at least 2; if not given, 24 from each pose to the
    /// next.
    pub frames: Option<usize>,
    /// The shape space's name; for the method `spline`, patch-lri if not given.
    pub space: Option<String>,
    /// Where the frames lie among the poses; if not given, from each pose to the next. For the method
    /// `edge-lengths`, as the two below; `every` and this also for `conformal`.
    pub path: Option<MorphPath>,
    /// Squares of lengths are blended instead of lengths.
    pub squared: bool,
    /// Every so many frames one is embedded, lengths and angles are blended between; all if not given.
    pub every: Option<usize>,
}

/// Frames from one pose to the next where their number is not given: a second of film.
const BETWEEN: usize = 24;

/// Frames of a morph and how good they are.
#[derive(Debug, Clone)]
pub struct Morph {
    /// The frames; those at poses are the poses.
    pub frames: Sequence,
    /// What was measured.
    pub report: MorphReport,
}

/// What was measured of a morph, as the command line's JSON has it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MorphReport {
    /// The method's name.
    pub method: &'static str,
    /// How many poses there were.
    pub poses: usize,
    /// How far edges are from the straight path between their lengths.
    pub edges: EdgeReport,
    /// How far the poses are from isometric: the largest of each pair of neighbours.
    pub strain: Strain,
    /// What taking off the rigid motion changes; for the method `isometric`, of meshes and of skeletons.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub alignment: Option<AlignmentReport>,
    /// How the poses are equivalent; for the method `conformal`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub conformal: Option<ConformalReport>,
    /// How lengths were embedded; for the methods `edge-lengths` and `conformal`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub embedding: Option<EmbeddingReport>,
}

/// What taking off the rigid motion between two poses before they are compared changes half way between
/// them; of the pair of neighbours that turns most.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct AlignmentReport {
    /// By how much the whole turns, in degrees.
    pub turn_degrees: f64,
    /// With the alignment.
    pub with: AlignmentEffect,
    /// Without.
    pub without: AlignmentEffect,
}

/// Half way between two poses.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct AlignmentEffect {
    /// Mean error of an edge length in percent.
    pub edge_mean_percent: f64,
    /// Largest error of an edge length in percent.
    pub edge_worst_percent: f64,
    /// Mean angle between a triangle's normal and the great circle between its normals in the poses.
    pub normal_mean_degrees: f64,
    /// The largest such angle.
    pub normal_worst_degrees: f64,
    /// Of a skeleton, mean error of the angle between a bone and its parent's, against the mean of both
    /// poses: a skeleton that only turns keeps its angles where that turn was taken off.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub joint_mean_degrees: Option<f64>,
    /// The largest such error.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub joint_worst_degrees: Option<f64>,
}

impl AlignmentReport {
    /// Of two pairs the one that turns more.
    fn or_more(self, known: Option<Self>) -> Self {
        match known {
            Some(known) if known.turn_degrees >= self.turn_degrees => known,
            _ => self,
        }
    }
}

/// Where in a morph a frame is.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Moment {
    /// The pose before it, from 0.
    pose: usize,
    /// How far to the next pose, in \[0, 1).
    t: f64,
}

/// How many frames [`morph`] gives. One pose alone is enough for the method `conformal`: the sphere is the
/// other.
///
/// # Errors
/// Fewer than two poses or frames.
pub fn morph_frames(poses: &Sequence, request: &MorphRequest) -> Result<usize> {
    match (request.method, poses.frames()) {
        (MorphMethod::Conformal, 1) => wanted_frames(2, request),
        (_, count) => wanted_frames(count, request),
    }
}

fn wanted_frames(count: usize, request: &MorphRequest) -> Result<usize> {
    if count < 2 {
        return Diagnostic::error(format!("a morph needs two poses, here is {count}"))
            .hint("name several meshes, or a folder or file that holds several frames")
            .err();
    }
    match request.frames.unwrap_or(BETWEEN * (count - 1) + 1) {
        frames @ 2.. => Ok(frames),
        frames => Diagnostic::error(format!("a morph has at least 2 frames, asked are {frames}"))
            .hint("two are the poses at both ends alone")
            .err(),
    }
}

/// Frames between poses. Poses follow each other in the order of the sequence, the same number of
/// frames from each to the next.
///
/// # Errors
/// As [`morph_frames`]; a mesh that the method does not suit, cancellation.
pub fn morph(poses: &Sequence, request: &MorphRequest, task: &Task) -> Result<Warned<Morph>> {
    let frames = morph_frames(poses, request)?;
    if request.method != MorphMethod::Spline {
        no_space(request)?;
    }
    only_by_lengths(request)?;
    let moments = || moments(frames, poses.frames());
    let mut morph = match request.method {
        MorphMethod::Isometric => {
            isometric::morph(poses, &moments(), task)?.measured(poses, &moments(), request.method)
        }
        MorphMethod::Spline => spline::morph(poses, &moments(), request, task)?.measured(
            poses,
            &moments(),
            request.method,
        ),
        MorphMethod::EdgeLengths => {
            let blend = match request.squared {
                false => Blend::Lengths,
                true => Blend::Squares,
            };
            let embedding = Embedding::new(poses.topology()).map_err(SpaceError::from)?;
            let shapes = (0..poses.frames()).map(|pose| doubles(poses, pose));
            let shapes: Vec<Vec<f64>> = shapes.collect();
            edge_lengths::morph(poses, (&embedding, &shapes), request, blend, task)?
        }
        // its lengths are to change
        MorphMethod::Conformal => return conformal::morph(poses, request, task),
    };
    morph
        .warnings
        .extend(edges::strain_warning(&morph.output.report.strain));
    Ok(morph)
}

/// What a method finds: the coordinates of all frames in a row, those at poses being the poses.
struct Found {
    positions: Vec<f32>,
    alignment: Option<AlignmentReport>,
}

impl Warned<Found> {
    /// With what edges do from pose to pose.
    fn measured(self, poses: &Sequence, moments: &[Moment], method: MorphMethod) -> Warned<Morph> {
        let Warned {
            output: Found {
                positions,
                alignment,
            },
            warnings,
        } = self;
        let frames = Sequence::new(Arc::clone(poses.topology()), positions, poses.fps());
        let (edges, strain) = edges::measured(poses, &frames, moments);
        let report = MorphReport {
            method: method.name(),
            poses: poses.frames(),
            edges,
            strain,
            alignment,
            conformal: None,
            embedding: None,
        };
        Warned {
            output: Morph { frames, report },
            warnings,
        }
    }
}

/// Refuses a space where the method has none.
fn no_space(request: &MorphRequest) -> Result<()> {
    match &request.space {
        None => Ok(()),
        Some(_) => Diagnostic::error(format!(
            "the method {} works without a shape space",
            request.method.name()
        ))
        .hint("leave the space out, or take the method spline")
        .err(),
    }
}

/// Refuses options that the method does not know.
fn only_by_lengths(request: &MorphRequest) -> Result<()> {
    let embeds = matches!(
        request.method,
        MorphMethod::EdgeLengths | MorphMethod::Conformal
    );
    let given = [
        ("path", request.path.is_some() && !embeds),
        (
            "squared",
            request.squared && request.method != MorphMethod::EdgeLengths,
        ),
        ("every", request.every.is_some() && !embeds),
    ];
    match given.iter().find(|(_, given)| *given) {
        None => Ok(()),
        Some((name, _)) => Diagnostic::error(format!(
            "`{name}` is for the method edge-lengths, not for {}",
            request.method.name()
        ))
        .hint(
            "say `--method edge-lengths` (in a recipe `method: \"edge-lengths\"`), or leave it out",
        )
        .err(),
    }
}

/// Where `frames` frames lie among `poses` poses, at least two of both; exact at poses.
fn moments(frames: usize, poses: usize) -> Vec<Moment> {
    let last = frames - 1;
    let along = (0..frames).map(|frame| frame * (poses - 1));
    let moment = |along: usize| Moment {
        pose: along / last,
        t: (along % last) as f64 / last as f64,
    };
    along.map(moment).collect()
}

/// The 3V coordinates of a pose.
fn doubles(poses: &Sequence, pose: usize) -> Vec<f64> {
    poses.frame(pose).iter().map(|&x| f64::from(x)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Topology;

    /// A roof of two triangles, opened by `angle` at its ridge of length 2.
    fn roofs(angles: &[f64]) -> Sequence {
        let topology = Topology::from_triangles(4, &[[0, 1, 2], [1, 0, 3]]).unwrap();
        let positions = angles.iter().flat_map(|&angle| {
            let (sine, cosine) = libm::sincos(angle);
            [
                [0.0, 0.0, 0.0],
                [2.0, 0.0, 0.0],
                [1.0, cosine, sine],
                [1.0, -cosine, sine],
            ]
            .into_iter()
            .flatten()
            .map(|x| x as f32)
            .collect::<Vec<_>>()
        });
        Sequence::new(Arc::new(topology), positions.collect(), None)
    }

    #[test]
    fn frames_at_poses_are_the_poses_and_others_keep_their_lengths() {
        let poses = roofs(&[0.0, 0.8, -0.3]);
        let request = MorphRequest {
            frames: Some(9),
            ..MorphRequest::default()
        };
        let found = morph(&poses, &request, &Task::default()).unwrap().output;
        assert_eq!(found.frames.frames(), 9);
        for (frame, pose) in [(0, 0), (4, 1), (8, 2)] {
            assert_eq!(found.frames.frame(frame), poses.frame(pose));
        }
        // isometric poses up to their rounding to f32, and a polygon
        assert!(
            found.report.edges.worst_percent < 1e-4,
            "{:?}",
            found.report
        );
        assert!(found.report.strain.worst_percent < 1e-4);
    }

    #[test]
    fn the_default_is_a_second_of_film_from_pose_to_pose() {
        let found = morph(
            &roofs(&[0.0, 0.5, 1.0]),
            &MorphRequest::default(),
            &Task::default(),
        );
        assert_eq!(found.unwrap().output.frames.frames(), 49);
    }

    #[test]
    fn a_spline_goes_through_the_poses_in_any_space() {
        let poses = roofs(&[0.0, 0.8, -0.3]);
        for space in [None, Some("gradients"), Some("vertices")] {
            let request = MorphRequest {
                method: MorphMethod::Spline,
                frames: Some(9),
                space: space.map(String::from),
                ..MorphRequest::default()
            };
            let found = morph(&poses, &request, &Task::default()).unwrap().output;
            for (frame, pose) in [(0, 0), (4, 1), (8, 2)] {
                assert_eq!(found.frames.frame(frame), poses.frame(pose), "{space:?}");
            }
            assert!(found.frames.positions().iter().all(|x| x.is_finite()));
        }
        let request = MorphRequest {
            space: Some("gradients".into()),
            ..MorphRequest::default()
        };
        assert!(morph(&poses, &request, &Task::default()).is_err());
    }

    #[test]
    fn too_few_poses_or_frames_are_told() {
        let one = morph(&roofs(&[0.0]), &MorphRequest::default(), &Task::default());
        assert!(one.unwrap_err().message.contains("needs two poses"));
        let request = MorphRequest {
            frames: Some(1),
            ..MorphRequest::default()
        };
        assert!(morph(&roofs(&[0.0, 1.0]), &request, &Task::default()).is_err());
        assert_eq!("isometric".parse(), Ok(MorphMethod::Isometric));
        assert!(
            "x".parse::<MorphMethod>()
                .unwrap_err()
                .contains("isometric")
        );
    }

    #[test]
    fn poses_that_stretch_are_told_with_their_strain() {
        let mut positions = roofs(&[0.2]).positions().to_vec();
        positions.extend(roofs(&[0.2]).positions().iter().map(|x| 2.0 * x));
        let poses = Sequence::new(roofs(&[0.0]).topology().clone(), positions, None);
        let found = morph(&poses, &MorphRequest::default(), &Task::default()).unwrap();
        // doubled: 1 against a mean of 1.5
        assert!((found.output.report.strain.mean_percent - 100.0 / 1.5).abs() < 1e-3);
        assert!(found.warnings[0].message.contains("not near-isometric"));
    }
}
