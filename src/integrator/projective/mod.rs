//! Projective dynamics: implicit Euler by local and global steps.
//!
//! The end of a step is where
//!
//! J(v) = ½ (v − v₀) · M (v − v₀) + U(x₀ + dt v) + dt D(v)
//!
//! is least, U the potential of every law and D half the power of every damping: there
//! M (v₁ − v₀) = dt f(x₁, v₁), which is implicit Euler without linearisation. An iteration takes the
//! forces at hand (the local step) and solves with one constant matrix, factorised once (the global
//! step). The history of the last few iterations then bends the step towards Newton's.
//!
//! Source: Liu, Bargteil, O'Brien and Kavan 2013 and Bouaziz, Martin, Liu, Kavan and Pauly 2014 (the
//! local and global steps); Liu, Bouaziz and Kavan 2017 (that they are a quasi-Newton method, and
//! how to accelerate it).

mod history;
mod matrix;

use super::Scheme;
use super::implicit_euler::free_fall;
use crate::collision::Contacts;
use crate::linear::Solve;
use crate::model::Model;
use crate::state::State;
use glam::DVec3;
use history::History;
use matrix::Matrix;

/// The most iterations of a step when a scene doesn't say.
pub(super) const ITERATIONS: u32 = 100;

/// Halvings of a step that doesn't lower the energy.
const MAX_HALVINGS: u32 = 30;

/// Work arrays of the scheme; one entry a particle unless it says otherwise.
#[derive(Debug)]
pub(super) struct Projective {
    iterations: u32,
    residual: f64,
    /// Releases of pins that the matrix knows of.
    released: usize,
    matrix: Matrix,
    history: History,
    /// The state at the start of the step.
    start: State,
    /// The state that is tried.
    moved: State,
    /// ∂J/∂v = M (v − v₀) − dt f (N·s), nothing where pinned; and the last one.
    gradient: Vec<DVec3>,
    before: Vec<DVec3>,
    /// Change of velocity of an iteration (m/s).
    step: Vec<DVec3>,
}

/// How far a velocity is from the end of the step; norms are √(Σ |gᵢ|²/mᵢ) over free particles.
#[derive(Clone, Copy, Debug)]
struct Balance {
    /// Norm of the gradient.
    left: f64,
    /// Norm of M (v − v₀).
    gained: f64,
}

/// ½ (v − v₀) · M (v − v₀) + U (J), and the sum of its parts' sizes, at which it rounds.
#[derive(Clone, Copy, Debug, Default)]
struct Energy {
    sum: f64,
    scale: f64,
}

impl Projective {
    pub(super) fn new(model: &Model, iterations: u32, residual: f64) -> Self {
        let zero = vec![DVec3::ZERO; model.particles()];
        Self {
            iterations,
            residual,
            released: model.released(),
            matrix: Matrix::new(model),
            history: History::new(model.particles()),
            start: State::at_rest(zero.clone()),
            moved: State::at_rest(zero.clone()),
            gradient: zero.clone(),
            before: zero.clone(),
            step: zero,
        }
    }

    /// Sets the gradient of J at a state.
    fn take_gradient(&mut self, model: &Model, dt: f64, state: &State) -> Balance {
        self.gradient.fill(DVec3::ZERO);
        for force in model.forces() {
            force.add_forces(state, &mut self.gradient);
        }
        for damping in model.dampings() {
            damping.add_forces(state, &mut self.gradient);
        }
        let [mut left, mut gained] = [0.0; 2];
        for (i, g) in self.gradient.iter_mut().enumerate() {
            let (m, w) = (model.masses[i], model.inverse_masses[i]);
            let gain = (state.velocities[i] - self.start.velocities[i]) * m;
            *g = if w > 0.0 { gain - *g * dt } else { DVec3::ZERO };
            left += w * g.length_squared();
            gained += w * gain.length_squared();
        }
        Balance {
            left: left.sqrt(),
            gained: gained.sqrt(),
        }
    }

    /// J without damping.
    fn energy(&self, model: &Model, state: &State) -> Energy {
        let mut energy = Energy::default();
        for force in model.forces() {
            let part = force.energy(state);
            energy.sum += part;
            energy.scale += part.abs();
        }
        let velocities = state.velocities.iter().zip(&self.start.velocities);
        let each = model.masses.iter().zip(velocities);
        let gain: f64 = each
            .map(|(m, (v, start))| m * v.distance_squared(*start))
            .sum();
        energy.sum += 0.5 * gain;
        energy.scale += 0.5 * gain;
        energy
    }

    /// Goes a step, or as much of it as lowers J; false when none does.
    fn descend(&mut self, model: &Model, dt: f64, state: &mut State, energy: &mut Energy) -> bool {
        loop {
            self.history
                .step(&mut self.matrix, &self.gradient, &mut self.step);
            if self.search_line(model, dt, state, energy) {
                return true;
            }
            if self.history.is_empty() {
                return false;
            }
            self.history.clear();
        }
    }

