//! How people walk: angles over the gait cycle, and stride and rhythm at a speed.
//!
//! Phases are shares of a stride, from one contact of the heel to the next of the same foot.
//!
//! Sources: Perry and Burnfield 2010, "Gait Analysis", angles of thigh, knee and ankle at the ends of the
//! phases of gait (0, 12, 31, 50, 62, 75 and 87 % of the stride); between these, the shapes in Winter 1991,
//! "The Biomechanics and Motor Control of Human Gait", natural cadence. Rounded to a degree: people
//! differ by 5° and more. Left out: that stance is longer, up to two thirds, in slow walking.

use super::keyframes::{hermite, monotone_slope};

/// Walks that people walk (m/s): slower they stand about, faster they run.
const SPEEDS: [f64; 2] = [0.3, 1.8];

/// Strides of the people measured (m), at 1.37 m/s.
pub(super) const MEASURED_STRIDE: f64 = 1.41;

/// Phase at which the toes leave the ground.
pub(super) const TOE_OFF: f64 = 0.60;

/// Phase at which the hip passes over the ankle: the ankle touches down a quarter of a stride ahead.
pub(super) const OVER: f64 = 0.23;

/// A walk along +z.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gait {
    /// Mean speed (m/s), 0.3 to 1.8.
    pub speed: f64,
    /// Until when it stands (s).
    pub start: f64,
    /// Whether the ground goes back at that speed instead, as on a treadmill.
    pub on_the_spot: bool,
}

impl Gait {
    /// # Errors
    ///
    /// A speed that isn't walked, a start that is no time.
    pub(super) fn check(&self) -> Result<(), String> {
        let [slowest, fastest] = SPEEDS;
        if !(slowest..=fastest).contains(&self.speed) {
            return Err(format!(
                "walk.speed = {} m/s can't be walked; take one between {slowest} and {fastest} m/s",
                self.speed
            ));
        }
        if !self.start.is_finite() {
            return Err(format!(
                "walk.start = {} s is no time; take the seconds to stand before the walk, such as 1",
                self.start
            ));
        }
        Ok(())
    }

    /// Strides a second.
    ///
    /// f = ½ · 1.62 v^0.58. Exponent: Grieve and Gear 1966; the factor makes strides of 1.41 m at 1.37 m/s.
    pub(super) fn rate(&self) -> f64 {
        0.5 * 1.62 * self.speed.powf(0.58)
    }

    /// Length of a stride (m): speed over [`Gait::rate`].
    pub(super) fn stride(&self) -> f64 {
        self.speed / self.rate()
    }
}

/// An angle (degrees) at every 5 % of the stride.
#[derive(Debug)]
pub(super) struct Curve([f64; 20]);

/// Thigh against the vertical, forwards positive.
#[rustfmt::skip]
pub(super) const THIGH: Curve = Curve([
    22.0, 22.0, 20.0, 16.0, 11.0, 6.0, 1.0, -4.0, -9.0, -14.0,
    -18.0, -18.0, -12.0, -3.0, 8.0, 16.0, 22.0, 25.0, 25.0, 23.0,
]);

/// Knee, flexion positive.
#[rustfmt::skip]
pub(super) const KNEE: Curve = Curve([
    5.0, 10.0, 16.0, 18.0, 15.5, 12.0, 9.0, 7.0, 6.0, 8.0,
    12.0, 22.0, 36.0, 51.0, 61.0, 61.0, 51.0, 35.0, 17.0, 5.0,
]);

/// Foot against the ground, toes up positive: thigh − knee + ankle, and flat from 10 to 30 %.
#[rustfmt::skip]
pub(super) const FOOT: Curve = Curve([
    17.0, 7.0, 0.0, 0.0, 0.0, 0.0, 0.0, -1.5, -6.0, -14.0,
    -24.0, -42.0, -57.0, -63.0, -60.0, -47.0, -27.0, -7.0, 9.0, 18.0,
]);

impl Curve {
    /// The angle (rad) at a phase, by cubics that don't overshoot.
    pub(super) fn at(&self, phase: f64) -> f64 {
        let count = self.0.len();
        let place = (phase - phase.floor()) * 20.0;
        let here = (0..count)
            .rfind(|&k| (k as f64) <= place)
            .unwrap_or_default();
        let value = |k: usize| self.0[(here + count + k - 1) % count].to_radians();
        let rise = |k: usize| value(k + 1) - value(k);
        let slopes = [1, 2].map(|k| monotone_slope([1.0, 1.0], [rise(k - 1), rise(k)]));
        hermite(
            [0.0, 1.0],
            [value(1), value(2)],
            slopes,
            place - here as f64,
        )[0]
    }
}

/// 0 up to 0 and 1 from 1 on, with s² (3 − 2 s) between.
pub(super) fn smoothstep(s: f64) -> f64 {
    let s = s.clamp(0.0, 1.0);
    s * s * (3.0 - 2.0 * s)
}
