//! Does a segment cross a triangle? Told without rounding.

use glam::DVec3;
use robust::{Coord3D, orient3d};

/// Whether the segment from `p` to `q` goes through a triangle: its ends strictly on both sides, and the
/// triangle's plane met inside it or on its border.
///
/// By the signs of five volumes, each right whatever the rounding; a segment in the plane crosses nothing.
///
/// Source: Shewchuk 1997, "Adaptive precision floating-point arithmetic and fast robust geometric
/// predicates"; Guigue and Devillers 2003 (the five volumes).
pub(super) fn crosses([p, q]: [DVec3; 2], [a, b, c]: [DVec3; 3]) -> bool {
    let (above, below) = (side([a, b, c], p), side([a, b, c], q));
    if above * below >= 0.0 {
        return false;
    }
    let turns = [[a, b], [b, c], [c, a]].map(|[u, v]| side([p, q, u], v));
    turns.iter().all(|&turn| turn >= 0.0) || turns.iter().all(|&turn| turn <= 0.0)
}

/// On which side of a triangle a point is: 1 where it sees the corners counter-clockwise, −1 where
/// clockwise, 0 in its plane.
pub(super) fn side([a, b, c]: [DVec3; 3], p: DVec3) -> f64 {
    let [a, b, c, p] = [a, b, c, p].map(|v| Coord3D {
        x: v.x,
        y: v.y,
        z: v.z,
    });
    // Theirs is positive for a point below a counter-clockwise triangle.
    let volume = -orient3d(a, b, c, p);
    if volume == 0.0 { 0.0 } else { volume.signum() }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TRIANGLE: [DVec3; 3] = [DVec3::ZERO, DVec3::X, DVec3::NEG_Z];

    #[test]
    fn above_is_where_the_corners_run_counter_clockwise() {
        assert_eq!(side(TRIANGLE, DVec3::Y), 1.0);
        assert_eq!(side(TRIANGLE, DVec3::NEG_Y), -1.0);
        assert_eq!(side(TRIANGLE, DVec3::new(7.0, 0.0, 5.0)), 0.0);
    }

    #[test]
    fn through_beside_and_along_a_triangle() {
        let through =
            |x: f64, z: f64| crosses([DVec3::new(x, 1.0, z), DVec3::new(x, -1.0, z)], TRIANGLE);
        assert!(through(0.2, -0.2));
        assert!(!through(0.8, -0.8) && !through(-0.1, -0.1) && !through(0.1, 0.1));
        // Through an edge and through a corner, from either side.
        assert!(through(0.5, 0.0) && through(0.0, 0.0));
        let up = [DVec3::new(0.2, -1.0, -0.2), DVec3::new(0.2, 1.0, -0.2)];
        assert!(crosses(up, TRIANGLE));
        // Too short, ending in the plane, and lying in it.
        assert!(!crosses([up[0], DVec3::new(0.2, -1e-300, -0.2)], TRIANGLE));
        assert!(!crosses([up[0], DVec3::new(0.2, 0.0, -0.2)], TRIANGLE));
        assert!(!crosses(
            [DVec3::NEG_X, DVec3::new(0.5, 0.0, -0.1)],
            TRIANGLE
        ));
    }

    /// A hundred thousandth of a billionth of a metre decides, far from the origin.
    #[test]
    fn the_last_bit_counts() {
        let far = 1024.0;
        let triangle = TRIANGLE.map(|p| p + DVec3::splat(far));
        let top = DVec3::new(0.25, 0.5, -0.25) + DVec3::splat(far);
        let at = |y: f64| crosses([top, DVec3::new(top.x, y, top.z)], triangle);
        assert!(at(far.next_down()) && !at(far) && !at(far.next_up()));
    }
}
