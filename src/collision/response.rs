//! The answer to a contact: out of the body, no approach, Coulomb friction.

use super::Contacts;
use crate::state::State;
use glam::DVec3;

/// What the response did.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Response {
    /// Particles that were moved.
    pub moved: usize,
}

/// Intrusion into the thickness that is left alone (m): a micrometre, a thousandth of what the
/// report calls deep. Smaller corrections would only chase rounding.
const NEGLIGIBLE: f64 = 1e-6;

/// Moves the particles that came too close back to one thickness above the surface, and takes away
/// their approach.
///
/// v ← v − min(0, v·n) n;  v_t ← v_t max(0, 1 − μ Δv_n / |v_t|)
///
/// Restitution is 0. The way out is not turned into velocity, so that cloth that starts inside a
/// body leaves it without being thrown.
///
/// Source: Bridson, Fedkiw and Anderson 2002 (friction).
pub fn respond(contacts: &mut Contacts, masses: &[f64], inverse_masses: &[f64], state: &mut State) -> Response {
    let mut response = Response::default();
    for contact in &contacts.list {
        let i = contact.particle;
        if contact.gap >= -NEGLIGIBLE || inverse_masses[i] == 0.0 {
            continue;
        }
        response.moved += 1;
        state.positions[i] -= contact.normal * contact.gap;
        let v = state.velocities[i];
        let approach = -v.dot(contact.normal);
        if approach > 0.0 {
            let tangential = v + contact.normal * approach;
            let (kept, sticks) = rub(tangential, contact.friction * approach);
            state.velocities[i] = kept;
            let grip = &mut contacts.grips[i];
            grip.pressure += masses[i] * approach;
            grip.drag = (kept - tangential) * masses[i];
            grip.sticks = sticks;
        }
    }
    response
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
    use crate::collision::Contact;

    fn one(gap: f64, velocity: DVec3) -> (Contacts, State) {
        let mut contacts = Contacts::none(1);
        let contact = Contact { particle: 0, normal: DVec3::Y, gap, distance: gap + 0.003, friction: 0.5 };
        contacts.list.push(contact);
        (contacts, State { time: 0.0, positions: vec![DVec3::ZERO], velocities: vec![velocity] })
    }

    #[test]
    fn friction_slows_or_stops() {
        let (mut contacts, mut state) = one(-0.001, DVec3::new(2.0, -1.0, 0.0));
        assert_eq!(respond(&mut contacts, &[0.1], &[10.0], &mut state).moved, 1);
        assert!((state.positions[0] - DVec3::Y * 0.001).length() < 1e-15);
        assert!((state.velocities[0] - DVec3::X * 1.5).length() < 1e-15);
        assert!(!contacts.grips[0].sticks && (contacts.grips[0].pressure - 0.1).abs() < 1e-15);
        let (mut contacts, mut state) = one(-0.001, DVec3::new(0.4, -1.0, 0.0));
        respond(&mut contacts, &[0.1], &[10.0], &mut state);
        assert!(contacts.grips[0].sticks && state.velocities[0] == DVec3::ZERO);
    }

    #[test]
    fn leaving_and_distant_particles_keep_their_velocity() {
        let leaving = DVec3::new(2.0, 1.0, 0.0);
        let (mut contacts, mut state) = one(-0.001, leaving);
        respond(&mut contacts, &[0.1], &[10.0], &mut state);
        assert_eq!(state.velocities[0], leaving);
        let (mut contacts, mut state) = one(0.001, -leaving);
        assert_eq!(respond(&mut contacts, &[0.1], &[10.0], &mut state).moved, 0);
        assert_eq!(state.velocities[0], -leaving);
    }
}
