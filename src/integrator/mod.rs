//! Schemes that advance a state by one step: one a file, all on the same forces.

mod constraint;
mod euler;
mod explicit;
mod implicit_euler;
mod projective;
mod rk4;
mod symplectic_euler;
mod verlet;

use crate::collision::Contacts;
use crate::linear::Solve;
use crate::model::Model;
use crate::scene::{IntegratorName, Solver};
use crate::state::State;
use euler::Euler;
use implicit_euler::ImplicitEuler;
use projective::Projective;
use rk4::Rk4;
use symplectic_euler::SymplecticEuler;
use verlet::Verlet;

/// A scheme and its parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Integrator {
    /// x ← x + dt v, v ← v + dt f(x, v)/m, both from the old state.
    Euler,
    /// v ← v + dt f(x, v)/m, x ← x + dt v.
    SymplecticEuler,
    /// Velocity Verlet, second order.
    Verlet,
    /// The classical Runge–Kutta scheme, fourth order.
    Rk4,
    /// One linearised solve a step.
    ImplicitEuler {
        /// Residual at which the solve ends, relative to its start.
        linear_tolerance: f64,
    },
    /// Implicit Euler solved by local and global steps with one factorised matrix.
    Projective {
        /// The most iterations of a step.
        iterations: u32,
        /// Force out of balance at which a step ends, relative to those that move the cloth.
        residual: f64,
    },
}

impl Integrator {
    /// The schemes that are stable for short steps only.
    pub const EXPLICIT: [Self; 4] = [Self::Euler, Self::SymplecticEuler, Self::Verlet, Self::Rk4];

    /// The scheme that a scene asks for.
    pub fn of(solver: &Solver) -> Self {
        match solver.integrator {
            IntegratorName::Euler => Self::Euler,
            IntegratorName::SymplecticEuler => Self::SymplecticEuler,
            IntegratorName::Verlet => Self::Verlet,
            IntegratorName::Rk4 => Self::Rk4,
            IntegratorName::ImplicitEuler => Self::ImplicitEuler {
                linear_tolerance: solver.linear_tolerance,
            },
            IntegratorName::Projective => Self::Projective {
                iterations: solver.iterations.unwrap_or(projective::ITERATIONS),
                residual: solver.residual,
            },
        }
    }

    /// The scheme's name in scenes and reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Euler => "euler",
            Self::SymplecticEuler => "symplectic-euler",
            Self::Verlet => "verlet",
            Self::Rk4 => "rk4",
            Self::ImplicitEuler { .. } => "implicit-euler",
            Self::Projective { .. } => "projective",
        }
    }

    /// Whether the scheme is stable for short steps only.
    pub fn is_explicit(self) -> bool {
        Self::EXPLICIT.contains(&self)
    }

    /// One step (s) of the oscillator x″ = −ω² x − c v from [x, v], as an explicit scheme takes it;
    /// `None` for the others. What it does to amplitudes says which steps are stable.
    pub fn test_step(
        self,
        omega_squared: f64,
        c: f64,
        dt: f64,
        start: [f64; 2],
    ) -> Option<[f64; 2]> {
        let a = |x: f64, v: f64| -omega_squared * x - c * v;
        match self {
            Self::Euler => Some(euler::test_step(a, dt, start)),
            Self::SymplecticEuler => Some(symplectic_euler::test_step(a, dt, start)),
            Self::Verlet => Some(verlet::test_step(a, dt, start)),
            Self::Rk4 => Some(rk4::test_step(a, dt, start)),
            Self::ImplicitEuler { .. } | Self::Projective { .. } => None,
        }
    }

    /// The scheme with its work arrays, sized for a model.
    pub fn scheme(self, model: &Model) -> Scheme {
        match self {
            Self::Euler => Scheme::Euler(Euler::new(model)),
            Self::SymplecticEuler => Scheme::SymplecticEuler(SymplecticEuler::new(model)),
            Self::Verlet => Scheme::Verlet(Verlet::new(model)),
            Self::Rk4 => Scheme::Rk4(Box::new(Rk4::new(model))),
            Self::ImplicitEuler { linear_tolerance } => {
                Scheme::ImplicitEuler(Box::new(ImplicitEuler::new(model, linear_tolerance)))
            }
            Self::Projective {
                iterations,
                residual,
            } => Scheme::Projective(Box::new(Projective::new(model, iterations, residual))),
        }
    }
}

/// A scheme at work.
#[derive(Debug)]
pub enum Scheme {
    /// See [`Integrator::Euler`].
    Euler(Euler),
    /// See [`Integrator::SymplecticEuler`].
    SymplecticEuler(SymplecticEuler),
    /// See [`Integrator::Verlet`].
    Verlet(Verlet),
    /// See [`Integrator::Rk4`].
    Rk4(Box<Rk4>),
    /// See [`Integrator::ImplicitEuler`].
    ImplicitEuler(Box<ImplicitEuler>),
    /// See [`Integrator::Projective`].
    Projective(Box<Projective>),
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
            Self::Euler(scheme) => scheme.advance(model, dt, state),
            Self::SymplecticEuler(scheme) => scheme.advance(model, dt, state),
            Self::Verlet(scheme) => scheme.advance(model, dt, state),
            Self::Rk4(scheme) => scheme.advance(model, dt, state),
            Self::ImplicitEuler(scheme) => return scheme.advance(model, contacts, dt, state),
            Self::Projective(scheme) => return scheme.advance(model, dt, state),
        }
        Solve {
            converged: true,
            ..Solve::default()
        }
    }
}
