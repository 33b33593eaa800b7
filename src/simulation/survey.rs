//! What is measured of a state, in one look on all threads.

use crate::energy::kinetic_of;
use crate::force::largest_stretch_squared;
use crate::linear::Chunks;
use crate::model::Model;
use crate::state::State;
use glam::DVec3;
use std::ops::Range;

/// A thousand kilometres (m): beyond, the recording's `f32` has lost every centimetre.
const FAR: f64 = 1e6;

/// What a look at a state found. The default is what there is to see where there is nothing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Survey {
    /// Whether all positions and velocities are numbers.
    pub(super) finite: bool,
    /// Whether no particle is farther than [`FAR`] from the origin.
    pub(super) near: bool,
    /// Kinetic energy (J).
    pub(super) kinetic: f64,
    /// Largest λ² of the weave; −∞ without springs.
    stretch_squared: f64,
}

impl Default for Survey {
    fn default() -> Self {
        Self {
            finite: true,
            near: true,
            kinetic: 0.0,
            stretch_squared: f64::NEG_INFINITY,
        }
    }
}

impl Survey {
    /// Looks at a state. Sums are taken in the order of fixed chunks.
    pub(super) fn of(model: &Model, state: &State) -> Self {
        let chunks = Chunks::of(model.particles());
        let look = |chunk: usize| {
            let weave = model.weave().map(|batch| {
                let share = chunks.share(chunk, batch.springs.len());
                largest_stretch_squared(&batch.springs[share], &state.positions)
            });
            Self {
                stretch_squared: weave.fold(f64::NEG_INFINITY, f64::max),
                ..Self::of_particles(model, state, chunks.range(chunk))
            }
        };
        chunks.map(look).fold(Self::default(), |all, chunk| Self {
            finite: all.finite && chunk.finite,
            near: all.near && chunk.near,
            kinetic: all.kinetic + chunk.kinetic,
            stretch_squared: all.stretch_squared.max(chunk.stretch_squared),
        })
    }

    fn of_particles(model: &Model, state: &State, range: Range<usize>) -> Self {
        let (positions, velocities) = (
            &state.positions[range.clone()],
            &state.velocities[range.clone()],
        );
        // Zero times a number is zero; times infinity or NaN it is NaN, and stays it in the sum.
        let (mut zero, mut farthest) = (DVec3::ZERO, 0.0_f64);
        for (x, v) in positions.iter().zip(velocities) {
            zero += *x * 0.0 + *v * 0.0;
            farthest = farthest.max(x.length_squared());
        }
        Self {
            finite: !zero.is_nan(),
            near: farthest <= FAR * FAR,
            kinetic: kinetic_of(&model.masses[range], velocities),
            ..Self::default()
        }
    }

    /// Largest strain of the springs that stand for the weave; 0 without springs.
    pub(super) fn strain(&self) -> f64 {
        if self.stretch_squared < 0.0 {
            0.0
        } else {
            self.stretch_squared.sqrt() - 1.0
        }
    }
}
