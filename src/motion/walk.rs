//! The mannequin's walk.
//!
//! Feet are led over their prints ([`super::foot`]), hips over the feet so that the knee of the leg that
//! carries bends as published, and the legs follow by inverse kinematics. It starts from standing: the body
//! gathers speed over one stride, each print lying where the hip will pass over it.

use super::foot::{Foot, Placed, Step, flexion};
pub use super::gait::Gait;
use super::gait::{MEASURED_STRIDE, OVER, TOE_OFF, smoothstep};
use super::leg::{Bent, Leg};
use crate::linear::Chunks;
use crate::mesh::mannequin::skeleton::{
    self, ABDOMEN, CHEST, Change, FOOT, FOREARM, HAND, HEAD, LINKS, LUMBAR, NECK, PELVIS, Pose,
    SHANK, THIGH, TOES, UPPER_ARM,
};
use crate::mesh::mannequin::skin::Skin;
use glam::{DQuat, DVec3};
use std::f64::consts::TAU;

/// Phase of each leg when the walk starts, left first: the left foot is about to lift its heel, the right one
/// to carry.
const FIRST: [f64; 2] = [0.3, -0.2];

/// Share of the first stride in which hips, trunk and arms come into their swing.
const WAKING: f64 = 0.7;

/// How much nearer the middle the feet walk than they stand (m): steps 15 cm wide.
const NARROWER: f64 = 0.033;

/// Harmonics of the hips' height over a step.
const HARMONICS: usize = 3;

/// Times at which it is fitted.
const SAMPLES: u32 = 48;

/// Phase from which the body falls onto the leg ahead, whose heel touches down at 0.5.
const FALLING: f64 = 0.41;

/// A knee bends at least so far (rad): 8°. At 3° it went through its straightest with 400 m/s².
const LEAST_FLEXION: f64 = 0.14;

/// Times at which legs are seen to reach their feet, and how often they are.
const REACH_SAMPLES: u32 = 250;
const ROUNDS: u32 = 5;

/// Strides within which the walk begins.
const FIRST_STRIDES: f64 = 2.5;

/// A mannequin that walks along +z.
#[derive(Clone, Debug)]
pub struct Walk {
    gait: Gait,
    skin: Skin,
    /// The standing mannequin's vertices (m).
    positions: Vec<DVec3>,
    rest: [DVec3; LINKS],
    /// Height of the hips less that when standing (m): mean, then cosine and sine of each harmonic.
    height: [f64; 1 + 2 * HARMONICS],
    /// How much lower the hips go while the walk begins (m).
    crouch: f64,
}

/// Where a walk is at one time.
#[derive(Clone, Copy, Debug)]
struct Moment {
    /// Strides of each leg, left first.
    strides: [f64; 2],
    /// How far it has gone (m).
    gone: f64,
    /// How much of the walk's swing there is: 0 standing, 1 walking.
    awake: f64,
}

impl Walk {
    /// The walk of the standing mannequin with these vertices, in its own coordinates (m).
    ///
    /// # Errors
    ///
    /// A mesh that isn't the mannequin; a speed that can't be walked.
    pub fn new(positions: &[DVec3], gait: Gait) -> Result<Self, String> {
        gait.check()?;
        let mut walk = Self {
            gait,
            skin: Skin::new(positions)?,
            positions: positions.to_vec(),
            rest: skeleton::rest(),
            height: [0.0; 1 + 2 * HARMONICS],
            crouch: 0.0,
        };
        walk.height = walk.settled_height();
        walk.crouch();
        Ok(walk)
    }

    /// Where the vertices are at a time (s): into `out` (m), the standing mesh exactly up to the start.
    pub fn positions(&self, time: f64, out: &mut [DVec3]) {
        let changes = self.changes(time);
        self.each_vertex(&changes, out, |x, change| {
            x + (change.turn * x + change.shift)
        });
    }

    /// How fast the vertices go at a time (s): into `out` (m/s).
    ///
    /// v = Ṁ x₀ + ṡ, where the rates of the links' motions are central differences over 2 µs: right to 1e-8 m/s,
    /// and to 1e-4 m/s within a µs of a jump of the acceleration.
    pub fn velocities(&self, time: f64, out: &mut [DVec3]) {
        const H: f64 = 1e-6; // s; rounding is 2e-16 · 10 m / h
        let [before, after] = [-H, H].map(|h| self.changes(time + h));
        let rates = std::array::from_fn(|k| Change {
            turn: (after[k].turn - before[k].turn) * (0.5 / H),
            shift: (after[k].shift - before[k].shift) * (0.5 / H),
        });
        self.each_vertex(&rates, out, |x, rate| rate.turn * x + rate.shift);
    }

