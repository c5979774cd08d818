//! A mesh and a camera to pixels, on the CPU. Pure: no files, no threads, the same bytes everywhere.
//!
//! A [`Renderer`] projects the vertices, finds for every pixel the nearest triangle (`raster`), then
//! colours each pixel once (`shade`): smooth normals under a headlight, wires from the distance to
//! the triangle's edges. It owns its buffers, so that a repeated picture allocates nothing.

mod camera;
mod heat;
mod raster;
mod shade;

pub use camera::{Camera, Projection, Up};
pub use heat::heat_colours;
pub use shade::{Style, Wire};

use crate::image::Image;
use crate::mesh::vertex_normals;
use raster::Raster;

/// What is drawn: triangles over positions, both as [`Topology`](crate::mesh::Topology) and
/// [`Sequence`](crate::mesh::Sequence) hold them.
#[derive(Debug, Clone, Copy)]
pub struct Surface<'a> {
    /// Corners, counter-clockwise seen from outside.
    pub triangles: &'a [[u32; 3]],
    /// 3V coordinates, x y z interleaved.
    pub positions: &'a [f32],
    /// V colours that replace [`Style::front`] and [`Style::back`].
    pub colours: Option<&'a [[u8; 3]]>,
}

/// What lies under a pixel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hit {
    /// The triangle, from 0.
    pub triangle: usize,
    /// Weights of its three corners at the centre of the pixel; they sum to 1.
    pub weights: [f32; 3],
    /// The corner with the largest weight, a vertex from 0.
    pub vertex: u32,
    /// Distance from the camera along the line of sight's axis, in the mesh's units. Orthographic
    /// cameras count from the plane through the target (negative in front of it).
    pub depth: f32,
}

/// Draws surfaces; keeps its buffers between pictures.
#[derive(Debug, Default)]
pub struct Renderer {
    normals: Vec<[f32; 3]>,
    raster: Raster,
}

impl Renderer {
    /// Fills `image` with the background of `style` and draws `surface` on it.
    ///
    /// # Panics
    /// A triangle names a vertex that has no position or no colour.
    pub fn render(
        &mut self,
        surface: Surface<'_>,
        camera: &Camera,
        style: &Style,
        image: &mut Image,
    ) {
        image.fill(style.background);
        self.overlay(surface, camera, style, image);
    }

    /// Draws `surface` over what `image` shows, with the opacity of `style`: an onion skin is the
    /// neighbouring frames drawn so, faint ones first, and the present frame last. Hidden surfaces
    /// are removed within `surface` only.
    ///
    /// Vertices that are not finite, behind a perspective camera or 60 000 pixels off take their
    /// triangles with them.
    ///
    /// # Panics
    /// As [`Renderer::render`].
    pub fn overlay(
        &mut self,
        surface: Surface<'_>,
        camera: &Camera,
        style: &Style,
        image: &mut Image,
    ) {
        let eye = camera.eye(image.width, image.height);
        vertex_normals(surface.triangles, surface.positions, &mut self.normals);
        self.raster.draw(surface, &eye, image.width, image.height);
        shade::resolve(surface, &self.normals, &self.raster, &eye, style, image);
    }

    /// What the surface drawn last, which has these triangles, shows at pixel (`x`, `y`), counted from
    /// the upper left. None where it shows nothing.
    pub fn pick(&self, triangles: &[[u32; 3]], x: usize, y: usize) -> Option<Hit> {
        let triangle = self.raster.triangle_at(x, y)?;
        let corners = *triangles.get(triangle)?;
        let sample = self.raster.sample(corners, x, y);
        let best = (1..3).fold(0, |best, i| {
            if sample.weights[i] > sample.weights[best] {
                i
            } else {
                best
            }
        });
        Some(Hit {
            triangle,
            weights: sample.weights,
            vertex: corners[best],
            depth: self.raster.depth_at(x, y),
        })
    }
}

/// One picture with buffers of its own; whoever draws many keeps a [`Renderer`].
///
/// # Panics
/// As [`Renderer::render`].
pub fn render(surface: Surface<'_>, camera: &Camera, style: &Style, image: &mut Image) {
    Renderer::default().render(surface, camera, style, image);
}

#[cfg(test)]
mod tests;
