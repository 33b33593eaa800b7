//! The point of a triangle that is nearest to another point.

use glam::DVec3;

/// The nearest point of a triangle to `p`, by the region that p is in: over a corner, over an edge, or over
/// the face.
///
/// Source: Ericson 2005, "Real-time collision detection", 5.1.5.
pub(super) fn closest_on_triangle(p: DVec3, [a, b, c]: [DVec3; 3]) -> DVec3 {
    let (ab, ac) = (b - a, c - a);
    let [d1, d2] = [ab, ac].map(|side| side.dot(p - a));
    if d1 <= 0.0 && d2 <= 0.0 {
        return a;
    }
    let [d3, d4] = [ab, ac].map(|side| side.dot(p - b));
    if d3 >= 0.0 && d4 <= d3 {
        return b;
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return a + ab * (d1 / (d1 - d3));
    }
    let [d5, d6] = [ab, ac].map(|side| side.dot(p - c));
    if d6 >= 0.0 && d5 <= d6 {
        return c;
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return a + ac * (d2 / (d2 - d6));
    }
    let va = d3 * d6 - d5 * d4;
    let (to_c, to_b) = (d4 - d3, d5 - d6);
    if va <= 0.0 && to_c >= 0.0 && to_b >= 0.0 {
        return b + (c - b) * (to_c / (to_c + to_b));
    }
    a + (ab * vb + ac * vc) / (va + vb + vc)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// No point of the triangle on a fine grid is nearer.
    #[test]
    fn nothing_on_the_triangle_is_nearer() {
        let triangle = [
            DVec3::new(0.1, 0.2, -0.3),
            DVec3::new(1.2, 0.1, 0.4),
            DVec3::new(0.3, 0.9, 0.5),
        ];
        let [a, b, c] = triangle;
        for i in 0..500_u32 {
            let s = f64::from(i);
            let p = DVec3::new((s * 0.7).sin(), (s * 1.3).cos(), (s * 2.1).sin()) * 1.5;
            let nearest = closest_on_triangle(p, triangle).distance(p);
            let grid = (0..=60).flat_map(|j| {
                (0..=60 - j).map(move |k| (f64::from(j) / 60.0, f64::from(k) / 60.0))
            });
            let best = grid
                .map(|(u, v)| (a + (b - a) * u + (c - a) * v).distance(p))
                .fold(f64::MAX, f64::min);
            assert!(
                nearest <= best + 1e-12 && best - nearest < 0.03,
                "{p}: {nearest}, {best}"
            );
        }
    }
}
