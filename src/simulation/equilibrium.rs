//! Where a model comes to rest: the state of least energy, found without simulating the way there.

use crate::energy::{Energies, potential};
use crate::force::{Jacobian, Stiffness};
use crate::linear::{Assembly, Cholesky, PairMatrix, Pattern, Slot};
use crate::model::Model;
use crate::state::State;
use glam::{DMat3, DVec3};

/// How a search for rest ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rest {
    /// Newton steps taken.
    pub steps: u32,
    /// Largest force left on a free particle, over the largest weight or pull that was seen, also at
    /// pins.
    pub residual: f64,
    /// Whether the tolerance was reached, or rounding, where nothing more can be.
    pub found: bool,
}

/// Newton steps after which the search gives up: a cantilever of 40 cells with Γ = 100 takes 150.
const MAX_STEPS: u32 = 3000;

/// Halvings of a step that doesn't lower the energy.
const MAX_HALVINGS: u32 = 12;

/// Moves a state to where the energy of its model is least, until no free particle is left with more
/// than `tolerance` times the largest force that was seen, on it or on a pin, or what is left is
/// rounding. Velocities become zero.
///
/// Newton's method on the energy with positive semi-definite Jacobians, a mass term μ M that shrinks
/// while whole steps succeed (Levenberg and Marquardt), and halved steps where the energy doesn't
/// fall. Strain limits, obstacles and damping take no part. A net that can move without energy, such
/// as cloth that doesn't bend, is held by gravity only: it may take many steps.
pub fn settle(model: &Model, state: &mut State, tolerance: f64) -> Rest {
    let Some(mut search) = Search::new(model) else {
        return rest(0, f64::INFINITY, false);
    };
    state.velocities.fill(DVec3::ZERO);
    let mut scale = 0.0_f64;
    let mut mass_factor = 1e4;
    for steps in 0..MAX_STEPS {
        let [left, largest] = search.find_forces(model, state);
        scale = scale.max(largest).max(largest_weight(model));
        let residual = if scale > 0.0 { left / scale } else { 0.0 };
        if residual <= tolerance || left <= search.rounding {
            return rest(steps, residual, true);
        }
        if !search.find_step(model, state, mass_factor) {
            mass_factor *= 10.0;
            continue;
        }
        match search.descend(model, state) {
            None => return rest(steps, residual, left <= search.rounding),
            Some(0) => mass_factor *= 0.3,
            Some(1) => {}
            Some(_) => mass_factor *= 4.0,
        }
        mass_factor = mass_factor.max(1e-6);
    }
    rest(
        MAX_STEPS,
        search.find_forces(model, state)[0] / scale,
        false,
    )
}

fn rest(steps: u32, residual: f64, found: bool) -> Rest {
    Rest {
        steps,
        residual,
        found,
    }
}

/// Weight of the heaviest particle (N).
fn largest_weight(model: &Model) -> f64 {
    let heaviest = model.masses.iter().copied().fold(0.0, f64::max);
    heaviest * model.gravity.acceleration.length()
}

/// The least force that means anything (N): a few roundings of positions x times the stiffness there.
fn rounding(diagonal: &[DMat3], positions: &[DVec3]) -> f64 {
    let each = diagonal.iter().zip(positions);
    let stiffness = |k: &DMat3| k.x_axis.x.max(k.y_axis.y).max(k.z_axis.z);
    let forces = each.map(|(k, x)| stiffness(k) * x.length());
    4.0 * f64::EPSILON * forces.fold(0.0, f64::max)
}

/// Work arrays of the search; one entry a particle unless it says otherwise.
struct Search {
    matrix: PairMatrix,
    /// Slots of each stiffness.
    slots: Vec<Vec<Slot>>,
    pairs: Vec<[u32; 2]>,
    cholesky: Cholesky,
    forces: Vec<DVec3>,
    /// The Newton step.
    step: Vec<DVec3>,
    /// Force that the rounding of positions makes (N), from the last step on.
    rounding: f64,
    diagonal: Vec<DMat3>,
    moved: State,
}

