//! One backward-Euler stage, solved as the nonlinear equation that it is.
//!
//! M (v − v̄) = γ [f(x) + d(x, v)],   x = x̄ + γ v
//!
//! with f the laws' forces, d damping, and γ the time that the stage stands for (s). Implicit Euler is
//! one such stage with γ = dt, implicit midpoint one with γ = dt/2, BDF2 one with γ = ⅔ dt.
//!
//! Newton's method with definite Jacobians (each element's without its negative part) minimises
//!
//! Φ(v) = ½ (v − v̄) · M (v − v̄) + U(x̄ + γ v) + ½ γ vᵀ D v,   ∂Φ/∂v = M (v − v̄) − γ (f + d),
//!
//! with D as it is at the present iterate, which is the true one when the iteration ends. A step is
//! taken as it is when it halves what is left; otherwise Φ has to fall (Armijo).
//!
//! Source: Nocedal and Wright 2006, chapters 3 and 7 (line search, inexact solves); Teran et al. 2005
//! (definite Jacobians by element).

use super::constraint::{prescribe, pressed, update_grips};
use super::implicit_euler::free_fall;
use super::linear_system::{Linear, LinearSystem, inertia};
use crate::collision::{Contact, Contacts};
use crate::energy::potential;
use crate::linear::Solve;
use crate::model::Model;
use crate::state::{Archive, State};
use glam::DVec3;

/// How the nonlinear equation of a stage is solved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nonlinear {
    /// Force out of balance √(Σ |r|²/m) at which the iteration ends, relative to what moves the cloth:
    /// the first one, or the cloth's weight where that is more.
    pub residual: f64,
    /// Newton steps after which it gives up.
    pub iterations: u32,
    /// Its linear solves.
    pub linear: Linear,
}

/// Halvings of a Newton step that doesn't lower Φ.
const MAX_HALVINGS: i32 = 20;

/// Share of the slope by which Φ has to fall (Armijo).
const FALL: f64 = 1e-4;

/// A linear solve ends at this share of the present residual at most: more exact ones don't save a
/// Newton step on `hanging-cloth`.
const FORCING: f64 = 0.1;

/// Work arrays of a stage; one entry a particle.
#[derive(Debug)]
pub(super) struct BackwardEuler {
    settings: Nonlinear,
    system: LinearSystem,
    /// Where the iteration stands: v, and x = x̄ + γ v.
    at: State,
    /// The next iterate.
    next: State,
    /// r = M (v̄ − v) + γ (f + d) + friction at the present iterate (N·s).
    missing: Vec<DVec3>,
    next_missing: Vec<DVec3>,
    /// The Newton step (m/s).
    step: Vec<DVec3>,
    /// Positions of the present iterate with the velocities of the next, for its damping.
    lagged: State,
    /// Change of velocity over the last step (m/s): where the next search starts.
    change: Vec<DVec3>,
    /// Power of all forces but the weight (W) at the end of the last stage.
    pub(super) power: f64,
}

/// A stage: where it starts, and for how long it stands.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stage<'a> {
    /// x̄ and v̄; of pinned particles, v.
    pub(super) start: &'a State,
    /// γ (s).
    pub(super) gamma: f64,
    /// The whole step (s), of which grips hold the impulses.
    pub(super) dt: f64,
    /// Positions at the start of the step (m), from which the gaps of contacts were measured.
    pub(super) positions: &'a [DVec3],
    /// How far into the step x is, as a share: gaps have closed by as much.
    pub(super) share: f64,
}

/// Makes a stage at `time` (s) of its start: driven particles have the place and the velocity of then.
pub(super) fn aim(
    model: &Model,
    time: f64,
    gamma: f64,
    start: &mut State,
    velocities: &mut [DVec3],
) {
    start.time = time;
    model.drive(start);
    for i in model.driven() {
        let i = i as usize;
        start.positions[i] -= start.velocities[i] * gamma;
        velocities[i] = start.velocities[i];
    }
}

impl Stage<'_> {
    /// Velocity against the obstacle, along its normal, with which a contact's gap closes (m/s).
    fn closing(&self, contact: &Contact) -> f64 {
        let i = contact.particle;
        let ahead = contact
            .normal
            .dot(self.start.positions[i] - self.positions[i]);
        let going = contact.normal.dot(contact.velocity);
        let target = (self.dt * going - contact.gap.max(0.0)) * self.share;
        (target - ahead) / self.gamma - going
    }
}

impl BackwardEuler {
    pub(super) fn new(model: &Model, settings: Nonlinear) -> Self {
        let zero = vec![DVec3::ZERO; model.particles()];
        Self {
            settings,
            system: LinearSystem::new(model, settings.linear),
            at: State::at_rest(zero.clone()),
            next: State::at_rest(zero.clone()),
            missing: zero.clone(),
            next_missing: zero.clone(),
            step: zero.clone(),
            lagged: State::at_rest(zero.clone()),
            change: zero,
            power: 0.0,
        }
    }

