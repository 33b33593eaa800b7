//! One step as named stages, and what is measured on the way.

mod budget;
mod cause;
mod divergence;
mod element;
mod equilibrium;
mod stability;
mod stats;
mod step_length;

pub use cause::{Cause, Part};
pub use divergence::{Account, Diverged, Sign};
pub use element::{Element, elements};
pub use equilibrium::{Rest, settle};
pub use stability::{Forecast, Limit, Mode, forecast};
pub use stats::{Stage, StageTimes, Stats};
pub use step_length::{AUTO_SHARE, NoStableStep, step_length, sweep_compliance};

use budget::Budget;

use crate::collision::{Contacts, Detection, Masses, respond};
use crate::energy::{Ledger, kinetic};
use crate::integrator::{Integrator, Scheme};
use crate::linear::Solve;
use crate::model::Model;
use crate::state::State;
use crate::strain_limit::{Limited, Wall};
use glam::DVec3;

/// A model, its state, and the scheme that moves it.
#[derive(Debug)]
pub struct Simulation {
    model: Model,
    state: State,
    /// The state before the current step: where a run that diverges is taken back to.
    before: State,
    integrator: Integrator,
    scheme: Scheme,
    dt: f64,
    contacts: Contacts,
    detection: Detection,
    ledger: Ledger,
    budget: Budget,
    /// A strain beyond this is no cloth's any more.
    sensible_strain: f64,
    stats: Stats,
    /// Positions before strain limiting (m), scratch; empty without a strain limit.
    unlimited: Vec<DVec3>,
    /// What strain limiting must not pull particles into, scratch; empty without a strain limit.
    walls: Vec<Wall>,
}

/// What a step did.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StepStats {
    /// The linear solve.
    pub solve: Solve,
    /// Strain limiting.
    pub limited: Limited,
    /// Largest strain of structural and shear springs at the end.
    pub strain: f64,
    /// Deepest particle below an obstacle's surface at the end (m).
    pub depth: f64,
}

/// Rounds of strain limiting and contact in a step: each undoes a little of the other. Steps of
/// `drape` need one or two.
const MAX_ROUNDS: u32 = 12;

impl Simulation {
    /// A simulation at its first state. `dt` is the step (s).
    pub fn new(model: Model, state: State, integrator: Integrator, dt: f64) -> Self {
        let particles = model.particles();
        let limited = if model.strain_limit.is_some() {
            particles
        } else {
            0
        };
        Self {
            before: state.clone(),
            scheme: integrator.scheme(&model),
            contacts: Contacts::none(particles),
            detection: Detection::new(&model.obstacles, model.cloth_particles()),
            sensible_strain: divergence::sensible_strain(&model, &state),
            ledger: Ledger::open(&model, &state),
            budget: Budget::open(&model, &state, dt),
            stats: Stats::default(),
            unlimited: vec![DVec3::ZERO; limited],
            walls: vec![Wall::default(); limited],
            integrator,
            dt,
            model,
            state,
        }
    }

    /// Does one step.
    ///
    /// # Errors
    ///
    /// When the state is no longer finite, stretched beyond sense, or has energy that no work explains.
    /// The state is then the last good one.
    pub fn step(&mut self) -> Result<StepStats, Diverged> {
        self.before.copy_from(&self.state);
        let solve = self.integrate();
        self.check_sense()?;
        self.book_damping();
        let limited = self.correct();
        let strain = self.measure_strain();
        let step = StepStats {
            solve,
            limited,
            strain,
            depth: self.contacts.deepest(),
        };
        self.check_finite()?;
        let kinetic = self.measure_kinetic();
        self.check_budget(kinetic)?;
        self.book(&step, kinetic);
        Ok(step)
    }

    fn integrate(&mut self) -> Solve {
        let Self {
            scheme,
            model,
            contacts,
            dt,
            state,
            stats,
            ..
        } = self;
        let solve = stats.times.time(Stage::Integrate, || {
            scheme.advance(model, contacts, *dt, state)
        });
        let steps = stats.steps + 1;
        // n dt, not a sum of dt: after a million steps a sum is off by 1e-10 s.
        #[expect(clippy::cast_precision_loss, reason = "steps stay far below 2⁵³")]
        let time = steps as f64 * *dt;
        state.time = time;
        stats.steps = steps;
        solve
    }

    /// Books what damping took, at the scheme's own velocities: limits and contact change them after.
    fn book_damping(&mut self) {
        let Self {
            model,
            state,
            ledger,
            stats,
            dt,
            ..
        } = self;
        stats
            .times
            .time(Stage::Measure, || ledger.book(model, state, *dt));
    }

