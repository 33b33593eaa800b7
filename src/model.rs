//! Everything that is fixed during a run, but for pins that let go.

mod memory;
mod part;
mod pins;

pub use memory::Memory;
pub use pins::{Drive, Pins, Release};

use crate::collision::{Contacts, Masses, Obstacle, SelfCollision};
use crate::force::{
    Damping, DiscreteShell, EdgeSpring, Force, ForcePass, Gravity, Hinge, HingeBatch, HingeDamping,
    MassDamping, Spring, SpringBatch, SpringDamping, Stiffness, largest_stretch_squared,
};
use crate::mesh::edge_uses;
use crate::strain_limit::StrainLimit;
use glam::DVec3;
use std::ops::Range;

/// Masses, forces, obstacles, limits and pins. A part that a scene doesn't ask for isn't there.
#[derive(Clone, Debug)]
pub struct Model {
    /// The cloths, in the order of their particles. Particles behind the last cloth's are the far
    /// sides of clamps: pinned, without mass and never shown.
    pub cloths: Vec<Cloth>,
    /// Mass of each particle (kg).
    pub masses: Vec<f64>,
    /// 1/mass of each particle (1/kg), 0 for pinned ones.
    pub inverse_masses: Vec<f64>,
    /// Pins that move or let go.
    pub pins: Pins,
    /// Particle positions at rest (m): each cloth's in coordinates of its own.
    pub rest: Vec<DVec3>,
    /// Weight.
    pub gravity: Gravity,
    /// Springs by family.
    pub springs: Vec<SpringBatch>,
    /// Bending of the cloths that ask for edge springs.
    pub edge_springs: Option<HingeBatch<EdgeSpring>>,
    /// Bending of the cloths that ask for discrete shells.
    pub discrete_shells: Option<HingeBatch<DiscreteShell>>,
    /// Drag on all motion.
    pub mass_damping: Option<MassDamping>,
    /// Damping of change of length, by family.
    pub spring_damping: Vec<SpringDamping>,
    /// Damping of bending.
    pub hinge_damping: Option<HingeDamping>,
    /// Upper bound on strain.
    pub strain_limit: Option<StrainLimit>,
    /// What the cloth collides with.
    pub obstacles: Vec<Obstacle>,
    /// How cloth collides with cloth.
    pub self_collision: Option<SelfCollision>,
}

/// One cloth of a model.
#[derive(Clone, Debug)]
pub struct Cloth {
    /// Its name in the scene.
    pub name: String,
    /// Its particles.
    pub particles: Range<usize>,
    /// Its triangles, by the model's particles; empty for a chain.
    pub triangles: Vec<[u32; 3]>,
}

impl Model {
    /// Number of particles, with the far sides of clamps.
    pub fn particles(&self) -> usize {
        self.masses.len()
    }

    /// Number of the cloths' particles.
    pub fn cloth_particles(&self) -> usize {
        self.cloths.last().map_or(0, |cloth| cloth.particles.end)
    }

