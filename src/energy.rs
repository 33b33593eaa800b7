//! The energies of a state, and the ledger of where a run's energy went.

mod damping_work;
mod ledger;
mod pin_work;

pub use damping_work::{DampingWork, When};
pub use ledger::{Balance, CONTACT, FRICTION, Flows, Ledger, SCHEME, STRAIN_LIMIT};
pub use pin_work::PinWork;

use crate::force::Force;
use crate::linear::Chunks;
use crate::model::Model;
use crate::state::State;
use glam::DVec3;

/// The energies of a state (J).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Energies {
    /// ½ Σ m v².
    pub kinetic: f64,
    /// −Σ m g · x, zero at the origin.
    pub gravitational: f64,
    /// ½ Σ k (ℓ − ℓ₀)² of the springs by family, and what the hinges hold by law.
    pub elastic: Vec<(&'static str, f64)>,
}

impl Energies {
    /// The energies of a state of a model.
    pub fn of(model: &Model, state: &State) -> Self {
        let mut energies = Self::default();
        energies.take(model, state);
        energies
    }

    /// Becomes the energies of a state of a model, without allocating once its families are known.
    pub fn take(&mut self, model: &Model, state: &State) {
        self.kinetic = kinetic(model, state);
        self.gravitational = 0.0;
        self.elastic.clear();
        for force in model.forces() {
            let energy = energy_of(model, force, &state.positions);
            match force.name() {
                "gravitational" => self.gravitational += energy,
                family => self.elastic.push((family, energy)),
            }
        }
    }

    /// The size of what is summed up in the total, which rounds at this (J).
    pub fn scale(&self) -> f64 {
        let elastic = self.elastic.iter().map(|(_, energy)| energy.abs());
        self.kinetic + self.gravitational.abs() + elastic.sum::<f64>()
    }

    /// Their sum (J).
    pub fn total(&self) -> f64 {
        self.kinetic
            + self.gravitational
            + self.elastic.iter().map(|(_, energy)| energy).sum::<f64>()
    }
}

/// The energies of a state in three numbers (J).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Totals {
    /// Kinetic.
    pub kinetic: f64,
    /// Gravitational.
    pub gravitational: f64,
    /// Elastic, of all springs and hinges; 0 where nobody asks for it.
    pub elastic: f64,
}

impl Totals {
    /// Their sum (J).
    pub fn total(self) -> f64 {
        self.kinetic + self.gravitational + self.elastic
    }
}

impl std::ops::Add for Totals {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            kinetic: self.kinetic + other.kinetic,
            gravitational: self.gravitational + other.gravitational,
            elastic: self.elastic + other.elastic,
        }
    }
}

/// Energy of one law (J), in the order of fixed chunks on all threads of the pool it is called in.
fn energy_of(model: &Model, force: &dyn Force, positions: &[DVec3]) -> f64 {
    let chunks = Chunks::of(model.particles());
    let part = |chunk| force.energy_of(chunks.share(chunk, force.elements()), positions);
    chunks.map(part).sum()
}

/// Gravitational and elastic energy together (J).
pub fn potential(model: &Model, state: &State) -> f64 {
    potential_at(model, &state.positions)
}

/// Gravitational and elastic energy together (J), in the order of fixed chunks on all threads of the pool
/// it is called in.
pub fn potential_at(model: &Model, positions: &[DVec3]) -> f64 {
    let chunks = Chunks::of(model.particles());
    let part = |chunk| {
        let each = model.forces().map(|force| {
            let share = chunks.share(chunk, force.elements());
            force.energy_of(share, positions)
        });
        each.sum::<f64>()
    };
    chunks.map(part).sum()
}

/// Elastic energy of all springs and hinges (J).
pub fn elastic(model: &Model, state: &State) -> f64 {
    model.stiffnesses().map(|law| law.energy(state)).sum()
}

/// ½ Σ m v² (J).
pub fn kinetic(model: &Model, state: &State) -> f64 {
    let chunks = Chunks::of(model.particles());
    let part = |chunk| {
        let range = chunks.range(chunk);
        kinetic_of(&model.masses[range.clone()], &state.velocities[range])
    };
    chunks.map(part).sum()
}

/// ½ Σ m v² (J) of some particles.
pub(crate) fn kinetic_of(masses: &[f64], velocities: &[DVec3]) -> f64 {
    // Four sums side by side: one after the other, each addition waits for the last.
    let mut sums = [0.0; 4];
    for (masses, velocities) in masses.chunks(4).zip(velocities.chunks(4)) {
        for (sum, (m, v)) in sums.iter_mut().zip(masses.iter().zip(velocities)) {
            *sum += 0.5 * m * v.length_squared();
        }
    }
    sums.iter().sum()
}
