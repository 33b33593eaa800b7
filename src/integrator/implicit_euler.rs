//! Implicit Euler with one linearised solve a step.
//!
//! Source: Baraff and Witkin 1998, with the new velocity itself as the unknown:
//!
//! (M − dt ∂f/∂v − dt² ∂f/∂x) v₁ = M v₀ + dt f(x₀),   x₁ = x₀ + dt v₁
//!
//! where f holds all forces but damping, which is linear in the velocity and stands on the left
//! alone. This is theirs with v₁ = v₀ + Δv; the term dt² ∂f/∂x v₀ of their right hand side is gone.
//!
//! The equation itself never makes energy; its linearisation does where springs turn or snap by much in a
//! step, and a pressed chain at long steps is torn apart by it. So what a step makes is measured, and one
//! with which it would exceed a tenth of the cloth's energy is solved whole instead, as `newton` does.

use super::Scheme;
use super::backward_euler::{BackwardEuler, Nonlinear};
use super::constraint::{prescribe, pressed, update_grips};
use super::linear_system::{Linear, LinearSystem};
use super::newton;
use super::surplus::Surplus;
use crate::collision::{Contact, Contacts};
use crate::energy::{elastic, kinetic};
use crate::force::Force as _;
use crate::linear::Solve;
use crate::model::Model;
use crate::state::{Archive, State};
use glam::DVec3;
use std::any::Any;

/// Solves of a step that is solved whole.
const WHOLE: (f64, u32) = (1e-3, 50);

/// Work arrays of the scheme.
#[derive(Debug)]
pub(super) struct ImplicitEuler {
    linear: Linear,
    /// M − dt ∂f/∂v − dt² ∂f/∂x.
    system: LinearSystem,
    /// M v₀ + dt f(x₀) of each particle (N·s).
    impulses: Vec<DVec3>,
    surplus: Surplus,
    /// What solves a step whole; made when one first has to.
    whole: Option<(BackwardEuler, State)>,
}

impl ImplicitEuler {
    pub(super) fn new(model: &Model, linear: Linear) -> Self {
        Self {
            linear,
            system: LinearSystem::new(model, linear),
            impulses: vec![DVec3::ZERO; model.particles()],
            surplus: Surplus::default(),
            whole: None,
        }
    }

    /// The linearised step.
    fn step(
        &mut self,
        model: &Model,
        contacts: &mut Contacts,
        dt: f64,
        state: &mut State,
    ) -> Solve {
        let Self {
            linear,
            system,
            impulses,
            ..
        } = self;
        system.constrain(model, contacts);
        // Both sides of the equation; neither needs the other.
        rayon::join(
            || system.assemble(model, dt, state),
            || set_impulses(impulses, model, contacts, dt, state),
        );
        model.aim(dt, state);
        let velocities = &mut state.velocities;
        let closing = |contact: &Contact| -contact.gap.max(0.0) / dt;
        prescribe(model, contacts, closing, velocities);
        system.balance_momentum(model, impulses, velocities);
        let floor = free_fall(model, dt);
        let solve = system.solve(impulses, velocities, linear.tolerance, floor);
        system.balance_momentum(model, impulses, velocities);
        update_grips(model, contacts, system.residual(), 1.0, velocities);
        for (x, v) in state.positions.iter_mut().zip(&state.velocities) {
            *x += *v * dt;
        }
        solve
    }

    /// What solves a step whole.
    fn whole(&mut self, model: &Model) -> &mut (BackwardEuler, State) {
        let (residual, iterations) = WHOLE;
        let settings = Nonlinear {
            residual,
            iterations,
            linear: self.linear,
        };
        self.whole.get_or_insert_with(|| {
            let start = State::at_rest(vec![DVec3::ZERO; model.particles()]);
            (BackwardEuler::new(model, settings), start)
        })
    }

    /// The step solved whole.
    fn step_whole(
        &mut self,
        model: &Model,
        contacts: &mut Contacts,
        dt: f64,
        state: &mut State,
    ) -> Solve {
        let (stage, start) = self.whole(model);
        stage.begin_at_rest(&state.velocities);
        newton::step(stage, start, model, contacts, dt, state)
    }
}

impl Scheme for ImplicitEuler {
    fn advance(
        &mut self,
        model: &Model,
        contacts: &mut Contacts,
        dt: f64,
        before: &State,
        state: &mut State,
    ) -> Solve {
        state.copy_from(before);
        // Driven pins and moving obstacles do work, whose part in what is made isn't known here.
        if model.driven().next().is_some() || contacts.any_moves() {
            return self.step(model, contacts, dt, state);
        }
        self.surplus.begin(contacts);
        let own = |state: &State| kinetic(model, state) + elastic(model, state);
        let total_before = own(state) + model.gravity.energy(state);
        let solve = self.step(model, contacts, dt, state);
        let own = own(state);
        let made = own + model.gravity.energy(state) - total_before;
        // One step's fall counts as nothing.
        let floor = free_fall(model, dt).powi(2);
        if !made.is_finite() || self.surplus.book(made, own, floor) {
            return solve; // what is no number is not the linearisation's fault alone: halves are tried
        }
        self.surplus.take_back(before, contacts, state);
        let damped = self.step_whole(model, contacts, dt, state);
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

    fn carry(&mut self, model: &Model, archive: &mut Archive) {
        self.surplus.carry(archive);
        self.system.carry(archive);
        let mut needed = self.whole.is_some();
        archive.flag(&mut needed);
        if needed {
            self.whole(model).0.carry(archive);
        }
    }
}

/// The scale below which residuals don't matter: the impulse of free fall of what isn't pinned during a
/// time (s), weighted by M^-½ (N·s/√kg).
pub(super) fn free_fall(model: &Model, time: f64) -> f64 {
    let each = model.masses.iter().zip(&model.inverse_masses);
    let mass: f64 = each.map(|(m, w)| if *w > 0.0 { *m } else { 0.0 }).sum();
    time * model.gravity.acceleration.length() * mass.sqrt()
}

/// M v₀ + dt f(x₀), and the friction of particles that slide.
fn set_impulses(
    impulses: &mut [DVec3],
    model: &Model,
    contacts: &Contacts,
    dt: f64,
    state: &State,
) {
    impulses.fill(DVec3::ZERO);
    for force in model.forces() {
        force.add_forces(state, impulses);
    }
    for (impulse, (&m, &v)) in impulses
        .iter_mut()
        .zip(model.masses.iter().zip(&state.velocities))
    {
        *impulse = *impulse * dt + v * m;
    }
    for (contact, grip) in pressed(model, contacts) {
        impulses[contact.particle] += grip.drag;
    }
}
