//! What the dial of contact is worth: exact distances or grids of several resolutions, each with
//! continuous collision detection and without.
//!
//! Every setting runs the same scene and is audited with exact geometry, which no setting shares. How far
//! a setting moves the cloth is compared with what halving the step does: less than that is lost in the
//! error of the step, which grows by itself where folds decide.

mod dial;
pub mod table;
mod watch;

pub use dial::{CELLS, Dial};
pub use watch::Time;

use super::error::StudyError;
use super::front::FASTER;
use super::reference::completed;
use super::{Distance, Outcome, PATIENCE, Setting, Subject, digits};
use crate::frame::Audited;
use crate::mesh::GridError;
use crate::scene::Obstacle;
use glam::DVec3;
use watch::{Watched, timed, watched};

/// Runs of each setting; the least time of each counts. Settings take turns, so that what else the
/// machine does meets all alike.
pub const ROUNDS: u32 = 4;

/// What every setting of the dial came to.
#[derive(Clone, Debug)]
pub struct Contact {
    /// How all runs are computed.
    pub setting: Setting,
    /// What halving the step moves the cloth by, under exact distances and continuous detection.
    pub halved: Distance,
    /// The slowest round of the first setting over its fastest, less 1: smaller differences are noise.
    pub noise: f64,
    /// Each setting, exact ones first.
    pub rows: Vec<Row>,
}

/// A setting of the dial.
#[derive(Clone, Debug)]
pub struct Row {
    /// The setting.
    pub dial: Dial,
    /// What came of it.
    pub came: Result<Measured, Failed>,
}

/// A run that came to its end.
#[derive(Clone, Debug)]
pub struct Measured {
    /// The worst of all audited states.
    pub audited: Audited,
    /// Pairs of features that met although continuous detection was to keep them apart.
    pub missed: u64,
    /// From the run with exact distances and continuous detection, over the compared times.
    pub distance: Distance,
    /// The quickest of its rounds.
    pub time: Time,
    /// The error of each obstacle's grid, by its name.
    pub grids: Vec<(String, GridError)>,
}

/// Why nothing was measured.
#[derive(Clone, Debug, PartialEq)]
pub struct Failed {
    /// What happened, as in tables: `refused` is a grid that can't be made.
    pub name: &'static str,
    /// In words.
    pub why: String,
}

impl Contact {
    /// Whether another setting is clearly faster and in nothing worse; what failed always is. Distances
    /// below what halving the step does count as that.
    pub fn is_dominated(&self, row: &Row) -> bool {
        let Ok(own) = &row.came else {
            return true;
        };
        let faults = |measured: &Measured| {
            let Audited {
                depth,
                inside,
                crossings,
                ..
            } = measured.audited;
            #[expect(clippy::cast_precision_loss, reason = "far below 2⁵³")]
            let missed = measured.missed as f64;
            let distance = measured.distance.rms.max(self.halved.rms);
            [depth, inside.into(), crossings.into(), missed, distance]
        };
        self.rows
            .iter()
            .filter_map(|row| row.came.as_ref().ok())
            .any(|other| {
                let quick = (1.0 - FASTER) * own.time.seconds_per_second;
                let pairs = faults(other).into_iter().zip(faults(own));
                other.time.seconds_per_second < quick && pairs.into_iter().all(|(a, b)| a <= b)
            })
    }
}

