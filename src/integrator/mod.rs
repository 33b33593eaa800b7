//! Schemes that advance a state by one step: one a file, all on the same forces.

mod constraint;
mod implicit_euler;
mod symplectic_euler;

use crate::collision::Contacts;
use crate::linear::Solve;
use crate::model::Model;
use crate::state::State;
use implicit_euler::ImplicitEuler;
use symplectic_euler::SymplecticEuler;

/// A scheme and its parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Integrator {
    /// v ← v + dt f(x, v)/m, x ← x + dt v.
    SymplecticEuler,
    /// One linearised solve a step.
    ImplicitEuler {
        /// Residual at which the solve ends, relative to its start.
        linear_tolerance: f64,
    },
}

impl Integrator {
    /// The scheme's name in scenes and reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::SymplecticEuler => "symplectic-euler",
            Self::ImplicitEuler { .. } => "implicit-euler",
        }
    }

    /// Whether the scheme is stable for short steps only.
    pub fn is_explicit(self) -> bool {
        matches!(self, Self::SymplecticEuler)
    }

    /// The scheme with its work arrays, sized for a model.
    pub fn scheme(self, model: &Model) -> Scheme {
        match self {
            Self::SymplecticEuler => Scheme::SymplecticEuler(SymplecticEuler::new(model)),
            Self::ImplicitEuler { linear_tolerance } => {
                Scheme::ImplicitEuler(Box::new(ImplicitEuler::new(model, linear_tolerance)))
            }
        }
    }
}

/// A scheme at work.
#[derive(Debug)]
pub enum Scheme {
    /// See [`Integrator::SymplecticEuler`].
    SymplecticEuler(SymplecticEuler),
    /// See [`Integrator::ImplicitEuler`].
    ImplicitEuler(Box<ImplicitEuler>),
}

impl Scheme {
    /// Advances positions and velocities by `dt` (s); time is the caller's.
    ///
    /// `contacts` are those that the last step left; the scheme may use and update their grips.
    pub fn advance(
        &mut self,
        model: &Model,
        contacts: &mut Contacts,
        dt: f64,
        state: &mut State,
    ) -> Solve {
        match self {
            Self::SymplecticEuler(scheme) => scheme.advance(model, dt, state),
            Self::ImplicitEuler(scheme) => scheme.advance(model, contacts, dt, state),
        }
    }
}
