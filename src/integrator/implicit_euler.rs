//! Implicit Euler with one linearised solve a step.
//!
//! Source: Baraff and Witkin 1998, with the new velocity itself as the unknown:
//!
//! (M − dt ∂f/∂v − dt² ∂f/∂x) v₁ = M v₀ + dt f(x₀),   x₁ = x₀ + dt v₁
//!
//! where f holds all forces but damping, which is linear in the velocity and stands on the left
//! alone. This is theirs with v₁ = v₀ + Δv; the term dt² ∂f/∂x v₀ of their right hand side is gone.

use super::constraint::{Constraint, closing_velocity, constrain, pressed, regrip};
use crate::collision::Contacts;
use crate::force::{Damping, Jacobian, Stiffness};
use crate::linear::{
    Assembly, ConjugateGradient, Limits, PairMatrix, Pattern, Slot, Solve, System,
};
use crate::model::{Cloth, Model};
use crate::state::State;
use glam::{DMat3, DVec3};

/// Work arrays of the scheme; one entry a particle unless it says otherwise.
#[derive(Debug)]
pub struct ImplicitEuler {
    linear_tolerance: f64,
    /// M − dt ∂f/∂v − dt² ∂f/∂x.
    matrix: PairMatrix,
    /// Slots in the matrix of each stiffness, then of each damping.
    slots: Vec<Vec<Slot>>,
    /// M v₀ + dt f(x₀) (N·s).
    impulses: Vec<DVec3>,
    constraints: Vec<Constraint>,
    /// Preconditioner: the inverse of each diagonal block on the free directions.
    inverse: Vec<DMat3>,
    solver: ConjugateGradient,
    /// A v, while momentum is balanced.
    product: Vec<DVec3>,
}

/// Iterations after which a solve is taken as it is, and counted: `drape` takes 40 on average.
const MAX_ITERATIONS: u32 = 2000;

impl ImplicitEuler {
    pub(super) fn new(model: &Model, linear_tolerance: f64) -> Self {
        let particles = model.particles();
        let mut patterns: Vec<Pattern> = model.stiffnesses().map(Stiffness::pattern).collect();
        patterns.extend(model.dampings().map(Damping::pattern));
        let matrix = PairMatrix::with_patterns(particles, &patterns);
        let slots = patterns.iter().map(|pattern| matrix.slots(pattern));
        Self {
            linear_tolerance,
            slots: slots.collect(),
            matrix,
            impulses: vec![DVec3::ZERO; particles],
            constraints: vec![Constraint::Free; particles],
            inverse: vec![DMat3::ZERO; particles],
            solver: ConjugateGradient::new(particles),
            product: vec![DVec3::ZERO; particles],
        }
    }

    pub(super) fn advance(
        &mut self,
        model: &Model,
        contacts: &mut Contacts,
        dt: f64,
        state: &mut State,
    ) -> Solve {
        constrain(model, contacts, &mut self.constraints);
        self.prepare(model, contacts, dt, state);
        self.guess(model, contacts, dt, state);
        let solve = self.solve(model, dt, state);
        self.update_grips(contacts, state);
        for (x, v) in state.positions.iter_mut().zip(&state.velocities) {
            *x += *v * dt;
        }
        solve
    }

    /// Both sides of the equation; neither needs the other.
    fn prepare(&mut self, model: &Model, contacts: &Contacts, dt: f64, state: &State) {
        let Self {
            matrix,
            slots,
            inverse,
            impulses,
            ..
        } = self;
        rayon::join(
            || {
                assemble(matrix, slots, model, dt, state);
                matrix.diagonal(inverse);
            },
            || set_impulses(impulses, model, contacts, dt, state),
        );
    }