    /// Halves the step until it lowers J by a ten-thousandth of what its slope promises (Armijo 1966),
    /// or differences of J are rounding.
    ///
    /// Dampings take their directions from the positions before the step, as the matrix does: at the
    /// end of the last step both are the same.
    fn search_line(
        &mut self,
        model: &Model,
        dt: f64,
        state: &mut State,
        energy: &mut Energy,
    ) -> bool {
        let each = self.gradient.iter().zip(&self.step);
        let mut slope: f64 = each.map(|(g, s)| g.dot(*s)).sum();
        if slope >= 0.0 {
            return false;
        }
        let before = energy.sum + dissipation(model, dt, state);
        let noise = 1e-13 * energy.scale;
        for _ in 0..=MAX_HALVINGS {
            for i in 0..self.step.len() {
                let v = state.velocities[i] + self.step[i];
                self.moved.velocities[i] = v;
                self.moved.positions[i] = self.start.positions[i] + v * dt;
            }
            let after = self.energy(model, &self.moved);
            std::mem::swap(&mut state.positions, &mut self.moved.positions);
            let sum = after.sum + dissipation(model, dt, &self.moved);
            if sum <= before + 1e-4 * slope || (-slope < noise && sum.is_finite()) {
                std::mem::swap(&mut state.velocities, &mut self.moved.velocities);
                *energy = after;
                return true;
            }
            std::mem::swap(&mut state.positions, &mut self.moved.positions);
            self.step.iter_mut().for_each(|s| *s *= 0.5);
            slope *= 0.5;
        }
        false
    }

    /// Norm of the gradient that the rounding of positions and velocities makes.
    fn rounding(&self, model: &Model, dt: f64, state: &State) -> f64 {
        let each = self.matrix.stiffness.iter().zip(&state.positions);
        let squares = each.enumerate().map(|(i, (k, x))| {
            let impulse = dt * k * x.length() + model.masses[i] * state.velocities[i].length();
            model.inverse_masses[i] * impulse * impulse
        });
        4.0 * f64::EPSILON * squares.sum::<f64>().sqrt()
    }
}

impl Scheme for Projective {
    /// M (v₁ − v₀) = dt f(x₁, v₁), x₁ = x₀ + dt v₁, or as near to it as the iterations come. First order;
    /// damps every oscillation as implicit Euler does.
    fn advance(
        &mut self,
        model: &Model,
        _: &mut Contacts,
        dt: f64,
        before: &State,
        state: &mut State,
    ) -> Solve {
        state.copy_from(before);
        if self.released != model.released() {
            *self = Self::new(model, self.iterations, self.residual);
        }
        model.aim(dt, state);
        self.matrix.prepare(model, dt);
        self.history.clear();
        self.start.copy_from(state);
        guess(model, dt, state);
        self.moved.copy_from(state);
        let floor = self.rounding(model, dt, state);
        let weight = free_fall(model, dt);
        let mut energy = self.energy(model, state);
        let mut balance = self.take_gradient(model, dt, state);
        let mut iterations = 0;
        loop {
            let reference = weight.max(balance.gained);
            let converged = balance.left <= floor.max(self.residual * reference);
            let ends = converged || iterations == self.iterations;
            if ends || !self.descend(model, dt, state, &mut energy) {
                let residual = if reference > 0.0 {
                    balance.left / reference
                } else {
                    0.0
                };
                return Solve {
                    iterations,
                    residual,
                    converged,
                    damped: false,
                };
            }
            std::mem::swap(&mut self.gradient, &mut self.before);
            balance = self.take_gradient(model, dt, state);
            self.history.learn(&self.step, &self.before, &self.gradient);
            iterations += 1;
        }
    }
}

/// Sets the velocities from which a step starts, and moves the positions with them: the old ones, and
/// for cloths that no pin holds those of free fall, which have the momentum of the step's end already.
/// The matrix then keeps it.
fn guess(model: &Model, dt: f64, state: &mut State) {
    for cloth in &model.cloths {
        let mut range = cloth.particles.clone();
        if range.any(|i| model.is_pinned(i)) {
            continue;
        }
        for i in cloth.particles.clone() {
            let (v, m) = (&mut state.velocities[i], model.masses[i]);
            let drag = model
                .mass_damping
                .as_ref()
                .map_or(0.0, |damping| damping.drag[i]);
            *v = (*v + model.gravity.acceleration * dt) / (1.0 + dt * drag / m);
        }
    }
    for (x, v) in state.positions.iter_mut().zip(&state.velocities) {
        *x += *v * dt;
    }
}

/// dt D of a state (J): half of what dampings take in a step.
fn dissipation(model: &Model, dt: f64, state: &State) -> f64 {
    model
        .dampings()
        .map(|damping| 0.5 * dt * damping.power(state))
        .sum()
}
