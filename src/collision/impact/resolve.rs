//! The rounds of a step: search, part what meets, search again.

use super::element::Element;
use super::examine::TIGHT;
use super::ground::Ground;
use super::search::Found;
use super::slowing::slow;
use super::stage::{Impacts, Resolved, Step, TASK};
use super::touch::separate;
use crate::state::Archive;
use crate::strain_limit::Hold;
use glam::DVec3;
use rayon::prelude::*;

/// Rounds of impulses; what then still meets becomes rigid zones. Cloth that falls on bodies or itself
/// takes 2 to 5, sheets that meet at 100 m/s 6; what 12 don't part, such as a needle at 100 m/s, 30 don't, either.
/// From half of them on floors are small.
const ROUNDS: u32 = 12;

/// Rounds of growing zones; two or three are enough for needles.
const ZONE_ROUNDS: u32 = 60;

/// Rounds after which zones also grow by the neighbours of what they meet.
const PATIENT: u32 = 4;

/// Share of the smallest floor by which targets may be missed within a round: less than what lies
/// between the target and the band of detection.
const PRECISION: f64 = 0.1;

impl Impacts {
    /// Shapes the hierarchies by where the particles are at first (m), whatever step comes first: what is found in one
    /// has their order.
    pub fn shape(&mut self, positions: &[DVec3]) {
        let vertices = &mut self.ground.vertices;
        vertices.start[..self.particles].copy_from_slice(positions);
        vertices.end[..self.particles].copy_from_slice(positions);
        self.ground.fit_solids();
        if self.ground.layers.is_some() {
            self.ground.fit_cloth(positions, 0.0);
        }
    }

    /// Carries over when and where the list of what is near was made: the rest is found again.
    pub fn carry(&mut self, archive: &mut Archive) {
        if let Some(layers) = &self.ground.layers {
            let thickness = layers.thickness;
            self.neighbours.carry(&mut self.ground, thickness, archive);
        }
    }

    /// Tells how a solid's vertices move in the coming step, in a straight line each. A solid that isn't
    /// placed stays where it is.
    pub fn place(&mut self, solid: usize, before: &[DVec3], after: &[DVec3]) {
        let vertices = &mut self.ground.vertices;
        for (i, (&x0, &x1)) in (self.firsts[solid]..).zip(before.iter().zip(after)) {
            self.solid_jump = self.solid_jump.max((x0 - vertices.end[i]).length());
            self.solid_way = self.solid_way.max((x1 - x0).length());
            vertices.start[i] = x0;
            vertices.end[i] = x1;
        }
        self.fitted = false;
    }

    /// Tells the unit normal that a plane has at the end of the coming step.
    pub fn tilt(&mut self, solid: usize, normal: DVec3) {
        for plane in &mut self.ground.planes {
            if plane.solid == solid + 1 {
                plane.normal = normal;
            }
        }
    }

    /// Leaves out, from now on, what has a corner among some particles: one entry a particle, or none at all.
    pub fn exempt(&mut self, exempt: impl Iterator<Item = bool>) {
        self.ground.exempt.clear();
        self.ground.exempt.extend(exempt);
        // What was left out has not been searched: nothing that is known holds.
        self.free = false;
        self.searched.fill(DVec3::NAN);
    }

    /// Changes the ends of a step's ways, and the velocities, so that nothing passes through anything.
    ///
    /// At the step's start nothing may cross but what is [left out](Self::exempt). Ways are straight lines from
    /// there. Of a step that is resolved again, with solids at rest, only ways that have changed since are searched,
    /// and only for meetings: what is only too close is moved once a step.
    pub fn resolve(
        &mut self,
        step: Step<'_>,
        positions: &mut [DVec3],
        velocities: &mut [DVec3],
    ) -> Resolved {
        self.rounds(step, positions, velocities, true)
    }

    /// Does the first round of [`resolve`](Self::resolve) only: moves apart once what meets, and doesn't look whether it
    /// meets anything now. The same step has to be resolved afterwards.
    ///
    /// For what moves the ends again in any case, as strain limiting does: in `twist` contact takes 0.8 of the time.
    pub fn part_once(
        &mut self,
        step: Step<'_>,
        positions: &mut [DVec3],
        velocities: &mut [DVec3],
    ) -> Resolved {
        self.rounds(step, positions, velocities, false)
    }

