//! Which particles are at an obstacle.
//!
//! Most particles are far from everything or haven't moved much. A distance changes at most as fast
//! as the particle moves, so what an earlier step measured bounds it now: a particle is only asked
//! for when it may have come into reach, and then no farther than that bound.
//!
//! A particle that moved farther than it was away is followed along its way by conservative
//! advancement: from each point it may safely go as far as the surface is away. So no particle
//! passes through a body, however thin or fast, and one that would is stopped where it met it.
//!
//! All that is done where the obstacle starts: what moves as one piece stands still there, and a particle's
//! way is that against the obstacle.

use super::{Bodies, Contact, Contacts, Grip, Obstacle};
use crate::mesh::Nearest;
use crate::state::Archive;
use glam::DVec3;
use rayon::prelude::*;

/// What is known of each particle's distance from each obstacle.
#[derive(Clone, Debug)]
pub struct Detection {
    /// Per obstacle, one entry a particle.
    known: Vec<Vec<Known>>,
    /// The nearest contact found, one entry a particle.
    found: Vec<Option<Contact>>,
}

/// The last measurement of a particle: with the obstacle where it starts if it is of one piece, else where
/// it was then.
#[derive(Clone, Copy, Debug)]
struct Known {
    /// Where the particle was (m).
    at: DVec3,
    /// The nearest point then; `None` before the first measurement.
    nearest: Option<Nearest>,
    /// How far the obstacle's fastest vertices had come by then (m).
    odometer: f64,
}

/// Contact is noticed this share of a thickness before it begins: a particle that slides over a
/// round body at 1 m/s and steps of 4 ms leaves a surface of 5 cm radius by 0.2 mm in a step, 5 %
/// of a thickness of 3 mm, and must not lose its contact by that.
const NOTICE: f64 = 0.5;

/// Particles that one task looks at.
const TASK: usize = 128;

impl Detection {
    /// Nothing is known yet; without obstacles, nothing has to be.
    pub fn new(obstacles: &[Obstacle], particles: usize) -> Self {
        let particles = if obstacles.is_empty() { 0 } else { particles };
        let unknown = Known {
            at: DVec3::ZERO,
            nearest: None,
            odometer: 0.0,
        };
        Self {
            known: vec![vec![unknown; particles]; obstacles.len()],
            found: vec![None; particles],
        }
    }

    /// Size of its lists (B).
    pub fn bytes(&self) -> usize {
        let known = self.known.iter().map(|known| size_of_val(&known[..]));
        known.sum::<usize>() + size_of_val(&self.found[..])
    }

    /// Carries over what is known.
    pub fn carry(&mut self, archive: &mut Archive) {
        for known in self.known.iter_mut().flatten() {
            archive.vector(&mut known.at);
            archive.real(&mut known.odometer);
            let mut measured = known.nearest.is_some();
            archive.flag(&mut measured);
            if !measured {
                known.nearest = None;
                continue;
            }
            let nothing = Nearest::new(DVec3::ZERO, DVec3::ZERO, 0.0);
            let nearest = known.nearest.get_or_insert(nothing);
            archive.vector(&mut nearest.point);
            archive.vector(&mut nearest.normal);
            archive.real(&mut nearest.distance);
            archive.small(&mut nearest.triangle);
            for weight in &mut nearest.weights {
                archive.real(weight);
            }
        }
    }

    /// Finds the contacts of all particles with obstacles as they stand now; `contacts` keeps the grips of those that go on.
    pub fn find(
        &mut self,
        obstacles: &[Obstacle],
        bodies: &Bodies,
        positions: &[DVec3],
        contacts: &mut Contacts,
    ) {
        self.found.fill(None);
        for (k, (obstacle, known)) in obstacles.iter().zip(&mut self.known).enumerate() {
            let tasks = self
                .found
                .par_chunks_mut(TASK)
                .zip(known.par_chunks_mut(TASK))
                .enumerate();
            tasks.for_each(|(task, (found, known))| {
                for (i, (found, known)) in found.iter_mut().zip(known).enumerate() {
                    let particle = task * TASK + i;
                    let x = positions[particle];
                    let Some(nearest) = known.measure(obstacle, bodies, k, x) else {
                        continue;
                    };
                    let gap = nearest.distance - obstacle.thickness;
                    if found.is_none_or(|other| gap < other.gap) {
                        let at = known.place(bodies, k, x);
                        *found = Some(contact(obstacle, bodies, k, particle, at, &nearest));
                    }
                }
            });
        }
        contacts.list.clear();
        for (found, grip) in self.found.iter().zip(&mut contacts.grips) {
            match found {
                Some(contact) => contacts.list.push(*contact),
                None => *grip = Grip::default(),
            }
        }
    }
}

