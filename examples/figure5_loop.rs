//! Figure 5 of Cashman & Hormann 2012: an edit that is local in time. A loop is added to a motion of 99
//! frames with k = 82, l = 46, m = 19; k and n grow, l and m stay, and frames away from the seams keep
//! their bits.

mod support;

use std::process::ExitCode;

use meshloom::diag::Result;
use meshloom::edit::{Looped, find_loop};
use meshloom::loom::Loom;
use meshloom::loom::fit::FitOptions;
use meshloom::mesh::FrameSource;
use meshloom::pipeline::plot::plot_loom;
use meshloom::plot::{Anchor, PoseSpace, Scene, Theme, pose_space};
use meshloom::task::Task;

use support::{Figure, View, percent, table};

/// How many frames the loop may have: about as many as the paper's adds.
const LENGTHS: std::ops::RangeInclusive<usize> = 12..=30;

/// Frames of the new loop that are shown.
const SHOWN: usize = 7;

fn main() -> ExitCode {
    support::run("figure5_loop", draw)
}

fn draw(figure: &mut Figure) -> Result<()> {
    let (sequence, view) = figure.capture("gallop")?;
    let sequence = support::first(&sequence, 99);
    let n = sequence.frames();
    let scaled = |number: usize| (number * n).div_ceil(99); // shorter captures keep the paper's shares
    let counts = [
        scaled(82).clamp(4, n + 2),
        scaled(46).max(3),
        scaled(19).min(n - 1),
    ];
    let loom = support::fit_with(&sequence, counts, FitOptions::default())?;
    let looped = find_loop(&loom, *LENGTHS.start(), *LENGTHS.end(), &Task::default())?;
    let (from, to) = looped.stretch;
    let length = (to - from) as usize;
    let longer = &looped.loom;
    let added = longer.frames() - n;
    let same = untouched(&loom, longer, looped.stretch)?;
    let row = |name: &str, paper: &str, here: String| vec![name.into(), paper.into(), here];
    let both = |before: usize, after: usize| format!("{before} -> {after}");
    table(
        &["", "paper", "here"],
        &[
            row(
                "dimension d",
                "11505",
                (3 * sequence.topology().vertices()).to_string(),
            ),
            row("frames n", "99 -> 118", both(n, longer.frames())),
            row(
                "control points k",
                "82 -> 97",
                both(loom.time().controls().len(), longer.time().controls().len()),
            ),
            row(
                "sites l",
                "46",
                both(loom.pose().sites().len(), longer.pose().sites().len()),
            ),
            row(
                "modes m",
                "19",
                both(loom.shape().modes(), longer.shape().modes()),
            ),
            row("total error", "", percent(loom.report().error.total)),
            row(
                "loop",
                "",
                format!("[{from}, {to}], {} frames of bridge", looped.bridge),
            ),
            row(
                "seam over the motion's own changes",
                "",
                format!("{:.2}", looped.seam.worst()),
            ),
            row(
                "frames with the same bits",
                "\"unmodified\"",
                format!("{same} of {n}"),
            ),
        ],
    );
    let kept = longer.pose().sites().len() == loom.pose().sites().len()
        && longer.shape().modes() == loom.shape().modes();
    figure.goal("l and m stay", kept);
    figure.goal(
        "n grows by the loop's frames and its bridge's",
        added == length + looped.bridge,
    );
    figure.goal(
        "the seam does not show: at most 1.5",
        looped.seam.worst() <= 1.5,
    );
    // at each seam, two spans to either side: fewer than four frames at 0.8 spans a frame
    figure.goal("all but eight frames keep their bits", same + 8 >= n);
    figure.picture(&compose(&loom, &looped, &view)?)
}

/// How many frames have the same bits before and after: those before the loop's end at their own times,
/// those after it later.
fn untouched(loom: &Loom, longer: &Loom, (from, to): (f64, f64)) -> Result<usize> {
    let shift = (longer.frames() - loom.frames()) as f64;
    let mut same = 0;
    for frame in 1..=loom.frames() {
        let t = frame as f64;
        let shape = loom.at(t)?;
        let before = t <= to && longer.at(t)? == shape;
        let after = t >= from && longer.at(t + shift)? == shape;
        same += usize::from(before || after);
    }
    Ok(same)
}

/// The map before and after, the new pass set off, and shapes of it.
fn compose(loom: &Loom, looped: &Looped, view: &View) -> Result<Scene> {
    let theme = Theme::light();
    let (half, tall) = (560.0, 460.0);
    let side = 2.0 * half / SHOWN as f32;
    let mut scene = Scene::new(2.0 * half, tall + side + 74.0, theme.background);
    let first = looped.stretch.1;
    let last = first + (looped.loom.frames() - loom.frames()) as f64;
    let halves = [
        (loom, None, "(a) the time signal"),
        (
            &looped.loom,
            Some([first, last]),
            "(b) with a loop more, set off",
        ),
    ];
    for (i, (loom, span, name)) in halves.into_iter().enumerate() {
        let (map, _) = plot_loom(loom);
        let map = PoseSpace {
            curve: map.curve,
            times: map.times,
            frames: map.reached,
            span,
            ..PoseSpace::default()
        };
        let (map, _) = pose_space(&map, half, tall, &theme);
        scene.place(map, [half * i as f32, 24.0]);
        scene.write(
            name,
            [half * (0.5 + i as f32), 16.0],
            Anchor::Middle,
            &theme,
        );
    }
    let mut shapes = Vec::new();
    for shown in 0..SHOWN {
        let t = first + (last - first) * shown as f64 / (SHOWN - 1) as f64;
        let shape = looped.loom.at(t.round())?;
        let image = view.picture(&shape, 2 * side as usize, [150, 170, 200]);
        shapes.push((format!("ψ({})", t.round()), image));
    }
    scene.write(
        "(c) frames of the new loop",
        [half, tall + 38.0],
        Anchor::Middle,
        &theme,
    );
    support::row(&mut scene, [0.0, tall + 44.0], side, &shapes, &theme);
    Ok(scene)
}
