//! The setting that a scene needs: a scheme and a step that keep to a tolerance at the least cost, or that
//! are the most exact a budget pays for.
//!
//! A short calibration on the scene itself. First a yardstick: what runs are compared with, as
//! [`reference()`](super::reference()) finds it, over as much of the run as can be told. Then a search: each
//! scheme's step is turned until its error, or its cost, is where it should be. What is picked has been
//! run, and the run that follows does the same steps: its error is measured. Only where a rehearsal of the
//! whole run turns the step of a budget once more, the error is scaled with it.
//!
//! An error here is the RMS distance over particles to the run that shorter steps converge to, on the
//! same mesh, at the time where it is largest.

mod dial;
mod search;
mod yardstick;

use super::error::StudyError;
use super::{Outcome, Reference, Setting, Subject, digits};
use crate::integrator::Integrator;
use crate::scene::{IntegratorName, Solver};
use search::Search;
use std::time::{Duration, Instant};

/// What is asked of a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Goal {
    /// The largest error (m RMS).
    Tolerance(f64),
    /// Wall time of a simulated 1/60 s (s).
    Budget(f64),
}

/// What came of one setting in the calibration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measured {
    /// The setting.
    pub setting: Setting,
    /// Its error over the window (m RMS).
    pub error: f64,
    /// Wall time per simulated second.
    pub seconds_per_second: f64,
}

impl Measured {
    /// Wall time of a simulated 1/60 s (ms).
    pub fn ms_per_frame(&self) -> f64 {
        1000.0 * self.seconds_per_second / FRAMES
    }
}

/// What was picked, and what it was picked from.
#[derive(Clone, Debug, PartialEq)]
pub struct Picked {
    /// What was asked for.
    pub goal: Goal,
    /// The setting.
    pub chosen: Measured,
    /// Every setting that was tried to its end.
    pub tried: Vec<Measured>,
    /// Simulated time from the start that errors are measured over (s).
    pub window: f64,
    /// Error of what they are measured against (m RMS): smaller ones can't be told.
    pub resolution: f64,
    /// Wall time of the calibration (s).
    pub seconds: f64,
}

impl Picked {
    /// The most exact of those that cost less than two thirds.
    pub fn cheaper(&self) -> Option<&Measured> {
        let most = self.chosen.seconds_per_second * 2.0 / 3.0;
        self.tried
            .iter()
            .filter(|other| other.seconds_per_second < most && !self.is_chosen(other))
            .min_by(|a, b| a.error.total_cmp(&b.error))
    }

    fn is_chosen(&self, other: &Measured) -> bool {
        other.setting == self.chosen.setting
    }

    /// The cheapest of those whose error is less than half.
    pub fn finer(&self) -> Option<&Measured> {
        let most = self.chosen.error.max(self.resolution) / 2.0;
        self.tried
            .iter()
            .filter(|other| other.error < most && !self.is_chosen(other))
            .min_by(|a, b| a.seconds_per_second.total_cmp(&b.seconds_per_second))
    }
}

/// Schemes that are ever the best at what they cost; see the tables of a study.
const CANDIDATES: [IntegratorName; 8] = [
    IntegratorName::SymplecticEuler,
    IntegratorName::Verlet,
    IntegratorName::Rk4,
    IntegratorName::ImplicitEuler,
    IntegratorName::ImplicitMidpoint,
    IntegratorName::Bdf2,
    IntegratorName::Xpbd,
    IntegratorName::Projective,
];

/// The schemes to pick from, with a scene's dials; its iterations are its own scheme's.
pub fn candidates(solver: &Solver) -> Vec<Integrator> {
    let with = |name| {
        let own = name == solver.integrator;
        Integrator::of(&Solver {
            integrator: name,
            iterations: solver.iterations.filter(|_| own),
            ..solver.clone()
        })
    };
    CANDIDATES.map(with).to_vec()
}

/// Frames of a simulated second that a budget is for.
const FRAMES: f64 = 60.0;

/// Compared times in a simulated second: steps of 1/60 s meet them.
const RATE: f64 = 20.0;

/// Wall time for what runs are compared with (s), and for comparing.
const ALLOWANCE: [f64; 2] = [12.0, 18.0];

/// Wall time of a candidate's run for a budget (s): a dozen of them fit the allowance.
const TASTE: f64 = 1.2;

/// Errors below this (m) are no use to anybody.
const FINEST: f64 = 1e-6;

/// Share of the tolerance that the yardstick's own error may be.
const BLUR: f64 = 1.0 / 3.0;

/// Share of a budget that is aimed at: what else the machine does can only add to it.
const SPENT: f64 = 0.9;

