//! The integration tests: one binary, one module a topic.

#![allow(
    clippy::unwrap_used,
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a test may panic, and its numbers are small"
)]

mod architecture;
mod bending;
mod blackbox;
mod extremes;
mod gallery;
mod lab;
mod laws;
mod motion;
mod pick;
mod program;
mod projective;
mod runs;
mod schemes;
mod springs;
mod structures;
mod support;
mod truths;
