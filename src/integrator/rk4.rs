//! The classical Runge–Kutta scheme of fourth order.
//!
//! Source: Kutta 1901.

use super::Scheme;
use super::explicit::{Accelerations, parts};
use crate::collision::Contacts;
use crate::linear::Solve;
use crate::model::Model;
use crate::state::State;
use glam::DVec3;

/// The scheme's pass, and the states of its second and third stage.
#[derive(Debug)]
pub(super) struct Rk4 {
    pass: Accelerations,
    stages: [State; 2],
}

/// Weight of each stage, and how far from the start the next one lies, both in steps.
const STAGES: [(f64, f64); 4] = [
    (1.0 / 6.0, 0.5),
    (1.0 / 3.0, 0.5),
    (1.0 / 3.0, 1.0),
    (1.0 / 6.0, 0.0),
];

impl Rk4 {
    pub(super) fn new(model: &Model) -> Self {
        let zero = || State::at_rest(vec![DVec3::ZERO; model.particles()]);
        Self {
            pass: Accelerations::new(model),
            stages: [zero(), zero()],
        }
    }
}

impl Scheme for Rk4 {
    /// Four stages: slopes at the start, twice in the middle and at the end, weighted 1 : 2 : 2 : 1.
    ///
    /// Fourth order on smooth problems; stable for dt ω ≤ 2√2 without damping, and slightly damping.
    /// The accelerations of the first three stages stand in the velocities of the next: their part of the
    /// gain is (v₂ + 2 v₃ + v₄ − 4 v₁)/3.
    fn advance(
        &mut self,
        model: &Model,
        _: &mut Contacts,
        dt: f64,
        before: &State,
        state: &mut State,
    ) -> Solve {
        let Self { pass, stages } = self;
        let [second, third] = stages;
        let start = (&before.positions[..], &before.velocities[..]);
        let ahead = |from: &State, to: &mut State, pass: &mut Accelerations, share: f64| {
            let h = share * dt;
            pass.step(model, from, parts(to), start, |i, a| {
                let x = before.positions[i] + from.velocities[i] * h;
                [x, before.velocities[i] + a * h]
            });
            to.time = before.time + h;
            model.drive(to);
        };
        ahead(before, second, pass, STAGES[0].1);
        ahead(second, third, pass, STAGES[1].1);
        ahead(third, state, pass, STAGES[2].1);
        let fourth = &*state;
        // The stages' positions have served.
        let to = [&mut third.positions[..], &mut second.positions[..]];
        let [v2, v3] = [&second.velocities, &third.velocities];
        let reads = (start, (&v2[..], &v3[..]));
        pass.step(model, fourth, to, reads, |i, a| {
            let (x, v) = (before.positions[i], before.velocities[i]);
            // Differences from the start: what doesn't accelerate keeps its velocity to the last bit.
            let [d2, d3, d4] = [v2[i], v3[i], fourth.velocities[i]].map(|stage| stage - v);
            let mean = v + ((d2 + d3) * 2.0 + d4) * (1.0 / 6.0);
            let gain = (d2 + d3 * 2.0 + d4) * (1.0 / 3.0);
            [x + mean * dt, v + gain + a * (dt / 6.0)]
        });
        std::mem::swap(&mut state.positions, &mut third.positions);
        std::mem::swap(&mut state.velocities, &mut second.positions);
        Solve::NONE
    }
}

/// A step of x″ = a(x, v).
pub(super) fn test_step(a: impl Fn(f64, f64) -> f64, dt: f64, [x, v]: [f64; 2]) -> [f64; 2] {
    let (mut at, mut sums) = ([x, v], [0.0, 0.0]);
    for (weight, ahead) in STAGES {
        let slopes = [at[1], a(at[0], at[1])];
        sums = [sums[0] + weight * slopes[0], sums[1] + weight * slopes[1]];
        at = [x + ahead * dt * slopes[0], v + ahead * dt * slopes[1]];
    }
    [x + dt * sums[0], v + dt * sums[1]]
}
