//! Where frames go: a Rerun recording, live viewers, or memory.
//!
//! A [`Recorder`] takes one [`Frame`] after another. [`RerunRecorder`] writes an `.rrd` file and
//! feeds live viewers at the same time; [`MemoryRecorder`] keeps the frames. What is recorded and
//! where is told by `entity.rs`; a frame becomes shapes in `drawing.rs` and curves in `plots.rs`.
//!
//! Nothing that a viewer does can hold up the file or the simulation: `live.rs` drops frames
//! instead, and counts them. Rerun reports trouble with its sinks only through [`tracing`], so a
//! program that wants to see it installs a subscriber.

mod discard;
mod error;
mod memory;

#[cfg(feature = "rerun")]
pub(crate) mod blueprint;
#[cfg(feature = "rerun")]
mod camera;
#[cfg(feature = "rerun")]
pub(crate) mod checkpoint;
#[cfg(feature = "rerun")]
pub(crate) mod color;
#[cfg(feature = "rerun")]
mod drawing;
#[cfg(feature = "rerun")]
pub(crate) mod entity;
#[cfg(feature = "rerun")]
pub(crate) mod feed;
#[cfg(feature = "rerun")]
mod file;
#[cfg(feature = "rerun")]
mod frame_set;
#[cfg(feature = "rerun")]
mod live;
#[cfg(feature = "rerun")]
pub(crate) mod normals;
#[cfg(feature = "rerun")]
mod panels;
#[cfg(feature = "rerun")]
mod plots;
#[cfg(feature = "rerun")]
pub(crate) mod properties;
#[cfg(feature = "rerun")]
mod queue;
#[cfg(feature = "rerun")]
mod rerun;
#[cfg(feature = "rerun")]
mod springs;
#[cfg(feature = "rerun")]
pub(crate) mod statics;
#[cfg(feature = "rerun")]
mod targets;
#[cfg(test)]
#[cfg(feature = "rerun")]
mod tests;
#[cfg(feature = "rerun")]
mod viewer;

pub use discard::DiscardRecorder;
pub use error::RecordError;
pub use memory::MemoryRecorder;

#[cfg(feature = "rerun")]
pub(crate) use self::file::MOST_LISTED;
#[cfg(feature = "rerun")]
pub use self::rerun::RerunRecorder;
#[cfg(feature = "rerun")]
pub use targets::Targets;

use crate::frame::Frame;

/// Takes the frames of one run.
pub trait Recorder {
    /// Records a frame.
    ///
    /// # Errors
    ///
    /// When the frame can't be kept. A live viewer that misses it is not an error.
    fn record(&mut self, frame: &Frame) -> Result<(), RecordError>;

    /// Completes the recording; nothing may be recorded after it.
    ///
    /// # Errors
    ///
    /// When the recording can't be completed.
    fn finish(&mut self) -> Result<Recorded, RecordError>;

    /// Frames that a live viewer missed so far.
    fn dropped_live_frames(&self) -> u64 {
        0
    }
}

/// What a finished recording holds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Recorded {
    /// Frames recorded.
    pub frames: u64,
    /// Frames that a live viewer missed, wholly or in part; the file has them.
    pub dropped_live_frames: u64,
}
