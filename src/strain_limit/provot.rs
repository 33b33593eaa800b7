//! Strain limiting spring by spring.
//!
//! Source: Provot 1995, "Deformation constraints in a mass-spring model to describe rigid cloth
//! behavior". He makes one pass and halves the correction between free ends; here the shares follow
//! the masses, so that momentum is kept, and passes are repeated until the limit holds.

use crate::force::Spring;
use crate::state::Archive;
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

/// Passes after which corrections are enlarged by [`OVERSHOOT`]. A few passes reach most states
/// exactly; long rows need hundreds, and a third of them with larger corrections.
const PATIENT_PASSES: u32 = 20;

/// Factor of over-relaxation: a row of n springs converges fastest with 2 / (1 + sin(π/n)), 1.7 for
/// 15 and 1.9 for 60.
const OVERSHOOT: f64 = 1.7;

/// Passes after which what remains is reported instead. A row of 30 springs, stretched
/// to four times its limit, needs 164.
const MAX_PASSES: u32 = 500;

/// Springs beyond this share of the longest length take part in the passes: shortening one can
/// lengthen its neighbours by a few percent.
const NEAR: f64 = 0.96;

impl StrainLimit {
    /// Shortens the springs that exceed the limit, until none does.
    ///
    /// `inverse_masses` (1/kg) is 0 for particles that must not move. Both ends move along the
    /// spring in proportion to their inverse mass, so that Σ m x stays and no torque arises.
    /// Passes run forwards and backwards in turn: a correction travels along the rows in both
    /// directions. They visit the springs near the limit only; when those hold, all are looked at
    /// again. `held` keeps what touches from being pulled together.
    pub fn apply(&self, positions: &mut [DVec3], held: Held<'_>) -> Limited {
        let before = self.largest_strain(positions);
        let mut limited = Limited {
            passes: 0,
            before,
            after: before,
        };
        while limited.after > self.max + SLACK && limited.passes < MAX_PASSES {
            let near = (1.0 + self.max) * NEAR;
            let hot: Vec<&Spring> = self
                .springs
                .iter()
                .filter(|spring| spring.stretch_squared(positions) > near * near)
                .collect();
            let most = MAX_PASSES - limited.passes;
            let passes = self.relax(&hot, positions, held, most);
            if passes == 0 {
                break; // within rounding of the slack
            }
            limited.passes += passes;
            limited.after = self.largest_strain(positions);
        }
        limited
    }

    /// Passes over some springs until none exceeds the limit; returns their number.
    fn relax(
        &self,
        springs: &[&Spring],
        positions: &mut [DVec3],
        held: Held<'_>,
        most: u32,
    ) -> u32 {
        let enough = (1.0 + self.max + SLACK) * (1.0 + self.max + SLACK);
        for pass in 0..most {
            let factor = if pass < PATIENT_PASSES {
                1.0
            } else {
                OVERSHOOT
            };
            if springs
                .iter()
                .all(|spring| spring.stretch_squared(positions) <= enough)
            {
                return pass;
            }
            if pass % 2 == 0 {
                springs
                    .iter()
                    .for_each(|spring| self.shorten(spring, factor, positions, held));
            } else {
                springs
                    .iter()
                    .rev()
                    .for_each(|spring| self.shorten(spring, factor, positions, held));
            }
            for hold in held.holds {
                hold.keep(positions, held.inverse_masses);
            }
        }
        most
    }

    /// Whether a spring is longer than the limit and its slack allow.
    pub fn is_exceeded(&self, positions: &[DVec3]) -> bool {
        self.largest_strain(positions) > self.max + SLACK
    }

    /// Largest strain of the limited springs; −1 when there are none.
    pub fn largest_strain(&self, positions: &[DVec3]) -> f64 {
        let squares = self
            .springs
            .iter()
            .map(|spring| spring.stretch_squared(positions));
        squares.fold(0.0, f64::max).sqrt() - 1.0
    }

    fn shorten(&self, spring: &Spring, factor: f64, positions: &mut [DVec3], held: Held<'_>) {
        let [i, j] = spring.ends.map(|end| end as usize);
        let longest = (1.0 + self.max) * spring.rest_length;
        let d = positions[j] - positions[i];
        let length_squared = d.length_squared();
        let (wi, wj) = (held.inverse_masses[i], held.inverse_masses[j]);
        if length_squared <= longest * longest || wi + wj <= 0.0 {
            return;
        }
        let length = length_squared.sqrt();
        let correction = d * (factor * (length - longest) / (length * (wi + wj)));
        if wi > 0.0 {
            positions[i] = held.keep_out(i, positions[i] + correction * wi);
        }
        if wj > 0.0 {
            positions[j] = held.keep_out(j, positions[j] - correction * wj);
        }
    }
}

/// What limits the particles' motion while springs are shortened.
#[derive(Clone, Copy, Debug)]
pub struct Held<'a> {
    /// 1/mass (1/kg), 0 for particles that must not move.
    pub inverse_masses: &'a [f64],
    /// For particles that touch an obstacle: one entry a particle, or none where there is no obstacle.
    pub walls: &'a [Wall],
    /// For edges and triangles that touch something.
    pub holds: &'a [Hold],
}

/// A gap between features that must not close: Σ wᵢ n · xᵢ ≥ c over up to four particles.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Hold {
    /// The particles; those of weight 0 don't count.
    pub particles: [u32; 4],
    /// wᵢ, those of the feature behind the gap negative.
    pub weights: [f64; 4],
    /// n, the gap's unit direction.
    pub normal: DVec3,
    /// c (m).
    pub offset: f64,
}

