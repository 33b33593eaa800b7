//! One step as named stages, and what is measured on the way.

mod budget;
mod carry;
mod cause;
mod correct;
mod divergence;
mod element;
mod equilibrium;
mod error;
mod impacts;
mod memory;
mod stability;
mod stats;
mod step_length;
mod survey;
mod tangle;
mod tunnelling;

pub use cause::{Cause, Part};
pub use divergence::{Account, Diverged, Sign};
pub use element::{Element, elements};
pub use equilibrium::{Rest, settle};
pub use error::ErrorEstimate;
pub use stability::{Forecast, Limit, Mode, forecast};
pub use stats::{ImpactStats, Stage, StageTimes, Stats};
pub use step_length::{AUTO_SHARE, NoStableStep, step_length, sweep_compliance};
pub use tangle::TangledStart;
pub(crate) use tangle::audit_of;
pub use tunnelling::{Tunnelling, tunnelling};

use budget::{Budget, STEPS};

use crate::collision::impact::Impacts;
use crate::collision::{Bodies, Contacts, Detection, Tangles};
use crate::energy::{Balance, DampingWork, Energies, Flows, Ledger, PinWork, potential};
use crate::integrator::{Integrator, Scheme};
use crate::linear::{Solve, awake};
use crate::model::Model;
use crate::state::State;
use crate::strain_limit::{Hold, Limited, Wall};
use glam::DVec3;
use survey::{Survey, View, moving};

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
    bodies: Bodies,
    detection: Detection,
    /// What keeps edges and triangles apart; none where nobody asks.
    impacts: Option<Impacts>,
    /// Cloth that started inside something or across it, until it is free.
    tangles: Option<Tangles>,
    /// How that went.
    tangled: TangledStart,
    ledger: Ledger,
    /// The ledger before the current step.
    booked: Ledger,
    /// What measures the work of dampings; none without them.
    damping_work: Option<DampingWork>,
    /// What measures the work of moving pins; none without them.
    pin_work: Option<PinWork>,
    /// Who has moved particles since the ledger's potential was taken.
    mover: Option<&'static str>,
    budget: Budget,
    /// The model as it is looked at after each step.
    view: View,
    /// A strain beyond this is no cloth's any more.
    sensible_strain: f64,
    stats: Stats,
    /// Positions before strain limiting (m), scratch; empty without a strain limit.
    unlimited: Vec<DVec3>,
    /// What strain limiting must not pull particles into, scratch; empty without a strain limit or
    /// without obstacles.
    walls: Vec<Wall>,
    /// What it must not pull together either: what impacts have parted in the step, before them in the last one.
    holds: Vec<Hold>,
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

/// Time (s) from which the ledger's accounts are compared with how they stood before: a frame.
const LOOK: f64 = 1.0 / 60.0;

impl Simulation {
    /// A simulation at its first state. `dt` is the step (s).
    ///
    /// Pins are released and placed as they are at the state's time.
    pub fn new(mut model: Model, mut state: State, integrator: Integrator, dt: f64) -> Self {
        model.begin_step(state.time, state.time + dt);
        model.drive(&mut state);
        let count = |asked: bool| if asked { model.particles() } else { 0 };
        let limited = count(model.strain_limit.is_some());
        let walled = count(model.strain_limit.is_some() && !model.obstacles.is_empty());
        let mut run = Self {
            before: state.clone(),
            scheme: integrator.scheme(&model),
            contacts: model.no_contacts(),
            bodies: Bodies::new(&model.obstacles, state.time),
            detection: Detection::new(&model.obstacles, model.cloth_particles()),
            impacts: impacts::of(&model, &state),
            tangles: None,
            tangled: TangledStart::default(),
            sensible_strain: divergence::sensible_strain(&model, &state),
            booked: Ledger::open(&model, &state),
            ledger: Ledger::open(&model, &state),
            damping_work: DampingWork::new(&model, integrator.damped_at()),
            pin_work: PinWork::new(&model),
            mover: None,
            budget: Budget::open(&model, &state, dt),
            view: View::of(&model),
            stats: Stats::default(),
            unlimited: vec![DVec3::ZERO; limited],
            walls: vec![Wall::default(); walled],
            holds: Vec::new(),
            integrator,
            dt,
            start: state.time,
            model,
            state,
        };
        run.look_for_tangles();
        run
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
        self.begin_ledger();
        self.release_pins();
        self.move_obstacles();
        let (solve, flows) = self.integrate();
        let mut survey = self.survey();
        self.check_finite(&survey, Stage::Integrate)?;
        self.check_solved(solve)?;
        self.budget.grant(flows.pins + flows.obstacles);
        self.check_strain(&survey)?;
        self.ledger.integrated(flows, survey.energy);
        let limited = self.correct(&mut survey)?;
        self.free_tangles();
        let step = StepStats {
            solve,
            limited,
            strain: survey.strain(),
            depth: self.contacts.deepest(),
        };
        self.check_budget(&survey)?;
        self.book(&step, survey.energy.kinetic);
        self.end_ledger(&survey);
        Ok(step)
    }

