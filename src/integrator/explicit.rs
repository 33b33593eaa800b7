//! What the explicit schemes share: accelerations of a state, and how particles are moved.

use crate::force::ForcePass;
use crate::linear::Chunks;
use crate::model::Model;
use crate::state::State;
use glam::DVec3;
use rayon::prelude::*;

/// All laws and dampings of a model, ready for a pass on all threads.
#[derive(Debug)]
pub(super) struct Accelerations {
    pass: ForcePass,
    /// Releases that the pass knows of: they change the hinges at clamps.
    released: usize,
}

impl Accelerations {
    pub(super) fn new(model: &Model) -> Self {
        Self {
            pass: model.force_pass(),
            released: model.released(),
        }
    }

    /// Sets `state` to what `kernel` makes of each particle's [x, v] before and its f(x, v)/m (m/s²), all in
    /// one pass: beyond the second-level cache, a pass over memory takes as long as the springs.
    pub(super) fn step(
        &mut self,
        model: &Model,
        before: &State,
        state: &mut State,
        kernel: impl Fn([DVec3; 2], DVec3) -> [DVec3; 2] + Sync,
    ) {
        self.keep_up(model);
        let State {
            positions,
            velocities,
            ..
        } = state;
        // The forces stand where the new velocities will.
        self.pass
            .set_all(before, velocities, positions, |first, forces, x| {
                for (k, (v, x)) in forces.iter_mut().zip(x).enumerate() {
                    let i = first + k;
                    let a = *v * model.inverse_masses[i];
                    [*x, *v] = kernel([before.positions[i], before.velocities[i]], a);
                }
            });
    }

    /// Cuts the laws anew when pins have let go.
    fn keep_up(&mut self, model: &Model) {
        if self.released != model.released() {
            *self = Self::new(model);
        }
    }

    /// Sets f(x, v)/m of each particle (m/s²), all laws and dampings; 0 for pinned ones.
    pub(super) fn set(&mut self, model: &Model, state: &State, accelerations: &mut [DVec3]) {
        self.keep_up(model);
        let nothing = &mut vec![(); accelerations.len()]; // takes no memory
        self.pass
            .set_all(state, accelerations, nothing, |first, forces, _| {
                for (a, &w) in forces.iter_mut().zip(&model.inverse_masses[first..]) {
                    *a *= w;
                }
            });
    }
}

/// Moves every particle, on all threads: `kernel` gets its number, position, velocity, and what the
/// scheme keeps for it.
pub(super) fn update<T: Send>(
    state: &mut State,
    own: &mut [T],
    kernel: impl Fn(usize, &mut DVec3, &mut DVec3, &mut T) + Sync,
) {
    let (x, v) = (&mut state.positions[..], &mut state.velocities[..]);
    let chunks = Chunks::of(own.len());
    let move_chunk = |first: usize, x: &mut [DVec3], v: &mut [DVec3], own: &mut [T]| {
        for (k, ((x, v), own)) in x.iter_mut().zip(v).zip(own).enumerate() {
            kernel(first + k, x, v, own);
        }
    };
    if chunks.count() < 2 {
        return move_chunk(0, x, v, own); // not worth waking anybody
    }
    let size = chunks.size();
    x.par_chunks_mut(size)
        .zip(v.par_chunks_mut(size))
        .zip(own.par_chunks_mut(size))
        .enumerate()
        .for_each(|(chunk, ((x, v), own))| move_chunk(chunk * size, x, v, own));
}
