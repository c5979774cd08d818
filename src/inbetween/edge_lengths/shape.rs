//! What edge lengths fix of a mesh without an embedding, and what an embedding adds: corner angles,
//! dihedral angles, inequalities.

use std::f64::consts::PI;

use nalgebra::Vector3;
use rayon::prelude::*;

use super::fans::{Fan, Fans};
use crate::mesh::dihedral::{signed_angle, triangle_of_lengths};
use crate::mesh::{Hinges, NO_EDGE};

/// Edges, hinges or triangles that one thread takes at a time.
const CHUNK: usize = 2048;

/// Lengths break a triangle inequality from this part of the perimeter on; below it is rounding.
const BROKEN: f64 = 1e-9;

/// Position of a vertex.
pub(super) fn point(positions: &[f64], vertex: u32) -> Vector3<f64> {
    let at = 3 * vertex as usize;
    Vector3::new(positions[at], positions[at + 1], positions[at + 2])
}

/// The length of each edge.
pub(super) fn lengths(edges: &[[u32; 2]], positions: &[f64]) -> Vec<f64> {
    let each = edges.par_iter().with_min_len(CHUNK);
    each.map(|&[a, b]| (point(positions, b) - point(positions, a)).norm())
        .collect()
}

/// The dihedral angle of each hinge in (-pi, pi], positive where the surface is convex seen from the side
/// its first triangle faces; 0 where a triangle has no plane.
pub(super) fn dihedrals(triangles: &[[u32; 3]], hinges: &Hinges, positions: &[f64]) -> Vec<f64> {
    let angle = |sides: [u32; 2]| {
        let corner = |side: u32, k: u32| triangles[side as usize / 3][((side + k) % 3) as usize];
        let (a, b) = (corner(sides[0], 0), corner(sides[0], 1));
        let (start, axis) = (
            point(positions, a),
            point(positions, b) - point(positions, a),
        );
        let [one, two] = sides.map(|side| {
            let wing = point(positions, corner(side, 2)) - start;
            axis.cross(&wing)
        });
        let sizes = one.norm() * two.norm() * axis.norm();
        match sizes > 0.0 {
            // the second triangle lies beyond the edge: its normal is that of the reversed side
            true => signed_angle(&axis.normalize(), &one.normalize(), &-two.normalize()),
            false => 0.0,
        }
    };
    let each = hinges.hinges().par_iter().with_min_len(CHUNK);
    each.map(|hinge| angle(hinge.sides)).collect()
}

/// The lengths of the sides 01, 12, 20 of a triangle; a side from a vertex to itself has none.
fn sides(hinges: &Hinges, lengths: &[f64], triangle: usize) -> [f64; 3] {
    std::array::from_fn(|k| match hinges.side_edges()[3 * triangle + k] {
        NO_EDGE => 0.0,
        edge => lengths[edge as usize],
    })
}

/// The angle at each corner of each triangle, from its side lengths; sides that make no triangle are
/// shortened to a flat one.
pub(super) fn corner_angles(hinges: &Hinges, lengths: &[f64]) -> Vec<f64> {
    let triangles = hinges.side_edges().len() / 3;
    let each = (0..triangles).into_par_iter().with_min_len(CHUNK);
    let angles = each.flat_map_iter(|triangle| {
        let [length, offset, height] = triangle_of_lengths(sides(hinges, lengths, triangle));
        let first = libm::atan2(height, offset);
        let second = libm::atan2(height, length - offset);
        [first, second, (PI - first - second).max(0.0)]
    });
    angles.collect()
}

/// The height of a triangle over one of its sides.
pub(super) fn height(hinges: &Hinges, lengths: &[f64], side: u32) -> f64 {
    let [a, b, c] = sides(hinges, lengths, side as usize / 3);
    let turned = match side % 3 {
        0 => [a, b, c],
        1 => [b, c, a],
        _ => [c, a, b],
    };
    triangle_of_lengths(turned)[2]
}

/// The first triangle whose sides break its inequality or are no lengths at all, with its sides.
pub(super) fn broken_triangle(hinges: &Hinges, lengths: &[f64]) -> Option<(usize, [f64; 3])> {
    let triangles = hinges.side_edges().len() / 3;
    (0..triangles).find_map(|triangle| {
        let sides = sides(hinges, lengths, triangle);
        let longest = sides.into_iter().fold(0.0, f64::max);
        let perimeter: f64 = sides.iter().sum();
        let sound = sides.iter().all(|side| side.is_finite() && *side >= 0.0)
            && 2.0 * longest <= perimeter * (1.0 + BROKEN);
        (!sound).then_some((triangle, sides))
    })
}

/// By how much (radians) the corner angles around a vertex fail to close: a closed walk of arcs a_i on the
/// unit sphere, each at most pi, exists where for every odd set S of them
/// sum over S of (pi - a_i) + sum over the others of a_i >= pi (for three: the triangle inequality and
/// a perimeter of at most 2 pi). 0 where they do.
pub(super) fn missing(fans: &Fans, fan: &Fan, corners: &[f64]) -> f64 {
    let angles = || {
        fans.steps[fan.steps()]
            .iter()
            .map(|step| corners[step.corner as usize])
    };
    let sum: f64 = angles().map(|a| a.min(PI - a)).sum();
    let odd = angles().filter(|&a| a > 0.5 * PI).count() % 2 == 1;
    let cheapest = angles()
        .map(|a| (PI - 2.0 * a).abs())
        .fold(f64::MAX, f64::min);
    let least = if odd { sum } else { sum + cheapest };
    (PI - least).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::VertexCorners;

    /// A pyramid over a square seen as a fan of four triangles about its top.
    fn missing_of(angles: [f64; 4]) -> f64 {
        let triangles = [[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 1]];
        let corners = VertexCorners::new(5, &triangles);
        let hinges = Hinges::new(5, &triangles, &corners);
        let fans = Fans::new(&triangles, &corners, &hinges);
        let fan = fans.fans.iter().find(|fan| fan.vertex == 0).unwrap();
        let mut all = vec![0.0; 12];
        (0..4).for_each(|i| all[3 * i] = angles[i]);
        missing(&fans, fan, &all)
    }

    #[test]
    fn arcs_that_cannot_close_are_told_by_how_much() {
        assert_eq!(missing_of([0.5 * PI; 4]), 0.0);
        // the corner of R14 section 4, pi/2 against twice pi/5, its second arc cut in two
        let lacks = missing_of([0.5 * PI, 0.1 * PI, 0.1 * PI, 0.2 * PI]);
        assert!((lacks - 0.1 * PI).abs() < 1e-12);
        // four arcs of nearly a half turn each go twice back and forth
        assert!(missing_of([0.9 * PI; 4]) == 0.0);
        // three of them do not, with nothing in between
        assert!((missing_of([0.9 * PI, 0.9 * PI, 0.9 * PI, 0.0]) - 0.7 * PI).abs() < 1e-12);
    }
}
