//! A shape put on a loom's map (CH12 §4.4).
//!
//! With x the coordinates of the shape and p its place, g becomes g + c (x - g(p)), where c is the thin
//! plate with g's sites and p that is 1 at p and otherwise nearest 0 at the frames and the sites: exactly
//! 0 there where every frame is a site. What h does not reach of the shape becomes one mode more.

use std::sync::Arc;

use crate::diag::{Diagnostic, Result};
use crate::loom::ch12;
use crate::loom::pose_map::{distance, extent};
use crate::loom::{Layout, Loom, Parts};
use crate::math::b_spline::Point;
use crate::math::layout::place_one;
use crate::math::pivoted_qr::PivotedQr;
use crate::math::thin_plate::{self, Rows};
use crate::mesh::rigid_align;
use crate::signal::pose::{COINCIDENT, PoseSignal};
use crate::signal::root::RootKind;
use crate::signal::shape::ShapeSignal;

/// A shape's distance from h's subspace below this part of its distance from h_0 is rounding: f32 has no
/// more.
const REACHED: f64 = 1e-7;

/// Vectors of h that the others reach but for this part add nothing.
const SAME: f64 = 1e-10;

/// How fast distances lose weight where the layout is not by plain distances: 1 / (delta + FADE max)^2,
/// as the ordered layout weighs them.
const FADE: f64 = 0.02;

/// The loom with the shape of 3V `positions` at the place `at` of its map; without one, at the place that
/// keeps its distances from the frames best (CH12 §3.2.1, the frames held). A loom with root motion takes
/// the shape as aligned with its first frame. Where a site lies within 1e-4 of the layout's extent, that
/// site's shape is replaced.
///
/// Time, frames and root motion stay; shapes of the motion near the place follow it. A loom of poses
/// ([`crate::loom::pose_map`]) with one added is the loom of all of them.
///
/// # Errors
/// Another number of coordinates; numbers that are not finite.
pub fn add_pose(loom: &Loom, positions: &[f32], at: Option<Point>) -> Result<Loom> {
    check(loom, positions, at)?;
    let z = encoded(loom, positions);
    let Reached { loom, x } = reaching(loom, &z)?;
    let place = at.unwrap_or_else(|| nearest_place(&loom, &x));
    let layout = with_pose(loom.layout(), place, &x, at.is_some());
    Loom::new(Parts {
        pose: Arc::new(through(&loom, place, &x)?),
        layout: Arc::new(layout),
        ..loom.parts()
    })
}

fn check(loom: &Loom, positions: &[f32], at: Option<Point>) -> Result<()> {
    let (found, vertices) = (positions.len() / 3, loom.topology().vertices());
    if positions.len() != 3 * vertices {
        let message = format!("the shape has {found} vertices, the loom {vertices}");
        return Diagnostic::error(message)
            .hint("a pose is a shape of the loom's own mesh")
            .err();
    }
    if let Some(bad) = positions.iter().position(|x| !x.is_finite()) {
        return Diagnostic::error("a coordinate of the shape is not finite")
            .at_vertex(bad / 3 + 1)
            .err();
    }
    match at {
        Some([x, y]) if !(x.is_finite() && y.is_finite()) => {
            Diagnostic::error("the place of the shape is not finite").err()
        }
        _ => Ok(()),
    }
}

/// Coordinates of the shape in the loom's space, on the branch of the frame most like it.
fn encoded(loom: &Loom, positions: &[f32]) -> Vec<f64> {
    let mut shape: Vec<f64> = positions.iter().map(|&x| f64::from(x)).collect();
    let (space, m) = (loom.space(), loom.shape().modes());
    let decoded = |x: &[f64]| {
        let (mut z, mut positions) = (vec![0.0; space.dimension()], vec![0.0; shape.len()]);
        loom.shape().evaluate(x, &mut z);
        space.decode(&z, &mut positions);
        positions
    };
    if let (Some(root), Some(x)) = (loom.root(), loom.layout().coordinates.get(..m)) {
        let first = decoded(x);
        let motion = match root.kind() {
            RootKind::Rigid => rigid_align::rigid(&first, &shape),
            RootKind::Ground => rigid_align::ground(&first, &shape, crate::loom::frames::UP),
        };
        let back = motion.inverse();
        for point in shape.as_chunks_mut::<3>().0 {
            *point = (back * nalgebra::Point3::from(*point)).coords.into();
        }
    }
    let mut z = vec![0.0; space.dimension()];
    space.encode(&shape, &mut z);
    if let Some(near) = most_like(loom, &z) {
        space.follow(&near, &mut z);
    }
    z
}

