//! Implicit steps that fail are tried again in halves.

use super::Scheme;
use crate::collision::{Contacts, Grip};
use crate::linear::Solve;
use crate::model::Model;
use crate::state::State;

/// Halvings of a step before it is taken as it is: sixteen parts.
const MAX_HALVINGS: u32 = 4;

/// An implicit scheme, and what a further attempt at a step starts from.
#[derive(Debug)]
pub(super) struct Retry<S> {
    scheme: S,
    start: State,
    grips: Vec<Grip>,
}

impl<S: Scheme> Retry<S> {
    pub(super) fn new(model: &Model, scheme: S) -> Self {
        Self {
            scheme,
            start: State::at_rest(vec![glam::DVec3::ZERO; model.particles()]),
            grips: vec![Grip::default(); model.particles()],
        }
    }
}

impl<S: Scheme> Scheme for Retry<S> {
    /// Advances by `dt` (s) at once, or in 2, 4, 8, 16 parts, until every part is solved and finite. When
    /// none is, what the last attempt gave stands, and says that it is not solved.
    fn advance(
        &mut self,
        model: &Model,
        contacts: &mut Contacts,
        dt: f64,
        state: &mut State,
    ) -> Solve {
        let Self {
            scheme,
            start,
            grips,
        } = self;
        start.copy_from(state);
        grips.copy_from_slice(&contacts.grips);
        scheme.remember();
        let mut iterations = 0;
        for halvings in 0..=MAX_HALVINGS {
            let parts = 1 << halvings;
            let mut solve = in_parts(scheme, model, contacts, dt, parts, state);
            iterations += solve.iterations;
            let last = halvings == MAX_HALVINGS;
            if last || solve.converged && state.first_non_finite().is_none() {
                solve.iterations = iterations;
                return solve;
            }
            state.copy_from(start);
            contacts.grips.copy_from_slice(grips);
            scheme.recall();
        }
        Solve::default() // the last attempt has returned
    }
}

/// Some steps that together last `dt` (s), or those up to the first that fails.
fn in_parts(
    scheme: &mut impl Scheme,
    model: &Model,
    contacts: &mut Contacts,
    dt: f64,
    parts: u32,
    state: &mut State,
) -> Solve {
    let mut all = Solve {
        converged: true,
        ..Solve::default()
    };
    let (start, part) = (state.time, dt / f64::from(parts));
    for k in 0..parts {
        let solve = scheme.advance(model, contacts, part, state);
        all.iterations += solve.iterations;
        all.residual = all.residual.max(solve.residual);
        all.converged &= solve.converged;
        state.time = start + f64::from(k + 1) * part;
        model.drive(state);
    }
    // Grips hold the impulses of a whole step.
    for grip in &mut contacts.grips {
        grip.pressure *= f64::from(parts);
        grip.drag *= f64::from(parts);
    }
    all
}
