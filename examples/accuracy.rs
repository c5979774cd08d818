//! Error against k, l and m: each is lowered alone from k - 2 = l = m + 1 = n, where every frame is
//! reproduced, with the other two kept there. Relative total errors, sqrt(sum |z_i - psi(i)|^2) over the same
//! about the mean.

mod support;

use std::process::ExitCode;

use meshloom::diag::Result;
use meshloom::mesh::{FrameSource, Sequence};
use meshloom::plot::{Chart, Panel, Scale, Series, Style, Theme, Tint, chart};

use support::{Figure, table};

/// Captures that are measured where none is given.
const DEMOS: [&str; 5] = ["gallop", "walk", "flag", "jelly", "bar"];

/// Shares of the full numbers, in percent.
const SHARES: [usize; 7] = [10, 25, 40, 55, 70, 85, 100];

/// Errors of one capture: a list for k, l and m each, in the order of [`SHARES`].
type Errors = [Vec<f64>; 3];

/// Below this an error is rounding of f64 in the sums, not of the method; it is what a plot shows.
const ROUNDING: f64 = 1e-16;

fn main() -> ExitCode {
    support::run("accuracy", draw)
}

fn draw(figure: &mut Figure) -> Result<()> {
    let mut panels: [Vec<Series>; 3] = Default::default();
    let names = if figure.is_demo() {
        DEMOS.to_vec()
    } else {
        vec!["capture"]
    };
    for (i, name) in names.into_iter().enumerate() {
        let (sequence, _) = figure.capture(name)?;
        let sequence = support::first(&sequence, 120);
        let errors = errors(&sequence)?;
        print(name, &sequence, &errors);
        let exact = errors.iter().filter_map(|list| list.last());
        let exact = exact.fold(0.0_f64, |worst, error| worst.max(*error));
        let merged = merged(&sequence)?; // coincident positions share a site: the one thing that is lost
        figure.goal(
            &format!("{name}: full numbers reproduce every frame to 1e-8 ({exact:.0e}, merged {merged:.0e})"),
            exact <= 1e-8 + merged,
        );
        let slack = ROUNDING + merged;
        let falls = errors[2]
            .windows(2)
            .all(|pair| pair[1] <= pair[0] * (1.0 + 1e-9) + slack);
        figure.goal(&format!("{name}: more modes are never worse"), falls);
        for (panel, list) in panels.iter_mut().zip(&errors) {
            // the full numbers leave rounding only, which would flatten everything else
            let points = SHARES[..SHARES.len() - 1]
                .iter()
                .zip(list)
                .map(|(&share, error)| [share as f64, error.max(ROUNDING)]);
            panel.push(
                Series::line(
                    if panel.len() == i { name } else { "" },
                    Tint::Series(i),
                    points.collect(),
                )
                .styled(Style::Both),
            );
        }
    }
    let heads = [
        "error, fewer control points k",
        "error, fewer sites l",
        "error, fewer modes m",
    ];
    let panels = panels
        .into_iter()
        .zip(heads)
        .enumerate()
        .map(|(i, (mut series, name))| {
            if i > 0 {
                series.iter_mut().for_each(|series| series.name.clear()); // named once
            }
            Panel {
                name: name.into(),
                scale: Scale::Log,
                series,
                ..Panel::default()
            }
        });
    let curves = Chart {
        name: "share of the full number (%)".into(),
        panels: panels.collect(),
        ..Chart::default()
    };
    figure.picture(&chart(&curves, 640.0, 760.0, &Theme::light()).0)
}

/// What sharing sites costs with full numbers at most, relative.
fn merged(sequence: &Sequence) -> Result<f64> {
    let n = sequence.frames();
    let loom = support::fit(sequence, [n + 2, n, n - 1])?;
    Ok(loom.report().merged.error * (n as f64).sqrt()) // all frames like the worst
}

fn errors(sequence: &Sequence) -> Result<Errors> {
    let n = sequence.frames();
    let full = [n + 2, n, n - 1];
    let least = [4, 3, 0];
    let mut errors = Errors::default();
    for which in 0..3 {
        for share in SHARES {
            let mut numbers = full;
            numbers[which] = (full[which] * share / 100).max(least[which]);
            errors[which].push(support::fit(sequence, numbers)?.report().error.total);
        }
    }
    Ok(errors)
}

fn print(name: &str, sequence: &Sequence, errors: &Errors) {
    println!(
        "\n{name}: n = {}, V = {}",
        sequence.frames(),
        sequence.topology().vertices()
    );
    let mut heads = vec!["share".to_string()];
    heads.extend(SHARES.map(|share| format!("{share} %")));
    let heads: Vec<&str> = heads.iter().map(String::as_str).collect();
    let lines: Vec<Vec<String>> = ["k", "l", "m"]
        .into_iter()
        .zip(errors)
        .map(|(letter, list)| {
            let cells = list.iter().map(|error| format!("{error:.1e}"));
            std::iter::once(letter.to_string()).chain(cells).collect()
        })
        .collect();
    table(&heads, &lines);
}
