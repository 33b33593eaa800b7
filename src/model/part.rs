//! A part of a model: what acts on a few of its particles.

use super::{Model, Pins};
use crate::force::{
    Gravity, Hinge, HingeBatch, HingeDamping, MassDamping, Spring, SpringBatch, SpringDamping,
};

/// The particles of a part, numbered as they are met.
struct Numbering {
    /// How many were asked for: the first ones.
    chosen: u32,
    /// Number in the part of each particle of the whole.
    local: Vec<Option<u32>>,
    /// Number in the whole of each particle of the part.
    particles: Vec<u32>,
}

impl Numbering {
    fn number(&mut self, particle: u32) -> u32 {
        let next = u32::try_from(self.particles.len()).unwrap_or(u32::MAX);
        let known = &mut self.local[particle as usize];
        if known.is_none() {
            self.particles.push(particle);
        }
        *known.get_or_insert(next)
    }

    /// The corners of an element in the part, if it touches a chosen particle.
    fn take<const N: usize>(&mut self, corners: [u32; N]) -> Option<[u32; N]> {
        let chosen = |&i: &u32| self.local[i as usize].is_some_and(|local| local < self.chosen);
        let touches = corners.iter().any(chosen);
        touches.then(|| corners.map(|corner| self.number(corner)))
    }

    fn spring(&mut self, spring: &Spring) -> Option<Spring> {
        let ends = self.take(spring.ends)?;
        Some(Spring { ends, ..*spring })
    }

    fn hinge(&mut self, hinge: &Hinge) -> Option<Hinge> {
        let corners = self.take(hinge.corners)?;
        Some(Hinge { corners, ..*hinge })
    }

    fn springs(&mut self, batch: &SpringBatch) -> SpringBatch {
        let own = batch.springs.iter().filter_map(|s| self.spring(s));
        SpringBatch {
            family: batch.family,
            springs: own.collect(),
        }
    }

    fn hinges<L: crate::force::BendingLaw>(&mut self, batch: &HingeBatch<L>) -> HingeBatch<L> {
        HingeBatch::new(batch.hinges.iter().filter_map(|h| self.hinge(h)).collect())
    }

    fn spring_damping(&mut self, damping: &SpringDamping) -> SpringDamping {
        let each = damping.springs.springs.iter().zip(&damping.times);
        let (springs, times) = each
            .filter_map(|(spring, &time)| Some((self.spring(spring)?, time)))
            .unzip();
        let family = damping.springs.family;
        SpringDamping {
            springs: SpringBatch { family, springs },
            times,
        }
    }

    fn hinge_damping(&mut self, damping: &HingeDamping) -> HingeDamping {
        let each = damping.hinges.iter().zip(&damping.times);
        let (hinges, times) = each
            .filter_map(|(hinge, &time)| Some((self.hinge(hinge)?, time)))
            .unzip();
        HingeDamping { hinges, times }
    }

    fn of<T: Copy>(&self, list: &[T]) -> Vec<T> {
        self.particles.iter().map(|&i| list[i as usize]).collect()
    }
}

impl Model {
    /// The elements that touch `chosen` particles, as a model of its own: forces on the chosen ones are
    /// those of the whole. Also the whole's number of each of its particles, the chosen ones first.
    pub fn around(&self, chosen: impl Iterator<Item = u32>) -> (Self, Vec<u32>) {
        let mut numbering = Numbering {
            chosen: u32::MAX,
            local: vec![None; self.particles()],
            particles: Vec::new(),
        };
        let count = chosen.map(|particle| numbering.number(particle)).max();
        numbering.chosen = count.map_or(0, |last| last + 1);
        let n = &mut numbering;
        let springs = self.springs.iter().map(|batch| n.springs(batch)).collect();
        let dampings = self.spring_damping.iter();
        let spring_damping = dampings.map(|damping| n.spring_damping(damping)).collect();
        let edge_springs = self.edge_springs.as_ref().map(|batch| n.hinges(batch));
        let discrete_shells = self.discrete_shells.as_ref().map(|batch| n.hinges(batch));
        let hinge_damping = self.hinge_damping.as_ref().map(|d| n.hinge_damping(d));
        let masses = n.of(&self.masses);
        let part = Self {
            cloths: Vec::new(),
            inverse_masses: n.of(&self.inverse_masses),
            rest: n.of(&self.rest),
            gravity: Gravity::new(self.gravity.acceleration, &masses),
            masses,
            pins: Pins::default(),
            springs,
            edge_springs,
            discrete_shells,
            mass_damping: self.mass_damping.as_ref().map(|damping| MassDamping {
                drag: n.of(&damping.drag),
            }),
            spring_damping,
            hinge_damping,
            strain_limit: None,
            obstacles: Vec::new(),
            self_collision: None,
        };
        (part, numbering.particles)
    }
}
