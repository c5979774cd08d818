//! The skin: flesh to a level set, level set to a mesh, mesh to bones.

use nalgebra::Vector3;

use crate::demo::implicit::{Field, Flesh, carve};
use crate::demo::skin::Skin;
use crate::demo::surface_nets::{Grid, polygonise};
use crate::mesh::Topology;
use crate::task::{Cancelled, Task};

use super::{Build, anatomy};

/// Side of the cubes that the skin is found with, in metres.
const fn step(build: Build) -> f64 {
    match build {
        Build::Light => 0.030,
        Build::Heavy => 0.036,
    }
}
/// Radius that thin limbs are thickened to while they are cut into faces, so that they get enough.
const THIN: f64 = 0.05;
/// Radius of fillets.
const BLEND: f64 = 0.022;

/// The mesh and what moves it.
#[derive(Debug)]
pub(super) struct Body {
    pub(super) topology: Topology,
    pub(super) skin: Skin,
}

/// Flesh above the ground: soles are flat.
struct Standing(Flesh);

impl Field for Standing {
    fn at(&self, point: Vector3<f64>) -> (f64, Vector3<f64>) {
        carve(self.0.at(point), (point.y, Vector3::y()), 0.008)
    }
}

impl Body {
    /// Cut thick, then drawn tight.
    pub(super) fn new(build: Build, task: &Task) -> Result<Self, Cancelled> {
        let flesh = Flesh {
            parts: anatomy::flesh(build),
            blend: BLEND,
        };
        let grid = Grid::uniform([-1.4, -0.15, -0.45], [1.65, 2.2, 0.45], step(build));
        let mut mesh = polygonise(&Standing(flesh.thickened(THIN)), &grid, task)?;
        mesh.relax(&Standing(flesh.clone()), 8, task)?;
        let neighbours = mesh.neighbours();
        let skin = Skin::attach(
            &mesh.points,
            &neighbours,
            &flesh,
            0.015,
            14,
            &anatomy::HOOVES,
            task,
        )?;
        let triangles = mesh.triangles();
        let topology = Topology::from_triangles(mesh.points.len(), &triangles);
        let topology = topology.expect("faces name their own points");
        Ok(Body { topology, skin })
    }
}
