//! What is wrong with a scene, and where.

use std::fmt;

/// Why a scene can't be run: file, line where there is one, cause and remedy.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub struct SceneError {
    /// The file, or the built-in scene's name.
    pub file: String,
    /// Line in the file, from 1.
    pub line: Option<usize>,
    /// What is wrong, and what to do about it.
    pub cause: String,
}

impl fmt::Display for SceneError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.line {
            Some(line) => write!(f, "{}:{line}: {}", self.file, self.cause),
            None => write!(f, "{}: {}", self.file, self.cause),
        }
    }
}

/// A fault found after parsing, at a path of keys such as `cloth.0.material.stretch`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Fault {
    pub path: String,
    pub cause: String,
}

impl Fault {
    pub(super) fn new(path: impl Into<String>, cause: impl Into<String>) -> Self {
        Self {
            path: path.into(),
            cause: cause.into(),
        }
    }
}
