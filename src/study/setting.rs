//! What a run is set to: a scheme with its dials, and a step.

use crate::integrator::Integrator;

/// A scheme with its dials, and a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Setting {
    /// The scheme and its parameters.
    pub integrator: Integrator,
    /// The step (s); of dopri5 the longest one.
    pub dt: f64,
}

impl Setting {
    /// Sweeps or iterations of a step, of the schemes whose dial they are.
    pub fn iterations(&self) -> Option<u32> {
        match self.integrator {
            Integrator::Xpbd { iterations } | Integrator::Projective { iterations, .. } => {
                Some(iterations)
            }
            _ => None,
        }
    }

    /// The error that a step may have (m), of dopri5.
    pub fn tolerance(&self) -> Option<f64> {
        match self.integrator {
            Integrator::Dopri5 { tolerance } => Some(tolerance),
            _ => None,
        }
    }

    /// What its settings have in common with those of other steps: a line of a diagram.
    pub fn series(&self) -> String {
        let name = self.integrator.name();
        match self.iterations() {
            Some(1) => format!("{name}, 1 sweep"),
            Some(n) => format!("{name}, {n} iterations"),
            None => name.to_owned(),
        }
    }

    /// What tells it from others of its series: the step, or dopri5's tolerance.
    pub fn dial(&self) -> String {
        match self.tolerance() {
            Some(tolerance) => format!("tolerance {} mm", digits(1000.0 * tolerance)),
            None => format!("{} ms", digits(1000.0 * self.dt)),
        }
    }
}

/// A number of any size with three digits.
pub fn digits(x: f64) -> String {
    if x == 0.0 || !x.is_finite() {
        return format!("{x}");
    }
    let size = x.abs().log10().floor();
    if !(-3.0..5.0).contains(&size) {
        return format!("{x:.2e}");
    }
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "between 0 and 5"
    )]
    let decimals = (2.0 - size).max(0.0) as usize;
    let text = format!("{x:.decimals$}");
    if decimals == 0 {
        return text;
    }
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

/// The compared times of a study in words.
pub(super) fn when(times: u32, duration: f64) -> String {
    let duration = digits(duration);
    match times {
        1 => format!("after {duration} s"),
        _ => format!("at {times} times over {duration} s"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_three_digits() {
        let texts = [0.123_45, 16.666_7, 1000.0, 0.000_012, 0.0, 1.0, 4.166_7].map(digits);
        assert_eq!(
            texts,
            ["0.123", "16.7", "1000", "1.20e-5", "0", "1", "4.17"]
        );
    }
}
