//! Contacts and what is remembered of them from step to step.

use super::{Anchor, Bodies};
use crate::state::Archive;
use crate::strain_limit::Wall;
use glam::DVec3;

/// A particle at an obstacle.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Contact {
    /// The particle.
    pub particle: usize,
    /// Where it was found (m): its position, or the place where its way met the surface.
    pub at: DVec3,
    /// Unit normal of the obstacle there, pointing away from it.
    pub normal: DVec3,
    /// Distance from the place where contact begins, one thickness above the surface (m); negative
    /// when the particle is closer.
    pub gap: f64,
    /// Distance from the surface itself (m), negative inside.
    pub distance: f64,
    /// Coulomb's friction coefficient μ.
    pub friction: f64,
    /// The obstacle's point there.
    pub anchor: Anchor,
    /// Velocity of that point (m/s): as the contact was found, and in a step the mean over it.
    pub velocity: DVec3,
    /// Velocity of that point at the end of the step (m/s).
    pub velocity_after: DVec3,
    /// Impulse on the particle (N·s) that the last step's own equations found, with a scheme that has
    /// contacts inside them.
    pub impulse: DVec3,
    /// How far out of the obstacle the particle may be moved in a step (m): without bound, unless it started
    /// inside and has time.
    pub leave: f64,
}

impl Contact {
    /// Whether the particle isn't to be moved out at once.
    pub fn has_time(&self) -> bool {
        self.leave < f64::INFINITY
    }

    /// The half space outside the obstacle's tangent plane, some time (s) after the contact was found; of a
    /// particle that has time to come out, the one that it is at the border of.
    pub fn wall(&self, ago: f64) -> Wall {
        let distance = if self.has_time() {
            self.distance.max(0.0)
        } else {
            self.distance
        };
        Wall {
            normal: self.normal,
            offset: self.normal.dot(self.at + self.velocity * ago) - distance,
        }
    }

    /// Velocity (m/s) of the particle, which has `v`, against the obstacle.
    pub fn against(&self, v: DVec3) -> DVec3 {
        v - self.velocity
    }
}

/// How a particle is held by an obstacle, as the last step found it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Grip {
    /// Impulse of the obstacle along its normal (N·s); 0 when the particle is free. Of one step with
    /// an implicit scheme; the others don't read it.
    pub pressure: f64,
    /// Friction impulse of one step while the particle slides (N·s).
    pub drag: DVec3,
    /// Whether friction holds the particle.
    pub sticks: bool,
}

/// The contacts of a state; at most one a particle, with the closest obstacle.
#[derive(Clone, Debug, Default)]
pub struct Contacts {
    /// The contacts in order of their particles.
    pub list: Vec<Contact>,
    /// One entry a particle that may touch something; empty where there is nothing to touch.
    pub grips: Vec<Grip>,
}

impl Contacts {
    /// No contact among `particles` particles.
    pub fn none(particles: usize) -> Self {
        Self {
            list: Vec::new(),
            grips: vec![Grip::default(); particles],
        }
    }

    /// Carries all of them over.
    pub fn carry(&mut self, archive: &mut Archive) {
        archive.list(&mut self.list, |archive, contact| {
            let Contact {
                particle,
                at,
                normal,
                gap,
                distance,
                friction,
                anchor,
                velocity,
                velocity_after,
                impulse,
                leave,
            } = contact;
            archive.index(particle);
            for number in [gap, distance, friction, leave] {
                archive.real(number);
            }
            for vector in [at, normal, velocity, velocity_after, impulse] {
                archive.vector(vector);
            }
            anchor.carry(archive);
        });
        archive.each(&mut self.grips, |archive, grip| {
            archive.real(&mut grip.pressure);
            archive.vector(&mut grip.drag);
            archive.flag(&mut grip.sticks);
        });
    }

    /// Copies other contacts of as many particles; allocates only for more contacts than ever before.
    pub fn copy_from(&mut self, other: &Self) {
        self.list.clone_from(&other.list);
        self.grips.clone_from(&other.grips);
    }

    /// Gives the obstacles at all contacts the velocity of a step of `dt` (s) that begins.
    pub fn begin_step(&mut self, bodies: &Bodies, dt: f64) {
        for contact in &mut self.list {
            contact.velocity = bodies.travel(&contact.anchor) / dt;
            contact.velocity_after = bodies.velocity(&contact.anchor);
        }
    }

    /// Whether the obstacle moves at any contact.
    pub fn any_moves(&self) -> bool {
        let moves = |contact: &Contact| contact.velocity != DVec3::ZERO;
        self.list.iter().any(moves)
    }

    /// Makes grips, which hold the impulses of a whole step, those of a step `factor` times as long.
    pub fn scale_grips(&mut self, factor: f64) {
        if factor == 1.0 {
            return;
        }
        for grip in &mut self.grips {
            grip.pressure *= factor;
            grip.drag *= factor;
        }
    }

    /// Depth of the deepest particle below an obstacle's surface (m); 0 when all are outside.
    pub fn deepest(&self) -> f64 {
        self.list
            .iter()
            .map(|contact| -contact.distance)
            .fold(0.0, f64::max)
    }
}
