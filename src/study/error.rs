//! Why there is no study.

use crate::scene::SceneError;

/// Why there is no study.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum StudyError {
    /// The scene can't be built.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// No pool of threads.
    #[error("the threads can't be started: {0}")]
    Threads(String),
    /// Nothing to compare with.
    #[error("there is no reference: {setting} {reason}; {remedy}")]
    NoReference {
        /// What was to be the reference.
        setting: String,
        /// What happened to it.
        reason: String,
        /// What to do.
        remedy: String,
    },
    /// Stopped before there was anything to keep.
    #[error("stopped before the reference was there: nothing is kept")]
    Stopped,
    /// What was asked for makes no sense.
    #[error("{0}")]
    Ask(String),
}
