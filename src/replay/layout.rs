//! What stays the same in every frame of a recording.

use super::{ReadError, for_each_chunk};
use crate::frame::{Checkpoint, ClothCheckpoint};
use crate::recorder::checkpoint::{start_particles, start_time};
use crate::recorder::entity;
use crate::recorder::statics::{BRANCH, CLOTHS, OBSTACLES, TEXT, TOML, frames_of, texts_of};
use crate::scene::{LoadedScene, SceneError, load_text};
use rerun::log::Chunk;
use rerun::{EntityPathPart, Mesh3D};
use std::collections::BTreeMap;
use std::path::Path;

/// What stays the same in every frame of a recording.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Layout {
    /// The scene's TOML as it was run.
    pub toml: String,
    /// Texts of the OBJ meshes that it names, by their paths in it.
    pub meshes: BTreeMap<String, String>,
    /// Of which recording this is a branch, and how; empty otherwise.
    pub branch: String,
    /// Number of frames as the end of the recording says; `None` when the end is missing.
    pub frames: Option<u64>,
    /// What a branch started with.
    pub start: Option<Checkpoint>,
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
        let folder = entity::path(&[entity::SCENE, entity::MESHES]);
        let (mut toml, mut cloths, mut obstacles, mut branch) = (None, None, None, None);
        let mut bodies = Vec::new();
        let mut meshes = BTreeMap::new();
        let mut start = Start::default();
        let mut frames = None;
        for_each_chunk(path, |chunk| {
            if !chunk.is_static() {
                return;
            }
            start.take(&chunk);
            if *chunk.entity_path() == scene {
                let take = |known: &mut Option<Vec<String>>, component: &'static str| {
                    *known = known.take().or_else(|| texts_of(&chunk, component));
                };
                take(&mut toml, TOML);
                take(&mut cloths, CLOTHS);
                take(&mut obstacles, OBSTACLES);
                take(&mut branch, BRANCH);
                frames = frames.or_else(|| frames_of(&chunk));
            } else if chunk.entity_path().is_child_of(&folder) {
                let name = chunk
                    .entity_path()
                    .last()
                    .map(EntityPathPart::unescaped_str);
                let text = texts_of(&chunk, TEXT).and_then(|mut texts| texts.pop());
                meshes.extend(name.map(str::to_owned).zip(text));
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
        let start = start.checkpoint(&cloths);
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
            meshes,
            frames,
            start,
            branch: branch.and_then(|mut texts| texts.pop()).unwrap_or_default(),
            cloths: cloths.collect(),
            obstacles: obstacles.collect(),
        })
    }
}

impl Layout {
    /// The scene as it was run, which messages call `name`; it needs no file.
    ///
    /// # Errors
    ///
    /// When this version takes it no more.
    pub fn scene(&self, name: &str) -> Result<LoadedScene, SceneError> {
        load_text(name, self.toml.clone(), None, self.meshes.clone())
    }
}

/// What a branch started with, as far as it is read.
#[derive(Default)]
struct Start {
    time: Option<f64>,
    cloths: BTreeMap<String, Vec<[f64; 6]>>,
}

impl Start {
    fn take(&mut self, chunk: &Chunk) {
        let path = chunk.entity_path();
        let root = entity::path(&[entity::START]);
        if *path == root {
            self.time = self.time.or_else(|| start_time(chunk));
        } else if path.is_child_of(&root) {
            let name = path.last().map(|part| part.unescaped_str().to_owned());
            self.cloths.extend(name.zip(start_particles(chunk)));
        }
    }

    fn checkpoint(mut self, names: &[String]) -> Option<Checkpoint> {
        let cloths = names.iter().map(|name| {
            Some(ClothCheckpoint {
                name: name.clone(),
                particles: self.cloths.remove(name)?,
            })
        });
        let cloths = cloths.collect::<Option<_>>()?;
        Some(Checkpoint {
            step: 0,
            time: self.time?,
            cloths,
            luggage: Vec::new(),
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
