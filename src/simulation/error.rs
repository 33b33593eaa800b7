//! The error of the time step, estimated while a run goes.
//!
//! From time to time the run is shadowed: a second simulation starts from a copy of its state and
//! repeats a few steps in halves, limits and contact included. With d what lies between the two then,
//! these steps have moved the run by d/(1 − 2⁻ᵖ) from where the equations of motion lead, p the
//! order of the scheme (Richardson 1911). Over the time of the window that is a rate (m/s), and the
//! error of the run is its integral.
//!
//! What the integral leaves out: errors of different times may cancel, and an error once made may grow
//! with the cloth's folds or be pulled back by its springs. On `hanging-cloth` at 0.5 s the estimate is
//! 0.30 (implicit Euler at 1 ms) to 2.7 times (symplectic Euler) the true error, whatever the step; on
//! the way there up to 10 times with BDF2, whose first steps are of first order. Later, when folds have
//! opened and closed, the true error may be far more, and in cloth that has come to rest it is less.
//! Summing vectors instead lets errors cancel that don't: 0.13 of the true error with implicit Euler.
//!
//! The error of the mesh is not seen: the shadow has the same.

use super::{Simulation, Stats};
use crate::integrator::Integrator;
use crate::model::Model;
use glam::DVec3;
use std::time::{Duration, Instant};

/// Simulated time for which a run is shadowed (s), a step at least. After one step of an explicit scheme,
/// half of what lies between is gone the next moment; twice the time leaves half of the samples.
const WINDOW: f64 = 1.0 / 240.0;

/// The same for `dopri5`, times as long: what its steps at the stability limit leave in the fastest modes
/// comes and goes within two or three.
const LONGER: f64 = 3.0;

/// What a sample takes besides the halved steps, in steps: copies, and the distance.
const BESIDES: f64 = 1.0;

/// Averages with neighbours before the distance is taken. What the fastest modes are off by changes its
/// sign from particle to particle, and is gone the next moment: with `dopri5`, which steps at their
/// stability limit, it makes 70 times the error of smooth motion, after 2 averages 7, after 4 twice.
const AVERAGES: u32 = 4;

/// Estimates the error of a run's time step, by a second simulation beside it.
#[derive(Debug)]
pub struct ErrorEstimate {
    shadow: Simulation,
    gap: Gap,
    /// Steps of a window.
    window: u32,
    /// Share of the run's time that it may take.
    budget: f64,
    /// Step at which the present window began, or the next one will.
    begin: u64,
    /// 1/(1 − 2⁻ᵖ).
    extrapolation: f64,
    /// When the last window ended (s).
    time: f64,
    /// The error then (m), and by how much it grew (m/s).
    error: f64,
    rate: f64,
    /// Sum of the rates of all windows (m/s).
    rates: f64,
    samples: u32,
    spent: Duration,
}

impl ErrorEstimate {
    /// Ready for the next step of a run, of whose time it is to take `share`, at most a half; `None` when
    /// that is 0. `before` (m) is the error that the run has already. Windows lie at fixed steps: the estimate is the same on every machine.
    pub fn new(run: &Simulation, share: f64, before: Option<f64>) -> Option<Self> {
        if share <= 0.0 {
            return None;
        }
        let chooses = matches!(run.integrator, Integrator::Dopri5 { .. });
        let length = if chooses { LONGER * WINDOW } else { WINDOW };
        let window = (length / run.dt).round().clamp(1.0, f64::from(u32::MAX));
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "clamped just above"
        )]
        let window = window as u32;
        let p = run.integrator.order_in(&run.model);
        Some(Self {
            shadow: run.shadow(),
            gap: Gap::new(&run.model),
            window,
            budget: share,
            begin: run.stats.steps,
            extrapolation: 1.0 / (1.0 - 0.5_f64.powi(p)),
            time: run.state.time,
            error: before.unwrap_or(0.0),
            rate: 0.0,
            rates: 0.0,
            samples: 0,
            spent: Duration::ZERO,
        })
    }

    /// Looks at a run after each of its steps; leaves it as it is.
    pub fn after_step(&mut self, run: &Simulation) {
        let start = Instant::now();
        if run.stats.steps == self.begin + u64::from(self.window) {
            self.measure(run);
            self.begin += self.interval(run);
        }
        if run.stats.steps == self.begin {
            self.shadow.follow(run);
        }
        self.spent += start.elapsed();
    }

    /// Steps from the start of a window to that of the next. Counts decide, not clocks: the halved steps of
    /// a scheme that iterates cost what their iterations do.
    fn interval(&self, run: &Simulation) -> u64 {
        let window = f64::from(self.window);
        let [all, steps, own] = [
            run.stats.iterations,
            run.stats.steps,
            self.shadow.stats.iterations,
        ]
        .map(count);
        let work = if all > 0.0 && own > 0.0 {
            (own / all * steps).clamp(window, 4.0 * window)
        } else {
            2.0 * window
        };
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "more than 2⁶⁴ steps are never done"
        )]
        let interval = ((work + BESIDES) / self.budget).ceil() as u64;
        interval
    }

    /// Ends a window. One whose halved steps diverge says nothing.
    fn measure(&mut self, run: &Simulation) {
        for _ in 0..2 * self.window {
            if self.shadow.step().is_err() {
                return;
            }
        }
        let moved = self.gap.rms(run, &self.shadow);
        let rate = self.extrapolation * moved / (f64::from(self.window) * run.dt);
        // Before the first window ends, the rate is taken to be its.
        let before = if self.samples == 0 { rate } else { self.rate };
        self.error += 0.5 * (before + rate) * (run.state.time - self.time);
        self.time = run.state.time;
        self.rate = rate;
        self.rates += rate;
        self.samples += 1;
    }

    /// Error at a time (s) after the last window: the root of the mean square over particles of the
    /// distance (m) from where exact steps would have led; `None` before the first window has ended.
    pub fn at(&self, time: f64) -> Option<f64> {
        let error = self.error + self.rate * (time - self.time);
        (self.samples > 0).then_some(error)
    }

    /// What a step adds (m), in the mean over all windows; `None` before the first has ended.
    pub fn per_step(&self) -> Option<f64> {
        let step = 2.0 * self.shadow.dt;
        (self.samples > 0).then(|| self.rates / f64::from(self.samples) * step)
    }

    /// Windows that were looked at.
    pub fn samples(&self) -> u32 {
        self.samples
    }

    /// Wall time that it took.
    pub fn spent(&self) -> Duration {
        self.spent
    }
}

