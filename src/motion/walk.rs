//! The mannequin's walk.
//!
//! Feet are led over their prints ([`super::foot`]), hips over the feet so that the knee of the leg that
//! carries bends as published, and the legs follow by inverse kinematics. It starts from standing: the body
//! gathers speed over one stride, each print lying where the hip will pass over it.

mod hips;
mod trunk;

use super::foot::{Foot, Placed, Step};
pub use super::gait::Gait;
use super::gait::{MEASURED_STRIDE, OVER, smoothstep};
use super::leg::{Bent, Leg};
use crate::linear::Chunks;
use crate::mesh::mannequin::skeleton::{
    self, Change, FOOT, LINKS, PELVIS, Pose, SHANK, THIGH, TOES,
};
use crate::mesh::mannequin::skin::Skin;
use glam::{DQuat, DVec3};
use hips::Hips;

/// Phase of each leg when the walk starts, left first: the left foot is about to lift its heel, the right one
/// to carry.
const FIRST: [f64; 2] = [0.3, -0.2];

/// Share of the first stride in which hips, trunk and arms come into their swing.
const WAKING: f64 = 0.7;

/// How much nearer the middle the feet walk than they stand (m): steps 15 cm wide.
const NARROWER: f64 = 0.033;

/// A mannequin that walks along +z.
#[derive(Clone, Debug)]
pub struct Walk {
    gait: Gait,
    skin: Skin,
    /// The standing mannequin's vertices (m).
    positions: Vec<DVec3>,
    rest: [DVec3; LINKS],
    hips: Hips,
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
            hips: Hips::default(),
        };
        walk.settle_hips();
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
        pose.shift.y = self.hips.height(moment);
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

    /// Share of the measured stride that this walk's are.
    fn share(&self) -> f64 {
        self.gait.stride() / MEASURED_STRIDE
    }
}

#[cfg(test)]
mod tests;
