//! Experiments on materials: virtual swatch tests, the exact solutions that they are compared with,
//! and the comparison in words, tables and pictures.
//!
//! What a cloth is made of is given by moduli; what it is after all depends on how springs and hinges
//! stand for them. [`membrane`] measures stretch and shear of [`swatch`]es, [`cantilever`] bending,
//! both at several resolutions with their [`limit`](mod@limit); [`finding`] does so for the cloths of a scene,
//! [`table`], [`words`] and [`drawing`] say what came of it.

pub mod cantilever;
mod digits;
pub mod drawing;
pub mod elastica;
pub mod elasticity;
pub mod finding;
pub mod limit;
pub mod membrane;
pub mod swatch;
pub mod table;
pub mod words;
