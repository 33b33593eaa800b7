//! What runs are compared with: a run in tiny steps, checked against another scheme's.

use super::error::StudyError;
use super::{Distance, Outcome, Setting, Subject, Trial};
use crate::integrator::{Integrator, Linear, Nonlinear};
use glam::DVec3;
use std::time::Instant;

/// Errors are reported down to this many times the reference's own.
pub const MARGIN: f64 = 10.0;

/// Solves of an implicit reference: far more exact than its steps.
const SOLVED: Nonlinear = Nonlinear {
    residual: 1e-8,
    iterations: 50,
    linear: Linear::to(1e-6),
};

/// Share of its stable step that an explicit reference starts at.
const SHARE: f64 = 0.5;

/// Step that an implicit reference starts at (s).
const IMPLICIT_STEP: f64 = 1.0 / 960.0;

/// Share of the reference's time that a first explicit run may take.
const AFFORDABLE: f64 = 0.15;

/// Steps that say what a run costs.
const PROBE: u32 = 20;

/// Wall time (s) after which fewer steps must do.
const PROBE_TIME: f64 = 0.5;

/// What runs are compared with.
#[derive(Clone, Debug)]
pub struct Reference {
    /// Its setting.
    pub setting: Setting,
    /// The setting of the one that it was checked against.
    pub second: Setting,
    /// The cloths' particles at the compared times (m).
    pub states: Vec<Vec<DVec3>>,
    /// Its own error, as far as known: the distance to the second, or to itself at twice the step where
    /// that is more.
    pub error: Distance,
    /// The same at each of the compared times (m RMS).
    pub errors: Vec<f64>,
    /// Wall time per simulated second.
    pub seconds_per_second: f64,
    /// Errors found at each refinement, from the coarsest on.
    pub history: Vec<Distance>,
    /// Whether its error came down to what was asked for.
    pub converged: bool,
}

impl Reference {
    /// The smallest error that can be reported (m RMS).
    pub fn smallest(&self) -> f64 {
        MARGIN * self.error.rms
    }

    /// Whether halving its steps brought it nearer to its limit.
    pub fn improves(&self) -> bool {
        match self.history.as_slice() {
            [.., before, last] => self.converged || last.rms < 0.75 * before.rms,
            _ => true,
        }
    }
}

/// Two schemes that are refined together.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pair {
    pub(super) first: Setting,
    pub(super) second: Setting,
}

impl Pair {
    fn halved(self, times: u32) -> Self {
        let shorter = |setting: Setting| Setting {
            dt: setting.dt / f64::from(1 << times),
            ..setting
        };
        Self {
            first: shorter(self.first),
            second: shorter(self.second),
        }
    }
}

/// Finds a reference whose error is at most `goal` (m RMS), or the best that `budget` (s) of wall time
/// gives.
///
/// Two schemes of different kinds run with steps that are halved until the one agrees with the other and
/// with itself at twice the step. Both differences are needed: schemes may agree on an error that they
/// share (contact and strain limits are answered step by step under each), and one scheme may converge
/// to something else.
///
/// # Errors
///
/// When a run diverges or takes too long, or the user stops before the first is there.
pub fn reference(
    subject: &Subject<'_>,
    goal: f64,
    budget: f64,
    say: &mut dyn FnMut(String),
) -> Result<Reference, StudyError> {
    let pair = pair(subject, budget)?;
    refine(subject, pair, goal, budget, say)
}

