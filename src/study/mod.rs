//! What accuracy costs: runs of one scene under every scheme and step, against a reference that the
//! study computes itself.
//!
//! A [`Subject`] is the scene and how it is run; a [`Reference`] what runs are compared with; a
//! [`sweep`](sweep()) measures one [`Row`] a [`Setting`]. [`front`] finds what is worth its time, [`table`] and
//! [`diagram()`] say it, [`overlay`] shows it. Errors are those of the time step, on one mesh; [`mesh`]
//! has those of the mesh. [`ablate`] finds which parts of the model the scene needs, [`contact`] what
//! exact distances and continuous detection are worth, [`stability`] at which steps it runs at all.
//! `compare` lays two recordings over each other.

pub mod ablate;
#[cfg(feature = "rerun")]
pub mod compare;
pub mod contact;
mod date;
mod diagram;
mod distance;
mod error;
pub mod front;
pub mod ladder;
pub mod mesh;
pub mod overlay;
pub mod pick;
pub mod reference;
mod setting;
pub mod stability;
mod subject;
mod sweep;
pub mod table;
mod track;

pub use date::today;
pub use diagram::diagram;
pub use distance::{Distance, diagonal};
pub use error::StudyError;
pub use ladder::Dials;
pub use pick::{Goal, Picked, pick};
pub use reference::{MARGIN, Reference, reference};
use setting::when;
pub use setting::{Setting, digits};
pub use subject::{Outcome, PATIENCE, Subject, Trial};
pub use sweep::{Error, Row, sweep};
pub use track::Track;
