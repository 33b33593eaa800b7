//! Hips, trunk and arms.
//!
//! Turns of the hips and sway: Perry and Burnfield 2010. Arms: Murray, Sepic and Barnard 1967, "Patterns of
//! sagittal rotation of the upper limbs in walking"; excursions of 32° and some 20° at free speed.

use super::{Moment, Walk};
use crate::mesh::mannequin::skeleton::{
    ABDOMEN, CHEST, FOREARM, HAND, HEAD, LINKS, LUMBAR, NECK, PELVIS, Pose, UPPER_ARM,
};
use glam::{DQuat, DVec3};
use std::f64::consts::TAU;

impl Walk {
    /// Hips, trunk and arms; the legs still stand, and the hips are as high as when standing.
    pub(super) fn trunk(&self, moment: &Moment) -> Pose {
        let wave = |peak: f64| (TAU * (moment.strides[0] - peak)).cos();
        let much = moment.awake * self.share();
        let degrees = |angle: f64| (much * angle).to_radians();
        let (yaw, list) = (DQuat::from_rotation_y, DQuat::from_rotation_z);
        let lean = DQuat::from_rotation_x;
        // Hips: the side of the leg ahead goes ahead, the side that swings sinks.
        let pelvis = yaw(degrees(-4.0 * wave(0.0))) * list(degrees(4.0 * wave(0.15)));
        let chest =
            yaw(degrees(4.0 * wave(0.0))) * list(degrees(-1.5 * wave(0.15))) * lean(degrees(3.0));
        let mut turns = [DQuat::IDENTITY; LINKS];
        turns[PELVIS] = pelvis;
        turns[ABDOMEN] = pelvis.lerp(chest, 1.0 / 3.0);
        turns[LUMBAR] = pelvis.lerp(chest, 2.0 / 3.0);
        turns[CHEST] = chest;
        turns[HEAD] = lean(degrees(1.0));
        turns[NECK] = chest.lerp(turns[HEAD], 0.5);
        for side in 0..2 {
            let inwards = [-1.0, 1.0][side] * moment.awake * 9_f64.to_radians();
            // The arm is ahead when the other leg is.
            let ahead = wave(0.5 * (1.0 - side as f64));
            let shoulder = degrees(-4.0 + 16.0 * ahead);
            let elbow = degrees(20.0 + 9.0 * ahead);
            let arm = chest * lean(-shoulder) * list(inwards);
            turns[UPPER_ARM[side]] = arm;
            turns[FOREARM[side]] = arm * lean(-elbow);
            turns[HAND[side]] = arm * lean(-1.1 * elbow);
        }
        let sway = 0.02 * moment.awake * wave(0.3);
        Pose {
            turns,
            shift: DVec3::new(sway, 0.0, moment.gone),
        }
    }
}
