//! Prescribed motion: rigid, through keyframes, and the mannequin's walk.

mod foot;
mod gait;
mod keyframes;
mod leg;
mod walk;

pub use keyframes::{Keyframe, Motion, Placement};
pub use walk::{Gait, Walk};
