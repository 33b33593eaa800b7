//! The classical Runge–Kutta scheme of fourth order.
//!
//! Source: Kutta 1901.

use super::Scheme;
use super::explicit::{Accelerations, update};
use crate::collision::Contacts;
use crate::linear::Solve;
use crate::model::Model;
use crate::state::State;
use glam::DVec3;

/// The scheme's pass and work arrays; one entry a particle.
#[derive(Debug)]
pub(super) struct Rk4 {
    pass: Accelerations,
    /// Acceleration of the present stage (m/s²).
    accelerations: Vec<DVec3>,
    /// Weighted sums of the stages' velocities and accelerations.
    sums: Vec<[DVec3; 2]>,
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
        let zero = vec![DVec3::ZERO; model.particles()];
        Self {
            pass: Accelerations::new(model),
            sums: vec![[DVec3::ZERO; 2]; zero.len()],
            accelerations: zero,
        }
    }
}

impl Scheme for Rk4 {
    /// Four stages: slopes at the start, twice in the middle and at the end, weighted 1 : 2 : 2 : 1.
    ///
    /// Fourth order on smooth problems; stable for dt ω ≤ 2√2 without damping, and slightly damping.
    fn advance(
        &mut self,
        model: &Model,
        _: &mut Contacts,
        dt: f64,
        before: &State,
        state: &mut State,
    ) -> Solve {
        state.copy_from(before);
        let Self {
            pass,
            accelerations,
            sums,
        } = self;
        sums.fill([DVec3::ZERO; 2]);
        for (weight, ahead) in STAGES {
            pass.set(model, state, accelerations);
            update(state, sums, |i, x, v, sums| {
                let (speed, a) = (*v, accelerations[i]);
                sums[0] += speed * weight;
                sums[1] += a * weight;
                *x = before.positions[i] + speed * (ahead * dt);
                *v = before.velocities[i] + a * (ahead * dt);
            });
            state.time = before.time + ahead * dt;
            model.drive(state);
        }
        update(state, sums, |i, x, v, sums| {
            *x = before.positions[i] + sums[0] * dt;
            *v = before.velocities[i] + sums[1] * dt;
        });
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
