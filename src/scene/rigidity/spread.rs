//! A hinge laid flat, and how much of a cloth's bending it is.

use glam::{DVec2, DVec3};

/// The two triangles of a hinge unfolded into a plane, edge a → b along the first axis.
#[derive(Clone, Copy, Debug)]
pub(super) struct Spread {
    /// Length ℓ of the edge (m).
    length: f64,
    /// Heights of the two triangles over the edge (m).
    heights: [f64; 2],
    /// Feet of the two heights, from a towards b (m).
    feet: [f64; 2],
}

impl Spread {
    /// From the corners a, b, c, d of a hinge (m).
    pub(super) fn new([a, b, c, d]: [DVec3; 4]) -> Self {
        let edge = b - a;
        let along = edge.normalize_or_zero();
        let feet = [c, d].map(|tip| (tip - a).dot(along));
        let heights = [c, d].map(|tip| (tip - a).cross(along).length());
        Self {
            length: edge.length(),
            heights,
            feet,
        }
    }

    /// Areas of the two triangles (m²).
    pub(super) fn areas(&self) -> [f64; 2] {
        self.heights.map(|height| 0.5 * self.length * height)
    }

    /// k of the hinge for C D = 1 N·m: ℓ²/A, 0 with a triangle without area.
    pub(super) fn weight(&self) -> f64 {
        let [first, second] = self.areas();
        if first > 0.0 && second > 0.0 {
            self.length * self.length / (first + second)
        } else {
            0.0
        }
    }

    /// p, q and r (m) of θ = p κₙₙ + q κₙₜ − r κₜₜ, for curvature across, twist, and curvature along
    /// the edge: p = (h₀ + h₁)/2, q = s₀ − s₁, r = Σ s (ℓ − s) / 2h.
    fn turns(&self) -> [f64; 3] {
        let Self {
            length,
            heights: [h0, h1],
            feet: [s0, s1],
        } = *self;
        let r = s0 * (length - s0) / h0 + s1 * (length - s1) / h1;
        [0.5 * (h0 + h1), s0 - s1, 0.5 * r]
    }

    /// θ of the hinge for κxx, κyy and κxy of 1/m each, when the vertices lie on the curved surface
    /// and the edge runs along the unit vector t = (cos, sin) of the plane.
    pub(super) fn reading(&self, edge: DVec2) -> DVec3 {
        let [p, q, r] = self.turns();
        let (c, s) = (edge.x, edge.y);
        let across = DVec3::new(s * s, c * c, -2.0 * c * s);
        let twist = DVec3::new(-c * s, c * s, c * c - s * s);
        let along = DVec3::new(c * c, s * s, 2.0 * c * s);
        p * across + q * twist - r * along
    }

    /// ∂θ/∂w for the heights w of a, b, c, d over the plane (1/m).
    pub(super) fn gradient(&self) -> [f64; 4] {
        let Self {
            length,
            heights: [h0, h1],
            feet: [s0, s1],
        } = *self;
        let (b0, b1) = (s0 / length, s1 / length);
        [
            -(1.0 - b0) / h0 - (1.0 - b1) / h1,
            -b0 / h0 - b1 / h1,
            1.0 / h0,
            1.0 / h1,
        ]
    }
}
