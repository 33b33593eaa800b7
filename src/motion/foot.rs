//! The path of a foot: on the ground it rolls over heel and ball without sliding, between it swings.

use super::gait::{FOOT, KNEE, MEASURED_STRIDE, THIGH, TOE_OFF, smoothstep};
use super::leg::Leg;
use glam::{DQuat, DVec3};

/// Centre (m) and radius about which the heel rounds, from the ankle when standing.
const HEEL: (DVec3, f64) = (DVec3::new(0.0, -0.058, -0.030), 0.022);

/// The same of the toes, from the ball's joint.
const TIP: (DVec3, f64) = (DVec3::new(0.0, -0.009, 0.053), 0.016);

/// Pitch (rad) from which the toes leave the ground with the foot, and over which they come to follow.
const TOES_LIFT: [f64; 2] = [0.45, 1.2];

/// Least height of the toes over the ground in the middle of a swing (m).
///
/// Source: Winter 1992, "Foot trajectory in human gait".
const CLEARANCE: f64 = 0.0129;

/// Phase in which a stance is flat: what comes before belongs to the swing before it, what comes after
/// to the swing after.
const FLAT: f64 = 0.2;

/// Shares of a swing in which it is led over from the ground and back to it: over longer ones it waited for the
/// body behind, and the leg was too short for it ahead.
const LEAVING: f64 = 0.25;
const COMING: f64 = 0.2;

/// Half the acceleration of the foot there, in strides a square of the stride's time: harder braking jerks the
/// knee, softer needs lower hips.
const SPEEDING: f64 = 20.0;
const BRAKING: f64 = 25.0;

/// How a knee's flexion grows with the length of the stride, from this share at none.
const LEAST_KNEE: f64 = 0.6;

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
    /// Where the ankle is when the foot, pitched, stands on its print by the heel.
    fn on_heel(&self, print: DVec3, pitch: f64) -> DVec3 {
        let (center, radius) = (self.ankle + HEEL.0, HEEL.1);
        let rolled = DVec3::NEG_Z * (radius * pitch);
        print + center + rolled - turned(HEEL.0, pitch)
    }

    /// The same by the toes, which bend at the ball: flat, then over their tip.
    fn on_toes(&self, print: DVec3, pitch: f64) -> DVec3 {
        let toes = toes_on_ground(pitch);
        let rolled = DVec3::NEG_Z * (TIP.1 * toes);
        let ball = print + self.ball + TIP.0 + rolled - turned(TIP.0, toes);
        ball - turned(self.ball - self.ankle, pitch)
    }

    /// Height of the ankle (m) at which heel and toes, pitched, just touch the ground.
    fn touching(&self, [foot, toes]: [f64; 2]) -> f64 {
        let heel = HEEL.1 - turned(HEEL.0, foot).y;
        let ball = turned(self.ball - self.ankle, foot).y;
        let tip = TIP.1 - ball - turned(TIP.0, toes).y;
        smooth_max(heel, tip)
    }

    /// Where the foot is in a step.
    pub(super) fn at(&self, step: &Step, hip: DVec3, leg: &Leg) -> Placed {
        let Step { prints, phase } = *step;
        if phase < TOE_OFF {
            let [from, to] = if phase < FLAT { [0, 1] } else { [1, 2] };
            let pitch = FOOT.at(phase) * share(prints[from], prints[to]);
            return Placed {
                ankle: if pitch > 0.0 {
                    self.on_heel(prints[1], pitch)
                } else {
                    self.on_toes(prints[1], pitch)
                },
                pitch: [pitch, toes_on_ground(pitch)],
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
                ankle: self.ankle + from,
                pitch: [0.0; 2],
            };
        }
        let share = share(from, to);
        let pitch = FOOT.at(step.phase) * share;
        let swing = (step.phase - TOE_OFF) / (1.0 - TOE_OFF);
        let mut free = hip + leg.ankle(THIGH.at(step.phase) * share, flexion(step.phase, share));
        free.x = self.ankle.x + from.lerp(to, smoothstep(swing)).x;
        let leaving = 1.0 - smoothstep(swing / LEAVING);
        let coming = smoothstep((swing - 1.0 + COMING) / COMING);
        let bent = toes_on_ground(pitch);
        let pitch = [pitch, bent + (pitch - bent) * smoothstep(swing / 0.6)];
        free.y = smooth_max(free.y, self.touching(pitch) + CLEARANCE);
        // Off the ground it doesn't wait over its print for the body.
        let away = |phases: f64, by: f64| (to - from) * (by * phases * phases);
        let left = self.on_toes(from, pitch[0]) + away(step.phase - TOE_OFF, SPEEDING);
        let next = self.on_heel(to, pitch[0]) - away(1.0 - step.phase, BRAKING);
        let ankle = left * leaving + next * coming + free * (1.0 - leaving - coming);
        Placed { ankle, pitch }
    }
}

/// A vector of the standing foot, pitched.
fn turned(v: DVec3, pitch: f64) -> DVec3 {
    DQuat::from_rotation_x(-pitch) * v
}

/// Pitch of the toes of a foot on the ground: they go with the heel's, and follow the ball's late.
fn toes_on_ground(pitch: f64) -> f64 {
    let [from, over] = TOES_LIFT;
    let beyond = (-pitch - from).max(0.0);
    pitch.max(0.0) - 0.5 * beyond * beyond / over
}

/// The larger of two lengths, rounded off where they are within 2 cm.
fn smooth_max(a: f64, b: f64) -> f64 {
    let near = (0.02 - (a - b).abs()).max(0.0);
    a.max(b) + near * near / 0.08
}
