//! `meshloom morph POSE POSE.. -o OUT`: the frames between poses of a mesh or a skeleton.

use std::path::PathBuf;

use serde_json::json;

use super::args::Part;
use super::report;
use super::session::{Outcome, Session};
use crate::diag::Result;
use crate::pipeline::{
    self, AlignmentReport, ConformalReport, EmbeddingReport, MorphMethod, MorphPath, MorphReport,
    MorphRequest, Output, Saved,
};

/// Write the frames between poses of a mesh or a skeleton
///
/// Poses follow each other in the order given; the frames at them are the poses themselves. isometric:
/// edge lengths go linearly from one pose to the next and triangles turn as their neighbours do; exact
/// for meshes without inner vertices. edge-lengths: edge lengths go linearly and are met, as near as a
/// shape can; --path leads through the space of three, four or more poses. conformal: one factor a vertex
/// scales the edges at it, between conformally equivalent poses, or from one closed mesh to the sphere. Of
/// skeletons (.bvh, and .json lists of joints) bones go linearly in length and straight in direction.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Meshes with the same faces, in order: files, a folder, a pattern, or one file with many frames; or
    /// files of skeletons (.bvh, .json)
    #[arg(value_name = "POSE", required = true)]
    poses: Vec<PathBuf>,

    #[command(flatten)]
    part: Part,

    /// One file, or a folder or pattern (frame_####.obj) for a file a frame; a .bvh or .json for skeletons
    #[arg(long, short, value_name = "OUT")]
    output: PathBuf,

    /// How shapes between the poses are found: isometric, spline (one curve through all poses in a shape
    /// space), edge-lengths, conformal
    #[arg(long, value_name = "METHOD", default_value = MorphMethod::default().name())]
    method: MorphMethod,

    /// The shape space of a spline [default: patch-lri]
    #[arg(long, value_name = "S")]
    space: Option<String>,

    /// This many frames, evenly over the whole, both ends among them [default: 24 from each pose to the
    /// next]
    #[arg(long, value_name = "N")]
    frames: Option<usize>,

    /// Where the frames lie among the poses: `circle` between four poses at the corners of a square, or a
    /// smooth curve through points: `0,0 0.5,1 1,1` in that square, else one weight a pose
    /// [edge-lengths, conformal]
    #[arg(long, value_name = "PATH")]
    path: Option<MorphPath>,

    /// Blend the squares of lengths: right for shapes stretched in one direction [edge-lengths]
    #[arg(long)]
    squared: bool,

    /// Embed every Nth frame only, blend lengths and angles between [edge-lengths, conformal]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    every: Option<u32>,

    /// Say which files would be written and removed, and end
    #[arg(long)]
    plan: bool,
}

pub(super) fn run(args: &Args, session: &Session) -> Result<Outcome> {
    if args.poses.iter().any(|pose| pipeline::is_skeleton(pose)) {
        return skeletons(args, session);
    }
    let (world, task) = (session.world(), &session.task);
    let capture = session.open(&args.part.of(&args.poses, None))?;
    let output = Output::from(&args.output).protecting(&capture.origin.files);
    let poses = capture.content.sequence(task)?;
    let request = args.request();
    if args.plan {
        let frames = pipeline::morph_frames(&poses, &request)?;
        let plan = pipeline::plan(world, &output, frames)?;
        return Ok(Outcome {
            report: report::plan(session.style, &plan),
            object: json!(plan),
            ..Outcome::default()
        });
    }
    let morph = session.keep(pipeline::morph(&poses, &request, task)?);
    let saved = pipeline::save(world, &morph.frames, &output, task)?;
    Ok(done(session, &saved, &morph.report))
}

