//! Where the texts of OBJ meshes come from: with the scene, built in, or from the disk.

use super::builtin_mesh;
use super::fault::{Fault, SceneError};
use super::load::LoadedScene;
use super::schema::{ObstacleMotion, ObstacleShape, Shape};
use super::sequence::files_of;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Where a text is.
enum Place<'a> {
    /// It came with the scene.
    Carried(&'a str),
    BuiltIn(&'static str),
    Disk(PathBuf),
}

/// Where the mesh of a path in the scene is.
fn place<'a>(loaded: &'a LoadedScene, path: &str) -> Place<'a> {
    if let Some(text) = loaded.meshes.get(path) {
        return Place::Carried(text);
    }
    let file = folder(loaded).join(path);
    // A built-in scene means its own mesh, whatever lies in the working folder.
    match builtin_mesh(path) {
        Some(text) if loaded.path.is_none() || !file.exists() => Place::BuiltIn(text),
        _ => Place::Disk(file),
    }
}

/// The folder to which a scene's paths are relative.
pub(super) fn folder(loaded: &LoadedScene) -> &Path {
    let folder = loaded.path.as_deref().and_then(Path::parent);
    folder.unwrap_or(Path::new(""))
}

/// The OBJ text at a path of the scene, and what messages call it.
pub(super) fn text_of(loaded: &LoadedScene, path: &str) -> Result<(String, String), String> {
    match place(loaded, path) {
        Place::Carried(text) => Ok((text.to_owned(), path.to_owned())),
        Place::BuiltIn(text) => Ok((text.to_owned(), path.to_owned())),
        Place::Disk(file) => {
            let name = file.display().to_string();
            match std::fs::read_to_string(&file) {
                Ok(text) => Ok((text, name)),
                Err(fault) => Err(format!(
                    "{name} can't be read: {fault}; paths are relative to the scene's file"
                )),
            }
        }
    }
}

/// The texts of all OBJ meshes that a scene names, by their paths in it, but for built-in ones: with them it can be
/// built anywhere.
///
/// # Errors
///
/// A file or folder that can't be read.
pub fn mesh_texts(loaded: &LoadedScene) -> Result<BTreeMap<String, String>, SceneError> {
    let error = |cause: String| loaded.error(&Fault::new("", cause));
    let mut paths: Vec<String> = Vec::new();
    for cloth in &loaded.scene.cloth {
        if let Shape::Obj(shape) = &cloth.shape {
            paths.push(shape.path.clone());
        }
    }
    for obstacle in &loaded.scene.obstacle {
        if let ObstacleShape::Obj(shape) = &obstacle.shape {
            paths.push(shape.path.clone());
        }
        if let Some(ObstacleMotion::Sequence(sequence)) = &obstacle.motion {
            let files = files_of(loaded, &sequence.dir).map_err(error)?;
            paths.extend(files.iter().map(|file| format!("{}/{file}", sequence.dir)));
        }
    }
    let mut texts = BTreeMap::new();
    for path in paths {
        if !matches!(place(loaded, &path), Place::BuiltIn(_)) {
            let (text, _) = text_of(loaded, &path).map_err(error)?;
            texts.insert(path, text);
        }
    }
    Ok(texts)
}
