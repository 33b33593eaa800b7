//! Forces: one law a file, each the gradient of its energy.
//!
//! A law is a few small pure kernels on plain values and a batch that applies them to many
//! elements. Damping has no energy; it reports the power that it takes away.

mod damping;
mod gravity;
mod spring;

pub use damping::{Damping, MassDamping, SpringDamping, damper_force};
pub use gravity::Gravity;
pub use spring::{Spring, SpringBatch, energy, force, jacobian, jacobian_definite};

use crate::linear::Assembly;
use crate::state::State;
use glam::DVec3;
use std::fmt::Debug;

/// A batch of elements of one law.
pub trait Force: Debug + Send + Sync {
    /// The law's name in reports: `gravitational`, or the spring family.
    fn name(&self) -> &'static str;

    /// Potential energy (J).
    fn energy(&self, state: &State) -> f64;

    /// Adds −∂E/∂x (N) to `forces`, one entry a particle.
    fn add_forces(&self, state: &State, forces: &mut [DVec3]);
}

/// A force whose derivative the implicit schemes need.
pub trait Stiffness: Force {
    /// Particles between which the law has blocks, in the order in which it fills them.
    fn pairs(&self) -> Vec<[u32; 2]>;

    /// Adds −`scale` · ∂f/∂x, made positive semi-definite, to the matrix.
    fn add_jacobian(&self, state: &State, scale: f64, assembly: &mut Assembly<'_>);
}
