//! The surface of a box of cubes.

/// How many cubes along x, y and z.
#[derive(Debug, Clone, Copy)]
pub(super) struct Lattice {
    pub(super) cells: [usize; 3],
}

impl Lattice {
    /// The lattice points on the surface, each as (i, j, k), in the order of their vertices.
    pub(super) fn surface_points(&self) -> Vec<[usize; 3]> {
        let [nx, ny, nz] = self.cells;
        let mut points = Vec::new();
        for i in 0..=nx {
            for j in 0..=ny {
                for k in 0..=nz {
                    if self.on_surface([i, j, k]) {
                        points.push([i, j, k]);
                    }
                }
            }
        }
        points
    }

    /// The quads of the surface, counter-clockwise seen from outside.
    pub(super) fn surface_quads(&self) -> Vec<[u32; 4]> {
        let names = self.names();
        let mut quads = Vec::new();
        for axis in 0..3 {
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            for side in [0, self.cells[axis]] {
                for a in 0..self.cells[u] {
                    for b in 0..self.cells[v] {
                        let corner = |da: usize, db: usize| {
                            let mut point = [0; 3];
                            (point[axis], point[u], point[v]) = (side, a + da, b + db);
                            names[self.index(point)]
                        };
                        let mut quad = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
                        if side == 0 {
                            quad.reverse();
                        }
                        quads.push(quad);
                    }
                }
            }
        }
        quads
    }

    fn on_surface(&self, point: [usize; 3]) -> bool {
        (0..3).any(|i| point[i] == 0 || point[i] == self.cells[i])
    }

    fn index(&self, [i, j, k]: [usize; 3]) -> usize {
        (i * (self.cells[1] + 1) + j) * (self.cells[2] + 1) + k
    }

    /// For each lattice point the vertex it is, where it lies on the surface.
    fn names(&self) -> Vec<u32> {
        let [nx, ny, nz] = self.cells;
        let mut names = vec![u32::MAX; (nx + 1) * (ny + 1) * (nz + 1)];
        for (name, point) in self.surface_points().into_iter().enumerate() {
            names[self.index(point)] = name as u32;
        }
        names
    }
}
