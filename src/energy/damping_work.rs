//! The energy that dampings take.

use crate::force::{DAMPINGS, DampedMotion};
use crate::linear::Chunks;
use crate::model::Model;
use crate::state::State;
use glam::DVec3;

/// A place within a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum When {
    /// Its start.
    Start,
    /// The mean of its start and end.
    Middle,
    /// Its end.
    End,
}

/// Measures what dampings take, step by step: W = −f(x, v) · (x₁ − x₀), with their forces f where the
/// scheme takes them.
///
/// The mean velocity of a step is its way by its time, and not (v₀ + v₁)/2: that has in it the jumps that
/// limits and contact left, which a stiff damper takes once and this would count c dt/m times over, 80
/// times on `drape`.
#[derive(Debug)]
pub struct DampingWork {
    /// Mean positions (m) and velocities (m/s) of a step.
    middle: State,
    /// Where the scheme takes positions and velocities.
    at: [When; 2],
}

impl DampingWork {
    /// Ready for the first step; `None` without dampings.
    pub fn new(model: &Model, at: [When; 2]) -> Option<Self> {
        model.dampings().next()?;
        Some(Self {
            middle: State::at_rest(vec![DVec3::ZERO; model.particles()]),
            at,
        })
    }

    /// What was taken in a step of `dt` (s) between two states (J), by [`DAMPINGS`]. Runs on all threads
    /// of the pool it is called in; the result doesn't depend on their number.
    pub fn of_step(&mut self, model: &Model, dt: f64, from: &State, to: &State) -> [f64; 2] {
        let State {
            positions,
            velocities,
            ..
        } = &mut self.middle;
        let (chunks, per_dt) = (Chunks::of(positions.len()), dt.recip());
        if self.at[0] == When::Middle {
            chunks.for_each(positions, |chunk, means| {
                let range = chunks.range(chunk);
                let ends = from.positions[range.clone()]
                    .iter()
                    .zip(&to.positions[range]);
                for (mean, (from, to)) in means.iter_mut().zip(ends) {
                    *mean = (*from + *to) * 0.5;
                }
            });
        }
        chunks.for_each(velocities, |chunk, means| {
            let range = chunks.range(chunk);
            let ways = from.positions[range.clone()]
                .iter()
                .zip(&to.positions[range]);
            for (mean, (from, to)) in means.iter_mut().zip(ways) {
                *mean = (*to - *from) * per_dt;
            }
        });
        let pick = |when| match when {
            When::Start => from,
            When::Middle => &self.middle,
            When::End => to,
        };
        let motion = DampedMotion {
            positions: &pick(self.at[0]).positions,
            damped: &pick(self.at[1]).velocities,
            moved: &self.middle.velocities,
        };
        let powers = chunks.map(|chunk| {
            let mut powers = [0.0; 2];
            for damping in model.dampings() {
                let share = chunks.share(chunk, damping.elements());
                let kind = usize::from(damping.name() == DAMPINGS[1]);
                powers[kind] += damping.power_of(share, motion);
            }
            powers
        });
        powers.fold([0.0; 2], |[a, b], power| {
            [a + dt * power[0], b + dt * power[1]]
        })
    }
}