impl Hold {
    /// Whether no obstacle is at either side: the weights of the two sides outweigh each other.
    pub fn is_between_particles(&self) -> bool {
        self.weights.iter().sum::<f64>().abs() < 0.5
    }

    /// Carries all of it over.
    pub fn carry(&mut self, archive: &mut Archive) {
        for (particle, weight) in self.particles.iter_mut().zip(&mut self.weights) {
            archive.small(particle);
            archive.real(weight);
        }
        archive.vector(&mut self.normal);
        archive.real(&mut self.offset);
    }

    /// Moves the particles along the normal by their weights and inverse masses, if the gap is too small.
    fn keep(&self, positions: &mut [DVec3], inverse_masses: &[f64]) {
        let (mut gap, mut compliance) = (-self.offset, 0.0);
        let each = || self.particles.into_iter().zip(self.weights);
        for (i, weight) in each().filter(|(_, weight)| *weight != 0.0) {
            gap += weight * self.normal.dot(positions[i as usize]);
            compliance += weight * weight * inverse_masses[i as usize];
        }
        if gap >= 0.0 || compliance <= 0.0 {
            return;
        }
        let push = self.normal * (-gap / compliance);
        for (i, weight) in each().filter(|(_, weight)| *weight != 0.0) {
            positions[i as usize] += push * (weight * inverse_masses[i as usize]);
        }
    }
}

impl Held<'_> {
    /// Where a particle that is to go to `x` may go.
    #[inline]
    fn keep_out(&self, particle: usize, x: DVec3) -> DVec3 {
        self.walls.get(particle).map_or(x, |wall| wall.keep_out(x))
    }
}

/// The half space n · x ≥ c in which a particle has to stay.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Wall {
    /// Unit normal, pointing into the half space; zero where there is no wall.
    pub normal: DVec3,
    /// c (m).
    pub offset: f64,
}

impl Wall {
    /// The nearest point of the half space.
    #[inline]
    fn keep_out(&self, x: DVec3) -> DVec3 {
        let missing = self.offset - self.normal.dot(x);
        if missing > 0.0 {
            x + self.normal * missing
        } else {
            x
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn by_mass(inverse_masses: &[f64]) -> Held<'_> {
        Held {
            inverse_masses,
            walls: &[],
            holds: &[],
        }
    }

    /// A row across a sharp edge that only its middle spring touches: the limit is reached on both sides of it,
    /// and the gap stays.
    #[test]
    fn a_gap_between_features_stays_open() {
        let limit = row(4);
        let mut positions: Vec<DVec3> = [-0.3, -0.1, 0.1, 0.3]
            .map(|x: f64| DVec3::new(x, -x.abs(), 0.0))
            .to_vec();
        let hold = Hold {
            particles: [1, 2, 0, 0],
            weights: [0.5, 0.5, 0.0, 0.0],
            normal: DVec3::Y,
            offset: -0.1,
        };
        let held = Held {
            holds: &[hold],
            ..by_mass(&[1.0; 4])
        };
        let limited = limit.apply(&mut positions, held);
        assert!(limited.before > 0.9 && limited.after <= limit.max + 2.0 * SLACK);
        let height = 0.5 * (positions[1].y + positions[2].y);
        assert!(height >= -0.1 - 1e-12, "{height}");
    }

    fn row(particles: u32) -> StrainLimit {
        let springs = (1..particles)
            .map(|j| Spring {
                ends: [j - 1, j],
                rest_length: 0.1,
                stiffness: 1.0,
            })
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
        let moment = |positions: &[DVec3]| -> DVec3 {
            positions.iter().zip(&masses).map(|(x, m)| *x * *m).sum()
        };
        let before = moment(&positions);
        let limited = limit.apply(&mut positions, by_mass(&inverse));
        assert!(limited.before > 0.3 && limited.passes > 0, "{limited:?}");
        assert!(
            limited.after <= 0.1 + SLACK && limited.passes < 200,
            "{limited:?}"
        );
        assert!((moment(&positions) - before).length() < 1e-14);
    }

    #[test]
    fn pinned_particles_stay_and_two_pins_too_far_apart_are_reported() {
        let limit = row(2);
        let mut positions = vec![DVec3::ZERO, DVec3::X];
        let limited = limit.apply(&mut positions, by_mass(&[0.0, 0.0]));
        assert_eq!(positions, [DVec3::ZERO, DVec3::X]);
        assert!(limited.after > 8.9, "{limited:?}");
        let limited = limit.apply(&mut positions, by_mass(&[0.0, 2.0]));
        assert!(positions[0] == DVec3::ZERO && limited.after <= 0.1 + SLACK);
    }

    #[test]
    fn what_is_within_the_limit_is_left_alone() {
        let limit = row(2);
        let mut positions = vec![DVec3::ZERO, DVec3::X * 0.105];
        assert_eq!(limit.apply(&mut positions, by_mass(&[1.0, 1.0])).passes, 0);
        assert_eq!(positions[1], DVec3::X * 0.105);
    }

    #[test]
    fn a_wall_is_not_crossed_and_the_other_end_gives_way() {
        let limit = row(2);
        let mut positions = vec![DVec3::ZERO, DVec3::new(0.1, -0.2, 0.0)];
        let wall = Wall {
            normal: DVec3::Y,
            offset: 0.0,
        };
        let limited = limit.apply(
            &mut positions,
            Held {
                walls: &[wall, Wall::default()],
                ..by_mass(&[1.0, 1.0])
            },
        );
        assert!(
            limited.after <= 0.1 + SLACK && positions[0].y >= 0.0 && positions[0].x > 0.0,
            "{positions:?}"
        );
    }
}
