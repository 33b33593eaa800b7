//! Why a recording can't be exported, each with its cause and remedy.

use crate::replay::ReadError;
use std::io;
use std::path::PathBuf;

/// Why nothing, or not all, is exported.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ExportError {
    /// The recording can't be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// The recording has no complete frame.
    #[error(
        "{} holds no complete frame; give a recording of a run that came far enough to record one",
        .path.display()
    )]
    NoFrame {
        /// The recording.
        path: PathBuf,
    },
    /// There are frames, but later ones.
    #[error(
        "{} has no frame at or before {time} s: the first is at {first} s; \
         ask for that or a later time", .path.display()
    )]
    TooEarly {
        /// The recording.
        path: PathBuf,
        /// The time asked for (s).
        time: f64,
        /// Time of the first frame (s).
        first: f64,
    },
    /// The parts of the recording don't belong together.
    #[error("{}: {what}; the recording is damaged: record the run again", .path.display())]
    Damaged {
        /// The recording.
        path: PathBuf,
        /// What doesn't fit.
        what: String,
    },
    /// The recording changed between its two readings.
    #[error(
        "{} changed while it was read; export it when its run has ended", .path.display()
    )]
    Changed {
        /// The recording.
        path: PathBuf,
    },
    /// More than a `.glb` can hold.
    #[error(
        "{frames} frames make a .glb of {:.1} GB, and its format ends at 4.3 GB; \
         export fewer with --every {every}", *.bytes as f64 * 1e-9
    )]
    TooLarge {
        /// Frames.
        frames: usize,
        /// What they would take.
        bytes: u64,
        /// Every how many frames would fit.
        every: u64,
    },
    /// Something is there already.
    #[error("{} {what}; choose another, or replace with --force", .path.display())]
    Exists {
        /// The file or folder.
        path: PathBuf,
        /// What is there.
        what: String,
    },
    /// A file or folder can't be made.
    #[error("{} can't be written: {source}; {}", .path.display(), remedy(.source))]
    CannotCreate {
        /// The file or folder.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// A file that was begun can't be written to its end; nothing is left of it.
    #[error("{} can't be written: {source}; {}", .path.display(), remedy(.source))]
    CannotWrite {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// What is written to takes no more.
    #[error("can't be written: {0}")]
    Output(#[from] io::Error),
}

/// What to do about it.
fn remedy(source: &io::Error) -> &'static str {
    match source.kind() {
        io::ErrorKind::NotFound => "create its folder or choose another place",
        io::ErrorKind::StorageFull | io::ErrorKind::FileTooLarge => {
            "make room or choose another place"
        }
        _ => "choose another place",
    }
}