impl Simulation {
    /// A second simulation of the same model from the same state, with steps half as long.
    fn shadow(&self) -> Self {
        let (model, state) = (self.model.clone(), self.state.clone());
        let mut shadow = Self::new(model, state, self.integrator.halved(), 0.5 * self.dt);
        shadow.follow(self);
        shadow
    }

    /// Goes to where another simulation of the same model is, to go on from there as it would.
    fn follow(&mut self, other: &Self) {
        self.state.copy_from(&other.state);
        self.scheme.follow(other.scheme.as_ref());
        self.contacts.copy_from(&other.contacts);
        self.contacts.scale_grips(self.dt / other.dt);
        self.detection.clone_from(&other.detection);
        self.bodies.clone_from(&other.bodies);
        self.impacts.clone_from(&other.impacts);
        self.tangles.clone_from(&other.tangles);
        self.tangled.clone_from(&other.tangled);
        self.ledger.copy_from(&other.ledger);
        self.budget.clone_from(&other.budget);
        self.sensible_strain = other.sensible_strain;
        self.start = other.state.time;
        self.stats = Stats::default();
    }
}

#[expect(clippy::cast_precision_loss, reason = "counts stay far below 2⁵³")]
fn count(n: u64) -> f64 {
    n as f64
}

/// How far two states of one model are apart, but for what the fastest modes are.
#[derive(Debug)]
struct Gap {
    /// From one state to the other (m), one entry a particle.
    apart: Vec<DVec3>,
    /// Sum of the neighbours' (m).
    around: Vec<DVec3>,
    /// 1/number of neighbours along springs of the weave; 0 without any.
    share: Vec<f64>,
}

impl Gap {
    fn new(model: &Model) -> Self {
        let mut share: Vec<f64> = vec![0.0; model.cloth_particles()];
        for spring in model.weave().flat_map(|batch| &batch.springs) {
            for i in spring.ends {
                share[i as usize] += 1.0;
            }
        }
        for share in share.iter_mut().filter(|neighbours| **neighbours > 0.0) {
            *share = share.recip();
        }
        Self {
            apart: vec![DVec3::ZERO; share.len()],
            around: vec![DVec3::ZERO; share.len()],
            share,
        }
    }

    /// Root of the mean square over the cloths' particles (m).
    fn rms(&mut self, a: &Simulation, b: &Simulation) -> f64 {
        let (from, to) = (&a.state.positions, &b.state.positions);
        for (i, apart) in self.apart.iter_mut().enumerate() {
            *apart = to[i] - from[i];
        }
        for _ in 0..AVERAGES {
            self.average(&a.model);
        }
        let squares: f64 = self.apart.iter().map(|apart| apart.length_squared()).sum();
        (squares / count(self.apart.len().max(1) as u64)).sqrt()
    }

    /// Half of each particle's own and half of its neighbours' mean.
    fn average(&mut self, model: &Model) {
        let Self {
            apart,
            around,
            share,
        } = self;
        around.fill(DVec3::ZERO);
        for spring in model.weave().flat_map(|batch| &batch.springs) {
            let [i, j] = spring.ends.map(|i| i as usize);
            around[i] += apart[j];
            around[j] += apart[i];
        }
        for (i, apart) in apart.iter_mut().enumerate() {
            if share[i] > 0.0 {
                *apart = (*apart + around[i] * share[i]) * 0.5;
            }
        }
    }
}
