//! Figure 11 of Rojas et al. 2014: a head becomes a sphere by a discrete conformal map. The factors u are
//! interpolated from zero; the lengths they give are embedded at 1/4, 1/2 and 3/4.

mod support;

use std::process::ExitCode;
use std::sync::Arc;

use meshloom::diag::{Diagnostic, Result};
use meshloom::inbetween::conformal::{factors, scaled, sphere};
use meshloom::inbetween::edge_lengths::{Blend, Embedding, KeyShapes, Memory};
use meshloom::mesh::Sequence;
use meshloom::plot::{Scene, Theme};
use meshloom::space::SpaceError;

use support::{Figure, View, rojas, row, table};

/// Width of one shape, in pixels.
const SIDE: f32 = 200.0;

fn main() -> ExitCode {
    support::run("rojas_conformal", draw)
}

fn draw(figure: &mut Figure) -> Result<()> {
    let told = |error: String| Box::new(Diagnostic::error(error));
    let (topology, head) = rojas::head(5);
    let embedding = Embedding::new(&topology).map_err(SpaceError::from)?;
    let lengths = embedding.lengths(&head);
    let unit = sphere(&topology, &lengths).map_err(|e| told(e.to_string()))?;
    // the sphere's size is free: one with the head's area, as factors far from zero would only scale
    let size = (area(&topology, &head) / area(&topology, &unit)).sqrt();
    let round: Vec<f64> = unit.iter().map(|x| x * size).collect();
    let found = factors(
        topology.vertices(),
        embedding.edges(),
        &lengths,
        &embedding.lengths(&round),
    )
    .map_err(|e| told(e.to_string()))?;
    figure.goal(
        "the head and the sphere are conformally equivalent to 1e-6",
        found.residual < 1e-6,
    );
    let keys = KeyShapes::new(&embedding, &[&head, &round]);
    let mut memory = Memory::default();
    let mut shapes = vec![("k = 0".to_string(), head.clone())];
    let mut rows = Vec::new();
    for k in [0.25, 0.5, 0.75] {
        let mut target = keys.blend(&[1.0 - k, k], Blend::Lengths);
        target.lengths = scaled(embedding.edges(), &lengths, &found.factors, k);
        let made = embedding
            .embed(&target, &mut memory)
            .map_err(|e| told(e.to_string()))?;
        let fit = &made.report.edges;
        rows.push(vec![
            format!("{k}"),
            format!("{:.2e}", made.report.residual),
            format!("{:.4} %", fit.rms_percent),
            format!("{:.3} %", fit.max_percent()),
            format!("{:.2} %", 100.0 * fit.within),
            made.report.impossible.len().to_string(),
        ]);
        figure.goal(
            &format!("k = {k}: RMS below 0.5 %, 98 % of the edges within 1 %"),
            fit.rms_percent < 0.5 && fit.within >= 0.98,
        );
        shapes.push((format!("k = {k}"), made.positions));
    }
    shapes.push(("k = 1".to_string(), round));
    println!(
        "{} vertices; equivalent to {:.1e}; factors from {:.3} to {:.3}",
        topology.vertices(),
        found.residual,
        least(&found.factors),
        -least(&found.factors.iter().map(|u| -u).collect::<Vec<_>>())
    );
    table(
        &[
            "k",
            "residual (3)",
            "RMS ratio",
            "worst edge",
            "within 1 %",
            "walks impossible",
        ],
        &rows,
    );
    let theme = Theme::light();
    let mut scene = Scene::new(5.0 * SIDE, SIDE + 30.0, theme.background);
    let all: Vec<f32> = shapes
        .iter()
        .flat_map(|(_, pose)| pose.iter().map(|&x| x as f32))
        .collect();
    let view = View::looking(&Sequence::new(Arc::clone(&topology), all, None), [0.7, 0.2]);
    let pictures: Vec<_> = shapes
        .iter()
        .map(|(name, pose)| {
            let positions: Vec<f32> = pose.iter().map(|&x| x as f32).collect();
            (
                name.clone(),
                view.picture(&positions, 2 * SIDE as usize, [205, 170, 140]),
            )
        })
        .collect();
    row(&mut scene, [0.0, 4.0], SIDE, &pictures, &theme);
    figure.picture(&scene)
}

fn least(values: &[f64]) -> f64 {
    values.iter().copied().fold(f64::MAX, f64::min)
}

fn area(topology: &meshloom::mesh::Topology, pose: &[f64]) -> f64 {
    let side = |a: u32, b: u32| -> [f64; 3] {
        std::array::from_fn(|k| pose[3 * b as usize + k] - pose[3 * a as usize + k])
    };
    let each = topology.triangles().iter().map(|&[a, b, c]| {
        let (p, q) = (side(a, b), side(a, c));
        let cross = [
            p[1] * q[2] - p[2] * q[1],
            p[2] * q[0] - p[0] * q[2],
            p[0] * q[1] - p[1] * q[0],
        ];
        0.5 * cross.iter().map(|x| x * x).sum::<f64>().sqrt()
    });
    each.sum()
}