/// The same for skeletons.
fn skeletons(args: &Args, session: &Session) -> Result<Outcome> {
    let (world, task) = (session.world(), &session.task);
    let poses = pipeline::open_skeletons(world, &args.poses, args.part.range, task)?;
    let output = Output::from(&args.output).protecting(&args.poses);
    if args.plan {
        let writes = pipeline::plan_skeletons(world, &output)?;
        return Ok(Outcome {
            report: report::table(session.style, "plan", &[("writes", report::files(&writes))]),
            object: json!({ "writes": report::paths(&writes), "removals": [] }),
            ..Outcome::default()
        });
    }
    let morph = session.keep(pipeline::morph_skeletons(&poses, &args.request(), task)?);
    let saved = pipeline::save_skeletons(world, &morph.frames, &output, task)?;
    Ok(done(session, &saved, &morph.report))
}

impl Args {
    fn request(&self) -> MorphRequest {
        MorphRequest {
            method: self.method,
            frames: self.frames,
            space: self.space.clone(),
            path: self.path.clone(),
            squared: self.squared,
            every: self.every.map(|every| every as usize),
        }
    }
}

fn done(session: &Session, saved: &Saved, found: &MorphReport) -> Outcome {
    Outcome {
        object: json!({
            "outputs": report::paths(&saved.outputs),
            "frames": saved.frames,
            "report": found,
            "seconds": session.progress.seconds(&["load", "morph", "write"]),
            "warnings": [],
        }),
        report: format!(
            "{}{}",
            report::saved(session.style, saved),
            told(session, found)
        ),
        ..Outcome::default()
    }
}

/// The report for people.
fn told(session: &Session, found: &MorphReport) -> String {
    let pair = |mean: f64, worst: f64| {
        format!(
            "{} on average, {} at most",
            report::percent(mean),
            report::percent(worst)
        )
    };
    let mut rows = vec![
        (
            "edge length error",
            pair(found.edges.mean_percent, found.edges.worst_percent),
        ),
        (
            "strain of the poses",
            pair(found.strain.mean_percent, found.strain.worst_percent),
        ),
    ];
    rows.extend(found.alignment.iter().flat_map(alignment_rows));
    rows.extend(found.conformal.iter().map(conformal_row));
    rows.extend(found.embedding.iter().flat_map(embedding_rows));
    report::table(session.style, found.method, &rows)
}

type Row = (&'static str, String);

/// What taking off the rigid motion did: to the angles at joints of a skeleton, to normals and edges of a
/// mesh.
fn alignment_rows(alignment: &AlignmentReport) -> Vec<Row> {
    let degrees = |value: f64| format!("{} degrees", report::number(value));
    let (with, without) = (alignment.with, alignment.without);
    let mut rows = vec![("rigid turn taken off", degrees(alignment.turn_degrees))];
    match (with.joint_mean_degrees, without.joint_mean_degrees) {
        (Some(with), Some(without)) => rows.push((
            "angles at joints",
            format!(
                "half way {} off on average, {} without that",
                degrees(with),
                degrees(without)
            ),
        )),
        _ => rows.extend([
            (
                "normals from slerp",
                format!(
                    "{} on average, {} without that",
                    degrees(with.normal_mean_degrees),
                    degrees(without.normal_mean_degrees),
                ),
            ),
            (
                "edges half way",
                format!(
                    "{} on average, {} without that",
                    report::percent(with.edge_mean_percent),
                    report::percent(without.edge_mean_percent),
                ),
            ),
        ]),
    }
    rows
}

fn conformal_row(conformal: &ConformalReport) -> Row {
    let [least, most] = conformal.factors.map(report::number);
    let place = if conformal.sphere {
        " to the sphere"
    } else {
        ""
    };
    let off = report::percent(conformal.residual_percent);
    let told = format!("{least} to {most}{place}, lengths explained to {off}");
    ("conformal factors", told)
}

fn embedding_rows(embedding: &EmbeddingReport) -> [Row; 2] {
    let [half, _, most, _] = embedding.percentiles;
    [
        (
            "edges within 1 %",
            format!(
                "{} in the worst frame (half within {}, 98 % within {})",
                report::percent(embedding.within_percent),
                report::percent(half),
                report::percent(most)
            ),
        ),
        (
            "closed walks",
            format!(
                "{}, residual at most {:.2e} (frame {})",
                embedding.walks, embedding.residual, embedding.residual_frame
            ),
        ),
    ]
}
