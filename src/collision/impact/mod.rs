//! Continuous collision detection and the answer to it: nothing passes through anything.
//!
//! [`Impacts`] takes a step's start, which is free of crossings, and its wished end. Every vertex moves
//! in a straight line between them. A round looks for vertices and faces, and edges and edges, that come
//! closer than a floor on the way ([`meeting`]), and moves the ends apart; rounds are repeated until
//! nothing meets any more. What doesn't come apart by impulses moves as a rigid zone. What still meets then
//! is counted. Velocities get inelastic impulses with Coulomb friction.
//!
//! Sources: Bridson, Fedkiw and Anderson 2002; Harmon et al. 2008; Li, Kaufman and Jiang 2021.

mod advance;
mod element;
mod element_boxes;
mod examine;
mod features;
mod ground;
mod halves;
mod near;
mod prism;
mod resolve;
mod search;
mod slowing;
mod solid;
mod stage;
mod touch;
mod watch;
mod zone;

pub use advance::{Meeting, meeting};
pub use features::{Closest, Features};
pub use solid::{Layers, Shape, Solid};
pub use stage::{Fabric, Impacts, Resolved, Step};
