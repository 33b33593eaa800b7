//! The heavy elastica: a thin strip that doesn't stretch, clamped horizontally at one end, and hangs
//! under its own weight.
//!
//! With s the arc length from the clamp over the length L, θ(s) the angle below the horizontal and
//! Γ = w L³ / B, where w is the weight per length and B the bending stiffness,
//!
//! ```text
//! θ'' = −Γ (1 − s) cos θ,   θ(0) = 0,   θ'(1) = 0.
//! ```
//!
//! Instead of this boundary value problem for each Γ, one family of initial value problems is solved.
//! With τ = Γ^⅓ (1 − s), measured from the free end, and β = π/2 − θ, the angle from the vertical,
//!
//! ```text
//! β'' = τ sin β,   β(0) = β₀,   β'(0) = 0,   until β(τ₁) = π/2;   then Γ = τ₁³.
//! ```
//!
//! Γ and the drop grow as β₀ falls, so that either finds it by bisection. β₀ is as small as 10⁻²⁸ at
//! Γ = 10⁴: what is sought is its logarithm.
//!
//! Source: Bickley 1934, "The heavy elastica". Leaves out stretch and the strip's width: B is the
//! plate's D for a wide sheet, D (1 − ν²) for a narrow strip, each times the width.

use std::f64::consts::FRAC_PI_2;

/// Largest Γ that is solved for: not far beyond, the angle at the tip has no double.
pub const GAMMA_MAX: f64 = 1e6;

/// Step of τ. Half of it changes lengths by less than 10⁻¹⁰ and the clamp's curvature by 2·10⁻⁹ of
/// itself, up to Γ = 10⁴.
const STEP: f64 = 0.005;

/// A depth beyond [`GAMMA_MAX`]: β grows about as exp(⅔ √Γ).
const DEEPEST: f64 = 680.0;

/// Shape of the strip for one Γ. Lengths are over L.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Elastica {
    /// Γ = w L³ / B: weight (N/m) times length cubed over bending stiffness (N·m²).
    pub gamma: f64,
    /// How far the free end hangs below the clamp, H/L = ∫ sin θ ds.
    pub drop: f64,
    /// How far the free end is from the clamp along the horizontal, W/L = ∫ cos θ ds.
    pub reach: f64,
    /// θ at the free end (rad).
    pub tip_angle: f64,
    /// Curvature at the clamp times L, θ'(0).
    pub clamp_curvature: f64,
}

/// The shape for Γ = w L³ / B, to 10⁻⁶ or better.
///
/// Γ → 0: H/L = Γ/8, θ'(0) = Γ/2. Γ → ∞: W/L = √(2/Γ), θ'(0) = √(2Γ).
///
/// ```
/// let strip = muslin::lab::elastica::elastica(10.0);
/// assert!((strip.drop - 0.700_200).abs() < 1e-6);
/// ```
///
/// # Panics
///
/// When `gamma` is not within 0 … [`GAMMA_MAX`].
pub fn elastica(gamma: f64) -> Elastica {
    Elastica {
        gamma,
        ..shape(depth_of_gamma(gamma))
    }
}

/// Points of the strip from the clamp at the origin to the free end, evenly spaced along it:
/// (x/L, y/L), with y upwards and so negative.
///
/// # Panics
///
/// When there are fewer than two points, or `gamma` is not within 0 … [`GAMMA_MAX`].
pub fn curve(gamma: f64, points: u32) -> Vec<[f64; 2]> {
    assert!(points >= 2, "a curve has two points or more");
    let pieces = points - 1;
    let depth = depth_of_gamma(gamma);
    let length = Arc::whole(depth).tau;
    if length == 0.0 {
        let along = |k| f64::from(k) / f64::from(pieces);
        return (0..points).map(|k| [along(k), 0.0]).collect();
    }
    let piece = length / f64::from(pieces);
    let steps = (piece / STEP).ceil();
    let mut arc = Arc::tip(depth);
    let mut from_tip = vec![[0.0; 2]];
    for _ in 0..pieces {
        let end = arc.tau + piece;
        while arc.tau < end - 0.5 * piece / steps {
            arc = arc.advanced(piece / steps);
        }
        from_tip.push([arc.across / length, arc.down / length]);
    }
    let [reach, drop] = from_tip[pieces as usize];
    let points = from_tip.iter().rev();
    points.map(|[x, y]| [reach - x, y - drop]).collect()
}

