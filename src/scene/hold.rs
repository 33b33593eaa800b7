//! What pins do to particles: until when they hold them, and where they move them.

use super::fault::Fault;
use super::schema;
use crate::model::{Drive, Pins, Release};
use crate::motion::{Keyframe, Motion};
use glam::DVec3;
use std::collections::BTreeMap;

/// How a particle is held.
#[derive(Clone, Copy, Debug)]
pub(super) struct Hold {
    /// Number of the first pin that selects it.
    pin: usize,
    /// When it becomes free (s); ∞ for never.
    pub(super) until: f64,
    /// Number of the motion that it follows.
    pub(super) drive: Option<usize>,
}

/// The holds of all particles, and the motions that they follow.
#[derive(Default)]
pub(super) struct Holds {
    /// One entry a particle; none for free ones.
    pub(super) each: Vec<Option<Hold>>,
    drives: Vec<Drive>,
}

/// A hinge whose stiffness changes when a clamp is released.
pub(super) struct Switch {
    pub(super) corners: [u32; 4],
    /// Stiffness from then on (N·m).
    pub(super) stiffness: f64,
    /// The time (s).
    pub(super) time: f64,
}

/// When a pin lets go (s).
pub(super) fn until(pin: &schema::Pin) -> f64 {
    pin.release.unwrap_or(f64::INFINITY)
}

impl Holds {
    /// Holds the vertices that pin number `i` selects of a cloth, whose first particle is `first`. The
    /// pin turns about the middle of the box around them.
    pub(super) fn add(
        &mut self,
        i: usize,
        pin: &schema::Pin,
        first: usize,
        selected: &[u32],
        positions: &[DVec3],
    ) -> Result<(), Fault> {
        let places = selected.iter().map(|&vertex| positions[vertex as usize]);
        let low = places.clone().reduce(DVec3::min).unwrap_or_default();
        let high = places.reduce(DVec3::max).unwrap_or_default();
        let motion = pin.motion.as_ref().map(|motion| rigid(&motion.keyframes));
        let drive = motion.map(|motion| self.drive(motion, 0.5 * (low + high)));
        for &vertex in selected {
            let hold = &mut self.each[first + vertex as usize];
            let hold = hold.get_or_insert(Hold {
                pin: i,
                until: until(pin),
                drive,
            });
            if hold.drive != drive {
                let other = hold.pin;
                let key = if drive.is_some() { "motion" } else { "select" };
                let cause = format!(
                    "vertex {vertex} is held by pin {other} too, which moves differently (a turn is about the middle of each pin's own vertices); give both the same motion, or select the vertex in one of them only"
                );
                return Err(Fault::new(format!("pin.{i}.{key}"), cause));
            }
            hold.until = hold.until.max(until(pin));
        }
        Ok(())
    }

    /// Number of a motion about a centre, which is new or known.
    fn drive(&mut self, motion: Motion, center: DVec3) -> usize {
        let same =
            |known: &Drive| known.motion == motion && (known.center == center || !motion.turns());
        if let Some(known) = self.drives.iter().position(same) {
            return known;
        }
        self.drives.push(Drive {
            motion,
            center,
            particles: Vec::new(),
            starts: Vec::new(),
        });
        self.drives.len() - 1
    }

    /// Adds a particle without mass that is held for ever: the far corner of a clamp.
    pub(super) fn add_far(&mut self, drive: Option<usize>) {
        self.each.push(Some(Hold {
            pin: 0,
            until: f64::INFINITY,
            drive,
        }));
    }

    /// The pins of a model whose particles start at `positions`.
    pub(super) fn pins(self, positions: &[DVec3], switches: Vec<Switch>) -> Pins {
        let mut drives = self.drives;
        let mut releases = Releases::default();
        let holds = (0_u32..).zip(positions).zip(self.each);
        for ((i, &start), hold) in holds {
            let Some(hold) = hold else { continue };
            if let Some(drive) = hold.drive {
                drives[drive].particles.push(i);
                drives[drive].starts.push(start);
            }
            if let Some(release) = releases.at(hold.until) {
                release.particles.push(i);
            }
        }
        for switch in switches {
            if let Some(release) = releases.at(switch.time) {
                release.hinges.insert(switch.corners, switch.stiffness);
            }
        }
        Pins::new(drives, releases.0.into_values().collect())
    }
}

/// By the bits of their times, which sort as the times do: they are positive.
#[derive(Default)]
struct Releases(BTreeMap<u64, Release>);

impl Releases {
    /// What is let go at a time; nothing at ∞.
    fn at(&mut self, time: f64) -> Option<&mut Release> {
        let new = || Release {
            time,
            ..Release::default()
        };
        let entry = self.0.entry(time.to_bits());
        time.is_finite().then(|| entry.or_insert_with(new))
    }
}

/// The rigid motion through keyframes.
pub(super) fn rigid(keyframes: &[schema::Keyframe]) -> Motion {
    let keys = keyframes.iter().map(|key| Keyframe {
        time: key.t,
        translate: DVec3::from_array(key.translate),
        rotate: DVec3::from_array(key.rotate.map(f64::to_radians)),
    });
    Motion::new(&keys.collect::<Vec<_>>())
}
