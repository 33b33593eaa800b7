//! What the explicit schemes share: accelerations of a state, and how particles are moved.

use crate::force::ForcePass;
use crate::linear::Shared;
use crate::model::Model;
use crate::state::State;
use glam::DVec3;

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

    /// Sets `to` to what `kernel` makes of each particle's number and f(x, v)/m (m/s²) at a state, all in
    /// one pass: beyond the caches, a pass over memory takes longer than the springs. `reads` are the lists
    /// besides the state's that the kernel looks at, asked for ahead of that.
    pub(super) fn step(
        &mut self,
        model: &Model,
        at: &State,
        to: [&mut [DVec3]; 2],
        reads: impl Shared,
        kernel: impl Fn(usize, DVec3) -> [DVec3; 2] + Sync,
    ) {
        // The forces stand where the new velocities will.
        let [positions, velocities] = to;
        let own = (positions, (&model.inverse_masses[..], reads));
        self.pass(model)
            .set_all(at, velocities, own, |first, forces, (x, (weights, _))| {
                let each = forces.iter_mut().zip(x).zip(weights);
                for (k, ((v, x), w)) in each.enumerate() {
                    [*x, *v] = kernel(first + k, *v * *w);
                }
            });
    }

    /// The pass, with the laws cut anew when pins have let go.
    pub(super) fn pass(&mut self, model: &Model) -> &ForcePass {
        if self.released != model.released() {
            *self = Self::new(model);
        }
        &self.pass
    }

    /// Sets f(x, v)/m of each particle (m/s²), all laws and dampings; 0 for pinned ones.
    pub(super) fn set(&mut self, model: &Model, state: &State, accelerations: &mut [DVec3]) {
        self.pass(model)
            .set_all(state, accelerations, (), |first, forces, ()| {
                for (a, &w) in forces.iter_mut().zip(&model.inverse_masses[first..]) {
                    *a *= w;
                }
            });
    }
}

/// A state's positions and velocities, to be set.
pub(super) fn parts(state: &mut State) -> [&mut [DVec3]; 2] {
    [&mut state.positions, &mut state.velocities]
}
