//! One cell of a map: a run of one scheme, at one step, of a row's model.

use super::{Axis, Extent};
use crate::integrator::Integrator;
use crate::scene::LoadedScene;
use crate::simulation::{Forecast, Simulation};
use crate::study::{Distance, PATIENCE, StudyError};
use glam::DVec3;
use std::time::Instant;

/// What became of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// Not run: the two next longer steps of its row came near their reference or took too long, and a
    /// shorter one only costs more.
    NotRun,
    /// It came to its end, near its reference.
    Completed,
    /// The same, but some steps ended before their equations were solved.
    Unsolved,
    /// It came to its end, too far from its reference.
    Inaccurate,
    /// It came to its end, and there is no reference to judge it by.
    Unjudged,
    /// It lost its sense.
    Diverged,
    /// It would take too long, or took it.
    TooSlow,
}

impl Verdict {
    /// Every verdict.
    pub const ALL: [Self; 7] = [
        Self::NotRun,
        Self::Completed,
        Self::Unsolved,
        Self::Inaccurate,
        Self::Unjudged,
        Self::Diverged,
        Self::TooSlow,
    ];

    /// Its name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::NotRun => "not-run",
            Self::Completed => "completed",
            Self::Unsolved => "unsolved",
            Self::Inaccurate => "inaccurate",
            Self::Unjudged => "unjudged",
            Self::Diverged => "diverged",
            Self::TooSlow => "too-slow",
        }
    }
}

/// One cell of a map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cell {
    /// The step (s); of dopri5 the longest one.
    pub step: f64,
    /// Steps of a run to its end.
    pub steps: u64,
    /// When it is compared with its reference (s).
    pub compared: f64,
    /// Its distance to the reference then (m RMS), if it got there and there is one.
    pub rms: Option<f64>,
    /// What became of it.
    pub verdict: Verdict,
}

/// Growth of an amplitude that shows: from the stirring, 0.1 mm/s, to energy that no fall explains.
const SHOWS: f64 = 1e6;

/// How far beyond the limit an instability should still show.
const BEYOND: f64 = 1.05;

/// Steps of an explicit scheme, at least: near the limit of rk4 an amplitude takes 40 to grow a
/// millionfold.
const LEAST: f64 = 100.0;

/// Steps after which runs are compared, at most: where they are so short, a longer run would only cost.
const COMPARED: f64 = 4000.0;

impl Extent {
    /// Steps of `dt` (s) after which a run is compared with its reference.
    pub(super) fn compared(&self, dt: f64) -> f64 {
        // 0.5 s are 15 steps of 1/30 s, also where rounding says 14.999.
        (self.horizon / dt * (1.0 + 1e-9))
            .floor()
            .clamp(1.0, self.most.min(COMPARED))
    }

    /// Steps of `dt` (s) of a run: of an explicit scheme as many as show an instability.
    fn steps(&self, scheme: Integrator, forecast: &Forecast, dt: f64) -> f64 {
        let compared = self.compared(dt);
        if !scheme.is_explicit() {
            return compared;
        }
        let limit = forecast.stable_dt(scheme);
        let growth = forecast.growth(scheme, if limit > 0.0 { BEYOND * limit } else { dt });
        let shows = if growth > 1.0 {
            SHOWS.ln() / growth.ln()
        } else {
            0.0
        };
        compared.max(LEAST).max(shows.ceil()).min(self.most)
    }
}

/// What the cells of a row have in common.
pub(super) struct Row<'a> {
    pub(super) loaded: &'a LoadedScene,
    pub(super) axis: Axis,
    pub(super) factor: f64,
    pub(super) scheme: Integrator,
    pub(super) forecast: &'a Forecast,
    pub(super) extent: Extent,
    /// Distance (m RMS) from which a run is inaccurate.
    pub(super) tolerance: f64,
}

impl Row<'_> {
    /// Runs a cell whose positions should be `truth` (m) at the end; `None` when stopped.
    ///
    /// # Errors
    ///
    /// As [`crate::scene::build`].
    pub(super) fn run(
        &self,
        dt: f64,
        truth: Option<&Vec<DVec3>>,
        is_stopped: &dyn Fn() -> bool,
    ) -> Result<Option<Cell>, StudyError> {
        let mut cell = self.not_run(dt);
        if self.is_too_long(&cell) {
            cell.verdict = Verdict::TooSlow;
            return Ok(Some(cell));
        }
        let built = self.axis.build(self.loaded, self.factor)?;
        let mut simulation = Simulation::new(built.model, built.state, self.scheme, dt);
        let cloth = simulation.model().cloth_particles();
        let start = Instant::now();
        for step in 1..=cell.steps {
            if is_stopped() {
                return Ok(None);
            }
            if start.elapsed().as_secs_f64() > PATIENCE {
                cell.verdict = Verdict::TooSlow;
                return Ok(Some(cell));
            }
            if simulation.step().is_err() {
                cell.verdict = Verdict::Diverged;
                return Ok(Some(cell));
            }
            #[expect(clippy::cast_precision_loss, reason = "fewer than 2⁵³ steps")]
            let time = step as f64 * dt;
            if (time - cell.compared).abs() < 0.5 * dt {
                let positions = &simulation.state().positions[..cloth];
                cell.rms = truth.map(|truth| Distance::between(positions, truth).rms);
            }
        }
        cell.verdict = match cell.rms {
            None => Verdict::Unjudged,
            Some(rms) if rms > self.tolerance => Verdict::Inaccurate,
            Some(_) if simulation.stats().unsolved > 0 => Verdict::Unsolved,
            Some(_) => Verdict::Completed,
        };
        Ok(Some(cell))
    }

    /// A cell before its run.
    pub(super) fn not_run(&self, dt: f64) -> Cell {
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a whole number of steps"
        )]
        let steps = self.extent.steps(self.scheme, self.forecast, dt) as u64;
        Cell {
            step: dt,
            steps,
            compared: self.extent.compared(dt) * dt,
            rms: None,
            verdict: Verdict::NotRun,
        }
    }

    /// Whether a scheme that chooses its own steps needs too many of them: their stable length is much
    /// like rk4's.
    fn is_too_long(&self, cell: &Cell) -> bool {
        let chooses = matches!(self.scheme, Integrator::Dopri5 { .. });
        chooses && cell.compared / self.forecast.stable_dt(Integrator::Rk4) > self.extent.most
    }
}
