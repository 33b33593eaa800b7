//! How high the hips are: so that the legs reach the ground as people's do.

use super::{FIRST, Moment, Walk};
use crate::motion::foot::flexion;
use crate::motion::gait::smoothstep;
use std::f64::consts::TAU;

/// Harmonics of their height over a step.
const HARMONICS: usize = 3;

/// Times at which it is fitted.
const SAMPLES: u32 = 48;

/// Phase from which the body falls onto the leg ahead, whose heel touches down at 0.5.
const FALLING: f64 = 0.43;

/// A knee bends at least so far (rad): 8°. At 3° it went through its straightest with 400 m/s².
const LEAST_FLEXION: f64 = 0.14;

/// Times at which legs are seen to reach their feet, and how often they are.
const REACH_SAMPLES: u32 = 250;
const ROUNDS: u32 = 5;

/// Strides within which the walk begins.
const FIRST_STRIDES: f64 = 2.5;

/// How much higher than when standing the hips are.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Hips {
    /// While walking (m): mean, then cosine and sine of each harmonic.
    waves: [f64; 1 + 2 * HARMONICS],
    /// How much lower they go while the walk begins (m).
    crouch: f64,
}

impl Hips {
    /// How much higher they are at a moment (m).
    pub(super) fn height(&self, moment: &Moment) -> f64 {
        let each = (1..=HARMONICS).map(|k| {
            let (sin, cos) = (2.0 * TAU * k as f64 * moment.strides[0]).sin_cos();
            self.waves[2 * k - 1] * cos + self.waves[2 * k] * sin
        });
        let walking = self.waves[0] + each.sum::<f64>();
        walking * moment.awake - self.crouch * beginning(moment)
    }
}

/// How much a walk is at its beginning: 0 at the start and from [`FIRST_STRIDES`] on, 1 between.
fn beginning(moment: &Moment) -> f64 {
    let strides = moment.strides[0] - FIRST[0];
    smoothstep(strides / 0.4) * smoothstep((FIRST_STRIDES - strides) / 1.2)
}

impl Walk {
    /// The height of the hips at which the knee of the leg that carries bends as published, until the body falls
    /// onto the leg ahead; lowered for legs to reach.
    pub(super) fn settle_hips(&mut self) {
        let samples = || (0..SAMPLES).map(|k| 0.5 * f64::from(k) / f64::from(SAMPLES));
        let bent = |phase: f64, side: usize| {
            let moment = self.moment((10.0 + phase - FIRST[0]) / self.gait.rate());
            let flexion = flexion(moment.strides[side], self.share());
            self.height_over(&moment, side, flexion)
        };
        let landing = bent(0.5, 1);
        let mut waves = [0.0; 1 + 2 * HARMONICS];
        for phase in samples() {
            let carrying = bent(phase, 0);
            let fallen = smoothstep((phase - FALLING) / (0.5 - FALLING));
            let height = (carrying + (landing - carrying) * fallen) / f64::from(SAMPLES);
            waves[0] += height;
            for k in 1..=HARMONICS {
                let (sin, cos) = (2.0 * TAU * k as f64 * phase).sin_cos();
                waves[2 * k - 1] += 2.0 * height * cos;
                waves[2 * k] += 2.0 * height * sin;
            }
        }
        self.hips.waves = waves;
        self.crouch();
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
        let moment = |walk: &Self, strides: f64| walk.moment(strides / walk.gait.rate());
        for _ in 0..ROUNDS {
            let short = samples(10.0, 10.5).map(|s| self.shortfall(&moment(self, s)));
            self.hips.waves[0] -= short.fold(0.0, f64::max);
        }
        for _ in 0..ROUNDS {
            let short = samples(0.02, FIRST_STRIDES).map(|s| {
                let moment = moment(self, s);
                self.shortfall(&moment) / beginning(&moment).max(0.01)
            });
            self.hips.crouch += short.fold(0.0, f64::max);
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
}
