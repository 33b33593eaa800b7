//! Position-based dynamics with compliance (XPBD), in small steps.
//!
//! Source: Macklin, Müller and Chentanez 2016; small steps of one sweep: Macklin et al. 2019.
//!
//! A step predicts positions from velocities and gravity alone, relaxes each spring and hinge in turn
//! as an implicit step of that one element would, and takes the velocities from the positions. One
//! sweep does not solve the implicit equations: what is left over makes cloth softer, the more the
//! larger dt² k/m, and is gone as dt → 0.

mod cluster;
mod color;
mod relax;

use super::Scheme;
use crate::collision::Contacts;
use crate::linear::Solve;
use crate::linear::team::{self, Member};
use crate::model::Model;
use crate::state::State;
use cluster::{CHUNK, Plan};
use glam::DVec3;
use relax::{Pace, Part, Particle, Patch, relax};
use std::array;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// The scheme's constraints and work array.
#[derive(Debug)]
pub(super) struct Xpbd {
    iterations: u32,
    /// Releases of pins that the constraints know of.
    released: usize,
    /// The particles in the middle of a step, filled up to whole chunks.
    particles: Vec<Particle>,
    /// The pinned ones.
    pinned: Vec<usize>,
    plan: Plan,
}

impl Xpbd {
    pub(super) fn new(model: &Model, iterations: u32) -> Self {
        let mut particles = vec![Particle::default(); model.particles().next_multiple_of(CHUNK)];
        for (particle, &w) in particles.iter_mut().zip(&model.inverse_masses) {
            particle.w = w;
        }
        Self {
            iterations,
            released: model.released(),
            particles,
            pinned: (0..model.particles())
                .filter(|&i| model.is_pinned(i))
                .collect(),
            plan: Plan::of(model, iterations),
        }
    }
}

impl Scheme for Xpbd {
    /// v̂ = (v₀ + dt g)/(1 + c dt), x̂ = x₀ + dt v̂; x₁ = x̂ after `iterations` sweeps over all
    /// constraints; v₁ = (x₁ − x₀)/dt. Pinned particles move at the velocity that they have.
    ///
    /// First order. Runs on all threads of the pool it is called in; the result doesn't depend on
    /// their number.
    fn advance(
        &mut self,
        model: &Model,
        _: &mut Contacts,
        dt: f64,
        before: &State,
        state: &mut State,
    ) -> Solve {
        if self.released != model.released() {
            *self = Self::new(model, self.iterations);
        }
        for &i in &self.pinned {
            state.positions[i] = before.positions[i];
            state.velocities[i] = before.velocities[i];
        }
        state.time = before.time;
        model.aim(dt, state);
        for &i in &self.pinned {
            self.particles[i].x = state.positions[i] + state.velocities[i] * dt;
        }
        let lanes: Vec<Mutex<Lane<'_>>> = self
            .particles
            .as_chunks_mut::<CHUNK>()
            .0
            .iter_mut()
            .zip(state.positions.chunks_mut(CHUNK))
            .zip(state.velocities.chunks_mut(CHUNK))
            .map(|((now, x), v)| Mutex::new(Lane { now, x, v }))
            .collect();
        let threads = rayon::current_num_threads().min(lanes.len());
        let step = Step {
            plan: &self.plan,
            iterations: self.iterations,
            model,
            before,
            dt,
            lanes,
        };
        team::run(threads, |member| step.run(member));
        Solve::NONE
    }
}

/// One chunk of particles.
struct Lane<'a> {
    now: &'a mut [Particle; CHUNK],
    x: &'a mut [DVec3],
    v: &'a mut [DVec3],
}

/// What the threads of a step share.
struct Step<'a> {
    plan: &'a Plan,
    iterations: u32,
    model: &'a Model,
    before: &'a State,
    dt: f64,
    lanes: Vec<Mutex<Lane<'a>>>,
}

impl<'a> Step<'a> {
    /// The whole step, as one thread goes through it. No lock is ever waited for: threads work on
    /// chunks of their own, or on clusters of one colour.
    fn run(&self, member: &Member<'_>) {
        for sweep in 0..self.iterations {
            let per_dt = self.dt.recip();
            let pace = Pace {
                per_dt,
                per_dt_squared: per_dt * per_dt,
                first: sweep == 0,
            };
            for (color, phase) in self.plan.phases.iter().enumerate() {
                for number in member.share(phase.len()) {
                    // The first colour has the clusters inside of each chunk, in order.
                    if color == 0 && sweep == 0 {
                        self.predict(number);
                    }
                    self.relax(phase.start + number, pace);
                }
                member.wait();
            }
        }
        for chunk in member.share(self.lanes.len()) {
            self.finish(chunk);
        }
    }

    fn lane(&self, chunk: usize) -> MutexGuard<'_, Lane<'a>> {
        self.lanes[chunk]
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
    }

    /// Where the free particles of a chunk go without constraints.
    fn predict(&self, chunk: usize) {
        let Self {
            model, before, dt, ..
        } = self;
        let mut lane = self.lane(chunk);
        let now = &mut lane.now;
        let first = chunk * CHUNK;
        let particles = before.positions[first..]
            .iter()
            .zip(&before.velocities[first..]);
        let gain = model.gravity.acceleration * *dt;
        let drag = model.mass_damping.as_ref();
        let drag = drag.map(|damping| &damping.drag[chunk * CHUNK..]);
        for (i, (now, (x, v))) in now.iter_mut().zip(particles).enumerate() {
            if now.w > 0.0 {
                let mut velocity = *v + gain;
                if let Some(drag) = drag {
                    velocity /= 1.0 + dt * drag[i] * now.w;
                }
                now.x = *x + velocity * *dt;
            }
        }
    }

    fn relax(&self, cluster: usize, pace: Pace) {
        let mut cluster = self.plan.clusters[cluster]
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        match cluster.chunks.len() {
            1 => self.relax_in::<1>(&mut cluster, pace),
            2 => self.relax_in::<2>(&mut cluster, pace),
            3 => self.relax_in::<3>(&mut cluster, pace),
            _ => self.relax_in::<4>(&mut cluster, pace),
        }
    }

    /// Relaxes a cluster of `N` chunks.
    fn relax_in<const N: usize>(&self, cluster: &mut cluster::Cluster, pace: Pace) {
        let mut lanes: [_; N] = array::from_fn(|slot| self.lane(cluster.chunks[slot]));
        let mut parts = lanes.each_mut().map(|lane| {
            let lane = &mut **lane;
            Part {
                now: lane.now,
                start: &[],
            }
        });
        for (part, &chunk) in parts.iter_mut().zip(&cluster.chunks) {
            part.start = &self.before.positions[chunk * CHUNK..];
        }
        relax(cluster, &mut Patch(parts), pace);
    }

    /// Takes a chunk's positions, and the velocities from them.
    fn finish(&self, chunk: usize) {
        let per_dt = self.dt.recip();
        let mut lane = self.lane(chunk);
        let Lane { now, x, v } = &mut *lane;
        let before = &self.before.positions[chunk * CHUNK..];
        for i in 0..x.len() {
            if now[i].w > 0.0 {
                v[i] = (now[i].x - before[i]) * per_dt;
            }
            x[i] = now[i].x;
        }
    }
}