    /// Keeps the state and the ledger as they are before the step.
    fn begin_ledger(&mut self) {
        let Self {
            model,
            state,
            ledger,
            booked,
            mover,
            stats,
            ..
        } = self;
        let looks = Ledger::is_booked_by_stage(model) || stats.steps.is_multiple_of(STEPS);
        stats.times.time(Stage::Measure, || {
            booked.copy_from(ledger);
            // Nothing but a step changes a state: a look now and then is enough to see that, and one in each
            // step is 5 % of an explicit one.
            if looks {
                ledger.begin(moving(model, state));
            }
        });
        *mover = None;
    }

    /// Ends the step in the ledger, and looks at its accounts where a frame's time is over.
    fn end_ledger(&mut self, survey: &Survey) {
        self.ledger.end(survey.energy);
        let frame = |time: f64| ((time - self.start) / LOOK + 1e-6).floor();
        if frame(self.state.time) > frame(self.before.time) {
            let Self {
                model,
                state,
                ledger,
                stats,
                ..
            } = self;
            let times = &mut stats.times;
            times.time(Stage::Measure, || ledger.mark(model, state));
        }
    }

    fn next_time(&self) -> f64 {
        self.time_after(self.stats.steps + 1)
    }

    /// n dt, not a sum of dt: after a million steps a sum is off by 1e-10 s.
    #[expect(clippy::cast_precision_loss, reason = "steps stay far below 2⁵³")]
    fn time_after(&self, steps: u64) -> f64 {
        self.start + steps as f64 * self.dt
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
            ledger.release(added);
            budget.grant(added);
        }
    }

    /// Moves the obstacles to where they are at the step's end; contacts learn how fast they go.
    fn move_obstacles(&mut self) {
        let end = self.next_time();
        self.bodies.begin_step(&self.model.obstacles, end);
        self.contacts.begin_step(&self.bodies, self.dt);
    }

    /// Advances the state by the scheme, and measures what acted within: over the whole step, or over each
    /// of those that the scheme takes on its own.
    fn integrate(&mut self) -> (Solve, Flows) {
        let end = self.next_time();
        let Self {
            scheme,
            model,
            contacts,
            dt,
            before,
            state,
            damping_work,
            pin_work,
            stats,
            ..
        } = self;
        let mut seen: Option<Flows> = None;
        let mut see = |seen: &mut Option<Flows>, dt: f64, from: &State, to: &State| {
            let flows = seen.get_or_insert_default();
            if let Some(work) = damping_work {
                let taken = work.of_step(model, dt, from, to);
                flows.dampings = [0, 1].map(|kind| flows.dampings[kind] + taken[kind]);
            }
            if let Some(work) = pin_work {
                flows.pins += work.of_step(model, from, to);
            }
        };
        std::mem::swap(before, state);
        let solve = stats.times.time(Stage::Integrate, || {
            let show =
                &mut |from: &State, to: &State| see(&mut seen, to.time - from.time, from, to);
            scheme.advance_showing(model, contacts, *dt, before, state, show)
        });
        state.time = end;
        model.drive(state);
        stats.steps += 1;
        stats.timed += 1;
        let flows = stats.times.time(Stage::Measure, || {
            if seen.is_none() {
                see(&mut seen, *dt, before, state);
            }
            let mut flows = seen.unwrap_or_default();
            for contact in &contacts.list {
                let i = contact.particle;
                let mean = contact.against((state.positions[i] - before.positions[i]) / *dt);
                flows.obstacles += contact.impulse.dot(contact.velocity);
                let along = contact.normal.dot(contact.impulse) * contact.normal.dot(mean);
                flows.contact -= along;
                flows.friction -= contact.impulse.dot(mean) - along;
            }
            flows
        });
        (solve, flows)
    }

    /// Looks for what is wrong, and measures strain and energies: the elastic one where stages besides
    /// the integration need it, too.
    fn survey(&mut self) -> Survey {
        let with_elastic = Ledger::is_booked_by_stage(&self.model);
        let Self {
            model,
            state,
            stats,
            view,
            ..
        } = self;
        stats.times.time(Stage::Measure, || {
            Survey::of(model, view, state, with_elastic)
        })
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
        stats.damped += u64::from(step.solve.damped);
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

    /// The obstacles as they stand.
    pub fn bodies(&self) -> &Bodies {
        &self.bodies
    }

    /// The energy ledger.
    pub fn ledger(&self) -> &Ledger {
        &self.ledger
    }

    /// The energies of the state and where those of the run went.
    pub fn balance(&self) -> Balance {
        self.ledger.balance(Energies::of(&self.model, &self.state))
    }

    /// Sums and extremes since the start.
    pub fn stats(&self) -> &Stats {
        &self.stats
    }

    /// The scheme.
    pub fn integrator(&self) -> Integrator {
        self.integrator
    }

    /// Time of the first state (s).
    pub fn start(&self) -> f64 {
        self.start
    }

    /// The step (s).
    pub fn dt(&self) -> f64 {
        self.dt
    }
}
