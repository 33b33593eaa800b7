//! Explicit (forward) Euler: the scheme that shows why not.

use super::Scheme;
use super::explicit::{Accelerations, update};
use crate::collision::Contacts;
use crate::linear::Solve;
use crate::model::Model;
use crate::state::State;
use glam::DVec3;

/// The scheme's pass and work array.
#[derive(Debug)]
pub(super) struct Euler {
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
}

impl Scheme for Euler {
    /// x ← x + dt v, v ← v + dt f(x, v)/m, both from the old state.
    ///
    /// Feeds energy into every undamped oscillation, |amplification| = √(1 + ω² dt²) a step: stable
    /// only for dt ≤ c/ω², c the damping of the mode. First order.
    fn advance(&mut self, model: &Model, _: &mut Contacts, dt: f64, state: &mut State) -> Solve {
        self.pass.set(model, state, &mut self.accelerations);
        update(state, &mut self.accelerations, |_, x, v, a| {
            *x += *v * dt;
            *v += *a * dt;
        });
        Solve::NONE
    }
}

/// A step of x″ = a(x, v).
pub(super) fn test_step(a: impl Fn(f64, f64) -> f64, dt: f64, [x, v]: [f64; 2]) -> [f64; 2] {
    [x + dt * v, v + dt * a(x, v)]
}
