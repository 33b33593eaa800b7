//! Uniform gravity.

use super::{Cut, Force, Window};
use crate::linear::Chunks;
use crate::state::State;
use glam::DVec3;

/// Weight of every particle: E = −Σ m g · x (J), zero at the origin; f = m g (N).
#[derive(Clone, Debug)]
pub struct Gravity {
    /// Acceleration (m/s²).
    pub acceleration: DVec3,
    /// Mass of each particle (kg); empty where nothing has weight.
    pub masses: Vec<f64>,
}

impl Gravity {
    /// The weight of some masses (kg) in an acceleration (m/s²).
    pub fn new(acceleration: DVec3, masses: &[f64]) -> Self {
        let weighs = acceleration != DVec3::ZERO;
        let masses = if weighs { masses.to_vec() } else { Vec::new() };
        Self {
            acceleration,
            masses,
        }
    }
}

impl Force for Gravity {
    fn name(&self) -> &'static str {
        "gravitational"
    }

    fn energy(&self, state: &State) -> f64 {
        let lifted = |(&m, x): (&f64, &DVec3)| -m * self.acceleration.dot(*x);
        self.masses.iter().zip(&state.positions).map(lifted).sum()
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
