//! `meshloom fit INPUT.. -o F.loom`: a capture becomes a loom.

use std::path::PathBuf;

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use serde_json::{Value, json};

use super::args::{Input, positive};
use super::report::{astray, count, number, percent, table};
use super::session::{Outcome, Session};
use crate::diag::Result;
use crate::loom::Loom;
use crate::loom::fit::{FitOptions, Method, fit};
use crate::loom::pins::{Pin, PinPlace};
use crate::loom::report::FitReport;
use crate::mesh::Sequence;
use crate::pipeline::{self, Output};
use crate::signal::root::RootKind;
use crate::space::SPACES;

/// The phases whose times are reported.
pub(super) const PHASES: [&str; 6] = ["load", "encode", "shape", "layout", "pose", "time"];

/// Fit a loom to a capture
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    #[command(flatten)]
    input: Input,

    /// The loom to write
    #[arg(long, short, value_name = "F.loom")]
    output: PathBuf,

    #[command(flatten)]
    how: How,
}

/// How to fit. Of k, l and m what is not given follows from the tolerance.
#[derive(Debug, Clone, clap::Args)]
#[command(next_help_heading = "Fit")]
struct How {
    /// How the motion is found between frames
    #[arg(long, value_parser = methods(), default_value = Method::default().name())]
    method: Method,

    /// The shape space
    #[arg(long, value_parser = spaces(), default_value = "vertices")]
    space: String,

    /// Control points of the time signal, 4 to n+2 for n frames
    #[arg(long, short = 'k', value_name = "K")]
    controls: Option<usize>,

    /// Sites of the pose signal, 3 to n
    #[arg(long, short = 'l', value_name = "L")]
    sites: Option<usize>,

    /// Modes of the shape signal, 0 to n-1
    #[arg(long, short = 'm', value_name = "M")]
    modes: Option<usize>,

    /// Relative total error, for what of k, l and m is not given
    #[arg(long, value_name = "T", value_parser = positive, default_value_t = 0.01)]
    tolerance: f64,

    /// Hold a frame in the map, at X,Y in layout units or X%,Y% of the layout's box; may be repeated
    #[arg(long = "pin", value_name = "FRAME=X,Y", value_parser = pin)]
    pins: Vec<Pin>,

    /// A loom fitted earlier, to nearly the same frames: its choice of a map is kept while it suits
    #[arg(long, value_name = "F.loom")]
    near: Option<PathBuf>,

    /// Exponent of the time signal's parametrisation, from 0 (uniform) to 1 (by distance)
    #[arg(long, value_name = "A", default_value_t = 0.5)]
    alpha: f64,

    /// Root motion to keep as a signal of its own, so that a walk can loop
    #[arg(long, value_parser = roots(), default_value = "none")]
    root: Root,

    /// Frames per second, where the files do not say
    #[arg(long, value_name = "F", value_parser = positive)]
    fps: Option<f64>,
}

/// Root motion to split off, if any.
type Root = std::option::Option<RootKind>;

pub(super) fn run(args: &Args, session: &Session) -> Result<Outcome> {
    let capture = session.open(&args.input.part.of(&args.input.inputs, args.how.fps))?;
    let output = Output::from(&args.output).protecting(&capture.origin.files);
    pipeline::check_loom_output(session.world(), &output)?;
    let sequence = capture.content.sequence(&session.task)?;
    let mut options = args.how.options();
    options.near = match &args.how.near {
        Some(path) => choice(session.open_loom(path)?.report()),
        None => None,
    };
    let loom = fitted(session, &sequence, &options)?;
    pipeline::save_loom(session.world(), &loom, &output, &session.task)?;
    Ok(Outcome {
        object: report(session, loom.report()),
        report: summary(session, &args.output.display().to_string(), loom.report()),
        ..Outcome::default()
    })
}

/// (tau, theta) of an ordered fit.
fn choice(report: &FitReport) -> Option<(f64, f64)> {
    report.ordered.map(|ordered| (ordered.tau, ordered.theta))
}

/// Fits and keeps the warnings.
pub(super) fn fitted(session: &Session, sequence: &Sequence, options: &FitOptions) -> Result<Loom> {
    Ok(session.keep(fit(sequence, options, &session.task)?))
}

impl How {
    fn options(&self) -> FitOptions {
        FitOptions {
            space: self.space.clone(),
            method: self.method,
            controls: self.controls,
            sites: self.sites,
            modes: self.modes,
            tolerance: self.tolerance,
            pins: self.pins.clone(),
            alpha: self.alpha,
            root: self.root,
            fps: self.fps,
            ..FitOptions::default()
        }
    }
}

