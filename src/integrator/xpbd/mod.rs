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
mod course;
mod element;
mod packed;
mod relax;

use super::Scheme;
use crate::collision::Contacts;
use crate::linear::team::{self, Member};
use crate::linear::{Ahead, Solve};
use crate::model::Model;
use crate::state::State;
use cluster::{Cluster, Plan};
use course::TILE;
use glam::DVec3;
use relax::{Pace, Part, Patch, relax};
use std::array;
use std::ops::Range;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// The scheme's constraints and work array.
#[derive(Debug)]
pub(super) struct Xpbd {
    iterations: u32,
    /// Releases of pins that the constraints know of.
    released: usize,
    /// The pinned particles.
    pinned: Vec<usize>,
    plan: Plan,
}

impl Xpbd {
    pub(super) fn new(model: &Model, iterations: u32) -> Self {
        Self {
            iterations,
            released: model.released(),
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
            state.positions[i] += state.velocities[i] * dt;
        }
        let size = self.plan.chunks.size();
        let positions = state.positions.chunks_mut(size);
        let lanes = positions
            .zip(state.velocities.chunks_mut(size))
            .map(|(x, v)| Mutex::new(Lane { x, v }));
        let lanes: Vec<Mutex<Lane<'_>>> = lanes.collect();
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
            let last = sweep + 1 == self.iterations;
            for (color, phase) in self.plan.phases.iter().enumerate() {
                for number in member.share(phase.len()) {
                    // The first colour has the clusters inside of each chunk, in order.
                    if color == 0 {
                        self.sweep(number, pace, last);
                    } else {
                        self.relax(phase.start + number, pace);
                    }
                }
                member.wait();
            }
        }
        for chunk in member.share(self.lanes.len()) {
            let mut lane = self.lane(chunk);
            for &i in &self.plan.shared[chunk] {
                self.finish(chunk, &mut lane, i as usize..i as usize + 1);
            }
        }
    }

    /// Relaxes the constraints inside of a chunk; what comes before the first sweep and after the
    /// last is done along the way.
    fn sweep(&self, chunk: usize, pace: Pace, last: bool) {
        let mut cluster = self.cluster(chunk);
        let mut lane = self.lane(chunk);
        let all = lane.x.len();
        let mut done = 0;
        let mut ahead = Ahead::default();
        for stage in 0..cluster.settled.len() {
            if pace.first {
                self.predict(chunk, lane.x, stage * TILE..all.min((stage + 1) * TILE));
            }
            ahead.begin(cluster.springs.batches(stage));
            self.expect(&mut ahead, chunk, &lane, stage + 1);
            cluster.springs.add_to(&mut ahead, stage + 1);
            let part = self.part(chunk, lane.x);
            relax(&mut cluster, stage, &mut Patch([part]), pace, &mut ahead);
            if last {
                let settled = cluster.settled[stage]
                    .min((stage + 1) * TILE)
                    .clamp(done, all);
                self.finish(chunk, &mut lane, done..settled);
                done = settled;
            }
        }
    }

    /// Adds a stage's particles to what is asked for ahead of its use.
    fn expect(&self, ahead: &mut Ahead, chunk: usize, lane: &Lane<'_>, stage: usize) {
        let tile = stage * TILE..(stage + 1) * TILE;
        let first = self.plan.chunks.range(chunk).start;
        let all = first + tile.start..first + tile.end;
        ahead.add(&self.before.positions, all.clone());
        ahead.add(&self.before.velocities, all.clone());
        ahead.add(&self.model.inverse_masses, all);
        ahead.add(lane.x, tile.clone());
        ahead.add(lane.v, tile);
    }

    fn lane(&self, chunk: usize) -> MutexGuard<'_, Lane<'a>> {
        self.lanes[chunk]
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
    }

    fn cluster(&self, cluster: usize) -> MutexGuard<'a, Cluster> {
        self.plan.clusters[cluster]
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
    }

    /// Where some free particles of a chunk go without constraints.
    fn predict(&self, chunk: usize, x: &mut [DVec3], range: Range<usize>) {
        let Self {
            model, before, dt, ..
        } = self;
        let first = self.plan.chunks.range(chunk).start;
        let all = first + range.start..first + range.end;
        let gain = model.gravity.acceleration * *dt;
        let drag = model.mass_damping.as_ref();
        let drag = drag.map(|damping| &damping.drag[all.clone()]);
        let weights = &model.inverse_masses[all.clone()];
        let start = &before.positions[all.clone()];
        let velocities = &before.velocities[all];
        let x = &mut x[range];
        for i in 0..x.len() {
            if weights[i] > 0.0 {
                let mut velocity = velocities[i] + gain;
                if let Some(drag) = drag {
                    velocity /= 1.0 + dt * drag[i] * weights[i];
                }
                x[i] = start[i] + velocity * *dt;
            }
        }
    }

    /// A chunk at its positions.
    fn part<'b>(&'b self, chunk: usize, x: &'b mut [DVec3]) -> Part<'b> {
        let range = self.plan.chunks.range(chunk);
        Part {
            x,
            w: &self.model.inverse_masses[range.clone()],
            start: &self.before.positions[range],
        }
    }

    fn relax(&self, cluster: usize, pace: Pace) {
        let mut cluster = self.cluster(cluster);
        match cluster.chunks.len() {
            2 => self.relax_in::<2>(&mut cluster, pace),
            3 => self.relax_in::<3>(&mut cluster, pace),
            _ => self.relax_in::<4>(&mut cluster, pace),
        }
    }

    /// Relaxes a cluster of `N` chunks.
    fn relax_in<const N: usize>(&self, cluster: &mut Cluster, pace: Pace) {
        let mut lanes: [_; N] = array::from_fn(|slot| self.lane(cluster.chunks[slot]));
        let mut slots = 0..N;
        let parts = lanes.each_mut().map(|lane| {
            let chunk = cluster.chunks[slots.next().unwrap_or_default()];
            self.part(chunk, lane.x)
        });
        relax(cluster, 0, &mut Patch(parts), pace, &mut Ahead::default());
    }

    /// Takes the velocities of some of a chunk's particles from their positions.
    fn finish(&self, chunk: usize, lane: &mut Lane<'_>, range: Range<usize>) {
        let per_dt = self.dt.recip();
        let Part { x, w, start } = self.part(chunk, lane.x);
        for i in range {
            if w[i] > 0.0 {
                lane.v[i] = (x[i] - start[i]) * per_dt;
            }
        }
    }
}
