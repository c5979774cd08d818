//! An adaptive grid over pose space: squares in which g is nearly flat, so that the pose in the middle of
//! each stands for all of it. Where g bends, squares are smaller.

use super::pose::PoseSignal;
use crate::math::b_spline::Point;

/// A square of the map.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Square {
    /// Its middle.
    pub middle: Point,
    /// Its side, in layout units.
    pub side: f64,
}

/// What a grid is to be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Grid {
    /// Ranges of x and y to be covered.
    pub window: [[f64; 2]; 2],
    /// Side of the largest squares, in layout units; above 0. Squares lie at multiples of it, so that
    /// windows that overlap share them.
    pub side: f64,
    /// How often a square may be quartered.
    pub depth: u32,
    /// A square is quartered where a second difference of g over it is larger, in units of the shape
    /// space.
    pub bend: f64,
}

/// No window is covered by more of the largest squares.
const MOST: f64 = 4096.0;

/// Squares that cover the window without overlap, from the lower left row by row. Where g is affine all
/// have the largest side. None for a window that is empty or not finite, or that so many squares would not
/// cover.
pub fn pose_grid(pose: &PoseSignal, grid: &Grid) -> Vec<Square> {
    let ranges = grid.window.map(|[low, high]| {
        let (first, last) = ((low / grid.side).floor(), (high / grid.side).ceil());
        (first, last - first)
    });
    let [(left, across), (bottom, up)] = ranges;
    let countable = across > 0.0 && up > 0.0 && across * up <= MOST;
    if !(countable && left.is_finite() && bottom.is_finite()) {
        return Vec::new();
    }
    let mut probe = Probe::new(pose);
    let mut squares = Vec::new();
    for row in 0..up as usize {
        for column in 0..across as usize {
            let middle = [left + column as f64 + 0.5, bottom + row as f64 + 0.5];
            let whole = Square {
                middle: middle.map(|at| at * grid.side),
                side: grid.side,
            };
            probe.divide(whole, grid.depth, grid, &mut squares);
        }
    }
    squares
}

/// Evaluates g with buffers that are kept.
struct Probe<'a> {
    pose: &'a PoseSignal,
    sum: Vec<f64>,
    value: Vec<f64>,
}

impl<'a> Probe<'a> {
    fn new(pose: &'a PoseSignal) -> Self {
        Probe {
            pose,
            sum: vec![0.0; pose.modes()],
            value: vec![0.0; pose.modes()],
        }
    }

    /// The square, or its quarters where g bends over it.
    fn divide(&mut self, square: Square, depth: u32, grid: &Grid, squares: &mut Vec<Square>) {
        if depth == 0 || self.bend(&square) <= grid.bend {
            let [x, y] = grid.window;
            let half = 0.5 * square.side;
            let meets = |at: f64, range: [f64; 2]| at + half > range[0] && at - half < range[1];
            if meets(square.middle[0], x) && meets(square.middle[1], y) {
                squares.push(square);
            }
            return;
        }
        let quarter = 0.25 * square.side;
        for (dx, dy) in [
            (-quarter, -quarter),
            (quarter, -quarter),
            (-quarter, quarter),
            (quarter, quarter),
        ] {
            let part = Square {
                middle: [square.middle[0] + dx, square.middle[1] + dy],
                side: 0.5 * square.side,
            };
            self.divide(part, depth - 1, grid, squares);
        }
    }

    /// The largest norm of the second differences of g over a square: along both axes and both diagonals,
    /// from edge or corner to middle to edge or corner.
    fn bend(&mut self, square: &Square) -> f64 {
        let half = 0.5 * square.side;
        let ways = [[half, 0.0], [0.0, half], [half, half], [half, -half]];
        let differences = ways.map(|way| self.second_difference(square.middle, way));
        differences.into_iter().fold(0.0, f64::max)
    }