/// Runs a scene under every setting of the dial, `rounds` times.
///
/// Ends early, with the settings so far, when the user stops.
///
/// # Errors
///
/// When the scene has no obstacles; when the run with exact distances and continuous detection doesn't
/// come to its end, or is stopped.
pub fn contact(
    subject: &Subject<'_>,
    setting: Setting,
    rounds: u32,
    say: &mut dyn FnMut(String),
) -> Result<Contact, StudyError> {
    let scene = &subject.loaded.scene;
    if scene.obstacle.is_empty() {
        return Err(StudyError::Ask(format!(
            "{} has no obstacles, whose contact --contact studies; add an [[obstacle]], or study another scene",
            subject.loaded.file
        )));
    }
    let setting = Setting {
        dt: subject.fitting(setting.dt),
        ..setting
    };
    say(said(Dial::EXACT));
    let exact = subject.with(&Dial::EXACT.changes(scene))?;
    let first = watched(&exact, setting)?;
    let reference = completed(&exact, first.trial.clone())?.states;
    say(format!("{}, at half the step", said(Dial::EXACT)));
    let halved = Setting {
        dt: 0.5 * setting.dt,
        ..setting
    };
    let finer = completed(&exact, exact.run(halved, &mut |_| {})?)?;
    let mut study = Contact {
        setting,
        halved: Distance::over(&reference, &finer.states),
        noise: 0.0,
        rows: vec![Row::new(Dial::EXACT, first, &reference)],
    };
    let mut subjects = vec![Some(exact)];
    let with_grids = scene.obstacle.iter().any(Obstacle::takes_grid);
    for dial in Dial::all(with_grids).into_iter().skip(1) {
        say(said(dial));
        let turned = match subject.with(&dial.changes(scene)) {
            Err(StudyError::Scene(error)) if dial.cell.is_some() => {
                study.rows.push(Row::refused(dial, error.cause));
                subjects.push(None);
                continue;
            }
            other => other?,
        };
        let run = watched(&turned, setting)?;
        if run.trial.outcome == Outcome::Stopped {
            return Ok(study);
        }
        study.rows.push(Row::new(dial, run, &reference));
        subjects.push(Some(turned));
    }
    study.repeat(&subjects, rounds, say)?;
    Ok(study)
}

fn said(dial: Dial) -> String {
    format!(
        "distances {}, continuous detection {}",
        dial.distances(),
        dial.continuous()
    )
}

impl Contact {
    /// Repeats the runs for their times.
    fn repeat(
        &mut self,
        subjects: &[Option<Subject<'_>>],
        rounds: u32,
        say: &mut dyn FnMut(String),
    ) -> Result<(), StudyError> {
        let mut slowest = f64::NEG_INFINITY;
        for round in 1..rounds {
            say(format!("times, round {} of {rounds}", round + 1));
            for (row, subject) in self.rows.iter_mut().zip(subjects) {
                let (Ok(measured), Some(subject)) = (&mut row.came, subject) else {
                    continue;
                };
                let (trial, time) = timed(subject, self.setting)?;
                if trial.outcome == Outcome::Completed {
                    if row.dial == Dial::EXACT {
                        let both = [time, measured.time].map(|time| time.seconds_per_second);
                        slowest = both.into_iter().fold(slowest, f64::max);
                    }
                    measured.time = measured.time.least(time);
                }
            }
        }
        if let Some(Ok(exact)) = self.rows.first().map(|row| &row.came) {
            self.noise = (slowest / exact.time.seconds_per_second - 1.0).max(0.0);
        }
        Ok(())
    }
}

impl Row {
    fn new(dial: Dial, run: Watched, reference: &[Vec<DVec3>]) -> Self {
        let failed = |why: String| Failed {
            name: run.trial.outcome.name(),
            why,
        };
        let came = match &run.trial.outcome {
            Outcome::Completed => Ok(Measured {
                audited: run.audited,
                missed: run.missed,
                distance: Distance::over(&run.trial.states, reference),
                time: run.time,
                grids: run.grids,
            }),
            Outcome::Diverged(why) => Err(failed(why.clone())),
            Outcome::TooSlow => Err(failed(format!("took more than {} s", digits(PATIENCE)))),
            Outcome::Stopped => Err(failed(String::new())),
        };
        Self { dial, came }
    }

    fn refused(dial: Dial, why: String) -> Self {
        let name = "refused";
        Self {
            dial,
            came: Err(Failed { name, why }),
        }
    }
}
