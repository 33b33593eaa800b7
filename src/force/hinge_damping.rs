//! Damping of the dihedral angles of hinges.

use super::dihedral::Hessian;
use super::hinge::{add_hessian, hinge_pattern};
use super::pass::{Lists, Tiled};
use super::{Cut, DAMPINGS, DampedMotion, Damping, Dihedral, Hinge, Tiles, Window};
use crate::linear::{Assembly, Pattern};
use crate::state::State;
use glam::DVec3;
use std::ops::Range;

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
    fn dampers(&self) -> impl Iterator<Item = Damper> + '_ {
        let each = self.hinges.iter().zip(&self.times);
        each.map(|(hinge, time)| (*hinge, *time))
    }
}

/// A hinge and its τ (s).
type Damper = (Hinge, f64);

/// Gradient of a hinge's angle (1/m), rate of its angle (1/s) and damping c (N·m·s).
#[inline]
fn motion((hinge, time): Damper, state: &State) -> ([DVec3; 4], f64, f64) {
    let gradient = Dihedral::of(hinge.of(&state.positions)).gradient;
    let velocities = hinge.of(&state.velocities);
    let rate = gradient.iter().zip(velocities).map(|(g, v)| g.dot(v)).sum();
    (gradient, rate, time * hinge.stiffness)
}

fn add_forces(dampers: impl Iterator<Item = Damper>, state: &State, window: &mut Window<'_>) {
    for damper in dampers {
        let (gradient, rate, c) = motion(damper, state);
        for (corner, gradient) in damper.0.corners.into_iter().zip(gradient) {
            window.add(corner, gradient * (-c * rate));
        }
    }
}

impl Damping for HingeDamping {
    fn name(&self) -> &'static str {
        DAMPINGS[1]
    }

    fn elements(&self) -> usize {
        self.times.len()
    }

    fn power_of(&self, elements: Range<usize>, motion: DampedMotion<'_>) -> f64 {
        let hinges = self.hinges[elements.clone()].iter();
        let power = |(hinge, time): (&Hinge, &f64)| {
            let gradient = Dihedral::of(hinge.of(motion.positions)).gradient;
            let rate = |velocities| {
                let corners = gradient.iter().zip(hinge.of(velocities));
                corners.map(|(g, v)| g.dot(v)).sum::<f64>()
            };
            time * hinge.stiffness * rate(motion.damped) * rate(motion.moved)
        };
        hinges.zip(&self.times[elements]).map(power).sum()
    }

    fn add_forces(&self, state: &State, forces: &mut [DVec3]) {
        add_forces(self.dampers(), state, &mut Window::whole(forces));
    }

    fn cut(&self, tiles: Tiles) -> Box<dyn Cut> {
        let dampers: Vec<Damper> = self.dampers().collect();
        let add = |dampers: &[Damper], state: &State, window: &mut Window<'_>| {
            add_forces(dampers.iter().copied(), state, window);
        };
        let tiled = Tiled::new(tiles, &dampers, |(h, _)| h.corners);
        Box::new(Lists { tiled, add })
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