/// The Γ of a strip whose free end hangs `drop` = H/L below the clamp: the inverse of
/// [`Elastica::drop`]. `None` unless 0 ≤ H/L and Γ ≤ [`GAMMA_MAX`], where H/L is 0.999.
pub fn gamma_of_drop(drop: f64) -> Option<f64> {
    if drop == 0.0 {
        return Some(0.0);
    }
    let gamma = shape(first_depth(|strip| strip.drop >= drop)).gamma;
    (drop > 0.0 && gamma <= GAMMA_MAX).then_some(gamma)
}

fn depth_of_gamma(gamma: f64) -> f64 {
    assert!(
        (0.0..=GAMMA_MAX).contains(&gamma),
        "Γ = {gamma} is not within 0 … {GAMMA_MAX}"
    );
    first_depth(|strip| strip.gamma >= gamma)
}

/// The least depth, −ln of β₀ over π/2, whose strip is far enough bent.
fn first_depth(far_enough: impl Fn(&Elastica) -> bool) -> f64 {
    let (mut low, mut high) = (0.0, DEEPEST);
    loop {
        let middle = 0.5 * (low + high);
        // 10⁻¹⁸ is less than β₀'s own rounding.
        if middle <= low || middle >= high || high - low < 1e-18 {
            return high;
        }
        if far_enough(&shape(middle)) {
            high = middle;
        } else {
            low = middle;
        }
    }
}

/// The strip of one depth.
fn shape(depth: f64) -> Elastica {
    let tip = Arc::tip(depth);
    let arc = Arc::whole(depth);
    let length = arc.tau;
    let straight = length == 0.0;
    Elastica {
        gamma: length.powi(3),
        drop: if straight { 0.0 } else { arc.down / length },
        reach: if straight { 1.0 } else { arc.across / length },
        tip_angle: FRAC_PI_2 - tip.beta,
        clamp_curvature: arc.slope * length,
    }
}

/// The strip from its free end up to τ; lengths are in units of τ.
#[derive(Clone, Copy, Debug)]
struct Arc {
    /// Length τ.
    tau: f64,
    /// Angle from the vertical β (rad).
    beta: f64,
    /// β'.
    slope: f64,
    /// Vertical extent ∫ cos β dτ.
    down: f64,
    /// Horizontal extent ∫ sin β dτ.
    across: f64,
}

impl Arc {
    fn tip(depth: f64) -> Self {
        Self {
            tau: 0.0,
            beta: FRAC_PI_2 * (-depth).exp(),
            slope: 0.0,
            down: 0.0,
            across: 0.0,
        }
    }

    /// Up to the clamp, where β = π/2.
    fn whole(depth: f64) -> Self {
        let mut arc = Self::tip(depth);
        while arc.beta < FRAC_PI_2 {
            let next = arc.advanced(STEP);
            if next.beta >= FRAC_PI_2 {
                return arc.advanced(arc.step_to_clamp(&next));
            }
            arc = next;
        }
        arc
    }

    /// The part of a step after which β = π/2, by Newton's method from the step's end.
    fn step_to_clamp(&self, end: &Self) -> f64 {
        let mut step = STEP;
        let mut reached = *end;
        for _ in 0..6 {
            step -= (reached.beta - FRAC_PI_2) / reached.slope;
            reached = self.advanced(step);
        }
        step
    }

