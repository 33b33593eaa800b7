//! The integration tests: one binary, one module a topic.

#![allow(
    clippy::unwrap_used,
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a test may panic, and its numbers are small"
)]

mod ablate;
mod architecture;
mod bad_obstacles;
mod bending;
mod blackbox;
#[cfg(feature = "rerun")]
mod compare;
mod contact;
mod contact_study;
mod contract;
mod detection;
mod error;
#[cfg(feature = "rerun")]
mod export;
mod extremes;
mod gallery;
mod impacts;
mod incline;
mod lab;
mod laws;
mod ledger;
#[cfg(feature = "rerun")]
mod live;
mod mesh_error;
mod motion;
mod moving;
mod pick;
mod program;
mod projective;
#[cfg(feature = "rerun")]
mod recordings;
mod recovery;
#[cfg(feature = "rerun")]
mod replay;
mod required;
mod resume;
mod runs;
mod schemes;
mod springs;
mod stability_map;
mod structures;
mod study;
mod support;
mod truths;
