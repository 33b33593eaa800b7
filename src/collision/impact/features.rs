//! Closest points of a vertex and a face, and of two edges.

use glam::DVec3;

/// What two features of meshes may come to touch. Four vertices describe either pair.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Features {
    /// A vertex (the first) and a face (the other three).
    #[default]
    VertexFace,
    /// An edge (the first two vertices) and another (the last two).
    EdgeEdge,
}

/// The closest points of two features.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Closest {
    /// Weights wᵢ of the four vertices: those of the first feature add up to 1, those of the second
    /// to −1, and none has the other sign.
    pub weights: [f64; 4],
    /// Σ wᵢ xᵢ (m): from the second feature's point to the first's.
    pub between: DVec3,
}

impl Features {
    /// The closest points, also of faces without area, edges without length and parallel edges.
    ///
    /// Weights are always those of points on the features. So a rounding error can only make the
    /// distance longer, by about 1e-8 of the features' size where they are nearly degenerate.
    ///
    /// Source: Ericson 2005, Real-Time Collision Detection, sections 5.1.5 and 5.1.9.
    pub fn closest(self, vertices: [DVec3; 4]) -> Closest {
        match self {
            Self::VertexFace => vertex_face(vertices),
            Self::EdgeEdge => edge_edge(vertices),
        }
    }

    /// What is perpendicular to the face or to both edges; 0 where that isn't defined.
    pub fn across(self, [a, b, c, d]: [DVec3; 4]) -> DVec3 {
        match self {
            Self::VertexFace => (c - b).cross(d - b),
            Self::EdgeEdge => (b - a).cross(d - c),
        }
    }

    /// How many of the four vertices are the first feature's.
    pub fn split(self) -> usize {
        match self {
            Self::VertexFace => 1,
            Self::EdgeEdge => 2,
        }
    }
}

/// Below this sine squared of its smallest angle a face's closest point is looked for on its edges,
/// too: its plane is known to 1e-16 over the sine.
const SLIVER: f64 = 1e-12;

fn vertex_face([p, a, b, c]: [DVec3; 4]) -> Closest {
    let (ab, ac, ap) = (b - a, c - a, p - a);
    let normal = ab.cross(ac);
    let (square, size) = (
        normal.length_squared(),
        ab.length_squared() * ac.length_squared(),
    );
    let [v, w] = [ap.cross(ac), ab.cross(ap)].map(|part| part.dot(normal) / square);
    let inside = v >= 0.0 && w >= 0.0 && v + w <= 1.0; // not with a NaN
    let face = inside.then(|| Closest {
        weights: [1.0, v + w - 1.0, -v, -w],
        between: ap - ab * v - ac * w,
    });
    if let Some(face) = face
        && square > SLIVER * size
    {
        return face;
    }
    let [along_ab, along_ac, along_bc] = [(p, a, b), (p, a, c), (p, b, c)].map(vertex_edge);
    let at_edges = [
        (along_ab.0, [1.0, along_ab.1 - 1.0, -along_ab.1, 0.0]),
        (along_ac.0, [1.0, along_ac.1 - 1.0, 0.0, -along_ac.1]),
        (along_bc.0, [1.0, 0.0, along_bc.1 - 1.0, -along_bc.1]),
    ];
    let edges = at_edges.map(|(between, weights)| Closest { weights, between });
    let mut nearest = face.unwrap_or(edges[0]);
    for edge in edges {
        if edge.between.length_squared() < nearest.between.length_squared() {
            nearest = edge;
        }
    }
    nearest
}

/// From the closest point of an edge to a vertex, and how far along the edge that is (0 to 1).
fn vertex_edge((p, a, b): (DVec3, DVec3, DVec3)) -> (DVec3, f64) {
    let (ab, ap) = (b - a, p - a);
    let share = share(ap.dot(ab), ab.length_squared());
    (ap - ab * share, share)
}

/// A quotient from 0 to 1; 0 when there is none.
fn share(part: f64, whole: f64) -> f64 {
    if whole > 0.0 {
        (part / whole).clamp(0.0, 1.0)
    } else {
        0.0
    }
}

fn edge_edge([a, b, c, d]: [DVec3; 4]) -> Closest {
    let (u, v, r) = (b - a, d - c, a - c);
    let (uu, vv, uv) = (u.length_squared(), v.length_squared(), u.dot(v));
    let (ur, vr) = (u.dot(r), v.dot(r));
    // On both lines first, then the edges' ends: each share is the best for the other.
    let free = share(uv * vr - vv * ur, uu * vv - uv * uv);
    let t = share(uv * free + vr, vv);
    let s = share(uv * t - ur, uu);
    let t = share(uv * s + vr, vv);
    Closest {
        weights: [1.0 - s, s, t - 1.0, -t],
        between: r + u * s - v * t,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::dvec3;

    /// Every pair of points on the features, on a grid of shares: none may be closer.
    fn by_search(features: Features, x: [DVec3; 4]) -> f64 {
        let mut least = f64::MAX;
        let shares = || (0..=40_u32).map(|i| f64::from(i) / 40.0);
        for s in shares() {
            for t in shares() {
                let weights = match features {
                    Features::VertexFace => [1.0, s - 1.0, -s * t, s * (t - 1.0)],
                    Features::EdgeEdge => [1.0 - s, s, t - 1.0, -t],
                };
                let between: DVec3 = (0..4).map(|i| x[i] * weights[i]).sum();
                least = least.min(between.length());
            }
        }
        least
    }

    #[test]
    fn no_pair_of_points_is_closer() {
        let mut turn = 0.0_f64;
        let mut next = || {
            turn += 1.0;
            let wave = |factor: f64| (turn * factor * turn).sin();
            dvec3(wave(0.7), wave(1.3), wave(2.1))
        };
        for case in 0..3000 {
            let mut x = [next(), next(), next(), next()];
            match case % 6 {
                1 => x[3] = x[2] + (x[1] - x[0]) * 0.7,    // parallel edges
                2 => x[3] = x[1] + (x[2] - x[1]) * 0.3,    // a face without area
                3 => x[3] = x[2],                          // an edge without length
                4 => x.iter_mut().for_each(|x| x.z = 0.0), // all in a plane
                5 => x[0] = x[1] * 0.2 + x[2] * 0.3 + x[3] * 0.5, // touching
                _ => {}
            }
            for features in [Features::VertexFace, Features::EdgeEdge] {
                let closest = features.closest(x);
                let w = closest.weights;
                let sum: DVec3 = (0..4).map(|i| x[i] * w[i]).sum();
                assert!((sum - closest.between).length() < 1e-14, "{x:?}");
                let split = features.split();
                assert!(
                    w[..split].iter().all(|w| *w >= 0.0) && w[split..].iter().all(|w| *w <= 0.0)
                );
                assert!((w[..split].iter().sum::<f64>() - 1.0).abs() < 1e-15);
                assert!((w[split..].iter().sum::<f64>() + 1.0).abs() < 1e-15);
                let found = by_search(features, x);
                let distance = closest.between.length();
                assert!(
                    distance < found + 1e-8,
                    "{features:?} {distance} {found} {x:?}"
                );
                assert!(
                    distance > found - 0.1,
                    "{features:?} {distance} {found} {x:?}"
                );
            }
        }
    }
}
