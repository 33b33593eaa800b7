//! What the calibration compares runs with: found in seconds, over as much of the run as it can tell.

use super::{RATE, span, worst};
use crate::integrator::{Integrator, Linear, Nonlinear};
use crate::study::error::StudyError;
use crate::study::reference::{Aim, Pair, Reference, cost, refine};
use crate::study::{PATIENCE, Setting, Subject, digits};

/// Solves of an implicit yardstick: exact to micrometres.
const SOLVED: Nonlinear = Nonlinear {
    residual: 1e-6,
    iterations: 50,
    linear: Linear::to(1e-4),
};

/// Share of its stable step that an explicit yardstick starts at.
const SHARE: f64 = 0.9;

/// The longest step of an explicit yardstick, and that an implicit one starts at (s).
const STEPS: [f64; 2] = [1.0 / 480.0, 1.0 / 240.0];

/// Cost of the first round, of one run of the first scheme in first steps: that run, and both schemes in
/// halves.
const ROUND: f64 = 5.0;

/// A window shorter than this (s) says nothing of a run: cloth falls by 0.3 m in it.
pub(super) const SHORTEST: f64 = 0.25;

/// A window that is long enough to be content with explicit schemes (s).
const CONTENT: f64 = 0.5;

/// A reference over at most `longest` (s), or as much of it as fits an `allowance` (s) of wall time.
pub(super) fn find(
    subject: &mut Subject<'_>,
    longest: f64,
    goal: f64,
    allowance: f64,
    say: &mut dyn FnMut(String),
) -> Result<Reference, StudyError> {
    let [explicit, implicit] = STEPS;
    span(subject, longest);
    let stable = |scheme| (SHARE * subject.forecast.stable_dt(scheme)).min(explicit);
    let pairs = [
        pair(
            subject,
            [Integrator::Rk4, Integrator::Verlet].map(|scheme| (scheme, stable(scheme))),
        ),
        pair(
            subject,
            [
                (Integrator::Bdf2(SOLVED), implicit),
                (Integrator::ImplicitMidpoint(SOLVED), implicit),
            ],
        ),
    ];
    let affordable = |pair: Pair| {
        let per_second = cost(subject, pair.first)? / longest;
        Ok::<f64, StudyError>((allowance / (ROUND * per_second)).min(longest))
    };
    let mut chosen = (pairs[0], affordable(pairs[0])?);
    if chosen.1 < CONTENT.min(longest) {
        let window = affordable(pairs[1])?;
        if window > chosen.1 {
            chosen = (pairs[1], window);
        }
    }
    let (pair, mut window) = chosen;
    loop {
        // Whole intervals between compared times, which steps of a frame meet.
        window = (window * RATE).floor() / RATE;
        let is_shortest = window <= SHORTEST;
        span(subject, window.max(SHORTEST).min(longest));
        // Dear scenes take what they take.
        subject.patience = if is_shortest {
            PATIENCE
        } else {
            0.5 * allowance
        };
        let met = Pair {
            first: met(subject, pair.first),
            second: met(subject, pair.second),
        };
        let aim = Aim {
            goal: 0.5 * goal, // the largest of many errors is some twice their mean
            budget: allowance,
            cuts: false,
        };
        match refine(subject, met, aim, say) {
            // Its first steps promised a faster run, or it comes to harm later on.
            Err(StudyError::NoReference { .. }) if !is_shortest => window *= 0.5,
            found => return found,
        }
    }
}

fn pair(subject: &Subject<'_>, [first, second]: [(Integrator, f64); 2]) -> Pair {
    let at = |(integrator, dt)| met(subject, Setting { integrator, dt });
    Pair {
        first: at(first),
        second: at(second),
    }
}

/// A setting whose steps meet the compared times.
fn met(subject: &Subject<'_>, setting: Setting) -> Setting {
    Setting {
        dt: subject.fitting(setting.dt),
        ..setting
    }
}

/// Shortens the window to where the reference is exact enough for a tolerance (m): runs drift apart where
/// cloth buckles either way, and no step is short enough after that.
///
/// # Errors
///
/// When nothing is left of the window.
pub(super) fn shorten(
    subject: &mut Subject<'_>,
    mut reference: Reference,
    tolerance: f64,
) -> Result<Reference, StudyError> {
    let interval = subject.interval();
    let told = reference
        .errors
        .iter()
        .take_while(|error| **error <= super::BLUR * tolerance)
        .count();
    let times = u32::try_from(told).unwrap_or(u32::MAX);
    let window = f64::from(times) * interval;
    let least = SHORTEST.min(subject.duration);
    if window < (1.0 - 1e-9) * least {
        reference.errors.truncate(least_times(least, interval));
        return Err(StudyError::Ask(format!(
            "--tolerance {} mm: an error as small can't be told here: the best run of {} s of calibration is known to {} mm over its first {} s; ask for {} mm, use larger cells, or set --integrator and --dt",
            digits(1000.0 * tolerance),
            digits(super::ALLOWANCE[0]),
            digits(1000.0 * worst(&reference)),
            digits(least),
            digits(1000.0 * worst(&reference) / super::BLUR),
        )));
    }
    reference.states.truncate(told);
    reference.errors.truncate(told);
    (subject.duration, subject.times) = (window, times);
    Ok(reference)
}

/// Compared times up to `least` (s).
fn least_times(least: f64, interval: f64) -> usize {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a few"
    )]
    let times = (least / interval * (1.0 - 1e-9)).ceil().max(1.0) as usize;
    times
}
