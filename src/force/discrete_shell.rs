//! Discrete shells: bending by the dihedral angle itself.

use super::{BendingLaw, Fold};
use std::f64::consts::{PI, TAU};

/// The bending energy of Grinspun, Hirani, Desbrun and Schröder 2003: E = ½ k (θ − θ₀)² (J).
///
/// θ − θ₀ is taken the short way round, within ±π.
#[derive(Clone, Copy, Debug, Default)]
pub struct DiscreteShell;

impl BendingLaw for DiscreteShell {
    const NAME: &'static str = "discrete_shell";

    fn energy(fold: Fold, rest: f64) -> f64 {
        0.5 * Self::moment(fold, rest).powi(2)
    }

    #[inline]
    fn moment(fold: Fold, rest: f64) -> f64 {
        let turn = fold.angle() - rest;
        if turn > PI {
            turn - TAU
        } else if turn < -PI {
            turn + TAU
        } else {
            turn
        }
    }

    fn slope(_: Fold, _: f64) -> f64 {
        1.0
    }

    #[inline]
    fn constraint(fold: Fold, rest: f64) -> [f64; 2] {
        [Self::moment(fold, rest), 1.0]
    }
}
