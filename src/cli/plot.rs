//! `meshloom plot F.loom -o P.png|P.svg`: the map and the time signals of a loom.

use std::path::PathBuf;

use serde_json::json;

use super::report;
use super::session::{Outcome, Session};
use crate::diag::Result;
use crate::pipeline::plot::{caption, figure, plot_loom};
use crate::pipeline::{Output, save_picture};
use crate::plot::Theme;

/// Pixels of a PNG to a unit of the figure: text stays readable on dense screens and in print.
const SCALE: f32 = 2.0;

/// Draw the map of a loom's poses and its time signals
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// The loom
    #[arg(value_name = "F.loom")]
    loom: PathBuf,

    /// The picture
    #[arg(long, short, value_name = "P.png|P.svg")]
    output: PathBuf,

    /// The ground it is drawn on
    #[arg(long, value_enum, default_value_t = Ground::Light)]
    theme: Ground,

    /// Width and height in units of text (a PNG has twice as many pixels)
    #[arg(long, value_name = "WxH", value_parser = size, default_value = "1200x560")]
    size: [f32; 2],
}

#[derive(Debug, Clone, Copy, clap::ValueEnum)]
enum Ground {
    Light,
    Dark,
}

pub(super) fn run(args: &Args, session: &Session) -> Result<Outcome> {
    let loom = session.open_loom(&args.loom)?;
    let theme = match args.theme {
        Ground::Light => Theme::light(),
        Ground::Dark => Theme::dark(),
    };
    let output = Output::from(&args.output).protecting(std::slice::from_ref(&args.loom));
    let name = args.loom.file_stem().unwrap_or_default().to_string_lossy();
    session.task.phase("draw", 0);
    let (map, signals) = plot_loom(&loom);
    let title = format!("{name}: {}", caption(&loom));
    let scene = figure(&map, &signals, &title, args.size, &theme);
    let saved = save_picture(session.world(), &scene, &output, SCALE)?;
    Ok(Outcome {
        object: json!({
            "outputs": report::paths(&saved.outputs),
            "spans": loom.report().spans,
            "warnings": [],
        }),
        report: report::table(
            session.style,
            &args.output.display().to_string(),
            &report::astray(&loom.report().spans),
        ),
        ..Outcome::default()
    })
}

/// `WIDTHxHEIGHT`, each from 100 to 10000.
fn size(text: &str) -> Result<[f32; 2], String> {
    let (width, height) = text.split_once('x').ok_or("a size is WIDTHxHEIGHT")?;
    let side = |text: &str| match text.parse::<u16>() {
        Ok(side @ 100..=10_000) => Ok(f32::from(side)),
        _ => Err(format!("`{text}` is not a number from 100 to 10000")),
    };
    Ok([side(width)?, side(height)?])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_two_numbers_that_a_picture_can_have() {
        assert_eq!(size("900x400"), Ok([900.0, 400.0]));
        for wrong in ["900", "900x", "axb", "10x10", "100000x100000", "-900x400"] {
            assert!(size(wrong).is_err(), "{wrong}");
        }
    }
}
