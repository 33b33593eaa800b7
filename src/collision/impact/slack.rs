//! How far elements of layers may move before they have to be looked at again.

use std::sync::atomic::{AtomicU32, Ordering::Relaxed};

/// Share of the thickness that features are apart, beyond the band of detection, if their boxes don't overlap:
/// 1 − 0.1 × 1.25, and a little less for rounding.
pub(super) const LOOSE: f64 = 0.8;

/// A length in whole nanometres that tasks lower together. The least of some numbers is the same in any order.
#[derive(Debug, Default)]
pub(super) struct Slack(AtomicU32);

impl Clone for Slack {
    fn clone(&self) -> Self {
        Self(AtomicU32::new(self.0.load(Relaxed)))
    }
}

/// A length (m) in nanometres, rounded down; 0 if it is negative or NaN.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "cut off on both sides"
)]
fn nanometres(length: f64) -> u32 {
    (length * 1e9) as u32
}

impl Slack {
    /// Its length (m).
    pub(super) fn get(&self) -> f64 {
        f64::from(self.0.load(Relaxed)) * 1e-9
    }

    pub(super) fn set(&self, length: f64) {
        self.0.store(nanometres(length), Relaxed);
    }

    /// Makes it no more than a length (m).
    pub(super) fn lower(&self, length: f64) {
        let most = nanometres(length);
        if most < self.0.load(Relaxed) {
            self.0.fetch_min(most, Relaxed);
        }
    }

    /// Makes it 0 if it is more than a length (m).
    pub(super) fn lose(&self, length: f64) {
        if nanometres(length) < self.0.load(Relaxed) {
            self.0.store(0, Relaxed);
        }
    }
}
