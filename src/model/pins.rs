//! Pins that move, and pins that let go.

use super::Model;
use crate::force::Hinge;
use crate::motion::{Motion, Placement};
use crate::state::State;
use glam::DVec3;
use std::collections::BTreeMap;

/// What pins do besides holding still: nothing, in most models.
#[derive(Clone, Debug, Default)]
pub struct Pins {
    /// The motions, each with the particles that it moves.
    pub drives: Vec<Drive>,
    /// What is let go, in the order of time.
    pub releases: Vec<Release>,
    /// How many of `releases` have happened.
    released: usize,
}

/// Particles that move rigidly while they are pinned, far corners of clamps among them.
#[derive(Clone, Debug)]
pub struct Drive {
    /// The motion.
    pub motion: Motion,
    /// The point about which it turns, where it starts (m).
    pub center: DVec3,
    /// The particles.
    pub particles: Vec<u32>,
    /// Where each of them starts (m).
    pub starts: Vec<DVec3>,
}

/// What is let go at one time.
#[derive(Clone, Debug, Default)]
pub struct Release {
    /// The time (s).
    pub time: f64,
    /// The particles that become free.
    pub particles: Vec<u32>,
    /// Stiffness (N·m) from then on of hinges, by their corners: 0 where a clamp held the tangent.
    pub hinges: BTreeMap<[u32; 4], f64>,
}

impl Pins {
    /// Pins with motions and releases, none of which has happened.
    pub fn new(drives: Vec<Drive>, releases: Vec<Release>) -> Self {
        Self {
            drives,
            releases,
            ..Self::default()
        }
    }

    /// The next release that belongs to the start of a step from `start` to `end` (s).
    fn due(&self, start: f64, end: f64) -> Option<&Release> {
        let next = self.releases.get(self.released);
        next.filter(|release| release.time < 0.5 * (start + end))
    }

    /// Whether all pins hold still for ever.
    pub fn are_still(&self) -> bool {
        self.drives.is_empty() && self.releases.is_empty()
    }
}

impl Model {
    /// Begins a step from `start` to `end` (s): lets go what is to be released nearer to its start than
    /// to its end, or earlier. Depends on the times alone, so that a resumed run does the same.
    ///
    /// A scheme that keeps what it found of stiffnesses or pinned particles from step to step compares
    /// [`Model::released`] with what it was.
    pub fn begin_step(&mut self, start: f64, end: f64) {
        let Self {
            pins,
            masses,
            inverse_masses,
            edge_springs,
            discrete_shells,
            hinge_damping,
            ..
        } = self;
        while let Some(release) = pins.due(start, end) {
            for &i in &release.particles {
                inverse_masses[i as usize] = 1.0 / masses[i as usize];
            }
            for hinges in [
                edge_springs.as_mut().map(|batch| &mut batch.hinges),
                discrete_shells.as_mut().map(|batch| &mut batch.hinges),
                hinge_damping.as_mut().map(|damping| &mut damping.hinges),
            ] {
                set_stiffness(hinges.into_iter().flatten(), &release.hinges);
            }
            pins.released += 1;
        }
    }

    /// Whether [`Model::begin_step`] of a step from `start` to `end` (s) lets something go.
    pub fn releases_in(&self, start: f64, end: f64) -> bool {
        self.pins.due(start, end).is_some()
    }

    /// How many releases have happened.
    pub fn released(&self) -> usize {
        self.pins.released
    }

    /// The particles that are moved now.
    pub fn driven(&self) -> impl Iterator<Item = u32> + '_ {
        let all = self.pins.drives.iter().flat_map(|drive| &drive.particles);
        all.copied().filter(|&i| self.is_pinned(i as usize))
    }

    /// Puts driven particles where they are at the state's time, with their velocities. A scheme calls
    /// it for each of its stages; what it leaves at the end of a step is set right by the simulation.
    pub fn drive(&self, state: &mut State) {
        for drive in &self.pins.drives {
            let placement = drive.motion.at(state.time);
            for (i, [x, v]) in self.each_driven(drive, placement) {
                state.positions[i] = x;
                state.velocities[i] = v;
            }
        }
    }

    /// Gives driven particles the velocity (m/s) that takes them in `dt` (s) from where they are to
    /// where they are then: (x(t + dt) − x)/dt.
    pub fn aim(&self, dt: f64, state: &mut State) {
        for drive in &self.pins.drives {
            let placement = drive.motion.at(state.time + dt);
            for (i, [x, _]) in self.each_driven(drive, placement) {
                state.velocities[i] = (x - state.positions[i]) / dt;
            }
        }
    }

    /// Number, position and velocity of the particles of a drive that are still pinned.
    fn each_driven<'a>(
        &'a self,
        drive: &'a Drive,
        placement: Placement,
    ) -> impl Iterator<Item = (usize, [DVec3; 2])> + 'a {
        let each = drive.particles.iter().zip(&drive.starts);
        let pinned = each.filter(|(i, _)| self.is_pinned(**i as usize));
        pinned.map(move |(&i, &start)| (i as usize, placement.of(start, drive.center)))
    }
}

fn set_stiffness<'a>(
    hinges: impl Iterator<Item = &'a mut Hinge>,
    changes: &BTreeMap<[u32; 4], f64>,
) {
    if changes.is_empty() {
        return;
    }
    for hinge in hinges {
        if let Some(&stiffness) = changes.get(&hinge.corners) {
            hinge.stiffness = stiffness;
        }
    }
}
