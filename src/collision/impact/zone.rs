//! The fail-safe: what impulses don't part moves as one rigid body, or stays.
//!
//! Vertices of features that still meet form zones. A zone of free particles moves rigidly with the
//! momentum and angular momentum of the motion that it had; one with pinned particles or vertices
//! of solids moves with these. Rigid ways in a straight line are an affine map at each time, so
//! nothing within a zone meets. What a zone then meets joins it.
//!
//! Sources: Provot 1997; Bridson, Fedkiw and Anderson 2002 (rigid impact zones).

use super::element::Element;
use super::ground::Ground;
use super::slowing::Slowed;
use super::touch::{Touch, Vertices};
use glam::{DMat3, DVec3};

/// The zones of a step.
#[derive(Clone, Debug, Default)]
pub(super) struct Zones {
    /// A vertex of the same zone, closer to its first; of all vertices.
    parent: Vec<u32>,
    /// First vertex of the zone and vertex, in order.
    members: Vec<(u32, u32)>,
}

/// A motion of a rigid body: x ↦ x + shift + turn (x − about).
#[derive(Clone, Copy, Debug)]
struct Rigid {
    about: DVec3,
    shift: DVec3,
    turn: DVec3,
}

impl Zones {
    pub(super) fn new(vertices: usize) -> Self {
        Self {
            parent: (0..).take(vertices).collect(),
            members: Vec::with_capacity(vertices),
        }
    }

    /// Number of zones.
    pub(super) fn count(&self) -> usize {
        let first = |k: &usize| *k == 0 || self.members[*k].0 != self.members[k - 1].0;
        (0..self.members.len()).filter(first).count()
    }

    /// Dissolves all zones.
    pub(super) fn clear(&mut self, ground: &mut Ground) {
        for (_, vertex) in self.members.drain(..) {
            self.parent[vertex as usize] = vertex;
            ground.zone[vertex as usize] = None;
        }
    }

    fn first(&mut self, vertex: u32) -> u32 {
        let mut at = vertex;
        while self.parent[at as usize] != at {
            let above = self.parent[self.parent[at as usize] as usize];
            self.parent[at as usize] = above;
            at = above;
        }
        at
    }

    /// Joins the vertices of each touch; with `elements`, also those of elements that share one with a touch.
    pub(super) fn join(&mut self, touches: &[Touch], elements: &[Element]) {
        for touch in touches {
            self.join_all(&touch.vertices);
        }
        if !elements.is_empty() {
            let mut met: Vec<u32> = touches.iter().flat_map(|touch| touch.vertices).collect();
            met.sort_unstable();
            for Element { corners, .. } in elements {
                if corners
                    .iter()
                    .any(|corner| met.binary_search(corner).is_ok())
                {
                    self.join_all(corners);
                }
            }
        }
        for k in 0..self.members.len() {
            self.members[k].0 = self.first(self.members[k].1);
        }
        self.members.sort_unstable();
        self.members.dedup();
    }

    fn join_all(&mut self, vertices: &[u32]) {
        let mut zone = self.first(vertices[0]);
        for &vertex in vertices {
            let other = self.first(vertex);
            let (low, high) = (zone.min(other), zone.max(other));
            self.parent[high as usize] = low;
            zone = low;
            self.members.push((0, vertex));
        }
    }

    fn zones(&self) -> impl Iterator<Item = &[(u32, u32)]> {
        self.members.chunk_by(|one, next| one.0 == next.0)
    }

    /// Makes the ways of each zone's free vertices those of one rigid body.
    pub(super) fn displace(&self, ground: &mut Ground) {
        let Ground {
            vertices,
            zone: zones,
            ..
        } = ground;
        for zone in self.zones() {
            let Vertices { start, end, .. } = &*vertices;
            let way = |i: usize| (start[i], end[i] - start[i]);
            let rigid = Rigid::of(zone, &vertices.inverse_mass, way);
            for i in free(zone, &vertices.inverse_mass) {
                vertices.end[i] = rigid.moved(vertices.start[i]);
                zones[i] = Some(zone[0].0);
            }
        }
    }

    /// Makes the velocities of each zone's free vertices those of one rigid body. Only solids that move give
    /// energy.
    pub(super) fn slow(&self, vertices: &mut Vertices, dt: f64, slowed: &mut Slowed) {
        for zone in self.zones() {
            let Vertices {
                start,
                end,
                velocity,
                inverse_mass,
            } = vertices;
            let held = zone.iter().any(|(_, i)| inverse_mass[*i as usize] == 0.0);
            let rigid = if held {
                Rigid::of(zone, inverse_mass, |i| (start[i], (end[i] - start[i]) / dt))
            } else {
                Rigid::of(zone, inverse_mass, |i| (end[i], velocity[i]))
            };
            for i in free(zone, inverse_mass) {
                let before = velocity[i];
                velocity[i] = rigid.rate(end[i]);
                let (change, mass) = (velocity[i] - before, 1.0 / inverse_mass[i]);
                if held {
                    slowed.work += mass * change.dot(velocity[i]);
                    slowed.approach += 0.5 * mass * change.length_squared();
                } else {
                    slowed.approach -= mass * change.dot(before + change * 0.5);
                }
            }
        }
    }
}

