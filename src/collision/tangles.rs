//! Cloth that starts inside a body, across it or across other cloth, and how it gets out.
//!
//! All that contact does holds only where nothing crosses at first: a particle that is put out at once is
//! thrown by its springs, and continuous detection would keep in what is in. So what starts tangled is taken
//! out of both until an exact look finds it free, and led out over [`TIME`] without velocity:
//!
//! - particles inside go to the nearest point outside, by depth · dt / (time left) in a step;
//! - edges and triangles that cross a body between their corners are lifted along the mean normal at these;
//! - crossing cloth goes along the gradient of the length of what it has in common (Volino and
//!   Magnenat-Thalmann 2006, "Resolving surface collisions through intersection contour minimization").
//!
//! Cloth that crosses cloth deeply, or runs through a thin body from side to side, may stay as it is; it is
//! counted then.

use super::audit::Crossings;
use super::{Audit, Bodies, Contacts, Masses, Obstacle, Response, Tangle};
use crate::state::{Archive, State};
use crate::strain_limit::Wall;
use glam::DVec3;
use std::collections::BTreeMap;

/// Within this time (s) particles that start inside a body are outside: a tenth of a metre goes at 0.4 m/s,
/// about as fast as cloth falls in 4 cm.
pub const TIME: f64 = 0.25;

/// Times [`TIME`] after which what still crosses is left alone.
const PATIENCE: f64 = 4.0;

/// Longest edges in [`TIME`] that what crosses a body is lifted by: 1.6 mm in a step of 4 ms for edges of 25 mm. With
/// one, the weight of what hangs at a sharp edge pulls it back as fast.
const PACE: f64 = 4.0;

/// Cloth that starts tangled.
#[derive(Clone, Debug)]
pub struct Tangles {
    audit: Audit,
    /// One entry a particle.
    tangles: Vec<Tangle>,
    crossings: Crossings,
    /// The third corners of the triangles at each edge.
    wings: BTreeMap<[u32; 2], Vec<u32>>,
    /// Longest edge at each particle (m).
    reach: Vec<f64>,
    /// Where crossing cloth is pushed, scratch.
    pushes: Vec<DVec3>,
    /// Particles that are tangled now.
    count: usize,
    /// Time at which all started (s).
    start: f64,
    /// Largest speed that cloth started with, or that bodies and pins had since (m/s).
    speed: f64,
}

/// Where cloth is, and what it may not pass through.
#[derive(Clone, Copy, Debug)]
pub struct Scenery<'a> {
    /// The obstacles.
    pub obstacles: &'a [Obstacle],
    /// The same as they stand.
    pub bodies: &'a Bodies,
}

impl Tangles {
    /// The particles that start tangled; `None` where none does.
    pub fn new(
        mut audit: Audit,
        scenery: Scenery<'_>,
        cloth: usize,
        state: &State,
    ) -> Option<Self> {
        let positions = &state.positions[..cloth];
        let mut tangles = vec![Tangle::Free; cloth];
        let crossings = audit.tangles(scenery.obstacles, scenery.bodies, positions, &mut tangles);
        let count = tangled(&tangles);
        if count == 0 {
            return None;
        }
        let mut reach = vec![0.0_f64; positions.len()];
        for edge in audit.edges() {
            let [a, b] = edge.map(|i| i as usize);
            let length = positions[a].distance(positions[b]);
            reach[a] = reach[a].max(length);
            reach[b] = reach[b].max(length);
        }
        let mut wings: BTreeMap<[u32; 2], Vec<u32>> = BTreeMap::new();
        for &[a, b, c] in audit.triangles() {
            for [u, v, w] in [[a, b, c], [b, c, a], [c, a, b]] {
                wings.entry([u.min(v), u.max(v)]).or_default().push(w);
            }
        }
        Some(Self {
            audit,
            pushes: vec![DVec3::ZERO; positions.len()],
            tangles,
            crossings,
            wings,
            reach,
            count,
            start: state.time,
            speed: state
                .velocities
                .iter()
                .map(|v| v.length())
                .fold(0.0, f64::max),
        })
    }