/// The frame of the layout nearest to coordinates, as coordinates; none where there is no layout.
fn most_like(loom: &Loom, z: &[f64]) -> Option<Vec<f64>> {
    let m = loom.shape().modes();
    let mut x = vec![0.0; m];
    loom.shape().project(z, &mut x);
    let far = |row: &&[f64]| -> f64 { row.iter().zip(&x).map(|(a, b)| (a - b) * (a - b)).sum() };
    let rows = loom.layout().coordinates.chunks_exact(m.max(1));
    let nearest = rows.min_by(|a, b| far(a).total_cmp(&far(b)))?;
    let mut near = vec![0.0; z.len()];
    loom.shape().evaluate(nearest, &mut near);
    Some(near)
}

/// A loom whose h reaches a shape, and the shape's coordinates there.
struct Reached {
    loom: Loom,
    x: Vec<f64>,
}

fn reaching(loom: &Loom, z: &[f64]) -> Result<Reached> {
    let shape = loom.shape();
    let m = shape.modes();
    let vectors: Vec<Vec<f64>> = (0..m).map(|mode| shape.vector(mode).to_vec()).collect();
    let from: Vec<f64> = z.iter().zip(shape.offset()).map(|(z, h)| z - h).collect();
    let (mut x, missed) = PivotedQr::new(&vectors, SAME).solve(&from);
    if missed <= REACHED * norm(&from) {
        let loom = loom.clone();
        return Ok(Reached { loom, x });
    }
    let mut reached = vec![0.0; z.len()];
    shape.direction(&x, &mut reached);
    let rest: Vec<f64> = from.iter().zip(&reached).map(|(z, h)| z - h).collect();
    let size = norm(&rest);
    x.push(size);
    let vectors = shape
        .vectors()
        .iter()
        .copied()
        .chain(rest.iter().map(|r| r / size));
    let shape = ShapeSignal::new(shape.offset().to_vec(), vectors.collect(), m + 1)
        .map_err(|error| Diagnostic::error(error.to_string()))?;
    let loom = with_mode(loom, shape)?;
    Ok(Reached { loom, x })
}

/// The loom with one mode more, in which nothing moves yet.
fn with_mode(loom: &Loom, shape: ShapeSignal) -> Result<Loom> {
    let m = shape.modes() - 1;
    let mut embedding = vec![0.0; (m + 1) * m];
    (0..m).for_each(|mode| embedding[mode * m + mode] = 1.0);
    let layout = loom.layout();
    let row = |frame: usize| &layout.coordinates[frame * m..(frame + 1) * m];
    let rows = 0..layout.positions.len();
    Loom::new(Parts {
        shape: Arc::new(shape),
        pose: Arc::new(loom.pose().map_values(&embedding, &vec![0.0; m + 1])),
        layout: Arc::new(Layout {
            coordinates: rows
                .flat_map(|frame| row(frame).iter().copied().chain([0.0]))
                .collect(),
            ..layout.as_ref().clone()
        }),
        ..loom.parts()
    })
}

/// Where distances to the frames' shapes are kept best. Distances are taken in units of the layout: their
/// factor is 1 where the layout has least stress.
fn nearest_place(loom: &Loom, x: &[f64]) -> Point {
    let layout = loom.layout();
    let row = |frame: usize| &layout.coordinates[frame * x.len()..(frame + 1) * x.len()];
    let far = |a: &[f64], b: &[f64]| {
        let squares = a.iter().zip(b).map(|(a, b)| (a - b) * (a - b));
        squares.sum::<f64>().sqrt()
    };
    let (mut squares, mut products) = (0.0, 0.0);
    for j in 0..layout.positions.len() {
        for i in 0..j {
            let apart = distance(layout.positions[i], layout.positions[j]);
            squares += apart * apart;
            products += apart * far(row(i), row(j));
        }
    }
    let unit = if products > 0.0 {
        squares / products
    } else {
        1.0
    };
    let distances: Vec<f64> = (0..layout.positions.len())
        .map(|frame| unit * far(row(frame), x))
        .collect();
    let most = distances.iter().copied().fold(0.0, f64::max);
    let weight = |&delta: &f64| match loom.report().method.as_str() {
        "ordered" => (delta + FADE * most).powi(-2),
        _ => 1.0,
    };
    let weights: Vec<f64> = distances.iter().map(weight).collect();
    place_one(&layout.positions, &distances, &weights)
}