/// The same of given schemes, from the steps on that they have.
pub(super) fn refine(
    subject: &Subject<'_>,
    mut pair: Pair,
    goal: f64,
    budget: f64,
    say: &mut dyn FnMut(String),
) -> Result<Reference, StudyError> {
    let start = Instant::now();
    let mut history = Vec::new();
    let mut coarse = whole(subject, pair.first)?;
    pair = pair.halved(1);
    loop {
        let round = Instant::now();
        let first = whole(subject, pair.first)?;
        let second = whole(subject, pair.second)?;
        let apart = [&second, &coarse].map(|other| Distance::over(&first.states, &other.states));
        let error = Distance {
            rms: apart[0].rms.max(apart[1].rms),
            largest: apart[0].largest.max(apart[1].largest),
        };
        history.push(error);
        say(format!(
            "reference {} at {}, error {} mm",
            first.setting.series(),
            first.setting.dial(),
            super::digits(1000.0 * error.rms)
        ));
        let converged = error.rms <= goal;
        // The next round takes twice as long as this one.
        let next = 2.0 * round.elapsed().as_secs_f64();
        if converged || start.elapsed().as_secs_f64() + next > budget || subject.is_stopped() {
            return Ok(Reference {
                setting: pair.first,
                second: pair.second,
                errors: apart_at(&first, [&second, &coarse]),
                seconds_per_second: first.seconds_per_second,
                states: first.states,
                error,
                history,
                converged,
            });
        }
        coarse = first;
        pair = pair.halved(1);
    }
}

/// How far a run is from the farther one of two others, at each time (m RMS).
fn apart_at(run: &Trial, others: [&Trial; 2]) -> Vec<f64> {
    let at = |k: usize| others.map(|other| Distance::between(&run.states[k], &other.states[k]).rms);
    (0..run.states.len())
        .map(|k| at(k).into_iter().fold(0.0, f64::max))
        .collect()
}

/// The schemes of the reference: of fourth and second order where steps as short as explicit schemes
/// need are affordable, else implicit ones of second order.
fn pair(subject: &Subject<'_>, budget: f64) -> Result<Pair, StudyError> {
    let at = |integrator, dt| Setting {
        integrator,
        dt: subject.fitting(dt),
    };
    let stable = |scheme| SHARE * subject.forecast.stable_dt(scheme);
    let explicit = Pair {
        first: at(Integrator::Rk4, stable(Integrator::Rk4).min(IMPLICIT_STEP)),
        second: at(
            Integrator::Verlet,
            stable(Integrator::Verlet).min(IMPLICIT_STEP),
        ),
    };
    if cost(subject, explicit.first)? <= AFFORDABLE * budget {
        return Ok(explicit);
    }
    Ok(Pair {
        first: at(Integrator::Bdf2(SOLVED), IMPLICIT_STEP),
        second: at(Integrator::ImplicitMidpoint(SOLVED), IMPLICIT_STEP),
    })
}

/// What a run will take (s), by its first steps.
pub(super) fn cost(subject: &Subject<'_>, setting: Setting) -> Result<f64, StudyError> {
    let mut simulation = subject.simulation(setting)?;
    let start = Instant::now();
    let mut steps = 0;
    while steps < PROBE && start.elapsed().as_secs_f64() < PROBE_TIME {
        if simulation.step().is_err() {
            break;
        }
        steps += 1;
    }
    let step = start.elapsed().as_secs_f64() / f64::from(steps.max(1));
    Ok(step * subject.duration / setting.dt)
}

/// A run to the end.
fn whole(subject: &Subject<'_>, setting: Setting) -> Result<Trial, StudyError> {
    let trial = subject.run(setting, &mut |_| {})?;
    let failed = |reason: String, remedy: &str| StudyError::NoReference {
        setting: format!("{} at {}", setting.series(), setting.dial()),
        reason,
        remedy: remedy.to_owned(),
    };
    match &trial.outcome {
        Outcome::Completed => Ok(trial),
        Outcome::Diverged(why) => Err(failed(
            format!("diverged: {why}"),
            "study a scene that runs: give it damping, a softer material or a shorter --duration",
        )),
        Outcome::TooSlow => Err(failed(
            format!("took more than {} s", super::digits(subject.patience)),
            "study less of it: a shorter --duration, or larger cells",
        )),
        Outcome::Stopped => Err(StudyError::Stopped),
    }
}