    fn rounds(
        &mut self,
        step: Step<'_>,
        positions: &mut [DVec3],
        velocities: &mut [DVec3],
        settle: bool,
    ) -> Resolved {
        let again = self.begin(step, positions, velocities);
        let mut resolved = Resolved::default();
        let mut found = self.search(!again);
        self.halves
            .sort(&mut self.touches, &self.ground.vertices.start);
        resolved.rounds = 1;
        let floors = self.ground.rules.iter().map(|rules| rules.floor);
        let precision = PRECISION * floors.filter(|floor| *floor > 0.0).fold(f64::MAX, f64::min);
        while found > 0 && resolved.rounds <= ROUNDS {
            if resolved.rounds == ROUNDS / 2 {
                self.ground.tight = true;
                self.touches
                    .iter_mut()
                    .for_each(|touch| touch.target = touch.tight.min(touch.target));
            }
            let precision = if self.ground.tight {
                TIGHT * precision
            } else {
                precision
            };
            let first = resolved.rounds == 1;
            separate(
                &mut self.touches,
                &mut self.ground.vertices,
                &mut self.halves,
                first,
                precision,
            );
            if !settle {
                found = 0;
                break;
            }
            found = self.search(false);
            resolved.rounds += 1;
        }
        self.part_rigidly(found, &mut resolved);
        if !self.touches.is_empty() {
            self.slow_down(step.dt, &mut resolved);
            let vertices = &self.ground.vertices;
            positions[..self.particles].copy_from_slice(&vertices.end[..self.particles]);
            velocities[..self.particles].copy_from_slice(&vertices.velocity[..self.particles]);
        }
        self.end(&resolved, settle);
        resolved
    }

    /// Adds the gaps that were kept open when the step was resolved last.
    pub fn holds(&self, holds: &mut Vec<Hold>) {
        let is_solid = |i: u32| i as usize >= self.particles;
        let ends = &self.ground.vertices.end;
        holds.extend(self.touches.iter().map(|touch| {
            let mut hold = Hold {
                particles: touch.vertices,
                weights: touch.weights,
                normal: touch.normal,
                offset: touch.target,
            };
            for k in (0..4).filter(|&k| is_solid(touch.vertices[k])) {
                let height = touch.normal.dot(ends[touch.vertices[k] as usize]);
                hold.offset -= touch.weights[k] * height;
                (hold.particles[k], hold.weights[k]) = (0, 0.0);
            }
            hold
        }));
    }

    /// Takes over where the step begins and where it would end. Returns whether it is the last one again, of which
    /// all ways were free.
    fn begin(&mut self, step: Step<'_>, positions: &[DVec3], velocities: &[DVec3]) -> bool {
        let particles = self.particles;
        let ground = &mut self.ground;
        let vertices = &mut ground.vertices;
        let still = self.solid_way == 0.0 && self.solid_jump == 0.0;
        let again = self.free && still && vertices.start[..particles] == step.before[..particles];
        vertices.start[..particles].copy_from_slice(&step.before[..particles]);
        vertices.end[..particles].copy_from_slice(&positions[..particles]);
        vertices.velocity[..particles].copy_from_slice(&velocities[..particles]);
        vertices.inverse_mass[..particles].copy_from_slice(&step.inverse_masses[..particles]);
        for i in particles..vertices.end.len() {
            vertices.velocity[i] = (vertices.end[i] - vertices.start[i]) / step.dt;
        }
        let solids = !ground.solid.is_empty();
        for (element, clear) in ground.cloth.iter().zip(&mut self.clear).filter(|_| solids) {
            let jump = |i: u32| (vertices.start[i as usize] - self.searched[i as usize]).length();
            let jumps = element.corners.map(jump);
            *clear -= jumps.into_iter().fold(self.solid_jump, f64::max);
            if jumps.iter().any(|jump| jump.is_nan()) {
                *clear = f64::NEG_INFINITY;
            }
        }
        if !self.fitted {
            self.ground.fit_solids();
        }
        self.ground.tight = false;
        self.touches.clear();
        self.zones.clear(&mut self.ground);
        again
    }

    /// Searches all ways, also for what is only too close, or those that have changed since the last search. Returns the
    /// number of meetings, whose touches are added to the step's.
    fn search(&mut self, first: bool) -> usize {
        let known = self.touches.len();
        self.mark_stale(first);
        if !self.ground.solid.is_empty() {
            self.choose(|stage, number, element| {
                let clear = stage.clear[number as usize];
                let near = || clear <= stage.ground.way(element) + stage.solid_way;
                if first {
                    near()
                } else {
                    stage.ground.is_stale(element)
                }
            });
            self.ask(|ground, number, found| ground.against_solids(number, first, found));
        }
        if let Some(layers) = &self.ground.layers {
            let thickness = layers.thickness;
            self.neighbours.renew(&mut self.ground, thickness, first);
            self.neighbours
                .search(&self.ground, thickness, first, &mut self.found);
            for found in &self.found[..self.neighbours.parts()] {
                self.touches.extend_from_slice(&found.touches);
            }
        }
        self.ground
            .against_planes(self.particles, first, &mut self.touches);
        for touch in &self.touches[known..] {
            // Searched again in any case, whether or not anything moves them.
            for vertex in touch.vertices {
                self.searched[vertex as usize] = DVec3::NAN;
            }
        }
        self.touches.len() - known
    }

