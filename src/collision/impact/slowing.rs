//! What impacts do to velocities: inelastic impulses with Coulomb friction.
//!
//! Restitution is 0: no touch approaches afterwards. Impulses are found one touch after another, in
//! passes; each brings the kinetic energy relative to the solids to its least along its own
//! direction, so none can add to it, however many passes there are (Bridson, Fedkiw and Anderson
//! 2002; a pass is one of Gauss–Seidel on the dual problem).

use super::halves::{Halves, Local, Visit};
use super::touch::{Touch, Vertices};
use glam::DVec3;
use std::ops::Add;

/// Where the kinetic energy of cloth went.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Slowed {
    /// Taken with the approach (J).
    pub(super) approach: f64,
    /// Taken by friction (J).
    pub(super) friction: f64,
    /// Given by solids and pinned particles that move (J).
    pub(super) work: f64,
}

/// Passes without friction, then with it, forwards and backwards in turn: enough for a sheet of 36 particles to stick
/// or slide on an incline to 1 %.
const PASSES: [u32; 2] = [10, 20];

/// Approach that is left (m/s).
const NEGLIGIBLE: f64 = 1e-6;

/// Change of velocity (m/s) that neighbours aren't told of.
const UNHEARD: f64 = 1e-6;

/// Takes the approach of touches that were pressed, and what friction takes.
pub(super) fn slow(
    touches: &mut Vec<Touch>,
    vertices: &mut Vertices,
    halves: &mut Halves,
) -> Slowed {
    halves.retain(touches, |touch| {
        touch.pressed > 0.0 && touch.compliance > 0.0
    });
    halves.take(touches, &vertices.velocity, &vertices.inverse_mass);
    let mut slowed = Slowed::default();
    for with_friction in [false, true] {
        halves.again();
        for pass in 0..PASSES[usize::from(with_friction)] {
            let done = halves.pass(touches, pass % 2 == 1, UNHEARD, |touch, local| {
                Some(touch.slow(local, with_friction))
            });
            slowed = slowed + done.slowed;
            if done.most <= NEGLIGIBLE {
                break;
            }
        }
    }
    halves.give(&mut vertices.velocity);
    slowed
}

impl Add for Slowed {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            approach: self.approach + other.approach,
            friction: self.friction + other.friction,
            work: self.work + other.work,
        }
    }
}

impl Touch {
    /// Takes away the approach, j ← max(0, j − vₙ/W), then sliding, with an impulse not longer than μ j. Measures
    /// the change of velocity (m/s).
    fn slow(&mut self, velocities: &mut Local<'_>, with_friction: bool) -> Visit {
        let compliance = self.compliance;
        let mut slowed = Slowed::default();
        let velocity = velocities.difference(&self.weights);
        let rate = self.normal.dot(velocity);
        let impulse = (self.impulse - rate / compliance).max(0.0);
        let pushed = impulse - self.impulse;
        self.impulse = impulse;
        slowed.approach -= pushed * (rate + 0.5 * pushed * compliance);
        let mut change = self.normal * pushed;
        if with_friction {
            let sliding = self.along(velocity);
            // What was allowed once stays allowed: to be taken back it would have to add energy.
            let most = (self.friction * self.impulse).max(self.drag.length());
            let drag = (self.drag - sliding / compliance).clamp_length_max(most);
            let rubbed = drag - self.drag;
            self.drag = drag;
            slowed.friction -= rubbed.dot(sliding + rubbed * (0.5 * compliance));
            change += rubbed;
        }
        if change == DVec3::ZERO {
            return Visit::default();
        }
        if self.fixed {
            slowed.work -= change.dot(velocities.driven(&self.weights));
        }
        velocities.shift(&self.weights, change);
        let moved = change.length() * compliance;
        Visit {
            most: moved,
            moved,
            slowed,
        }
    }
}