fn with_pose(layout: &Layout, place: Point, x: &[f64], pinned: bool) -> Layout {
    let mut layout = layout.clone();
    if pinned {
        layout.pins.push((layout.positions.len(), place));
    }
    layout.positions.push(place);
    layout.coordinates.extend(x);
    layout.residuals.push(0.0);
    layout
}

/// g + c (x - g(p)).
fn through(loom: &Loom, place: Point, x: &[f64]) -> Result<PoseSignal> {
    let (g, frames) = (loom.pose(), &loom.layout().positions);
    if x.is_empty() {
        return Ok(g.as_ref().clone());
    }
    let mut sites = match g.sites() {
        [] => frames[..frames.len().min(1)].to_vec(),
        sites => sites.to_vec(),
    };
    let mut site_frames = g.site_frames().to_vec();
    let all: Vec<Point> = frames.iter().chain(&sites).copied().collect();
    let near = COINCIDENT * extent(&[&all[..], &[place]].concat());
    match sites.iter().position(|&site| distance(site, place) <= near) {
        Some(site) => sites[site] = place,
        None => {
            if site_frames.len() == sites.len() {
                site_frames.push(frames.len());
            }
            sites.push(place);
        }
    }
    if site_frames.len() != sites.len() {
        site_frames.clear();
    }
    let held: Vec<Point> = all
        .into_iter()
        .filter(|&p| distance(p, place) > near)
        .collect();
    let c = cardinal(&held, place, &sites)?;
    let mut change = vec![0.0; x.len()];
    g.evaluate(place, &mut change);
    change.iter_mut().zip(x).for_each(|(g, x)| *g = x - *g);
    let mut targets = vec![0.0; sites.len() * x.len()];
    for ((&site, c), target) in sites.iter().zip(c).zip(targets.chunks_exact_mut(x.len())) {
        g.evaluate(site, target);
        let changed = target.iter_mut().zip(&change);
        changed.for_each(|(target, change)| *target += c * change);
    }
    let rows = Rows {
        positions: &sites,
        targets: &targets,
        width: x.len(),
        weights: None,
    };
    let plate = thin_plate::fit(&rows, &sites).map_err(ch12::unfit)?;
    PoseSignal::new(plate, site_frames).map_err(ch12::unfit)
}

/// c at the sites: of all thin plates over them that are 1 at `place`, the one with the least sum of
/// squares at the `held` points. (The least squares with 1 asked for at `place` is that one times a
/// factor.)
fn cardinal(held: &[Point], place: Point, sites: &[Point]) -> Result<Vec<f64>> {
    let positions: Vec<Point> = held.iter().copied().chain([place]).collect();
    let mut targets = vec![0.0; positions.len()];
    targets[held.len()] = 1.0;
    let rows = Rows {
        positions: &positions,
        targets: &targets,
        width: 1,
        weights: None,
    };
    let c = thin_plate::fit(&rows, sites).map_err(ch12::unfit)?;
    let at = |p: Point| {
        let mut value = [0.0];
        c.evaluate(p, &mut value);
        value[0]
    };
    let one = at(place);
    Ok(sites.iter().map(|&site| at(site) / one).collect())
}

