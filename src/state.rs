//! What moves: time, positions, velocities.

use crate::linear::Chunks;
use glam::DVec3;

/// The moving part of a simulation: one entry a particle, all cloths in a row.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct State {
    /// Simulated time (s).
    pub time: f64,
    /// Particle positions (m).
    pub positions: Vec<DVec3>,
    /// Particle velocities (m/s).
    pub velocities: Vec<DVec3>,
}

impl State {
    /// A state at rest at time 0.
    pub fn at_rest(positions: Vec<DVec3>) -> Self {
        let velocities = vec![DVec3::ZERO; positions.len()];
        Self {
            time: 0.0,
            positions,
            velocities,
        }
    }

    /// Index of the first particle whose position or velocity is not finite.
    pub fn first_non_finite(&self) -> Option<usize> {
        let finite = |(x, v): (&DVec3, &DVec3)| x.is_finite() && v.is_finite();
        self.positions
            .iter()
            .zip(&self.velocities)
            .position(|pair| !finite(pair))
    }

    /// Copies another state of the same size without allocating.
    pub fn copy_from(&mut self, other: &Self) {
        self.time = other.time;
        let chunks = Chunks::of(self.positions.len());
        chunks.for_each(&mut self.positions, |chunk, positions| {
            positions.copy_from_slice(&other.positions[chunks.range(chunk)]);
        });
        chunks.for_each(&mut self.velocities, |chunk, velocities| {
            velocities.copy_from_slice(&other.velocities[chunks.range(chunk)]);
        });
    }
}
