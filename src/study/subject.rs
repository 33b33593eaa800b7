//! The scene that is studied, and one run of it under one setting.

use super::Setting;
use super::distance::diagonal;
use super::error::StudyError;
use crate::energy::SCHEME;
use crate::scene::{self, LoadedScene};
use crate::simulation::{Forecast, Simulation, forecast};
use glam::DVec3;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// A run that takes longer than this (s) is given up: the others would wait for it.
pub const PATIENCE: f64 = 60.0;

/// A setting runs again until it has run for so long (s), and the least time counts: what else the machine
/// does can only add to it.
const REPEAT_UP_TO: f64 = 1.0;

/// Most runs of a setting: of three runs of 20 ms the least was still off by 15 %.
const REPEATS: u32 = 20;

/// A scene, the times at which its runs are compared, and what they run on.
#[derive(Debug)]
pub struct Subject<'a> {
    /// The scene.
    pub loaded: LoadedScene,
    /// How long a run is (s).
    pub duration: f64,
    /// Times in a run, evenly spread up to its end, at which states are compared.
    pub times: u32,
    /// Threads of a run.
    pub threads: usize,
    /// A run that takes longer than this (s) is given up; [`PATIENCE`] at first.
    pub patience: f64,
    /// What can be said before any run.
    pub forecast: Forecast,
    /// Diagonal of the box around the cloths at the start (m).
    size: f64,
    pool: rayon::ThreadPool,
    stop: &'a AtomicBool,
}

/// What came of one setting.
#[derive(Clone, Debug, PartialEq)]
pub struct Trial {
    /// The setting.
    pub setting: Setting,
    /// The cloths' particles at the compared times that were reached (m).
    pub states: Vec<Vec<DVec3>>,
    /// Wall time per simulated second, without building the scene.
    pub seconds_per_second: f64,
    /// Largest strain ever of structural and shear springs.
    pub strain: f64,
    /// Energy that the scheme took (positive) or added, over what was exchanged.
    pub drift: f64,
    /// How it ended.
    pub outcome: Outcome,
}

/// How a run ended.
#[derive(Clone, Debug, PartialEq)]
pub enum Outcome {
    /// At its end.
    Completed,
    /// It lost its sense, and says why.
    Diverged(String),
    /// It took longer than [`Subject::patience`].
    TooSlow,
    /// Stopped by the user.
    Stopped,
}

impl Outcome {
    /// Its name in tables.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Completed => "completed",
            Self::Diverged(_) => "diverged",
            Self::TooSlow => "too-slow",
            Self::Stopped => "stopped",
        }
    }
}

impl<'a> Subject<'a> {
    /// A scene to be studied over `duration` (s) at `times` times, on `threads` threads.
    ///
    /// # Errors
    ///
    /// When the scene can't be built, or a thread can't be started.
    pub fn new(
        loaded: LoadedScene,
        duration: f64,
        times: u32,
        threads: usize,
        stop: &'a AtomicBool,
    ) -> Result<Self, StudyError> {
        let built = scene::build(&loaded)?;
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        Ok(Self {
            size: diagonal(&built.state.positions[..built.model.cloth_particles()]),
            forecast: forecast(&built.model, &built.state),
            pool: pool.map_err(|error| StudyError::Threads(error.to_string()))?,
            loaded,
            duration,
            times,
            threads,
            patience: PATIENCE,
            stop,
        })
    }

    /// The same study of the scene with `changes` (`key=value`).
    ///
    /// # Errors
    ///
    /// When a change doesn't fit the scene; as [`Subject::new`].
    pub fn with(&self, changes: &[String]) -> Result<Self, StudyError> {
        let loaded = self.loaded.with(changes)?;
        Self::new(loaded, self.duration, self.times, self.threads, self.stop)
    }

    /// Whether the user wants to stop.
    pub fn is_stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    /// Diagonal of the box around the cloths at the start (m).
    pub fn size(&self) -> f64 {
        self.size
    }

    /// Does something on the threads of the study.
    pub(super) fn install<T: Send>(&self, work: impl FnOnce() -> T + Send) -> T {
        self.pool.install(work)
    }