/// Wall time that a whole run may take to see whether it keeps to its budget (s).
const REHEARSAL: f64 = 20.0;

/// Rehearsals at the most, each with what the last taught.
const REHEARSALS: u32 = 3;

/// Picks one of `schemes` and its step for the subject's scene over its whole run, `duration`.
///
/// The subject's duration is then that of the window, over which errors are known.
///
/// # Errors
///
/// When no setting meets the goal, errors as small as the tolerance can't be told in this scene, a run
/// that others are compared with fails, or the user stops.
pub fn pick(
    subject: &mut Subject<'_>,
    goal: Goal,
    schemes: &[Integrator],
    say: &mut dyn FnMut(String),
) -> Result<Picked, StudyError> {
    let start = Instant::now();
    let whole = subject.duration;
    let [measuring, comparing] = ALLOWANCE;
    let reference = match goal {
        Goal::Tolerance(tolerance) => {
            let reference = yardstick::find(subject, whole, BLUR * tolerance, measuring, say)?;
            yardstick::shorten(subject, reference, tolerance)?
        }
        Goal::Budget(budget) => {
            let longest = (TASTE / (FRAMES * budget)).max(yardstick::SHORTEST);
            yardstick::find(subject, whole.min(longest), FINEST, measuring, say)?
        }
    };
    let deadline = Instant::now() + Duration::from_secs_f64(comparing);
    let mut search = Search::new(subject, &reference, deadline, say);
    let mut chosen = match goal {
        Goal::Tolerance(tolerance) => search.within_tolerance(schemes, tolerance)?,
        Goal::Budget(budget) => search.within_budget(schemes, budget * FRAMES)?,
    };
    let tried = search.measured;
    let window = subject.duration;
    if let Goal::Budget(budget) = goal {
        rehearse(subject, whole, budget * FRAMES, &mut chosen, say)?;
    }
    Ok(Picked {
        goal,
        chosen,
        tried,
        window,
        resolution: worst(&reference),
        seconds: start.elapsed().as_secs_f64(),
    })
}

/// The yardstick's own error (m RMS) at the time where it is largest.
fn worst(reference: &Reference) -> f64 {
    reference.errors.iter().copied().fold(0.0, f64::max)
}

/// Sets the simulated time of a subject's runs and the times at which they are compared.
fn span(subject: &mut Subject<'_>, duration: f64) {
    subject.duration = duration;
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "at least 1"
    )]
    let times = (duration * RATE * (1.0 - 1e-9)).ceil().max(1.0) as u32;
    subject.times = times;
}

/// Runs what was chosen over the whole duration, if there is time, and turns its step by what that costs:
/// contact may come after the window, and solves take longer where cloth folds.
fn rehearse(
    subject: &mut Subject<'_>,
    whole: f64,
    budget: f64,
    chosen: &mut Measured,
    say: &mut dyn FnMut(String),
) -> Result<(), StudyError> {
    if budget * whole > REHEARSAL {
        return Ok(());
    }
    let window = (subject.duration, subject.times);
    span(subject, whole);
    for round in 1..=REHEARSALS {
        subject.patience = 2.0 * budget * whole;
        let trial = subject.run(chosen.setting, &mut |_| {})?;
        let cost = match trial.outcome {
            Outcome::Stopped => return Err(StudyError::Stopped),
            Outcome::Diverged(why) => {
                return Err(StudyError::Ask(format!(
                    "{} at {} comes to harm after the calibration's window: {why}; ask for less with --tolerance, or set --integrator and --dt",
                    chosen.setting.series(),
                    chosen.setting.dial()
                )));
            }
            Outcome::TooSlow => 2.0 * budget,
            Outcome::Completed => trial.seconds_per_second,
        };
        say(format!(
            "the whole run with {} at {}: {} ms a frame",
            chosen.setting.series(),
            chosen.setting.dial(),
            digits(1000.0 * cost / FRAMES)
        ));
        chosen.seconds_per_second = cost;
        let longest = dial::longest(subject, chosen.setting.integrator);
        let wanted = dial::dial_of(chosen.setting) * cost / (SPENT * budget);
        let next = dial::setting(subject, chosen.setting.integrator, wanted.min(longest));
        let is_sated = search::SATED.contains(&(cost / budget));
        if is_sated || next == chosen.setting || round == REHEARSALS {
            break;
        }
        chosen.error *= dial::dial_of(next) / dial::dial_of(chosen.setting);
        chosen.setting = next;
    }
    (subject.duration, subject.times) = window;
    Ok(())
}
