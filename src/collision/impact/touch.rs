//! One place where features met, and how the vertices are moved there.

use glam::DVec3;

/// All vertices: the cloths' particles first, then those of the solids.
#[derive(Clone, Debug, Default)]
pub(super) struct Vertices {
    /// Positions at the step's start (m).
    pub(super) start: Vec<DVec3>,
    /// Positions at the step's end (m).
    pub(super) end: Vec<DVec3>,
    /// Velocities at the step's end (m/s).
    pub(super) velocity: Vec<DVec3>,
    /// 1/mass (1/kg); 0 for solids and pinned particles.
    pub(super) inverse_mass: Vec<f64>,
}

/// Two features that met or are too close, and what was done about it.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Touch {
    /// Their vertices.
    pub(super) vertices: [u32; 4],
    /// Weights of the closest points, those of the second feature negative.
    pub(super) weights: [f64; 4],
    /// Unit vector from the second feature to the first.
    pub(super) normal: DVec3,
    /// Gap along the normal that the step has to end with (m).
    pub(super) target: f64,
    /// The same where there is no room for that (m).
    pub(super) tight: f64,
    /// Coulomb's friction coefficient μ.
    pub(super) friction: f64,
    /// Whether the features meet on their way, and aren't only closer than they should be.
    pub(super) meets: bool,
    /// What moved the positions along the normal (kg·m), not negative.
    pub(super) pressed: f64,
    /// What moved them against sliding (kg·m).
    pub(super) held: DVec3,
    /// Impulse along the normal (N·s), not negative.
    pub(super) impulse: f64,
    /// Impulse against sliding (N·s).
    pub(super) drag: DVec3,
}

impl Touch {
    /// Σ wᵢ aᵢ: difference of a quantity between the closest points.
    pub(super) fn difference(&self, of: &[DVec3]) -> DVec3 {
        let term = |k: usize| of[self.vertices[k] as usize] * self.weights[k];
        term(0) + term(1) + term(2) + term(3)
    }

    /// Σ wᵢ² / mᵢ (1/kg): how much an impulse changes the difference of velocities.
    pub(super) fn compliance(&self, inverse_mass: &[f64]) -> f64 {
        let term =
            |k: usize| self.weights[k] * self.weights[k] * inverse_mass[self.vertices[k] as usize];
        term(0) + term(1) + term(2) + term(3)
    }

    /// aᵢ ← aᵢ + wᵢ p / mᵢ: leaves Σ mᵢ aᵢ of free vertices as it is.
    pub(super) fn shift(&self, of: &mut [DVec3], inverse_mass: &[f64], p: DVec3) {
        for (&i, w) in self.vertices.iter().zip(self.weights) {
            of[i as usize] += p * (w * inverse_mass[i as usize]);
        }
    }

    /// The part of a vector along the surfaces.
    pub(super) fn along(&self, v: DVec3) -> DVec3 {
        v - self.normal * self.normal.dot(v)
    }

    /// Moves the ends of the step's ways so that the target is kept, and less along the surfaces, as friction
    /// would have it. Returns by how much the target was missed before (m).
    ///
    /// With g the gap, W = Σ wᵢ²/mᵢ, p what was done before and s the way slid:
    /// p ← max(0, p − (g − target)/W); h ← h − s/W, not longer than μ p.
    ///
    /// Repeated over all touches this finds the ends nearest to the wished ones, by mass, that keep all targets
    /// (Gauss–Seidel on the dual problem; Harmon et al. 2008 project velocities in the same way). What only
    /// widens a gap that was too narrow from the start doesn't count for friction.
    pub(super) fn separate(&mut self, vertices: &mut Vertices) -> f64 {
        let Vertices {
            start,
            end,
            inverse_mass,
            ..
        } = vertices;
        let compliance = self.compliance(inverse_mass);
        if compliance == 0.0 {
            return 0.0;
        }
        let missed = self.target - self.normal.dot(self.difference(end));
        let pressed = (self.pressed + missed / compliance).max(0.0);
        if pressed == 0.0 && self.pressed == 0.0 && self.held == DVec3::ZERO {
            return missed; // no friction without pressure
        }
        self.shift(end, inverse_mass, self.normal * (pressed - self.pressed));
        self.pressed = pressed;
        let began = self.difference(start);
        let widened = (self.target - self.normal.dot(began)).max(0.0) / compliance;
        let most = self.friction * (pressed - widened).max(0.0);
        let slid = self.along(self.difference(end) - began);
        let held = (self.held - slid / compliance).clamp_length_max(most);
        self.shift(end, inverse_mass, held - self.held);
        self.held = held;
        missed
    }
}

/// Passes over the touches in a round. With 10 a needle at 300 m/s ends in 19 rigid zones, with 30 in
/// 11, with 100 in 12.
const PASSES: u32 = 30;

/// Separates touches until each target is missed by `enough` (m) at most, or the passes are used up: all in
/// the first round, only those that meet later on. To hold some thousand features in a pile to the
/// last would change all ways again in each round, and all would have to be searched.
pub(super) fn separate(touches: &mut [Touch], vertices: &mut Vertices, first: bool, enough: f64) {
    for _ in 0..PASSES {
        let mut worst = 0.0_f64;
        for touch in touches.iter_mut().filter(|touch| first || touch.meets) {
            worst = worst.max(touch.separate(vertices));
        }
        if worst <= enough {
            break;
        }
    }
}
