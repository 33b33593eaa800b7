//! Recordings read back: what they hold, frame by frame, and the states in them.
//!
//! Works on the recording of a run that was killed, too: what is whole is read.

mod checkpoints;
mod error;
mod frames;
mod layout;
mod reading;
mod verify;

pub use checkpoints::{
    At, StateHash, checkpoint_times, read_checkpoint, read_first_checkpoint, state_hashes,
};
pub use error::ReadError;
pub use frames::{RecordedFrame, for_each_frame};
pub use layout::{Layout, RecordedCloth, RecordedObstacle};
pub(crate) use reading::for_each_chunk;
pub use verify::{Verdict, verify};
