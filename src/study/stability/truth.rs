//! Where the cloths of a row should be: a run in short steps, refined until it agrees with itself.

use super::Axis;
use crate::integrator::{Integrator, Linear, Nonlinear};
use crate::scene::LoadedScene;
use crate::simulation::Simulation;
use crate::study::track::hermite;
use crate::study::{Distance, StudyError};
use glam::DVec3;

/// The second-order scheme that stiff and soft rows alike can be run with; its solves far more exact
/// than a hundredth of a cloth.
const SCHEME: Integrator = Integrator::Bdf2(Nonlinear {
    residual: 1e-6,
    iterations: 50,
    linear: Linear::to(1e-4),
});

/// Steps of the first run; each further one has twice as many.
const FIRST: u32 = 64;

/// Runs after which what differs too much still is no reference.
const RUNS: u32 = 4;

/// Where the cloths of a row should be.
#[derive(Clone, Debug, Default)]
pub(super) struct Truth {
    /// The cloths' particles at each of the asked times (m); empty where no run came to its end.
    pub(super) states: Vec<Vec<DVec3>>,
    /// Largest distance (m RMS) to the run with twice the step; infinite without two.
    pub(super) error: f64,
}

impl Truth {
    /// The positions at `times` (s), to `goal` (m RMS) if that can be had; gives up when `is_stopped`.
    ///
    /// # Errors
    ///
    /// As [`crate::scene::build`].
    pub(super) fn find(
        (loaded, axis, factor): (&LoadedScene, Axis, f64),
        times: &[f64],
        goal: f64,
        is_stopped: &dyn Fn() -> bool,
    ) -> Result<Self, StudyError> {
        let mut truth = Self {
            states: Vec::new(),
            error: f64::INFINITY,
        };
        let end = times.iter().copied().fold(0.0, f64::max);
        for run in 0..RUNS {
            let dt = end / f64::from(FIRST << run);
            let built = axis.build(loaded, factor)?;
            let simulation = Simulation::new(built.model, built.state, SCHEME, dt);
            let Some(states) = states_at(simulation, times, is_stopped) else {
                continue; // shorter steps may do
            };
            let apart = truth.states.iter().zip(&states);
            let apart = apart.map(|(a, b)| Distance::between(a, b).rms);
            truth.error = apart.reduce(f64::max).unwrap_or(f64::INFINITY);
            truth.states = states;
            if truth.error <= goal {
                break;
            }
        }
        Ok(truth)
    }
}

/// The states at some times of a run, if it gets there.
fn states_at(
    mut simulation: Simulation,
    times: &[f64],
    is_stopped: &dyn Fn() -> bool,
) -> Option<Vec<Vec<DVec3>>> {
    let cloth = simulation.model().cloth_particles();
    let mut states = vec![Vec::new(); times.len()];
    let dt = simulation.dt();
    while states.iter().any(Vec::is_empty) {
        if is_stopped() {
            return None;
        }
        let before = simulation.state().clone();
        simulation.step().ok()?;
        let after = simulation.state();
        for (state, &time) in states.iter_mut().zip(times) {
            // The last time is the end, give or take rounding.
            let share = (time - before.time) / dt;
            if state.is_empty() && share <= 1.0 + 1e-6 {
                let at = |i: usize| {
                    let ends = [&before, after].map(|end| (end.positions[i], end.velocities[i]));
                    hermite(ends, dt, share)
                };
                state.extend((0..cloth).map(at));
            }
        }
    }
    Some(states)
}
