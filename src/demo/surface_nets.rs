//! Level sets to quads: surface nets (Gibson 1998), then relaxed on the level set.
//!
//! Every cell of the grid that the surface crosses gets a vertex at the mean of the crossings of its
//! edges; every edge of the grid that it crosses gets the quad of the four cells around. Where the
//! body stays inside the grid the result is closed. Where two sheets would meet in a cell the body is
//! filled by a grid point first, so that the result is a manifold.

use nalgebra::Vector3;

use super::implicit::Field;
use crate::task::{Cancelled, Task};

/// The planes of a grid along x, y and z, ascending.
#[derive(Debug, Clone)]
pub(super) struct Grid {
    pub(super) planes: [Vec<f64>; 3],
}

/// Points and quads, counter-clockwise seen from outside.
#[derive(Debug, Clone, Default)]
pub(super) struct QuadMesh {
    pub(super) points: Vec<Vector3<f64>>,
    pub(super) quads: Vec<[u32; 4]>,
}

impl Grid {
    /// Equal cubes of side `step` that cover a box; symmetric about the middle of the box.
    pub(super) fn uniform(min: [f64; 3], max: [f64; 3], step: f64) -> Self {
        let planes = std::array::from_fn(|i| {
            let half = libm::ceil(0.5 * (max[i] - min[i]) / step) as i64;
            let middle = 0.5 * (min[i] + max[i]);
            (-half..=half)
                .map(|plane| middle + plane as f64 * step)
                .collect()
        });
        Grid { planes }
    }

    fn size(&self) -> [usize; 3] {
        std::array::from_fn(|i| self.planes[i].len())
    }

    fn index(&self, [i, j, k]: [usize; 3]) -> usize {
        let [_, ny, nz] = self.size();
        (i * ny + j) * nz + k
    }

    /// Index of the corner (bits x, y, z) of a cell.
    fn corner(&self, cell: [usize; 3], corner: usize) -> usize {
        self.index(std::array::from_fn(|i| cell[i] + (corner >> i & 1)))
    }

    fn point(&self, [i, j, k]: [usize; 3]) -> Vector3<f64> {
        Vector3::new(self.planes[0][i], self.planes[1][j], self.planes[2][k])
    }
}

/// The surface of `field` as quads.
pub(super) fn polygonise(
    field: &dyn Field,
    grid: &Grid,
    task: &Task,
) -> Result<QuadMesh, Cancelled> {
    let mut values = sample(field, grid, task)?;
    fill_pinches(grid, &mut values);
    let mut mesh = QuadMesh::default();
    let mut names = vec![u32::MAX; values.len()];
    let size = grid.size();
    for cell in nodes(size).filter(|cell| (0..3).all(|i| cell[i] + 1 < size[i])) {
        if let Some(point) = cell_point(grid, &values, cell) {
            names[grid.index(cell)] = mesh.points.len() as u32;
            mesh.points.push(point);
        }
    }
    for node in nodes(size) {
        for axis in 0..3 {
            mesh.quads
                .extend(edge_quad(grid, &values, &names, node, axis));
        }
    }
    Ok(mesh)
}

/// Side of the blocks of grid points that are tried as a whole, in grid points.
const BLOCK: usize = 6;

/// The field at all grid points. Blocks that the surface cannot reach get the value of their middle,
/// whose sign is right: the fields here fall and rise by at most 2 a unit of length.
fn sample(field: &dyn Field, grid: &Grid, task: &Task) -> Result<Vec<f64>, Cancelled> {
    let size = grid.size();
    let mut values = vec![0.0; size[0] * size[1] * size[2]];
    let blocks = size.map(|count| count.div_ceil(BLOCK));
    for block in nodes(blocks) {
        task.check()?;
        let first = block.map(|index| index * BLOCK);
        let last: [usize; 3] = std::array::from_fn(|i| (first[i] + BLOCK).min(size[i]) - 1);
        let (low, high) = (grid.point(first), grid.point(last));
        let middle = field.at((low + high) * 0.5).0;
        let far = middle.abs() > (high - low).norm();
        for node in nodes(std::array::from_fn(|i| last[i] - first[i] + 1)) {
            let node = std::array::from_fn(|i| first[i] + node[i]);
            values[grid.index(node)] = if far {
                middle
            } else {
                field.at(grid.point(node)).0
            };
        }
    }
    Ok(values)
}

/// All index triples below `size`, the first slowest.
fn nodes([nx, ny, nz]: [usize; 3]) -> impl Iterator<Item = [usize; 3]> {
    (0..nx).flat_map(move |i| (0..ny).flat_map(move |j| (0..nz).map(move |k| [i, j, k])))
}

/// Adds grid points to the body until no square of the grid has exactly two opposite corners inside,
/// and no cube exactly two opposite corners inside or outside: then every cell is crossed by one sheet
/// and every square by one edge of the dual mesh. Ends because the body only grows.
fn fill_pinches(grid: &Grid, values: &mut [f64]) {
    let cells = grid.size().map(|count| count - 1);
    let mut changed = true;
    while changed {
        changed = false;
        for cell in nodes(cells) {
            while let Some(corner) = pinch(|corner| values[grid.corner(cell, corner)]) {
                values[grid.corner(cell, corner)] = -1e-9;
                changed = true;
            }
        }
    }
}

