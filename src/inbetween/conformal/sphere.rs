//! The conformal map to the sphere: a flat disk, lifted (Springborn, Schroeder & Pinkall 2008, §3.2).

use nalgebra::Vector3;

use super::ConformalError;
use super::disk::Disk;
use crate::mesh::{Components, Hinges, Topology, VertexCorners};

/// The mean of the vertices on the sphere is at the centre to this part of the radius.
const CENTRED: f64 = 1e-10;

/// Moebius transformations at most; a few dozen are usual.
const MOVES: usize = 2000;

/// An equivalent mesh inscribed in the unit sphere about the origin, the mean of its vertices at the
/// centre; 3V positions, faces seen from outside as before.
///
/// # Errors
/// [`ConformalError`].
///
/// # Panics
/// `lengths` is not in the order of the edges of `topology`'s triangles ([`Hinges::edges`]).
pub fn sphere(topology: &Topology, lengths: &[f64]) -> Result<Vec<f64>, ConformalError> {
    let (vertices, triangles) = (topology.vertices(), topology.triangles());
    let corners = VertexCorners::new(vertices, triangles);
    let hinges = Hinges::new(vertices, triangles, &corners);
    assert_eq!(
        lengths.len(),
        hinges.edges().len(),
        "lengths of another mesh"
    );
    check_sphere(vertices, triangles, &hinges)?;
    // many edges at the pole leave many free vertices around it
    let pole = (0..vertices).rev().max_by_key(|&v| corners.at(v).len());
    let pole = pole.unwrap_or(0);
    let disk = Disk::new(triangles, &hinges, pole as u32, vertices);
    let mut plane = disk.lay_out(&disk.flatten(lengths)?);
    spread(&mut plane, pole);
    let mut points: Vec<Vector3<f64>> = plane.into_iter().map(lifted).collect();
    points[pole] = Vector3::z();
    centre(&mut points);
    Ok(points.iter().flat_map(|p| [p.x, p.y, p.z]).collect())
}

/// Every edge between two triangles that run through it opposite ways, one part, Euler characteristic 2.
fn check_sphere(
    vertices: usize,
    triangles: &[[u32; 3]],
    hinges: &Hinges,
) -> Result<(), ConformalError> {
    let (edges, faces) = (hinges.edges().len(), triangles.len());
    let start = |side: u32| triangles[side as usize / 3][side as usize % 3];
    let closed = hinges.hinges().len() == edges
        && 2 * edges == 3 * faces
        && hinges
            .hinges()
            .iter()
            .all(|h| start(h.sides[0]) != start(h.sides[1]));
    let parts = Components::new(vertices, triangles).count();
    match closed && parts == 1 && vertices + faces == edges + 2 {
        true => Ok(()),
        false => Err(ConformalError::NotASphere {
            counts: [vertices, edges, faces],
        }),
    }
}

/// Moves and scales the plane so that half of the points lie within the unit circle about their middle:
/// as many on each half of the sphere. A similarity there is a Moebius transformation of the sphere; this
/// one leaves little for [`centre`] to do.
fn spread(plane: &mut [[f64; 2]], pole: usize) {
    let others = || (0..plane.len()).filter(|&v| v != pole);
    let median = |mut values: Vec<f64>| {
        values.sort_by(f64::total_cmp);
        values.get(values.len() / 2).copied().unwrap_or(0.0)
    };
    let middle = [0, 1].map(|axis| median(others().map(|v| plane[v][axis]).collect()));
    let distance = |v: usize| libm::hypot(plane[v][0] - middle[0], plane[v][1] - middle[1]);
    let radius = median(others().map(distance).collect());
    let scale = if radius > 0.0 { 1.0 / radius } else { 1.0 };
    for point in plane.iter_mut() {
        *point = [0, 1].map(|axis| (point[axis] - middle[axis]) * scale);
    }
}

/// The plane to the unit sphere from its north pole, turned over: what is counter-clockwise in the plane is
/// so seen from outside.
fn lifted([x, y]: [f64; 2]) -> Vector3<f64> {
    let square = x * x + y * y;
    Vector3::new(2.0 * x, -2.0 * y, square - 1.0) / (square + 1.0)
}

/// Moves the mean of points on the unit sphere to the centre by Moebius transformations: hyperbolic
/// translations that take the mean to the origin, over and over.
fn centre(points: &mut [Vector3<f64>]) {
    for _ in 0..MOVES {
        let mean = points.iter().sum::<Vector3<f64>>() / points.len() as f64;
        if mean.norm() < CENTRED {
            return;
        }
        // the inversion in the sphere about c = -a/|a|^2 scaled, written for points of the unit sphere
        let square = mean.norm_squared();
        for point in points.iter_mut() {
            let away = *point - mean;
            let moved = away * ((1.0 - square) / away.norm_squared()) - mean;
            *point = moved.normalize();
        }
    }
}
