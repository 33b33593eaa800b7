//! The implicit midpoint rule, damped where it would make energy.
//!
//! The rule takes the work of a force along a step from the force in the middle. That is exact where the
//! energy is quadratic. Elsewhere a step makes
//!
//! δ = U(x₁) − U(x₀) + (x₁ − x₀) · f(x½)
//!
//! by itself: of order dt³ and of changing sign where the step resolves the motion, and without bound
//! where stiff cloth rings. So δ, less what damping and friction took, is added up, and a step with which
//! it would exceed a tenth of the cloth's energy is taken by implicit Euler instead, which has what rings
//! gone at once. Runs that resolve their motion have no such step.
//!
//! Source: Simo, Tarnow and Wong 1992 (that the rule makes energy, and blows up, on stiff nonlinear
//! springs).

use super::Scheme;
use super::backward_euler::{BackwardEuler, Nonlinear, Stage, aim};
use super::constraint::pressed;
use super::implicit_euler::free_fall;
use super::newton;
use super::surplus::Surplus;
use crate::collision::Contacts;
use crate::energy::{elastic, kinetic};
use crate::force::Force as _;
use crate::linear::Solve;
use crate::model::Model;
use crate::state::{Archive, State};
use glam::DVec3;
use std::any::Any;

/// The scheme at work; one entry a particle.
#[derive(Debug)]
pub(super) struct ImplicitMidpoint {
    stage: BackwardEuler,
    start: State,
    /// Velocities in the middle of the step (m/s).
    middle: Vec<DVec3>,
    surplus: Surplus,
}

impl ImplicitMidpoint {
    pub(super) fn new(model: &Model, settings: Nonlinear) -> Self {
        let zero = vec![DVec3::ZERO; model.particles()];
        Self {
            stage: BackwardEuler::new(model, settings),
            start: State::at_rest(zero.clone()),
            surplus: Surplus::default(),
            middle: zero,
        }
    }

    /// M (v₁ − v₀) = dt f(x½, v½), x₁ = x₀ + dt v½ with x½, v½ the means of start and end: a backward
    /// Euler stage of half the step, gone twice as far. Second order, symplectic, of amplification 1 for
    /// every oscillation: what a step is too long to see keeps ringing.
    fn step(
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
            let v = &mut state.velocities[i];
            let given = contact.velocity_after + contact.against(self.middle[i]);
            *v = if grip.sticks {
                given
            } else {
                *v + n * n.dot(given - *v)
            };
        }
        solve
    }

    /// Energy (J) that the last step made, from the elastic energies at its ends and the work of the forces
    /// in between.
    fn made(&self, dt: f64, [before, after]: [f64; 2]) -> f64 {
        after - before + dt * self.stage.power
    }

    /// ½ Σ m |v₁ − v₀|² (J): what implicit Euler loses of the motion besides.
    fn lost(&self, model: &Model, state: &State) -> f64 {
        let velocities = state.velocities.iter().zip(&self.start.velocities);
        let each = model.masses.iter().zip(velocities);
        each.map(|(m, (v, start))| 0.5 * m * v.distance_squared(*start))
            .sum()
    }
}

impl Scheme for ImplicitMidpoint {
    fn advance(
        &mut self,
        model: &Model,
        contacts: &mut Contacts,
        dt: f64,
        before: &State,
        state: &mut State,
    ) -> Solve {
        state.copy_from(before);
        self.surplus.begin(contacts);
        let elastic_before = elastic(model, state);
        let moving = |state: &State| kinetic(model, state) + model.gravity.energy(state);
        let moving_before = moving(state);
        let solve = self.step(model, contacts, dt, state);
        let elastic_after = elastic(model, state);
        let mut made = self.made(dt, [elastic_before, elastic_after]);
        if !solve.converged && model.driven().next().is_none() && !contacts.any_moves() {
            // What is left of the equation has made motion that no force explains.
            let gained = moving(state) - moving_before + elastic_after - elastic_before;
            made = if gained > made { gained } else { made };
        }
        // One step's fall, and what rounding may make of the springs.
        let floor = free_fall(model, dt).powi(2) + self.stage.rounding(model).powi(2);
        let energy = kinetic(model, state) + elastic_after;
        if self.surplus.book(made, energy, floor) {
            return solve;
        }
        self.surplus.take_back(before, contacts, state);
        let Self { stage, start, .. } = self;
        stage.begin_at_rest(&state.velocities);
        let damped = newton::step(stage, start, model, contacts, dt, state);
        let elastic_after = elastic(model, state);
        let made = self.made(dt, [elastic_before, elastic_after]) - self.lost(model, state);
        let energy = kinetic(model, state) + elastic_after;
        self.surplus.book(made.min(0.0), energy, floor);
        Solve {
            iterations: solve.iterations + damped.iterations,
            damped: true,
            ..damped
        }
    }

    fn remember(&mut self) {
        self.surplus.remember();
    }

    fn recall(&mut self) {
        self.surplus.recall();
    }

    fn follow(&mut self, other: &dyn Scheme) {
        if let Some(other) = (other as &dyn Any).downcast_ref::<Self>() {
            self.surplus.follow(&other.surplus);
        }
    }

    fn carry(&mut self, _: &Model, archive: &mut Archive) {
        self.surplus.carry(archive);
        self.stage.carry(archive);
    }
}
