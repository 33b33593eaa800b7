//! What can go wrong while recording, each with its cause and remedy.

use std::io;
use std::net::SocketAddr;
#[cfg(feature = "rerun")]
use std::path::Path;
use std::path::PathBuf;

/// Why a recording failed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RecordError {
    /// The file can't be created or written.
    #[error("cannot write the recording {}: {source}; {}", .path.display(), remedy(.source))]
    CannotWrite {
        /// The recording.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// The file exists, and nobody said that it may be replaced.
    #[error("{} exists; give another name with --save, or replace it with --force", .path.display())]
    Exists {
        /// The file.
        path: PathBuf,
    },
    /// The address of the viewer isn't one.
    #[error("`{url}` is no viewer address: {reason}; write rerun+http://HOST:9876/proxy")]
    BadUrl {
        /// What was given.
        url: String,
        /// What is wrong with it.
        reason: String,
    },
    /// The port for viewers can't be opened.
    #[error("cannot serve viewers on {address}: {source}; choose another with --serve PORT")]
    CannotServe {
        /// The address.
        address: SocketAddr,
        /// What the system says.
        source: io::Error,
    },
    /// The viewer can't be started.
    #[error(
        "cannot start the Rerun viewer: {reason}; install it (`pip install rerun-sdk==0.36.3`) so \
         that `rerun` is in PATH, or record with --save and open the file later"
    )]
    CannotSpawn {
        /// Why.
        reason: String,
    },
    /// A thread for a viewer can't be started.
    #[error("cannot start a thread for the live viewer: {source}; run without live viewers")]
    CannotStartThread {
        /// What the system says.
        source: io::Error,
    },
    /// Two things of a scene would be recorded under one name.
    #[error(
        "`{name}` would be recorded twice under one name; give cloths and obstacles names of \
         their own, and none of them `contacts`"
    )]
    NameTaken {
        /// The name.
        name: String,
    },
    /// Neither a file nor a viewer was asked for.
    #[error("nothing to record to; use --save, --connect, --serve or --spawn")]
    NoTarget,
    /// Rerun refused.
    #[error("recording failed: {message}; the frames up to here are in the recording")]
    Sink {
        /// What Rerun says.
        message: String,
    },
}

impl RecordError {
    /// What the system says about a recording's file.
    #[cfg(feature = "rerun")]
    pub(super) fn of_file(path: &Path, source: io::Error) -> Self {
        let path = path.to_owned();
        match source.kind() {
            io::ErrorKind::AlreadyExists if path.is_dir() => Self::CannotWrite {
                path,
                source: io::ErrorKind::IsADirectory.into(),
            },
            io::ErrorKind::AlreadyExists => Self::Exists { path },
            _ => Self::CannotWrite { path, source },
        }
    }
}

/// What to do about a file that can't be written.
fn remedy(source: &io::Error) -> &'static str {
    match source.kind() {
        io::ErrorKind::NotFound => "create its folder first, or choose another with --save",
        io::ErrorKind::PermissionDenied | io::ErrorKind::ReadOnlyFilesystem => {
            "choose a folder that you may write to with --save"
        }
        io::ErrorKind::IsADirectory => "that is a folder; name a file with --save",
        io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded => {
            "free some space or choose another disk with --save; \
             the frames up to here can still be opened"
        }
        _ => "choose another file with --save",
    }
}
