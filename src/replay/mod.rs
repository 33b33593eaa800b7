//! Recordings read back: what they hold, frame by frame, and the states in them.
//!
//! A [`Replay`] streams them to viewers again, at their pace.
//!
//! Works on the recording of a run that was killed, too: what is whole is read.

mod checkpoints;
mod error;
mod frames;
mod info;
mod layout;
mod overlay;
mod pace;
mod play;
mod reading;
mod stage;
mod survey;
mod track;
mod verify;

pub use checkpoints::{
    At, StateHash, checkpoint_times, read_checkpoint, read_first_checkpoint, state_hashes,
};
pub use error::ReadError;
pub use frames::{RecordedFrame, for_each_frame};
pub use info::{Info, Size, Summary};
pub use layout::{Layout, RecordedCloth, RecordedObstacle};
pub use pace::Pace;
pub use play::{Command, Console, Replay, ReplayError, ReplayPlan, ReplayProgress};
pub(crate) use reading::for_each_chunk;
pub use verify::{Verdict, verify};

use frames::seconds;
use play::{Viewers, Window};
#[cfg(test)]
use reading::Messages;
