//! What impacts do to velocities: inelastic impulses with Coulomb friction.
//!
//! Restitution is 0: no touch approaches afterwards. Impulses are found one touch after another, in
//! passes; each brings the kinetic energy relative to the solids to its least along its own
//! direction, so none can add to it, however many passes there are (Bridson, Fedkiw and Anderson
//! 2002; a pass is one of Gauss–Seidel on the dual problem).

use super::touch::{Fresh, Touch, Vertices};
use glam::DVec3;

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
pub(super) fn slow(touches: &mut Vec<Touch>, vertices: &mut Vertices, fresh: &mut Fresh) -> Slowed {
    let mut slowed = Slowed::default();
    touches.retain(|touch| touch.pressed > 0.0 && touch.compliance > 0.0);
    for with_friction in [false, true] {
        fresh.begin(vertices.velocity.len(), touches.len());
        for pass in 0..PASSES[usize::from(with_friction)] {
            let mut most = 0.0_f64;
            let count = touches.len();
            for k in 0..count {
                let k = if pass % 2 == 0 { k } else { count - 1 - k };
                let touch = &mut touches[k];
                if fresh.is_due(k, touch.vertices) {
                    let change = touch.slow(vertices, with_friction, &mut slowed);
                    fresh.visited(k, touch.vertices, change > UNHEARD);
                    most = most.max(change);
                }
            }
            if most <= NEGLIGIBLE {
                break;
            }
        }
    }
    slowed
}

impl Touch {
    /// Takes away the approach, j ← max(0, j − vₙ/W), then sliding, with an impulse not longer than μ j. Returns the
    /// change of velocity (m/s).
    fn slow(&mut self, vertices: &mut Vertices, with_friction: bool, slowed: &mut Slowed) -> f64 {
        let compliance = self.compliance;
        let velocity = self.difference(&vertices.velocity);
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
            return 0.0;
        }
        if self.fixed {
            slowed.work -= change.dot(self.driven(vertices));
        }
        self.shift(&mut vertices.velocity, &vertices.inverse_mass, change);
        change.length() * compliance
    }

    /// The part of the difference of velocities that solids and pinned particles have (m/s).
    fn driven(&self, vertices: &Vertices) -> DVec3 {
        let term = |k: usize| {
            let i = self.vertices[k] as usize;
            let fixed = vertices.inverse_mass[i] == 0.0;
            if fixed {
                vertices.velocity[i] * self.weights[k]
            } else {
                DVec3::ZERO
            }
        };
        term(0) + term(1) + term(2) + term(3)
    }
}
