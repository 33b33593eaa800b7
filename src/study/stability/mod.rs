//! Where schemes are stable and where they are right: a map over the step and a property of the model,
//! with what the program forecasts.
//!
//! Each cell is a run of the scene from its start, with a property of its model multiplied by a factor.
//! It ends at [`Dials::horizon`], but after no more steps than [`Dials::work`] allows; an explicit
//! scheme takes at least as many as an instability 5 % beyond its limit needs to show. It has diverged when
//! the simulation says so, and is inaccurate when it is further from the row's reference than
//! [`Map::tolerance`]. A row goes from long steps to short ones and ends when two in a row
//! completed, or took too long: a shorter one only costs more.

mod axis;
mod cell;
mod drawing;
mod table;
mod truth;
mod workers;

pub use axis::Axis;
pub use cell::{Cell, Verdict};
pub use drawing::picture;
pub use table::{HEADER, csv};

use super::{StudyError, Subject, diagonal};
use crate::integrator::Integrator;
use crate::model::Model;
use crate::scene::{IntegratorName, LoadedScene};
use crate::simulation::{Forecast, forecast, sweep_compliance};
use std::sync::atomic::{AtomicUsize, Ordering};
use truth::Truth;

/// What is asked for; empty lists stand for the usual values.
#[derive(Clone, Debug, PartialEq)]
pub struct Dials {
    /// What varies from row to row.
    pub axis: Axis,
    /// The factors on it, a row each.
    pub factors: Vec<f64>,
    /// The steps (s), a column each.
    pub steps: Vec<f64>,
    /// How many steps where none are given.
    pub columns: u32,
    /// The schemes, a map each.
    pub schemes: Vec<IntegratorName>,
    /// Simulated time after which runs are compared (s); the subject's own where that is less.
    pub horizon: f64,
    /// Particles times steps of a run, at most.
    pub work: f64,
}

impl Default for Dials {
    fn default() -> Self {
        Self {
            axis: Axis::Stiffness,
            factors: Vec::new(),
            steps: Vec::new(),
            columns: 16, // a factor of two from a microsecond to 1/30 s
            schemes: Vec::new(),
            horizon: 0.5,
            work: 2e6,
        }
    }
}

/// The map of a scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Map {
    /// What varies from row to row.
    pub axis: Axis,
    /// The steps (s), short ones first.
    pub steps: Vec<f64>,
    /// The factors, small ones first.
    pub factors: Vec<f64>,
    /// Rows scheme by scheme, small factors first; those that the user stopped are missing.
    pub rows: Vec<Row>,
    /// Simulated time after which runs are compared (s).
    pub horizon: f64,
    /// Distance to the reference (m RMS) from which a run is inaccurate: [`TOLERANCE`] of the largest
    /// cloth's size.
    pub tolerance: f64,
    /// Of each factor, how far its reference is from one with twice its step (m RMS); where that is more
    /// than half of the tolerance, its runs can't be judged.
    pub errors: Vec<f64>,
}

/// The cells of a scheme with one factor.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// The scheme.
    pub scheme: Integrator,
    /// The factor.
    pub factor: f64,
    /// Of an explicit scheme the largest stable step at the start (s), 0 where no step is; of xpbd the one
    /// at which cloth is softer than its material by [`SOFTER`].
    pub forecast: Option<f64>,
    /// One entry a step of the map.
    pub cells: Vec<Cell>,
}

/// Share of the largest cloth's size (the diagonal of its box at rest) from which a distance to the
/// reference is called inaccurate.
pub const TOLERANCE: f64 = 0.01;

/// Share of the tolerance by which a reference may differ from one with twice its step: being of second
/// order, it is a third of that from its limit.
const SURE: f64 = 0.5;

/// Softening by XPBD that the forecast's line is drawn at.
pub const SOFTER: f64 = 0.1;

/// Longest of the usual steps (s).
const LONGEST: f64 = 1.0 / 30.0;

/// Shortest of the usual steps (s), at least and at most.
const SHORTEST: [f64; 2] = [1e-6, 1e-4];

/// How far runs go.
#[derive(Clone, Copy, Debug)]
struct Extent {
    /// Simulated time after which runs are compared (s).
    horizon: f64,
    /// Steps of a run, at most.
    most: f64,
}

