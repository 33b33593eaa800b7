//! The closest point of a triangle.

use glam::DVec3;

/// A point of a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OnTriangle {
    /// The point (m).
    pub point: DVec3,
    /// Its barycentric coordinates: point = Σ wᵢ cornerᵢ, Σ wᵢ = 1, none negative. Exactly 0 for the
    /// corner across from the edge that it lies on, for both others when it is a corner.
    pub weights: [f64; 3],
}

/// The point of a triangle closest to `p`.
///
/// Which of the seven regions `p` is in (three corners, three edges, the face) is told by the signs
/// of six dot products and three signed areas. Of a triangle without area some point is returned,
/// not always the closest; in a closed mesh its neighbours cover it.
///
/// Source: Ericson 2005, Real-Time Collision Detection, 5.1.5.
#[inline]
pub fn closest_point([a, b, c]: [DVec3; 3], p: DVec3) -> OnTriangle {
    let (ab, ac) = (b - a, c - a);
    let ap = p - a;
    let (d1, d2) = (ab.dot(ap), ac.dot(ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return corner(a, [1.0, 0.0, 0.0]);
    }
    let bp = p - b;
    let (d3, d4) = (ab.dot(bp), ac.dot(bp));
    if d3 >= 0.0 && d4 <= d3 {
        return corner(b, [0.0, 1.0, 0.0]);
    }
    let cp = p - c;
    let (d5, d6) = (ab.dot(cp), ac.dot(cp));
    if d6 >= 0.0 && d5 <= d6 {
        return corner(c, [0.0, 0.0, 1.0]);
    }
    // Twice the signed areas of p's projection with each edge, times twice the triangle's.
    let over_ab = d1 * d4 - d3 * d2;
    if over_ab <= 0.0 && d1 >= 0.0 && d3 <= 0.0 && d1 > d3 {
        let t = d1 / (d1 - d3);
        return OnTriangle {
            point: a + ab * t,
            weights: [1.0 - t, t, 0.0],
        };
    }
    let over_ca = d5 * d2 - d1 * d6;
    if over_ca <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        let t = d2 / (d2 - d6);
        return OnTriangle {
            point: a + ac * t,
            weights: [1.0 - t, 0.0, t],
        };
    }
    let over_bc = d3 * d6 - d5 * d4;
    if over_bc <= 0.0 && d4 >= d3 && d5 >= d6 {
        let t = (d4 - d3) / ((d4 - d3) + (d5 - d6));
        return OnTriangle {
            point: b + (c - b) * t,
            weights: [0.0, 1.0 - t, t],
        };
    }
    if over_ab.min(over_bc).min(over_ca) <= 0.0 {
        return corner(a, [1.0, 0.0, 0.0]); // rounding, in a triangle that has hardly any area
    }
    let whole = 1.0 / (over_ab + over_bc + over_ca);
    let (v, w) = (over_ca * whole, over_ab * whole);
    OnTriangle {
        point: a + ab * v + ac * w,
        weights: [over_bc * whole, v, w],
    }
}

fn corner(point: DVec3, weights: [f64; 3]) -> OnTriangle {
    OnTriangle { point, weights }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::dvec3;

    /// Of many points of a triangle, the distance of the closest.
    fn by_search([a, b, c]: [DVec3; 3], p: DVec3) -> f64 {
        let steps = 60;
        let along = |i: u32, j: u32| {
            let [v, w] = [i, j].map(|k| f64::from(k) / f64::from(steps));
            (a + (b - a) * v + (c - a) * w - p).length()
        };
        let all = (0..=steps).flat_map(|i| (0..=steps - i).map(move |j| along(i, j)));
        all.fold(f64::INFINITY, f64::min)
    }

    #[test]
    fn no_other_point_is_closer_and_weights_give_the_point() {
        let triangle = [
            dvec3(0.1, 0.2, 0.3),
            dvec3(1.3, 0.1, 0.2),
            dvec3(0.5, 0.9, 0.6),
        ];
        let mut regions = [0; 8];
        for i in 0..2000_u32 {
            let turn = f64::from(i);
            let far = 0.2 + 2.0 * (turn * 0.37).fract();
            let direction = dvec3((turn * 0.7).sin(), (turn * 1.3).cos(), (turn * 2.1).sin());
            let p = dvec3(0.6, 0.4, 0.35) + direction * far;
            let found = closest_point(triangle, p);
            let searched = by_search(triangle, p);
            let distance = (found.point - p).length();
            assert!(distance <= searched + 1e-14, "{p}: {distance} > {searched}");
            assert!(
                distance >= searched - 0.02,
                "{p}: {found:?} is beside the triangle"
            );
            let [u, v, w] = found.weights;
            let point = triangle[0] * u + triangle[1] * v + triangle[2] * w;
            assert!(
                (point - found.point).length() < 1e-15 * 8.0 && (u + v + w - 1.0).abs() < 1e-15
            );
            assert!(u.min(v).min(w) >= 0.0, "{found:?}");
            regions
                [usize::from(u > 0.0) | usize::from(v > 0.0) << 1 | usize::from(w > 0.0) << 2] += 1;
        }
        assert!(
            regions[0] == 0 && regions[1..].iter().all(|&n| n > 40),
            "{regions:?}"
        );
    }

    #[test]
    fn triangles_without_area_answer_with_a_point_of_theirs() {
        let [a, b] = [DVec3::ZERO, dvec3(0.3, 0.7, 0.1)];
        let thirds = a + (b - a) / 3.0;
        let all = [
            [a, a, a],
            [a, a, b],
            [a, b, a],
            [b, a, a],
            [a, b, thirds],
            [thirds, b, a],
        ];
        for triangle in all {
            for p in [
                a,
                b,
                thirds,
                dvec3(0.2, 0.1, 0.5),
                dvec3(-1.0, 2.0, 0.3),
                -DVec3::ONE,
            ] {
                let OnTriangle { point, weights } = closest_point(triangle, p);
                assert!(
                    weights.iter().all(|w| (0.0..=1.0).contains(w)),
                    "{triangle:?}: {weights:?}"
                );
                let t = (point - a).dot(b - a) / (b - a).length_squared();
                assert!(
                    (a + (b - a) * t - point).length() < 1e-15,
                    "{triangle:?}: {point}"
                );
                assert!((0.0..=1.0).contains(&t), "{triangle:?}: {point}");
            }
        }
    }
}
