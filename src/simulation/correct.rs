//! Strain limiting and contact: what is set right after the scheme's own step.

use super::survey::Survey;
use super::{Diverged, Simulation, Stage};
use crate::collision::{Response, respond};
use crate::energy::{CONTACT, FRICTION, Ledger, STRAIN_LIMIT, potential_at};
use crate::model::Model;
use crate::strain_limit::{Held, Hold, Limited, Wall};
use glam::DVec3;

/// Rounds of strain limiting and contact in a step: each undoes a little of the other. Steps of
/// `drape` need one or two.
const MAX_ROUNDS: u32 = 12;

/// Rounds of these and of keeping edges and triangles apart.
const MAX_IMPACT_ROUNDS: u32 = 6;

/// Those in which impacts are parted without a look at what then meets, since springs are to be shortened afterwards:
/// most steps of a rope of folds need four. With 1 contact in its last turn (`twist`) takes 1.25 times as long.
const HASTY_ROUNDS: u32 = 3;

impl Simulation {
    /// Strain limiting and contact, after which `survey` is the state's again. What they add to the energy
    /// is no fault of the scheme's.
    pub(super) fn correct(&mut self, survey: &mut Survey) -> Result<Limited, Diverged> {
        if !Ledger::is_booked_by_stage(&self.model) {
            return Ok(Limited::default());
        }
        let parted = self.part_tangles();
        let (limited, touched) = self.hold_apart();
        let calmed = self.calm_tangles();
        let touched = touched || parted || calmed;
        if touched {
            let before = survey.energy;
            *survey = self.survey();
            self.check_finite(survey, Stage::Respond)?;
            let now = survey.energy;
            if let Some(cause) = self.mover.take() {
                self.ledger
                    .displaced(cause, now.gravitational + now.elastic);
            }
            let elastic = if self.integrator.has_elastic_energy() {
                now.elastic - before.elastic
            } else {
                0.0
            };
            let rest = now.kinetic + now.gravitational - before.kinetic - before.gravitational;
            self.budget.grant(rest + elastic);
        }
        Ok(limited)
    }

    /// Strain limiting and contact of particles, then of whole edges and triangles, until neither undoes the
    /// other; the last word is that of contact. Also says whether anything was changed.
    ///
    /// Springs are shortened with what impacts have parted kept apart, at first with what they parted in the last
    /// step: layers that are pulled into each other by millimetres are to be found anew. A rope of folds (`twist`)
    /// takes 0.9 rounds of impacts for 1.7 without. Springs that don't get short enough are tried again with nothing
    /// kept apart: in the last turn of `twist` 4 of 750 steps of 4 ms ended with 26 to 39 % instead of 20 %.
    fn hold_apart(&mut self) -> (Limited, bool) {
        // Obstacles have gone on since.
        self.holds.retain(Hold::is_between_particles);
        let mut held = !self.holds.is_empty();
        let (mut limited, mut touched) = self.limit_strain_and_contact(true);
        self.holds.clear();
        let mut settle = self.model.strain_limit.is_none();
        for round in 1..MAX_IMPACT_ROUNDS {
            settle |= round > HASTY_ROUNDS;
            let met = self.resolve_impacts(settle);
            touched |= met;
            let Some(limit) = &self.model.strain_limit else {
                return (limited, touched);
            };
            if !met && !held {
                return (limited, touched);
            }
            if !limit.is_exceeded(&self.state.positions) {
                if settle || !met {
                    return (limited, touched);
                }
                settle = true;
                continue;
            }
            match &self.impacts {
                Some(impacts) if met => impacts.holds(&mut self.holds),
                _ => self.holds.clear(), // what was kept apart was in the way
            }
            held = !self.holds.is_empty();
            let (again, _) = self.limit_strain_and_contact(false);
            limited.passes += again.passes;
            limited.after = again.after;
        }
        self.resolve_impacts(true);
        (limited, true)
    }

