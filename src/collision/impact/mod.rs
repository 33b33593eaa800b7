//! Continuous collision detection and the answer to it: nothing passes through anything.

mod advance;
mod element;
mod examine;
mod features;
mod ground;
mod resolve;
mod search;
mod slowing;
mod solid;
mod stage;
mod touch;
mod zone;

pub use advance::{Meeting, meeting};
pub use features::{Closest, Features};
pub use solid::{Layers, Shape, Solid};
pub use stage::{Fabric, Impacts, Resolved, Step};
