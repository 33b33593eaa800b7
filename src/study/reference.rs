//! What runs are compared with: a run in tiny steps, checked against another scheme's.

use super::error::StudyError;
use super::overlay::FPS;
use super::{Distance, Outcome, PATIENCE, Setting, Subject, Track, Trial, digits};
use crate::integrator::{Integrator, Linear, Nonlinear};
use glam::DVec3;
use std::time::Instant;

/// Errors are reported down to this many times the reference's own.
pub const MARGIN: f64 = 10.0;

/// Solves of an implicit reference: far more exact than its steps.
const SOLVED: Nonlinear = Nonlinear {
    residual: 1e-6,
    iterations: 50,
    linear: Linear::to(1e-5),
};

/// Share of its stable step that an explicit reference starts at.
const SHARE: f64 = 0.5;

/// Step that an implicit reference starts at (s).
const IMPLICIT_STEP: f64 = 1.0 / 960.0;

/// Share of the reference's time that a first explicit run may take.
const AFFORDABLE: f64 = 0.15;

/// What rounding makes of positions some metres from the origin (m).
const ROUNDING: f64 = 1e-14;

/// Steps that say what a run costs.
const PROBE: u32 = 20;

/// Error of the reference, over the size of the cloths, up to which a time is worth comparing at.
const WORTH: f64 = 1e-3;

/// Errors that shrink to less than this share when steps are halved go to zero.
const SHRINKS: f64 = 0.75;

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
    /// The same at the frames of a recording.
    pub track: Track,
    /// Its own error, as far as known: the distance to the second, or to itself at twice the step where
    /// that is more.
    pub error: Distance,
    /// The same at each of the compared times (m RMS).
    pub errors: Vec<f64>,
    /// Wall time per simulated second.
    pub seconds_per_second: f64,
    /// Whether its error came down to what was asked for.
    pub converged: bool,
    /// Where it was cut short, if it was.
    pub cut: Option<Cut>,
}

/// A time from which on there is nothing to compare with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cut {
    /// The first time left out (s).
    pub time: f64,
    /// What the reference is off by then (m RMS).
    pub error: f64,
}

impl Reference {
    /// The smallest error that can be reported (m RMS): never less than what rounding makes of positions.
    pub fn smallest(&self) -> f64 {
        MARGIN * self.error.rms.max(ROUNDING)
    }
}

/// Two schemes that are refined together.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pair {
    pub(super) first: Setting,
    pub(super) second: Setting,
}

