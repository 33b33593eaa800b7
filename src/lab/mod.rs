//! Experiments on materials: the exact solutions that simulations are compared with, and pictures of
//! the comparison.

pub mod elastica;
pub mod picture;
