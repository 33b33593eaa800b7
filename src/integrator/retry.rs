//! Implicit steps that fail are tried again in halves.

use super::Scheme;
use crate::collision::Contacts;
use crate::linear::Solve;
use crate::model::Model;
use crate::state::State;
use std::any::Any;

/// Halvings of a step before it is taken as it is: sixteen parts.
const MAX_HALVINGS: u32 = 4;

/// An implicit scheme, and what a further attempt at a step starts from.
#[derive(Debug)]
pub(super) struct Retry<S> {
    scheme: S,
    start: State,
    contacts: Contacts,
}

impl<S: Scheme> Retry<S> {
    pub(super) fn new(model: &Model, scheme: S) -> Self {
        let particles = model.particles();
        Self {
            scheme,
            start: State::at_rest(vec![glam::DVec3::ZERO; particles]),
            contacts: Contacts::none(particles),
        }
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
        state: &mut State,
    ) -> Solve {
        self.start.copy_from(state);
        self.contacts.clone_from(contacts);
        self.scheme.remember();
        let mut iterations = 0;
        for halvings in 0..=MAX_HALVINGS {
            if halvings > 0 {
                state.copy_from(&self.start);
                contacts.clone_from(&self.contacts);
                self.scheme.recall();
            }
            let last = halvings == MAX_HALVINGS;
            let parts = Parts {
                count: 1 << halvings,
                to_the_end: last,
            };
            let solve = parts.advance(&mut self.scheme, model, contacts, dt, state);
            iterations += solve.iterations;
            if last || solve.converged {
                return Solve {
                    iterations,
                    ..solve
                };
            }
        }
        Solve::NONE // not reached: the last attempt returns
    }

    fn follow(&mut self, other: &dyn Scheme) {
        if let Some(other) = (other as &dyn Any).downcast_ref::<Self>() {
            self.scheme.follow(&other.scheme);
        }
    }
}

/// A step in equal parts.
#[derive(Clone, Copy)]
struct Parts {
    count: u32,
    /// Whether to go on after a part that failed.
    to_the_end: bool,
}

impl Parts {
    /// Steps that together last `dt` (s), or those up to the first that fails.
    fn advance(
        self,
        scheme: &mut impl Scheme,
        model: &Model,
        contacts: &mut Contacts,
        dt: f64,
        state: &mut State,
    ) -> Solve {
        let (start, count) = (state.time, f64::from(self.count));
        let part = dt / count;
        contacts.scale_grips(1.0 / count);
        let mut all = Solve::NONE;
        for k in 0..self.count {
            let solve = scheme.advance(model, contacts, part, state);
            all.iterations += solve.iterations;
            all.residual = all.residual.max(solve.residual);
            all.converged &= solve.converged && state.first_non_finite().is_none();
            if !all.converged && !self.to_the_end {
                return all;
            }
            state.time = start + f64::from(k + 1) * part;
            model.drive(state);
            // The first part has closed the gaps, which are measured again after the step.
            for contact in &mut contacts.list {
                contact.gap = contact.gap.min(0.0);
            }
        }
        contacts.scale_grips(count);
        all
    }
}
