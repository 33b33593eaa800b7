//! Smooth vertex normals; the viewer draws a mesh without them unlit.

/// Normal at each vertex: the mean of its triangles' normals, weighted by their areas.
///
/// n ∝ Σ (b − a) × (c − a), whose length is twice the triangle's area. Up (+y) where that
/// vanishes. Triangles with a vertex that doesn't exist are left out.
pub(crate) fn smooth(positions: &[[f32; 3]], triangles: &[[u32; 3]]) -> Vec<[f32; 3]> {
    let mut normals = vec![[0.0; 3]; positions.len()];
    for triangle in triangles {
        let [i, j, k] = triangle.map(|vertex| vertex as usize);
        let corners = (positions.get(i), positions.get(j), positions.get(k));
        let (Some(a), Some(b), Some(c)) = corners else {
            continue;
        };
        let area = cross(minus(b, a), minus(c, a));
        for vertex in [i, j, k] {
            for axis in 0..3 {
                normals[vertex][axis] += area[axis];
            }
        }
    }
    for normal in &mut normals {
        *normal = unit_or_up(*normal);
    }
    normals
}

fn minus(a: &[f32; 3], b: &[f32; 3]) -> [f32; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

fn cross(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

fn unit_or_up(v: [f32; 3]) -> [f32; 3] {
    let length = (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt();
    // Squares below 1e-38 vanish in f32: for triangles with edges below about 0.1 µm.
    if length > 0.0 && length.is_finite() {
        v.map(|x| x / length)
    } else {
        [0.0, 1.0, 0.0]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_flat_square_points_up() {
        let positions = [
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [1.0, 0.0, 1.0],
            [0.0, 0.0, 1.0],
        ];
        let normals = smooth(&positions, &[[0, 2, 1], [0, 3, 2]]);
        assert!(normals.iter().all(|n| *n == [0.0, 1.0, 0.0]), "{normals:?}");
    }

    #[test]
    fn lonely_and_missing_vertices_do_no_harm() {
        let normals = smooth(&[[0.0; 3], [1.0, 0.0, 0.0]], &[[0, 1, 7], [0, 1, 1]]);
        assert_eq!(normals, [[0.0, 1.0, 0.0]; 2]);
    }
}