    /// ||g(p + way) - 2 g(p) + g(p - way)||
    fn second_difference(&mut self, p: Point, way: Point) -> f64 {
        self.sum.fill(0.0);
        for (weight, step) in [(1.0, 1.0), (-2.0, 0.0), (1.0, -1.0)] {
            let at = [p[0] + step * way[0], p[1] + step * way[1]];
            self.pose.evaluate(at, &mut self.value);
            for (sum, value) in self.sum.iter_mut().zip(&self.value) {
                *sum += weight * value;
            }
        }
        self.sum.iter().map(|x| x * x).sum::<f64>().sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::thin_plate::Rows;

    /// g through `value` at the points of an 11 x 11 lattice over [-1, 1]^2.
    fn signal(value: impl Fn(Point) -> [f64; 2]) -> PoseSignal {
        let places = (0..121).map(|i| [f64::from(i % 11), f64::from(i / 11)]);
        let positions: Vec<Point> = places.map(|p| p.map(|at| at / 5.0 - 1.0)).collect();
        let targets: Vec<f64> = positions.iter().flat_map(|&p| value(p)).collect();
        let rows = Rows {
            positions: &positions,
            targets: &targets,
            width: 2,
            weights: None,
        };
        PoseSignal::fit(&rows, 121).unwrap().signal
    }

    const GRID: Grid = Grid {
        window: [[-1.0, 1.0], [-1.0, 0.9]],
        side: 0.5,
        depth: 3,
        bend: 1e-6,
    };

    #[test]
    fn a_flat_map_gives_the_coarse_grid() {
        let flat = signal(|[x, y]| [3.0 * x - y + 1.0, 0.5 * y]);
        let squares = pose_grid(&flat, &GRID);
        assert_eq!(squares.len(), 16);
        assert!(squares.iter().all(|square| square.side == 0.5));
    }

    #[test]
    fn squares_are_small_where_the_map_bends_and_cover_it_once() {
        // A kink along x = 0.1.
        let bent = signal(|[x, y]| [(x - 0.1).abs(), y]);
        let grid = Grid { bend: 0.05, ..GRID };
        let squares = pose_grid(&bent, &grid);
        let at_kink = |square: &&Square| (square.middle[0] - 0.1).abs() < 0.5 * square.side;
        let side = |squares: &mut dyn Iterator<Item = &Square>| {
            squares.map(|square| square.side).fold(0.0, f64::max)
        };
        assert!(side(&mut squares.iter().filter(at_kink)) < 0.5);
        assert_eq!(side(&mut squares.iter()), 0.5);
        let area: f64 = squares.iter().map(|square| square.side * square.side).sum();
        // The topmost quarters that lie outside the window are left out.
        assert!((3.8..=4.0).contains(&area), "{area}");
        for (i, a) in squares.iter().enumerate() {
            let apart = |b: &Square| {
                let reach = 0.5 * (a.side + b.side) - 1e-12;
                (0..2).any(|axis| (a.middle[axis] - b.middle[axis]).abs() >= reach)
            };
            assert!(squares[..i].iter().all(apart));
        }
    }

    #[test]
    fn windows_that_overlap_share_their_squares() {
        let bent = signal(|[x, y]| [x * x, y * x]);
        let grid = Grid { bend: 0.02, ..GRID };
        let moved = Grid {
            window: [[-0.3, 1.0], [-1.0, 0.9]],
            ..grid
        };
        let all = pose_grid(&bent, &grid);
        let part = pose_grid(&bent, &moved);
        assert!(part.len() < all.len() && part.iter().all(|square| all.contains(square)));
    }

    #[test]
    fn a_window_that_is_none_has_no_squares() {
        let flat = signal(|[x, y]| [x, y]);
        for (window, side) in [
            ([[0.0, f64::NAN], [0.0, 1.0]], 0.5),
            ([[1.0, 0.0], [0.0, 1.0]], 0.5),
            ([[0.0, f64::INFINITY], [0.0, 1.0]], 0.5),
            ([[0.0, 1.0], [0.0, 1.0]], 1e-9),
            ([[0.0, 1.0], [0.0, 1.0]], 0.0),
        ] {
            let grid = Grid {
                window,
                side,
                ..GRID
            };
            assert!(pose_grid(&flat, &grid).is_empty(), "{window:?} {side}");
        }
    }
}