/// Maps a scene; `done` sees how many of how many pieces of work are finished, from any thread.
///
/// Runs go side by side, each on one thread. Ends early, with the rows so far, when the user stops.
///
/// # Errors
///
/// When a dial makes no sense, the scene can't be built or a thread can't be started.
pub fn map(
    subject: &Subject<'_>,
    dials: &Dials,
    done: &(dyn Fn(usize, usize) + Sync),
) -> Result<Map, StudyError> {
    let plan = Plan::new(subject, dials)?;
    let (schemes, factors) = (&plan.schemes, &plan.factors);
    let rows = schemes.len() * factors.len();
    let count = factors.len() + rows;
    let finished = AtomicUsize::new(0);
    let finish = || done(1 + finished.fetch_add(1, Ordering::Relaxed), count);
    let truths = workers::each(subject.threads, factors.len(), |i| {
        let truth = plan.truth(subject, factors[i]);
        finish();
        truth
    })?;
    let truths: Vec<Truth> = truths.into_iter().collect::<Result<_, _>>()?;
    let rows = workers::each(subject.threads, rows, |i| {
        let (scheme, factor) = (schemes[i / factors.len()], i % factors.len());
        let row = plan.row(subject, scheme, factor, &truths[factor]);
        finish();
        row
    })?;
    let rows: Vec<Row> = rows.into_iter().collect::<Result<_, _>>()?;
    let is_there = |row: &Row| row.cells.iter().any(|cell| cell.verdict != Verdict::NotRun);
    Ok(Map {
        axis: plan.axis,
        rows: rows.into_iter().filter(is_there).collect(),
        horizon: plan.extent.horizon,
        tolerance: plan.tolerance,
        errors: truths.iter().map(|truth| truth.error).collect(),
        steps: plan.steps,
        factors: plan.factors,
    })
}

/// What is run.
struct Plan {
    axis: Axis,
    factors: Vec<f64>,
    /// One entry a factor.
    forecasts: Vec<Forecast>,
    steps: Vec<f64>,
    schemes: Vec<Integrator>,
    extent: Extent,
    tolerance: f64,
}

impl Plan {
    fn new(subject: &Subject<'_>, dials: &Dials) -> Result<Self, StudyError> {
        let (loaded, axis) = (&subject.loaded, dials.axis);
        let mut factors = dials.factors.clone();
        if factors.is_empty() {
            factors = axis.factors().to_vec();
        }
        axis.check(loaded, &factors)?;
        let positive = |x: f64| x.is_finite() && x > 0.0;
        if let Some(step) = dials.steps.iter().find(|step| !positive(**step)) {
            return Err(StudyError::Ask(format!(
                "step {step}: a step is a positive number of seconds"
            )));
        }
        if !(positive(dials.horizon) && positive(dials.work)) {
            return Err(StudyError::Ask(
                "a map needs runs that take some time: a positive horizon and work".to_owned(),
            ));
        }
        sort(&mut factors);
        let mut forecasts = Vec::new();
        for &factor in &factors {
            let built = axis.build(loaded, factor)?;
            forecasts.push(forecast(&built.model, &built.state));
        }
        let mut steps = dials.steps.clone();
        if steps.is_empty() {
            steps = usual(&forecasts, dials.columns);
        }
        sort(&mut steps);
        let model = axis.build(loaded, 1.0)?.model;
        #[expect(clippy::cast_precision_loss, reason = "fewer than 2⁵³ particles")]
        let particles = model.cloth_particles().max(1) as f64;
        Ok(Self {
            axis,
            schemes: schemes(loaded, &dials.schemes),
            extent: Extent {
                horizon: dials.horizon.min(subject.duration),
                most: (dials.work / particles).ceil(),
            },
            tolerance: TOLERANCE * size(&model),
            factors,
            forecasts,
            steps,
        })
    }

    /// The reference of a factor.
    fn truth(&self, subject: &Subject<'_>, factor: f64) -> Result<Truth, StudyError> {
        let scene = (&subject.loaded, self.axis, factor);
        let times = self.steps.iter().map(|&dt| self.extent.compared(dt) * dt);
        let times: Vec<f64> = times.collect();
        let is_stopped = || subject.is_stopped();
        Truth::find(scene, &times, SURE * self.tolerance, &is_stopped)
    }