    /// Carries over what the start doesn't say.
    pub fn carry(&mut self, archive: &mut Archive) {
        archive.each(&mut self.tangles, |archive, tangle| tangle.carry(archive));
        let corner = |archive: &mut Archive, i: &mut u32| archive.small(i);
        archive.list(&mut self.crossings.bodies, |archive, (body, corners)| {
            archive.index(body);
            archive.each(corners, corner);
        });
        archive.list(&mut self.crossings.cloth, |archive, (edge, triangle)| {
            archive.each(edge, corner);
            archive.each(triangle, corner);
        });
        archive.index(&mut self.count);
        archive.real(&mut self.start);
        archive.real(&mut self.speed);
    }

    /// Particles that are tangled now.
    pub fn count(&self) -> usize {
        self.count
    }

    /// Whether a particle is tangled.
    pub fn is_tangled(&self, particle: usize) -> bool {
        (self.tangles.get(particle)).is_some_and(|tangle| *tangle != Tangle::Free)
    }

    /// What each particle is caught in.
    pub fn list(&self) -> &[Tangle] {
        &self.tangles
    }

    /// Whether crossings are given up, so that a look now and then is enough.
    pub fn is_given_up(&self, time: f64) -> bool {
        time > self.start + PATIENCE * TIME
    }

    /// Looks again: what is free from now on is kept free by contact.
    pub fn look(&mut self, scenery: Scenery<'_>, positions: &[DVec3]) {
        let Scenery { obstacles, bodies } = scenery;
        self.crossings = (self.audit).tangles(obstacles, bodies, positions, &mut self.tangles);
        self.count = tangled(&self.tangles);
    }

    /// Gives contacts inside a body time: of a step of `dt` (s) that ends at `time` (s), its share of what is
    /// left.
    pub fn give_time(&self, contacts: &mut Contacts, time: f64, dt: f64) {
        let steps = 1.0 + ((self.start + TIME - time) / dt).max(0.0);
        for contact in &mut contacts.list {
            if contact.distance < 0.0 && self.tangles[contact.particle] != Tangle::Free {
                contact.leave = -contact.distance / steps + OUTSIDE;
            }
        }
    }

    /// Moves what crosses without being inside apart, by some longest edges in [`TIME`], until time is up. Also takes
    /// the approach of what is lifted from bodies.
    pub fn part(
        &mut self,
        scenery: Scenery<'_>,
        masses: Masses<'_>,
        dt: f64,
        state: &mut State,
    ) -> Response {
        let mut response = Response::default();
        if self.is_given_up(state.time) {
            self.pushes.fill(DVec3::ZERO);
            return response;
        }
        self.collect(scenery, &state.positions);
        for (i, push) in self.pushes.iter().enumerate() {
            let Some(direction) = push.try_normalize().filter(|_| masses.inverse[i] > 0.0) else {
                continue;
            };
            response.moved = true;
            let Tangle::Through(k) = self.tangles[i] else {
                state.positions[i] += push.clamp_length_max(1.0) * (self.reach[i] * dt / TIME);
                continue;
            };
            let x = scenery.bodies.at_start(k, state.positions[i]);
            let body = &scenery.obstacles[k];
            let nearest = scenery.bodies.nearest(body, k, x, self.reach[i]);
            let w = nearest.map_or(DVec3::ZERO, |nearest| {
                scenery.bodies.velocity(&Bodies::anchor(k, &nearest))
            });
            state.positions[i] += direction * (PACE * self.reach[i] * dt / TIME);
            let approach = direction.dot(w - state.velocities[i]);
            if approach > 0.0 {
                state.velocities[i] += direction * approach;
                response.work += masses.masses[i] * approach * direction.dot(w);
                response.approach += 0.5 * masses.masses[i] * approach * approach;
            }
        }
        response
    }

    /// Sums up where everything that crosses is pushed.
    fn collect(&mut self, scenery: Scenery<'_>, positions: &[DVec3]) {
        self.pushes.fill(DVec3::ZERO);
        for (k, corners) in &self.crossings.bodies {
            let push = self.outward(scenery, *k, corners, positions);
            corners
                .iter()
                .for_each(|&i| self.pushes[i as usize] += push);
        }
        for (edge, triangle) in &self.crossings.cloth {
            let wings = self.wings.get(edge).map_or(&[][..], Vec::as_slice);
            let push = shortening(*edge, wings, *triangle, positions);
            edge.iter().for_each(|&i| self.pushes[i as usize] += push);
            (triangle.iter()).for_each(|&i| self.pushes[i as usize] -= push);
        }
    }

