//! Contact of particles with obstacles: finding it, and answering it.
//!
//! [`Detection`] asks each obstacle for the nearest point of every particle that may be close;
//! [`respond`] moves particles out and takes away their approach, with Coulomb friction. What the
//! implicit schemes need to know of a lasting contact is its [`Grip`].

mod contact;
mod detection;
pub mod impact;
mod obstacle;
mod response;

pub use contact::{Contact, Contacts, Grip};
pub use detection::Detection;
pub use obstacle::Obstacle;
pub use response::{Masses, Response, respond};