    /// A step of the classical Runge–Kutta method.
    fn advanced(&self, step: f64) -> Self {
        let rate = |at: &Self| {
            [
                at.slope,
                at.tau * at.beta.sin(),
                at.beta.cos(),
                at.beta.sin(),
            ]
        };
        let k1 = rate(self);
        let k2 = rate(&self.moved(0.5 * step, k1));
        let k3 = rate(&self.moved(0.5 * step, k2));
        let k4 = rate(&self.moved(step, k3));
        let mean = |i: usize| (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]) / 6.0;
        self.moved(step, [0, 1, 2, 3].map(mean))
    }

    fn moved(&self, step: f64, rate: [f64; 4]) -> Self {
        Self {
            tau: self.tau + step,
            beta: self.beta + step * rate[0],
            slope: self.slope + step * rate[1],
            down: self.down + step * rate[2],
            across: self.across + step * rate[3],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Γ, H/L, W/L, tip angle (degrees), clamp curvature: computed by another solver, on the boundary
    /// value problem; as many digits as are known.
    const TABLE: [[f64; 5]; 15] = [
        [0.01, 0.001250, 0.999999, 0.0955, 0.00500],
        [0.1, 0.012498, 0.999911, 0.9548, 0.05000],
        [0.5, 0.062306, 0.997779, 4.7634, 0.24961],
        [1.0, 0.123471, 0.991246, 9.4604, 0.49693],
        [2.0, 0.238507, 0.966893, 18.4260, 0.97674],
        [5.0, 0.495905, 0.846657, 39.9354, 2.22689],
        [10.0, 0.700200, 0.656354, 60.3120, 3.74219],
        [20.0, 0.829881, 0.445232, 76.7478, 5.76153],
        [50.0, 0.907917, 0.245015, 87.4593, 9.52847],
        [100.0, 0.937524, 0.159223, 89.6167, 13.69324],
        [300.0, 0.965006, 0.086291, 89.9968, 24.06250],
        [1000.0, 0.981141, 0.045986, 90.0, 44.29766],
        [2000.0, 0.986737, 0.032238, 90.0, 62.82474],
        [5000.0, 0.991651, 0.020240, 90.0, 99.58167],
        [10000.0, 0.994110, 0.014261, 90.0, 141.00425],
    ];

    #[test]
    fn shapes_agree_with_the_table() {
        for [gamma, drop, reach, degrees, curvature] in TABLE {
            let strip = elastica(gamma);
            assert!((strip.drop - drop).abs() < 6e-7, "{strip:?}");
            assert!((strip.reach - reach).abs() < 6e-7, "{strip:?}");
            assert!(
                (strip.tip_angle.to_degrees() - degrees).abs() < 6e-5,
                "{strip:?}"
            );
            assert!(
                (strip.clamp_curvature - curvature).abs() < 6e-6,
                "{strip:?}"
            );
        }
    }

    #[test]
    fn a_drop_gives_back_its_gamma() {
        for [gamma, drop, ..] in TABLE {
            let again = gamma_of_drop(elastica(gamma).drop).unwrap();
            assert!((again / gamma - 1.0).abs() < 1e-9, "Γ = {gamma}: {again}");
            // As far as the table's six digits go.
            let slack = 6e-7 / drop.min(1.0 - drop) * gamma * 3.0;
            let found = gamma_of_drop(drop).unwrap();
            assert!((found - gamma).abs() < slack, "Γ = {gamma}: {found}");
        }
        assert_eq!(gamma_of_drop(0.0), Some(0.0));
        for outside in [-0.1, 0.9995, 1.0, f64::NAN] {
            assert_eq!(gamma_of_drop(outside), None, "{outside}");
        }
    }

    #[test]
    fn limits_are_the_beam_and_the_hanging_strip() {
        let beam = elastica(1e-6);
        assert!((beam.drop / 1e-6 - 1.0 / 8.0).abs() < 1e-9, "{beam:?}");
        assert!((beam.clamp_curvature / 1e-6 - 0.5).abs() < 1e-9, "{beam:?}");
        let limp = elastica(GAMMA_MAX);
        let expected = (2.0 / GAMMA_MAX).sqrt();
        assert!((limp.reach / expected - 1.0).abs() < 2e-2, "{limp:?}");
        let flat = elastica(0.0);
        assert!(
            flat.drop.abs() < 1e-15 && flat.reach > 1.0 - 1e-15,
            "{flat:?}"
        );
    }

    #[test]
    fn the_curve_runs_from_the_clamp_to_the_tip_in_equal_pieces() {
        for gamma in [0.0, 0.01, 3.0, 200.0, 10000.0] {
            let strip = elastica(gamma);
            let points = curve(gamma, 401);
            assert_eq!(points[0], [0.0, 0.0]);
            let [x, y] = points[400];
            assert!((x - strip.reach).abs() < 1e-8, "Γ = {gamma}: {x}");
            assert!((y + strip.drop).abs() < 1e-8, "Γ = {gamma}: {y}");
            // A chord is shorter than its arc by κ²/24 of its length cubed.
            let most = strip.clamp_curvature.powi(2) / 24.0 * 400.0_f64.powi(-3);
            for pair in points.windows(2) {
                let chord = (pair[1][0] - pair[0][0]).hypot(pair[1][1] - pair[0][1]);
                let short = 1.0 / 400.0 - chord;
                assert!(
                    (-1e-9..=most + 1e-9).contains(&short),
                    "Γ = {gamma}: {short}"
                );
            }
        }
    }
}