    /// A scheme's row of a factor.
    fn row(
        &self,
        subject: &Subject<'_>,
        scheme: Integrator,
        number: usize,
        truth: &Truth,
    ) -> Result<Row, StudyError> {
        let (factor, forecast) = (self.factors[number], &self.forecasts[number]);
        let row = cell::Row {
            loaded: &subject.loaded,
            axis: self.axis,
            factor,
            scheme,
            forecast,
            extent: self.extent,
            tolerance: self.tolerance,
        };
        let mut cells: Vec<Cell> = self.steps.iter().map(|&dt| row.not_run(dt)).collect();
        let is_sure = truth.error <= SURE * self.tolerance;
        let mut settled = 0;
        for (i, &dt) in self.steps.iter().enumerate().rev() {
            let truth = truth.states.get(i).filter(|_| is_sure);
            let Some(cell) = row.run(dt, truth, &|| subject.is_stopped())? else {
                // Half a row would look as if the rest were settled.
                cells
                    .iter_mut()
                    .for_each(|cell| cell.verdict = Verdict::NotRun);
                break;
            };
            let goes_on = match cell.verdict {
                Verdict::Diverged | Verdict::Inaccurate => true,
                Verdict::TooSlow => matches!(scheme, Integrator::Dopri5 { .. }), // foreseen, at no cost
                _ => false,
            };
            settled = if goes_on { 0 } else { settled + 1 };
            cells[i] = cell;
            if settled == 2 {
                break;
            }
        }
        Ok(Row {
            scheme,
            factor,
            forecast: drawn(scheme, forecast),
            cells,
        })
    }
}

/// The step of a scheme that is drawn as its forecast (s).
fn drawn(scheme: Integrator, forecast: &Forecast) -> Option<f64> {
    match scheme {
        // It is the stiffness ratio, and so the square of the step, that softens.
        Integrator::Xpbd { iterations } => {
            let is_soft =
                |dt: f64| sweep_compliance(forecast.stiffness_ratio(dt), iterations) > 1.0 + SOFTER;
            let [mut low, mut high] = [1e-9_f64, 1e3];
            for _ in 0..60 {
                let middle = (low * high).sqrt();
                if is_soft(middle) {
                    high = middle;
                } else {
                    low = middle;
                }
            }
            (high < 1e3).then_some(low)
        }
        _ if scheme.is_explicit() => Some(forecast.stable_dt(scheme)).filter(|dt| dt.is_finite()),
        _ => None,
    }
}

/// The schemes of some names, all without, as the scene sets their dials.
fn schemes(loaded: &LoadedScene, names: &[IntegratorName]) -> Vec<Integrator> {
    let all = IntegratorName::ALL;
    let names = if names.is_empty() { &all[..] } else { names };
    let own = &loaded.scene.solver;
    let each = names.iter().map(|&name| {
        let mut solver = own.clone();
        solver.integrator = name;
        if name != own.integrator {
            solver.iterations = None; // the scene means its own scheme's
        }
        Integrator::of(&solver)
    });
    each.collect()
}

fn sort(list: &mut Vec<f64>) {
    list.sort_by(f64::total_cmp);
    list.dedup();
}

/// Steps (s) from below the shortest limit of any row to [`LONGEST`], in equal ratios.
fn usual(forecasts: &[Forecast], columns: u32) -> Vec<f64> {
    let limits = forecasts
        .iter()
        .flat_map(|forecast| Integrator::EXPLICIT.map(|scheme| forecast.stable_dt(scheme)));
    let shortest = limits.filter(|dt| *dt > 0.0).fold(f64::INFINITY, f64::min);
    let shortest = (0.5 * shortest).clamp(SHORTEST[0], SHORTEST[1]);
    let last = columns.max(2) - 1;
    let ratio = LONGEST / shortest;
    let step = |i: u32| shortest * ratio.powf(f64::from(i) / f64::from(last));
    (0..=last).map(step).collect()
}

/// The diagonal of the largest cloth's box at rest (m).
fn size(model: &Model) -> f64 {
    let sizes = model
        .cloths
        .iter()
        .map(|cloth| diagonal(&model.rest[cloth.particles.clone()]));
    sizes.fold(0.0, f64::max)
}
