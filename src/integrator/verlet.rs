//! Velocity Verlet, with damping.
//!
//! Source: Swope et al. 1982; the prediction of the velocity is that of Groot and Warren 1997 with
//! λ = 1.

use super::Scheme;
use super::explicit::update;
use crate::collision::Contacts;
use crate::force::ForcePass;
use crate::linear::Solve;
use crate::model::Model;
use crate::state::State;
use glam::DVec3;
use std::any::Any;

/// The scheme's pass and work arrays; one entry a particle.
#[derive(Debug)]
pub(super) struct Verlet {
    pass: ForcePass,
    /// Forces of the laws (N) at `at`, which the next step begins with.
    forces: Vec<DVec3>,
    /// Positions at which `forces` was taken (m), where limits or contact may have moved particles since;
    /// empty without them.
    at: Vec<DVec3>,
    /// Releases of pins that had happened then: they change stiffnesses. None before the first step.
    released: Option<usize>,
    /// Forces of damping (N).
    damping: Vec<DVec3>,
    /// Velocities in the middle of the step (m/s).
    middle: Vec<DVec3>,
}

impl Verlet {
    pub(super) fn new(model: &Model) -> Self {
        let zero = vec![DVec3::ZERO; model.particles()];
        let moves = model.strain_limit.is_some() || !model.obstacles.is_empty();
        Self {
            pass: model.force_pass(),
            forces: zero.clone(),
            at: vec![DVec3::ZERO; if moves { model.particles() } else { 0 }],
            released: None,
            damping: zero.clone(),
            middle: zero,
        }
    }
}

impl Scheme for Verlet {
    /// v½ = v₀ + dt/2 a(x₀, v₀), x₁ = x₀ + dt v½, v₁ = v½ + dt/2 a(x₁, v̂) with v̂ = v₀ + dt a(x₀, v₀).
    ///
    /// Damping asks for v₁ itself on the right; the prediction v̂ is off by dt², which leaves the
    /// scheme of second order. Without damping it is symplectic and stable for dt ω ≤ 2. One pass of
    /// the laws' forces a step.
    fn advance(
        &mut self,
        model: &Model,
        _: &mut Contacts,
        dt: f64,
        before: &State,
        state: &mut State,
    ) -> Solve {
        let Self {
            pass,
            forces,
            at,
            damping,
            middle,
            released,
        } = self;
        if *released != Some(model.released()) {
            *pass = model.force_pass(); // hinges at clamps have changed
        }
        // Where pins are driven differs in the last bit from where they were driven to.
        let stays = |i: usize| at[i] == before.positions[i] || model.is_pinned(i);
        if *released != Some(model.released()) || !(0..at.len()).all(stays) {
            *released = Some(model.released());
            pass.set_laws(before, forces);
        }
        pass.set_dampings(before, damping);
        let half = |i: usize| 0.5 * dt * model.inverse_masses[i];
        update(state, middle, |i, x, v, middle| {
            let gain = (forces[i] + damping[i]) * half(i);
            *middle = before.velocities[i] + gain;
            *x = before.positions[i] + *middle * dt;
            *v = *middle + gain;
        });
        state.time = before.time + dt;
        model.drive(state);
        pass.set_laws(state, forces);
        pass.set_dampings(state, damping);
        let moves = at.len();
        at.copy_from_slice(&state.positions[..moves]);
        update(state, middle, |i, _, v, middle| {
            *v = *middle + (forces[i] + damping[i]) * half(i);
        });
        Solve::NONE
    }

    fn follow(&mut self, other: &dyn Scheme) {
        let Some(other) = (other as &dyn Any).downcast_ref::<Self>() else {
            return;
        };
        if self.released == other.released {
            self.forces.copy_from_slice(&other.forces);
            self.at.copy_from_slice(&other.at);
        } else {
            self.released = None;
        }
    }
}

/// A step of x″ = a(x, v).
pub(super) fn test_step(a: impl Fn(f64, f64) -> f64, dt: f64, [x, v]: [f64; 2]) -> [f64; 2] {
    let gain = 0.5 * dt * a(x, v);
    let middle = v + gain;
    let moved = x + dt * middle;
    [moved, middle + 0.5 * dt * a(moved, middle + gain)]
}
