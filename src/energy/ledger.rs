//! The books of a run's energy.
//!
//! Every stage of a step books what it does, each as far as can be by a measure of its own:
//!
//! - dampings and moving pins by the work of their forces ([`super::DampingWork`], [`super::PinWork`]);
//! - contact and friction inside a scheme's equations by their impulses, J · (x₁ − x₀)/dt against the
//!   obstacle, whose own work is J · w; outside of them, and strain limits, by the kinetic energy of each
//!   change of velocity, and by the potential before and after their changes of position;
//! - the scheme by what the energy changed from a step's start to the end of its integration, less the
//!   others that acted therein. It has no other measure: a part of the integration that nobody measures
//!   is in it, and so are the errors of the works' quadratures. From a linear oscillator implicit Euler
//!   takes ½ Δv · M Δv + ½ Δx · K Δx a step, dampings and contacts beside it or not.
//!
//! The remainder is the true energy of a state against all that. It is what changed a state between the
//! stages or in one, and was not booked, and rounding.
//!
//! Without limits and obstacles only integrations change the state, and the scheme's part is taken over
//! all of them at once: energies then cost nothing in a step. What changed the motion or the height from
//! one step to the next is still seen.

use super::{Energies, Totals};
use crate::force::DAMPINGS;
use crate::model::Model;
use crate::state::{Archive, State};

/// Friction at obstacles.
pub const FRICTION: &str = "friction";
/// The normal part of contact: inelastic impacts, and moving out what is inside.
pub const CONTACT: &str = "contact";
/// Strain limiting.
pub const STRAIN_LIMIT: &str = "strain_limit";
/// Work of pins that move or let go.
const PINS: &str = "pins";
/// Work of obstacles that move.
const OBSTACLES: &str = "obstacles";
/// The scheme's own dissipation; negative where it adds energy.
pub const SCHEME: &str = "scheme";

