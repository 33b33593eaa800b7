//! What the implicit schemes may not change: pinned particles and lasting contacts.

use crate::collision::{Contact, Contacts, Grip};
use crate::linear::Constraint;
use crate::model::Model;
use glam::DVec3;

/// One constraint a particle. A contact that carries pressure lets its particle approach the place
/// where contact begins, and no further; one that sticks also takes its tangential velocity.
pub(super) fn constrain(model: &Model, contacts: &Contacts, constraints: &mut [Constraint]) {
    for (constraint, &w) in constraints.iter_mut().zip(&model.inverse_masses) {
        *constraint = if w == 0.0 {
            Constraint::Fixed
        } else {
            Constraint::Free
        };
    }
    for (contact, grip) in pressed(model, contacts) {
        constraints[contact.particle] = if grip.sticks {
            Constraint::Fixed
        } else {
            Constraint::Plane(contact.normal)
        };
    }
}

/// The contacts that carry pressure, of particles that aren't pinned.
pub(super) fn pressed<'a>(
    model: &'a Model,
    contacts: &'a Contacts,
) -> impl Iterator<Item = (&'a Contact, &'a Grip)> {
    let with_grip = contacts
        .list
        .iter()
        .map(|contact| (contact, &contacts.grips[contact.particle]));
    with_grip.filter(|(contact, grip)| grip.pressure > 0.0 && !model.is_pinned(contact.particle))
}

/// Sets the velocities that lasting contacts give: along their normal that of the obstacle and the one that
/// closes the gap (m/s), and across it the obstacle's where they stick.
pub(super) fn prescribe(
    model: &Model,
    contacts: &Contacts,
    closing: impl Fn(&Contact) -> f64,
    velocities: &mut [DVec3],
) {
    for (contact, grip) in pressed(model, contacts) {
        let v = &mut velocities[contact.particle];
        let against = contact.against(*v);
        let tangential = if grip.sticks {
            DVec3::ZERO
        } else {
            against - contact.normal * against.dot(contact.normal)
        };
        *v = contact.velocity + tangential + contact.normal * closing(contact);
    }
}

/// What the constraints had to supply says how each contact goes on: `missing` is what was left of the
/// equation, of which one step's impulse is `scale` times as much with its sign turned. A contact that
/// lets go leaves its particle no velocity towards the obstacle: that was the constraint's own pull.
pub(super) fn update_grips(
    model: &Model,
    contacts: &mut Contacts,
    missing: &[DVec3],
    scale: f64,
    velocities: &mut [DVec3],
) {
    let Contacts { list, grips } = contacts;
    for contact in list {
        let i = contact.particle;
        let grip = grips[i];
        if grip.pressure > 0.0 {
            let (v, impulse) = (&mut velocities[i], -missing[i] * scale);
            contact.impulse += if grip.sticks {
                impulse
            } else {
                contact.normal * impulse.dot(contact.normal) + grip.drag
            };
            let against = contact.against(*v);
            grips[i] = regrip(contact, grip, impulse, against);
            if grips[i].pressure == 0.0 {
                let pull = contact.normal * against.dot(contact.normal).min(0.0);
                *v -= pull;
                contact.impulse -= pull * model.masses[i];
            }
        }
    }
}

/// Reads from the impulse that a constraint supplied how the contact goes on.
///
/// A contact that would have to pull lets go. Friction holds while |tangential impulse| ≤ μ pressure, and
/// otherwise drags with μ pressure against the motion that the pull, or the velocity against the obstacle,
/// asks for.
fn regrip(contact: &Contact, grip: Grip, impulse: DVec3, velocity: DVec3) -> Grip {
    let pressure = impulse.dot(contact.normal);
    if pressure <= 0.0 {
        return Grip::default();
    }
    let most = contact.friction * pressure;
    if grip.sticks {
        let held = impulse - contact.normal * pressure;
        let pull = held.length();
        if pull <= most {
            return Grip {
                pressure,
                drag: DVec3::ZERO,
                sticks: true,
            };
        }
        return Grip {
            pressure,
            drag: held * (most / pull),
            sticks: false,
        };
    }
    let sliding = velocity - contact.normal * velocity.dot(contact.normal);
    let reversed = sliding.dot(grip.drag) > 0.0;
    match sliding.try_normalize() {
        Some(direction) if !reversed => Grip {
            pressure,
            drag: -direction * most,
            sticks: false,
        },
        _ => Grip {
            pressure,
            drag: DVec3::ZERO,
            sticks: true,
        },
    }
}
