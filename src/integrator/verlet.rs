//! Velocity Verlet, with damping.
//!
//! Source: Swope et al. 1982; the prediction of the velocity is that of Groot and Warren 1997 with
//! λ = 1.

use super::Scheme;
use crate::collision::Contacts;
use crate::linear::Solve;
use crate::model::Model;
use crate::state::State;
use glam::DVec3;

/// Work arrays of the scheme; one entry a particle.
#[derive(Debug)]
pub(super) struct Verlet {
    /// Forces of the laws (N) at `at`, which the next step begins with.
    forces: Vec<DVec3>,
    /// Positions at which `forces` was taken (m): limits and contact may have moved particles since.
    at: Vec<DVec3>,
    /// Releases of pins that had happened then: they change stiffnesses.
    released: usize,
    /// Forces of damping (N).
    damping: Vec<DVec3>,
    /// Velocities in the middle of the step (m/s).
    middle: Vec<DVec3>,
}

impl Verlet {
    pub(super) fn new(model: &Model) -> Self {
        let zero = vec![DVec3::ZERO; model.particles()];
        Self {
            forces: zero.clone(),
            // Nowhere: the first step takes the forces.
            at: vec![DVec3::NAN; model.particles()],
            released: 0,
            damping: zero.clone(),
            middle: zero,
        }
    }

    fn take_forces(&mut self, model: &Model, state: &State) {
        self.forces.fill(DVec3::ZERO);
        for force in model.forces() {
            force.add_forces(state, &mut self.forces);
        }
        self.at.copy_from_slice(&state.positions);
        self.released = model.released();
    }

    fn take_damping(&mut self, model: &Model, state: &State) {
        self.damping.fill(DVec3::ZERO);
        for damping in model.dampings() {
            damping.add_forces(state, &mut self.damping);
        }
    }
}

impl Scheme for Verlet {
    /// v½ = v₀ + dt/2 a(x₀, v₀), x₁ = x₀ + dt v½, v₁ = v½ + dt/2 a(x₁, v̂) with v̂ = v₀ + dt a(x₀, v₀).
    ///
    /// Damping asks for v₁ itself on the right; the prediction v̂ is off by dt², which leaves the
    /// scheme of second order. Without damping it is symplectic and stable for dt ω ≤ 2. One pass of
    /// the laws' forces a step.
    fn advance(&mut self, model: &Model, _: &mut Contacts, dt: f64, state: &mut State) -> Solve {
        if self.at != state.positions || self.released != model.released() {
            self.take_forces(model, state);
        }
        self.take_damping(model, state);
        for i in 0..self.middle.len() {
            let gain = (self.forces[i] + self.damping[i]) * (0.5 * dt * model.inverse_masses[i]);
            self.middle[i] = state.velocities[i] + gain;
            state.positions[i] += self.middle[i] * dt;
            state.velocities[i] = self.middle[i] + gain;
        }
        state.time += dt;
        model.drive(state);
        self.take_forces(model, state);
        self.take_damping(model, state);
        for i in 0..self.middle.len() {
            let gain = (self.forces[i] + self.damping[i]) * (0.5 * dt * model.inverse_masses[i]);
            state.velocities[i] = self.middle[i] + gain;
        }
        Solve::NONE
    }
}

/// A step of x″ = a(x, v).
pub(super) fn test_step(a: impl Fn(f64, f64) -> f64, dt: f64, [x, v]: [f64; 2]) -> [f64; 2] {
    let gain = 0.5 * dt * a(x, v);
    let middle = v + gain;
    let moved = x + dt * middle;
    [moved, middle + 0.5 * dt * a(moved, middle + gain)]
}
