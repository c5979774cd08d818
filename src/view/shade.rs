//! The colour of each covered pixel: a headlight over the shoulder, ambient light, wires.

use super::Surface;
use super::camera::Eye;
use super::raster::{Raster, Sample};
use crate::image::{Image, blend};
use crate::mesh::unit_vector as unit;

/// Lines along the triangles' edges.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wire {
    /// Their colour.
    pub colour: [u8; 3],
    /// Their width in pixels.
    pub width: f32,
}

/// How a surface looks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Style {
    /// Where nothing is drawn; alpha 0 for a picture to be laid over another.
    pub background: [u8; 4],
    /// The outside.
    pub front: [u8; 3],
    /// The inside, seen through holes and behind open sheets.
    pub back: [u8; 3],
    /// Share of the light that comes from everywhere, in \[0, 1\]: 1 gives a flat silhouette.
    pub ambient: f32,
    /// Opacity of the whole surface, in \[0, 1\].
    pub opacity: f32,
    /// Lines along the edges, if any.
    pub wire: Option<Wire>,
}

impl Style {
    /// For a dark terminal.
    pub const DARK: Style = Style {
        background: [18, 20, 24, 255],
        front: [205, 210, 220],
        back: [150, 120, 95],
        ambient: 0.15,
        opacity: 1.0,
        wire: None,
    };

    /// For a light terminal and for paper.
    pub const LIGHT: Style = Style {
        background: [255, 255, 255, 255],
        front: [150, 170, 200],
        back: [205, 175, 140],
        ambient: 0.25,
        ..Style::DARK
    };
}

/// Colours the covered pixels of `image`.
pub(super) fn resolve(
    surface: Surface<'_>,
    normals: &[[f32; 3]],
    raster: &Raster,
    eye: &Eye,
    style: &Style,
    image: &mut Image,
) {
    let light = Light::of(eye, style.ambient);
    let width = image.width.max(1);
    let (pixels, _) = image.rgba.as_chunks_mut::<4>();
    for (y, (row, covers)) in pixels
        .chunks_exact_mut(width)
        .zip(raster.rows())
        .enumerate()
    {
        for (x, (pixel, &triangle)) in row.iter_mut().zip(covers).enumerate() {
            let Some(&corners) = surface.triangles.get(triangle as usize) else {
                continue;
            };
            let sample = raster.sample(corners, x, y);
            let normal = mix(corners, &sample, normals);
            let brightness = light.brightness(normal, sample.front);
            let base = base_colour(surface, style, corners, &sample);
            let mut colour = base.map(|value| (value * brightness).min(255.0));
            if let Some(wire) = &style.wire {
                colour = with_wire(colour, wire, raster.edge_distances(corners, x, y));
            }
            blend(pixel, colour, style.opacity);
        }
    }
}

/// A lamp above the viewer's left shoulder, so that round things look round.
struct Light {
    towards: [f32; 3],
    ambient: f32,
}

impl Light {
    fn of(eye: &Eye, ambient: f32) -> Self {
        let [right, up, near] = eye.axes;
        Light {
            towards: unit(std::array::from_fn(|i| {
                near[i] + 0.45 * up[i] - 0.35 * right[i]
            })),
            ambient,
        }
    }

    /// 1 where the surface faces the lamp.
    fn brightness(&self, normal: [f32; 3], front: bool) -> f32 {
        let [x, y, z] = normal;
        let square = x * x + y * y + z * z;
        let along = x * self.towards[0] + y * self.towards[1] + z * self.towards[2];
        let cosine = along / square.max(1e-12).sqrt();
        let lit = if front { cosine } else { -cosine }.max(0.0);
        self.ambient + (1.0 - self.ambient) * lit
    }
}

fn mix(corners: [u32; 3], sample: &Sample, values: &[[f32; 3]]) -> [f32; 3] {
    let [a, b, c] = corners.map(|corner| values[corner as usize]);
    let [u, v, w] = sample.weights;
    std::array::from_fn(|i| u * a[i] + v * b[i] + w * c[i])
}

fn base_colour(
    surface: Surface<'_>,
    style: &Style,
    corners: [u32; 3],
    sample: &Sample,
) -> [f32; 3] {
    match surface.colours {
        Some(colours) => {
            let [a, b, c] = corners.map(|corner| colours[corner as usize].map(f32::from));
            let [u, v, w] = sample.weights;
            std::array::from_fn(|i| u * a[i] + v * b[i] + w * c[i])
        }
        None if sample.front => style.front.map(f32::from),
        None => style.back.map(f32::from),
    }
}

/// Lines fade where triangles are not much larger than the line, else all would be line.
fn with_wire(colour: [f32; 3], wire: &Wire, edges: [f32; 3]) -> [f32; 3] {
    let nearest = edges[0].min(edges[1]).min(edges[2]);
    let height = edges.iter().fold(0.0_f32, |most, &edge| most.max(edge)) + nearest;
    let room = (height / (3.0 * wire.width) - 0.3).clamp(0.0, 1.0);
    let cover = (0.5 * wire.width + 0.5 - nearest).clamp(0.0, 1.0) * room;
    std::array::from_fn(|i| colour[i] + cover * (f32::from(wire.colour[i]) - colour[i]))
}
