//! Is a point inside a closed mesh? Told by counting, without rounding.

use super::crossing::side;
use glam::DVec3;
use robust::{Coord, orient2d};

/// How often a closed, outward mesh winds around `p`, given its triangles above and below it: 1 inside, 0
/// outside.
///
/// A ray goes up from `p` and counts the triangles that it meets, those that face up against those that
/// face down. Where it meets an edge or a corner it is taken to pass on one side of it, the same for all
/// triangles that meet there, so that none is counted twice or missed.
pub(super) fn winding(triangles: impl Iterator<Item = [DVec3; 3]>, p: DVec3) -> i32 {
    triangles.map(|corners| meets(corners, p)).sum()
}

/// 1 where the ray leaves through the triangle, −1 where it enters, 0 where it misses it.
fn meets([a, b, c]: [DVec3; 3], p: DVec3) -> i32 {
    // How often the triangle's outline, seen from above, winds around the ray.
    let outline: i32 = [[a, b], [b, c], [c, a]]
        .map(|edge| passes(edge, p))
        .into_iter()
        .sum();
    // It faces up where it runs counter-clockwise seen from above; p below it is on its other side.
    let above = side([a, b, c], p) * f64::from(outline) < 0.0;
    if above { outline } else { 0 }
}

/// 1 or −1 where an edge, seen from above with +z to the right and +x upward, crosses the half line from
/// `p` to the right, upward or downward.
fn passes([u, v]: [DVec3; 2], p: DVec3) -> i32 {
    let upward = u.x <= p.x && v.x > p.x;
    let downward = v.x <= p.x && u.x > p.x;
    if !upward && !downward {
        return 0;
    }
    // From its lower end to its upper one, whichever triangle asks: both get the same answer.
    let (low, high) = if upward { (u, v) } else { (v, u) };
    let flat = |q: DVec3| Coord { x: q.z, y: q.x };
    let to_the_left = orient2d(flat(low), flat(high), flat(p)) > 0.0;
    match (to_the_left, upward) {
        (false, _) => 0,
        (true, true) => 1,
        (true, false) => -1,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{TriMesh, ball, mannequin};

    fn around(mesh: &TriMesh, p: DVec3) -> i32 {
        winding(mesh.triangles.iter().map(|&t| mesh.corners(t)), p)
    }

    /// A ball's corners and edges lie exactly above each other on its axis and in its planes of symmetry.
    #[test]
    fn a_ball_is_round_on_its_axis_too() {
        let mesh = ball(DVec3::ZERO, 1.0);
        for k in -30..30 {
            let r = 0.05 * f64::from(k) + 1e-3;
            for direction in [DVec3::X, DVec3::Y, DVec3::Z, DVec3::ONE / 3.0_f64.sqrt()] {
                let inside = i32::from(r.abs() < 0.99);
                if (r.abs() - 0.995).abs() > 0.01 {
                    assert_eq!(
                        around(&mesh, direction * r),
                        inside,
                        "{r} along {direction}"
                    );
                }
            }
        }
        // Straight below corners, above and below the ball and in it.
        for corner in &mesh.positions {
            assert_eq!(around(&mesh, DVec3::new(corner.x, -2.0, corner.z)), 0);
            assert_eq!(around(&mesh, DVec3::new(corner.x, 2.0, corner.z)), 0);
            if corner.x.hypot(corner.z) < 0.9 {
                assert_eq!(around(&mesh, DVec3::new(corner.x, 0.01, corner.z)), 1);
            }
        }
    }

    #[test]
    fn the_mannequins_skin_has_two_sides() {
        let mesh = mannequin();
        for &triangle in mesh.triangles.iter().step_by(50) {
            let [a, b, c] = mesh.corners(triangle);
            let (middle, normal) = ((a + b + c) / 3.0, (b - a).cross(c - a).normalize_or_zero());
            assert_eq!(around(&mesh, middle + normal * 1e-6), 0, "above {middle}");
            assert_eq!(around(&mesh, middle - normal * 1e-6), 1, "below {middle}");
        }
    }
}
