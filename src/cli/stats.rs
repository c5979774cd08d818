//! `meshloom stats POSE..`: mean and principal components of poses.

use std::path::{Path, PathBuf};

use serde_json::json;

use super::args::Part;
use super::report;
use super::session::{Outcome, Session};
use crate::diag::Result;
use crate::pipeline::{
    self, Output, ReturnedReport, Statistics, StatisticsReport, StatisticsRequest,
};
use crate::plot::Theme;

/// Mean and principal components of poses of a mesh
///
/// Poses are aligned rigidly first. In the space edge-lengths (Rojas et al. 2014) shapes differ as the
/// lengths of their edges do; sums of lengths become shapes again by embedding them, or, where that finds
/// none, by triangles laid out as they fit: the report says which.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Meshes with the same faces: files, a folder, a pattern, or one file with many frames
    #[arg(value_name = "POSE", required = true)]
    poses: Vec<PathBuf>,

    #[command(flatten)]
    part: Part,

    /// What shapes are measured in: vertices, gradients, lri, patch-lri, lengths-angles or edge-lengths
    #[arg(long, value_name = "S", default_value = "gradients")]
    space: String,

    /// Size is no difference: poses are scaled to the same sum of edge lengths
    #[arg(long)]
    scale_free: bool,

    /// Write the mean shape to this file
    #[arg(long, value_name = "F")]
    mean: Option<PathBuf>,

    /// Write nine shapes from -2 to 2 standard deviations along each of the first three modes, to folders
    /// mode_1, mode_2, mode_3 in DIR
    #[arg(long, value_name = "DIR")]
    modes: Option<PathBuf>,

    /// Draw the poses by their first two modes, and the shares of all modes: .png or .svg
    #[arg(long, value_name = "P")]
    plot: Option<PathBuf>,
}

/// Modes that are written.
const WRITTEN: usize = 3;

pub(super) fn run(args: &Args, session: &Session) -> Result<Outcome> {
    let task = &session.task;
    let capture = session.open(&args.part.of(&args.poses, None))?;
    let poses = capture.content.sequence(task)?;
    let files = &capture.origin.files;
    let request = StatisticsRequest {
        space: args.space.clone(),
        scale_free: args.scale_free,
    };
    let found = pipeline::statistics(&poses, &request, task)?;
    let (outputs, returned) = args.write(&found, files, session)?;
    let report = found.report();
    let mut object = json!(report);
    if !returned.is_empty() {
        object["returned"] = json!(returned);
    }
    object["outputs"] = json!(report::paths(&outputs));
    object["seconds"] = session.progress.seconds(&["load", "statistics", "write"]);
    object["warnings"] = json!([]);
    Ok(Outcome {
        object,
        report: told(session, &report, &returned, &outputs),
        ..Outcome::default()
    })
}

impl Args {
    /// Writes what was asked for.
    fn write(
        &self,
        found: &Statistics,
        files: &[PathBuf],
        session: &Session,
    ) -> Result<(Vec<PathBuf>, Vec<ReturnedReport>)> {
        let (world, task) = (session.world(), &session.task);
        let output = |path: &Path| Output::from(path).protecting(files);
        let (mut outputs, mut returned) = (Vec::new(), Vec::new());
        if let Some(path) = &self.mean {
            let mean = session.keep(found.mean()?);
            returned.extend(mean.returned);
            let mean = mean.output.sequence();
            outputs.extend(pipeline::save(world, &mean, &output(path), task)?.outputs);
        }
        for mode in 1..=found.modes().min(WRITTEN) {
            let Some(folder) = &self.modes else {
                break;
            };
            let shapes = session.keep(found.along(mode, task)?);
            returned.extend(shapes.returned);
            let path = folder.join(format!("mode_{mode}")).join("frame_##.obj");
            outputs.extend(pipeline::save(world, &shapes.output, &output(&path), task)?.outputs);
        }
        if let Some(path) = &self.plot {
            let names = pipeline::pose_names(files, found.report().poses);
            let scene = found.figure(&names, &Theme::light());
            let saved = pipeline::save_picture(world, &scene, &output(path), 2.0)?;
            outputs.extend(saved.outputs);
        }
        Ok((outputs, returned))
    }
}

fn told(
    session: &Session,
    found: &StatisticsReport,
    returned: &[ReturnedReport],
    outputs: &[PathBuf],
) -> String {
    let shares = found.explained.iter().take(8);
    let shares: Vec<String> = shares.map(|share| report::percent(100.0 * share)).collect();
    let mut rows = vec![
        ("space", found.space.clone()),
        ("coordinates of a shape", found.dimension.to_string()),
        ("variance by mode", shares.join("  ")),
    ];
    if let Some(worst) = returned
        .iter()
        .max_by(|a, b| a.edge_rms_percent.total_cmp(&b.edge_rms_percent))
    {
        let by = |name| returned.iter().filter(|one| one.by == name).count();
        rows.push((
            "shapes from lengths",
            format!(
                "{} embedded, {} laid out; edges off by {} at most (root mean square)",
                by("embedding"),
                by("layout"),
                report::percent(worst.edge_rms_percent)
            ),
        ));
    }
    if !outputs.is_empty() {
        rows.push(("written", report::files(outputs)));
    }
    let title = report::count(found.poses, "pose");
    report::table(session.style, &title, &rows)
}
