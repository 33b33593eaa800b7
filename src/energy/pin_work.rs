//! The work that moving pins do.

use crate::model::Model;
use crate::state::State;
use glam::DVec3;

/// Measures the work of driven particles step by step, from the elements that touch them alone.
///
/// A pin's force is what its particle lacks, m a − f, with f all other forces on it, so that its work in
/// a step is W = Δ(½ m v²) − ∫ f · dx (J). The integral is the trapezoid's, of second order in the step.
#[derive(Debug)]
pub struct PinWork {
    /// The elements around the driven particles, and these and their neighbours.
    part: Model,
    /// Number in the model of each particle of the part, the driven ones first.
    particles: Vec<u32>,
    /// How many are driven.
    driven: usize,
    /// Releases that had happened when the part was taken.
    released: usize,
    /// The part's state at the start of the step, and at its end.
    states: [State; 2],
    /// The forces then (N).
    forces: [Vec<DVec3>; 2],
}

impl PinWork {
    /// Ready for the first step; `None` where no pin moves.
    pub fn new(model: &Model) -> Option<Self> {
        (!model.pins.drives.is_empty()).then(|| Self::of(model))
    }

    /// Size of its lists (B).
    pub fn bytes(&self) -> usize {
        let states = self
            .states
            .iter()
            .map(|state| size_of_val(&state.positions[..]) + size_of_val(&state.velocities[..]));
        let forces = self.forces.iter().map(|forces| size_of_val(&forces[..]));
        let own = states.chain(forces).sum::<usize>();
        own + self.part.memory().total() + size_of_val(&self.particles[..])
    }

    fn of(model: &Model) -> Self {
        let (part, particles) = model.around(model.driven());
        let zero = vec![DVec3::ZERO; particles.len()];
        let state = State::at_rest(zero.clone());
        Self {
            part,
            particles,
            driven: model.driven().count(),
            released: model.released(),
            states: [state.clone(), state],
            forces: [zero.clone(), zero],
        }
    }

    /// The work during a step of a model (J), from the state before to the one that the scheme has
    /// reached. Only a release makes it take its elements anew.
    pub fn of_step(&mut self, model: &Model, before: &State, after: &State) -> f64 {
        if self.released != model.released() {
            *self = Self::of(model);
        }
        for (n, whole) in [before, after].into_iter().enumerate() {
            let (state, forces) = (&mut self.states[n], &mut self.forces[n]);
            for (local, &i) in self.particles.iter().enumerate() {
                state.positions[local] = whole.positions[i as usize];
                state.velocities[local] = whole.velocities[i as usize];
            }
            forces.fill(DVec3::ZERO);
            for law in self.part.forces() {
                law.add_forces(state, forces);
            }
            for damping in self.part.dampings() {
                damping.add_forces(state, forces);
            }
        }
        let [from, to] = &self.states;
        let one = |i: usize| {
            let moved = to.positions[i] - from.positions[i];
            let [v0, v1] = [from.velocities[i], to.velocities[i]];
            let gained = v1.length_squared() - v0.length_squared();
            let others = (self.forces[0][i] + self.forces[1][i]).dot(moved);
            0.5 * (self.part.masses[i] * gained - others)
        };
        (0..self.driven).map(one).sum()
    }
}
