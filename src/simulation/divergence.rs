//! Noticing that a run has lost its sense, and saying why.

use super::budget::{self, STEPS};
use super::cause::{Cause, Part};
use super::survey::Survey;
use super::{Simulation, Stage, forecast};
use crate::energy::{Ledger, Totals};
use crate::force::Spring;
use crate::integrator::Integrator;
use crate::linear::Solve;
use crate::model::Model;
use crate::state::State;
use crate::strain_limit::Held;
use std::fmt;

/// Why a run can't go on.
#[derive(Clone, Debug, PartialEq)]
pub struct Diverged {
    /// The step that failed, from 1.
    pub step: u64,
    /// Simulated time at its end (s).
    pub time: f64,
    /// The stage that failed.
    pub stage: Stage,
    /// What was noticed.
    pub sign: Sign,
    /// The step (s).
    pub dt: f64,
    /// Largest stable step at the last good state (s), of the scheme that [`Account::limited`] names.
    pub stable_dt: f64,
    /// The rest of what is known.
    pub account: Box<Account>,
}

/// What is known of a divergence besides when and how it showed.
#[derive(Clone, Debug, PartialEq)]
pub struct Account {
    /// Name of the cloth, and the particle in it where it showed.
    pub particle: (String, usize),
    /// The most strained spring of the weave, with its strain in the failed step.
    pub spring: Option<Part>,
    /// Name of the run's scheme.
    pub scheme: &'static str,
    /// Whether that is explicit, so that the limit binds it.
    pub explicit: bool,
    /// Name of the scheme that the limit is of: the run's own, or symplectic Euler for a run that isn't
    /// explicit.
    pub limited: &'static str,
    /// The element that sets the limit.
    pub limiting: Option<Part>,
    /// What is behind it.
    pub cause: Cause,
    /// Time of the last good state (s), with which the recording ends.
    pub last_good: f64,
}

/// What gave a divergence away.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Sign {
    /// A position or velocity is not a number or infinite.
    NotFinite,
    /// A spring is stretched beyond sense.
    Stretched,
    /// A particle is more than a thousand kilometres away from the origin.
    Lost,
    /// Kinetic and elastic energy have grown to this many times what work explains.
    Grown(f64),
    /// The scheme that chooses its own steps found none that goes on.
    Unsolved,
}

impl Sign {
    /// Its name in reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::NotFinite => "not_finite",
            Self::Stretched => "stretched",
            Self::Lost => "lost",
            Self::Grown(_) => "energy",
            Self::Unsolved => "unsolved",
        }
    }
}

/// A strain that no cloth has: threefold length. Where springs of one cell are that long in the
/// middle of a step, forces are off by orders of magnitude, and strain limiting would hide it.
const SENSELESS_STRAIN: f64 = 2.0;

/// Share of the limit that is suggested.
const SAFE_SHARE: f64 = 0.9;

/// The strain beyond which a run has lost its sense: a scene may start beyond the usual one.
pub(super) fn sensible_strain(model: &Model, state: &State) -> f64 {
    SENSELESS_STRAIN.max(1.5 * model.largest_strain(&state.positions))
}

impl Diverged {
    /// A step that would have been stable (s).
    pub fn suggested_dt(&self) -> Option<f64> {
        let bound = self.account.explicit && self.stable_dt > 0.0 && self.dt > self.stable_dt;
        bound.then_some(SAFE_SHARE * self.stable_dt)
    }

    /// What can be done.
    pub fn remedy(&self) -> String {
        let Account {
            explicit, cause, ..
        } = self.account.as_ref();
        if *explicit && self.stable_dt == 0.0 {
            return "no step is stable: use --integrator symplectic-euler or implicit-euler"
                .to_owned();
        }
        if self.account.scheme == "dopri5" {
            return "use --integrator implicit-euler, or another solver.tolerance: a smaller one where cloth is torn, a larger one where steps are too short"
                .to_owned();
        }
        match self.suggested_dt() {
            // The limit of explicit Euler isn't that of ω alone.
            Some(dt) if self.account.scheme == "euler" => {
                format!("use --dt {dt:.1e} or less, or --integrator symplectic-euler or implicit-euler")
            }
            Some(dt) => format!(
                "use --dt {dt:.1e} or less, or --integrator implicit-euler{}",
                cause.material_remedy()
            ),
            None => "the recording ends with the last good state; use a smaller --dt, or look at the scene: pins that are too far apart, an obstacle's mesh".to_owned(),
        }
    }
}

