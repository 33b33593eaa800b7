//! Springs and hinges alike: what of a model is stiff, and how fast it would swing alone.

use crate::force::{BendingLaw as _, Dihedral, DiscreteShell, EdgeSpring, Hinge, Spring};
use crate::model::Model;
use glam::DVec3;

/// A spring or a hinge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Element {
    /// Its spring family or bending law.
    pub law: &'static str,
    /// Its stiffness k: N/m of a spring, N·m of a hinge.
    pub stiffness: f64,
    /// ω² of the element alone between its particles (1/s²): k (1/mᵢ + 1/mⱼ) of a spring, k Σ |∇θ|²/m
    /// of a hinge.
    pub omega_squared: f64,
    corners: [u32; 4],
    ends: usize,
}

impl Element {
    /// Its particles in the model: the two ends of a spring, the four corners of a hinge, those of its
    /// edge first.
    pub fn particles(&self) -> &[u32] {
        &self.corners[..self.ends]
    }

    fn spring(inverse_masses: &[f64], law: &'static str, spring: &Spring) -> Self {
        let [i, j] = spring.ends;
        let w = |particle: u32| inverse_masses[particle as usize];
        Self {
            law,
            stiffness: spring.stiffness,
            omega_squared: spring.stiffness * (w(i) + w(j)),
            corners: [i, j, 0, 0],
            ends: 2,
        }
    }

    fn hinge(
        inverse_masses: &[f64],
        positions: &[DVec3],
        law: &'static str,
        hinge: &Hinge,
    ) -> Self {
        let gradient = Dihedral::of(hinge.of(positions)).gradient;
        let w = |particle: u32| inverse_masses[particle as usize];
        let corners = hinge.corners.into_iter().zip(gradient);
        let share: f64 = corners.map(|(i, g)| w(i) * g.length_squared()).sum();
        Self {
            law,
            stiffness: hinge.stiffness,
            omega_squared: hinge.stiffness * share,
            corners: hinge.corners,
            ends: 4,
        }
    }
}

/// Every spring and hinge of a model, with the 1/masses (1/kg) that they are to be judged by.
pub fn elements<'a>(
    model: &'a Model,
    inverse_masses: &'a [f64],
    positions: &'a [DVec3],
) -> impl Iterator<Item = Element> + 'a {
    let springs = model.springs.iter().flat_map(move |batch| {
        let springs = batch.springs.iter();
        springs.map(move |spring| Element::spring(inverse_masses, batch.family, spring))
    });
    let edge_springs = model.edge_springs.iter().flat_map(|batch| &batch.hinges);
    let shells = model.discrete_shells.iter().flat_map(|batch| &batch.hinges);
    let edge_springs = edge_springs.map(|hinge| (EdgeSpring::NAME, hinge));
    let shells = shells.map(|hinge| (DiscreteShell::NAME, hinge));
    let hinges = edge_springs.chain(shells);
    springs.chain(
        hinges.map(move |(law, hinge)| Element::hinge(inverse_masses, positions, law, hinge)),
    )
}
