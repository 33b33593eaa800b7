//! How long a step is when the scene leaves it to the program.

use super::Forecast;
use crate::integrator::Integrator;
use crate::scene::Step;

/// Share of the stable step at the start that `"auto"` takes.
///
/// Stretched and folded cloth swings faster than at the start: measured while it moves, the stable step
/// shrinks by 7 % on `block` (strain 50 %), 1.4 % on `drape`, 0.7 % on `thin-shell`, and not at all
/// on `hanging-cloth`, `chain` and `spring`, since no spring gets stiffer than along itself at rest.
pub const AUTO_SHARE: f64 = 0.9;

/// Why there is no step to choose.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "\"auto\" finds no step at which {scheme} is stable: without damping there is none; give every cloth damping, or use --integrator symplectic-euler or implicit-euler"
)]
pub struct NoStableStep {
    /// Name of the scheme.
    pub scheme: &'static str,
}

/// The step of a run (s): what the scene says, or for `"auto"` a share of the forecast's stable one;
/// for schemes that any step leaves stable [`Integrator::usual_step`].
///
/// # Errors
///
/// When an explicit scheme is stable at no step.
pub fn step_length(
    step: Step,
    scheme: Integrator,
    forecast: &Forecast,
) -> Result<f64, NoStableStep> {
    if let Step::Seconds(dt) = step {
        return Ok(dt);
    }
    let limit = forecast.stable_dt(scheme);
    if limit == 0.0 {
        return Err(NoStableStep {
            scheme: scheme.name(),
        });
    }
    if limit.is_finite() {
        Ok(AUTO_SHARE * limit)
    } else {
        Ok(scheme.usual_step())
    }
}

/// How many times as far as the material a structure at rest stretches under `sweeps` sweeps of
/// XPBD a step, where its elements have a stiffness ratio R = dt² k (1/mᵢ + 1/mⱼ).
///
/// Every step lets all particles fall by dt² g, and the sweeps have to undo it: the multipliers of a
/// step end at λ = dt² × tension. Of C = (A + α̃) λ₀, with A the coupling by masses and α̃ = 1/(k dt²),
/// Gauss–Seidel leaves H C a sweep, with H = N (M)⁻¹ of the splitting A + α̃ = M − N; a tension that
/// changes little from element to element has A λ ≈ 0, so that half of the diagonal of A is what N
/// couples to those that are visited later: h = ½R / (1 + ½R). What s sweeps leave unsolved of the
/// elongation α̃ λ adds up, step by step, to hˢ/(1 − hˢ) of it; with one sweep that is R/2 and
/// exact in the mean over elements weighted by tension, whatever the order of the sweep.
pub fn sweep_compliance(ratio: f64, sweeps: u32) -> f64 {
    let left = (0.5 * ratio / (1.0 + 0.5 * ratio)).powi(sweeps.cast_signed());
    1.0 / (1.0 - left)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A hanging chain of n equal links, as XPBD leaves it when it doesn't move any more: how many times
    /// as far as its material it stretches, in the mean weighted by tension.
    fn stretch(n: usize, ratio: f64, sweeps: u32, order: &[usize]) -> f64 {
        // Masses and dt² g are 1; k is then half of R.
        let k = 0.5 * ratio;
        let compliance = 1.0 / k;
        let w = |i: usize| if i == 0 { 0.0 } else { 1.0 };
        let mut x = vec![0.0; n + 1];
        for _ in 0..60_000 {
            x.iter_mut().skip(1).for_each(|x| *x += 1.0);
            let mut multipliers = vec![0.0; n];
            for _ in 0..sweeps {
                for &link in order {
                    let masses = w(link) + w(link + 1);
                    let violation = x[link + 1] - x[link];
                    let change =
                        (violation - compliance * multipliers[link]) / (masses + compliance);
                    multipliers[link] += change;
                    x[link] += w(link) * change;
                    x[link + 1] -= w(link + 1) * change;
                }
            }
        }
        let tension = |link: usize| (n - link) as f64;
        let had: f64 = (0..n).map(|i| tension(i) * (x[i + 1] - x[i])).sum();
        had / (0..n).map(|i| tension(i).powi(2) / k).sum::<f64>()
    }

    #[test]
    fn sweeps_leave_a_chain_as_soft_as_forecast() {
        let n = 40;
        let forwards: Vec<usize> = (0..n).collect();
        let backwards: Vec<usize> = (0..n).rev().collect();
        let colours: Vec<usize> = (0..n).step_by(2).chain((1..n).step_by(2)).collect();
        let mixed: Vec<usize> = (0..n).map(|i| i * 17 % n).collect();
        // With one sweep, whatever its order: the sum of N_i N_(i+1) over that of N_i².
        let n_i = |i: u32| f64::from(i);
        let shared: f64 = (1..40).map(|i| n_i(i) * n_i(i + 1)).sum();
        let share = shared / (1..=40).map(|i| n_i(i).powi(2)).sum::<f64>();
        for ratio in [1.0, 8.0, 60.0] {
            for sweeps in [1, 2, 4] {
                let forecast = sweep_compliance(ratio, sweeps);
                for order in [&forwards, &backwards, &colours, &mixed] {
                    let found = stretch(n, ratio, sweeps, order);
                    let what = format!("R = {ratio}, {sweeps} sweeps: {found}, {forecast}");
                    assert!((found / forecast - 1.0).abs() < 0.05, "{what}");
                    if sweeps == 1 {
                        let exact = 1.0 + 0.5 * ratio * share;
                        assert!(
                            (found / exact - 1.0).abs() < 1e-6,
                            "{what}, exactly {exact}"
                        );
                    }
                }
            }
        }
    }
}
