//! Symplectic (semi-implicit) Euler.

use super::Scheme;
use super::explicit::{Accelerations, update};
use crate::collision::Contacts;
use crate::linear::Solve;
use crate::model::Model;
use crate::state::State;
use glam::DVec3;

/// The scheme's pass and work array.
#[derive(Debug)]
pub(super) struct SymplecticEuler {
    pass: Accelerations,
    /// Acceleration of each particle (m/s²).
    accelerations: Vec<DVec3>,
}

impl SymplecticEuler {
    pub(super) fn new(model: &Model) -> Self {
        Self {
            pass: Accelerations::new(model),
            accelerations: vec![DVec3::ZERO; model.particles()],
        }
    }
}

impl Scheme for SymplecticEuler {
    /// v ← v + dt f(x, v)/m, then x ← x + dt v with the new velocity.
    ///
    /// Stable for dt ω ≤ 2 without damping, ω² the largest eigenvalue of M⁻¹K; first order.
    fn advance(&mut self, model: &Model, _: &mut Contacts, dt: f64, state: &mut State) -> Solve {
        self.pass.set(model, state, &mut self.accelerations);
        update(state, &mut self.accelerations, |_, x, v, a| {
            *v += *a * dt;
            *x += *v * dt;
        });
        Solve::NONE
    }
}

/// A step of x″ = a(x, v).
pub(super) fn test_step(a: impl Fn(f64, f64) -> f64, dt: f64, [x, v]: [f64; 2]) -> [f64; 2] {
    let v = v + dt * a(x, v);
    [x + dt * v, v]
}
