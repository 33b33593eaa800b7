//! One patch laid flat: its hinges, and the heights that bending moments give its vertices.

use super::{Plate, Spread};
use glam::{DVec2, DVec3};

/// A hinge of a patch.
#[derive(Debug)]
pub(super) struct Stencil {
    /// Corners a, b, c, d in the patch.
    vertices: [usize; 4],
    /// ∂θ/∂w for the heights of the corners (1/m).
    gradient: [f64; 4],
    /// ℓ n ⊗ n (m), xx, yy and xy: the curvature integrated over the hinge for θ = 1.
    curvature: DVec3,
    /// Stiffness (N·m).
    k: f64,
    /// Areas of the two triangles (m²), negative when they are turned over.
    pub(super) areas: [f64; 2],
}

impl Stencil {
    pub(super) fn new([a, b, c, d]: [usize; 4], k: f64, flat: &[DVec2]) -> Self {
        let spread = Spread::new([a, b, c, d].map(|i| flat[i].extend(0.0)));
        let edge = flat[b] - flat[a];
        let squares = DVec3::new(edge.y * edge.y, edge.x * edge.x, -edge.x * edge.y);
        Self {
            vertices: [a, b, c, d],
            gradient: spread.gradient(),
            curvature: squares / edge.length(),
            k,
            areas: [[a, b, c], [b, a, d]].map(|corners| signed_area(corners.map(|i| flat[i]))),
        }
    }

    /// θ of the hinge for given heights.
    fn theta(&self, heights: &[DVec3]) -> DVec3 {
        let terms = (0..4).map(|i| self.gradient[i] * heights[self.vertices[i]]);
        terms.sum()
    }
}

/// A patch laid flat, with heights for each of three loads.
#[derive(Debug)]
pub(super) struct Patch {
    pub(super) stencils: Vec<Stencil>,
    /// Vertices that stay at height 0.
    pub(super) held: Vec<bool>,
    /// Heights of the vertices for unit moments xx, yy, xy (m).
    pub(super) heights: Vec<DVec3>,
}

impl Patch {
    /// Frees every vertex that hinges hold, but for one triangle.
    pub(super) fn hold(&mut self) {
        for stencil in &self.stencils {
            for vertex in stencil.vertices {
                self.held[vertex] = false;
            }
        }
        let center = self
            .stencils
            .iter()
            .find(|stencil| stencil.vertices.contains(&0));
        if let Some(Stencil {
            vertices: [a, b, c, _],
            ..
        }) = center
        {
            for vertex in [*a, *b, *c] {
                self.held[vertex] = true;
            }
        }
    }

    /// Bends the patch by uniform moments m at its rim: least ½ Σ k θ² − m · Σ θ ℓ n ⊗ n. `None` when a
    /// vertex isn't held, or there are too many.
    pub(super) fn relax(&mut self) -> Option<()> {
        let n = self.heights.len();
        if n > MOST_VERTICES {
            return None;
        }
        let mut matrix = vec![0.0; n * n];
        let mut loads = vec![DVec3::ZERO; n];
        for i in (0..n).filter(|&i| self.held[i]) {
            matrix[i * n + i] = 1.0;
        }
        for stencil in &self.stencils {
            for (&i, gi) in stencil.vertices.iter().zip(stencil.gradient) {
                if self.held[i] {
                    continue;
                }
                loads[i] += gi * stencil.curvature;
                for (&j, gj) in stencil.vertices.iter().zip(stencil.gradient) {
                    if j <= i && !self.held[j] {
                        matrix[i * n + j] += stencil.k * gi * gj;
                    }
                }
            }
        }
        solve(&mut matrix, &mut loads)?;
        self.heights = loads;
        Some(())
    }

    /// Energy, curvature and area of the triangles among the first `core` vertices. What a hinge has
    /// is shared by its triangles as its area is; a third of a triangle's area belongs to each of its
    /// hinges.
    pub(super) fn plate(&self, core: usize) -> Plate {
        let mut plate = Plate::NONE;
        for stencil in &self.stencils {
            let [a, b, c, d] = stencil.vertices.map(|vertex| vertex < core);
            let [first, second] = stencil.areas;
            let inside = f64::from(u8::from(a && b && c)) * first
                + f64::from(u8::from(a && b && d)) * second;
            let theta = stencil.theta(&self.heights);
            let share = inside / (first + second);
            plate.add_hinge(stencil.k, theta, stencil.curvature, share, inside / 3.0);
        }
        plate
    }
}

/// Four rings have 40 to 90 vertices; a hub of a thousand triangles has them all in its first ring, and
/// a solve takes the cube of their number.
const MOST_VERTICES: usize = 300;

fn signed_area([a, b, c]: [DVec2; 3]) -> f64 {
    0.5 * (b - a).perp_dot(c - a)
}

/// Solves A x = b for a positive definite A, of which the lower half is given row by row and
/// overwritten; b becomes x. `None` when A isn't positive definite to 12 digits.
///
/// Cholesky: A = L Lᵀ, then L y = b and Lᵀ x = y.
fn solve(matrix: &mut [f64], b: &mut [DVec3]) -> Option<()> {
    let n = b.len();
    for i in 0..n {
        let (above, row) = matrix.split_at_mut(i * n);
        for j in 0..i {
            let other = &above[j * n..=j * n + j];
            let sum: f64 = row[..j].iter().zip(other).map(|(p, q)| p * q).sum();
            row[j] = (row[j] - sum) / other[j];
        }
        let square: f64 = row[..i].iter().map(|p| p * p).sum();
        let pivot = row[i] - square;
        if pivot.is_nan() || pivot <= 1e-12 * row[i] {
            return None;
        }
        row[i] = pivot.sqrt();
        for j in 0..i {
            let known = b[j];
            b[i] -= row[j] * known;
        }
        b[i] /= row[i];
    }
    for i in (0..n).rev() {
        b[i] /= matrix[i * n + i];
        for j in 0..i {
            let known = b[i];
            b[j] -= matrix[i * n + j] * known;
        }
    }
    Some(())
}
