//! The backward differentiation formula of second order.
//!
//! Source: Curtiss and Hirschfelder 1952; with steps of different length, Hairer, Nørsett and Wanner
//! 1993, section III.5; on cloth Choi and Ko 2002.

use super::Scheme;
use super::backward_euler::{BackwardEuler, Nonlinear, Stage, aim};
use crate::collision::Contacts;
use crate::linear::Solve;
use crate::model::Model;
use crate::state::{Archive, State};
use glam::DVec3;
use std::any::Any;

/// The scheme at work.
#[derive(Debug)]
pub(super) struct Bdf2 {
    stage: BackwardEuler,
    /// x̄ and v̄.
    start: State,
    /// What the scheme remembers of the last step.
    history: History,
    /// `history` as it was when a step was first tried.
    remembered: History,
}

/// The last step.
#[derive(Clone, Debug)]
struct History {
    /// Its length (s); 0 before the first.
    dt: f64,
    /// The state that it started from.
    previous: State,
    /// The state that it left, before limits and contact changed it.
    left: State,
}

impl Bdf2 {
    pub(super) fn new(model: &Model, settings: Nonlinear) -> Self {
        let nowhere = State::at_rest(vec![DVec3::ZERO; model.particles()]);
        let history = History {
            dt: 0.0,
            previous: nowhere.clone(),
            left: nowhere.clone(),
        };
        Self {
            stage: BackwardEuler::new(model, settings),
            start: nowhere,
            remembered: history.clone(),
            history,
        }
    }
}

impl Scheme for Bdf2 {
    /// With ρ = dt/(the last dt): x₁ = a x₀ − b x₋₁ + γ v₁ and likewise M v₁ = M (a v₀ − b v₋₁) + γ f(x₁, v₁),
    /// a = (1 + ρ)²/(1 + 2ρ), b = ρ²/(1 + 2ρ), γ = dt (1 + ρ)/(1 + 2ρ); 4/3, 1/3 and ⅔ dt for equal steps.
    /// Second order; damps what a step is too long to see, and slow motion far less than implicit Euler,
    /// with which it starts.
    fn advance(
        &mut self,
        model: &Model,
        contacts: &mut Contacts,
        dt: f64,
        before: &State,
        state: &mut State,
    ) -> Solve {
        state.copy_from(before);
        let History {
            dt: last,
            previous,
            left,
        } = &mut self.history;
        // Without history ρ = 0 is implicit Euler. So begins the first step, and one that follows much
        // shorter ones, after a step in parts: the formula is unstable for ρ > 1 + √2.
        let ratio = if *last > 0.0 && dt <= 2.1 * *last {
            dt / *last
        } else {
            0.0
        };
        let (a, b) = (
            (1.0 + ratio).powi(2) / (1.0 + 2.0 * ratio),
            ratio * ratio / (1.0 + 2.0 * ratio),
        );
        let gamma = dt * (1.0 + ratio) / (1.0 + 2.0 * ratio);
        self.start.copy_from(state);
        for i in 0..state.positions.len() {
            let (x, v) = (state.positions[i], state.velocities[i]);
            // Limits and contact made the state jump. The history jumps along: it keeps its acceleration,
            // so that a particle that was stopped isn't thrown back.
            let jump = v - left.velocities[i];
            let old_v = previous.velocities[i] + jump;
            let old_x = previous.positions[i] + (x - left.positions[i]) - jump * *last;
            if ratio > 0.0 && !model.is_pinned(i) {
                self.start.positions[i] = x * a - old_x * b;
                self.start.velocities[i] = v * a - old_v * b;
            }
        }
        previous.copy_from(state);
        let velocities = &mut state.velocities;
        aim(model, state.time + dt, gamma, &mut self.start, velocities);
        let stage = Stage {
            start: &self.start,
            gamma,
            dt,
            positions: &state.positions,
            share: 1.0,
        };
        let solve = self.stage.solve(model, contacts, stage, velocities);
        for (i, v) in velocities.iter().enumerate() {
            state.positions[i] = self.start.positions[i] + *v * gamma;
        }
        *last = dt;
        left.copy_from(state);
        solve
    }

    fn remember(&mut self) {
        self.remembered.copy_from(&self.history);
    }

    fn recall(&mut self) {
        self.history.copy_from(&self.remembered);
    }

    fn follow(&mut self, other: &dyn Scheme) {
        if let Some(other) = (other as &dyn Any).downcast_ref::<Self>() {
            self.history.copy_from(&other.history);
        }
    }

    fn carry(&mut self, _: &Model, archive: &mut Archive) {
        let History { dt, previous, left } = &mut self.history;
        archive.real(dt);
        previous.carry(archive);
        left.carry(archive);
        self.stage.carry(archive);
    }
}

impl History {
    fn copy_from(&mut self, other: &Self) {
        self.dt = other.dt;
        self.previous.copy_from(&other.previous);
        self.left.copy_from(&other.left);
    }
}
