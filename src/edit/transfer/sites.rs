//! The sites of a map that is fitted again.

use crate::math::b_spline::Point;

/// Sites and those places of frames that are at least half a step of the motion from each of them and from
/// each other: what lies closer, as strides laid over each other do, is for the least squares to even out.
pub(super) fn between(sites: &[Point], frames: &[Point]) -> Vec<Point> {
    let mut steps: Vec<f64> = frames
        .windows(2)
        .map(|pair| apart(&pair[0], &pair[1]))
        .collect();
    steps.sort_by(f64::total_cmp);
    let least = 0.5 * steps.get(steps.len() / 2).copied().unwrap_or(0.0);
    let mut more = sites.to_vec();
    for frame in frames {
        if more.iter().all(|site| apart(site, frame) > least) {
            more.push(*frame);
        }
    }
    more
}

/// Sites of a map by the frame whose place is nearest.
pub(super) fn sites_by_frame(sites: &[Point], places: &[Point]) -> Vec<Vec<Point>> {
    let mut by_frame = vec![Vec::new(); places.len()];
    for &site in sites {
        let from = |frame: &usize| apart(&places[*frame], &site);
        let nearest = (0..places.len()).min_by(|a, b| from(a).total_cmp(&from(b)));
        nearest
            .into_iter()
            .for_each(|frame| by_frame[frame].push(site));
    }
    by_frame
}

fn apart(a: &Point, b: &Point) -> f64 {
    libm::hypot(a[0] - b[0], a[1] - b[1])
}
