//! Figure 12 of Rojas et al. 2014: edge lengths of an arm between bent and straight, 100 steps, against the
//! straight path between the lengths. The paper compares its method (RMS ratio up to .75 %, worst edge 15 %)
//! with Winkler et al. 2010 (.5 %, 40 %); here are five methods on an arm of the paper's 2,502 vertices.

mod support;

use std::process::ExitCode;
use std::sync::Arc;

use meshloom::diag::{Diagnostic, Result};
use meshloom::inbetween::edge_lengths::{Blend, EdgeFit, Embedding, KeyShapes, Options, morph};
use meshloom::inbetween::isometric::{Alignment, Connectivity, Isometric};
use meshloom::mesh::Topology;
use meshloom::plot::{Chart, Panel, Scale, Series, Theme, Tint, chart};
use meshloom::space::{SpaceError, Spaces, StraightPath};
use meshloom::task::Task;

use support::{Figure, rojas, table};

/// Steps between the poses.
const STEPS: usize = 100;

fn main() -> ExitCode {
    support::run("figure12_measures", draw)
}

/// A method and its frames' errors.
struct Measured {
    name: &'static str,
    fits: Vec<EdgeFit>,
}

fn draw(figure: &mut Figure) -> Result<()> {
    let (topology, straight) = rojas::arm(0.0, 0.0, 0.0);
    let (_, bent) = rojas::arm(1.7, 0.6, 0.4);
    let embedding = Embedding::new(&topology).map_err(SpaceError::from)?;
    let keys = KeyShapes::new(&embedding, &[&bent, &straight]);
    let path: Vec<f64> = (0..=STEPS).map(|i| i as f64 / STEPS as f64).collect();
    let measured = |name, frames: Vec<Vec<f64>>| {
        let fits = path.iter().zip(&frames).map(|(&t, frame)| {
            let asked = keys.blend(&[1.0 - t, t], Blend::Lengths).lengths;
            EdgeFit::new(&asked, &embedding.lengths(frame))
        });
        Measured {
            name,
            fits: fits.collect(),
        }
    };
    let mut methods = vec![measured(
        "edge-lengths",
        embedded(&embedding, &topology, &keys, &path)?,
    )];
    for space in ["lengths-angles", "gradients", "vertices"] {
        methods.push(measured(
            space,
            blended(space, &topology, [&bent, &straight], &path)?,
        ));
    }
    methods.insert(
        2,
        measured(
            "isometric",
            isometric(&topology, [&bent, &straight], &path)?,
        ),
    );
    print(&methods);
    let [ours, ..] = &methods[..] else {
        return Ok(());
    };
    figure.goal(
        "edge-lengths: the worst edge of any frame is below 1 %",
        worst(ours) < 1.0,
    );
    figure.goal(
        "edge-lengths: the RMS ratio of any frame is below 0.1 %",
        rms(ours) < 0.1,
    );
    figure.goal(
        "edge-lengths has the smallest RMS ratio and worst edge of the five",
        methods[1..]
            .iter()
            .all(|other| rms(other) > rms(ours) && worst(other) > worst(ours)),
    );
    figure.picture(&plotted(&methods, &path))
}

/// The largest RMS ratio of any frame, in percent.
fn rms(method: &Measured) -> f64 {
    method
        .fits
        .iter()
        .map(|fit| fit.rms_percent)
        .fold(0.0, f64::max)
}

/// The worst edge of any frame, in percent.
fn worst(method: &Measured) -> f64 {
    method
        .fits
        .iter()
        .map(EdgeFit::max_percent)
        .fold(0.0, f64::max)
}

fn embedded(
    embedding: &Embedding,
    topology: &Arc<Topology>,
    keys: &KeyShapes,
    path: &[f64],
) -> Result<Vec<Vec<f64>>> {
    let rows: Vec<Vec<f64>> = path.iter().map(|&t| vec![1.0 - t, t]).collect();
    let found = morph(
        embedding,
        topology,
        keys,
        &rows,
        Options::default(),
        &Task::default(),
    );
    let found = found.map_err(|error| Box::new(Diagnostic::error(format!("{error:?}"))))?;
    println!("{} jumps mended", found.repairs.len());
    Ok(found.frames)
}

/// Straight paths in a shape space.
fn blended(
    name: &str,
    topology: &Arc<Topology>,
    [from, to]: [&[f64]; 2],
    path: &[f64],
) -> Result<Vec<Vec<f64>>> {
    let space = Spaces::new(Arc::clone(topology), from).open(name, &[from, to])?;
    let straight = StraightPath::new(space, from, to);
    let frame = |&t: &f64| {
        let mut positions = vec![0.0; from.len()];
        straight.at(t, &mut positions);
        positions
    };
    Ok(path.iter().map(frame).collect())
}

fn isometric(
    topology: &Arc<Topology>,
    [from, to]: [&[f64]; 2],
    path: &[f64],
) -> Result<Vec<Vec<f64>>> {
    let connectivity = Connectivity::new(topology, from).map_err(SpaceError::from)?;
    let morph =
        Isometric::new(&connectivity, from, to, Alignment::Rigid).map_err(SpaceError::from)?;
    let frame = |&t: &f64| {
        let mut positions = vec![0.0; from.len()];
        morph.at(t, &mut positions);
        positions
    };
    Ok(path.iter().map(frame).collect())
}

fn print(methods: &[Measured]) {
    let paper = |name: &str| match name {
        "edge-lengths" => ["0.75 %", "15 %"],
        "lengths-angles" => ["0.5 % (Winkler)", "40 % (Winkler)"],
        _ => ["", ""],
    };
    let row = |method: &Measured| {
        let peak = |value: &dyn Fn(&EdgeFit) -> f64| {
            let best = (0..method.fits.len())
                .max_by(|&a, &b| value(&method.fits[a]).total_cmp(&value(&method.fits[b])));
            best.unwrap_or(0).to_string()
        };
        let [rms_paper, max_paper] = paper(method.name).map(String::from);
        vec![
            method.name.to_string(),
            rms_paper,
            format!("{:.4} %", rms(method)),
            peak(&|fit| fit.rms_percent),
            max_paper,
            format!("{:.3} %", worst(method)),
            peak(&EdgeFit::max_percent),
        ]
    };
    let heads = [
        "",
        "RMS ratio: paper",
        "here",
        "at frame",
        "worst edge: paper",
        "here",
        "at frame",
    ];
    table(&heads, &methods.iter().map(row).collect::<Vec<_>>());
}

/// Both graphs, logarithmic: the methods differ by orders of magnitude.
fn plotted(methods: &[Measured], path: &[f64]) -> meshloom::plot::Scene {
    let theme = Theme::light();
    let panel = |name: &str, value: &dyn Fn(&EdgeFit) -> f64| {
        let series = methods.iter().enumerate().map(|(at, method)| {
            let points = path.iter().zip(&method.fits).enumerate();
            let points = points.map(|(frame, (_, fit))| [frame as f64, value(fit)]);
            let inner: Vec<[f64; 2]> = points.filter(|p| p[1] > 1e-7).collect();
            Series::line(method.name, Tint::Series(at), inner)
        });
        Panel {
            name: name.into(),
            scale: Scale::Log,
            series: series.collect(),
            ..Panel::default()
        }
    };
    let figure = Chart {
        name: "frame".into(),
        panels: vec![
            panel("RMS error / mean length (%)", &|fit| fit.rms_percent),
            panel("worst edge (%)", &EdgeFit::max_percent),
        ],
        ..Chart::default()
    };
    chart(&figure, 760.0, 620.0, &theme).0
}
