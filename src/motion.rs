//! Prescribed motion: rigid, through keyframes, and of meshes that deform.

mod foot;
mod gait;
mod keyframes;
mod leg;
mod sequence;
mod walk;

pub use keyframes::{Keyframe, Motion, Placement};
pub use sequence::{Sequence, SequenceError};
pub use walk::{Gait, Walk};

use glam::DVec3;
use std::fmt::Debug;

/// A motion in which every vertex of a mesh goes its own way.
pub trait Deformation: Debug + Send + Sync {
    /// Sets where the vertices are at a time (s), in metres; the same bits for any number of threads.
    fn positions(&self, time: f64, positions: &mut [DVec3]);
}
