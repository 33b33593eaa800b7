//! The implicit midpoint rule.

use super::Scheme;
use super::backward_euler::{BackwardEuler, Nonlinear, Stage, aim};
use super::constraint::pressed;
use crate::collision::Contacts;
use crate::linear::Solve;
use crate::model::Model;
use crate::state::State;
use glam::DVec3;

/// The scheme at work; one entry a particle.
#[derive(Debug)]
pub(super) struct ImplicitMidpoint {
    stage: BackwardEuler,
    start: State,
    /// Velocities in the middle of the step (m/s).
    middle: Vec<DVec3>,
}

impl ImplicitMidpoint {
    pub(super) fn new(model: &Model, settings: Nonlinear) -> Self {
        let zero = vec![DVec3::ZERO; model.particles()];
        Self {
            stage: BackwardEuler::new(model, settings),
            start: State::at_rest(zero.clone()),
            middle: zero,
        }
    }
}

impl Scheme for ImplicitMidpoint {
    /// M (v₁ − v₀) = dt f(x½, v½), x₁ = x₀ + dt v½ with x½, v½ the means of start and end: a backward
    /// Euler stage of half the step, gone twice as far. Second order, symplectic, of amplification 1 for
    /// every oscillation: what a step is too long to see keeps ringing.
    fn advance(
        &mut self,
        model: &Model,
        contacts: &mut Contacts,
        dt: f64,
        state: &mut State,
    ) -> Solve {
        self.start.copy_from(state);
        self.middle.copy_from_slice(&state.velocities);
        let (time, gamma) = (state.time + 0.5 * dt, 0.5 * dt);
        aim(model, time, gamma, &mut self.start, &mut self.middle);
        let stage = Stage {
            start: &self.start,
            gamma,
            dt,
            positions: &self.start.positions,
            share: 0.5,
        };
        let solve = self.stage.solve(model, contacts, stage, &mut self.middle);
        for (i, &middle) in self.middle.iter().enumerate() {
            state.positions[i] += middle * dt;
            state.velocities[i] = if model.is_pinned(i) {
                middle
            } else {
                middle * 2.0 - self.start.velocities[i]
            };
        }
        // A contact's velocity is what the constraint gives, not twice that less the old one.
        for (contact, grip) in pressed(model, contacts) {
            let (i, n) = (contact.particle, contact.normal);
            let (middle, v) = (self.middle[i], &mut state.velocities[i]);
            *v = if grip.sticks {
                middle
            } else {
                *v + n * n.dot(middle - *v)
            };
        }
        solve
    }
}
