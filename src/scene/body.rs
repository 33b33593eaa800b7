//! Reading the obstacles of a scene.

use super::builtin_mesh;
use super::fault::{Fault, SceneError};
use super::load::LoadedScene;
use super::place::place;
use super::schema::{self, ObjShape, ObstacleShape};
use crate::collision::Obstacle;
use crate::mesh::{self, Surface};
use std::path::Path;

/// Reads, repairs and places an obstacle; what was repaired is added to `notes`.
pub(super) fn read_obstacle(
    loaded: &LoadedScene,
    i: usize,
    obstacle: &schema::Obstacle,
    notes: &mut Vec<String>,
) -> Result<Obstacle, SceneError> {
    let ObstacleShape::Obj(ObjShape { path, scale }) = &obstacle.shape;
    let (text, file) = read_mesh(loaded, path).map_err(|cause| {
        loaded.error(&Fault::new(format!("obstacle.{i}.shape.obj.path"), cause))
    })?;
    let error = |cause: String| SceneError {
        file: file.clone(),
        line: None,
        cause,
    };
    let (mut mesh, mut repairs) = mesh::read_obj(&text, *scale).map_err(|fault| match fault {
        mesh::ObjError::Line { line, cause } => SceneError {
            file: file.clone(),
            line: Some(line),
            cause,
        },
        other => error(other.to_string()),
    })?;
    if let Some(edge) = mesh::open_edge(&mesh) {
        return Err(error(format!(
            "the mesh isn't closed: {edge}; fill its holes, inside and outside can't be told otherwise"
        )));
    }
    repairs.turned = mesh::orient_outward(&mut mesh);
    place(&mut mesh.positions, obstacle.rotate, obstacle.translate);
    notes.extend(repair_notes(&file, repairs));
    let surface = Surface::new(&mesh).ok_or_else(|| error("holds no triangles".to_owned()))?;
    let schema::Obstacle {
        name,
        friction,
        thickness,
        ..
    } = obstacle.clone();
    Ok(Obstacle {
        name,
        mesh,
        surface,
        friction,
        thickness,
    })
}

/// The OBJ text at a path relative to the scene, or built in; and what messages call it.
fn read_mesh(loaded: &LoadedScene, path: &str) -> Result<(String, String), String> {
    let folder = loaded.path.as_deref().and_then(Path::parent);
    let file = folder.unwrap_or(Path::new("")).join(path);
    let name = file.display().to_string();
    // A built-in scene means its own mesh, whatever lies in the working folder.
    if (loaded.path.is_none() || !file.exists())
        && let Some(text) = builtin_mesh(path)
    {
        return Ok((text.to_owned(), path.to_owned()));
    }
    std::fs::read_to_string(&file)
        .map(|text| (text, name.clone()))
        .map_err(|fault| {
            format!("{name} can't be read: {fault}; paths are relative to the scene's file")
        })
}

fn repair_notes(file: &str, repairs: mesh::Repairs) -> Option<String> {
    let mesh::Repairs {
        merged_vertices,
        degenerate_triangles,
        duplicate_triangles,
        turned,
    } = repairs;
    let mut done = Vec::new();
    for (count, what) in [
        (merged_vertices, "repeated vertices merged"),
        (degenerate_triangles, "triangles without area dropped"),
        (duplicate_triangles, "repeated triangles dropped"),
    ] {
        if count > 0 {
            done.push(format!("{count} {what}"));
        }
    }
    if turned {
        done.push("was inside out and was turned".to_owned());
    }
    (!done.is_empty()).then(|| format!("{file}: {}", done.join(", ")))
}
