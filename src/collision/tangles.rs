//! Cloth that starts inside a body, across it or across other cloth, and how it gets out.
//!
//! All that contact does holds only where nothing crosses at first: a particle that is put out at once is
//! thrown by its springs, and continuous detection would keep in what is in. So what starts tangled is taken
//! out of both until an exact look finds it free, and led out over [`TIME`] without velocity:
//!
//! - particles inside go to the nearest point outside, by depth · dt / (time left) in a step;
//! - corners of edges and triangles that cross a body between them are lifted along its normals there;
//! - crossing cloth goes along the gradient of the length of what it has in common (Volino and
//!   Magnenat-Thalmann 2006, "Resolving surface collisions through intersection contour minimization").
//!
//! Cloth that crosses cloth deeply, or runs through a thin body from side to side, may stay as it is; it is
//! counted then.

use super::audit::Crossing;
use super::{Audit, Bodies, Contacts, Masses, Obstacle, Response, Tangle};
use crate::state::State;
use glam::DVec3;
use std::collections::BTreeMap;

/// Within this time (s) particles that start inside a body are outside: a tenth of a metre goes at 0.4 m/s,
/// about as fast as cloth falls in 4 cm.
pub const TIME: f64 = 0.25;

/// Times [`TIME`] after which what still crosses is left alone.
const PATIENCE: f64 = 4.0;

/// Cloth that starts tangled.
#[derive(Clone, Debug)]
pub struct Tangles {
    audit: Audit,
    /// One entry a particle.
    tangles: Vec<Tangle>,
    crossings: Vec<Crossing>,
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
        positions: &[DVec3],
        start: f64,
    ) -> Option<Self> {
        let mut tangles = vec![Tangle::Free; positions.len()];
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
            start,
        })
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

    /// Moves what crosses without being inside apart, by a longest edge in [`TIME`], until time is up.
    pub fn part(
        &mut self,
        scenery: Scenery<'_>,
        masses: Masses<'_>,
        dt: f64,
        state: &mut State,
    ) -> Response {
        let mut response = Response::default();
        if state.time > self.start + PATIENCE * TIME {
            return response;
        }
        for (i, tangle) in self.tangles.iter().enumerate() {
            if let Tangle::Through(k) = *tangle
                && masses.inverse[i] > 0.0
            {
                let way = self.reach[i] * (dt / TIME);
                lift(
                    scenery,
                    k,
                    (i, self.reach[i], way),
                    masses,
                    state,
                    &mut response,
                );
            }
        }
        self.push_apart(masses, dt, state, &mut response);
        response
    }

    /// Moves crossing edges and triangles of cloth by the gradient of what they have in common.
    fn push_apart(
        &mut self,
        masses: Masses<'_>,
        dt: f64,
        state: &mut State,
        response: &mut Response,
    ) {
        if self.crossings.is_empty() {
            return;
        }
        self.pushes.fill(DVec3::ZERO);
        for (edge, triangle) in &self.crossings {
            let wings = self.wings.get(edge).map_or(&[][..], Vec::as_slice);
            let push = shortening(*edge, wings, *triangle, &state.positions);
            edge.iter().for_each(|&i| self.pushes[i as usize] += push);
            (triangle.iter()).for_each(|&i| self.pushes[i as usize] -= push);
        }
        for (i, push) in self.pushes.iter().enumerate() {
            if masses.inverse[i] > 0.0 && *push != DVec3::ZERO {
                let way = push.clamp_length_max(1.0) * (self.reach[i] * dt / TIME);
                state.positions[i] += way;
                response.moved = true;
            }
        }
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

/// Moves a particle by a way (m) from an obstacle that is in its reach (m), and takes its approach.
fn lift(
    Scenery { obstacles, bodies }: Scenery<'_>,
    k: usize,
    (i, reach, way): (usize, f64, f64),
    masses: Masses<'_>,
    state: &mut State,
    response: &mut Response,
) {
    let x = bodies.at_start(k, state.positions[i]);
    let Some(nearest) = bodies.nearest(&obstacles[k], k, x, reach) else {
        return;
    };
    let normal = bodies.turned(k, nearest.normal);
    state.positions[i] += normal * way;
    response.moved = true;
    let velocity = bodies.velocity(&Bodies::anchor(k, &nearest));
    let approach = normal.dot(velocity - state.velocities[i]);
    if approach > 0.0 {
        state.velocities[i] += normal * approach;
        response.work += masses.masses[i] * approach * normal.dot(velocity);
        response.approach += 0.5 * masses.masses[i] * approach * approach;
    }
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
