//! Velocity Verlet, with damping.
//!
//! Source: Swope et al. 1982; the prediction of the velocity is that of Groot and Warren 1997 with
//! λ = 1.

use super::Scheme;
use crate::collision::Contacts;
use crate::force::ForcePass;
use crate::linear::{Chunks, Solve};
use crate::model::Model;
use crate::state::{Archive, State};
use glam::DVec3;
use std::any::Any;

/// The scheme's pass and work arrays; one entry a particle.
#[derive(Debug)]
pub(super) struct Verlet {
    pass: ForcePass,
    /// Forces of the laws (N) at `at`, which the next step begins with.
    forces: Vec<DVec3>,
    /// Positions at which `forces` was taken (m), where limits or contact may have moved particles since;
    /// empty without them.
    at: Vec<DVec3>,
    /// Releases of pins that had happened then: they change stiffnesses. None before the first step.
    released: Option<usize>,
    /// Forces of damping (N); empty without.
    damping: Vec<DVec3>,
    /// Velocities in the middle of the step (m/s), then at its end.
    middle: Vec<DVec3>,
}

impl Verlet {
    pub(super) fn new(model: &Model) -> Self {
        let zero = vec![DVec3::ZERO; model.particles()];
        let moves = model.is_corrected();
        let pass = model.force_pass();
        Self {
            forces: zero.clone(),
            at: vec![DVec3::ZERO; if moves { model.particles() } else { 0 }],
            released: None,
            damping: vec![
                DVec3::ZERO;
                if pass.is_damped() {
                    model.particles()
                } else {
                    0
                }
            ],
            middle: zero,
            pass,
        }
    }

    /// Takes the laws' forces at a state, unless the last step has left them.
    fn begin(&mut self, model: &Model, before: &State) {
        let Self {
            pass,
            forces,
            at,
            released,
            ..
        } = self;
        if *released != Some(model.released()) {
            *pass = model.force_pass(); // hinges at clamps have changed
        }
        // Where pins are driven differs in the last bit from where they were driven to.
        let stays = |i: usize| at[i] == before.positions[i] || model.is_pinned(i);
        if *released != Some(model.released()) || !(0..at.len()).all(stays) {
            *released = Some(model.released());
            pass.set_laws(before, forces, (), |_, _, ()| {});
        }
    }

    /// v½ = v₀ + dt/2 a(x₀, v₀), x₁ = x₀ + dt v½, and with damping v̂.
    fn kick_and_drift(&mut self, model: &Model, dt: f64, before: &State, state: &mut State) {
        let Self {
            pass,
            forces,
            damping,
            middle,
            ..
        } = self;
        let half = |i: usize| 0.5 * dt * model.inverse_masses[i];
        let own = (&mut state.positions[..], &mut middle[..]);
        if pass.is_damped() {
            let own = (&mut state.velocities[..], own);
            pass.set_dampings(before, damping, own, |first, damping, (v, (x, middle))| {
                for k in 0..damping.len() {
                    let i = first + k;
                    let gain = (forces[i] + damping[k]) * half(i);
                    middle[k] = before.velocities[i] + gain;
                    x[k] = before.positions[i] + middle[k] * dt;
                    v[k] = middle[k] + gain;
                }
            });
        } else {
            let chunks = Chunks::of(forces.len());
            chunks.for_each_of(own, |chunk, (x, middle)| {
                let first = chunks.range(chunk).start;
                for (k, (x, middle)) in x.iter_mut().zip(middle).enumerate() {
                    let i = first + k;
                    *middle = before.velocities[i] + forces[i] * half(i);
                    *x = before.positions[i] + *middle * dt;
                }
            });
        }
    }

    /// Sets `middle` to v₁ = v½ + dt/2 a(x₁, v̂).
    fn kick(&mut self, model: &Model, dt: f64, state: &State) {
        let Self {
            pass,
            forces,
            damping,
            middle,
            ..
        } = self;
        let kick = |first: usize, forces: &[DVec3], middle: &mut [DVec3]| {
            for (k, (f, v)) in forces.iter().zip(middle).enumerate() {
                *v += *f * (0.5 * dt * model.inverse_masses[first + k]);
            }
        };
        let own = (&mut middle[..], &model.inverse_masses[..]);
        pass.set_laws(state, forces, own, |first, forces, (middle, _)| {
            kick(first, forces, middle);
        });
        if pass.is_damped() {
            pass.set_dampings(state, damping, &mut middle[..], |first, damping, middle| {
                kick(first, damping, middle);
            });
        }
    }
}

