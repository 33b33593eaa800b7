//! The energy ledger: where a run's energy is, and where it went.

mod pin_work;

pub use pin_work::PinWork;

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
        let mut energies = Self {
            kinetic: kinetic(model, state),
            ..Self::default()
        };
        for force in model.forces() {
            match force.name() {
                "gravitational" => energies.gravitational += force.energy(state),
                family => energies.elastic.push((family, force.energy(state))),
            }
        }
        energies
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

/// Gravitational and elastic energy together (J).
pub fn potential(model: &Model, state: &State) -> f64 {
    model.forces().map(|force| force.energy(state)).sum()
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

/// Energy taken out of the motion and put into it since the start.
#[derive(Clone, Debug, PartialEq)]
pub struct Ledger {
    /// Total energy at the start (J).
    pub initial: f64,
    /// Dissipated energy by cause (J).
    pub dissipated: Vec<(&'static str, f64)>,
    /// Work done on the cloths by cause (J): by pins that move or let go.
    pub work: Vec<(&'static str, f64)>,
}

impl Ledger {
    /// Opens the ledger of a run.
    pub fn open(model: &Model, state: &State) -> Self {
        // Springs of several families are damped under one name.
        let mut dissipated: Vec<(&'static str, f64)> = Vec::new();
        for damping in model.dampings() {
            if dissipated.iter().all(|(name, _)| *name != damping.name()) {
                dissipated.push((damping.name(), 0.0));
            }
        }
        Self {
            initial: Energies::of(model, state).total(),
            dissipated,
            work: if model.pins.are_still() {
                Vec::new()
            } else {
                vec![("pins", 0.0)]
            },
        }
    }

    /// Books work of the pins (J).
    pub fn book_pins(&mut self, work: f64) {
        for (_, booked) in &mut self.work {
            *booked += work;
        }
    }

    /// Books what damping took during a step of `dt` (s) that ended with `state`.
    pub fn book(&mut self, model: &Model, state: &State, dt: f64) {
        for damping in model.dampings() {
            if let Some(entry) = self
                .dissipated
                .iter_mut()
                .find(|(name, _)| *name == damping.name())
            {
                entry.1 += damping.power(state) * dt;
            }
        }
    }

    /// What the ledger doesn't explain (J): E(0) + work − E(t) − dissipated. Positive where contact,
    /// friction, strain limiting and the scheme itself took energy.
    pub fn residual(&self, energies: &Energies) -> f64 {
        let sum = |list: &[(_, f64)]| list.iter().map(|(_, energy)| energy).sum::<f64>();
        self.initial + sum(&self.work) - energies.total() - sum(&self.dissipated)
    }
}
