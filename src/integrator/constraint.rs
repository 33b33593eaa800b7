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
            grips[i] = regrip(contact, grip, impulse, against, model.masses[i]);
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
fn regrip(contact: &Contact, grip: Grip, impulse: DVec3, velocity: DVec3, mass: f64) -> Grip {
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
            drag: follow(
                grip.drag,
                -direction * most,
                most / (mass * sliding.length()),
            ),
            sticks: false,
        },
        _ => Grip {
            pressure,
            drag: DVec3::ZERO,
            sticks: true,
        },
    }
}

/// The drag of the next step, which turns from the last one's towards what the present velocity asks for.
///
/// `gain` is the velocity that the drag takes in a step over the one there is, μ p/(m |v|). Taken as it is
/// asked for, a drag turns the velocity in the next step across by that factor times its own angle, past the
/// other side where it is above 1: a slowly sliding block then rattles sideways for ever, and part of its
/// friction is lost (4 % on an incline). Turned by 1/(1 + gain) of the angle it settles whatever the gain, and
/// with dt the gain goes to 0.
fn follow(last: DVec3, asked: DVec3, gain: f64) -> DVec3 {
    let size = asked.length();
    let turned = |last: DVec3| (last * gain * size + asked).try_normalize();
    let drag = last.try_normalize().and_then(turned);
    drag.map_or(asked, |direction| direction * size)
}