/// A particle at obstacle number `k`, found at `at`.
fn contact(
    obstacle: &Obstacle,
    bodies: &Bodies,
    k: usize,
    particle: usize,
    at: DVec3,
    nearest: &Nearest,
) -> Contact {
    let anchor = Bodies::anchor(k, nearest);
    let velocity = bodies.velocity(&anchor);
    Contact {
        particle,
        at,
        normal: bodies.turned(k, nearest.normal),
        gap: nearest.distance - obstacle.thickness,
        distance: nearest.distance,
        friction: obstacle.friction,
        anchor,
        velocity,
        velocity_after: velocity,
        impulse: DVec3::ZERO,
        leave: f64::INFINITY,
    }
}

/// Closer than this (m), the way of a particle has met the surface: a hundredth of a millimetre
/// takes three or four queries, a hundred times less would take two more.
const MET: f64 = 1e-5;

/// Queries along a way after which it counts as meeting the surface: it runs beside it closer than
/// it is long by this factor.
const MAX_ADVANCES: u32 = 40;

impl Known {
    /// The point of obstacle number `k` nearest to a particle at `x`, if it is in reach.
    fn measure(
        &mut self,
        obstacle: &Obstacle,
        bodies: &Bodies,
        k: usize,
        x: DVec3,
    ) -> Option<Nearest> {
        let reach = (1.0 + NOTICE) * obstacle.thickness;
        let x = bodies.at_start(k, x);
        let body = |p: DVec3, farthest: f64| bodies.nearest(obstacle, k, p, farthest);
        let way = x - self.at;
        let odometer = bodies.odometer(k);
        let drift = odometer - self.odometer;
        let moved = way.length();
        let distance = self.nearest.map(|nearest| nearest.distance);
        match distance {
            Some(distance) if distance - moved - drift > reach => return None,
            Some(distance) if drift > 0.0 => self.ask(&body, x, distance.abs() + moved + drift)?,
            Some(distance) if moved > 0.0 => self.advance(&body, way, moved, distance)?,
            Some(_) => {}
            None => self.ask(&body, x, f64::MAX)?,
        }
        self.odometer = odometer;
        self.nearest.filter(|nearest| nearest.distance <= reach)
    }

    /// Where the particle that is at `x` was found: there, or where its way met obstacle number `k`.
    fn place(&self, bodies: &Bodies, k: usize, x: DVec3) -> DVec3 {
        if self.at == bodies.at_start(k, x) {
            x
        } else {
            bodies.now(k, self.at)
        }
    }

    /// Follows a way from a point at a distance to its end, or to where it meets the surface.
    fn advance(
        &mut self,
        body: &impl Fn(DVec3, f64) -> Option<Nearest>,
        way: DVec3,
        moved: f64,
        distance: f64,
    ) -> Option<()> {
        let start = self.at;
        let normal = self.nearest?.normal;
        // A particle that touches stays there if it goes on inwards, and is free to leave. One that
        // is inside already is not held back: it has to come out.
        if (0.0..MET).contains(&distance) && way.dot(normal) < 0.0 {
            return Some(());
        }
        let (mut gone, mut safe) = (0.0, if distance >= MET { distance } else { moved });
        let mut queries = 0;
        while gone + safe < moved {
            if safe < MET || queries == MAX_ADVANCES {
                return Some(());
            }
            gone += safe;
            self.ask(body, start + way * (gone / moved), 2.0 * safe)?;
            safe = self.nearest?.distance;
            queries += 1;
        }
        let farthest = distance.abs().max(safe) + (moved - gone);
        self.ask(body, start + way, farthest)
    }