    /// Carries over where the next search starts.
    pub(super) fn carry(&mut self, archive: &mut Archive) {
        archive.vectors(&mut self.change);
        archive.real(&mut self.power);
        self.system.carry(archive);
        self.system.carry_diagonal(archive);
    }

    /// Lets the next search start at rest, if that leaves less than starting at `velocities`: there Φ is the
    /// energy before the step, however far these would go.
    pub(super) fn begin_at_rest(&mut self, velocities: &[DVec3]) {
        for (change, v) in self.change.iter_mut().zip(velocities) {
            *change = -*v;
        }
    }

    /// Solves a stage; `velocities` hold the step's first velocities and become the stage's v.
    pub(super) fn solve(
        &mut self,
        model: &Model,
        contacts: &mut Contacts,
        stage: Stage<'_>,
        velocities: &mut [DVec3],
    ) -> Solve {
        let terms = Terms {
            model,
            contacts,
            stage,
        };
        self.system.constrain(model, contacts);
        self.start(terms, velocities);
        let solve = self.iterate(terms);
        self.power = self.power_of_forces(terms);
        self.balance_momentum(terms);
        for i in 0..velocities.len() {
            self.change[i] = self.at.velocities[i] - velocities[i];
            velocities[i] = self.at.velocities[i];
        }
        // What was left before the constraints were projected out is what they had to supply.
        let whole = stage.dt / stage.gamma;
        update_grips(model, contacts, &self.missing, whole, velocities);
        solve
    }

    /// Starts at the old velocities, or at those that go on as in the last step, whichever leaves less.
    fn start(&mut self, terms: Terms<'_>, velocities: &[DVec3]) {
        self.next.velocities.copy_from_slice(velocities);
        self.set_next(terms);
        let still = self.size(&self.next_missing, terms.model);
        self.accept();
        for i in 0..velocities.len() {
            let change = self.system.constraints[i].project(self.change[i]);
            self.next.velocities[i] = velocities[i] + change;
        }
        self.set_next(terms);
        // What is not a number, as after a failed step, is not less.
        if self.size(&self.next_missing, terms.model) < still {
            self.accept();
        }
    }

    /// Newton steps until the residual is small, or nothing more than rounding.
    fn iterate(&mut self, terms: Terms<'_>) -> Solve {
        let (model, gamma) = (terms.model, terms.stage.gamma);
        let mut left = self.size(&self.missing, model);
        let scale = left.max(free_fall(model, gamma));
        let goal = self.settings.residual * scale;
        let mut iterations = 0;
        let mut converged = left <= goal;
        for _ in 0..self.settings.iterations {
            if converged || !left.is_finite() {
                break;
            }
            self.system.assemble(model, gamma, &self.at);
            let forcing = FORCING.max(0.5 * goal / left).min(0.5);
            self.step.fill(DVec3::ZERO);
            let linear = &mut self.system;
            let solve = linear.solve(&self.missing, &mut self.step, forcing, 0.0);
            iterations += solve.iterations.max(1);
            let rounding = self.rounding(model);
            let found = self.search(terms, left, rounding);
            left = self.size(&self.missing, model);
            converged = left <= goal || left <= rounding || !found && left <= 100.0 * rounding;
            if !found {
                break;
            }
        }
        Solve {
            iterations,
            residual: if scale > 0.0 { left / scale } else { 0.0 },
            converged,
            damped: false,
        }
    }

    /// Goes the Newton step, or as much of it as lowers Φ; false when no part of it does.
    fn search(&mut self, terms: Terms<'_>, left: f64, rounding: f64) -> bool {
        let each = self.missing.iter().zip(&self.step);
        let slope: f64 = each.map(|(r, s)| r.dot(*s)).sum();
        let mut before = None;
        self.lagged.copy_from(&self.at);
        for halvings in 0..=MAX_HALVINGS {
            let share = 0.5_f64.powi(halvings);
            for (i, v) in self.next.velocities.iter_mut().enumerate() {
                *v = self.at.velocities[i] + self.step[i] * share;
            }
            self.set_next(terms);
            let now = self.size(&self.next_missing, terms.model);
            let fallen = now <= 0.5 * left || now <= rounding || {
                let start = *before.get_or_insert_with(|| terms.merit(&self.at, &self.lagged));
                let next = &self.next.velocities;
                self.lagged.velocities.copy_from_slice(next);
                let fall = terms.merit(&self.next, &self.lagged) - start;
                // Below that, differences of Φ are rounding.
                fall <= -FALL * share * slope || share * slope < 1e-13 * start.abs()
            };
            if fallen {
                self.accept();
                return true;
            }
        }
        false
    }

