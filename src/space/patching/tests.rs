//! A coarse mesh goes the way of the fine one.

use std::sync::Arc;

use super::growing::nearest_whole;
use super::members::{largest_shares, listed};
use super::*;
use crate::mesh::collapse::collapse;
use crate::mesh::rigid_align::rigid;
use crate::mesh::{Topology, VertexCorners};
use crate::space::{Fine, Spaces};

const RINGS: usize = 60;
const AROUND: usize = 16;

fn tube() -> (Arc<Topology>, Vec<f64>) {
    let at = |i: usize, j: usize| (i * AROUND + j % AROUND) as u32;
    let (mut points, mut triangles) = (Vec::new(), Vec::new());
    for i in 0..RINGS {
        for j in 0..AROUND {
            let turn = std::f64::consts::TAU * j as f64 / AROUND as f64;
            let (sine, cosine) = libm::sincos(turn);
            points.extend([0.1 * i as f64, 0.4 * cosine, 0.4 * sine]);
            if i > 0 {
                let [a, b] = [at(i - 1, j), at(i - 1, j + 1)];
                let [c, d] = [at(i, j + 1), at(i, j)];
                triangles.extend([[a, b, c], [a, c, d]]);
            }
        }
    }
    let topology = Topology::from_triangles(RINGS * AROUND, &triangles).unwrap();
    (Arc::new(topology), points)
}

/// The tube rolled up about z, by `bend` in all.
fn rolled(points: &[f64], bend: f64) -> Vec<f64> {
    let radius = 0.1 * RINGS as f64 / bend;
    let roll = |p: &[f64]| {
        let (sine, cosine) = libm::sincos(p[0] / radius);
        [
            (radius - p[1]) * sine,
            radius - (radius - p[1]) * cosine,
            p[2],
        ]
    };
    points.chunks_exact(3).flat_map(roll).collect()
}

#[test]
fn a_coarse_mesh_goes_the_way_of_the_mesh_that_it_stands_for() {
    let (topology, points) = tube();
    let poses = [rolled(&points, 0.5), rolled(&points, 4.0)];
    let poses: [&[f64]; 2] = [&poses[0], &poses[1]];
    let found = collapse(topology.triangles(), &poses, 160).unwrap();
    let pick = |pose: &[f64]| -> Vec<f64> {
        let place = |&v: &u32| pose[3 * v as usize..3 * v as usize + 3].to_vec();
        found.vertices.iter().flat_map(place).collect()
    };
    let few = Topology::from_triangles(found.vertices.len(), &found.triangles).unwrap();
    // any triangle at what absorbed the first corner stands for a triangle
    let corners = VertexCorners::new(few.vertices(), few.triangles());
    let carrier =
        |triangle: &[u32; 3]| corners.at(found.absorber[triangle[0] as usize] as usize)[0] / 3;
    let carriers: Vec<u32> = topology.triangles().iter().map(carrier).collect();
    let fine = Fine {
        topology: &topology,
        poses: &poses,
        weights: &[],
        carriers: &carriers,
    };
    let coarse = Spaces::new(Arc::new(few), &pick(poses[0]));
    let coarse = coarse.open_coarse(&fine, &[]).unwrap();
    let own = Spaces::new(Arc::clone(&topology), poses[0])
        .open("patch-lri", &poses)
        .unwrap();
    let rows = |dimension: usize, encode: &dyn Fn(&[f64], &mut [f64])| {
        poses.map(|pose| {
            let mut row = vec![0.0; dimension];
            encode(pose, &mut row);
            row
        })
    };
    let few = rows(coarse.space().dimension(), &|pose, row| {
        coarse.encode(pose, &pick(pose), row);
    });
    let all = rows(own.dimension(), &|pose, row| own.encode(pose, row));
    for share in [0.0, 0.25, 0.5, 1.0, 1.3] {
        let between = |[from, to]: &[Vec<f64>; 2]| -> Vec<f64> {
            let pairs = from.iter().zip(to);
            pairs.map(|(a, b)| a + share * (b - a)).collect()
        };
        let mut ghost = vec![0.0; 3 * found.vertices.len()];
        coarse.space().decode(&between(&few), &mut ghost);
        let mut whole = vec![0.0; points.len()];
        own.decode(&between(&all), &mut whole);
        let expected = pick(&whole);
        let near = rigid(&ghost, &expected);
        let far = ghost.chunks_exact(3).zip(expected.chunks_exact(3));
        let far = far.map(|(a, b)| {
            let a = near * nalgebra::Point3::from_slice(a);
            (a - nalgebra::Point3::from_slice(b)).norm()
        });
        let far = far.fold(0.0, f64::max);
        // of a length of 6: keys to rounding, between them what 12 triangles for one can tell
        let bound = if share == 0.0 || share == 1.0 {
            1e-9
        } else {
            0.06
        };
        assert!(far < bound, "{share}: {far}");
    }
}