/// The corner of a cube (bits x, y, z) that is best added to the body, if the cube is pinched: of the
/// corners outside that would help the one nearest to the body.
fn pinch(value: impl Fn(usize) -> f64) -> Option<usize> {
    let inside = |corner: usize| value(corner) < 0.0;
    let nearest = |corners: &[usize]| {
        let outside = corners.iter().copied().filter(|&corner| !inside(corner));
        outside.min_by(|&a, &b| value(a).total_cmp(&value(b)))
    };
    for axis in 0..3 {
        let (u, v) = (1 << ((axis + 1) % 3), 1 << ((axis + 2) % 3));
        for base in [0, 1 << axis] {
            let square = [base, base | u, base | u | v, base | v];
            let [a, b, c, d] = square.map(inside);
            if a == c && b == d && a != b {
                return nearest(&square);
            }
        }
    }
    let count = (0..8).filter(|&corner| inside(corner)).count();
    let opposite =
        (0..4).any(|corner| inside(corner) == inside(7 - corner) && inside(corner) == (count == 2));
    let all = [0, 1, 2, 3, 4, 5, 6, 7];
    if (count == 2 || count == 6) && opposite {
        nearest(&all)
    } else {
        None
    }
}

/// The mean of the crossings of a cell's twelve edges; None where there are none.
fn cell_point(grid: &Grid, values: &[f64], cell: [usize; 3]) -> Option<Vector3<f64>> {
    let (mut sum, mut count) = (Vector3::zeros(), 0);
    for axis in 0..3 {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        for (du, dv) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
            let mut from = cell;
            from[u] += du;
            from[v] += dv;
            let mut to = from;
            to[axis] += 1;
            let (a, b) = (values[grid.index(from)], values[grid.index(to)]);
            if (a < 0.0) != (b < 0.0) {
                sum += grid.point(from).lerp(&grid.point(to), a / (a - b));
                count += 1;
            }
        }
    }
    (count > 0).then(|| sum / f64::from(count))
}

/// The quad across the grid edge from `node` along `axis`, where the surface crosses it.
fn edge_quad(
    grid: &Grid,
    values: &[f64],
    names: &[u32],
    node: [usize; 3],
    axis: usize,
) -> Option<[u32; 4]> {
    let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
    let size = grid.size();
    let mut next = node;
    next[axis] += 1;
    if next[axis] >= size[axis] || node[u] == 0 || node[v] == 0 {
        return None;
    }
    let (a, b) = (values[grid.index(node)], values[grid.index(next)]);
    if (a < 0.0) == (b < 0.0) {
        return None;
    }
    let cell = |du: usize, dv: usize| {
        let mut cell = node;
        cell[u] -= du;
        cell[v] -= dv;
        names[grid.index(cell)]
    };
    let mut quad = [cell(1, 1), cell(0, 1), cell(0, 0), cell(1, 0)];
    if b < 0.0 {
        quad.reverse();
    }
    Some(quad)
}

impl QuadMesh {
    /// For every vertex the vertices it shares an edge with, ascending.
    pub(super) fn neighbours(&self) -> Vec<Vec<u32>> {
        let mut neighbours = vec![Vec::new(); self.points.len()];
        for quad in &self.quads {
            for i in 0..4 {
                neighbours[quad[i] as usize].push(quad[(i + 1) % 4]);
                neighbours[quad[(i + 1) % 4] as usize].push(quad[i]);
            }
        }
        for list in &mut neighbours {
            list.sort_unstable();
            list.dedup();
        }
        neighbours
    }

    /// Evens the mesh out on the level set of `field`: `rounds` times each vertex goes half the way
    /// to the mean of its neighbours and then down the gradient to the surface.
    pub(super) fn relax(
        &mut self,
        field: &dyn Field,
        rounds: usize,
        task: &Task,
    ) -> Result<(), Cancelled> {
        let neighbours = self.neighbours();
        for _ in 0..rounds {
            let old = self.points.clone();
            task.check()?;
            for (point, around) in self.points.iter_mut().zip(&neighbours) {
                let sum: Vector3<f64> = around.iter().map(|&other| old[other as usize]).sum();
                let moved = point.lerp(&(sum / around.len() as f64), 0.5);
                *point = drop_to_surface(field, moved, 2);
            }
        }
        Ok(())
    }

    /// Each quad cut along its shorter diagonal.
    pub(super) fn triangles(&self) -> Vec<[u32; 3]> {
        let cut = |&[a, b, c, d]: &[u32; 4]| {
            let at = |vertex: u32| self.points[vertex as usize];
            if (at(a) - at(c)).norm_squared() <= (at(b) - at(d)).norm_squared() {
                [[a, b, c], [a, c, d]]
            } else {
                [[a, b, d], [b, c, d]]
            }
        };
        self.quads.iter().flat_map(cut).collect()
    }
}

/// Newton steps along the gradient, each at most 0.05 long.
fn drop_to_surface(field: &dyn Field, start: Vector3<f64>, steps: usize) -> Vector3<f64> {
    (0..steps).fold(start, |point, _| {
        let (value, gradient) = field.at(point);
        let step = gradient * (value / gradient.norm_squared().max(1e-6));
        let length = step.norm();
        point
            - if length > 0.05 {
                step * (0.05 / length)
            } else {
                step
            }
    })
}
