//! Going on from a checkpoint as if never stopped.
//!
//! A simulation is made anew from its scene, at its first state: that gives all that follows from the scene and
//! the start. What a checkpoint adds is the state then, and what the stages carry over from step to step.
//! Caches that only save work start empty: the same is found without them.

use super::Simulation;
use crate::collision::{Bodies, Tangle, Tangles};
use crate::state::{Archive, Damaged, State};

impl Simulation {
    /// Goes to where another simulation of the same scene, scheme and step was after `steps` steps: to a state of its
    /// cloths' particles, and to what [`Self::carry`] packed then.
    ///
    /// # Errors
    ///
    /// When that is of another model or version. The simulation can't be used then.
    pub fn go_on(
        &mut self,
        steps: u64,
        state: &State,
        archive: &mut Archive,
    ) -> Result<(), Damaged> {
        let cloth = ..self.model.cloth_particles();
        if [&state.positions, &state.velocities]
            .iter()
            .any(|list| list.len() != cloth.end)
        {
            return Err(Damaged);
        }
        self.state.time = state.time;
        self.state.positions[cloth].copy_from_slice(&state.positions);
        self.state.velocities[cloth].copy_from_slice(&state.velocities);
        // Lets go the pins whose time is past, as the last step did; schemes keep matrices of the pins that are left.
        self.stats.steps = steps;
        if let Some(before) = steps.checked_sub(1) {
            self.model.begin_step(self.time_after(before), state.time);
        }
        self.scheme = self.integrator.scheme(&self.model);
        self.bodies = Bodies::new(&self.model.obstacles, state.time);
        self.carry(archive);
        if let Some(impacts) = &mut self.impacts {
            let list = self.tangles.iter().flat_map(Tangles::list);
            impacts.exempt(list.map(|tangle| *tangle != Tangle::Free));
        }
        Ok(())
    }

    /// A new simulation of the same model, scheme and step that starts with a state of its cloths' particles; `None`
    /// when it has others.
    pub fn started_at(self, start: &State) -> Option<Self> {
        let Self {
            model,
            mut state,
            integrator,
            dt,
            ..
        } = self;
        let cloth = ..model.cloth_particles();
        let lists = [&start.positions, &start.velocities];
        if lists.iter().any(|list| list.len() != cloth.end) {
            return None;
        }
        state.time = start.time;
        state.positions[cloth].copy_from_slice(&start.positions);
        state.velocities[cloth].copy_from_slice(&start.velocities);
        Some(Self::new(model, state, integrator, dt))
    }

    /// Packs or unpacks what the stages and the scheme carry over to the next step besides the state of the cloths'
    /// particles.
    pub fn carry(&mut self, archive: &mut Archive) {
        let Self {
            model,
            state,
            scheme,
            contacts,
            bodies,
            detection,
            impacts,
            holds,
            tangles,
            tangled,
            ledger,
            budget,
            stats,
            ..
        } = self;
        stats.carry(archive);
        // What isn't cloth: the particles behind clamps.
        let rest = model.cloth_particles()..;
        archive.vectors(&mut state.positions[rest.clone()]);
        archive.vectors(&mut state.velocities[rest]);
        contacts.carry(archive);
        bodies.carry(archive);
        detection.carry(archive);
        if let Some(impacts) = impacts {
            impacts.carry(archive);
        }
        archive.list(holds, |archive, hold| hold.carry(archive));
        if (holds.iter().flat_map(|hold| hold.particles))
            .any(|particle| particle as usize >= model.cloth_particles())
        {
            archive.damage();
        }
        ledger.carry(archive);
        budget.carry(archive);
        archive.index(&mut tangled.now);
        archive.option(&mut tangled.took, Archive::real);
        let mut still = tangles.is_some();
        archive.flag(&mut still);
        match tangles {
            Some(tangles) if still => tangles.carry(archive),
            None if still => archive.damage(),
            _ => *tangles = None,
        }
        scheme.carry(model, archive);
    }
}