/// Energy taken out of the motion and put into it since the start.
#[derive(Debug)]
pub struct Ledger {
    /// Total energy at the start (J).
    pub initial: f64,
    /// Work done on the cloths by cause (J): by pins that move or let go, by obstacles that move.
    pub work: Vec<(&'static str, f64)>,
    /// Dissipated energy by cause (J), but for the scheme's.
    dissipated: Vec<(&'static str, f64)>,
    /// What the scheme took (J), where that is booked step by step.
    scheme: Option<f64>,
    /// Energy that came from nowhere between steps (J).
    outside: f64,
    /// The energies that what was booked last led to. Of gravitational and elastic energy only the sum
    /// counts while a step goes on.
    level: Totals,
    /// What has gone from account to account until the accounts stood as in `marks` (J).
    exchanged: f64,
    /// All accounts (J) when they were looked at last.
    marks: Vec<f64>,
    /// The energies then, scratch.
    energies: Energies,
}

/// What acted within an integration (J).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Flows {
    /// Taken by dampings, by [`DAMPINGS`].
    pub dampings: [f64; 2],
    /// Given by moving pins.
    pub pins: f64,
    /// Taken by friction inside the equations.
    pub friction: f64,
    /// Taken by contacts inside the equations, along their normals.
    pub contact: f64,
    /// Given by moving obstacles inside the equations.
    pub obstacles: f64,
}

/// The ledger closed at a state.
#[derive(Clone, Debug, PartialEq)]
pub struct Balance {
    /// The state's energies.
    pub energies: Energies,
    /// Dissipated energy by cause (J).
    pub dissipated: Vec<(&'static str, f64)>,
    /// Work done on the cloths by cause (J).
    pub work: Vec<(&'static str, f64)>,
    /// What the ledger doesn't explain (J): E(0) + work − E(t) − dissipated.
    pub residual: f64,
    /// Energy that went from one account to another (J): half the sum of the changes of all kinds of
    /// energy, dissipations and works, each change taken from one 1/60 s to the next and without its sign.
    pub exchanged: f64,
}

impl Balance {
    /// What a cause has dissipated (J); 0 where there is no such cause.
    pub fn dissipated_by(&self, cause: &str) -> f64 {
        let entry = self.dissipated.iter().find(|(name, _)| *name == cause);
        entry.map_or(0.0, |(_, joules)| *joules)
    }

    /// The part of the energy exchanged that is not explained; 0 where nothing was exchanged.
    pub fn unexplained(&self) -> f64 {
        if self.exchanged > 0.0 {
            self.residual.abs() / self.exchanged
        } else {
            0.0
        }
    }
}

impl Ledger {
    /// Opens the ledger of a run.
    pub fn open(model: &Model, state: &State) -> Self {
        let energies = Energies::of(model, state);
        let mut causes: Vec<&'static str> = Vec::new();
        // Springs of several families are damped under one name.
        for damping in model.dampings() {
            if !causes.contains(&damping.name()) {
                causes.push(damping.name());
            }
        }
        if model.has_contact() {
            causes.extend([FRICTION, CONTACT]);
        }
        if model.strain_limit.is_some() {
            causes.push(STRAIN_LIMIT);
        }
        let pins = (!model.pins.are_still()).then_some(PINS);
        let moves = model.obstacles.iter().any(|body| body.motion.is_some());
        let works = pins.into_iter().chain(moves.then_some(OBSTACLES));
        let mut ledger = Self {
            initial: energies.total(),
            work: works.into_iter().map(|cause| (cause, 0.0)).collect(),
            dissipated: causes.into_iter().map(|cause| (cause, 0.0)).collect(),
            scheme: Self::is_booked_by_stage(model).then_some(0.0),
            outside: 0.0,
            level: Totals {
                kinetic: energies.kinetic,
                gravitational: energies.gravitational,
                elastic: energies.elastic.iter().map(|(_, energy)| energy).sum(),
            },
            exchanged: 0.0,
            marks: Vec::new(),
            energies,
        };
        ledger.marks = ledger.accounts(&ledger.energies).collect();
        ledger
    }

    /// Whether stages besides the integration may change the state: energies are then taken between them.
    pub fn is_booked_by_stage(model: &Model) -> bool {
        model.is_corrected()
    }

    /// Begins a step from a state whose kinetic and gravitational energy are given. The elastic one is that
    /// at which the last step ended.
    pub fn begin(&mut self, now: Totals) {
        let Totals {
            kinetic,
            gravitational,
            ..
        } = self.level;
        self.outside += now.kinetic + now.gravitational - kinetic - gravitational;
        self.level = Totals {
            elastic: self.level.elastic,
            ..now
        };
    }

    /// Books what pins that let go added to the potential (J).
    pub fn release(&mut self, added: f64) {
        self.level.elastic += added;
        self.book_work(PINS, added);
    }

    /// Books an integration that ended with some energies.
    pub fn integrated(&mut self, flows: Flows, now: Totals) {
        for (cause, joules) in DAMPINGS.into_iter().zip(flows.dampings) {
            self.book(cause, joules);
        }
        self.book(FRICTION, flows.friction);
        self.book(CONTACT, flows.contact);
        self.book_work(PINS, flows.pins);
        self.book_work(OBSTACLES, flows.obstacles);
        if let Some(scheme) = &mut self.scheme {
            let others = flows.dampings[0] + flows.dampings[1] + flows.friction + flows.contact;
            *scheme += self.level.total() - now.total() + flows.pins + flows.obstacles - others;
        }
        self.level = now;
    }

    /// Books kinetic energy that a change of velocities took (J).
    pub fn slowed(&mut self, cause: &'static str, taken: f64) {
        self.book(cause, taken);
        self.level.kinetic -= taken;
    }

    /// Books kinetic energy that moving obstacles gave outside the equations (J); driven pins did, where no
    /// obstacle moves.
    pub fn pushed(&mut self, given: f64) {
        let moves = self.work.iter().any(|(name, _)| *name == OBSTACLES);
        self.book_work(if moves { OBSTACLES } else { PINS }, given);
        self.level.kinetic += given;
    }

    /// Books the potential that changes of positions took, given what is left of it (J).
    pub fn displaced(&mut self, cause: &'static str, potential: f64) {
        let elastic = potential - self.level.gravitational;
        self.book(cause, self.level.elastic - elastic);
        self.level.elastic = elastic;
    }

    /// Ends a step with some energies.
    pub fn end(&mut self, now: Totals) {
        self.level = now;
    }

    /// The ledger closed at a state with some energies.
    pub fn balance(&self, energies: Energies) -> Balance {
        let scheme = self.scheme_until(&energies);
        let dissipated = self.dissipated.iter().copied();
        let dissipated: Vec<_> = dissipated.chain([(SCHEME, scheme)]).collect();
        Balance {
            residual: self.initial + sum(&self.work) - energies.total() - sum(&dissipated),
            exchanged: self.exchanged + self.exchanged_since(&energies),
            work: self.work.clone(),
            energies,
            dissipated,
        }
    }

    /// Looks at all accounts, so that what they exchange from here on counts apart.
    pub fn mark(&mut self, model: &Model, state: &State) {
        let mut energies = std::mem::take(&mut self.energies);
        energies.take(model, state);
        self.exchanged += self.exchanged_since(&energies);
        let mut marks = std::mem::take(&mut self.marks);
        marks.clear();
        marks.extend(self.accounts(&energies));
        (self.marks, self.energies) = (marks, energies);
    }

    /// Copies another ledger of the same run without allocating.
    pub fn copy_from(&mut self, other: &Self) {
        let Self {
            initial,
            work,
            dissipated,
            scheme,
            outside,
            level,
            exchanged,
            marks,
            energies: _, // scratch
        } = self;
        *initial = other.initial;
        work.clone_from(&other.work);
        dissipated.clone_from(&other.dissipated);
        *scheme = other.scheme;
        *outside = other.outside;
        *level = other.level;
        *exchanged = other.exchanged;
        marks.clone_from(&other.marks);
    }

    /// Carries all of it over; the causes are the model's.
    pub fn carry(&mut self, archive: &mut Archive) {
        let Self {
            initial,
            work,
            dissipated,
            scheme,
            outside,
            level,
            exchanged,
            marks,
            energies: _, // scratch
        } = self;
        let Totals {
            kinetic,
            gravitational,
            elastic,
        } = level;
        for joules in [initial, outside, exchanged, kinetic, gravitational, elastic] {
            archive.real(joules);
        }
        for accounts in [work, dissipated] {
            archive.each(accounts, |archive, (_, joules)| archive.real(joules));
        }
        archive.option(scheme, Archive::real);
        archive.each(marks, Archive::real);
    }

    fn book(&mut self, cause: &'static str, joules: f64) {
        let entry = self.dissipated.iter_mut().find(|(name, _)| *name == cause);
        if let Some((_, booked)) = entry {
            *booked += joules;
        }
    }

    fn book_work(&mut self, cause: &'static str, joules: f64) {
        let entry = self.work.iter_mut().find(|(name, _)| *name == cause);
        if let Some((_, booked)) = entry {
            *booked += joules;
        }
    }

    /// What the scheme took until a state with some energies (J).
    fn scheme_until(&self, energies: &Energies) -> f64 {
        let whole = || {
            self.initial + self.outside + sum(&self.work) - energies.total() - sum(&self.dissipated)
        };
        self.scheme.unwrap_or_else(whole)
    }

    /// Every kind of energy, every dissipation and every work (J).
    fn accounts<'a>(&'a self, energies: &'a Energies) -> impl Iterator<Item = f64> + 'a {
        let lists = [&energies.elastic, &self.dissipated, &self.work];
        [
            energies.kinetic,
            energies.gravitational,
            self.scheme_until(energies),
        ]
        .into_iter()
        .chain(lists.into_iter().flatten().map(|(_, joules)| *joules))
    }

    fn exchanged_since(&self, energies: &Energies) -> f64 {
        let each = self.accounts(energies).zip(&self.marks);
        each.map(|(now, then)| 0.5 * (now - then).abs()).sum()
    }
}

fn sum(list: &[(&str, f64)]) -> f64 {
    list.iter().map(|(_, joules)| joules).sum()
}
