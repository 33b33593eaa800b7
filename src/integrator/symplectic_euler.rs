//! Symplectic (semi-implicit) Euler.

use super::Scheme;
use super::explicit::{Accelerations, parts};
use crate::collision::Contacts;
use crate::linear::Solve;
use crate::model::Model;
use crate::state::State;

/// The scheme's pass.
#[derive(Debug)]
pub(super) struct SymplecticEuler {
    pass: Accelerations,
}

impl SymplecticEuler {
    pub(super) fn new(model: &Model) -> Self {
        Self {
            pass: Accelerations::new(model),
        }
    }
}

impl Scheme for SymplecticEuler {
    /// v ← v + dt f(x, v)/m, then x ← x + dt v with the new velocity.
    ///
    /// Stable for dt ω ≤ 2 without damping, ω² the largest eigenvalue of M⁻¹K; first order.
    fn advance(
        &mut self,
        model: &Model,
        _: &mut Contacts,
        dt: f64,
        before: &State,
        state: &mut State,
    ) -> Solve {
        self.pass.step(model, before, parts(state), (), |i, a| {
            let v = before.velocities[i] + a * dt;
            [before.positions[i] + v * dt, v]
        });
        Solve::NONE
    }
}

/// A step of x″ = a(x, v).
pub(super) fn test_step(a: impl Fn(f64, f64) -> f64, dt: f64, [x, v]: [f64; 2]) -> [f64; 2] {
    let v = v + dt * a(x, v);
    [x + dt * v, v]
}
