//! Implicit Euler, solved as the nonlinear equation that it is.

use super::Scheme;
use super::backward_euler::{BackwardEuler, Nonlinear, Stage, aim};
use crate::collision::Contacts;
use crate::linear::Solve;
use crate::model::Model;
use crate::state::{Archive, State};

/// The scheme at work.
#[derive(Debug)]
pub(super) struct Newton {
    stage: BackwardEuler,
    start: State,
}

impl Newton {
    pub(super) fn new(model: &Model, settings: Nonlinear) -> Self {
        Self {
            stage: BackwardEuler::new(model, settings),
            start: State::at_rest(vec![glam::DVec3::ZERO; model.particles()]),
        }
    }
}

impl Scheme for Newton {
    fn advance(
        &mut self,
        model: &Model,
        contacts: &mut Contacts,
        dt: f64,
        before: &State,
        state: &mut State,
    ) -> Solve {
        state.copy_from(before);
        step(&mut self.stage, &mut self.start, model, contacts, dt, state)
    }

    fn carry(&mut self, _: &Model, archive: &mut Archive) {
        self.stage.carry(archive);
    }
}

/// M (v₁ − v₀) = dt f(x₁, v₁), x₁ = x₀ + dt v₁. First order; damps every oscillation, by a ratio of
/// ω dt/2 of the critical one. `start` becomes x₀ and v₀.
pub(super) fn step(
    solver: &mut BackwardEuler,
    start: &mut State,
    model: &Model,
    contacts: &mut Contacts,
    dt: f64,
    state: &mut State,
) -> Solve {
    start.copy_from(state);
    let velocities = &mut state.velocities;
    aim(model, state.time + dt, dt, start, velocities);
    let stage = Stage {
        start,
        gamma: dt,
        dt,
        positions: &start.positions,
        share: 1.0,
    };
    let solve = solver.solve(model, contacts, stage, velocities);
    for (x, v) in state.positions.iter_mut().zip(velocities) {
        *x += *v * dt;
    }
    solve
}
