//! Why a recording can't be read, each with its cause and remedy.

use std::io;
use std::path::PathBuf;

/// Why nothing can be read from a recording.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ReadError {
    /// The file can't be read.
    #[error("cannot read {}: {source}; give the path of an .rrd file", .path.display())]
    CannotRead {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// The file is no recording.
    #[error(
        "{} is not a Rerun recording that this version reads: {reason}; \
         give an .rrd file that muslin saved", .path.display()
    )]
    NotARecording {
        /// The file.
        path: PathBuf,
        /// What Rerun says.
        reason: String,
    },
    /// The recording has no complete checkpoint.
    #[error(
        "{} holds no checkpoint; give a recording that muslin saved with --save, \
         of a run that came far enough to record one", .path.display()
    )]
    NoCheckpoint {
        /// The file.
        path: PathBuf,
    },
    /// There are checkpoints, but later ones.
    #[error(
        "{} has no checkpoint at or before {time} s: the first is at {first} s; \
         ask for that or a later time", .path.display()
    )]
    TooEarly {
        /// The file.
        path: PathBuf,
        /// The time asked for (s).
        time: f64,
        /// Time of the first checkpoint (s).
        first: f64,
    },
    /// The recording has no scene.
    #[error("{} holds no scene; give a recording that muslin saved", .path.display())]
    NoScene {
        /// The file.
        path: PathBuf,
    },
}
