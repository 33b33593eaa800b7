//! What moves: time, positions, velocities.

mod archive;

pub use archive::{Archive, Damaged};

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

    /// Carries all of it over.
    pub fn carry(&mut self, archive: &mut Archive) {
        archive.real(&mut self.time);
        archive.vectors(&mut self.positions);
        archive.vectors(&mut self.velocities);
    }

    /// A number that is another one if any bit of the state is, but for one case in 2⁶⁴: FNV-1a over its words
    /// (Fowler, Noll and Vo 1991), each turned so that high bits reach the low ones.
    pub fn hash(&self) -> u64 {
        let lists = [&self.positions, &self.velocities];
        let vectors = lists.into_iter().flatten().flat_map(DVec3::to_array);
        let words = vectors.map(f64::to_bits);
        [self.time.to_bits()]
            .into_iter()
            .chain(words)
            .fold(0xcbf2_9ce4_8422_2325, |hash: u64, word| {
                (hash ^ word).wrapping_mul(0x0100_0000_01b3).rotate_left(29)
            })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn any_bit_changes_the_hash() {
        let state = State {
            time: 0.5,
            positions: vec![DVec3::new(0.1, 0.2, 0.3); 3],
            velocities: vec![DVec3::new(-1.0, 0.0, 1e-9); 3],
        };
        let hash = state.hash();
        assert_eq!(hash, state.clone().hash());
        let mut other = state.clone();
        other.velocities[1].y = -0.0;
        assert_ne!(hash, other.hash());
        for bit in 0..64 {
            let mut other = state.clone();
            other.positions[2].z = f64::from_bits(0.3_f64.to_bits() ^ 1 << bit);
            assert_ne!(hash, other.hash(), "bit {bit}");
        }
        let mut other = state;
        other.positions.swap(0, 1);
        assert_eq!(hash, other.hash(), "alike");
        other.positions[0].x = 0.4;
        let first = other.hash();
        other.positions.swap(0, 1);
        assert_ne!(first, other.hash(), "order");
    }
}