/// The vertices of a zone that can be moved.
fn free(zone: &[(u32, u32)], inverse_mass: &[f64]) -> impl Iterator<Item = usize> {
    let all = zone.iter().map(|(_, vertex)| *vertex as usize);
    all.filter(|&i| inverse_mass[i] > 0.0)
}

/// Turns of more than this (rad) in a step are cut off: half a turn would flatten a zone on its way.
const MOST_TURN: f64 = 1.0;

impl Rigid {
    /// The rigid motion that has the momentum and angular momentum of places and their motions: of the fixed
    /// vertices, all of the same mass, where there are any.
    fn of(
        zone: &[(u32, u32)],
        inverse_mass: &[f64],
        motion: impl Fn(usize) -> (DVec3, DVec3),
    ) -> Self {
        let held = zone.iter().any(|(_, i)| inverse_mass[*i as usize] == 0.0);
        let masses = zone.iter().filter_map(|(_, vertex)| {
            let i = *vertex as usize;
            match (held, inverse_mass[i] == 0.0) {
                (true, true) => Some((i, 1.0)),
                (false, _) => Some((i, 1.0 / inverse_mass[i])),
                _ => None,
            }
        });
        let (mut whole, mut about, mut shift) = (0.0, DVec3::ZERO, DVec3::ZERO);
        for (i, mass) in masses.clone() {
            let (x, u) = motion(i);
            whole += mass;
            about += x * mass;
            shift += u * mass;
        }
        about /= whole;
        shift /= whole;
        let (mut spin, mut inertia) = (DVec3::ZERO, DMat3::ZERO);
        for (i, mass) in masses {
            let (x, u) = motion(i);
            let r = x - about;
            spin += r.cross(u - shift) * mass;
            let outer = DMat3::from_cols(r * r.x, r * r.y, r * r.z);
            inertia += (DMat3::from_diagonal(DVec3::splat(r.length_squared())) - outer) * mass;
        }
        // About the axis of a straight zone nothing turns.
        let trace = inertia.x_axis.x + inertia.y_axis.y + inertia.z_axis.z;
        inertia += DMat3::from_diagonal(DVec3::splat(1e-9 * trace));
        let turn = if trace > 0.0 {
            inertia.inverse() * spin
        } else {
            DVec3::ZERO
        };
        Self { about, shift, turn }
    }

    /// Where the motion over a step brings a place.
    fn moved(&self, x: DVec3) -> DVec3 {
        if self.shift == DVec3::ZERO && self.turn == DVec3::ZERO {
            return x; // exactly, so that what rests stays free of what rests
        }
        let turn = glam::DQuat::from_scaled_axis(self.turn.clamp_length_max(MOST_TURN));
        self.about + self.shift + turn * (x - self.about)
    }

    /// Velocity of a place.
    fn rate(&self, x: DVec3) -> DVec3 {
        self.shift + self.turn.cross(x - self.about)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::dvec3;

    #[test]
    fn a_free_zone_keeps_its_momentum_and_angular_momentum() {
        let wave = |i: u32, f: f64| (f64::from(i + 1) * f).sin();
        let place = |i: u32| dvec3(wave(i, 1.1), wave(i, 2.3), wave(i, 3.7));
        let vertices = Vertices {
            start: (0..5).map(place).collect(),
            end: (0..5).map(place).collect(),
            velocity: (10..15).map(place).collect(),
            inverse_mass: (0..5).map(|i| 1.0 / f64::from(i + 1)).collect(),
        };
        let momenta = |vertices: &Vertices| {
            let each = vertices
                .end
                .iter()
                .zip(&vertices.velocity)
                .zip(&vertices.inverse_mass);
            each.fold((DVec3::ZERO, DVec3::ZERO, 0.0), |(p, l, e), ((x, v), w)| {
                (
                    p + v / w,
                    l + x.cross(*v) / w,
                    e + 0.5 * v.length_squared() / w,
                )
            })
        };
        let before = momenta(&vertices);
        let mut zones = Zones::new(5);
        let touch = |vertices| Touch {
            vertices,
            ..Touch::default()
        };
        zones.join(&[touch([0, 1, 2, 3]), touch([3, 4, 1, 0])], &[]);
        assert_eq!(zones.count(), 1);
        let (mut after, mut slowed) = (vertices, Slowed::default());
        zones.slow(&mut after, 0.01, &mut slowed);
        let now = momenta(&after);
        assert!((now.0 - before.0).length() < 1e-12, "{now:?} {before:?}");
        assert!((now.1 - before.1).length() < 1e-7, "{now:?} {before:?}");
        assert!((before.2 - now.2 - slowed.approach).abs() < 1e-12 && slowed.approach > 0.0);
        // Rigid: no distance changes.
        for i in 0..5 {
            for j in 0..i {
                let rate = (after.end[i] - after.end[j]).dot(after.velocity[i] - after.velocity[j]);
                assert!(rate.abs() < 1e-12, "{i} {j}: {rate}");
            }
        }
    }
}
