//! Noticing that a run has lost its sense, and saying why.

use super::survey::Survey;
use super::{Simulation, forecast};
use crate::force::Spring;
use crate::integrator::Integrator;
use crate::model::Model;
use crate::state::State;
use std::fmt;

/// Why a run can't go on.
#[derive(Clone, Debug, PartialEq)]
pub struct Diverged {
    /// The step that failed, from 1.
    pub step: u64,
    /// Simulated time at its end (s).
    pub time: f64,
    /// What was noticed.
    pub sign: Sign,
    /// Name of the cloth, and the particle in it.
    pub particle: (String, usize),
    /// The most strained spring: family, particles in the cloth, strain.
    pub spring: Option<(&'static str, [u32; 2], f64)>,
    /// The step (s).
    pub dt: f64,
    /// Name of the scheme that the limit is of: the run's own, or symplectic Euler for an implicit run.
    pub limited: &'static str,
    /// Its largest stable step at the last good state (s).
    pub stable_dt: f64,
    /// Whether the run's scheme is explicit, so that the limit binds it.
    pub explicit: bool,
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
}

/// A strain that no cloth has: threefold length. Where springs of one cell are that long in the
/// middle of a step, forces are off by orders of magnitude, and strain limiting would hide it.
const SENSELESS_STRAIN: f64 = 2.0;

/// The strain beyond which a run has lost its sense: a scene may start beyond the usual one.
pub(super) fn sensible_strain(model: &Model, state: &State) -> f64 {
    SENSELESS_STRAIN.max(1.5 * model.largest_strain(&state.positions))
}

impl fmt::Display for Diverged {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (cloth, particle) = &self.particle;
        let sign = match self.sign {
            Sign::NotFinite => "is no longer finite",
            Sign::Stretched => "is torn away",
            Sign::Lost => "has left the scene",
        };
        write!(
            f,
            "diverged in step {} at t = {:.6} s: particle {particle} of \"{cloth}\" {sign}",
            self.step, self.time
        )?;
        if let Some((family, [i, j], strain)) = self.spring {
            write!(
                f,
                "; the {family} spring between particles {i} and {j} has strain {strain:.3e}"
            )?;
        }
        write!(
            f,
            "; the step is {:.3e} s, the stable step of {} {:.3e} s",
            self.dt, self.limited, self.stable_dt
        )?;
        if self.explicit && self.stable_dt == 0.0 {
            write!(
                f,
                "; no step is stable: use --integrator symplectic-euler or implicit-euler"
            )
        } else if self.explicit && self.dt > self.stable_dt {
            write!(
                f,
                "; use --dt {:.1e} or less, or --integrator implicit-euler",
                0.9 * self.stable_dt
            )
        } else {
            write!(
                f,
                "; the recording ends with the last good state; use a smaller --dt, or look at the scene: pins that are too far apart, an obstacle's mesh"
            )
        }
    }
}

impl std::error::Error for Diverged {}

impl Simulation {
    /// Looks at the state before limiting, which would hide a senseless strain.
    pub(super) fn check_sense(&mut self, survey: &Survey) -> Result<(), Diverged> {
        if survey.finite && survey.strain() > self.sensible_strain {
            return Err(self.diverged(Sign::Stretched));
        }
        self.check_finite(survey)
    }

    pub(super) fn check_finite(&mut self, survey: &Survey) -> Result<(), Diverged> {
        if !survey.finite {
            Err(self.diverged(Sign::NotFinite))
        } else if !survey.near {
            Err(self.diverged(Sign::Lost))
        } else {
            Ok(())
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

    /// Explains the state and goes back to the last good one.
    fn diverged(&mut self, sign: Sign) -> Diverged {
        let worst = self.most_strained();
        let particle = self
            .state
            .first_non_finite()
            .or(worst.map(|(_, spring, _)| spring.ends[0] as usize))
            .unwrap_or_default();
        let (step, time) = (self.stats.steps, self.state.time);
        self.state.copy_from(&self.before);
        self.stats.steps -= 1;
        self.contacts.list.clear(); // they belong to the failed step
        let place = |particle: usize| self.model.place(particle);
        let (cloth, number) = place(particle);
        let limited = if self.integrator.is_explicit() {
            self.integrator
        } else {
            Integrator::SymplecticEuler
        };
        Diverged {
            step,
            time,
            sign,
            particle: (cloth.to_owned(), number),
            spring: worst.map(|(family, spring, strain)| {
                let local = |end: u32| u32::try_from(place(end as usize).1).unwrap_or(end);
                (family, spring.ends.map(local), strain)
            }),
            dt: self.dt,
            limited: limited.name(),
            stable_dt: forecast(&self.model, &self.state).stable_dt(limited),
            explicit: self.integrator.is_explicit(),
        }
    }
}
