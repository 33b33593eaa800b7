//! What each part of a model keeps in memory.

use super::{Model, Pins};
use crate::force::{BendingLaw as _, DiscreteShell, EdgeSpring, Hinge};
use std::collections::BTreeMap;

/// Size of lists (B) by the part that asks for them; a part that isn't modelled has no entry.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Memory {
    /// The size of each part's lists (B).
    pub parts: BTreeMap<&'static str, usize>,
}

impl Memory {
    /// Adds a list of a part.
    pub fn add<T>(&mut self, part: &'static str, list: &[T]) {
        self.add_bytes(part, size_of_val(list));
    }

    /// Adds the size of something of a part (B).
    pub fn add_bytes(&mut self, part: &'static str, bytes: usize) {
        if bytes > 0 {
            *self.parts.entry(part).or_default() += bytes;
        }
    }

    /// The size of all parts together (B).
    pub fn total(&self) -> usize {
        self.parts.values().sum()
    }
}

impl Model {
    /// Its lists, but for the meshes of obstacles.
    pub fn memory(&self) -> Memory {
        let mut memory = Memory::default();
        memory.add("particles", &self.masses);
        memory.add("particles", &self.inverse_masses);
        memory.add("particles", &self.rest);
        for cloth in &self.cloths {
            memory.add("triangles", &cloth.triangles);
        }
        memory.add("gravity", &self.gravity.masses);
        for batch in &self.springs {
            memory.add(batch.family, &batch.springs);
        }
        let hinges = |hinges: Option<&Vec<Hinge>>| hinges.map_or(0, |h| size_of_val(&h[..]));
        let edge_springs = self.edge_springs.as_ref().map(|batch| &batch.hinges);
        let shells = self.discrete_shells.as_ref().map(|batch| &batch.hinges);
        memory.add_bytes(EdgeSpring::NAME, hinges(edge_springs));
        memory.add_bytes(DiscreteShell::NAME, hinges(shells));
        if let Some(damping) = &self.mass_damping {
            memory.add("mass_damping", &damping.drag);
        }
        for damping in &self.spring_damping {
            memory.add("stiffness_damping", &damping.springs.springs);
            memory.add("stiffness_damping", &damping.times);
        }
        if let Some(damping) = &self.hinge_damping {
            memory.add("stiffness_damping", &damping.hinges);
            memory.add("stiffness_damping", &damping.times);
        }
        if let Some(limit) = &self.strain_limit {
            memory.add("strain_limit", &limit.springs);
        }
        memory.add_bytes("pins", self.pins.bytes());
        memory
    }
}

impl Pins {
    /// Size of what moves and is let go (B).
    fn bytes(&self) -> usize {
        let drives = self.drives.iter().map(|drive| {
            size_of_val(drive) + size_of_val(&drive.particles[..]) + size_of_val(&drive.starts[..])
        });
        let releases = self.releases.iter().map(|release| {
            let hinges = release.hinges.len() * size_of::<([u32; 4], f64)>();
            size_of_val(release) + size_of_val(&release.particles[..]) + hinges
        });
        drives.chain(releases).sum()
    }
}
