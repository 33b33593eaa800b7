//! Cloth that starts inside a body, across it or across other cloth.

use super::correct::hand_over;
use super::{Simulation, Stage};
use crate::collision::{Audit, Bodies, Scenery, TIME, Tangle, Tangles};
use crate::energy::CONTACT;
use crate::model::Model;
use std::collections::BTreeMap;

/// How cloth started, and since when it is free.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TangledStart {
    /// Particles that were tangled at the start.
    pub at_start: usize,
    /// Particles that still are.
    pub now: usize,
    /// By cloth and what it was in, in words.
    pub said: Vec<String>,
    /// Time from the start after which none was tangled any more (s).
    pub took: Option<f64>,
}

/// Steps between two looks at what can't be parted.
const SELDOM: u64 = 32;

/// What of one cloth is in one thing.
#[derive(Clone, Copy, Debug, Default)]
struct Share {
    inside: usize,
    crossing: usize,
    depth: f64,
}

/// The model's audit.
pub(crate) fn audit_of(model: &Model) -> Audit {
    let triangles = model.cloths.iter().flat_map(|cloth| &cloth.triangles);
    Audit::new(
        triangles.copied().collect(),
        model.edges(),
        &model.obstacles,
        model.self_collision.is_some(),
    )
}

/// What cloth may be tangled in.
fn scenery<'a>(model: &'a Model, bodies: &'a Bodies) -> Scenery<'a> {
    Scenery {
        obstacles: &model.obstacles,
        bodies,
    }
}

impl Simulation {
    /// Looks for what starts tangled, and takes it out of contact.
    pub(super) fn look_for_tangles(&mut self) {
        if !self.model.has_contact() {
            return;
        }
        let Self {
            model,
            state,
            bodies,
            impacts,
            ..
        } = self;
        let scenery = scenery(model, bodies);
        self.tangles = Tangles::new(audit_of(model), scenery, model.cloth_particles(), state);
        let Some(tangles) = &self.tangles else {
            return;
        };
        if let Some(impacts) = impacts {
            impacts.exempt(tangles.list().iter().map(|tangle| *tangle != Tangle::Free));
        }
        self.tangled = TangledStart {
            at_start: tangles.count(),
            now: tangles.count(),
            said: words(self, tangles),
            took: None,
        };
    }

    /// Moves apart what crosses, before the rest of contact; whether anything was moved.
    pub(super) fn part_tangles(&mut self) -> bool {
        let Self {
            model,
            state,
            bodies,
            tangles,
            ledger,
            mover,
            dt,
            stats,
            ..
        } = self;
        let Some(tangles) = tangles else {
            return false;
        };
        let (scenery, masses) = (scenery(model, bodies), model.by_mass());
        stats.times.time(Stage::Respond, || {
            hand_over(mover, CONTACT, ledger, model, &state.positions);
            let response = tangles.part(scenery, masses, *dt, state);
            if !response.moved {
                *mover = None;
            }
            ledger.slowed(CONTACT, response.approach);
            ledger.pushed(response.work);
            response.moved
        })
    }

    /// Slows down what was led out and goes faster than a fall explains; whether anything does.
    pub(super) fn calm_tangles(&mut self) -> bool {
        let Self {
            model,
            state,
            bodies,
            tangles,
            ledger,
            ..
        } = self;
        let Some(tangles) = tangles else {
            return false;
        };
        let (scenery, masses) = (scenery(model, bodies), model.by_mass());
        let gravity = model.gravity.acceleration.length();
        let taken = tangles.calm(scenery, masses, gravity, state);
        ledger.slowed(CONTACT, taken);
        taken > 0.0
    }

    /// Sets free what is out.
    pub(super) fn free_tangles(&mut self) {
        let Self {
            model,
            state,
            bodies,
            impacts,
            tangles,
            tangled,
            start,
            stats,
            ..
        } = self;
        let Some(found) = tangles else {
            return;
        };
        if let Some(took) = tangled.took {
            // What was stretched on the way out is calmed for as long again.
            if state.time > *start + took + TIME {
                *tangles = None;
            }
            return;
        }
        if found.is_given_up(state.time) && !stats.steps.is_multiple_of(SELDOM) {
            return;
        }
        let scenery = scenery(model, bodies);
        let cloth = &state.positions[..model.cloth_particles()];
        stats
            .times
            .time(Stage::DetectContacts, || found.look(scenery, cloth));
        tangled.now = found.count();
        let done = tangled.now == 0;
        if let Some(impacts) = impacts {
            let list = found.list().iter().map(|tangle| *tangle != Tangle::Free);
            impacts.exempt(list.take(if done { 0 } else { usize::MAX }));
        }
        if done {
            tangled.took = Some(state.time - *start);
        }
    }

    /// What started inside something or across it; nothing in most scenes.
    pub fn tangled(&self) -> &TangledStart {
        &self.tangled
    }
}

/// What of each cloth is in what, and how it gets out.
fn words(run: &Simulation, tangles: &Tangles) -> Vec<String> {
    let (model, state) = (&run.model, &run.state);
    let mut shares: BTreeMap<(usize, Option<usize>), Share> = BTreeMap::new();
    for (i, tangle) in tangles.list().iter().enumerate() {
        let cloth = model
            .cloths
            .iter()
            .position(|cloth| cloth.particles.contains(&i));
        let cloth = cloth.unwrap_or_default();
        match *tangle {
            Tangle::Free | Tangle::Beside => {}
            Tangle::Cloth => shares.entry((cloth, None)).or_default().crossing += 1,
            Tangle::Through(k) => shares.entry((cloth, Some(k))).or_default().crossing += 1,
            Tangle::Inside(k) => {
                let share = shares.entry((cloth, Some(k))).or_default();
                share.inside += 1;
                let x = run.bodies.at_start(k, state.positions[i]);
                let found = run.bodies.nearest(&model.obstacles[k], k, x, f64::MAX);
                share.depth = found
                    .map_or(0.0, |nearest| -nearest.distance)
                    .max(share.depth);
            }
        }
    }
    let each = shares.iter().map(|((cloth, k), share)| {
        let cloth = &model.cloths[*cloth].name;
        match k {
            Some(k) if share.inside > 0 => format!(
                "{} particles of {cloth} start inside {}, deepest {:.1} mm; moved out within {TIME} s",
                share.inside,
                model.obstacles[*k].name,
                1000.0 * share.depth
            ),
            Some(k) => format!(
                "{} particles of {cloth} start at edges that cross {}; moved apart",
                share.crossing, model.obstacles[*k].name
            ),
            None => format!(
                "{} particles of {cloth} start where cloth crosses cloth; moved apart",
                share.crossing
            ),
        }
    });
    each.collect()
}
