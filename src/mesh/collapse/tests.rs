//! What collapses keep of a surface, and what they refuse.

use std::collections::HashMap;

use nalgebra::Vector3;

use super::*;

/// A torus of `rows` x `columns` squares cut in two.
fn torus(rows: usize, columns: usize) -> (Vec<[u32; 3]>, Vec<f64>) {
    let at = |i: usize, j: usize| ((i % rows) * columns + j % columns) as u32;
    let (mut triangles, mut points) = (Vec::new(), Vec::new());
    for i in 0..rows {
        for j in 0..columns {
            let turn = |i: usize, n: usize| std::f64::consts::TAU * i as f64 / n as f64;
            let ((s, c), (t, d)) = (libm::sincos(turn(i, rows)), libm::sincos(turn(j, columns)));
            points.extend([(2.0 + d) * c, (2.0 + d) * s, t]);
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    (triangles, points)
}

/// A flat sheet of `side` x `side` squares with a border.
fn sheet(side: usize) -> (Vec<[u32; 3]>, Vec<f64>) {
    let at = |x: usize, y: usize| (y * (side + 1) + x) as u32;
    let (mut triangles, mut points) = (Vec::new(), Vec::new());
    for y in 0..=side {
        for x in 0..=side {
            points.extend([x as f64, y as f64, 0.0]);
            if x < side && y < side {
                let (a, b) = (at(x, y), at(x + 1, y));
                let (c, d) = (at(x + 1, y + 1), at(x, y + 1));
                triangles.extend([[a, b, c], [a, c, d]]);
            }
        }
    }
    (triangles, points)
}

/// How many triangles lie at each edge; vertices and edges that are used.
fn edges(triangles: &[[u32; 3]]) -> (HashMap<[u32; 2], usize>, usize) {
    let mut edges = HashMap::new();
    let mut vertices: Vec<u32> = triangles.concat();
    for &[a, b, c] in triangles {
        for [a, b] in [[a, b], [b, c], [c, a]] {
            *edges.entry([a.min(b), a.max(b)]).or_insert(0) += 1;
        }
    }
    vertices.sort_unstable();
    vertices.dedup();
    (edges, vertices.len())
}

#[test]
fn a_torus_stays_a_closed_torus() {
    let (triangles, points) = torus(30, 20);
    for target in [400, 60, 20] {
        let found = collapse(&triangles, &[&points], target).unwrap();
        assert!(found.triangles.len() <= target);
        let (edges, vertices) = edges(&found.triangles);
        assert!(edges.values().all(|&count| count == 2));
        assert_eq!(vertices + found.triangles.len(), edges.len(), "Euler's 0");
        assert_eq!(vertices, found.vertices.len());
    }
}

#[test]
fn a_flat_sheet_keeps_its_corners_and_its_border() {
    let (triangles, points) = sheet(12);
    let found = collapse(&triangles, &[&points], 40).unwrap();
    for corner in [0, 12, 13 * 12, 13 * 13 - 1] {
        assert!(found.vertices.contains(&corner));
    }
    let area: f64 = found
        .triangles
        .iter()
        .map(|triangle| {
            let [a, b, c] = triangle.map(|vertex| {
                let at = 3 * found.vertices[vertex as usize] as usize;
                Vector3::from_column_slice(&points[at..at + 3])
            });
            0.5 * (b - a).cross(&(c - a)).z
        })
        .sum();
    assert!((area - 144.0).abs() < 1e-9, "{area}");
}

#[test]
fn one_sequence_serves_all_poses() {
    let (triangles, flat) = sheet(12);
    // folded along a line in the second pose: its vertices must stay
    let fold = |p: &[f64]| [p[0], p[1], (p[0] - 5.0).abs()];
    let folded: Vec<f64> = flat.chunks_exact(3).flat_map(fold).collect();
    let found = collapse(&triangles, &[&flat, &folded], 60).unwrap();
    let on_the_fold = |triangle: &[u32; 3]| {
        let x = triangle.map(|v| flat[3 * found.vertices[v as usize] as usize]);
        x.iter().all(|x| *x <= 5.0) || x.iter().all(|x| *x >= 5.0)
    };
    assert!(found.triangles.iter().all(on_the_fold));
}

#[test]
fn every_vertex_is_absorbed_by_one_that_remains() {
    let (triangles, points) = torus(20, 12);
    let found = collapse(&triangles, &[&points], 100).unwrap();
    for (new, &old) in found.vertices.iter().enumerate() {
        assert_eq!(found.absorber[old as usize] as usize, new);
    }
    assert!(
        found
            .absorber
            .iter()
            .all(|&to| (to as usize) < found.vertices.len())
    );
    let mut counts = found.curve.iter().map(|(count, _)| *count);
    assert!(counts.next_back() == Some(found.triangles.len()));
    assert!(found.curve.windows(2).all(|pair| pair[1].0 < pair[0].0));
}

#[test]
fn what_is_no_surface_or_holds_is_named() {
    let points = [
        0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, -1.0, 0.0,
    ];
    let three = [[0, 1, 2], [1, 0, 3], [0, 1, 4]];
    let error = collapse(&three, &[&points], 1).unwrap_err();
    assert_eq!(error, CollapseError::EdgeOfMany { edge: [0, 1] });
    let twice = [[0, 1, 2], [0, 3, 3]];
    let error = collapse(&twice, &[&points], 1).unwrap_err();
    assert_eq!(error, CollapseError::Degenerate { triangle: 1 });
    let solid = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];
    let error = collapse(&solid, &[&points], 2).unwrap_err();
    assert_eq!(error, CollapseError::Stuck { triangles: 4 });
    let (triangles, points) = sheet(6);
    assert!(matches!(
        collapse(&triangles, &[&points], 0),
        Err(CollapseError::Stuck { triangles: 1.. })
    ));
}

#[test]
fn where_fans_meet_the_vertex_stays() {
    // two sheets that share one corner
    let (one, points) = sheet(4);
    let shift = |[a, b, c]: &[u32; 3]| [a, b, c].map(|&v| if v == 0 { 0 } else { v + 24 });
    let both: Vec<[u32; 3]> = one.iter().copied().chain(one.iter().map(shift)).collect();
    let mirrored = points[3..].iter().map(|x| -x);
    let points: Vec<f64> = points.iter().copied().chain(mirrored).collect();
    let found = collapse(&both, &[&points], 12).unwrap();
    assert!(found.vertices.contains(&0));
}
