//! One animated file: binary glTF 2.0, which Blender, three.js and most others open.
//!
//! Every body that moves is a mesh at its place in a first frame, with the differences of the later
//! frames from it, of positions and normals, as morph targets. Their weights turn one target up while
//! they turn down the one before, so that what is between two frames lies on a line between them. A
//! chain is drawn as lines. All is in linen and grey: strain is shown by the colours of PLY.
//!
//! Too many targets of one mesh can't be drawn (see [`TARGETS`]), so a longer recording becomes several
//! meshes one after another, of which all but one are scaled to nothing.
//!
//! The recording is read twice, first to learn what the file's head must say, so that neither is held in
//! memory.
//!
//! Source: Khronos, glTF 2.0 specification, 2021.

mod document;
mod survey;
#[cfg(test)]
mod tests;
mod walk;

use super::{ExportError, Selection, Span};
use crate::recorder::normals::smooth;
use crate::replay::Layout;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use survey::{Survey, survey};
use walk::{Part, Place, walk};

/// Most morph targets of a mesh.
///
/// three.js keeps a target in a layer of a texture, and its weight in a vector of four among the
/// constants of its program. WebGL 2 promises 256 of each, and 25 such vectors are used otherwise.
const TARGETS: usize = 200;

/// Bytes of the file's head, and of the head of each of its two chunks.
const HEAD: u64 = 12;
const CHUNK_HEAD: u64 = 8;

/// A recording as one animated file, ready to be written.
#[derive(Debug)]
pub struct Animation {
    recording: PathBuf,
    layout: Layout,
    selection: Selection,
    survey: Survey,
    /// The file's first chunk.
    document: Vec<u8>,
}

impl Animation {
    /// Reads what the file's head must say.
    ///
    /// # Errors
    ///
    /// When the recording can't be read, has no such frame, or is too large for the format.
    pub fn survey(recording: &Path, selection: Selection) -> Result<Self, ExportError> {
        let layout = Layout::read(recording)?;
        let mut survey = survey(recording, &layout, selection)?;
        let mut document = document::document(&mut survey).to_string().into_bytes();
        document.resize(document.len().next_multiple_of(4), b' ');
        let animation = Self {
            recording: recording.to_owned(),
            layout,
            selection,
            survey,
            document,
        };
        let (bytes, most) = (animation.bytes(), u64::from(u32::MAX));
        if bytes > most {
            let now = match selection {
                Selection::Every(every) => every.get(),
                Selection::At(_) => 1,
            };
            return Err(ExportError::TooLarge {
                frames: animation.span().frames,
                bytes,
                every: now * bytes.div_ceil(most),
            });
        }
        Ok(animation)
    }

    /// Length of the file.
    pub fn bytes(&self) -> u64 {
        HEAD + 2 * CHUNK_HEAD + self.document.len() as u64 + self.survey.bytes()
    }

    /// The frames in it.
    pub fn span(&self) -> Span {
        self.survey.span
    }

    /// Writes the file.
    ///
    /// # Errors
    ///
    /// When `out` can't be written, or the recording isn't what it was.
    pub fn write(&self, out: &mut impl Write) -> Result<(), ExportError> {
        let word = |length: u64| u32::try_from(length).map_err(io::Error::other);
        out.write_all(b"glTF")?;
        out.write_all(&2_u32.to_le_bytes())?;
        out.write_all(&word(self.bytes())?.to_le_bytes())?;
        for (kind, length) in [
            (b"JSON", self.document.len() as u64),
            (b"BIN\0", self.survey.bytes()),
        ] {
            out.write_all(&word(length)?.to_le_bytes())?;
            out.write_all(kind)?;
            if kind == b"JSON" {
                out.write_all(&self.document)?;
            }
        }
        for index in &self.survey.indices {
            out.write_all(&index.to_le_bytes())?;
        }
        let mut vertices = Vertices { out, bytes: 0 };
        self.write_vertices(&mut vertices)?;
        if vertices.bytes != self.survey.vertex_bytes {
            return Err(ExportError::Changed {
                path: self.recording.clone(),
            });
        }
        for key in &self.survey.keys {
            out.write_all(&key.to_le_bytes())?;
        }
        Ok(())
    }

    fn write_vertices(&self, out: &mut Vertices<'_, impl Write>) -> Result<(), ExportError> {
        let mut normals = Vec::new();
        let most = self.survey.span.frames;
        walk(
            &self.recording,
            &self.layout,
            self.selection,
            most,
            |part| {
                match part {
                    Part::Resting(places) => {
                        for place in places {
                            out.write(&place.positions)?;
                            out.write(&normals_of(place))?;
                        }
                    }
                    Part::Base(places) => {
                        normals = places.iter().map(normals_of).collect();
                        for (place, normals) in places.iter().zip(&normals) {
                            out.write(&place.positions)?;
                            out.write(normals)?;
                        }
                    }
                    Part::Target { base, places, .. } => {
                        for ((base, place), normals) in base.iter().zip(places).zip(&normals) {
                            out.write(&differences(&place.positions, &base.positions))?;
                            out.write(&differences(&normals_of(place), normals))?;
                        }
                    }
                }
                Ok(())
            },
        )?;
        Ok(())
    }
}

/// Normals of a mesh; none of a chain.
fn normals_of(place: &Place) -> Vec<[f32; 3]> {
    match place.triangles.is_empty() {
        true => Vec::new(),
        false => smooth(&place.positions, &place.triangles),
    }
}

/// a − b of each vertex.
fn differences(a: &[[f32; 3]], b: &[[f32; 3]]) -> Vec<[f32; 3]> {
    let pairs = a.iter().zip(b);
    pairs
        .map(|(a, b)| [a[0] - b[0], a[1] - b[1], a[2] - b[2]])
        .collect()
}

/// Writes vectors and counts them.
struct Vertices<'a, W> {
    out: &'a mut W,
    bytes: u64,
}

impl<W: Write> Vertices<'_, W> {
    fn write(&mut self, vectors: &[[f32; 3]]) -> io::Result<()> {
        for x in vectors.as_flattened() {
            self.out.write_all(&x.to_le_bytes())?;
        }
        self.bytes += size_of_val(vectors) as u64;
        Ok(())
    }
}
