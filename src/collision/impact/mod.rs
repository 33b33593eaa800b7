//! Continuous collision detection and the answer to it: nothing passes through anything.

mod advance;
mod features;

pub use advance::{Meeting, meeting};
pub use features::{Closest, Features};
