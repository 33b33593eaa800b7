//! The energy that a run may have: growth beyond it is the scheme's own, and shows before anything
//! overflows.

use crate::energy::Energies;
use crate::model::Model;
use crate::state::{Archive, State};
use rayon::prelude::*;

/// What kinetic and elastic energy together may come from.
///
/// B(t) = K(0) + U(0) + G(0) − G(t) + what was put in since; a run has lost its sense when
/// K + U > factor · B + floor.
#[derive(Clone, Debug)]
pub(super) struct Budget {
    /// K(0) + U(0) + G(0) and what was put in since (J).
    granted: f64,
    /// Times that the budget may be exceeded.
    pub(super) factor: f64,
    /// Energy that counts as none (J).
    floor: f64,
    /// The bound when it was taken last (J).
    pub(super) bound: f64,
}

/// Steps between two looks at the elastic energy, which costs a pass over the springs. An instability
/// that multiplies energy by less than 2 a step is then seen before it has grown by 256; a faster one
/// shows in the kinetic energy, which is looked at in every step.
pub(super) const STEPS: u64 = 8;

/// Times that the budget may be exceeded at first. Near their limit the symplectic schemes keep an
/// energy of their own, and the true one swings; see [`swing`].
const FACTOR: f64 = 10.0;

/// Strain whose energy in all springs counts as none: what pins, limits and contact leave in
/// cloth.
const SMALL_STRAIN: f64 = 0.01;

/// Largest factor by which the energy may exceed its budget in steps of `share` times the stable
/// one; beyond that, where nothing is kept that bounds the swing, [`FACTOR`].
///
/// Symplectic Euler keeps ½v² + ½ω²x² − ½ dt ω² x v, whose level sets are ellipses on which the true
/// energy varies by (1 + s)/(1 − s), s = dt ω/2; Verlet's by 1/(1 − s²). Twice that for what else
/// adds up.
pub(super) fn swing(share: f64) -> f64 {
    if share < 1.0 {
        FACTOR.max(4.0 / (1.0 - share))
    } else {
        FACTOR
    }
}

impl Budget {
    pub(super) fn open(model: &Model, state: &State, dt: f64) -> Self {
        let energies = Energies::of(model, state);
        let springs = model.springs.iter().flat_map(|batch| &batch.springs);
        let small = springs.map(|s| s.stiffness * (SMALL_STRAIN * s.rest_length).powi(2));
        let masses = model.masses.iter().zip(&model.inverse_masses);
        let free: f64 = masses.map(|(m, w)| if *w > 0.0 { *m } else { 0.0 }).sum();
        // A scheme may move before it falls or fall before it moves: one step's fall.
        let fall = model.gravity.acceleration.length() * dt;
        let rounding = 1e-12 * energies.scale();
        let floor = 0.5 * small.sum::<f64>() + free * fall * fall + rounding;
        let granted = energies.total();
        Self {
            granted,
            factor: FACTOR,
            floor,
            bound: FACTOR * (granted - energies.gravitational) + floor,
        }
    }

    /// Carries all of it over.
    pub(super) fn carry(&mut self, archive: &mut Archive) {
        for number in [
            &mut self.granted,
            &mut self.factor,
            &mut self.floor,
            &mut self.bound,
        ] {
            archive.real(number);
        }
    }

    /// Books energy that came from outside the scheme (J): the work of driven pins, what limits and
    /// contact added.
    pub(super) fn grant(&mut self, energy: f64) {
        self.granted += energy.max(0.0);
    }

    /// Twice what kinetic and elastic energy may come from (J): more is not what the scheme's own swing
    /// explains, where something else looks wrong already.
    pub(super) fn explained(&self, gravitational: f64) -> f64 {
        2.0 * (self.granted - gravitational).max(0.0) + self.floor
    }

    /// Takes the bound of K + U for a gravitational energy (J).
    pub(super) fn take_bound(&mut self, gravitational: f64) -> f64 {
        self.bound = self.factor * (self.granted - gravitational).max(0.0) + self.floor;
        self.bound
    }
}

/// Elastic energy of all springs and hinges (J), the laws side by side on the pool's threads.
pub(super) fn elastic(model: &Model, state: &State) -> f64 {
    let laws: Vec<_> = model.stiffnesses().collect();
    let energies: Vec<f64> = laws.par_iter().map(|law| law.energy(state)).collect();
    energies.iter().sum()
}
