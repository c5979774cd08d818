use nalgebra::Vector3;

use super::*;
use crate::mesh::{Hinges, Topology, VertexCorners};

/// A closed mesh of genus 0: an octahedron divided, each vertex at a bumpy radius.
fn bumpy(divisions: usize, bump: f64) -> (Topology, Vec<f64>) {
    let mut points: Vec<Vector3<f64>> = [
        [1., 0., 0.],
        [-1., 0., 0.],
        [0., 1., 0.],
        [0., -1., 0.],
        [0., 0., 1.],
        [0., 0., -1.],
    ]
    .map(Vector3::from)
    .to_vec();
    let mut triangles = vec![
        [0, 2, 4],
        [2, 1, 4],
        [1, 3, 4],
        [3, 0, 4],
        [2, 0, 5],
        [1, 2, 5],
        [3, 1, 5],
        [0, 3, 5],
    ];
    for _ in 0..divisions {
        let mut middles = std::collections::BTreeMap::new();
        let mut next = Vec::new();
        for [a, b, c] in triangles {
            let mut middle = |i: u32, j: u32| {
                *middles.entry((i.min(j), i.max(j))).or_insert_with(|| {
                    points.push((points[i as usize] + points[j as usize]).normalize());
                    points.len() as u32 - 1
                })
            };
            let [ab, bc, ca] = [middle(a, b), middle(b, c), middle(c, a)];
            next.extend([[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]);
        }
        triangles = next;
    }
    let radius =
        |p: &Vector3<f64>| 1.0 + bump * ((3.0 * p.x + 1.0).sin() + (2.0 * p.y).cos() * p.z);
    let pose = points
        .iter()
        .flat_map(|p| (p * radius(p)).data.0[0])
        .collect();
    (
        Topology::from_triangles(points.len(), &triangles).unwrap(),
        pose,
    )
}

fn edges(topology: &Topology) -> Vec<[u32; 2]> {
    let corners = VertexCorners::new(topology.vertices(), topology.triangles());
    Hinges::new(topology.vertices(), topology.triangles(), &corners)
        .edges()
        .to_vec()
}

fn lengths(edges: &[[u32; 2]], pose: &[f64]) -> Vec<f64> {
    let point = |v: u32| Vector3::from_column_slice(&pose[3 * v as usize..][..3]);
    edges
        .iter()
        .map(|&[a, b]| (point(b) - point(a)).norm())
        .collect()
}

#[test]
fn factors_between_equivalent_metrics_are_found() {
    let (topology, pose) = bumpy(2, 0.1);
    let edges = edges(&topology);
    let a = lengths(&edges, &pose);
    let wanted: Vec<f64> = (0..topology.vertices())
        .map(|v| (1.7 * v as f64).sin())
        .collect();
    let b = scaled(&edges, &a, &wanted, 1.0);
    let found = factors(topology.vertices(), &edges, &a, &b).unwrap();
    // the regularisation of 1e-12 is relative to diagonals of order one
    assert!(found.residual < 1e-10);
    assert!(
        found
            .factors
            .iter()
            .zip(&wanted)
            .all(|(a, b)| (a - b).abs() < 1e-8)
    );
    let halfway = scaled(&edges, &a, &wanted, 0.5);
    assert!(
        halfway
            .iter()
            .zip(a.iter().zip(&b))
            .all(|(h, (a, b))| (h * h - a * b).abs() < 1e-12)
    );
    // two shapes are not equivalent in general
    let other = lengths(&edges, &bumpy(2, 0.3).1);
    assert!(
        factors(topology.vertices(), &edges, &a, &other)
            .unwrap()
            .residual
            > 1e-3
    );
}

#[test]
fn a_closed_mesh_is_equivalent_to_one_in_the_sphere() {
    for (divisions, bump) in [(1, 0.3), (3, 0.25), (4, 0.15)] {
        let (topology, pose) = bumpy(divisions, bump);
        let edges = edges(&topology);
        let a = lengths(&edges, &pose);
        let round = sphere(&topology, &a).unwrap();
        for point in round.chunks_exact(3) {
            assert!((Vector3::from_column_slice(point).norm() - 1.0).abs() < 1e-12);
        }
        let mean = crate::mesh::rigid_align::mean(&round);
        assert!(mean.norm() < 1e-9);
        let found = factors(topology.vertices(), &edges, &a, &lengths(&edges, &round)).unwrap();
        // angle sums are right to 1e-10; the layout adds them up over the mesh
        assert!(found.residual < 1e-7, "{}", found.residual);
        // seen from outside as before
        let volume: f64 = topology
            .triangles()
            .iter()
            .map(|t| {
                let [a, b, c] =
                    t.map(|v| Vector3::from_column_slice(&round[3 * v as usize..][..3]));
                a.cross(&b).dot(&c)
            })
            .sum();
        assert!(volume > 0.0);
    }
}

#[test]
fn the_sphere_is_its_own_map_up_to_moebius_transformations() {
    let (topology, pose) = bumpy(3, 0.0);
    let edges = edges(&topology);
    let a = lengths(&edges, &pose);
    let found = lengths(&edges, &sphere(&topology, &a).unwrap());
    // the octahedron's symmetry leaves the mean at the centre only for the identity
    assert!(a.iter().zip(&found).all(|(a, b)| (a - b).abs() < 1e-6));
}

#[test]
fn other_surfaces_are_refused() {
    let open = Topology::from_triangles(4, &[[0, 1, 2], [0, 2, 3]]).unwrap();
    let error = sphere(&open, &[1.0; 5]).unwrap_err();
    assert_eq!(error, ConformalError::NotASphere { counts: [4, 5, 2] });
    assert!(
        error
            .to_string()
            .contains("4 vertices, 5 edges and 2 triangles")
    );
}