impl fmt::Display for Diverged {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (cloth, particle) = &self.account.particle;
        write!(
            f,
            "diverged in step {} at t = {:.6} s: particle {particle} of \"{cloth}\" ",
            self.step, self.time
        )?;
        match self.sign {
            Sign::NotFinite => write!(f, "is no longer finite")?,
            Sign::Stretched => write!(f, "is torn away")?,
            Sign::Lost => write!(f, "has left the scene")?,
            Sign::Grown(times) => write!(
                f,
                "is fastest, and the cloths have {times:.1e} times the energy that work explains"
            )?,
            Sign::Unsolved => write!(f, "is fastest, and no step is short enough")?,
        }
        if self.stage != Stage::Integrate {
            write!(f, " after {}", self.stage.name())?;
        }
        if let Some(spring) = &self.account.spring {
            let strain = spring.strain.unwrap_or(f64::NAN);
            write!(f, "; {spring} has strain {strain:.3e}")?;
        }
        write!(
            f,
            "; the step is {:.3e} s, the stable step of {} {:.3e} s",
            self.dt, self.account.limited, self.stable_dt
        )?;
        if let Some(part) = &self.account.limiting {
            write!(f, ", set by {part}")?;
        }
        if let Some(why) = self.account.cause.words() {
            write!(f, "; {why}")?;
        }
        write!(f, "; {}", self.remedy())
    }
}

impl std::error::Error for Diverged {}

impl Simulation {
    /// Looks for what isn't a number, or is far away, after a stage.
    pub(super) fn check_finite(&mut self, survey: &Survey, stage: Stage) -> Result<(), Diverged> {
        let sign = match (survey.finite, survey.near) {
            (true, true) => return Ok(()),
            (true, false) => Sign::Lost,
            (false, _) => Sign::NotFinite,
        };
        let stage = if stage == Stage::Respond {
            self.correcting_stage()
        } else {
            stage
        };
        Err(self.diverged(sign, stage))
    }

    /// A scheme that chooses its own steps must have come to the end of this one.
    pub(super) fn check_solved(&mut self, solve: Solve) -> Result<(), Diverged> {
        let chooses = matches!(self.integrator, Integrator::Dopri5 { .. });
        if chooses && !solve.converged {
            return Err(self.diverged(Sign::Unsolved, Stage::Integrate));
        }
        Ok(())
    }

    /// Looks at strains before limiting, which would hide a senseless one. It counts when energy comes with
    /// it that nothing explains: cloth may be that soft.
    pub(super) fn check_strain(&mut self, survey: &Survey) -> Result<(), Diverged> {
        if survey.strain() > self.sensible_strain
            && self.energy(survey) > self.budget.explained(survey.energy.gravitational)
        {
            return Err(self.diverged(Sign::Stretched, Stage::Integrate));
        }
        Ok(())
    }

    /// Looks for energy that no work explains: every eighth step, and at once when motion alone has more
    /// than it may.
    pub(super) fn check_budget(&mut self, survey: &Survey) -> Result<(), Diverged> {
        let Totals {
            kinetic,
            gravitational,
            ..
        } = survey.energy;
        if !self.stats.steps.is_multiple_of(STEPS) && kinetic <= self.budget.bound {
            return Ok(());
        }
        let has = self.energy(survey);
        if has <= self.budget.take_bound(gravitational) {
            return Ok(());
        }
        // Near the limit of an explicit scheme the energy may swing by more.
        let stable = forecast(&self.model, &self.before).stable_dt(self.integrator);
        let factor = self.budget.factor.max(budget::swing(self.dt / stable));
        let allowed = self.budget.bound / self.budget.factor;
        self.budget.factor = factor;
        if has <= self.budget.take_bound(gravitational) {
            return Ok(());
        }
        Err(self.diverged(Sign::Grown(has / allowed), Stage::Integrate))
    }

    /// The energy that work has to explain (J): kinetic, and elastic where the scheme's springs have it.
    fn energy(&self, survey: &Survey) -> f64 {
        let Totals {
            kinetic, elastic, ..
        } = survey.energy;
        if !self.integrator.has_elastic_energy() {
            kinetic
        } else if Ledger::is_booked_by_stage(&self.model) {
            kinetic + elastic
        } else {
            kinetic + budget::elastic(&self.model, &self.state)
        }
    }

