//! What each part of a simulation keeps in memory.

use super::Simulation;
use crate::energy::PinWork;
use crate::model::Memory;

impl Simulation {
    /// The lists of its model and of its steps by part; what the scheme keeps for itself, and the meshes of
    /// obstacles, aren't counted.
    pub fn memory(&self) -> Memory {
        let mut memory = self.model.memory();
        for state in [&self.state, &self.before] {
            memory.add("particles", &state.positions);
            memory.add("particles", &state.velocities);
        }
        for (family, bytes) in self.view.weave.bytes() {
            memory.add_bytes(family, bytes);
        }
        memory.add("strain_limit", &self.unlimited);
        memory.add("contact", &self.walls);
        memory.add("contact", &self.contacts.grips);
        memory.add_bytes("contact", self.detection.bytes());
        let work = self.pin_work.as_ref();
        memory.add_bytes("pins", work.map_or(0, PinWork::bytes));
        memory
    }
}