    /// Holds what is lifted from bodies where it is, against strain limiting: one wall a particle, or none.
    pub fn hold(&self, positions: &[DVec3], walls: &mut [Wall]) {
        for (i, wall) in walls.iter_mut().enumerate().take(self.tangles.len()) {
            if let (Tangle::Through(_), Some(normal)) =
                (self.tangles[i], self.pushes[i].try_normalize())
            {
                let offset = normal.dot(positions[i]);
                *wall = Wall { normal, offset };
            }
        }
    }

    /// The mean outward normal of an obstacle at some corners, of those that are in reach; none where they are on
    /// opposite sides.
    fn outward(&self, scenery: Scenery<'_>, k: usize, corners: &[u32; 3], x: &[DVec3]) -> DVec3 {
        let Scenery { obstacles, bodies } = scenery;
        let normals = corners.iter().filter_map(|&i| {
            let (at, reach) = (bodies.at_start(k, x[i as usize]), self.reach[i as usize]);
            let nearest = bodies.nearest(&obstacles[k], k, at, reach)?;
            Some(bodies.turned(k, nearest.normal))
        });
        normals.sum::<DVec3>().normalize_or_zero()
    }

    /// Takes from velocities (m/s) what no fall since the start explains, nor the speed of the start or that
    /// of bodies: stretched springs must not throw what was led out. Returns the kinetic energy taken (J).
    ///
    /// `fall` is the acceleration of gravity (m/s²).
    pub fn calm(
        &mut self,
        scenery: Scenery<'_>,
        masses: Masses<'_>,
        fall: f64,
        state: &mut State,
    ) -> f64 {
        let Scenery { obstacles, bodies } = scenery;
        let pinned = (state.velocities.iter().zip(masses.inverse)).filter(|(_, w)| **w == 0.0);
        let pinned = pinned.map(|(v, _)| v.length()).fold(0.0, f64::max);
        let driven = bodies.fastest(obstacles).max(pinned);
        self.speed = self.speed.max(driven);
        let most = self.speed + fall * (state.time - self.start);
        let mut taken = 0.0;
        for (i, v) in state.velocities.iter_mut().enumerate() {
            let square = v.length_squared();
            if square > most * most && masses.inverse[i] > 0.0 {
                *v *= most / square.sqrt();
                taken += 0.5 * masses.masses[i] * (square - most * most);
            }
        }
        taken
    }
}

/// What a particle is put outside by at last (m).
const OUTSIDE: f64 = 1e-6;

fn tangled(tangles: &[Tangle]) -> usize {
    tangles
        .iter()
        .filter(|tangle| **tangle != Tangle::Free)
        .count()
}

/// Where an edge has to go against a triangle that it crosses, for the contour that the surfaces have in common
/// to become shorter.
///
/// Σ over the triangles at the edge of R − 2 (E·R)/(E·N) N, with E the edge's direction, N the crossed
/// triangle's normal and R the direction of the contour into the edge's triangle; of length 1 at most.
///
/// Source: Volino and Magnenat-Thalmann 2006.
fn shortening([a, b]: [u32; 2], wings: &[u32], triangle: [u32; 3], x: &[DVec3]) -> DVec3 {
    let at = |i: u32| x[i as usize];
    let [c, d, e] = triangle.map(at);
    let along = (at(b) - at(a)).normalize_or_zero();
    let normal = (d - c).cross(e - c).normalize_or_zero();
    let mut sum = DVec3::ZERO;
    for &wing in wings {
        let inward = (at(wing) - at(a)).reject_from_normalized(along);
        let own = along.cross(inward);
        let contour = normal.cross(own).normalize_or_zero();
        let contour = contour * contour.dot(inward).signum();
        sum += contour - normal * (2.0 * along.dot(contour) / along.dot(normal));
    }
    if sum.is_finite() {
        sum.clamp_length_max(1.0)
    } else {
        DVec3::ZERO
    }
}
