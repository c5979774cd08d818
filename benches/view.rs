//! The mesh panel: one shaded picture of 640 x 400 pixels with a renderer that is kept, on one core.
//! Goals: 85 K faces in 10 ms, 1 M faces in 50 ms.

use divan::Bencher;
use meshloom::image::Image;
use meshloom::mesh::Bounds;
use meshloom::view::{Camera, Renderer, Style, Surface};

/// A wavy ball of `rings` times twice `rings` quads.
fn ball(rings: u32) -> (Vec<[u32; 3]>, Vec<f32>) {
    let around = 2 * rings;
    let mut positions = Vec::new();
    for ring in 0..=rings {
        let polar = std::f64::consts::PI * f64::from(ring) / f64::from(rings);
        for step in 0..around {
            let turn = 2.0 * std::f64::consts::PI * f64::from(step) / f64::from(around);
            let radius = 1.0 + 0.1 * (9.0 * turn).sin() * (7.0 * polar).sin() * polar.sin();
            let (flat, height) = (radius * polar.sin(), radius * polar.cos());
            let point = [flat * turn.cos(), height, -flat * turn.sin()];
            positions.extend(point.map(|value| value as f32));
        }
    }
    let mut triangles = Vec::new();
    for ring in 0..rings {
        for step in 0..around {
            let (a, b) = (ring * around + step, ring * around + (step + 1) % around);
            triangles.extend([[a, a + around, b], [b, a + around, b + around]]);
        }
    }
    (triangles, positions)
}

#[divan::bench(args = [50, 146, 500])]
fn shade(bencher: Bencher<'_, '_>, rings: u32) {
    let (triangles, positions) = ball(rings);
    let surface = Surface {
        triangles: &triangles,
        positions: &positions,
        colours: None,
    };
    let camera = Camera::framing(&Bounds::of(&positions).expect("points"), 1.6);
    let (mut renderer, mut image) = (Renderer::default(), Image::new(640, 400));
    bencher.bench_local(|| renderer.render(surface, &camera, &Style::DARK, &mut image));
}

fn main() {
    divan::main();
}
