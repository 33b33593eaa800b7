//! Uniform gravity.

use super::{Cut, Force, Window};
use crate::linear::Chunks;
use crate::state::State;
use glam::DVec3;
use std::ops::Range;

/// Weight of every particle: E = −Σ m g · x (J), zero at the origin; f = m g (N).
#[derive(Clone, Debug)]
pub struct Gravity {
    /// Acceleration (m/s²).
    pub acceleration: DVec3,
    /// Mass of each particle (kg).
    pub masses: Vec<f64>,
}

impl Force for Gravity {
    fn name(&self) -> &'static str {
        "gravitational"
    }

    fn elements(&self) -> usize {
        self.masses.len()
    }

    fn energy_of(&self, elements: Range<usize>, positions: &[DVec3]) -> f64 {
        let each = self.masses[elements.clone()]
            .iter()
            .zip(&positions[elements]);
        let moment: DVec3 = each.map(|(&m, &x)| x * m).sum();
        -self.acceleration.dot(moment)
    }

    fn add_forces(&self, state: &State, forces: &mut [DVec3]) {
        Cut::add_forces(self, 0, state, &mut Window::whole(forces));
    }

    fn cut(&self, _: Chunks) -> Box<dyn Cut> {
        Box::new(self.clone())
    }
}

impl Cut for Gravity {
    fn add_forces(&self, _: usize, _: &State, window: &mut Window<'_>) {
        let masses = &self.masses[window.range()];
        for (force, &m) in window.forces.iter_mut().zip(masses) {
            *force += self.acceleration * m;
        }
    }
}
