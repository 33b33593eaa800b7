//! The study itself: every setting against the reference.

use super::error::StudyError;
use super::{Distance, Outcome, Reference, Setting, Subject, Trial};

/// What came of a setting.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// The setting.
    pub setting: Setting,
    /// Wall time per simulated second.
    pub seconds_per_second: f64,
    /// Distance to the reference at the compared times.
    pub error: Error,
    /// Largest strain ever.
    pub strain: f64,
    /// Energy that the scheme took (positive) or added, over what was exchanged.
    pub drift: f64,
    /// How the run ended.
    pub outcome: Outcome,
}

/// What is known of a run's error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Error {
    /// Its distance to the reference.
    Known(Distance),
    /// Less than the reference can tell: its own error times [`MARGIN`](super::reference::MARGIN).
    Below(f64),
    /// The run didn't come to its end.
    None,
}

impl Row {
    /// A trial beside the reference.
    pub fn new(trial: &Trial, reference: &Reference) -> Self {
        let error = if trial.outcome == Outcome::Completed {
            let error = Distance::over(&trial.states, &reference.states);
            if error.rms <= reference.smallest() {
                Error::Below(reference.smallest())
            } else {
                Error::Known(error)
            }
        } else {
            Error::None
        };
        Self {
            setting: trial.setting,
            seconds_per_second: trial.seconds_per_second,
            error,
            strain: trial.strain,
            drift: trial.drift,
            outcome: trial.outcome.clone(),
        }
    }

    /// Whether a setting after it in a series can show nothing.
    fn is_exact_enough_for(&self, next: Setting) -> bool {
        matches!(self.error, Error::Below(_)) && self.setting.series() == next.series()
    }

    /// Its error (m RMS), if it is known.
    pub fn rms(&self) -> Option<f64> {
        match self.error {
            Error::Known(distance) => Some(distance.rms),
            _ => None,
        }
    }

    /// A length that its error is known to be below or equal to (m RMS); infinite where the run failed.
    pub fn at_most(&self) -> f64 {
        match self.error {
            Error::Known(distance) => distance.rms,
            Error::Below(bound) => bound,
            Error::None => f64::INFINITY,
        }
    }
}

/// Runs settings one after another; `done` sees each row with all that came before.
///
/// What follows in a series after a setting that is as exact as can be told costs more and shows nothing:
/// it is left out. Ends early, with the rows so far, when the user stops.
///
/// # Errors
///
/// As [`Subject::run`].
pub fn sweep(
    subject: &Subject<'_>,
    reference: &Reference,
    settings: &[Setting],
    done: &mut dyn FnMut(&[Row]),
) -> Result<Vec<Row>, StudyError> {
    let mut rows: Vec<Row> = Vec::new();
    for &setting in settings {
        if rows
            .last()
            .is_some_and(|row| row.is_exact_enough_for(setting))
        {
            continue;
        }
        let trial = subject.measure(setting)?;
        if trial.outcome == Outcome::Stopped {
            break;
        }
        rows.push(Row::new(&trial, reference));
        done(&rows);
    }
    Ok(rows)
}