    /// Sets the next iterate's positions and what is missing there from its velocities, after setting
    /// those that are given.
    fn set_next(&mut self, terms: Terms<'_>) {
        let Terms {
            model,
            contacts,
            stage,
        } = terms;
        let next = &mut self.next;
        let closing = |contact: &Contact| stage.closing(contact);
        prescribe(model, contacts, closing, &mut next.velocities);
        for (i, x) in next.positions.iter_mut().enumerate() {
            *x = stage.start.positions[i] + next.velocities[i] * stage.gamma;
        }
        terms.set_missing(next, &mut self.next_missing);
    }

    fn accept(&mut self) {
        std::mem::swap(&mut self.at, &mut self.next);
        std::mem::swap(&mut self.missing, &mut self.next_missing);
    }

    /// √(Σ |P r|²/m) on the free directions.
    fn size(&self, missing: &[DVec3], model: &Model) -> f64 {
        let each = missing.iter().zip(&self.system.constraints);
        let free = each.map(|(r, constraint)| constraint.project(*r).length_squared());
        let weighted = free.zip(&model.inverse_masses).map(|(r, w)| r * w);
        weighted.sum::<f64>().sqrt()
    }

    /// The size of a residual that is rounding.
    pub(super) fn rounding(&self, model: &Model) -> f64 {
        let each = self.system.rounding(&self.at.positions);
        let squares = each
            .zip(&model.inverse_masses)
            .map(|(impulse, w)| impulse * impulse * w);
        squares.sum::<f64>().sqrt()
    }

    /// Σ v · (f + d + friction) (W) at the present iterate, of pinned particles too, with f read from what
    /// is missing there.
    fn power_of_forces(&self, terms: Terms<'_>) -> f64 {
        let Terms { model, stage, .. } = terms;
        let start = stage.start.velocities.iter();
        let each = start.zip(&self.at.velocities).zip(&self.missing);
        let powers = each.enumerate().map(|(i, ((start, v), missing))| {
            let force = (*missing - (*start - *v) * model.masses[i]) / stage.gamma;
            v.dot(force - model.gravity.weight(i))
        });
        powers.sum()
    }

    /// Supplies the momentum that a free cloth still misses, by a uniform velocity: inner forces stay.
    fn balance_momentum(&mut self, terms: Terms<'_>) {
        for cloth in &terms.model.cloths {
            if self.system.is_free(cloth) {
                let range = cloth.particles.clone();
                let missing: DVec3 = self.missing[range.clone()].iter().sum();
                let shift = missing / inertia(terms.model, cloth, terms.stage.gamma);
                self.at.velocities[range]
                    .iter_mut()
                    .for_each(|v| *v += shift);
            }
        }
    }
}

/// What the equation is made of.
#[derive(Clone, Copy)]
struct Terms<'a> {
    model: &'a Model,
    contacts: &'a Contacts,
    stage: Stage<'a>,
}

impl Terms<'_> {
    /// r = M (v̄ − v) + γ (f + d), and the friction of particles that slide.
    fn set_missing(self, at: &State, missing: &mut [DVec3]) {
        let Stage {
            start, gamma, dt, ..
        } = self.stage;
        missing.fill(DVec3::ZERO);
        for force in self.model.forces() {
            force.add_forces(at, missing);
        }
        for damping in self.model.dampings() {
            damping.add_forces(at, missing);
        }
        for (i, r) in missing.iter_mut().enumerate() {
            *r = *r * gamma + (start.velocities[i] - at.velocities[i]) * self.model.masses[i];
        }
        for (contact, grip) in pressed(self.model, self.contacts) {
            missing[contact.particle] += grip.drag * (gamma / dt);
        }
    }

    /// Φ at an iterate, whose velocities `damped` has too, with the positions that damping is taken at.
    fn merit(self, at: &State, damped: &State) -> f64 {
        let Stage {
            start, gamma, dt, ..
        } = self.stage;
        let mut merit = potential(self.model, at);
        for (i, m) in self.model.masses.iter().enumerate() {
            merit += 0.5 * m * at.velocities[i].distance_squared(start.velocities[i]);
        }
        let dampings = self.model.dampings();
        merit += dampings
            .map(|damping| 0.5 * gamma * damping.power(damped))
            .sum::<f64>();
        let drags = pressed(self.model, self.contacts);
        merit
            - drags
                .map(|(contact, grip)| {
                    grip.drag.dot(at.velocities[contact.particle]) * (gamma / dt)
                })
                .sum::<f64>()
    }
}
