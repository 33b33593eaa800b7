//! Symplectic (semi-implicit) Euler.

use crate::linear::Solve;
use crate::model::Model;
use crate::state::State;
use glam::DVec3;

/// Work array of the scheme.
#[derive(Debug)]
pub struct SymplecticEuler {
    /// Force on each particle (N).
    forces: Vec<DVec3>,
}

impl SymplecticEuler {
    pub(super) fn new(model: &Model) -> Self {
        Self {
            forces: vec![DVec3::ZERO; model.particles()],
        }
    }

    /// v ← v + dt f(x, v)/m, then x ← x + dt v with the new velocity.
    ///
    /// Stable for dt ω ≤ 2 without damping, ω² the largest eigenvalue of M⁻¹K; first order.
    pub(super) fn advance(&mut self, model: &Model, dt: f64, state: &mut State) -> Solve {
        self.forces.fill(DVec3::ZERO);
        for force in model.forces() {
            force.add_forces(state, &mut self.forces);
        }
        for damping in model.dampings() {
            damping.add_forces(state, &mut self.forces);
        }
        for i in 0..self.forces.len() {
            state.velocities[i] += self.forces[i] * (dt * model.inverse_masses[i]);
            state.positions[i] += state.velocities[i] * dt;
        }
        Solve {
            converged: true,
            ..Solve::default()
        }
    }
}
