//! What accuracy costs: runs of one scene under every scheme and step, against a reference that the
//! study computes itself.
//!
//! A [`Subject`] is the scene and how it is run; a [`Reference`] what runs are compared with; a
//! [`sweep`](sweep()) measures one [`Row`] a [`Setting`]. [`front`] finds what is worth its time. Errors are
//! those of the time step, on one mesh.

mod distance;
mod error;
pub mod front;
pub mod ladder;
pub mod pick;
pub mod reference;
mod setting;
mod subject;
mod sweep;

pub use distance::Distance;
pub use error::StudyError;
pub use ladder::Dials;
pub use pick::{Goal, Picked, pick};
pub use reference::Reference;
pub use setting::{Setting, digits};
pub use subject::{Outcome, PATIENCE, Subject, Trial};
pub use sweep::{Error, Row, sweep};
