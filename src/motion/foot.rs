//! The path of a foot: on the ground it rolls over heel and ball without sliding, between it swings.

use super::gait::{FOOT, KNEE, MEASURED_STRIDE, THIGH, TOE_OFF, smoothstep};
use super::leg::Leg;
use glam::{DQuat, DVec3};

/// Height of the centre about which the heel rounds (m), and how far it is behind the ankle.
const HEEL: [f64; 2] = [0.022, 0.030];

/// Phase in which a stance is flat: what comes before belongs to the swing before it, what comes after
/// to the swing after.
const FLAT: f64 = 0.2;

/// How a knee's flexion grows with the length of the stride, from this share at none.
const LEAST_KNEE: f64 = 0.35;

/// A foot when standing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Foot {
    pub(super) ankle: DVec3,
    pub(super) ball: DVec3,
}

/// Where a foot is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Placed {
    /// Its ankle (m).
    pub(super) ankle: DVec3,
    /// Pitch of the foot and of the toes (rad), toes up positive.
    pub(super) pitch: [f64; 2],
}

/// A step of one foot: from contact at `phase` 0 to the next at 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Step {
    /// How far footprints lie from where the foot stood (m): the one before, this one, the next one.
    pub(super) prints: [DVec3; 3],
    pub(super) phase: f64,
}

/// Share of the measured angles at which a stride is as long as from `a` to `b`.
fn share(a: DVec3, b: DVec3) -> f64 {
    (b.z - a.z) / MEASURED_STRIDE
}

/// Flexion of the knee (rad) at a phase of a stride of that share.
pub(super) fn flexion(phase: f64, share: f64) -> f64 {
    let least = KNEE.at(0.0);
    least + (KNEE.at(phase) - least) * (LEAST_KNEE + (1.0 - LEAST_KNEE) * share)
}

impl Foot {
    /// Where the ankle is when the foot, pitched, stands on its print: heel down where the toes are up, else
    /// the ball.
    ///
    /// The toes stay flat and the foot turns about the ball's joint; the heel rolls on a circle.
    fn planted(&self, print: DVec3, pitch: f64, on_heel: bool) -> DVec3 {
        let turn = DQuat::from_rotation_x(-pitch);
        let center = if on_heel {
            DVec3::new(self.ankle.x, HEEL[0], self.ankle.z - HEEL[1])
        } else {
            self.ball
        };
        let rolled = if on_heel { -HEEL[0] * pitch } else { 0.0 };
        print + center + DVec3::Z * rolled + turn * (self.ankle - center)
    }

    /// Where the foot is in a step.
    pub(super) fn at(&self, step: &Step, hip: DVec3, leg: &Leg) -> Placed {
        let Step { prints, phase } = *step;
        if phase < TOE_OFF {
            let [from, to] = if phase < FLAT { [0, 1] } else { [1, 2] };
            let pitch = FOOT.at(phase) * share(prints[from], prints[to]);
            return Placed {
                ankle: self.planted(prints[1], pitch, pitch > 0.0),
                pitch: [pitch, pitch.max(0.0)],
            };
        }
        self.swinging(step, hip, leg)
    }

    /// Where the foot is in a swing: where the angles of hip and knee bring it, led over from the way that it
    /// leaves the ground and to the way that it comes back.
    fn swinging(&self, step: &Step, hip: DVec3, leg: &Leg) -> Placed {
        let [_, from, to] = step.prints;
        if from == to {
            return Placed {
                ankle: self.planted(from, 0.0, false),
                pitch: [0.0; 2],
            };
        }
        let share = share(from, to);
        let pitch = FOOT.at(step.phase) * share;
        let swing = (step.phase - TOE_OFF) / (1.0 - TOE_OFF);
        let mut free = hip + leg.ankle(THIGH.at(step.phase) * share, flexion(step.phase, share));
        free.x = self.ankle.x + from.lerp(to, smoothstep(swing)).x;
        let leaving = 1.0 - smoothstep(2.0 * swing);
        let coming = smoothstep(2.0 * swing - 1.0);
        let ankle = self.planted(from, pitch, false) * leaving
            + self.planted(to, pitch, true) * coming
            + free * (1.0 - leaving - coming);
        Placed {
            ankle,
            pitch: [pitch, pitch * smoothstep(swing / 0.4)],
        }
    }
}
