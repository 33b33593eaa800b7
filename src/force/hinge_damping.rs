//! Damping of the dihedral angles of hinges.

use super::dihedral::Hessian;
use super::hinge::{add_hessian, hinge_pattern};
use super::{Damping, Dihedral, Hinge};
use crate::linear::{Assembly, Pattern};
use crate::state::State;
use glam::DVec3;

/// Damping of bending with c = τ k (N·m·s): f = −c θ̇ ∇θ (N) with θ̇ = ∇θ · v; P = Σ c θ̇² (W).
/// Turning and moving as a whole stay free.
///
/// Source: Bridson, Marino and Fedkiw 2003, with the damping taken in proportion to the stiffness.
#[derive(Clone, Debug, Default)]
pub struct HingeDamping {
    /// The hinges that are damped.
    pub hinges: Vec<Hinge>,
    /// τ of each hinge (s).
    pub times: Vec<f64>,
}

impl HingeDamping {
    /// Hinge, gradient of its angle (1/m), rate of its angle (1/s) and damping c (N·m·s).
    fn each<'a>(
        &'a self,
        state: &'a State,
    ) -> impl Iterator<Item = (&'a Hinge, [DVec3; 4], f64, f64)> + 'a {
        let hinges = self.hinges.iter().zip(&self.times);
        hinges.map(|(hinge, time)| {
            let gradient = Dihedral::of(hinge.of(&state.positions)).gradient;
            let velocities = hinge.of(&state.velocities);
            let rate = gradient.iter().zip(velocities).map(|(g, v)| g.dot(v)).sum();
            (hinge, gradient, rate, time * hinge.stiffness)
        })
    }
}

impl Damping for HingeDamping {
    fn name(&self) -> &'static str {
        "stiffness_damping"
    }

    fn power(&self, state: &State) -> f64 {
        self.each(state)
            .map(|(_, _, rate, c)| c * rate * rate)
            .sum()
    }

    fn add_forces(&self, state: &State, forces: &mut [DVec3]) {
        for (hinge, gradient, rate, c) in self.each(state) {
            for (corner, gradient) in hinge.corners.into_iter().zip(gradient) {
                forces[corner as usize] -= gradient * (c * rate);
            }
        }
    }

    fn pattern(&self) -> Pattern {
        hinge_pattern(&self.hinges)
    }

    fn add_jacobian(&self, state: &State, scale: f64, assembly: &mut Assembly<'_>) {
        for (element, (hinge, time)) in self.hinges.iter().zip(&self.times).enumerate() {
            let c = scale * time * hinge.stiffness;
            let gradient = Dihedral::of(hinge.of(&state.positions)).gradient;
            let hessian = Hessian::gauss_newton(&gradient, c);
            add_hessian(element, &hessian, assembly);
        }
    }
}
