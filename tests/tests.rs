//! The integration tests: one binary, one module a topic.

mod architecture;
mod laws;
mod program;
mod runs;
mod support;
mod truths;