    /// The masses of all particles, and their inverses.
    pub fn by_mass(&self) -> Masses<'_> {
        Masses {
            masses: &self.masses,
            inverse: &self.inverse_masses,
        }
    }

    /// Whether a particle is pinned.
    pub fn is_pinned(&self, particle: usize) -> bool {
        self.inverse_masses[particle] == 0.0
    }

    /// Every force. The integrators, the energy ledger and the tests walk this list, so that none
    /// can forget one.
    pub fn forces(&self) -> impl Iterator<Item = &dyn Force> {
        let inner = self.stiffnesses().map(|law| law as &dyn Force);
        let weighs = self.gravity.acceleration != DVec3::ZERO;
        let weight = weighs.then_some(&self.gravity as &dyn Force);
        weight.into_iter().chain(inner)
    }

    /// The forces that resist deformation.
    pub fn stiffnesses(&self) -> impl Iterator<Item = &dyn Stiffness> {
        let springs = self.springs.iter().map(|batch| batch as &dyn Stiffness);
        let edge_springs = self
            .edge_springs
            .iter()
            .map(|batch| batch as &dyn Stiffness);
        let shells = self
            .discrete_shells
            .iter()
            .map(|batch| batch as &dyn Stiffness);
        springs.chain(edge_springs).chain(shells)
    }

    /// Every damping.
    pub fn dampings(&self) -> impl Iterator<Item = &dyn Damping> {
        let mass = self
            .mass_damping
            .iter()
            .map(|damping| damping as &dyn Damping);
        let springs = self
            .spring_damping
            .iter()
            .map(|damping| damping as &dyn Damping);
        let hinges = self
            .hinge_damping
            .iter()
            .map(|damping| damping as &dyn Damping);
        mass.chain(springs).chain(hinges)
    }

    /// Every force and damping, for passes on all threads.
    pub fn force_pass(&self) -> ForcePass {
        ForcePass::new(self.particles(), self.forces(), self.dampings())
    }

    /// No contact, with room for as many as there may be: none without obstacles.
    pub fn no_contacts(&self) -> Contacts {
        Contacts::none(if self.obstacles.is_empty() {
            0
        } else {
            self.particles()
        })
    }

    /// The hinges of both laws.
    pub fn hinges(&self) -> impl Iterator<Item = &Hinge> {
        let edge_springs = self.edge_springs.iter().flat_map(|batch| &batch.hinges);
        let shells = self.discrete_shells.iter().flat_map(|batch| &batch.hinges);
        edge_springs.chain(shells)
    }

    /// Number of springs.
    pub fn spring_count(&self) -> usize {
        self.springs.iter().map(|batch| batch.springs.len()).sum()
    }

    /// The springs whose strain is reported and limited: all but bend springs, which stand for
    /// bending and not for the length of the weave, and zero-length ones, which have no strain.
    pub fn weave(&self) -> impl Iterator<Item = &SpringBatch> {
        self.springs.iter().filter(|batch| batch.is_weave())
    }

    /// Largest strain of the weave; 0 without springs.
    pub fn largest_strain(&self, positions: &[DVec3]) -> f64 {
        let squares = self
            .weave()
            .map(|batch| largest_stretch_squared(&batch.springs, positions));
        squares
            .reduce(f64::max)
            .map_or(0.0, |square| square.sqrt() - 1.0)
    }

    /// Whether anything can touch anything.
    pub fn has_contact(&self) -> bool {
        !self.obstacles.is_empty() || self.self_collision.is_some()
    }

    /// Whether stages besides the integration may move particles.
    pub fn is_corrected(&self) -> bool {
        self.strain_limit.is_some() || self.has_contact()
    }

    /// The links of cloths without triangles.
    pub fn links(&self) -> Vec<[u32; 2]> {
        let chains = self
            .cloths
            .iter()
            .filter(|cloth| cloth.triangles.is_empty());
        let families = self.springs.iter().filter(|batch| batch.family != "bend");
        let springs: Vec<_> = families.flat_map(|batch| &batch.springs).collect();
        let own = chains.flat_map(|chain| {
            let inside = |spring: &&&Spring| chain.particles.contains(&(spring.ends[0] as usize));
            springs.iter().filter(inside).map(|spring| spring.ends)
        });
        own.collect()
    }

    /// Every edge of the cloths' triangles, and every link.
    pub fn edges(&self) -> Vec<[u32; 2]> {
        let triangles = self.cloths.iter().map(|cloth| &cloth.triangles);
        let edges = triangles.flat_map(|triangles| edge_uses(triangles).into_keys());
        edges.chain(self.links()).collect()
    }

    /// Name of a particle's cloth and the particle's number in it.
    pub fn place(&self, particle: usize) -> (&str, usize) {
        self.cloths
            .iter()
            .find(|cloth| cloth.particles.contains(&particle))
            .map_or(("", particle), |cloth| {
                (cloth.name.as_str(), particle - cloth.particles.start)
            })
    }
}
