//! The embedded Runge–Kutta pair of fifth and fourth order, with steps as long as the error allows.
//!
//! Source: Dormand and Prince 1980; step control after Hairer, Nørsett and Wanner 1993, section II.4.

use super::Scheme;
use super::explicit::Accelerations;
use crate::collision::Contacts;
use crate::linear::Solve;
use crate::model::Model;
use crate::state::{Archive, State};
use glam::DVec3;
use std::any::Any;

/// Stages of a step; the last one is the first of the next.
const STAGES: usize = 7;

/// When each stage is, in steps.
const TIMES: [f64; STAGES] = [0.0, 0.2, 0.3, 0.8, 8.0 / 9.0, 1.0, 1.0];

/// Weights of the slopes before, by stage; the last row is the step itself, of fifth order.
const WEIGHTS: [[f64; STAGES - 1]; STAGES] = [
    [0.0; 6],
    [0.2, 0.0, 0.0, 0.0, 0.0, 0.0],
    [3.0 / 40.0, 9.0 / 40.0, 0.0, 0.0, 0.0, 0.0],
    [44.0 / 45.0, -56.0 / 15.0, 32.0 / 9.0, 0.0, 0.0, 0.0],
    [
        19372.0 / 6561.0,
        -25360.0 / 2187.0,
        64448.0 / 6561.0,
        -212.0 / 729.0,
        0.0,
        0.0,
    ],
    [
        9017.0 / 3168.0,
        -355.0 / 33.0,
        46732.0 / 5247.0,
        49.0 / 176.0,
        -5103.0 / 18656.0,
        0.0,
    ],
    [
        35.0 / 384.0,
        0.0,
        500.0 / 1113.0,
        125.0 / 192.0,
        -2187.0 / 6784.0,
        11.0 / 84.0,
    ],
];

/// Weights of all slopes in the difference between the results of fifth and fourth order.
const ERROR: [f64; STAGES] = [
    71.0 / 57600.0,
    0.0,
    -71.0 / 16695.0,
    71.0 / 1920.0,
    -17253.0 / 339_200.0,
    22.0 / 525.0,
    -1.0 / 40.0,
];

/// How far the estimate may exceed the tolerance: it is the error of the pair's worse result, and what
/// the better one leaves after many steps is 0.06 to 0.6 of it on a swinging chain and sheet.
const BETTER: f64 = 2.0;

/// Time (s) after which what a velocity is off by counts as what it does to the position: a frame. A
/// step's own length would let stiff cloth, whose steps are short, ring with any velocity.
const SHOWS_AFTER: f64 = 1.0 / 60.0;

/// A step's length against the one that just meets the tolerance.
const SAFETY: f64 = 0.9;

/// By how much a step may grow or shrink from one to the next.
const CHANGE: [f64; 2] = [0.2, 5.0];

/// Steps tried within one `dt` before the scheme gives up.
const MOST_STEPS: u32 = 20_000;

/// Work arrays of the scheme; one entry a particle.
#[derive(Debug)]
pub(super) struct Dopri5 {
    pass: Accelerations,
    /// Error of a step in the position of any particle (m).
    tolerance: f64,
    /// The step to try next (s); 0 before the first.
    step: f64,
    start: State,
    /// Velocity and acceleration of each stage: its slopes.
    slopes: [[Vec<DVec3>; 2]; STAGES],
}

impl Dopri5 {
    pub(super) fn new(model: &Model, tolerance: f64) -> Self {
        let zero = || vec![DVec3::ZERO; model.particles()];
        Self {
            pass: Accelerations::new(model),
            tolerance,
            step: 0.0,
            start: State::at_rest(zero()),
            slopes: std::array::from_fn(|_| [zero(), zero()]),
        }
    }

    /// Sets the slopes of a stage from the state there.
    fn set_slopes(&mut self, stage: usize, model: &Model, state: &State) {
        let [velocities, slopes] = &mut self.slopes[stage];
        velocities.copy_from_slice(&state.velocities);
        self.pass.set(model, state, slopes);
    }