    /// Which of strain limiting and contact spoiled a state that was sound before both.
    fn correcting_stage(&mut self) -> Stage {
        let Self {
            model,
            unlimited,
            walls,
            holds,
            ..
        } = self;
        let sound = |positions: &[glam::DVec3]| positions.iter().all(|x| x.is_finite());
        match &model.strain_limit {
            Some(limit) if !model.obstacles.is_empty() => {
                // The last limiting again, from what it began with.
                let began_sound = sound(unlimited);
                let held = Held {
                    inverse_masses: &model.inverse_masses,
                    walls,
                    holds,
                };
                limit.apply(unlimited, held);
                if began_sound && !sound(unlimited) {
                    Stage::LimitStrain
                } else {
                    Stage::Respond
                }
            }
            Some(_) => Stage::LimitStrain,
            None => Stage::Respond,
        }
    }

    /// Family, spring and strain of the most strained spring of the weave; NaN counts as most.
    fn most_strained(&self) -> Option<(&'static str, Spring, f64)> {
        let springs = self
            .model
            .weave()
            .flat_map(|batch| batch.springs.iter().map(|spring| (batch.family, *spring)));
        springs
            .map(|(family, spring)| (family, spring, spring.strain(&self.state.positions)))
            .max_by(|a, b| a.2.abs().total_cmp(&b.2.abs()))
    }

    /// The particle where a divergence shows.
    fn conspicuous(&self, sign: Sign, worst: Option<Spring>) -> usize {
        let energy = |i: &usize| self.model.masses[*i] * self.state.velocities[*i].length_squared();
        let distance = |i: &usize| self.state.positions[*i].length_squared();
        let largest = |of: &dyn Fn(&usize) -> f64| {
            (0..self.model.cloth_particles()).max_by(|a, b| of(a).total_cmp(&of(b)))
        };
        let found = match sign {
            Sign::NotFinite => self.state.first_non_finite(),
            Sign::Lost => largest(&distance),
            Sign::Grown(_) | Sign::Unsolved => largest(&energy),
            Sign::Stretched => worst.and_then(|spring| {
                let ends = spring.ends.into_iter().map(|end| end as usize);
                let speed = |i: &usize| self.state.velocities[*i].length_squared();
                ends.max_by(|a, b| speed(a).total_cmp(&speed(b)))
            }),
        };
        found.unwrap_or_default()
    }

    /// Explains the state and goes back to the last good one.
    fn diverged(&mut self, sign: Sign, stage: Stage) -> Diverged {
        let worst = self.most_strained();
        let particle = self.conspicuous(sign, worst.map(|(_, spring, _)| spring));
        let (step, time) = (self.stats.steps, self.state.time);
        self.state.copy_from(&self.before);
        self.ledger.copy_from(&self.booked);
        self.stats.steps -= 1;
        self.contacts.list.clear(); // they belong to the failed step
        let place = |particle: usize| self.model.place(particle);
        let (cloth, number) = place(particle);
        let (explicit, scheme) = (self.integrator.is_explicit(), self.integrator);
        let limited = if explicit {
            scheme
        } else {
            Integrator::SymplecticEuler
        };
        let limit = forecast(&self.model, &self.state).limit(limited);
        let too_long = explicit && self.dt > limit.dt;
        let cause = if too_long {
            Cause::find(&self.model, &self.state, limit, self.dt)
        } else {
            Cause::Unknown
        };
        let limiting = limit.element;
        let account = Account {
            particle: (cloth.to_owned(), number),
            spring: worst.map(|(law, spring, strain)| Part {
                law,
                cloth: place(spring.ends[0] as usize).0.to_owned(),
                particles: spring.ends.map(|end| place(end as usize).1).to_vec(),
                strain: Some(strain),
            }),
            scheme: scheme.name(),
            explicit,
            limited: limited.name(),
            limiting: limiting.map(|e| Part::of(&e, &self.model, &self.state)),
            cause,
            last_good: self.state.time,
        };
        Diverged {
            step,
            time,
            stage,
            sign,
            dt: self.dt,
            stable_dt: limit.dt,
            account: Box::new(account),
        }
    }
}
