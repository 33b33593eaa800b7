//! Contact of particles with obstacles: finding it, and answering it.
//!
//! [`Audit`] measures, apart from both, what they left undone.
//!
//! [`Bodies`] knows where the obstacles of a model are, and how far they go in a step.
//! [`Detection`] asks each obstacle for the nearest point of every particle that may be close;
//! [`respond`] moves particles out and takes away their approach, with Coulomb friction. What the
//! implicit schemes need to know of a lasting contact is its [`Grip`].

mod audit;
mod body;
mod contact;
mod detection;
pub mod impact;
mod obstacle;
mod response;
mod tangles;

pub use audit::{Audit, Findings, Penetration, Tangle};
pub use body::{Anchor, Bodies};
pub use contact::{Contact, Contacts, Grip};
pub use detection::Detection;
pub use obstacle::{BodyMotion, Obstacle, SelfCollision, Solid};
pub use response::{Masses, Response, respond};
pub use tangles::{Scenery, TIME, Tangles};
