//! One place where features met, and how the vertices are moved there.

use super::halves::{Halves, Local, Visit};
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
    /// Σ wᵢ² / mᵢ (1/kg): how much an impulse changes the difference of velocities.
    pub(super) compliance: f64,
    /// Whether any of the vertices is fixed.
    pub(super) fixed: bool,
    /// Difference of the closest points at the step's start (m).
    pub(super) began: DVec3,
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
    /// Takes what doesn't change in a step from the vertices.
    pub(super) fn weigh(&mut self, vertices: &Vertices) {
        let inverse_mass = |k: usize| vertices.inverse_mass[self.vertices[k] as usize];
        let term = |k: usize| self.weights[k] * self.weights[k] * inverse_mass(k);
        self.compliance = term(0) + term(1) + term(2) + term(3);
        self.fixed = (0..4).any(|k| inverse_mass(k) == 0.0);
        self.began = difference(&vertices.start, self.vertices, &self.weights);
    }

    /// The part of a vector along the surfaces.
    pub(super) fn along(&self, v: DVec3) -> DVec3 {
        v - self.normal * self.normal.dot(v)
    }

    /// Moves the ends of the step's ways so that the target is kept, and less along the surfaces, as friction
    /// would have it. Returns by how much the target was missed before, and how far the closest points were moved (m).
    ///
    /// With g the gap, W = Σ wᵢ²/mᵢ, p what was done before and s the way slid:
    /// p ← max(0, p − (g − target)/W); h ← h − s/W, not longer than μ p.
    ///
    /// Repeated over all touches this finds the ends nearest to the wished ones, by mass, that keep all targets
    /// (Gauss–Seidel on the dual problem; Harmon et al. 2008 project velocities in the same way). What only
    /// widens a gap that was too narrow from the start doesn't count for friction.
    fn separate(&mut self, ends: &mut Local<'_>) -> Visit {
        let compliance = self.compliance;
        if compliance == 0.0 {
            return Visit::default();
        }
        let ended = ends.difference(&self.weights);
        let missed = self.target - self.normal.dot(ended);
        let pressed = (self.pressed + missed / compliance).max(0.0);
        if pressed == 0.0 && self.pressed == 0.0 && self.held == DVec3::ZERO {
            return Visit {
                most: missed,
                ..Visit::default()
            }; // no friction without pressure
        }
        let push = self.normal * (pressed - self.pressed);
        self.pressed = pressed;
        let widened = (self.target - self.normal.dot(self.began)).max(0.0) / compliance;
        let most = self.friction * (pressed - widened).max(0.0);
        let slid = self.along(ended - self.began);
        let held = (self.held - slid / compliance).clamp_length_max(most);
        let moved = push + held - self.held;
        self.held = held;
        ends.shift(&self.weights, moved);
        Visit {
            most: missed,
            moved: moved.length() * compliance,
            ..Visit::default()
        }
    }
}

/// Σ wᵢ aᵢ: difference of a quantity between the closest points.
#[inline]
pub(super) fn difference(of: &[DVec3], vertices: [u32; 4], weights: &[f64; 4]) -> DVec3 {
    let term = |k: usize| of[vertices[k] as usize] * weights[k];
    term(0) + term(1) + term(2) + term(3)
}

/// Passes over the touches in a round. With 10 a needle at 300 m/s ends in 19 rigid zones, with 30 in
/// 11, with 100 in 12.
const PASSES: u32 = 30;

/// Passes in which what is only too close takes part, and those in which what is pressed of it goes on: it is a wish
/// that each step repeats. A rope of folds has four touches of this kind to one that meets.
const PUSHES: [u32; 2] = [2, 10];

/// Share of what is precise enough by which closest points may be moved without their neighbours being looked at again.
const UNHEARD: f64 = 0.1;

/// Separates touches until each target is missed by `enough` (m) at most, or the passes are used up: all in
/// the first round, only those that meet later on. To hold some thousand features in a pile to the
/// last would change all ways again in each round, and all would have to be searched.
pub(super) fn separate(
    touches: &mut [Touch],
    vertices: &mut Vertices,
    halves: &mut Halves,
    first: bool,
    enough: f64,
) {
    halves.take(touches, &vertices.end, &vertices.inverse_mass);
    for pass in 0..PASSES {
        let done = halves.pass(touches, false, UNHEARD * enough, |touch, local| {
            let held = pass < PUSHES[0] || (pass < PUSHES[1] && touch.pressed > 0.0);
            (touch.meets || (first && held)).then(|| touch.separate(local))
        });
        if done.most <= enough {
            break;
        }
    }
    halves.give(&mut vertices.end);
}
