//! Uniform gravity.

use super::{Cut, Force, Tiles, Window};
use crate::linear::Ahead;
use crate::state::State;
use glam::DVec3;
use std::ops::Range;

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

    /// The weight of a particle (N).
    pub fn weight(&self, particle: usize) -> DVec3 {
        let mass = self.masses.get(particle).copied().unwrap_or(0.0);
        self.acceleration * mass
    }
}

impl Force for Gravity {
    fn name(&self) -> &'static str {
        "gravitational"
    }

    fn elements(&self) -> usize {
        self.masses.len()
    }

    fn energy_of(&self, elements: Range<usize>, positions: &[DVec3]) -> f64 {
        if self.masses.is_empty() {
            return 0.0; // nothing weighs
        }
        // Four sums side by side: one after the other, each addition waits for the last.
        let mut moments = [DVec3::ZERO; 4];
        let each = self.masses[elements.clone()].chunks(4);
        for (masses, positions) in each.zip(positions[elements].chunks(4)) {
            for (moment, (m, x)) in moments.iter_mut().zip(masses.iter().zip(positions)) {
                *moment += *x * *m;
            }
        }
        -self.acceleration.dot(moments.into_iter().sum())
    }

    fn add_forces(&self, state: &State, forces: &mut [DVec3]) {
        Cut::add_forces(self, 0, state, &mut Window::whole(forces));
    }

    fn cut(&self, _: Tiles) -> Box<dyn Cut> {
        Box::new(self.clone())
    }
}

impl Cut for Gravity {
    fn add_to(&self, ahead: &mut Ahead, _: usize, particles: Range<usize>) {
        ahead.add(&self.masses, particles);
    }

    fn add_forces(&self, _: usize, _: &State, window: &mut Window<'_>) {
        let (range, forces) = window.tile();
        for (force, &m) in forces.iter_mut().zip(&self.masses[range]) {
            *force += self.acceleration * m;
        }
    }
}
