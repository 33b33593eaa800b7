//! What the explicit schemes share: accelerations of a state.

use crate::model::Model;
use crate::state::State;
use glam::DVec3;

/// f(x, v)/m of each particle (m/s²), all laws and dampings; 0 for pinned ones.
pub(super) fn accelerations(model: &Model, state: &State, accelerations: &mut [DVec3]) {
    accelerations.fill(DVec3::ZERO);
    for force in model.forces() {
        force.add_forces(state, accelerations);
    }
    for damping in model.dampings() {
        damping.add_forces(state, accelerations);
    }
    for (a, &w) in accelerations.iter_mut().zip(&model.inverse_masses) {
        *a *= w;
    }
}
