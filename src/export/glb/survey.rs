//! What the file's head must say: how much there is, where, and in which bounds.

use super::differences;
use super::walk::{Part, Place, walk};
use crate::export::{ExportError, Selection, Span};
use crate::replay::Layout;
use std::path::Path;

/// What is in the file.
#[derive(Debug, Default)]
pub(super) struct Survey {
    pub(super) span: Span,
    /// Triangles and links of all bodies.
    pub(super) indices: Vec<u32>,
    /// Bytes of all positions and normals.
    pub(super) vertex_bytes: u64,
    /// Times, weights and scales of the animation.
    pub(super) keys: Vec<f32>,
    pub(super) resting: Vec<Mesh>,
    pub(super) segments: Vec<Segment>,
}

/// Meshes that share the keys of their weights.
#[derive(Debug, Default)]
pub(super) struct Segment {
    pub(super) meshes: Vec<Mesh>,
    /// Times of the base and the targets (s).
    pub(super) times: Vec<f32>,
}

/// A body, with its targets if it moves.
#[derive(Debug, Default)]
pub(super) struct Mesh {
    pub(super) name: String,
    pub(super) is_cloth: bool,
    /// Its part of the indices.
    pub(super) indices: Run,
    pub(super) is_chain: bool,
    pub(super) base: Vertices,
    pub(super) targets: Vec<Vertices>,
}

/// Numbers in a row.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Run {
    /// Byte at which they begin, in their part of the file.
    pub(super) offset: u64,
    /// How many.
    pub(super) count: usize,
}

/// Positions of a mesh, or their differences; normals follow.
#[derive(Debug, Default)]
pub(super) struct Vertices {
    pub(super) positions: Run,
    pub(super) least: [f32; 3],
    pub(super) greatest: [f32; 3],
    /// None of a chain.
    pub(super) normals: Option<Run>,
}

/// Reads a recording for it.
pub(super) fn survey(
    path: &Path,
    layout: &Layout,
    selection: Selection,
) -> Result<Survey, ExportError> {
    let mut survey = Survey::default();
    let span = walk(path, layout, selection, usize::MAX, |part| {
        survey.take(&part);
        Ok(())
    })?;
    survey.span = span;
    if survey.indices.is_empty() {
        return Err(ExportError::Damaged {
            path: path.to_owned(),
            what: "there is nothing to draw".to_owned(),
        });
    }
    Ok(survey)
}

impl Survey {
    /// Bytes of the second chunk.
    pub(super) fn bytes(&self) -> u64 {
        let words = self.indices.len() + self.keys.len();
        4 * words as u64 + self.vertex_bytes
    }

    fn take(&mut self, part: &Part<'_>) {
        match part {
            Part::Resting(places) => {
                self.resting = places.iter().map(|place| self.mesh(place)).collect();
            }
            Part::Base(places) => {
                let meshes = match self.segments.first() {
                    None => places.iter().map(|place| self.mesh(place)).collect(),
                    Some(first) => {
                        let indices: Vec<Run> = first.meshes.iter().map(|m| m.indices).collect();
                        let places = places.iter().zip(indices);
                        places
                            .map(|(place, indices)| self.mesh_of(place, indices))
                            .collect()
                    }
                };
                self.segments.push(Segment {
                    meshes,
                    times: Vec::new(),
                });
            }
            Part::Target {
                base,
                places,
                times,
            } => {
                let added: Vec<Vertices> = (base.iter().zip(*places))
                    .map(|(base, place)| {
                        let moved = differences(&place.positions, &base.positions);
                        self.vertices(&moved, !place.triangles.is_empty())
                    })
                    .collect();
                let Some(segment) = self.segments.last_mut() else {
                    return;
                };
                for (mesh, target) in segment.meshes.iter_mut().zip(added) {
                    mesh.targets.push(target);
                }
                let from = usize::from(!segment.times.is_empty());
                segment.times.extend(&times[from..]);
            }
        }
    }

    /// A mesh of its own indices.
    fn mesh(&mut self, place: &Place) -> Mesh {
        let offset = 4 * self.indices.len() as u64;
        let before = self.indices.len();
        self.indices.extend(place.triangles.as_flattened());
        self.indices.extend(place.links.as_flattened());
        let count = self.indices.len() - before;
        self.mesh_of(place, Run { offset, count })
    }

    fn mesh_of(&mut self, place: &Place, indices: Run) -> Mesh {
        let is_chain = place.triangles.is_empty();
        Mesh {
            name: place.name.clone(),
            is_cloth: place.is_cloth,
            indices,
            is_chain,
            base: self.vertices(&place.positions, !is_chain),
            targets: Vec::new(),
        }
    }

    fn vertices(&mut self, positions: &[[f32; 3]], with_normals: bool) -> Vertices {
        let mut run = || {
            let offset = self.vertex_bytes;
            self.vertex_bytes += size_of_val(positions) as u64;
            let count = positions.len();
            Run { offset, count }
        };
        let mut vertices = Vertices {
            positions: run(),
            normals: with_normals.then(run),
            least: [f32::INFINITY; 3],
            greatest: [f32::NEG_INFINITY; 3],
        };
        for position in positions {
            for axis in 0..3 {
                vertices.least[axis] = vertices.least[axis].min(position[axis]);
                vertices.greatest[axis] = vertices.greatest[axis].max(position[axis]);
            }
        }
        vertices
    }

    /// Adds keys, and says where they are: `width` numbers make one.
    pub(super) fn add_keys(&mut self, keys: &[f32], width: usize) -> Run {
        let offset = 4 * self.keys.len() as u64;
        self.keys.extend_from_slice(keys);
        let count = keys.len() / width;
        Run { offset, count }
    }
}