    /// Time between two compared states (s).
    pub fn interval(&self) -> f64 {
        self.duration / f64::from(self.times)
    }

    /// Leaves out the compared times after the first `times`.
    pub fn shorten(&mut self, times: u32) {
        self.duration = self.interval() * f64::from(times);
        self.times = times;
    }

    /// The longest step of at most `dt` (s) that meets every compared time.
    pub fn fitting(&self, dt: f64) -> f64 {
        // 1/60 s doesn't fit 1/6 s ten times to the last bit.
        self.interval() / (self.interval() / dt * (1.0 - 1e-9)).ceil().max(1.0)
    }

    /// The scene's simulation under a setting.
    ///
    /// # Errors
    ///
    /// As [`scene::build`].
    pub fn simulation(&self, setting: Setting) -> Result<Simulation, StudyError> {
        let built = scene::build(&self.loaded)?;
        Ok(Simulation::new(
            built.model,
            built.state,
            setting.integrator,
            setting.dt,
        ))
    }

    /// Runs a setting, several times if it is a short run; the least time counts.
    ///
    /// # Errors
    ///
    /// As [`scene::build`].
    pub fn measure(&self, setting: Setting) -> Result<Trial, StudyError> {
        let mut trial = self.run(setting, &mut |_| {})?;
        let mut spent = trial.seconds_per_second * self.duration;
        for _ in 1..REPEATS {
            let enough = spent >= REPEAT_UP_TO || trial.outcome != Outcome::Completed;
            if enough || self.is_stopped() {
                break;
            }
            let again = self.run(setting, &mut |_| {})?;
            spent += again.seconds_per_second * self.duration;
            if again.outcome == Outcome::Completed {
                let least = trial.seconds_per_second.min(again.seconds_per_second);
                trial.seconds_per_second = least;
            }
        }
        Ok(trial)
    }

    /// Runs a setting once; `look` sees the simulation at its start and after each step, outside of the
    /// time that counts.
    ///
    /// # Errors
    ///
    /// As [`scene::build`].
    pub fn run(
        &self,
        setting: Setting,
        look: &mut (dyn FnMut(&Simulation) + Send),
    ) -> Result<Trial, StudyError> {
        let mut simulation = self.simulation(setting)?;
        look(&simulation);
        let mut spent = Duration::ZERO;
        let mut states = Vec::new();
        let outcome = self
            .pool
            .install(|| self.advance(&mut simulation, &mut states, &mut spent, look));
        let simulated = simulation.state().time.max(setting.dt); // a run that fails at once had one step
        Ok(Trial {
            setting,
            states,
            seconds_per_second: spent.as_secs_f64() / simulated,
            strain: simulation.stats().strain_ever,
            drift: drift(&simulation),
            outcome,
        })
    }

    /// Steps to the end, or as far as it goes.
    fn advance(
        &self,
        simulation: &mut Simulation,
        states: &mut Vec<Vec<DVec3>>,
        spent: &mut Duration,
        look: &mut (dyn FnMut(&Simulation) + Send),
    ) -> Outcome {
        let cloth = simulation.model().cloth_particles();
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a whole number of steps"
        )]
        let steps = (self.interval() / simulation.dt()).round().max(1.0) as u64;
        for _ in 0..self.times {
            for _ in 0..steps {
                if self.is_stopped() {
                    return Outcome::Stopped;
                }
                if spent.as_secs_f64() > self.patience {
                    return Outcome::TooSlow;
                }
                let start = Instant::now();
                let step = simulation.step();
                *spent += start.elapsed();
                if let Err(diverged) = step {
                    return Outcome::Diverged(diverged.to_string());
                }
                look(simulation);
            }
            states.push(simulation.state().positions[..cloth].to_vec());
        }
        Outcome::Completed
    }
}

/// Energy that the scheme took by itself, over what was exchanged.
fn drift(simulation: &Simulation) -> f64 {
    let balance = simulation.balance();
    if balance.exchanged > 0.0 {
        balance.dissipated_by(SCHEME) / balance.exchanged
    } else {
        0.0
    }
}
