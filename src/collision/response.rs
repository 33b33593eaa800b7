//! The answer to a contact: out of the body, no approach, Coulomb friction.

use super::Contacts;
use crate::state::State;
use glam::DVec3;

/// Share of an intrusion into the thickness that is taken back in a step, from 3 mm to a
/// micrometre in 28 steps. All at once would throw particles to and fro between two walls that are
/// closer than two thicknesses, and stretch the springs that end at them.
const SHARE: f64 = 0.25;

/// Intrusion into the thickness that is left alone (m).
const NEGLIGIBLE: f64 = 1e-6;

/// What answering contacts did.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Response {
    /// Particles that were stopped where they met a surface, or moved out of it.
    pub stopped: usize,
    /// Whether any particle was touched.
    pub moved: bool,
    /// Kinetic energy taken with the approach, ½ Σ m vₙ² (J), as all here against the obstacle.
    pub approach: f64,
    /// Kinetic energy that friction took (J).
    pub friction: f64,
    /// Work that moving obstacles did (J).
    pub work: f64,
}

/// Stops particles where they met a surface, moves those that are inside out of it, and takes away
/// the approach of all that came too close.
///
/// v ← v − min(0, v·n) n;  vₜ ← vₜ max(0, 1 − μ Δvₙ / |vₜ|)
///
/// with v against the obstacle, of velocity w. Of the energy that the impulse J = m Δv gives, J · w is the
/// obstacle's work, and the rest, which is negative, what impact and friction take.
///
/// Restitution is 0. The way out is not turned into velocity, so that cloth that starts inside a
/// body leaves it without being thrown; where that has time, it is by no more than [`Contact::leave`](super::Contact::leave) and with
/// `spread` only. With `spread`, particles outside the surface but within the
/// thickness are also moved away, never farther than the distance they have: between two walls they
/// come to rest in the middle.
///
/// Source: Bridson, Fedkiw and Anderson 2002 (friction).
pub fn respond(
    contacts: &mut Contacts,
    model: Masses<'_>,
    spread: bool,
    state: &mut State,
) -> Response {
    let mut response = Response::default();
    for contact in &mut contacts.list {
        let i = contact.particle;
        let met = contact.at != state.positions[i];
        if (contact.gap >= -NEGLIGIBLE && !met) || model.inverse[i] == 0.0 {
            continue;
        }
        let beyond = state.positions[i] - contact.at;
        let slid = beyond - contact.normal * beyond.dot(contact.normal).min(0.0);
        let has_time = contact.distance <= 0.0 && contact.has_time();
        let out = if has_time {
            if spread { contact.leave } else { 0.0 }
        } else if contact.distance <= 0.0 {
            NEGLIGIBLE - contact.distance
        } else if spread {
            (-SHARE * contact.gap).clamp(0.0, contact.distance)
        } else {
            0.0
        };
        response.stopped += usize::from(!has_time && (met || contact.distance <= 0.0));
        response.moved = true;
        state.positions[i] = contact.at + slid + contact.normal * out;
        if has_time {
            contact.at = state.positions[i];
        }
        let v = contact.against(state.velocities[i]);
        let approach = -v.dot(contact.normal);
        if approach > 0.0 {
            let tangential = v + contact.normal * approach;
            let (kept, sticks) = rub(tangential, contact.friction * approach);
            state.velocities[i] = kept + contact.velocity;
            let half = 0.5 * model.masses[i];
            response.work += model.masses[i] * (kept - v).dot(contact.velocity);
            response.approach += half * approach * approach;
            response.friction += half * (tangential.length_squared() - kept.length_squared());
            let grip = &mut contacts.grips[i];
            // A lasting contact keeps its friction: this approach is a correction beside it.
            if grip.pressure == 0.0 {
                grip.drag = (kept - tangential) * model.masses[i];
                grip.sticks = sticks;
            }
            grip.pressure += model.masses[i] * approach;
        }
    }
    response
}

/// The masses of a model's particles.
#[derive(Clone, Copy, Debug)]
pub struct Masses<'a> {
    /// Mass (kg).
    pub masses: &'a [f64],
    /// 1/mass (1/kg), 0 for pinned particles.
    pub inverse: &'a [f64],
}

