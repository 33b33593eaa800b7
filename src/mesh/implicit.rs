//! Bodies described by a signed distance, and their surfaces as triangles.
//!
//! Shapes are rounded cones, joined by a smooth minimum. The surface, where the distance is zero,
//! is found on a grid by surface nets (Gibson 1998), whose triangles are then evened out: vertices
//! slide towards the centre of their neighbours, Newton steps take them back to the surface, and
//! edges are flipped towards equal vertex degrees (Botsch and Kobbelt 2004). Distances near the
//! surface are what counts; far from it they may be short by a few per cent.
//!
//! Features must be thicker, and gaps wider, than about a cell of the grid; sharp edges are lost.

use fast_surface_nets::ndshape::{RuntimeShape, Shape};
use fast_surface_nets::{SurfaceNetsBuffer, surface_nets};
use glam::DVec3;

use super::TriMesh;

/// Signed distance at a point, and its derivative.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Sample {
    /// Distance to the surface, negative inside (m).
    pub(super) distance: f64,
    /// Direction in which the distance grows, of about unit length.
    pub(super) gradient: DVec3,
}

impl Sample {
    /// Nothing anywhere: the neutral element of [`smooth_min`].
    pub(super) const EMPTY: Self = Self {
        distance: f64::INFINITY,
        gradient: DVec3::ZERO,
    };
}

impl std::ops::Neg for Sample {
    type Output = Self;

    /// Inside out.
    fn neg(self) -> Self {
        Self {
            distance: -self.distance,
            gradient: -self.gradient,
        }
    }
}

/// Two balls and all that lies between them, pressed flat along an axis.
///
/// The union of the balls of centre a + t (b − a) and radius ra + t (rb − ra), 0 ≤ t ≤ 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct RoundCone {
    /// Centre of the first ball (m).
    pub(super) a: DVec3,
    /// Centre of the second ball (m).
    pub(super) b: DVec3,
    /// Radius of the first ball (m).
    pub(super) ra: f64,
    /// Radius of the second ball (m).
    pub(super) rb: f64,
    /// Unit vector along which the section is flattened.
    pub(super) flat_axis: DVec3,
    /// Thickness along `flat_axis` as a share of the width across it; 1 is round.
    pub(super) flatness: f64,
}

impl RoundCone {
    /// Signed distance to the surface at `p`.
    ///
    /// The ball nearest to p, at y along the axis and x away from it, has its centre at
    /// y − x tan α, sin α = (ra − rb)/|b − a|, held between the ends. With S the map that undoes
    /// the flattening and u the unit vector from that centre to S p, the distance is
    /// (|S p − c| − r) / |S u|: exact when round, of first order near the surface when flat.
    /// When one ball holds the other, the larger one.
    ///
    /// Source: Quilez, "Rounded cone – exact"; "Ellipsoid – bound" for the flattened case.
    pub(super) fn sample(&self, p: DVec3) -> Sample {
        let stretch = 1.0 / self.flatness - 1.0;
        let round = |v: DVec3| v + self.flat_axis * (stretch * v.dot(self.flat_axis));
        let (q, axis) = (round(p - self.a), round(self.b - self.a));
        let length = axis.length();
        let taper = self.ra - self.rb;
        let t = if length > taper.abs() {
            let along = q.dot(axis) / length;
            let across = (q.length_squared() - along * along).max(0.0).sqrt();
            let tan = taper / (length * length - taper * taper).sqrt();
            ((along - across * tan) / length).clamp(0.0, 1.0)
        } else {
            f64::from(u8::from(taper < 0.0))
        };
        let from_centre = q - axis * t;
        let slope = round(from_centre.try_normalize().unwrap_or(DVec3::Y));
        let steepness = slope.length();
        Sample {
            distance: (from_centre.length() - (self.ra - taper * t)) / steepness,
            gradient: slope / steepness,
        }
    }
}

impl RoundCone {
    /// The union of `body` and this cone with a fillet of `k` (m), at `p`.
    ///
    /// Most cones are too far away to matter; a ball around the cone tells so for less work
    /// than [`RoundCone::sample`], and without changing a bit of the result.
    pub(super) fn join(&self, body: Sample, p: DVec3, k: f64) -> Sample {
        let half = 0.5 * (self.b - self.a);
        let reach = half.abs().element_sum() + self.ra.max(self.rb);
        let at_least = self.flatness * (p.distance(self.a + half) - reach);
        if at_least > 0.0 && at_least > body.distance + k {
            return body;
        }
        smooth_min(body, self.sample(p), k)
    }
}

/// Union of two shapes, filleted where both surfaces are nearer than `k` (m) to each other.
///
/// min(a, b) − k h³/6 with h = max(0, 1 − |a − b|/k): twice continuously differentiable, and
/// exactly the minimum from |a − b| = k on.
///
/// Source: Quilez, "Smooth minimum", the cubic polynomial.
pub(super) fn smooth_min(a: Sample, b: Sample, k: f64) -> Sample {
    let (near, far) = if a.distance <= b.distance {
        (a, b)
    } else {
        (b, a)
    };
    let h = (1.0 - (far.distance - near.distance) / k).max(0.0);
    if h == 0.0 || far.distance.is_infinite() {
        return near;
    }
    Sample {
        distance: near.distance - k * h * h * h / 6.0,
        gradient: near.gradient.lerp(far.gradient, 0.5 * h * h),
    }
}

