//! One run, watched: its audit, and where its time went.

use crate::frame::{Audited, Capture};
use crate::mesh::GridError;
use crate::simulation::{Simulation, Stage, Stats};
use crate::study::{Setting, StudyError, Subject, Trial};

/// Looks of the audit in a simulated second.
const FPS: f64 = 60.0;

/// What contact took of a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Time {
    /// Wall time per simulated second.
    pub seconds_per_second: f64,
    /// Wall time of finding contacts, answering them and keeping edges and triangles apart (s a step).
    pub stages: [f64; 3],
}

impl Time {
    #[expect(clippy::cast_precision_loss, reason = "steps stay far below 2⁵³")]
    fn of(trial: &Trial, stats: &Stats) -> Self {
        let steps = stats.steps.max(1) as f64;
        let stages = [Stage::DetectContacts, Stage::Respond, Stage::ResolveImpacts]
            .map(|stage| stats.times.of(stage).as_secs_f64() / steps);
        Self {
            seconds_per_second: trial.seconds_per_second,
            stages,
        }
    }

    /// The least of two runs.
    pub(super) fn least(self, other: Self) -> Self {
        let pairs = |i: usize| self.stages[i].min(other.stages[i]);
        Self {
            seconds_per_second: self.seconds_per_second.min(other.seconds_per_second),
            stages: [0, 1, 2].map(pairs),
        }
    }

    /// Share of contact in a step of `dt` (s).
    pub fn share(&self, dt: f64) -> f64 {
        self.stages.iter().sum::<f64>() / (self.seconds_per_second * dt)
    }
}

/// What was seen of a run.
#[derive(Debug)]
pub(super) struct Watched {
    pub(super) trial: Trial,
    pub(super) audited: Audited,
    /// Pairs of features that met nevertheless.
    pub(super) missed: u64,
    pub(super) time: Time,
    /// The error of each obstacle's grid, by its name.
    pub(super) grids: Vec<(String, GridError)>,
}

/// Runs a setting once, and audits it with exact geometry at every 1/60 s.
pub(super) fn watched(subject: &Subject<'_>, setting: Setting) -> Result<Watched, StudyError> {
    let mut capture = None;
    let mut stats = Stats::default();
    let mut grids = Vec::new();
    let mut due = 0.0;
    let trial = subject.run(setting, &mut |simulation: &Simulation| {
        let capture = capture.get_or_insert_with(|| {
            grids = grid_errors(simulation);
            Capture::new(&subject.loaded, simulation).0
        });
        stats = *simulation.stats();
        let frame = simulation.state().time * FPS + 1e-6;
        if frame >= due {
            capture.frame(simulation, Vec::new(), false);
            due = frame.floor() + 1.0;
        }
    })?;
    Ok(Watched {
        audited: capture
            .and_then(|capture| capture.audited())
            .unwrap_or_default(),
        missed: stats.impacts.missed,
        time: Time::of(&trial, &stats),
        trial,
        grids,
    })
}

/// Runs a setting once, for its time alone.
pub(super) fn timed(subject: &Subject<'_>, setting: Setting) -> Result<(Trial, Time), StudyError> {
    let mut stats = Stats::default();
    let trial = subject.run(setting, &mut |simulation| stats = *simulation.stats())?;
    let time = Time::of(&trial, &stats);
    Ok((trial, time))
}

fn grid_errors(simulation: &Simulation) -> Vec<(String, GridError)> {
    let obstacles = simulation.model().obstacles.iter();
    obstacles
        .filter_map(|obstacle| Some((obstacle.name.clone(), obstacle.shape.grid_error()?)))
        .collect()
}