/// Coulomb friction: the tangential velocity (m/s) loses at most `loss` (m/s). Also says whether it
/// comes to rest.
fn rub(tangential: DVec3, loss: f64) -> (DVec3, bool) {
    let speed = tangential.length();
    if speed <= loss {
        (DVec3::ZERO, true)
    } else {
        (tangential * (1.0 - loss / speed), false)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::collision::{Anchor, Contact};

    const MASSES: Masses<'_> = Masses {
        masses: &[0.1],
        inverse: &[10.0],
    };

    fn one(distance: f64, velocity: DVec3) -> (Contacts, State) {
        let mut contacts = Contacts::none(1);
        let gap = distance - 0.003;
        let contact = Contact {
            leave: f64::INFINITY,
            particle: 0,
            at: DVec3::ZERO,
            normal: DVec3::Y,
            gap,
            distance,
            friction: 0.5,
            anchor: Anchor::default(),
            velocity: DVec3::ZERO,
            velocity_after: DVec3::ZERO,
            impulse: DVec3::ZERO,
        };
        contacts.list.push(contact);
        (
            contacts,
            State {
                time: 0.0,
                positions: vec![DVec3::ZERO],
                velocities: vec![velocity],
            },
        )
    }

    #[test]
    fn friction_slows_or_stops() {
        let (mut contacts, mut state) = one(-0.001, DVec3::new(2.0, -1.0, 0.0));
        let response = respond(&mut contacts, MASSES, true, &mut state);
        assert_eq!(response.stopped, 1);
        // Half of 0.1 kg, from 2 m/s along and 1 m/s towards the surface to 1.5 m/s along it.
        assert!((response.approach - 0.05).abs() < 1e-15, "{response:?}");
        assert!((response.friction - 0.0875).abs() < 1e-15, "{response:?}");
        assert!((state.positions[0] - DVec3::Y * 0.001).length() < 2.0 * NEGLIGIBLE);
        assert!((state.velocities[0] - DVec3::X * 1.5).length() < 1e-15);
        assert!(!contacts.grips[0].sticks && (contacts.grips[0].pressure - 0.1).abs() < 1e-15);
        let (mut contacts, mut state) = one(-0.001, DVec3::new(0.4, -1.0, 0.0));
        respond(&mut contacts, MASSES, true, &mut state);
        assert!(contacts.grips[0].sticks && state.velocities[0] == DVec3::ZERO);
    }

    /// What happens on a moving obstacle is what happens on one at rest, seen from a moving place.
    #[test]
    fn a_moving_obstacle_takes_along_and_its_work_is_told() {
        let wind = DVec3::new(-3.0, 1.0, 0.5);
        for v in [DVec3::new(2.0, -1.0, 0.0), DVec3::new(0.4, -1.0, 0.0)] {
            let (mut contacts, mut state) = one(-0.001, v);
            let at_rest = respond(&mut contacts, MASSES, true, &mut state);
            let (mut contacts, mut moved) = one(-0.001, v + wind);
            contacts.list[0].velocity = wind;
            let response = respond(&mut contacts, MASSES, true, &mut moved);
            assert!((moved.velocities[0] - state.velocities[0] - wind).length() < 1e-15);
            assert!((response.approach - at_rest.approach).abs() < 1e-15);
            assert!((response.friction - at_rest.friction).abs() < 1e-15);
            let gained =
                0.05 * (moved.velocities[0].length_squared() - (v + wind).length_squared());
            let told = response.work - response.approach - response.friction;
            assert!((gained - told).abs() < 1e-15, "{gained} is not {told}");
        }
    }

    #[test]
    fn leaving_and_distant_particles_keep_their_velocity() {
        let leaving = DVec3::new(2.0, 1.0, 0.0);
        let (mut contacts, mut state) = one(-0.001, leaving);
        respond(&mut contacts, MASSES, true, &mut state);
        assert_eq!(state.velocities[0], leaving);
        let (mut contacts, mut state) = one(0.004, -leaving);
        assert_eq!(respond(&mut contacts, MASSES, true, &mut state).stopped, 0);
        assert_eq!(state.velocities[0], -leaving);
    }

    #[test]
    fn within_the_thickness_particles_move_away_slowly_and_never_past_the_middle() {
        for (distance, moved) in [(0.002, 0.00025), (0.0001, 0.0001)] {
            let (mut contacts, mut state) = one(distance, DVec3::ZERO);
            assert_eq!(respond(&mut contacts, MASSES, true, &mut state).stopped, 0);
            assert!((state.positions[0].y - moved).abs() < 1e-12);
            let (mut contacts, mut state) = one(distance, DVec3::ZERO);
            respond(&mut contacts, MASSES, false, &mut state);
            assert_eq!(state.positions[0], DVec3::ZERO);
        }
    }

    #[test]
    fn a_particle_that_met_the_surface_on_its_way_slides_on_from_there() {
        let (mut contacts, mut state) = one(1e-5, DVec3::ZERO);
        state.positions[0] = DVec3::new(0.02, -0.05, 0.0);
        assert_eq!(respond(&mut contacts, MASSES, false, &mut state).stopped, 1);
        assert!((state.positions[0] - DVec3::X * 0.02).length() < 1e-12);
    }
}