impl Pair {
    fn halved(self) -> Self {
        let shorter = |setting: Setting| Setting {
            dt: 0.5 * setting.dt,
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
/// Where folds may buckle either way, or friction may hold or not, the least difference grows until
/// everything is different, and no step is short enough. The study then ends before: the subject is
/// shortened to the times at which the reference has an error below a thousandth of the cloths' size.
///
/// # Errors
///
/// When a run diverges or takes too long, no time is left to compare at, or the user stops before the
/// reference is there.
pub fn reference(
    subject: &mut Subject<'_>,
    goal: f64,
    budget: f64,
    say: &mut dyn FnMut(String),
) -> Result<Reference, StudyError> {
    let pair = pair(subject, budget)?;
    let aim = Aim {
        goal,
        budget,
        cuts: true,
    };
    let patience = std::mem::replace(&mut subject.patience, budget.max(PATIENCE));
    let found = refine(subject, pair, aim, say);
    subject.patience = patience;
    found
}

/// What a refinement is after.
#[derive(Clone, Copy, Debug)]
pub(super) struct Aim {
    /// The error (m RMS) at which it ends.
    pub(super) goal: f64,
    /// The wall time (s) that it may take.
    pub(super) budget: f64,
    /// Whether times at which there is nothing to compare with are left out.
    pub(super) cuts: bool,
}

/// The same of given schemes, from the steps on that they have.
pub(super) fn refine(
    subject: &mut Subject<'_>,
    mut pair: Pair,
    Aim { goal, budget, cuts }: Aim,
    say: &mut dyn FnMut(String),
) -> Result<Reference, StudyError> {
    let start = Instant::now();
    let mut coarse = whole(subject, pair.first, None)?;
    let mut before: Option<Vec<Distance>> = None;
    let mut cut = None;
    loop {
        let round = Instant::now();
        pair = pair.halved();
        let mut track = Track::new(FPS);
        let first = whole(subject, pair.first, Some(&mut track))?;
        let second = whole(subject, pair.second, None)?;
        let errors = errors(&first, [&second, &coarse]);
        let error = Distance::of_all(&errors);
        say(format!(
            "reference {} at {}, error {} mm up to {} s",
            first.setting.series(),
            first.setting.dial(),
            digits(1000.0 * error.rms),
            digits(subject.duration),
        ));
        let converged = error.rms <= goal;
        // The next round takes twice as long as this one.
        let next = 2.0 * round.elapsed().as_secs_f64();
        let last = converged || start.elapsed().as_secs_f64() + next > budget;
        let kept = match &before {
            _ if !cuts => errors.len(),
            None if !last => errors.len(), // nobody knows yet what shrinks
            before => worthwhile(&errors, before.as_deref().filter(|_| !last), subject.size()),
        };
        if kept < errors.len() {
            cut = Some(Cut {
                time: subject.interval() * (kept + 1) as f64,
                error: errors[kept].rms,
            });
            if kept == 0 {
                return Err(nothing_to_compare(subject, pair.first, errors[0].rms));
            }
            subject.shorten(u32::try_from(kept).unwrap_or(u32::MAX));
        }
        if last || subject.is_stopped() {
            let error = Distance::of_all(&errors[..kept]);
            track.cut(subject.duration);
            return Ok(Reference {
                setting: pair.first,
                second: pair.second,
                errors: errors[..kept].iter().map(|error| error.rms).collect(),
                seconds_per_second: first.seconds_per_second,
                states: first.states[..kept].to_vec(),
                track,
                error,
                converged: error.rms <= goal,
                cut,
            });
        }
        before = Some(errors);
        coarse = first;
    }
}

/// The larger of the distances to two others, at each time.
fn errors(first: &Trial, others: [&Trial; 2]) -> Vec<Distance> {
    let at = |k: usize| {
        let [a, b] = others.map(|other| Distance::between(&first.states[k], &other.states[k]));
        Distance {
            rms: a.rms.max(b.rms),
            largest: a.largest.max(b.largest),
        }
    };
    let times = first.states.len();
    (0..times.min(others[1].states.len())).map(at).collect()
}

/// How many times, from the first on, are worth comparing at: those with a small error, and while there
/// is another round to come those with one that shrinks.
fn worthwhile(errors: &[Distance], before: Option<&[Distance]>, size: f64) -> usize {
    let shrinks = |k: usize| before.is_some_and(|before| errors[k].rms < SHRINKS * before[k].rms);
    let good = |k: &usize| errors[*k].rms <= WORTH * size || shrinks(*k);
    (0..errors.len()).take_while(good).count()
}

fn nothing_to_compare(subject: &Subject<'_>, setting: Setting, error: f64) -> StudyError {
    StudyError::NoReference {
        setting: format!("{} at {}", setting.series(), setting.dial()),
        reason: format!(
            "is still {} mm off after {} s, and halving its steps doesn't mend it: what happens depends on every detail",
            digits(1000.0 * error),
            digits(subject.interval())
        ),
        remedy: "study a shorter --duration or more --times, or give it more --patience".to_owned(),
    }
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
    let step = subject.install(|| {
        let start = Instant::now();
        let mut steps = 0;
        while steps < PROBE && start.elapsed().as_secs_f64() < PROBE_TIME {
            if simulation.step().is_err() {
                break;
            }
            steps += 1;
        }
        start.elapsed().as_secs_f64() / f64::from(steps.max(1))
    });
    Ok(step * subject.duration / setting.dt)
}

/// A run to the end.
pub(super) fn whole(
    subject: &Subject<'_>,
    setting: Setting,
    mut track: Option<&mut Track>,
) -> Result<Trial, StudyError> {
    let trial = subject.run(setting, &mut |simulation| {
        if let Some(track) = &mut track {
            track.see(simulation);
        }
    })?;
    completed(subject, trial)
}

/// A run, if it came to its end.
pub(super) fn completed(subject: &Subject<'_>, trial: Trial) -> Result<Trial, StudyError> {
    let setting = trial.setting;
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
            format!("took more than {} s", digits(subject.patience)),
            "study less of it: a shorter --duration, or larger cells",
        )),
        Outcome::Stopped => Err(StudyError::Stopped),
    }
}