fn norm(v: &[f64]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::demo::Demo;
    use crate::loom::pose_map::pose_map;
    use crate::loom::test_looms::{ring, travelling};
    use crate::task::Task;

    const TEST_PLACES: [Point; 3] = [[0.0, 0.0], [2.0, 0.0], [0.5, 1.5]];

    fn far(a: &[f32], b: &[f32]) -> f32 {
        a.iter()
            .zip(b)
            .map(|(a, b)| (a - b).abs())
            .fold(0.0, f32::max)
    }

    /// A shape that the ring's modes do not reach.
    fn strange(loom: &Loom) -> Vec<f32> {
        let mut shape = loom.at(2.0).unwrap();
        let bump = |(i, x): (usize, &mut f32)| *x += 0.05 * ((i * i) % 11) as f32;
        shape.iter_mut().enumerate().for_each(bump);
        shape
    }

    #[test]
    fn a_map_of_poses_with_one_added_is_the_map_of_all() {
        let poses = Demo::find("cactus").expect("a demo").generate();
        let of = |count: usize| {
            let (poses, places) = (poses.slice(0..count), &TEST_PLACES[..count]);
            pose_map(&poses, places, "vertices", None, &Task::default()).unwrap()
        };
        let added = add_pose(&of(2), poses.frame(2), Some(TEST_PLACES[2])).unwrap();
        let all = of(3);
        for p in [[0.3, 0.2], [1.5, 1.5], [-1.0, 0.4], TEST_PLACES[1]] {
            // positions are of size 1 and rounded to single precision
            let apart = far(&added.pose_at(p).unwrap(), &all.pose_at(p).unwrap());
            assert!(apart < 1e-6, "{apart} at {p:?}");
        }
        assert_eq!(added.layout().pins.len(), 3);
    }

    #[test]
    fn its_place_shows_the_shape_and_frames_that_are_sites_stay() {
        let loom = ring(60, 20, true);
        let (shape, place) = (strange(&loom), [2.5, 0.4]);
        let added = add_pose(&loom, &shape, Some(place)).unwrap();
        assert_eq!(added.shape().modes(), loom.shape().modes() + 1);
        assert_eq!(added.pose().sites().len(), loom.pose().sites().len() + 1);
        assert!(far(&added.pose_at(place).unwrap(), &shape) < 1e-6);
        for frame in 1..=20 {
            let t = f64::from(frame);
            assert!(far(&added.at(t).unwrap(), &loom.at(t).unwrap()) < 1e-6);
        }
        assert_eq!(added.pose().site_frames().last(), Some(&20));
    }

    #[test]
    fn on_a_site_it_replaces_that_shape() {
        let loom = ring(60, 20, true);
        let (shape, place) = (strange(&loom), loom.pose().sites()[4]);
        let added = add_pose(&loom, &shape, Some(place)).unwrap();
        assert_eq!(added.pose().sites().len(), loom.pose().sites().len());
        assert!(far(&added.pose_at(place).unwrap(), &shape) < 1e-6);
    }

    #[test]
    fn without_a_place_it_lies_where_its_distances_want_it() {
        let poses = Demo::find("cactus").expect("a demo").generate();
        let far = |i: usize, j: usize| {
            let pairs = poses.frame(i).iter().zip(poses.frame(j));
            let squares = pairs.map(|(a, b)| f64::from(a - b) * f64::from(a - b));
            squares.sum::<f64>().sqrt()
        };
        // two poses at their own distance: a third one completes the triangle
        let places = [[0.0, 0.0], [far(0, 1), 0.0]];
        let two = poses.slice(0..2);
        let map = pose_map(&two, &places, "vertices", None, &Task::default()).unwrap();
        let added = add_pose(&map, poses.frame(2), None).unwrap();
        let place = *added.layout().positions.last().unwrap();
        for (pose, at) in places.into_iter().enumerate() {
            // coordinates are single precision
            assert!((distance(place, at) / far(pose, 2) - 1.0).abs() < 1e-5);
        }
        let shape = added.pose_at(place).unwrap();
        assert!(super::tests::far(&shape, poses.frame(2)) < 1e-6);
        assert_eq!(added.layout().pins.len(), map.layout().pins.len());
    }

    #[test]
    fn where_the_loom_travels_the_shape_is_taken_back() {
        let loom = travelling(60, 20);
        let still = loom.pose_at(loom.position_at(1.0).unwrap()).unwrap();
        let moved: Vec<f32> = {
            let motion = loom.root_at(9.0).unwrap();
            let points = still.as_chunks::<3>().0.iter();
            let moved = points.map(|p| motion * nalgebra::Point3::from(p.map(f64::from)));
            moved
                .flat_map(|p| [p.x as f32, p.y as f32, p.z as f32])
                .collect()
        };
        let added = add_pose(&loom, &moved, Some([2.5, 0.4])).unwrap();
        // two roundings to single precision of coordinates up to 10
        assert!(far(&added.pose_at([2.5, 0.4]).unwrap(), &still) < 5e-6);
    }

    #[test]
    fn shapes_of_other_meshes_are_refused() {
        let loom = ring(10, 12, true);
        assert!(add_pose(&loom, &[0.0; 33], None).is_err());
        let mut shape = loom.at(1.0).unwrap();
        assert!(add_pose(&loom, &shape, Some([f64::NAN, 0.0])).is_err());
        shape[7] = f32::INFINITY;
        let error = add_pose(&loom, &shape, None).unwrap_err();
        assert_eq!(error.place.vertex, Some(3));
    }
}