    /// Measures the distance of a point that is at most `farthest` (m) away.
    fn ask(
        &mut self,
        body: &impl Fn(DVec3, f64) -> Option<Nearest>,
        point: DVec3,
        farthest: f64,
    ) -> Option<()> {
        // A billionth of a metre for rounding, which must not push the surface out of range.
        let nearest = body(point, farthest + 1e-9)?;
        (self.at, self.nearest) = (point, Some(nearest));
        Some(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::collision::Solid;
    use crate::mesh::{Surface, read_obj};

    /// A plate of 1 m × 1 m and a millimetre thick, its top at y = 0.
    fn plate() -> Obstacle {
        let corner = |i: u32| {
            let [x, y, z] = [i & 1, i >> 1 & 1, i >> 2 & 1].map(f64::from);
            format!("v {} {} {}\n", x - 0.5, 0.001 * (y - 1.0), z - 0.5)
        };
        let faces = "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n";
        let (mesh, _) = read_obj(&((0..8).map(corner).collect::<String>() + faces), 1.0).unwrap();
        assert!(mesh.volume() > 0.0 && crate::mesh::open_edge(&mesh).is_none());
        let surface = Surface::new(&mesh).unwrap();
        Obstacle {
            name: "plate".to_owned(),
            shape: Solid::Mesh {
                mesh,
                surface,
                grid: None,
            },
            motion: None,
            friction: 0.0,
            thickness: 0.003,
            continuous: true,
        }
    }

    fn find(detection: &mut Detection, obstacles: &[Obstacle], x: [DVec3; 1], to: &mut Contacts) {
        let bodies = Bodies::new(obstacles, 0.0);
        detection.find(obstacles, &bodies, &x, to);
    }

    #[test]
    fn nothing_passes_through_a_thin_plate_at_any_speed() {
        let obstacles = [plate()];
        for speed in [0.002, 0.02, 1.0, 300.0] {
            for side in [1.0, -1.0] {
                let mut detection = Detection::new(&obstacles, 1);
                let mut contacts = Contacts::none(1);
                let start = DVec3::new(0.1, 0.0101 * side, 0.2);
                find(&mut detection, &obstacles, [start], &mut contacts);
                let mut x = start;
                for _ in 0..20 {
                    x.y -= speed * side; // past the plate at last
                    find(&mut detection, &obstacles, [x], &mut contacts);
                    if contacts.list.first().is_some_and(|contact| contact.at != x) {
                        break;
                    }
                }
                let contact = contacts.list[0];
                assert!(
                    contact.normal.y * side > 0.99,
                    "speed {speed}, side {side}: {contact:?}"
                );
                assert!(contact.distance.abs() < 2.0 * MET, "{contact:?}");
            }
        }
    }

    #[test]
    fn the_closest_of_two_obstacles_counts_and_a_lost_contact_loses_its_grip() {
        let mut far = plate();
        if let Solid::Mesh { mesh, surface, .. } = &mut far.shape {
            mesh.positions.iter_mut().for_each(|p| p.y -= 0.001);
            *surface = Surface::new(mesh).unwrap();
        }
        let obstacles = [far, plate()];
        let mut detection = Detection::new(&obstacles, 1);
        let mut contacts = Contacts::none(1);
        find(
            &mut detection,
            &obstacles,
            [DVec3::Y * 0.002],
            &mut contacts,
        );
        assert_eq!(contacts.list.len(), 1);
        assert!((contacts.list[0].distance - 0.002).abs() < 1e-12);
        contacts.grips[0].pressure = 1.0;
        find(&mut detection, &obstacles, [DVec3::Y * 0.5], &mut contacts);
        assert!(contacts.list.is_empty() && contacts.grips[0] == Grip::default());
    }

    #[test]
    fn a_particle_that_touched_obliquely_may_leave() {
        let obstacles = [plate()];
        let mut detection = Detection::new(&obstacles, 1);
        let mut contacts = Contacts::none(1);
        let mut x = DVec3::new(0.0, 0.01, 0.0);
        find(&mut detection, &obstacles, [x], &mut contacts);
        x += DVec3::new(0.01, -0.02, 0.0);
        find(&mut detection, &obstacles, [x], &mut contacts);
        assert!(contacts.list[0].at != x, "stopped at the surface");
        x = contacts.list[0].at + DVec3::new(0.005, 0.0, 0.0);
        for _ in 0..5 {
            x += DVec3::new(0.005, 0.01, 0.0);
            find(&mut detection, &obstacles, [x], &mut contacts);
        }
        assert!(contacts.list.is_empty(), "{:?}", contacts.list);
    }
}
