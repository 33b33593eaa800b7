//! Implicit steps that fail are tried again in halves.

use super::Scheme;
use crate::collision::Contacts;
use crate::linear::Solve;
use crate::model::Model;
use crate::state::{Archive, State};
use std::any::Any;

/// Halvings of a step before it is taken as it is: sixteen parts.
const MAX_HALVINGS: u32 = 4;

/// An implicit scheme, and what a further attempt at a step starts from.
#[derive(Debug)]
pub(super) struct Retry<S> {
    scheme: S,
    /// The state before the present part of a step.
    start: State,
    /// The contacts before the step.
    contacts: Contacts,
}

impl<S: Scheme> Retry<S> {
    pub(super) fn new(model: &Model, scheme: S) -> Self {
        Self {
            scheme,
            start: State::at_rest(vec![glam::DVec3::ZERO; model.particles()]),
            contacts: model.no_contacts(),
        }
    }

    /// `count` steps that together last `dt` (s), or those up to the first that fails, unless `to_the_end`.
    fn advance_in_parts(
        &mut self,
        model: &Model,
        contacts: &mut Contacts,
        (dt, count, to_the_end): (f64, u32, bool),
        before: &State,
        state: &mut State,
    ) -> Solve {
        let share = f64::from(count).recip();
        let part = dt * share;
        // Grips hold the impulses of a whole step.
        contacts.scale_grips(share);
        let mut all = Solve::NONE;
        for k in 1..=count {
            let start = if k == 1 {
                before
            } else {
                self.start.copy_from(state);
                &self.start
            };
            let solve = self.scheme.advance(model, contacts, part, start, state);
            all.iterations += solve.iterations;
            all.residual = all.residual.max(solve.residual);
            all.damped |= solve.damped;
            all.converged &= solve.converged && state.first_non_finite().is_none();
            if !all.converged && !to_the_end {
                return all;
            }
            state.time = before.time + f64::from(k) * part;
            model.drive(state);
            // The first part has closed the gaps, which are measured again after the step.
            for contact in &mut contacts.list {
                contact.gap = contact.gap.min(0.0);
            }
        }
        contacts.scale_grips(f64::from(count));
        all
    }
}

impl<S: Scheme + 'static> Scheme for Retry<S> {
    /// Advances by `dt` (s) at once, or in 2, 4, 8, 16 parts, until every part is solved and finite. When
    /// none is, what the last attempt gave stands, and says that it is not solved.
    fn advance(
        &mut self,
        model: &Model,
        contacts: &mut Contacts,
        dt: f64,
        before: &State,
        state: &mut State,
    ) -> Solve {
        self.contacts.copy_from(contacts);
        self.scheme.remember();
        let mut iterations = 0;
        let mut halvings = 0;
        loop {
            let last = halvings == MAX_HALVINGS;
            let parts = (dt, 1 << halvings, last);
            let solve = self.advance_in_parts(model, contacts, parts, before, state);
            iterations += solve.iterations;
            if last || solve.converged {
                return Solve {
                    iterations,
                    ..solve
                };
            }
            contacts.copy_from(&self.contacts);
            self.scheme.recall();
            halvings += 1;
        }
    }

    fn follow(&mut self, other: &dyn Scheme) {
        if let Some(other) = (other as &dyn Any).downcast_ref::<Self>() {
            self.scheme.follow(&other.scheme);
        }
    }

    fn carry(&mut self, model: &Model, archive: &mut Archive) {
        self.scheme.carry(model, archive);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::collision::{Anchor, Contact, Grip};
    use crate::scene;
    use glam::DVec3;

    /// A scheme that fails at first, and keeps what it was given: the step (s), and the pressure, gap and
    /// place of the first particle.
    #[derive(Debug, Default)]
    struct Stubborn(Vec<[f64; 4]>);

    impl Scheme for Stubborn {
        fn advance(
            &mut self,
            _: &Model,
            contacts: &mut Contacts,
            dt: f64,
            before: &State,
            state: &mut State,
        ) -> Solve {
            let grip = &mut contacts.grips[0];
            let place = before.positions[0].y;
            self.0
                .push([dt, grip.pressure, contacts.list[0].gap, place]);
            grip.pressure += dt;
            state.copy_from(before);
            state.positions[0].y += dt;
            Solve {
                converged: self.0.len() > 1,
                ..Solve::NONE
            }
        }
    }

    /// Two halves after a failed step: both begin where the step did, with contacts as they were before it,
    /// with half of its impulses, and the gap is closed once.
    #[test]
    fn halves_share_impulses_and_gaps_with_the_whole_step() {
        let loaded = scene::load("hanging-cloth", &[]).unwrap();
        let scene::Built { model, state, .. } = scene::build(&loaded).unwrap();
        let mut contacts = Contacts::none(model.particles());
        contacts.grips[0] = Grip {
            pressure: 4.0,
            ..Grip::default()
        };
        contacts.list.push(Contact {
            leave: f64::INFINITY,
            particle: 0,
            at: DVec3::ZERO,
            normal: DVec3::Y,
            gap: 0.25,
            distance: 0.5,
            friction: 0.0,
            anchor: Anchor::default(),
            velocity: DVec3::ZERO,
            velocity_after: DVec3::ZERO,
            impulse: DVec3::ZERO,
        });
        let mut before = state.clone();
        before.positions[0].y = 1.0;
        let mut after = state;
        let mut retry = Retry::new(&model, Stubborn::default());
        let solve = retry.advance(&model, &mut contacts, 1.0, &before, &mut after);
        assert!(solve.converged);
        let whole = [1.0, 4.0, 0.25, 1.0];
        let halves = [[0.5, 2.0, 0.25, 1.0], [0.5, 2.5, 0.0, 1.5]];
        assert_eq!(retry.scheme.0, [whole, halves[0], halves[1]]);
        assert_eq!(after.positions[0].y, 2.0);
        // 2 + ½ + ½ of each half make 6 of the whole.
        assert_eq!(contacts.grips[0].pressure, 6.0);
    }
}
