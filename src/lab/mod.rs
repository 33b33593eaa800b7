//! Experiments on materials: virtual swatch tests, the exact solutions that they are compared with,
//! and pictures of the comparison.

pub mod cantilever;
pub mod elastica;
pub mod elasticity;
pub mod limit;
pub mod membrane;
pub mod picture;
pub mod swatch;