    /// Strain limiting and contact. What they add to the energy is no fault of the scheme's.
    fn correct(&mut self) -> Limited {
        if self.model.strain_limit.is_none() && self.model.obstacles.is_empty() {
            return Limited::default();
        }
        let before = self.measure_energy();
        let limited = self.limit_strain_and_contact();
        let added = self.measure_energy() - before;
        self.budget.grant(added);
        limited
    }

    /// Kinetic, gravitational and elastic energy (J).
    fn measure_energy(&mut self) -> f64 {
        let Self {
            model,
            state,
            stats,
            ..
        } = self;
        let times = &mut stats.times;
        times.time(Stage::Measure, || budget::total(model, state))
    }

    /// Repeats strain limiting and contact until nothing is inside a body any more.
    fn limit_strain_and_contact(&mut self) -> Limited {
        let mut all = Limited::default();
        for round in 0..MAX_ROUNDS {
            let first = round == 0;
            let limited = self.limit_strain(first);
            let before = if first { limited.before } else { all.before };
            all = Limited {
                passes: all.passes + limited.passes,
                before,
                after: limited.after,
            };
            self.detect_contacts();
            // What is only too close is moved once; the next round brings its springs in order.
            if self.respond(first) == 0 && !(first && self.model.strain_limit.is_some()) {
                return all;
            }
        }
        // Strain and contact contradict each other: contact has the last word, strain is reported.
        self.detect_contacts();
        self.respond(false);
        self.detect_contacts();
        all
    }

    /// Shortens what is stretched too far. The way moved becomes velocity, if asked for: what follows
    /// a contact's correction, which has no velocity either, must not throw the cloth.
    fn limit_strain(&mut self, with_velocity: bool) -> Limited {
        let Self {
            model,
            state,
            unlimited,
            walls,
            contacts,
            dt,
            stats,
            ..
        } = self;
        let Some(limit) = &model.strain_limit else {
            return Limited::default();
        };
        stats.times.time(Stage::LimitStrain, || {
            unlimited.copy_from_slice(&state.positions);
            walls.fill(Wall::default());
            for contact in &contacts.list {
                walls[contact.particle] = contact.wall();
            }
            let limited = limit.apply(&mut state.positions, &model.inverse_masses, walls);
            if limited.passes > 0 && with_velocity {
                for i in 0..unlimited.len() {
                    state.velocities[i] += (state.positions[i] - unlimited[i]) / *dt;
                }
            }
            limited
        })
    }

    fn detect_contacts(&mut self) {
        let Self {
            model,
            state,
            contacts,
            detection,
            stats,
            ..
        } = self;
        if !model.obstacles.is_empty() {
            stats.times.time(Stage::DetectContacts, || {
                let cloth = &state.positions[..model.cloth_particles()];
                detection.find(&model.obstacles, cloth, contacts);
            });
        }
    }

    fn respond(&mut self, spread: bool) -> usize {
        let Self {
            model,
            state,
            contacts,
            stats,
            ..
        } = self;
        let masses = Masses {
            masses: &model.masses,
            inverse: &model.inverse_masses,
        };
        stats
            .times
            .time(Stage::Respond, || respond(contacts, masses, spread, state))
    }

    /// Largest strain of the springs that stand for the weave; 0 without springs.
    fn measure_strain(&mut self) -> f64 {
        let Self {
            model,
            state,
            stats,
            ..
        } = self;
        stats
            .times
            .time(Stage::Measure, || model.largest_strain(&state.positions))
    }

    fn measure_kinetic(&mut self) -> f64 {
        let Self {
            model,
            state,
            stats,
            ..
        } = self;
        stats.times.time(Stage::Measure, || kinetic(model, state))
    }

    fn book(&mut self, step: &StepStats, kinetic: f64) {
        let stats = &mut self.stats;
        stats.kinetic_peak = stats.kinetic_peak.max(kinetic);
        stats.strain = step.strain;
        stats.strain_ever = stats.strain_ever.max(step.strain);
        stats.depth = step.depth;
        stats.depth_ever = stats.depth_ever.max(step.depth);
        stats.solve = step.solve;
        stats.iterations += u64::from(step.solve.iterations);
        stats.unsolved += u64::from(!step.solve.converged);
        stats.limit_passes += u64::from(step.limited.passes);
    }

    /// What is fixed.
    pub fn model(&self) -> &Model {
        &self.model
    }

    /// What moves.
    pub fn state(&self) -> &State {
        &self.state
    }

    /// The contacts of the state.
    pub fn contacts(&self) -> &Contacts {
        &self.contacts
    }

    /// The energy ledger.
    pub fn ledger(&self) -> &Ledger {
        &self.ledger
    }

    /// Sums and extremes since the start.
    pub fn stats(&self) -> &Stats {
        &self.stats
    }

    /// The scheme.
    pub fn integrator(&self) -> Integrator {
        self.integrator
    }

    /// The step (s).
    pub fn dt(&self) -> f64 {
        self.dt
    }
}