/// Triangles of the surface of `field` inside the box from `min` to `max`, about `cell` (m) long.
///
/// `rounds` is how often the triangles are evened out; 10 to 20 are enough.
pub(super) fn triangulate(
    field: impl Fn(DVec3) -> Sample,
    min: DVec3,
    max: DVec3,
    cell: f64,
    rounds: usize,
) -> TriMesh {
    let mut mesh = surface_on_grid(&field, min, max, cell);
    for _ in 0..rounds {
        flip_edges(&mut mesh);
        relax(&mut mesh, &field);
    }
    mesh
}

/// Surface nets on the grid of points `min` + `cell` (i, j, k).
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "counts of grid points are small and positive; distances are needed to f32 only here"
)]
fn surface_on_grid(field: &impl Fn(DVec3) -> Sample, min: DVec3, max: DVec3, cell: f64) -> TriMesh {
    let counts = ((max - min) / cell).ceil() + DVec3::ONE;
    let counts = [counts.x as u32, counts.y as u32, counts.z as u32];
    let shape = RuntimeShape::<u32, 3>::new(counts);
    let distances: Vec<f32> = (0..shape.size())
        .map(|index| {
            let [i, j, k] = shape.delinearize(index);
            field(min + cell * DVec3::new(i.into(), j.into(), k.into())).distance as f32
        })
        .collect();
    let mut net = SurfaceNetsBuffer::default();
    surface_nets(&distances, &shape, [0; 3], counts.map(|n| n - 1), &mut net);
    let to_world =
        |[x, y, z]: &[f32; 3]| min + cell * DVec3::new(f64::from(*x), f64::from(*y), f64::from(*z));
    TriMesh {
        positions: net.positions.iter().map(to_world).collect(),
        triangles: net.indices.as_chunks().0.to_vec(),
    }
}

/// Moves every vertex along the surface to the middle of its neighbours, then back onto it.
fn relax(mesh: &mut TriMesh, field: &impl Fn(DVec3) -> Sample) {
    let mut sums = vec![(DVec3::ZERO, 0.0); mesh.positions.len()];
    for t in &mesh.triangles {
        let [a, b, c] = t.map(|v| mesh.positions[v as usize]);
        let area = (b - a).cross(c - a).length();
        for &v in t {
            let (sum, weight) = &mut sums[v as usize];
            *sum += area * (a + b + c) / 3.0;
            *weight += area;
        }
    }
    for (x, (sum, weight)) in mesh.positions.iter_mut().zip(sums) {
        let normal = field(*x).gradient.normalize_or_zero();
        let step = sum / weight - *x;
        *x = project(*x + 0.7 * (step - normal * step.dot(normal)), field);
    }
}

/// Nearest point of the surface, by Newton steps along the gradient: x − d ∇d/|∇d|².
///
/// After the last round of the mannequin two steps leave at most 1.2e-7 m.
fn project(mut x: DVec3, field: &impl Fn(DVec3) -> Sample) -> DVec3 {
    for _ in 0..2 {
        let Sample { distance, gradient } = field(x);
        x -= gradient * (distance / gradient.length_squared().max(0.25));
    }
    x
}

/// Flips edges wherever that brings the degrees of the four vertices around nearer to six.
///
/// A triangle takes part in one flip at most, so that the table of edges stays true. A flip that
/// would double an edge, or fold the surface, is left out.
fn flip_edges(mesh: &mut TriMesh) {
    let TriMesh {
        positions,
        triangles,
    } = mesh;
    let mut degrees = vec![0_i32; positions.len()];
    let mut edges = Vec::with_capacity(3 * triangles.len());
    for (t, triangle) in triangles.iter().enumerate() {
        for corner in 0..3 {
            let [a, b, c] = [0, 1, 2].map(|i| triangle[(corner + i) % 3]);
            degrees[a as usize] += 1;
            edges.push(([a.min(b), a.max(b)], t, c));
        }
    }
    edges.sort_unstable();
    let mut taken = vec![false; triangles.len()];
    for pair in edges.as_chunks::<2>().0 {
        let [([a, b], t, c), (_, u, d)] = *pair;
        let new_edge = [c.min(d), c.max(d)];
        let exists = edges.binary_search_by_key(&new_edge, |edge| edge.0).is_ok();
        if taken[t] || taken[u] || exists {
            continue;
        }
        let excess = |v: u32, change: i32| (degrees[v as usize] + change - 6).pow(2);
        let before = excess(a, 0) + excess(b, 0) + excess(c, 0) + excess(d, 0);
        let after = excess(a, -1) + excess(b, -1) + excess(c, 1) + excess(d, 1);
        let [first, second] = flipped(triangles[t], [a, b, c, d]);
        if after < before && same_side(positions, triangles[t], &[first, second]) {
            (triangles[t], triangles[u]) = (first, second);
            (taken[t], taken[u]) = (true, true);
            for (v, change) in [(a, -1), (b, -1), (c, 1), (d, 1)] {
                degrees[v as usize] += change;
            }
        }
    }
}

/// The triangles on c d instead of those on a b, the first of which is `old`.
fn flipped(old: [u32; 3], [a, b, c, d]: [u32; 4]) -> [[u32; 3]; 2] {
    let forwards = (0..3).any(|i| old[i] == a && old[(i + 1) % 3] == b);
    let (a, b) = if forwards { (a, b) } else { (b, a) };
    [[c, a, d], [d, b, c]]
}

/// Whether both `new` triangles look the way of `old`, within 60°.
fn same_side(positions: &[DVec3], old: [u32; 3], new: &[[u32; 3]; 2]) -> bool {
    let normal = |triangle: [u32; 3]| {
        let [a, b, c] = triangle.map(|v| positions[v as usize]);
        (b - a).cross(c - a).normalize_or_zero()
    };
    let old = normal(old);
    new.iter().all(|&triangle| normal(triangle).dot(old) > 0.5)
}
