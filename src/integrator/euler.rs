//! Explicit (forward) Euler: the scheme that shows why not.

use super::explicit::{Accelerations, update};
use crate::model::Model;
use crate::state::State;
use glam::DVec3;

/// The scheme's pass and work array.
#[derive(Debug)]
pub struct Euler {
    pass: Accelerations,
    /// Acceleration of each particle (m/s²).
    accelerations: Vec<DVec3>,
}

impl Euler {
    pub(super) fn new(model: &Model) -> Self {
        Self {
            pass: Accelerations::new(model),
            accelerations: vec![DVec3::ZERO; model.particles()],
        }
    }

    /// x ← x + dt v, v ← v + dt f(x, v)/m, both from the old state.
    ///
    /// Feeds energy into every undamped oscillation, |amplification| = √(1 + ω² dt²) a step: stable
    /// only for dt ≤ c/ω², c the damping of the mode. First order.
    pub(super) fn advance(&mut self, model: &Model, dt: f64, state: &mut State) {
        self.pass.set(model, state, &mut self.accelerations);
        update(state, &mut self.accelerations, |_, x, v, a| {
            *x += *v * dt;
            *v += *a * dt;
        });
    }
}

/// A step of x″ = a(x, v).
pub(super) fn test_step(a: impl Fn(f64, f64) -> f64, dt: f64, [x, v]: [f64; 2]) -> [f64; 2] {
    [x + dt * v, v + dt * a(x, v)]
}