impl Scheme for Verlet {
    /// v½ = v₀ + dt/2 a(x₀, v₀), x₁ = x₀ + dt v½, v₁ = v½ + dt/2 a(x₁, v̂) with v̂ = v₀ + dt a(x₀, v₀).
    ///
    /// Damping asks for v₁ itself on the right; the prediction v̂ is off by dt², which leaves the
    /// scheme of second order. Without damping it is symplectic and stable for dt ω ≤ 2. One pass of
    /// the laws' forces a step.
    fn advance(
        &mut self,
        model: &Model,
        _: &mut Contacts,
        dt: f64,
        before: &State,
        state: &mut State,
    ) -> Solve {
        self.begin(model, before);
        self.kick_and_drift(model, dt, before, state);
        state.time = before.time + dt;
        model.drive(state);
        self.kick(model, dt, state);
        let moves = self.at.len();
        self.at.copy_from_slice(&state.positions[..moves]);
        std::mem::swap(&mut state.velocities, &mut self.middle);
        Solve::NONE
    }

    fn follow(&mut self, other: &dyn Scheme) {
        let Some(other) = (other as &dyn Any).downcast_ref::<Self>() else {
            return;
        };
        if self.released == other.released {
            self.forces.copy_from_slice(&other.forces);
            self.at.copy_from_slice(&other.at);
        } else {
            self.released = None;
        }
    }

    fn carry(&mut self, _: &Model, archive: &mut Archive) {
        archive.vectors(&mut self.forces);
        archive.vectors(&mut self.at);
        archive.option(&mut self.released, Archive::index);
    }
}

/// A step of x″ = a(x, v).
pub(super) fn test_step(a: impl Fn(f64, f64) -> f64, dt: f64, [x, v]: [f64; 2]) -> [f64; 2] {
    let gain = 0.5 * dt * a(x, v);
    let middle = v + gain;
    let moved = x + dt * middle;
    [moved, middle + 0.5 * dt * a(moved, middle + gain)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene;

    /// The model of a small sheet with some changes, and its state.
    fn sheet(changes: &[&str]) -> (Model, State) {
        let undamped = ["cloth.0.damping.mass=0.0", "cloth.0.damping.stiffness=0.0"];
        let all = ["cloth.0.shape.sheet.cells=[6, 6]"]
            .into_iter()
            .chain(undamped);
        let changes: Vec<String> = all
            .chain(changes.iter().copied())
            .map(str::to_owned)
            .collect();
        let loaded = scene::load("hanging-cloth", &changes).unwrap();
        let built = scene::build(&loaded).unwrap();
        (built.model, built.state)
    }

    fn advance(verlet: &mut Verlet, model: &Model, before: &State, dt: f64) -> State {
        let mut state = State::at_rest(vec![DVec3::ZERO; model.particles()]);
        verlet.advance(model, &mut model.no_contacts(), dt, before, &mut state);
        state
    }

    /// What limits or contact have moved is gone on with as from a first state: nothing is left over of where
    /// the last step had ended.
    #[test]
    fn what_was_moved_since_is_seen() {
        for change in ["strain_limit.max=0.1", "self_collision.thickness=0.001"] {
            let (model, start) = sheet(&[change]);
            let mut verlet = Verlet::new(&model);
            let mut moved = advance(&mut verlet, &model, &start, 1e-3);
            moved.positions[20] += DVec3::new(0.01, 0.02, -0.01);
            let on = advance(&mut verlet, &model, &moved, 1e-3);
            let anew = advance(&mut Verlet::new(&model), &model, &moved, 1e-3);
            assert_eq!(on.positions, anew.positions, "{change}");
            assert_eq!(on.velocities, anew.velocities, "{change}");
        }
    }
}
