//! Meshes of planes and spheres, to look at.

use super::TriMesh;
use glam::DVec3;
use std::f64::consts::PI;

/// Parts of half a great circle of a ball.
const PARTS: u32 = 24;

/// A square in a plane around a point of it (m), seen from where the unit normal points; its side is twice
/// `half` (m).
pub fn square(point: DVec3, normal: DVec3, half: f64) -> TriMesh {
    let (u, v) = normal.any_orthonormal_pair();
    let corner = |a: f64, b: f64| point + u * (a * half) + v * (b * half);
    TriMesh {
        positions: vec![
            corner(-1.0, -1.0),
            corner(1.0, -1.0),
            corner(1.0, 1.0),
            corner(-1.0, 1.0),
        ],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
    }
}

/// A ball in rings of equal latitude, closed and turned outward.
pub fn ball(center: DVec3, radius: f64) -> TriMesh {
    let around = 2 * PARTS;
    let place = |ring: u32, k: u32| {
        let (down, turn) = (
            PI * f64::from(ring) / f64::from(PARTS),
            PI * f64::from(k) / f64::from(PARTS),
        );
        let out = DVec3::new(down.sin() * turn.sin(), down.cos(), down.sin() * turn.cos());
        center + out * radius
    };
    let mut positions = vec![center + DVec3::Y * radius];
    for ring in 1..PARTS {
        positions.extend((0..around).map(|k| place(ring, k)));
    }
    positions.push(center - DVec3::Y * radius);
    let vertex = |ring: u32, k: u32| match ring {
        0 => 0,
        PARTS => 1 + (PARTS - 1) * around,
        _ => 1 + (ring - 1) * around + k % around,
    };
    let mut triangles = Vec::new();
    for ring in 0..PARTS {
        for k in 0..around {
            let [a, b] = [vertex(ring, k), vertex(ring, k + 1)];
            let [c, d] = [vertex(ring + 1, k), vertex(ring + 1, k + 1)];
            if ring > 0 {
                triangles.push([a, c, b]);
            }
            if ring + 1 < PARTS {
                triangles.push([b, c, d]);
            }
        }
    }
    TriMesh {
        positions,
        triangles,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::open_edge;

    #[test]
    fn a_ball_is_closed_and_nearly_full() {
        let mesh = ball(DVec3::new(1.0, -2.0, 0.5), 0.3);
        assert!(open_edge(&mesh).is_none());
        let full = 4.0 / 3.0 * PI * 0.3_f64.powi(3);
        assert!(
            (0.98..1.0).contains(&(mesh.volume() / full)),
            "{}",
            mesh.volume() / full
        );
    }

    #[test]
    fn a_square_faces_its_normal() {
        let normal = DVec3::new(2.0, 3.0, -6.0) / 7.0;
        let mesh = square(DVec3::ONE, normal, 2.0);
        for triangle in &mesh.triangles {
            let [a, b, c] = mesh.corners(*triangle);
            assert!(((b - a).cross(c - a) - normal * 16.0).length() < 1e-12);
        }
    }
}