#[test]
fn triangles_that_stand_for_nothing_and_torn_ones_are_like_their_neighbours() {
    let triangles = [[0, 1, 2], [1, 3, 2], [2, 3, 4], [3, 5, 4]];
    let hinges = Hinges::new(6, &triangles, &VertexCorners::new(6, &triangles));
    assert_eq!(nearest_whole(&[1.0, 0.1, 0.1, 1.0], &hinges), [0, 0, 3, 3]);
    assert_eq!(nearest_whole(&[0.5; 4], &hinges), [0, 1, 2, 3]);
    let members = listed(2, vec![(0, 0, 1.0), (0, 2, 0.2), (1, 2, 0.3)]);
    assert_eq!(largest_shares(&members, 4, &hinges), [0, 0, 1, 1]);
}

#[test]
fn what_is_torn_holds_its_sides_together_on_straight_ways() {
    // Two plates side by side along x that do not turn; of the row between them every triangle is torn.
    const LONG: u32 = 12;
    let (at, wide) = (|i: u32, j: u32| i * (LONG + 1) + j, 9_u32);
    let cells = (0..wide).flat_map(|i| (0..LONG).map(move |j| (i, j)));
    let triangles: Vec<[u32; 3]> = cells
        .flat_map(|(i, j)| {
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            [[a, b, c], [a, c, d]]
        })
        .collect();
    // the upper plate lies across a narrow gap, then on the far side of the lower one and a little off
    let shape = |shift: [f64; 3]| -> Vec<f64> {
        let points = (0..=wide).flat_map(|i| (0..=LONG).map(move |j| (i, j)));
        points
            .flat_map(|(i, j)| {
                let plate = if 2 * i > wide { 1.0 } else { 0.0 };
                let y = f64::from(i) - plate;
                [
                    f64::from(j) + plate * shift[0],
                    y + plate * shift[1],
                    plate * shift[2],
                ]
            })
            .collect()
    };
    let (near, far) = (shape([0.0, 0.05, 0.0]), shape([3.0, -12.0, 0.5]));
    let weights = crate::mesh::torn(&triangles, &[&near, &far]);
    let torn = |face: &usize| weights[*face] < 1.0;
    let row = 2 * (LONG * (wide / 2)) as usize..2 * (LONG * (wide / 2 + 1)) as usize;
    assert!((0..triangles.len()).filter(torn).eq(row));
    let topology = Topology::from_triangles(near.len() / 3, &triangles).unwrap();
    let spaces = Spaces::new(Arc::new(topology), &near);
    let space = spaces.open_weighted(&[&near, &far], &weights).unwrap();
    let (mut from, mut to) = (vec![0.0; space.dimension()], vec![0.0; space.dimension()]);
    space.encode(&near, &mut from);
    space.encode(&far, &mut to);
    space.follow(&from, &mut to);
    for share in [0.0, 0.3, 0.5, 1.0] {
        let blended: Vec<f64> = from
            .iter()
            .zip(&to)
            .map(|(a, b)| a + share * (b - a))
            .collect();
        let mut found = vec![0.0; near.len()];
        space.decode(&blended, &mut found);
        // torn triangles have a small say in how patches turn
        for ((found, a), b) in found.iter().zip(&near).zip(&far) {
            assert!((found - (a + share * (b - a))).abs() < 1e-3, "{share}");
        }
    }
}