    /// Inverts the preconditioner's blocks, and sets the velocities from which the solve starts: the
    /// old ones where nothing is prescribed.
    fn guess(&mut self, model: &Model, contacts: &Contacts, dt: f64, state: &mut State) {
        for (i, constraint) in self.constraints.iter().enumerate() {
            self.inverse[i] = constraint.inverse(self.inverse[i]);
            if *constraint == Constraint::Fixed {
                state.velocities[i] = DVec3::ZERO;
            }
        }
        model.aim(dt, state);
        for (contact, grip) in pressed(model, contacts) {
            let v = &mut state.velocities[contact.particle];
            let tangential = if grip.sticks {
                DVec3::ZERO
            } else {
                *v - contact.normal * v.dot(contact.normal)
            };
            *v = tangential + contact.normal * closing_velocity(contact, dt);
        }
    }

    /// Solves for the new velocities, and gives every free cloth exactly the momentum it is due.
    fn solve(&mut self, model: &Model, dt: f64, state: &mut State) -> Solve {
        self.balance_momentum(model, dt, state);
        let g = model.gravity.acceleration.length();
        let mass: f64 = model.masses.iter().sum();
        // The scale below which residuals don't matter: the impulse of one step's free fall.
        let floor = dt * g * mass.sqrt();
        let limits = Limits {
            tolerance: self.linear_tolerance,
            floor,
            max_iterations: MAX_ITERATIONS,
        };
        let system = System {
            matrix: &self.matrix,
            inverse: &self.inverse,
            b: &self.impulses,
        };
        let solve = self.solver.solve(system, &mut state.velocities, limits);
        self.balance_momentum(model, dt, state);
        solve
    }

    /// Shifts the velocity of every unconstrained cloth so that its residuals sum to zero.
    ///
    /// Inner forces sum to zero, so the sum of the residuals b − A v is the momentum that is still
    /// missing; a uniform velocity of it over Σ (m + dt c m) supplies it. This makes free fall exact
    /// and keeps momentum to rounding at any tolerance.
    fn balance_momentum(&mut self, model: &Model, dt: f64, state: &mut State) {
        let free = |cloth: &Cloth| {
            self.constraints[cloth.particles.clone()]
                .iter()
                .all(|c| *c == Constraint::Free)
        };
        if !model.cloths.iter().any(free) {
            return;
        }
        self.matrix.multiply(&state.velocities, &mut self.product);
        for cloth in model.cloths.iter().filter(|cloth| free(cloth)) {
            let range = cloth.particles.clone();
            let missing: DVec3 = range
                .clone()
                .map(|i| self.impulses[i] - self.product[i])
                .sum();
            let drag = |i| {
                model
                    .mass_damping
                    .as_ref()
                    .map_or(0.0, |damping| dt * damping.drag[i])
            };
            let inertia: f64 = range.clone().map(|i| model.masses[i] + drag(i)).sum();
            for v in &mut state.velocities[range] {
                *v += missing / inertia;
            }
        }
    }

    /// What the constraints had to supply, A v₁ − b, says how each contact goes on. One that lets go
    /// leaves its particle no velocity towards the surface: that was the constraint's own pull.
    fn update_grips(&self, contacts: &mut Contacts, state: &mut State) {
        for contact in &contacts.list {
            let i = contact.particle;
            let grip = contacts.grips[i];
            if grip.pressure > 0.0 {
                let v = &mut state.velocities[i];
                contacts.grips[i] = regrip(contact, grip, -self.solver.residual[i], *v);
                if contacts.grips[i].pressure == 0.0 {
                    *v -= contact.normal * v.dot(contact.normal).min(0.0);
                }
            }
        }
    }
}

/// M − dt ∂f/∂v − dt² ∂f/∂x.
fn assemble(matrix: &mut PairMatrix, slots: &[Vec<Slot>], model: &Model, dt: f64, state: &State) {
    matrix.clear(&model.masses);
    let mut slots = slots.iter();
    for (law, slots) in model.stiffnesses().zip(slots.by_ref()) {
        law.add_jacobian(
            state,
            dt * dt,
            Jacobian::Definite,
            &mut Assembly { matrix, slots },
        );
    }
    for (law, slots) in model.dampings().zip(slots) {
        law.add_jacobian(state, dt, &mut Assembly { matrix, slots });
    }
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
