//! What impacts do to velocities: inelastic impulses with Coulomb friction.
//!
//! Restitution is 0: no touch approaches afterwards. Impulses are found one touch after another, in
//! passes; each brings the kinetic energy relative to the solids to its least along its own
//! direction, so none can add to it, however many passes there are (Bridson, Fedkiw and Anderson
//! 2002; a pass is one of Gauss–Seidel on the dual problem).

use super::touch::{Touch, Vertices};
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

/// Passes without friction, then as many with it: enough for a sheet of 36 particles to stick or slide on
/// an incline to 1 %.
const PASSES: u32 = 30;

/// Approach that is left (m/s).
const NEGLIGIBLE: f64 = 1e-6;

/// Takes the approach of touches that were pressed, and what friction takes.
pub(super) fn slow(touches: &mut Vec<Touch>, vertices: &mut Vertices) -> Slowed {
    let mut slowed = Slowed::default();
    touches.retain(|touch| touch.pressed > 0.0);
    for with_friction in [false, true] {
        for _ in 0..PASSES {
            let mut most = 0.0_f64;
            for touch in touches.iter_mut() {
                let compliance = touch.compliance(&vertices.inverse_mass);
                if compliance > 0.0 {
                    most = most.max(touch.stop(vertices, compliance, &mut slowed));
                    if with_friction {
                        most = most.max(touch.rub(vertices, compliance, &mut slowed));
                    }
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
    /// Takes away the approach: j ← max(0, j − vₙ/W). Returns the change of velocity (m/s).
    fn stop(&mut self, vertices: &mut Vertices, compliance: f64, slowed: &mut Slowed) -> f64 {
        let rate = self.normal.dot(self.difference(&vertices.velocity));
        let impulse = (self.impulse - rate / compliance).max(0.0);
        let change = impulse - self.impulse;
        if change == 0.0 {
            return 0.0;
        }
        self.impulse = impulse;
        let taken = self.strike(vertices, compliance, self.normal * change, slowed);
        slowed.approach += taken;
        (change * compliance).abs()
    }

    /// Takes away sliding, with an impulse not longer than μ j. Returns the change of velocity (m/s).
    fn rub(&mut self, vertices: &mut Vertices, compliance: f64, slowed: &mut Slowed) -> f64 {
        let sliding = self.along(self.difference(&vertices.velocity));
        // What was allowed once stays allowed: to be taken back it would have to add energy.
        let most = (self.friction * self.impulse).max(self.drag.length());
        let drag = (self.drag - sliding / compliance).clamp_length_max(most);
        let change = drag - self.drag;
        if change == DVec3::ZERO {
            return 0.0;
        }
        self.drag = drag;
        let taken = self.strike(vertices, compliance, change, slowed);
        slowed.friction += taken;
        change.length() * compliance
    }

    /// Gives the features an impulse (N·s). Returns what it takes of the energy of their relative motion (J);
    /// what solids do beside that is added to their work.
    fn strike(
        &self,
        vertices: &mut Vertices,
        compliance: f64,
        impulse: DVec3,
        slowed: &mut Slowed,
    ) -> f64 {
        let Vertices {
            velocity,
            inverse_mass,
            ..
        } = vertices;
        let before = self.difference(velocity);
        let driven = |k: usize| {
            let i = self.vertices[k] as usize;
            let fixed = inverse_mass[i] == 0.0;
            if fixed {
                velocity[i] * self.weights[k]
            } else {
                DVec3::ZERO
            }
        };
        slowed.work -= impulse.dot(driven(0) + driven(1) + driven(2) + driven(3));
        self.shift(velocity, inverse_mass, impulse);
        -impulse.dot(before + impulse * (0.5 * compliance))
    }
}
