//! What is measured of a state, in one look on all threads.

use crate::energy::{Totals, kinetic_of};
use crate::force::{Force as _, Tiles, Weave, energy_and_stretch_squared};
use crate::linear::{Ahead, Chunks};
use crate::model::Model;
use crate::state::State;
use glam::DVec3;
use std::ops::Range;

/// A thousand kilometres (m): beyond, the recording's `f32` has lost every centimetre.
const FAR: f64 = 1e6;

/// A model as it is looked at: tile by tile, so that what is beyond the caches is read once.
#[derive(Debug)]
pub(super) struct View {
    tiles: Tiles,
    pub(super) weave: Weave,
}

impl View {
    pub(super) fn of(model: &Model) -> Self {
        let tiles = Tiles::of(model.particles());
        Self {
            weave: Weave::of(tiles, model.weave()),
            tiles,
        }
    }

    /// Prepares to ask for what a tile needs, in as many shares as the one before it has batches.
    fn expect(&self, ahead: &mut Ahead, model: &Model, state: &State, tile: usize) {
        let particles = self.tiles.range(tile);
        ahead.begin(self.weave.batches(tile - 1));
        ahead.add(&state.positions, particles.clone());
        ahead.add(&state.velocities, particles.clone());
        ahead.add(&model.masses, particles.clone());
        ahead.add(&model.gravity.masses, particles.clone());
        self.weave.add_to(ahead, tile, &particles);
    }
}

/// What a look at a state found. The default is what there is to see where there is nothing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Survey {
    /// Whether all positions and velocities are numbers.
    pub(super) finite: bool,
    /// Whether no particle is farther than [`FAR`] from the origin.
    pub(super) near: bool,
    /// The energies; the elastic one if it was asked for.
    pub(super) energy: Totals,
    /// Largest λ² of the weave; −∞ without springs.
    stretch_squared: f64,
}

impl Default for Survey {
    fn default() -> Self {
        Self {
            finite: true,
            near: true,
            energy: Totals::default(),
            stretch_squared: f64::NEG_INFINITY,
        }
    }
}

impl Survey {
    /// Looks at a state, `with_elastic` also at the energy of springs and hinges. Sums are taken in the
    /// order of fixed chunks and tiles.
    pub(super) fn of(model: &Model, view: &View, state: &State, with_elastic: bool) -> Self {
        let View { tiles, weave } = view;
        let chunks = tiles.chunks();
        let look = |chunk: usize| {
            let mut ahead = Ahead::default();
            let each = tiles.of_chunk(chunk).map(|tile| {
                let mut survey = Self::of_particles(model, state, tiles.range(tile));
                if !with_elastic {
                    view.expect(&mut ahead, model, state, tile + 1);
                    survey.stretch_squared =
                        weave.largest_stretch_squared(tile, &state.positions, &mut ahead);
                }
                survey
            });
            let mut survey = each.fold(Self::default(), Self::and);
            if with_elastic {
                [survey.energy.elastic, survey.stretch_squared] =
                    look_at_elements(model, &state.positions, chunks, chunk);
            }
            survey
        };
        chunks.map(look).fold(Self::default(), Self::and)
    }

    fn and(self, other: Self) -> Self {
        Self {
            finite: self.finite && other.finite,
            near: self.near && other.near,
            energy: self.energy + other.energy,
            stretch_squared: self.stretch_squared.max(other.stretch_squared),
        }
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
            energy: Totals {
                kinetic: kinetic_of(&model.masses[range.clone()], velocities),
                gravitational: model.gravity.energy_of(range, &state.positions),
                elastic: 0.0,
            },
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

/// Elastic energy (J) of a chunk's share of springs and hinges, and the largest λ² of the weave among
/// them.
fn look_at_elements(model: &Model, positions: &[DVec3], chunks: Chunks, chunk: usize) -> [f64; 2] {
    let (mut elastic, mut largest) = (0.0, f64::NEG_INFINITY);
    for batch in &model.springs {
        let share = chunks.share(chunk, batch.springs.len());
        if batch.is_weave() {
            let [energy, square] = energy_and_stretch_squared(&batch.springs[share], positions);
            elastic += energy;
            largest = largest.max(square);
        } else {
            elastic += batch.energy_of(share, positions);
        }
    }
    for law in model.stiffnesses().skip(model.springs.len()) {
        elastic += law.energy_of(chunks.share(chunk, law.elements()), positions);
    }
    [elastic, largest]
}

/// Kinetic and gravitational energy of a state: one that was changed after its survey shows.
pub(super) fn moving(model: &Model, state: &State) -> Totals {
    let chunks = Chunks::of(model.particles());
    let part = |chunk| {
        let range = chunks.range(chunk);
        let velocities = &state.velocities[range.clone()];
        Totals {
            kinetic: kinetic_of(&model.masses[range.clone()], velocities),
            gravitational: model.gravity.energy_of(range, &state.positions),
            elastic: 0.0,
        }
    };
    chunks
        .map(part)
        .fold(Totals::default(), |all, part| all + part)
}
