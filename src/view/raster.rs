//! Which triangle is nearest at the centre of each pixel.
//!
//! Corners are rounded to 1/16 pixel, so that the edge functions (twice the signed area of an edge and
//! the pixel) are exact integers: neighbouring triangles leave no gap between them. A pixel on a
//! shared edge belongs to both; the nearer wins, and of equals the first.

use super::Surface;
use super::camera::Eye;

/// Steps of a pixel that corners are rounded to.
const STEPS: i32 = 16;
/// Corners farther from the picture's corner than this, in steps, are not drawn: products of two
/// stay far inside i64.
const FARTHEST: f32 = 1e6;
const NOTHING: u32 = u32::MAX;

/// A projected vertex: screen position in steps, and nearness (NaN: not drawn).
#[derive(Debug, Clone, Copy)]
struct Point {
    x: i32,
    y: i32,
    near: f32,
}

/// A triangle at a pixel.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sample {
    /// Weights of the corners on the surface; they sum to 1.
    pub(super) weights: [f32; 3],
    /// Whether the front is seen (corners counter-clockwise on the screen).
    pub(super) front: bool,
}

/// For each pixel the nearest triangle and its nearness.
#[derive(Debug, Default)]
pub(super) struct Raster {
    width: usize,
    height: usize,
    points: Vec<Point>,
    near: Vec<f32>,
    triangles: Vec<u32>,
    eye: Option<Eye>,
}

impl Raster {
    /// Draws all of `surface` into emptied buffers of that size.
    pub(super) fn draw(&mut self, surface: Surface<'_>, eye: &Eye, width: usize, height: usize) {
        (self.width, self.height, self.eye) = (width, height, Some(*eye));
        self.near.clear();
        self.near.resize(width * height, f32::NEG_INFINITY);
        self.triangles.clear();
        self.triangles.resize(width * height, NOTHING);
        let points = surface.positions.as_chunks::<3>().0;
        self.points.clear();
        self.points
            .extend(points.iter().map(|&point| place(eye, point)));
        for (index, &[a, b, c]) in surface.triangles.iter().enumerate() {
            let corners = [a, b, c].map(|corner| self.points[corner as usize]);
            self.triangle(index as u32, corners);
        }
    }

    /// The triangle that covers a pixel; None outside the picture too.
    pub(super) fn triangle_at(&self, x: usize, y: usize) -> Option<usize> {
        if x >= self.width || y >= self.height {
            return None;
        }
        let triangle = self.triangles[y * self.width + x];
        (triangle != NOTHING).then_some(triangle as usize)
    }

    /// The rows of triangles, `u32::MAX` where there is none.
    pub(super) fn rows(&self) -> impl Iterator<Item = &[u32]> {
        self.triangles.chunks_exact(self.width.max(1))
    }

    /// Distance of what a covered pixel shows.
    pub(super) fn depth_at(&self, x: usize, y: usize) -> f32 {
        let near = self.near[y * self.width + x];
        self.eye.map_or(near, |eye| eye.depth(near))
    }

    /// The triangle with these corners at pixel (`x`, `y`).
    pub(super) fn sample(&self, corners: [u32; 3], x: usize, y: usize) -> Sample {
        let [a, b, c] = self.seen_from(corners, x, y);
        let areas = [cross(b, c), cross(c, a), cross(a, b)];
        let total = areas[0] + areas[1] + areas[2];
        let mut weights = areas;
        if self.eye.is_some_and(|eye| eye.distance.is_some()) {
            for (weight, corner) in weights.iter_mut().zip(corners) {
                *weight *= self.points[corner as usize].near;
            }
        }
        let sum = weights[0] + weights[1] + weights[2];
        Sample {
            weights: weights.map(|weight| if sum == 0.0 { 1.0 / 3.0 } else { weight / sum }),
            // y runs down the screen, so counter-clockwise corners have negative area
            front: total < 0.0,
        }
    }

    /// Distances from the centre of pixel (`x`, `y`) to the three edges of the triangle with these
    /// corners, in pixels; edge i is opposite corner i.
    pub(super) fn edge_distances(&self, corners: [u32; 3], x: usize, y: usize) -> [f32; 3] {
        let [a, b, c] = self.seen_from(corners, x, y);
        [(b, c), (c, a), (a, b)].map(|(from, to)| {
            let (dx, dy) = (to[0] - from[0], to[1] - from[1]);
            cross(from, to).abs() / (dx * dx + dy * dy).sqrt().max(1.0) / STEPS as f32
        })
    }