    /// Works on every vertex of the standing mesh with what its links' changes come to.
    fn each_vertex(
        &self,
        changes: &[Change; 2 * LINKS],
        out: &mut [DVec3],
        work: impl Fn(DVec3, Change) -> DVec3 + Sync,
    ) {
        let chunks = Chunks::of(self.positions.len());
        chunks.for_each(&mut out[..self.positions.len()], |chunk, out| {
            for (vertex, out) in chunks.range(chunk).zip(out) {
                *out = work(self.positions[vertex], self.skin.change(vertex, changes));
            }
        });
    }

    fn changes(&self, time: f64) -> [Change; 2 * LINKS] {
        if time <= self.gait.start {
            return [Change::NONE; 2 * LINKS];
        }
        skeleton::changes(&self.pose(time - self.gait.start), &self.rest)
    }

    /// The pose so long (s) after the start.
    fn pose(&self, since: f64) -> Pose {
        let moment = self.moment(since);
        let mut pose = self.upper(&moment);
        for side in 0..2 {
            let placed = self.placed(&pose, &moment, side);
            let bent = self.leg(&pose, &placed, side);
            let turns = &mut pose.turns;
            turns[THIGH[side]] = bent.thigh;
            turns[SHANK[side]] = bent.shank;
            turns[FOOT[side]] = DQuat::from_rotation_x(-placed.pitch[0]);
            turns[TOES[side]] = DQuat::from_rotation_x(-placed.pitch[1]);
        }
        if self.gait.on_the_spot {
            pose.shift.z -= moment.gone;
        }
        pose
    }

    fn moment(&self, since: f64) -> Moment {
        let strides = since * self.gait.rate();
        Moment {
            strides: FIRST.map(|first| first + strides),
            gone: self.gone(strides),
            awake: smoothstep(strides / WAKING),
        }
    }

    /// How far it has gone (m) after so many strides' time: its speed is a smooth step over the first.
    fn gone(&self, strides: f64) -> f64 {
        let s = strides.clamp(0.0, 1.0);
        let first = s * s * s * (1.0 - 0.5 * s);
        self.gait.stride() * (first + (strides - 1.0).max(0.0))
    }

    /// Hips, trunk and arms, the hips at their height.
    fn upper(&self, moment: &Moment) -> Pose {
        let mut pose = self.trunk(moment);
        let walking = height(&self.height, moment.strides[0]);
        pose.shift.y = walking * moment.awake - self.crouch * beginning(moment);
        pose
    }

    /// Where a foot is.
    fn placed(&self, pose: &Pose, moment: &Moment, side: usize) -> Placed {
        let (hip, leg) = (self.hip(pose, side), self.limb(side));
        self.foot(side).at(&self.step(moment, side), hip, &leg)
    }

    /// The leg between hip and foot.
    fn leg(&self, pose: &Pose, placed: &Placed, side: usize) -> Bent {
        let to = placed.ankle - self.hip(pose, side);
        self.limb(side).reaching(to)
    }

    fn hip(&self, pose: &Pose, side: usize) -> DVec3 {
        let pelvis = self.rest[PELVIS];
        pelvis + pose.shift + pose.turns[PELVIS] * (self.rest[THIGH[side]] - pelvis)
    }

    fn limb(&self, side: usize) -> Leg {
        let [hip, knee, ankle] = [THIGH, SHANK, FOOT].map(|link| self.rest[link[side]]);
        Leg {
            thigh: knee - hip,
            shank: ankle - knee,
        }
    }

    fn foot(&self, side: usize) -> Foot {
        Foot {
            ankle: self.rest[FOOT[side]],
            ball: self.rest[TOES[side]],
        }
    }

    /// The step that a foot is in.
    fn step(&self, moment: &Moment, side: usize) -> Step {
        let number = moment.strides[side].floor();
        Step {
            prints: [-1.0, 0.0, 1.0].map(|k| self.print(number + k, side)),
            phase: moment.strides[side] - number,
        }
    }

    /// How far from where it stood (m) a foot's print of that number lies; 0 and those before are the first.
    fn print(&self, number: f64, side: usize) -> DVec3 {
        if number <= 0.0 {
            return DVec3::ZERO;
        }
        let inwards = [-NARROWER, NARROWER][side];
        DVec3::new(inwards, 0.0, self.gone(number + OVER - FIRST[side]))
    }