/// The report as data, with the time each phase took. The session adds the warnings.
pub(super) fn report(session: &Session, report: &FitReport) -> Value {
    let mut object = json!(report);
    object["seconds"] = session.progress.seconds(&PHASES);
    object["warnings"] = json!([]);
    object
}

/// The report for people.
pub(super) fn summary(session: &Session, title: &str, report: &FitReport) -> String {
    let share = |share: f64| format!("{:.0} % of the frames", 100.0 * share);
    let of = |error: f64| percent(100.0 * error);
    let error = &report.error;
    let seconds = session.progress.seconds(&PHASES);
    let mut rows = vec![
        (
            "capture",
            format!(
                "{}, {}, {}",
                count(report.frames, "frame"),
                format_args!("{} vertices", report.vertices),
                count(report.faces, "face")
            ),
        ),
        (
            "space",
            format!("{}, dimension {}", report.space, report.dimension),
        ),
        (
            "control points",
            format!("k = {:<5}{}", report.controls, share(report.share.controls)),
        ),
        (
            "sites",
            format!("l = {:<5}{}", report.sites, share(report.share.sites)),
        ),
        (
            "modes",
            format!("m = {:<5}{}", report.modes, share(report.share.modes)),
        ),
        (
            "error",
            format!(
                "{} of the motion (shape {}, pose {}, time {})",
                of(error.total),
                of(error.shape),
                of(error.pose),
                of(error.time)
            ),
        ),
    ];
    if let Some(positions) = error.positions.filter(|_| report.space != "vertices") {
        rows.push((
            "in positions",
            format!("{} of the motion of the vertices", of(positions)),
        ));
    }
    if let Some(left_out) = &report.left_out {
        rows.push((
            "between frames",
            format!(
                "{} (linear blending {}, cubic splines {})",
                of(left_out.psi),
                of(left_out.linear),
                of(left_out.cubic)
            ),
        ));
    }
    rows.extend(astray(&report.spans));
    let layout = &report.layout;
    rows.push((
        "layout",
        format!(
            "stress {}, {}",
            number(report.stress),
            count(layout.steps, "step")
        ),
    ));
    rows.push((
        "took",
        format!("{} s", number(seconds["total"].as_f64().unwrap_or(0.0))),
    ));
    table(session.style, title, &rows)
}

fn methods() -> impl TypedValueParser<Value = Method> {
    let method = |name: &str| {
        Method::ALL
            .iter()
            .copied()
            .find(|method| method.name() == name)
    };
    let names = Method::ALL
        .iter()
        .map(|method| PossibleValue::new(method.name()));
    PossibleValuesParser::new(names).map(move |name| method(&name).unwrap_or_default())
}

pub(super) fn spaces() -> impl TypedValueParser<Value = String> {
    PossibleValuesParser::new(SPACES.iter().map(|space| PossibleValue::new(space.name)))
}

fn roots() -> impl TypedValueParser<Value = Root> {
    PossibleValuesParser::new(["none", "ground", "rigid"]).map(|name| match name.as_str() {
        "ground" => Some(RootKind::Ground),
        "rigid" => Some(RootKind::Rigid),
        _ => None,
    })
}

/// `FRAME=X,Y` or `FRAME=X%,Y%`.
fn pin(text: &str) -> Result<Pin, String> {
    let wanted = "a pin is FRAME=X,Y or FRAME=X%,Y%";
    let (frame, place) = text.split_once('=').ok_or(wanted)?;
    let (x, y) = place.split_once(',').ok_or(wanted)?;
    let frame = frame
        .trim()
        .parse()
        .map_err(|_| format!("`{frame}` is not a frame number"))?;
    let number = |text: &str| match text.trim().parse::<f64>() {
        Ok(number) if number.is_finite() => Ok(number),
        _ => Err(format!("`{text}` is not a number")),
    };
    let at = match (x.trim().strip_suffix('%'), y.trim().strip_suffix('%')) {
        (Some(x), Some(y)) => PinPlace::Box([number(x)? / 100.0, number(y)? / 100.0]),
        (None, None) => PinPlace::Layout([number(x)?, number(y)?]),
        _ => return Err("both places are percentages, or none".to_string()),
    };
    Ok(Pin { frame, at })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pins_are_in_layout_units_or_parts_of_the_box() {
        let read = |text| pin(text).map(|pin| (pin.frame, pin.at));
        assert_eq!(read("3=-1.5,2"), Ok((3, PinPlace::Layout([-1.5, 2.0]))));
        assert_eq!(read("12=50%, 20%"), Ok((12, PinPlace::Box([0.5, 0.2]))));
        for wrong in ["3", "3=1", "x=1,2", "3=1,y", "3=50%,2", "3=nan,1", "-1=0,0"] {
            assert!(read(wrong).is_err(), "{wrong}");
        }
    }
}
