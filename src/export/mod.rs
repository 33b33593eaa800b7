//! Recordings in the formats of other programs: a table of the exact state, a mesh file a frame, and
//! one animated file.
//!
//! Lengths are in metres, y is up, right-handed, as in muslin itself; glTF wants just that.

mod csv;

#[cfg(feature = "rerun")]
mod body;
#[cfg(feature = "rerun")]
mod error;
#[cfg(feature = "rerun")]
mod file;
#[cfg(feature = "rerun")]
mod glb;
#[cfg(feature = "rerun")]
mod obj;
#[cfg(feature = "rerun")]
mod ply;
#[cfg(test)]
#[cfg(feature = "rerun")]
mod sample;
#[cfg(feature = "rerun")]
mod selection;
#[cfg(feature = "rerun")]
mod sequence;

pub use csv::write_csv;

#[cfg(feature = "rerun")]
pub use error::ExportError;
#[cfg(feature = "rerun")]
pub use file::{check_file, write_whole};
#[cfg(feature = "rerun")]
pub use glb::Animation;
#[cfg(feature = "rerun")]
pub use obj::write_obj;
#[cfg(feature = "rerun")]
pub use ply::write_ply;
#[cfg(feature = "rerun")]
pub use selection::{Selection, Span, for_each_selected};
#[cfg(feature = "rerun")]
pub use sequence::{MeshFormat, check_folder, write_sequence};