    /// Repeats strain limiting and contact until nothing is inside a body any more. Also says whether
    /// anything was changed.
    fn limit_strain_and_contact(&mut self, begins: bool) -> (Limited, bool) {
        let (mut all, mut touched) = (Limited::default(), false);
        for round in 0..MAX_ROUNDS {
            let first = begins && round == 0;
            let limited = self.limit_strain(first);
            let before = if round == 0 {
                limited.before
            } else {
                all.before
            };
            all = Limited {
                passes: all.passes + limited.passes,
                before,
                after: limited.after,
            };
            if self.model.obstacles.is_empty() {
                return (all, limited.passes > 0);
            }
            self.detect_contacts();
            // What is only too close is moved once; the next round brings its springs in order.
            let response = self.respond(first);
            touched |= limited.passes > 0 || response.moved;
            if response.stopped == 0 && !(first && self.model.strain_limit.is_some()) {
                return (all, touched);
            }
        }
        // Strain and contact contradict each other: contact has the last word, strain is reported.
        self.detect_contacts();
        self.respond(false);
        self.detect_contacts();
        (all, true)
    }

    /// Shortens what is stretched too far. The way moved becomes velocity, if asked for: what follows
    /// a contact's correction, which has no velocity either, must not throw the cloth.
    fn limit_strain(&mut self, with_velocity: bool) -> Limited {
        let Self {
            model,
            state,
            unlimited,
            walls,
            holds,
            contacts,
            ledger,
            mover,
            tangles,
            dt,
            stats,
            ..
        } = self;
        let Some(limit) = &model.strain_limit else {
            return Limited::default();
        };
        // At first the contacts are those that the step began with.
        let ago = if with_velocity { *dt } else { 0.0 };
        stats.times.time(Stage::LimitStrain, || {
            unlimited.copy_from_slice(&state.positions);
            walls.fill(Wall::default());
            for contact in &contacts.list {
                walls[contact.particle] = contact.wall(ago);
            }
            if let Some(tangles) = tangles {
                tangles.hold(&state.positions, walls);
            }
            let held = Held {
                inverse_masses: &model.inverse_masses,
                walls,
                holds,
            };
            let limited = limit.apply(&mut state.positions, held);
            if limited.passes == 0 {
                return limited;
            }
            hand_over(mover, STRAIN_LIMIT, ledger, model, unlimited);
            if with_velocity {
                let mut gained = 0.0;
                // What is led out of a body is stretched by that, and must not be thrown by its limit.
                let led = |i: usize| {
                    tangles
                        .as_ref()
                        .is_some_and(|tangles| tangles.is_tangled(i))
                };
                for i in (0..unlimited.len()).filter(|&i| !led(i)) {
                    let (v, gain) = (
                        &mut state.velocities[i],
                        (state.positions[i] - unlimited[i]) / *dt,
                    );
                    gained += model.masses[i] * gain.dot(*v + gain * 0.5);
                    *v += gain;
                }
                ledger.slowed(STRAIN_LIMIT, -gained);
            }
            limited
        })
    }

    pub(super) fn detect_contacts(&mut self) {
        let Self {
            model,
            state,
            contacts,
            bodies,
            detection,
            tangles,
            dt,
            stats,
            ..
        } = self;
        stats.times.time(Stage::DetectContacts, || {
            let cloth = &state.positions[..model.cloth_particles()];
            detection.find(&model.obstacles, bodies, cloth, contacts);
            if let Some(tangles) = tangles {
                tangles.give_time(contacts, state.time, *dt);
            }
        });
    }

    fn respond(&mut self, spread: bool) -> Response {
        let Self {
            model,
            state,
            contacts,
            ledger,
            mover,
            stats,
            ..
        } = self;
        if contacts.list.is_empty() {
            return Response::default();
        }
        let masses = model.by_mass();
        stats.times.time(Stage::Respond, || {
            let last = *mover;
            hand_over(mover, CONTACT, ledger, model, &state.positions);
            let response = respond(contacts, masses, spread, state);
            if !response.moved && last != Some(CONTACT) {
                *mover = None;
            }
            ledger.slowed(CONTACT, response.approach);
            ledger.slowed(FRICTION, response.friction);
            ledger.pushed(response.work);
            response
        })
    }
}

/// Books the potential that the last mover has changed, before the next one moves the particles from some
/// positions on. One after itself goes on: of two passes over the springs none is needed then.
pub(super) fn hand_over(
    mover: &mut Option<&'static str>,
    next: &'static str,
    ledger: &mut Ledger,
    model: &Model,
    positions: &[DVec3],
) {
    match *mover {
        Some(last) if last != next => ledger.displaced(last, potential_at(model, positions)),
        _ => {}
    }
    *mover = Some(next);
}
