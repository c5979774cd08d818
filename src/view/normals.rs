//! Smooth normals: at each vertex the sum of its triangles' normals, each as long as the triangle's
//! area, made a unit vector. Vertices without area get the zero vector.

use super::Surface;

/// Writes V unit normals.
pub(super) fn smooth(surface: Surface<'_>, normals: &mut Vec<[f32; 3]>) {
    let points = surface.positions.as_chunks::<3>().0;
    normals.clear();
    normals.resize(points.len(), [0.0; 3]);
    for &[a, b, c] in surface.triangles {
        let [a, b, c] = [a as usize, b as usize, c as usize];
        let normal = cross(minus(points[b], points[a]), minus(points[c], points[a]));
        for corner in [a, b, c] {
            for i in 0..3 {
                normals[corner][i] += normal[i];
            }
        }
    }
    for normal in normals {
        *normal = unit(*normal);
    }
}

/// `a` as a unit vector; zero stays zero, also where the square of the length leaves f32.
pub(super) fn unit(a: [f32; 3]) -> [f32; 3] {
    let mut a = a;
    let mut square = a[0] * a[0] + a[1] * a[1] + a[2] * a[2];
    if !(1e-30..1e30).contains(&square) {
        let largest = a.iter().fold(0.0_f32, |most, value| most.max(value.abs()));
        if largest == 0.0 || !largest.is_finite() {
            return [0.0; 3];
        }
        a = a.map(|value| value / largest);
        square = a[0] * a[0] + a[1] * a[1] + a[2] * a[2];
    }
    let scale = 1.0 / square.sqrt();
    a.map(|value| value * scale)
}

fn minus(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

fn cross(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}
