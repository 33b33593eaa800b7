//! One step as named stages, and what is measured on the way.

mod budget;
mod cause;
mod divergence;
mod element;
mod equilibrium;
mod error;
mod stability;
mod stats;
mod step_length;
mod survey;

pub use cause::{Cause, Part};
pub use divergence::{Account, Diverged, Sign};
pub use element::{Element, elements};
pub use equilibrium::{Rest, settle};
pub use error::ErrorEstimate;
pub use stability::{Forecast, Limit, Mode, forecast};
pub use stats::{Stage, StageTimes, Stats};
pub use step_length::{AUTO_SHARE, NoStableStep, step_length, sweep_compliance};

use budget::Budget;

use crate::collision::{Contacts, Detection, Masses, respond};
use crate::energy::{Ledger, PinWork, kinetic, potential};
use crate::force::Force as _;
use crate::integrator::{Integrator, Scheme};
use crate::linear::{Solve, awake};
use crate::model::Model;
use crate::state::State;
use crate::strain_limit::{Limited, Wall};
use glam::DVec3;
use survey::Survey;

/// A model, its state, and the scheme that moves it.
#[derive(Debug)]
pub struct Simulation {
    model: Model,
    state: State,
    /// The state before the current step: where a run that diverges is taken back to.
    before: State,
    integrator: Integrator,
    scheme: Box<dyn Scheme>,
    dt: f64,
    /// Time of the first state (s).
    start: f64,
    contacts: Contacts,
    detection: Detection,
    ledger: Ledger,
    /// The ledger before the current step.
    booked: Ledger,
    /// What measures the work of moving pins; none without them.
    pin_work: Option<PinWork>,
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
    ///
    /// Pins are released and placed as they are at the state's time.
    pub fn new(mut model: Model, mut state: State, integrator: Integrator, dt: f64) -> Self {
        model.begin_step(state.time, state.time + dt);
        model.drive(&mut state);
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
            booked: Ledger::open(&model, &state),
            ledger: Ledger::open(&model, &state),
            pin_work: PinWork::new(&model),
            budget: Budget::open(&model, &state, dt),
            stats: Stats::default(),
            unlimited: vec![DVec3::ZERO; limited],
            walls: vec![Wall::default(); limited],
            integrator,
            dt,
            start: state.time,
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
        awake(|| self.step_awake())
    }

    fn step_awake(&mut self) -> Result<StepStats, Diverged> {
        self.before.copy_from(&self.state);
        self.booked.clone_from(&self.ledger);
        self.release_pins();
        let solve = self.integrate();
        let mut survey = self.survey();
        self.check_finite(&survey, Stage::Integrate)?;
        self.check_solved(solve)?;
        let work = self.work_of_pins();
        self.check_strain(&survey)?;
        self.book_damping_and_pins(work);
        let limited = self.correct();
        if self.model.strain_limit.is_some() || !self.model.obstacles.is_empty() {
            survey = self.survey(); // the state may be another one
            self.check_finite(&survey, Stage::Respond)?;
        }
        let step = StepStats {
            solve,
            limited,
            strain: survey.strain(),
            depth: self.contacts.deepest(),
        };
        self.check_budget(survey.kinetic)?;
        self.book(&step, survey.kinetic);
        Ok(step)
    }

    /// n dt, not a sum of dt: after a million steps a sum is off by 1e-10 s.
    #[expect(clippy::cast_precision_loss, reason = "steps stay far below 2⁵³")]
    fn next_time(&self) -> f64 {
        self.start + (self.stats.steps + 1) as f64 * self.dt
    }

    /// Lets go the pins whose time has come. The energy of clamps that go slack leaves with them.
    fn release_pins(&mut self) {
        let end = self.next_time();
        let Self {
            model,
            state,
            ledger,
            budget,
            ..
        } = self;
        let before = model
            .releases_in(state.time, end)
            .then(|| potential(model, state));
        model.begin_step(state.time, end);
        if let Some(before) = before {
            let added = potential(model, state) - before;
            ledger.book_pins(added);
            budget.grant(added);
        }
    }

    fn integrate(&mut self) -> Solve {
        let end = self.next_time();
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
        state.time = end;
        model.drive(state);
        stats.steps += 1;
        solve
    }

    /// The work (J) that moving pins did in the step, which explains as much energy; 0 without any.
    fn work_of_pins(&mut self) -> f64 {
        let Self {
            model,
            state,
            before,
            pin_work,
            budget,
            stats,
            ..
        } = self;
        let Some(pins) = pin_work else {
            return 0.0;
        };
        let times = &mut stats.times;
        let work = times.time(Stage::Measure, || pins.of_step(model, before, state));
        budget.grant(work);
        work
    }

    /// Books what damping took and what moving pins gave, at the scheme's own velocities: limits and
    /// contact change them after.
    fn book_damping_and_pins(&mut self, work: f64) {
        let Self {
            model,
            state,
            ledger,
            pin_work,
            stats,
            dt,
            ..
        } = self;
        stats.times.time(Stage::Measure, || {
            ledger.book(model, state, *dt);
            if pin_work.is_some() {
                ledger.book_pins(work);
            }
        });
    }

    /// Strain limiting and contact. What they add to motion and height is no fault of the scheme's; what
    /// they take from the springs isn't looked at, which would cost two passes over them.
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

    /// Kinetic and gravitational energy (J).
    fn measure_energy(&mut self) -> f64 {
        let Self {
            model,
            state,
            stats,
            ..
        } = self;
        let times = &mut stats.times;
        times.time(Stage::Measure, || {
            kinetic(model, state) + model.gravity.energy(state)
        })
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

    /// Looks for what is wrong, and measures strain and kinetic energy.
    fn survey(&mut self) -> Survey {
        let Self {
            model,
            state,
            stats,
            ..
        } = self;
        stats
            .times
            .time(Stage::Measure, || Survey::of(model, state))
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
