//! Explicit (forward) Euler: the scheme that shows why not.

use super::Scheme;
use super::explicit::{Accelerations, parts};
use crate::collision::Contacts;
use crate::linear::Solve;
use crate::model::Model;
use crate::state::State;

/// The scheme's pass.
#[derive(Debug)]
pub(super) struct Euler {
    pass: Accelerations,
}

impl Euler {
    pub(super) fn new(model: &Model) -> Self {
        Self {
            pass: Accelerations::new(model),
        }
    }
}

impl Scheme for Euler {
    /// x ← x + dt v, v ← v + dt f(x, v)/m, both from the old state.
    ///
    /// Feeds energy into every undamped oscillation, |amplification| = √(1 + ω² dt²) a step: stable
    /// only for dt ≤ c/ω², c the damping of the mode. First order.
    fn advance(
        &mut self,
        model: &Model,
        _: &mut Contacts,
        dt: f64,
        before: &State,
        state: &mut State,
    ) -> Solve {
        self.pass.step(model, before, parts(state), (), |i, a| {
            let v = before.velocities[i];
            [before.positions[i] + v * dt, v + a * dt]
        });
        Solve::NONE
    }
}

/// A step of x″ = a(x, v).
pub(super) fn test_step(a: impl Fn(f64, f64) -> f64, dt: f64, [x, v]: [f64; 2]) -> [f64; 2] {
    [x + dt * v, v + dt * a(x, v)]
}
