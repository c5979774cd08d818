//! Keys and the spline through them as a picture of the shape space (X19 Fig. 2b): the plane of the two
//! leading principal components of the keys' coordinates.

use super::key_plane::KeyPlane;
use crate::diag::Result;
use crate::inbetween::Motion;
use crate::plot::{
    Anchor, Chart, MapNames, Panel, PoseSpace, Scale, Scene, Series, Theme, Tint, chart, pose_space,
};
use crate::task::Task;

/// The curve is sampled this often from key to key, if it can be afforded.
const SMOOTH: usize = 24;

/// Samples of the whole curve at most, and numbers that are computed for them.
const SAMPLES: usize = 600;
const NUMBERS: usize = 1 << 28;

/// A motion in the plane of its keys.
#[derive(Debug, Clone, PartialEq)]
pub struct KeyPath {
    /// Where each key lies.
    pub keys: Vec<[f64; 2]>,
    /// When it is reached.
    pub times: Vec<f64>,
    /// Points of the spline, from the first key to the last.
    pub curve: Vec<[f64; 2]>,
    /// The times of these points.
    pub curve_times: Vec<f64>,
    /// The share of the keys' spread that the plane shows, in \[0, 1\]; 1 for keys that are one shape.
    pub share: f64,
}

/// The path of a motion through the plane in which its keys lie farthest apart. Two keys lie on a line;
/// keys that are one shape lie at the origin.
///
/// # Errors
/// Coordinates that are not finite; cancellation.
pub fn key_path(motion: &Motion, task: &Task) -> Result<KeyPath> {
    let plane = KeyPlane::of(motion, task)?;
    let spline = motion.spline();
    let curve_times = dense(spline.times(), spline.width());
    let mut code = vec![0.0; spline.width()];
    let mut curve = Vec::with_capacity(curve_times.len());
    for time in &curve_times {
        task.check()?;
        spline.evaluate(*time, &mut code);
        curve.push(plane.place(&code));
    }
    Ok(KeyPath {
        keys: plane.keys(),
        times: spline.times().to_vec(),
        curve,
        curve_times,
        share: plane.share,
    })
}

/// Times from the first key to the last, every key among them.
pub(super) fn dense(times: &[f64], width: usize) -> Vec<f64> {
    let pieces = times.len().saturating_sub(1).max(1);
    let most = SAMPLES.min(NUMBERS / width.max(1)) / pieces;
    let steps = SMOOTH.min(most).max(1);
    let mut dense: Vec<f64> = times
        .windows(2)
        .flat_map(|pair| {
            let step = move |i: usize| pair[0] + (pair[1] - pair[0]) * i as f64 / steps as f64;
            (0..steps).map(step)
        })
        .collect();
    dense.extend(times.last());
    dense
}

/// The path as a map: keys as its frames.
pub fn key_map(path: &KeyPath) -> PoseSpace {
    PoseSpace {
        curve: path.curve.clone(),
        times: path.curve_times.clone(),
        frames: path.keys.clone(),
        shown: (1..=path.keys.len()).collect(),
        names: MapNames::keys(),
        ..PoseSpace::default()
    }
}

/// Size of the picture in pixels at scale 1.
const FIGURE: [f32; 2] = [640.0, 560.0];

/// The picture of a motion: its path, and beside it what the collapses to its ghost cost, where it has
/// one.
pub fn plot_motion(motion: &Motion, path: &KeyPath, theme: &Theme) -> Scene {
    let [width, height] = FIGURE;
    let map = pose_space(&key_map(path), width, height, theme).0;
    let report = motion.report();
    let title = format!(
        "{} keys in {}, {:.1} % of their spread in the plane",
        report.keys,
        report.space,
        100.0 * path.share
    );
    let costs = report.ghost.as_ref().map(|ghost| {
        let points = ghost
            .curve
            .iter()
            .map(|&(faces, cost)| [faces as f64, cost]);
        let cost = Panel {
            name: "cost of a collapse".into(),
            scale: Scale::Log,
            series: vec![Series::line("", Tint::Series(0), points.collect())],
            ..Panel::default()
        };
        let costs = Chart {
            name: "faces left".into(),
            scale: Scale::Log,
            panels: vec![cost],
            ..Chart::default()
        };
        chart(&costs, width, height, theme).0
    });
    let top = 2.0 * theme.text;
    let across = if costs.is_some() { 2.0 } else { 1.0 };
    let mut scene = Scene::new(across * width, height + top, theme.background);
    scene.write(
        &title,
        [0.8 * theme.text, 1.4 * theme.text],
        Anchor::Start,
        theme,
    );
    scene.place(map, [0.0, top]);
    if let Some(costs) = costs {
        scene.place(costs, [width, top]);
    }
    scene
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::inbetween::{CompleteOptions, Keys, complete};
    use crate::mesh::{Sequence, Topology};

    /// Shapes of one triangle whose last corner goes through `places`.
    fn motion(places: &[[f32; 2]]) -> Motion {
        let topology = Arc::new(Topology::from_triangles(3, &[[0, 1, 2]]).unwrap());
        let shape = |&[x, y]: &[f32; 2]| [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, x, y, 0.0];
        let positions = places.iter().flat_map(shape).collect();
        let keys = Keys::new(Sequence::new(topology, positions, None), None).unwrap();
        let options = CompleteOptions {
            space: "vertices".into(),
            ..CompleteOptions::default()
        };
        complete(&keys, &options, &Task::default()).unwrap().output
    }

    #[test]
    fn keys_in_a_plane_keep_their_distances_and_lie_on_the_curve() {
        let places = [[0.0, 1.0], [2.0, 1.5], [1.0, 4.0], [0.5, 3.0]];
        let path = key_path(&motion(&places), &Task::default()).unwrap();
        assert!((path.share - 1.0).abs() < 1e-12);
        for i in 0..4 {
            for j in 0..i {
                let [a, b] = [path.keys[i], path.keys[j]];
                let here = (a[0] - b[0]).hypot(a[1] - b[1]);
                let [a, b] = [places[i], places[j]].map(|place| place.map(f64::from));
                // rounding of coordinates up to 4
                assert!((here - (a[0] - b[0]).hypot(a[1] - b[1])).abs() < 1e-12);
            }
            let at = path
                .curve_times
                .iter()
                .position(|time| *time == path.times[i]);
            let [x, y] = path.curve[at.expect("each key is on the curve")];
            assert!((x - path.keys[i][0]).abs() + (y - path.keys[i][1]).abs() < 1e-12);
        }
        assert_eq!(path.curve.len(), 3 * SMOOTH + 1);
    }

    #[test]
    fn two_keys_lie_on_a_line_and_one_shape_at_the_origin() {
        let line = key_path(&motion(&[[0.0, 1.0], [3.0, 1.0]]), &Task::default()).unwrap();
        assert!(line.curve.iter().all(|at| at[1] == 0.0));
        let still = key_path(&motion(&[[0.0, 1.0], [0.0, 1.0]]), &Task::default()).unwrap();
        assert!(still.keys.iter().flatten().all(|x| *x == 0.0));
        assert_eq!(still.share, 1.0);
        let scene = plot_motion(&motion(&[[0.0, 1.0], [3.0, 1.0]]), &line, &Theme::light());
        assert!(scene.items.len() > 10);
    }
}
