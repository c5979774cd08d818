//! Smooth normals: at each vertex the sum of its triangles' normals, each as long as the triangle's
//! area, made a unit vector. Vertices without area get the zero vector.

/// Replaces `normals` by V unit normals of these triangles over 3V coordinates.
///
/// # Panics
/// A triangle names a vertex that has no position.
pub fn vertex_normals(triangles: &[[u32; 3]], positions: &[f32], normals: &mut Vec<[f32; 3]>) {
    let points = positions.as_chunks::<3>().0;
    normals.clear();
    normals.resize(points.len(), [0.0; 3]);
    for &[a, b, c] in triangles {
        let [a, b, c] = [a as usize, b as usize, c as usize];
        let normal = cross(minus(points[b], points[a]), minus(points[c], points[a]));
        for corner in [a, b, c] {
            for i in 0..3 {
                normals[corner][i] += normal[i];
            }
        }
    }
    for normal in normals {
        *normal = unit_vector(*normal);
    }
}

/// `a` as a unit vector; zero stays zero, also where the square of the length leaves f32.
pub fn unit_vector(a: [f32; 3]) -> [f32; 3] {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normals_point_out_whatever_the_size() {
        let corners = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
        for size in [1e-8_f32, 1.0, 1e8] {
            let positions = [0., 0., 0., 1., 0., 0., 0., 1., 0., 0., 0., 1.].map(|x| x * size);
            let mut normals = Vec::new();
            vertex_normals(&corners, &positions, &mut normals);
            let third = -1.0 / 3.0_f32.sqrt();
            for i in 0..3 {
                // f32 rounding of a sum of three and a square root
                assert!((normals[0][i] - third).abs() < 1e-6);
            }
        }
    }

    #[test]
    fn vertices_without_area_have_none() {
        let mut normals = vec![[1.0; 3]];
        vertex_normals(
            &[[0, 1, 1]],
            &[0., 0., 0., 1., 0., 0., 5., 5., 5.],
            &mut normals,
        );
        assert_eq!(normals, [[0.0; 3]; 3]);
    }
}
