//! Edge springs: bending by the sine of half the dihedral angle.

use super::{BendingLaw, Fold};

/// The elastic bending element of Bridson, Marino and Fedkiw 2003.
///
/// Moment M = 2 k (sin θ/2 − sin θ₀/2) (N·m), k θ for small angles. It grows ever more slowly and is
/// largest where the hinge is folded flat, so that a crumpled cloth stays easy to fold.
///
/// Theirs is `k_e` |E|²/(|N₁| + |N₂|) in place of 2 k with the current lengths. Here they are those at
/// rest, which makes the force the gradient of an energy:
/// E = 2 k [2 (cos θ₀/2 − cos θ/2) − (θ − θ₀) sin θ₀/2] (J).
#[derive(Clone, Copy, Debug, Default)]
pub struct EdgeSpring;

impl BendingLaw for EdgeSpring {
    const NAME: &'static str = "edge_spring";

    fn energy(fold: Fold, rest: f64) -> f64 {
        // 2 (cos θ₀/2 − cos θ/2) as a product, which keeps the digits of small differences.
        let angle = fold.angle();
        let fall = 4.0 * (0.25 * (angle + rest)).sin() * (0.25 * (angle - rest)).sin();
        2.0 * (fall - (angle - rest) * (0.5 * rest).sin())
    }

    #[inline]
    fn moment(fold: Fold, rest: f64) -> f64 {
        let at_rest = if rest == 0.0 { 0.0 } else { (0.5 * rest).sin() };
        2.0 * (fold.half_sine() - at_rest)
    }

    fn slope(fold: Fold, _: f64) -> f64 {
        let half_sine = fold.half_sine();
        (1.0 - half_sine * half_sine).max(0.0).sqrt()
    }
}