    /// Corners in steps from the centre of a pixel.
    fn seen_from(&self, corners: [u32; 3], x: usize, y: usize) -> [[f32; 2]; 3] {
        let (px, py) = centre(x as i32, y as i32);
        corners.map(|corner| {
            let point = self.points[corner as usize];
            [(point.x - px) as f32, (point.y - py) as f32]
        })
    }

    fn triangle(&mut self, index: u32, [a, b, c]: [Point; 3]) {
        if !(a.near + b.near + c.near).is_finite() {
            return;
        }
        let columns = pixels(a.x.min(b.x).min(c.x), a.x.max(b.x).max(c.x), self.width);
        let rows = pixels(a.y.min(b.y).min(c.y), a.y.max(b.y).max(c.y), self.height);
        if columns.0 >= columns.1 || rows.0 >= rows.1 {
            return;
        }
        let area = edge(a, b, c.x, c.y);
        if area == 0 {
            return;
        }
        let (b, c) = if area < 0 { (c, b) } else { (b, c) };
        self.fill(index, [a, b, c], area.abs(), columns, rows);
    }

    /// Visits the pixels of a box; inside, all three edge functions are at least 0.
    fn fill(
        &mut self,
        index: u32,
        [a, b, c]: [Point; 3],
        area: i64,
        columns: (usize, usize),
        rows: (usize, usize),
    ) {
        let step = i64::from(STEPS);
        let (px, py) = centre(columns.0 as i32, rows.0 as i32);
        let mut row = [edge(b, c, px, py), edge(c, a, px, py), edge(a, b, px, py)];
        let right = [(b, c), (c, a), (a, b)].map(|(from, to)| step * i64::from(from.y - to.y));
        let down = [(b, c), (c, a), (a, b)].map(|(from, to)| step * i64::from(to.x - from.x));
        let (rise_b, rise_c) = (
            (b.near - a.near) / area as f32,
            (c.near - a.near) / area as f32,
        );
        for y in rows.0..rows.1 {
            let mut at = row;
            let line = y * self.width;
            for pixel in line + columns.0..line + columns.1 {
                if at[0] | at[1] | at[2] >= 0 {
                    let near = a.near + at[1] as f32 * rise_b + at[2] as f32 * rise_c;
                    if near > self.near[pixel] {
                        self.near[pixel] = near;
                        self.triangles[pixel] = index;
                    }
                }
                at = [at[0] + right[0], at[1] + right[1], at[2] + right[2]];
            }
            row = [row[0] + down[0], row[1] + down[1], row[2] + down[2]];
        }
    }
}

fn place(eye: &Eye, point: [f32; 3]) -> Point {
    let [x, y, near] = eye.project(point);
    let (x, y) = (x * STEPS as f32, y * STEPS as f32);
    let seen = x.abs() < FARTHEST && y.abs() < FARTHEST;
    Point {
        x: (x + FARTHEST + 0.5) as i32 - FARTHEST as i32,
        y: (y + FARTHEST + 0.5) as i32 - FARTHEST as i32,
        near: if seen { near } else { f32::NAN },
    }
}

/// The centre of a pixel in steps.
fn centre(x: i32, y: i32) -> (i32, i32) {
    (x * STEPS + STEPS / 2, y * STEPS + STEPS / 2)
}

/// Twice the signed area of `from`, `to` and (`x`, `y`).
fn edge(from: Point, to: Point, x: i32, y: i32) -> i64 {
    i64::from(to.x - from.x) * i64::from(y - from.y)
        - i64::from(to.y - from.y) * i64::from(x - from.x)
}

fn cross(a: [f32; 2], b: [f32; 2]) -> f32 {
    a[0] * b[1] - a[1] * b[0]
}

/// The half-open range of pixels in 0..`count` whose centres lie in \[`least`, `most`\] steps.
fn pixels(least: i32, most: i32, count: usize) -> (usize, usize) {
    let first = (least + STEPS / 2 - 1).div_euclid(STEPS).max(0);
    let end = ((most - STEPS / 2).div_euclid(STEPS) + 1).max(0);
    (first as usize, (end as usize).min(count))
}
