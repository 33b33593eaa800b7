//! Edge springs: bending by the sine of half the dihedral angle.

use super::{BendingLaw, Fold};

/// Turn (rad) below which the constraint is linear: its next term is a third of this.
const NEAR_REST: f64 = 1e-7;

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

    /// 4 sin θ/4 and cos θ/4 for a flat rest, which need no angle. Else C = ±√(2 E/k), C′ = E′/(k C),
    /// with δ = θ − θ₀ and E/k = 8 cos θ₀/2 sin² δ/4 − 2 (δ − 2 sin δ/2) sin θ₀/2; near rest, where
    /// that is rounding, √(cos θ₀/2) times δ.
    #[inline]
    fn constraint(fold: Fold, rest: f64) -> [f64; 2] {
        if rest == 0.0 {
            let quarter_cosine = (0.5 + 0.5 * Self::slope(fold, rest)).sqrt();
            return [2.0 * fold.half_sine() / quarter_cosine, quarter_cosine];
        }
        let turn = fold.angle() - rest;
        let (at_rest, slope_at_rest) = (0.5 * rest).sin_cos();
        if turn.abs() < NEAR_REST {
            let slope = slope_at_rest.max(0.0).sqrt();
            return [slope * turn, slope];
        }
        let convex = 8.0 * slope_at_rest * (0.25 * turn).sin().powi(2);
        let energy = convex - 2.0 * (turn - 2.0 * (0.5 * turn).sin()) * at_rest;
        let c = (2.0 * energy.max(0.0)).sqrt().copysign(turn);
        if c == 0.0 {
            return [0.0; 2];
        }
        [c, Self::moment(fold, rest) / c]
    }
}