    /// Marks the vertices whose ways aren't those of the last search, and remembers these.
    fn mark_stale(&mut self, first: bool) {
        let Self {
            ground, searched, ..
        } = self;
        let ways = ground.vertices.end.iter().zip(searched);
        for (stale, (end, searched)) in ground.stale.iter_mut().zip(ways) {
            *stale = first || *end != *searched; // also with a NaN
            *searched = *end;
        }
    }

    /// Chooses the elements to look for.
    fn choose(&mut self, chosen: impl Fn(&Self, u32, &Element) -> bool) {
        let mut asked = std::mem::take(&mut self.asked);
        asked.clear();
        let numbers = (0..).zip(&self.ground.cloth);
        asked.extend(numbers.filter_map(|(k, one)| chosen(self, k, one).then_some(k)));
        self.asked = asked;
    }

    /// Lets all threads look for the chosen elements.
    fn ask(&mut self, look: impl Fn(&Ground, u32, &mut Found) + Sync) {
        let asked = std::mem::take(&mut self.asked);
        let chunks = asked.len().div_ceil(TASK);
        self.work(chunks, |ground, chunk, found| {
            for &number in asked.iter().skip(chunk * TASK).take(TASK) {
                look(ground, number, found);
            }
        });
        self.asked = asked;
    }

    /// Lets all threads do tasks, and takes over what they find in the tasks' order.
    fn work(&mut self, tasks: usize, look: impl Fn(&Ground, usize, &mut Found) + Sync) {
        let ground = &self.ground;
        let all = self.found[..tasks].par_iter_mut().enumerate();
        all.for_each(|(task, found)| {
            found.touches.clear();
            found.clear.clear();
            look(ground, task, found);
        });
        for found in &self.found[..tasks] {
            self.touches.extend_from_slice(&found.touches);
            for &(number, clear) in &found.clear {
                self.clear[number as usize] = clear;
            }
        }
    }

    /// Parts what impulses didn't by rigid zones; what these can't, either, is counted.
    fn part_rigidly(&mut self, mut found: usize, resolved: &mut Resolved) {
        let mut round = 0;
        while found > 0 && round < ZONE_ROUNDS {
            let new = self.touches.len() - found;
            let around = if round < PATIENT {
                &[]
            } else {
                &self.ground.cloth[..]
            };
            self.zones.join(&self.touches[new..], around);
            self.zones.displace(&mut self.ground);
            found = self.search(false);
            round += 1;
        }
        if found > 0 && self.solid_way == 0.0 {
            // Where everything was is free.
            let vertices = &mut self.ground.vertices;
            for i in 0..self.particles {
                if vertices.inverse_mass[i] > 0.0 {
                    vertices.end[i] = vertices.start[i];
                }
            }
            found = self.search(false);
            round += 1;
        }
        resolved.rounds += round;
        resolved.zones = self.zones.count();
        resolved.missed = found;
    }

    /// Takes from the velocities what the touches and zones take.
    fn slow_down(&mut self, dt: f64, resolved: &mut Resolved) {
        let vertices = &mut self.ground.vertices;
        let mut slowed = slow(&mut self.touches, vertices, &mut self.halves);
        self.zones.slow(vertices, dt, &mut slowed);
        resolved.approach = slowed.approach;
        resolved.friction = slowed.friction;
        resolved.work = slowed.work;
        resolved.impacts = self.touches.len();
        resolved.moved = true;
    }

    /// Remembers where everything is, and what is known of clearances.
    fn end(&mut self, resolved: &Resolved, settled: bool) {
        let solids = !self.ground.solid.is_empty();
        let elements = self.ground.cloth.iter().zip(&mut self.clear);
        for (element, clear) in elements.filter(|_| solids) {
            *clear -= self.ground.way(element) + self.solid_way;
        }
        let vertices = &mut self.ground.vertices;
        if settled {
            self.searched.copy_from_slice(&vertices.end);
        }
        self.fitted = self.solid_way == 0.0;
        self.free = self.fitted && resolved.missed == 0;
        if !self.fitted {
            let solids = self.particles..;
            vertices.start[solids.clone()].copy_from_slice(&vertices.end[solids]);
        }
        self.solid_way = 0.0;
        self.solid_jump = 0.0;
    }
}
