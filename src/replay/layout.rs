//! What stays the same in every frame of a recording.

use super::{ReadError, for_each_chunk};
use crate::recorder::entity;
use crate::recorder::statics::{CLOTHS, OBSTACLES, TOML, texts_of};
use rerun::Mesh3D;
use rerun::log::Chunk;
use std::path::Path;

/// What stays the same in every frame of a recording.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Layout {
    /// The scene's TOML as it was run.
    pub toml: String,
    /// The cloths, in the scene's order.
    pub cloths: Vec<RecordedCloth>,
    /// The obstacles, in the scene's order.
    pub obstacles: Vec<RecordedObstacle>,
}

/// A cloth of a recording.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RecordedCloth {
    /// Its name.
    pub name: String,
    /// Vertex indices of one triangle an entry, counter-clockwise; empty for a chain.
    pub triangles: Vec<[u32; 3]>,
}

/// An obstacle of a recording.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RecordedObstacle {
    /// Its name.
    pub name: String,
    /// Vertex indices of one triangle an entry, counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
    /// Vertex positions (m); `None` when it moves: then every frame has its own.
    pub positions: Option<Vec<[f32; 3]>>,
}

impl Layout {
    /// Reads it from a recording.
    ///
    /// # Errors
    ///
    /// When the file can't be read, is no recording, or has no scene.
    pub fn read(path: &Path) -> Result<Self, ReadError> {
        let scene = entity::path(&[entity::SCENE]);
        let (mut toml, mut cloths, mut obstacles) = (None, None, None);
        let mut bodies = Vec::new();
        for_each_chunk(path, |chunk| {
            if !chunk.is_static() {
                return;
            }
            if *chunk.entity_path() == scene {
                let take = |known: &mut Option<Vec<String>>, component: &'static str| {
                    *known = known.take().or_else(|| texts_of(&chunk, component));
                };
                take(&mut toml, TOML);
                take(&mut cloths, CLOTHS);
                take(&mut obstacles, OBSTACLES);
            } else if chunk.entity_path().len() == 2
                && (chunk.entity_path().iter().next())
                    .is_some_and(|part| part.unescaped_str() == entity::WORLD)
            {
                bodies.push(chunk);
            }
        })?;
        let (Some(mut toml), Some(cloths), Some(obstacles)) = (toml, cloths, obstacles) else {
            return Err(ReadError::NoScene {
                path: path.to_owned(),
            });
        };
        let cloths = cloths.into_iter().map(|name| RecordedCloth {
            triangles: find(&bodies, &name, triangles).unwrap_or_default(),
            name,
        });
        let obstacles = obstacles.into_iter().map(|name| RecordedObstacle {
            triangles: find(&bodies, &name, triangles).unwrap_or_default(),
            positions: find(&bodies, &name, |chunk| positions(chunk).next()),
            name,
        });
        Ok(Self {
            toml: toml.pop().unwrap_or_default(),
            cloths: cloths.collect(),
            obstacles: obstacles.collect(),
        })
    }
}

/// What the chunks of `/world/<name>` say.
fn find<T>(chunks: &[Chunk], name: &str, say: impl Fn(&Chunk) -> Option<T>) -> Option<T> {
    let path = entity::body(name);
    let mut own = chunks.iter().filter(|chunk| *chunk.entity_path() == path);
    own.find_map(say)
}

fn triangles(chunk: &Chunk) -> Option<Vec<[u32; 3]>> {
    let component = Mesh3D::descriptor_triangle_indices().component;
    let mut rows = chunk.iter_slices::<[u32; 3]>(component);
    rows.next().map(<[_]>::to_vec)
}

/// Vertex positions of the rows of a chunk of `/world/<name>` (m).
pub(super) fn positions(chunk: &Chunk) -> impl Iterator<Item = Vec<[f32; 3]>> {
    let of_mesh = Mesh3D::descriptor_vertex_positions().component;
    let of_points = rerun::Points3D::descriptor_positions().component;
    let rows = [of_mesh, of_points].map(|component| chunk.iter_slices::<[f32; 3]>(component));
    rows.into_iter().flatten().map(<[_]>::to_vec)
}

/// Vertex colours of the same rows (sRGB).
pub(super) fn colors(chunk: &Chunk) -> impl Iterator<Item = Vec<[u8; 3]>> {
    let of_mesh = Mesh3D::descriptor_vertex_colors().component;
    let of_points = rerun::Points3D::descriptor_colors().component;
    let rows = [of_mesh, of_points].map(|component| chunk.iter_slices::<u32>(component));
    let rgb = |rgba: &u32| {
        let [red, green, blue, _] = rgba.to_be_bytes();
        [red, green, blue]
    };
    let rows = rows.into_iter().flatten();
    rows.map(move |row| row.iter().map(rgb).collect())
}
