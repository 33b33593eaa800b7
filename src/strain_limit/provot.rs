//! Strain limiting spring by spring.
//!
//! Source: Provot 1995, "Deformation constraints in a mass-spring model to describe rigid cloth
//! behavior". He makes one pass and halves the correction between free ends; here the shares follow
//! the masses, so that momentum is kept, and passes are repeated until the limit holds.

use crate::force::Spring;
use glam::DVec3;

/// An upper bound on the strain of springs.
#[derive(Clone, Debug)]
pub struct StrainLimit {
    /// Largest strain ε = ℓ/ℓ₀ − 1.
    pub max: f64,
    /// The springs that are limited: structural and shear (Provot leaves bend springs alone).
    pub springs: Vec<Spring>,
}

/// What limiting did.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Limited {
    /// Passes over the springs that moved something.
    pub passes: u32,
    /// Largest strain before.
    pub before: f64,
    /// Largest strain that remains.
    pub after: f64,
}

/// Strain by which the limit may be missed: half of what the report's readers are promised (0.1 % of
/// strain 10 %), so that a later contact correction has room.
const SLACK: f64 = 5e-5;

/// Passes after which what remains is reported instead. A sheet of 60 × 60 cells hung from two
/// corners at twenty times the load that its limit bears needs about 300.
const MAX_PASSES: u32 = 500;

impl StrainLimit {
    /// Shortens the springs that exceed the limit, until none does.
    ///
    /// `inverse_masses` (1/kg) is 0 for particles that must not move. Both ends move along the
    /// spring in proportion to their inverse mass, so that Σ m x stays and no torque arises.
    /// Passes run forwards and backwards in turn: a correction travels along the rows in both
    /// directions.
    pub fn apply(&self, positions: &mut [DVec3], inverse_masses: &[f64]) -> Limited {
        let before = self.largest_strain(positions);
        let mut limited = Limited { passes: 0, before, after: before };
        while limited.after > self.max + SLACK && limited.passes < MAX_PASSES {
            if limited.passes % 2 == 0 {
                self.springs.iter().for_each(|spring| self.shorten(spring, positions, inverse_masses));
            } else {
                self.springs.iter().rev().for_each(|spring| self.shorten(spring, positions, inverse_masses));
            }
            limited.passes += 1;
            limited.after = self.largest_strain(positions);
        }
        limited
    }

    /// Largest strain of the limited springs; −1 when there are none.
    pub fn largest_strain(&self, positions: &[DVec3]) -> f64 {
        let stretch_squared = self
            .springs
            .iter()
            .map(|spring| spring.span(positions).length_squared() / (spring.rest_length * spring.rest_length))
            .fold(0.0, f64::max);
        stretch_squared.sqrt() - 1.0
    }

    fn shorten(&self, spring: &Spring, positions: &mut [DVec3], inverse_masses: &[f64]) {
        let [i, j] = spring.ends.map(|end| end as usize);
        let longest = (1.0 + self.max) * spring.rest_length;
        let d = positions[j] - positions[i];
        let length_squared = d.length_squared();
        let (wi, wj) = (inverse_masses[i], inverse_masses[j]);
        if length_squared <= longest * longest || wi + wj <= 0.0 {
            return;
        }
        let length = length_squared.sqrt();
        let correction = d * ((length - longest) / (length * (wi + wj)));
        positions[i] += correction * wi;
        positions[j] -= correction * wj;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(particles: u32) -> StrainLimit {
        let springs = (1..particles)
            .map(|j| Spring { ends: [j - 1, j], rest_length: 0.1, stiffness: 1.0 })
            .collect();
        StrainLimit { max: 0.1, springs }
    }

    #[test]
    fn the_limit_is_reached_and_momentum_kept() {
        let limit = row(30);
        let masses: Vec<f64> = (0..30).map(|i| 0.01 + 0.001 * f64::from(i)).collect();
        let inverse: Vec<f64> = masses.iter().map(|m| 1.0 / m).collect();
        let mut positions: Vec<DVec3> = (0..30_u32)
            .map(|i| {
                let t = f64::from(i);
                DVec3::new(0.13 * t, 0.05 * t.sin(), 0.02 * t.cos())
            })
            .collect();
        let moment = |positions: &[DVec3]| -> DVec3 { positions.iter().zip(&masses).map(|(x, m)| *x * *m).sum() };
        let before = moment(&positions);
        let limited = limit.apply(&mut positions, &inverse);
        assert!(limited.before > 0.3 && limited.passes > 0, "{limited:?}");
        assert!(limited.after <= 0.1 + SLACK, "{limited:?}");
        assert!((moment(&positions) - before).length() < 1e-14);
    }

    #[test]
    fn pinned_particles_stay_and_two_pins_too_far_apart_are_reported() {
        let limit = row(2);
        let mut positions = vec![DVec3::ZERO, DVec3::X];
        let limited = limit.apply(&mut positions, &[0.0, 0.0]);
        assert_eq!(positions, [DVec3::ZERO, DVec3::X]);
        assert!(limited.after > 8.9, "{limited:?}");
        let limited = limit.apply(&mut positions, &[0.0, 2.0]);
        assert!(positions[0] == DVec3::ZERO && limited.after <= 0.1 + SLACK);
    }

    #[test]
    fn what_is_within_the_limit_is_left_alone() {
        let limit = row(2);
        let mut positions = vec![DVec3::ZERO, DVec3::X * 0.105];
        assert_eq!(limit.apply(&mut positions, &[1.0, 1.0]).passes, 0);
        assert_eq!(positions[1], DVec3::X * 0.105);
    }
}
