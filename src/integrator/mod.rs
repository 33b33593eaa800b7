//! Schemes that advance a state by one step: one a file, all on the same forces.

mod backward_euler;
mod bdf2;
mod constraint;
mod dopri5;
mod euler;
mod explicit;
mod implicit_euler;
mod implicit_midpoint;
mod linear_system;
mod newton;
mod projective;
mod properties;
mod retry;
mod rk4;
mod surplus;
mod symplectic_euler;
mod verlet;
mod xpbd;

pub use backward_euler::Nonlinear;
pub use linear_system::Linear;

use crate::collision::Contacts;
use crate::linear::Solve;
use crate::model::Model;
use crate::scene::{IntegratorName, Solver};
use crate::state::{Archive, State};
use bdf2::Bdf2;
use dopri5::Dopri5;
use euler::Euler;
use implicit_euler::ImplicitEuler;
use implicit_midpoint::ImplicitMidpoint;
use newton::Newton;
use projective::Projective;
use retry::Retry;
use rk4::Rk4;
use std::any::Any;
use std::fmt::Debug;
use symplectic_euler::SymplecticEuler;
use verlet::Verlet;
use xpbd::Xpbd;

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
    /// Dormand and Prince's pair of orders five and four, its steps chosen by their error.
    Dopri5 {
        /// Error of a step in the position of any particle (m).
        tolerance: f64,
    },
    /// One linearised solve a step.
    ImplicitEuler(Linear),
    /// Implicit Euler, its nonlinear equation solved.
    Newton(Nonlinear),
    /// The implicit midpoint rule, second order, keeps the energy.
    ImplicitMidpoint(Nonlinear),
    /// The backward differentiation formula of second order.
    Bdf2(Nonlinear),
    /// Springs and hinges as compliant constraints, relaxed one by one.
    Xpbd {
        /// Sweeps over all constraints in a step.
        iterations: u32,
    },
    /// Implicit Euler solved by local and global steps with one factorised matrix.
    Projective {
        /// The most iterations of a step.
        iterations: u32,
        /// Force out of balance at which a step ends, relative to those that move the cloth.
        residual: f64,
    },
}

/// Newton steps of a stage after which it is given up and tried with halves.
const MOST_NEWTON_STEPS: u32 = 50;

impl Integrator {
    /// The schemes that are stable for short steps only.
    pub const EXPLICIT: [Self; 4] = [Self::Euler, Self::SymplecticEuler, Self::Verlet, Self::Rk4];

    /// The scheme that a scene asks for.
    pub fn of(solver: &Solver) -> Self {
        let linear = Linear {
            solver: solver.linear,
            tolerance: solver.linear_tolerance,
        };
        let nonlinear = Nonlinear {
            residual: solver.residual,
            iterations: solver.iterations.unwrap_or(MOST_NEWTON_STEPS),
            linear,
        };
        match solver.integrator {
            IntegratorName::Euler => Self::Euler,
            IntegratorName::SymplecticEuler => Self::SymplecticEuler,
            IntegratorName::Verlet => Self::Verlet,
            IntegratorName::Rk4 => Self::Rk4,
            IntegratorName::Dopri5 => Self::Dopri5 {
                tolerance: solver.tolerance,
            },
            IntegratorName::ImplicitEuler => Self::ImplicitEuler(linear),
            IntegratorName::Newton => Self::Newton(nonlinear),
            IntegratorName::ImplicitMidpoint => Self::ImplicitMidpoint(nonlinear),
            IntegratorName::Bdf2 => Self::Bdf2(nonlinear),
            IntegratorName::Xpbd => Self::Xpbd {
                iterations: solver.iterations.unwrap_or(1),
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
            Self::Dopri5 { .. } => "dopri5",
            Self::ImplicitEuler(_) => "implicit-euler",
            Self::Newton(_) => "newton",
            Self::ImplicitMidpoint(_) => "implicit-midpoint",
            Self::Bdf2(_) => "bdf2",
            Self::Xpbd { .. } => "xpbd",
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
            _ => None,
        }
    }

    /// The scheme with its work arrays, sized for a model.
    pub fn scheme(self, model: &Model) -> Box<dyn Scheme> {
        match self {
            Self::Euler => Box::new(Euler::new(model)),
            Self::SymplecticEuler => Box::new(SymplecticEuler::new(model)),
            Self::Verlet => Box::new(Verlet::new(model)),
            Self::Rk4 => Box::new(Rk4::new(model)),
            Self::Dopri5 { tolerance } => Box::new(Dopri5::new(model, tolerance)),
            Self::ImplicitEuler(linear) => {
                Box::new(Retry::new(model, ImplicitEuler::new(model, linear)))
            }
            Self::Newton(settings) => Box::new(Retry::new(model, Newton::new(model, settings))),
            Self::ImplicitMidpoint(settings) => {
                Box::new(Retry::new(model, ImplicitMidpoint::new(model, settings)))
            }
            Self::Bdf2(settings) => Box::new(Retry::new(model, Bdf2::new(model, settings))),
            Self::Xpbd { iterations } => Box::new(Xpbd::new(model, iterations)),
            Self::Projective {
                iterations,
                residual,
            } => Box::new(Projective::new(model, iterations, residual)),
        }
    }
}

/// A scheme at work.
pub trait Scheme: Any + Debug + Send {
    /// Sets `state` to what `before` is `dt` (s) later. What it holds at first means nothing; its time at
    /// the end, and where driven particles end, is the caller's.
    ///
    /// Driven particles are exact before. A scheme that asks for forces later in the step calls
    /// [`Model::drive`] at the state's time then.
    ///
    /// `contacts` are those that the last step left; the scheme may use and update their grips.
    fn advance(
        &mut self,
        model: &Model,
        contacts: &mut Contacts,
        dt: f64,
        before: &State,
        state: &mut State,
    ) -> Solve;

    /// Advances like [`Scheme::advance`], and hands each step of its own within `dt` to `show`, by the
    /// states before and after it. Only a scheme that has such steps does; the others show nothing.
    fn advance_showing(
        &mut self,
        model: &Model,
        contacts: &mut Contacts,
        dt: f64,
        before: &State,
        state: &mut State,
        show: &mut dyn FnMut(&State, &State),
    ) -> Solve {
        let _ = show;
        self.advance(model, contacts, dt, before, state)
    }

    /// Keeps what the scheme carries over from step to step, in case that the next one is tried again.
    fn remember(&mut self) {}

    /// Goes back to what was kept.
    fn recall(&mut self) {}

    /// Takes what another one of the same scheme and model carries over from its last step, to go on in
    /// its place: all that the next step's result depends on by more than its tolerance.
    fn follow(&mut self, _other: &dyn Scheme) {}

    /// Carries over all that the next step's bits depend on besides the state, its contacts and the model, in which
    /// the pins of the state's time are released already.
    fn carry(&mut self, _model: &Model, _archive: &mut Archive) {}
}