impl Search {
    /// `None` for a model whose matrix is too large to factorise.
    fn new(model: &Model) -> Option<Self> {
        let particles = model.particles();
        let patterns: Vec<Pattern> = model.stiffnesses().map(Stiffness::pattern).collect();
        let matrix = PairMatrix::with_patterns(particles, &patterns);
        let pairs = matrix.pairs();
        Some(Self {
            slots: patterns
                .iter()
                .map(|pattern| matrix.slots(pattern))
                .collect(),
            cholesky: Cholesky::new(particles, &pairs)?,
            matrix,
            pairs,
            forces: vec![DVec3::ZERO; particles],
            step: vec![DVec3::ZERO; particles],
            rounding: 0.0,
            diagonal: vec![DMat3::ZERO; particles],
            moved: State::at_rest(vec![DVec3::ZERO; particles]),
        })
    }

    /// Sets the forces on free particles; returns the largest, and the largest on any (N).
    fn find_forces(&mut self, model: &Model, state: &State) -> [f64; 2] {
        self.forces.fill(DVec3::ZERO);
        for force in model.forces() {
            force.add_forces(state, &mut self.forces);
        }
        let [mut left, mut largest] = [0.0_f64; 2];
        for (i, force) in self.forces.iter_mut().enumerate() {
            largest = largest.max(force.length());
            if model.is_pinned(i) {
                *force = DVec3::ZERO;
            }
            left = left.max(force.length());
        }
        [left, largest]
    }

    /// Solves (K + μ M) step = f; false when that is not positive definite.
    fn find_step(&mut self, model: &Model, state: &State, mass_factor: f64) -> bool {
        let masses: Vec<f64> = model.masses.iter().map(|m| m * mass_factor).collect();
        self.matrix.clear(&masses);
        for (law, slots) in model.stiffnesses().zip(&self.slots) {
            let matrix = &mut self.matrix;
            law.add_jacobian(
                state,
                1.0,
                Jacobian::Definite,
                &mut Assembly { matrix, slots },
            );
        }
        self.matrix.diagonal(&mut self.diagonal);
        self.rounding = rounding(&self.diagonal, &state.positions);
        let mut off: Vec<DMat3> = self.matrix.off_diagonal().collect();
        for (block, pair) in off.iter_mut().zip(&self.pairs) {
            if pair.iter().any(|&i| model.is_pinned(i as usize)) {
                *block = DMat3::ZERO;
            }
        }
        for (i, block) in self.diagonal.iter_mut().enumerate() {
            if model.is_pinned(i) {
                *block = DMat3::IDENTITY;
            }
        }
        if self.cholesky.factor(&self.diagonal, &off).is_err() {
            return false;
        }
        self.step.copy_from_slice(&self.forces);
        self.cholesky.solve(&mut self.step);
        true
    }

    /// Goes the step, or as much of it as lowers the energy; returns how often it was halved.
    fn descend(&mut self, model: &Model, state: &mut State) -> Option<u32> {
        let before = potential(model, state);
        let slope: f64 = self
            .forces
            .iter()
            .zip(&self.step)
            .map(|(f, s)| f.dot(*s))
            .sum();
        // Below this, differences of the energy are rounding.
        let noise = 1e-13 * Energies::of(model, state).scale();
        self.moved.copy_from(state);
        for halvings in 0..=MAX_HALVINGS {
            let share = 0.5_f64.powi(halvings.cast_signed());
            for i in 0..self.step.len() {
                self.moved.positions[i] = state.positions[i] + self.step[i] * share;
            }
            let after = potential(model, &self.moved);
            if after <= before - 1e-4 * share * slope || share * slope < noise {
                state.copy_from(&self.moved);
                return Some(halvings);
            }
        }
        None
    }
}
