//! Forces: one law a file, each the gradient of its energy.
//!
//! A law is a few small pure kernels on plain values and a batch that applies them to many
//! elements. Damping has no energy; it reports the power that it takes away.

mod damping;
mod dihedral;
mod discrete_shell;
mod edge_spring;
mod gravity;
mod hinge;
mod hinge_damping;
mod packed;
mod pass;
mod spring;
mod weave;

pub use damping::{DAMPINGS, DampedMotion, Damping, MassDamping, SpringDamping, damper_force};
pub use dihedral::{Dihedral, Fold};
pub use discrete_shell::DiscreteShell;
pub use edge_spring::EdgeSpring;
pub use gravity::Gravity;
pub use hinge::{BendingLaw, Hinge, HingeBatch};
pub use hinge_damping::HingeDamping;
pub use pass::{Cut, ForcePass, Tiles, Window};
pub use spring::{
    Spring, SpringBatch, energy, energy_and_stretch_squared, force, jacobian,
    largest_stretch_squared,
};
pub use weave::Weave;

use crate::linear::{Assembly, Pattern};
use crate::state::State;
use glam::DVec3;
use std::fmt::Debug;
use std::ops::Range;

/// A batch of elements of one law.
pub trait Force: Debug + Send + Sync {
    /// The law's name in reports: `gravitational`, or the spring family.
    fn name(&self) -> &'static str;

    /// Number of elements.
    fn elements(&self) -> usize;

    /// Potential energy of some of its elements (J).
    fn energy_of(&self, elements: Range<usize>, positions: &[DVec3]) -> f64;

    /// Potential energy (J).
    fn energy(&self, state: &State) -> f64 {
        self.energy_of(0..self.elements(), &state.positions)
    }

    /// Adds −∂E/∂x (N) to `forces`, one entry a particle.
    fn add_forces(&self, state: &State, forces: &mut [DVec3]);

    /// The law cut by tiles of the particles, for [`ForcePass`].
    fn cut(&self, tiles: Tiles) -> Box<dyn Cut>;
}

/// A force whose derivative the implicit schemes need.
pub trait Stiffness: Force {
    /// Particles between which the law has blocks.
    fn pattern(&self) -> Pattern;

    /// Adds −`scale` · ∂f/∂x to the matrix.
    fn add_jacobian(
        &self,
        state: &State,
        scale: f64,
        jacobian: Jacobian,
        assembly: &mut Assembly<'_>,
    );
}

/// Which −∂f/∂x.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Jacobian {
    /// The derivative itself.
    Exact,
    /// Each element's without its negative part, so that the implicit schemes' matrix is positive
    /// definite.
    Definite,
}