    /// The height's waves: at which the knee of the leg that carries bends as published, less what keeps every
    /// leg on the ground from being too short.
    fn settled_height(&self) -> [f64; 1 + 2 * HARMONICS] {
        let samples = || (0..SAMPLES).map(|k| 0.5 * f64::from(k) / f64::from(SAMPLES));
        let walking = |phase: f64| self.moment((10.0 + phase - FIRST[0]) / self.gait.rate());
        let mut waves = [0.0; 1 + 2 * HARMONICS];
        for phase in samples() {
            let moment = walking(phase);
            let bent = |moment: &Moment, side| {
                let flexion = flexion(moment.strides[side], self.share());
                self.height_over(moment, side, flexion)
            };
            let (carrying, next) = (bent(&moment, 0), bent(&walking(0.5), 1));
            let fallen = smoothstep((phase - FALLING) / (0.5 - FALLING));
            let height = carrying + (next - carrying) * fallen;
            waves[0] += height / f64::from(SAMPLES);
            for k in 1..=HARMONICS {
                let (sin, cos) = (2.0 * TAU * k as f64 * phase).sin_cos();
                waves[2 * k - 1] += 2.0 * height * cos / f64::from(SAMPLES);
                waves[2 * k] += 2.0 * height * sin / f64::from(SAMPLES);
            }
        }
        waves
    }

    /// Lowers the hips until every leg reaches its foot: all along, and more while the walk begins, when prints
    /// are wider and the hips not yet in their rhythm.
    ///
    /// Lower hips change where a foot swings, which is why it's done several times.
    fn crouch(&mut self) {
        let samples = |from: f64, to: f64| {
            (0..REACH_SAMPLES)
                .map(move |k| from + (to - from) * f64::from(k) / f64::from(REACH_SAMPLES))
        };
        let moments = |walk: &Self, strides: f64| walk.moment(strides / walk.gait.rate());
        for _ in 0..ROUNDS {
            let short = samples(10.0, 10.5).map(|s| self.shortfall(&moments(self, s)));
            self.height[0] -= short.fold(0.0, f64::max);
        }
        for _ in 0..ROUNDS {
            let short = samples(0.02, FIRST_STRIDES).map(|s| {
                let moment = moments(self, s);
                self.shortfall(&moment) / beginning(&moment).max(0.01)
            });
            self.crouch += short.fold(0.0, f64::max);
        }
    }

    /// How much lower (m) the hips would have to be for both legs to reach their feet with a knee bent at least by
    /// [`LEAST_FLEXION`], or half as much when standing, where it is 4.8°.
    fn shortfall(&self, moment: &Moment) -> f64 {
        let pose = self.upper(moment);
        let short = |side: usize| {
            let leg = self.limb(side);
            let to = self.placed(&pose, moment, side).ankle - self.hip(&pose, side);
            let reach = leg.reach(LEAST_FLEXION * (0.5 + 0.5 * moment.awake));
            -to.y - (reach * reach - to.x * to.x - to.z * to.z).max(0.0).sqrt()
        };
        short(0).max(short(1))
    }

    /// Share of the measured stride that this walk's are.
    fn share(&self) -> f64 {
        self.gait.stride() / MEASURED_STRIDE
    }

    /// The height of the hips (m) less that when standing at which the knee of a leg on the ground bends so far
    /// (rad).
    fn height_over(&self, moment: &Moment, side: usize, flexion: f64) -> f64 {
        let pose = self.trunk(moment);
        let (hip, leg) = (self.hip(&pose, side), self.limb(side));
        let ankle = self.placed(&pose, moment, side).ankle;
        let reach = leg.reach(flexion);
        let [dx, dz] = [ankle.x - hip.x, ankle.z - hip.z];
        ankle.y + (reach * reach - dx * dx - dz * dz).max(0.0).sqrt() - hip.y
    }

    /// Hips, trunk and arms; the legs still stand, and the hips are as high as when standing.
    fn trunk(&self, moment: &Moment) -> Pose {
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

/// How much a walk is at its beginning: 0 at the start and from [`FIRST_STRIDES`] on, 1 between.
fn beginning(moment: &Moment) -> f64 {
    let strides = moment.strides[0] - FIRST[0];
    smoothstep(strides / 0.4) * smoothstep((FIRST_STRIDES - strides) / 1.2)
}

/// Height of the hips (m) less that when standing, at a stride of the left leg, walking.
fn height(waves: &[f64; 1 + 2 * HARMONICS], stride: f64) -> f64 {
    let each = (1..=HARMONICS).map(|k| {
        let (sin, cos) = (2.0 * TAU * k as f64 * stride).sin_cos();
        waves[2 * k - 1] * cos + waves[2 * k] * sin
    });
    waves[0] + each.sum::<f64>()
}

#[cfg(test)]
mod tests;