    /// Goes one step of `h` (s) from the start, whose slopes are known; returns the error in metres.
    fn try_step(&mut self, model: &Model, h: f64, state: &mut State) -> f64 {
        for stage in 1..STAGES {
            for i in 0..state.positions.len() {
                let mut sums = [DVec3::ZERO; 2];
                for (slopes, weight) in self.slopes.iter().zip(WEIGHTS[stage]).take(stage) {
                    sums[0] += slopes[0][i] * weight;
                    sums[1] += slopes[1][i] * weight;
                }
                state.positions[i] = self.start.positions[i] + sums[0] * h;
                state.velocities[i] = self.start.velocities[i] + sums[1] * h;
            }
            state.time = self.start.time + TIMES[stage] * h;
            model.drive(state);
            self.set_slopes(stage, model, state);
        }
        let mut worst = 0.0_f64;
        for i in 0..state.positions.len() {
            let mut errors = [DVec3::ZERO; 2];
            for (slopes, weight) in self.slopes.iter().zip(ERROR) {
                errors[0] += slopes[0][i] * weight;
                errors[1] += slopes[1][i] * weight;
            }
            if errors.iter().any(|error| error.is_nan()) {
                return f64::NAN;
            }
            worst = worst.max(errors[0].length().max(errors[1].length() * SHOWS_AFTER) * h);
        }
        worst
    }
}

impl Scheme for Dopri5 {
    /// Steps of fifth order that together last `dt`, each as long as its error allows in the position of
    /// any particle: a mean would hide what goes wrong at a corner. What would be unstable has a large
    /// error: stiff cloth is stepped at its stable step. Not solved when that takes too many steps: the
    /// state is then short of the end.
    fn advance(
        &mut self,
        model: &Model,
        contacts: &mut Contacts,
        dt: f64,
        before: &State,
        state: &mut State,
    ) -> Solve {
        self.advance_showing(model, contacts, dt, before, state, &mut |_, _| {})
    }

    fn advance_showing(
        &mut self,
        model: &Model,
        _: &mut Contacts,
        dt: f64,
        before: &State,
        state: &mut State,
        show: &mut dyn FnMut(&State, &State),
    ) -> Solve {
        state.copy_from(before);
        let end = state.time + dt;
        let mut solve = Solve::NONE;
        self.step = if self.step > 0.0 {
            self.step
        } else {
            0.01 * dt
        };
        self.start.copy_from(state);
        self.set_slopes(0, model, state);
        while state.time < end {
            let left = end - self.start.time;
            // Two equal steps to the end rather than a long and a tiny one.
            let h = match left / self.step {
                n if n <= 1.0 + 1e-9 => left,
                n if n < 2.0 => 0.5 * left,
                _ => self.step,
            };
            let error = self.try_step(model, h, state);
            solve.iterations += 1;
            let ratio = error / (BETTER * self.tolerance);
            // The error of the fourth-order result grows with h⁵.
            let change = SAFETY * ratio.powf(-0.2);
            let change = change.clamp(CHANGE[0], CHANGE[1]);
            let accepted = ratio <= 1.0;
            if accepted {
                state.time = if h >= left { end } else { self.start.time + h };
                show(&self.start, state);
                self.start.copy_from(state);
                self.slopes.swap(0, STAGES - 1);
                // A step that was cut short by the end says little of the next.
                self.step = if h < self.step {
                    self.step.max(h * change)
                } else {
                    h * change
                };
            } else {
                state.copy_from(&self.start);
                self.step = h * if change.is_finite() {
                    change.min(1.0)
                } else {
                    CHANGE[0]
                };
            }
            if solve.iterations == MOST_STEPS || h < 1e-12 * dt {
                solve.converged = false;
                return solve;
            }
        }
        solve
    }

    /// Steps of a tighter tolerance find their length from there.
    fn follow(&mut self, other: &dyn Scheme) {
        if let Some(other) = (other as &dyn Any).downcast_ref::<Self>() {
            self.step = other.step * (self.tolerance / other.tolerance).powf(0.2);
        }
    }

    fn carry(&mut self, _: &Model, archive: &mut Archive) {
        archive.real(&mut self.step);
    }
}
