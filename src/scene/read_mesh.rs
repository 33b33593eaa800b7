//! Reading the OBJ meshes that a scene names.

use super::fault::{Fault, SceneError};
use super::load::LoadedScene;
use super::schema::ObjShape;
use super::texts::text_of;
use crate::mesh::{self, Repairs, TriMesh};

/// A mesh that was read, and what messages call its file.
pub(super) struct ReadMesh {
    pub(super) mesh: TriMesh,
    pub(super) repairs: Repairs,
    file: String,
}

impl ReadMesh {
    /// Reads and repairs the mesh of a shape; `key` is the shape's place in the scene.
    pub(super) fn new(
        loaded: &LoadedScene,
        key: &str,
        shape: &ObjShape,
    ) -> Result<Self, SceneError> {
        let (text, file) = text_of(loaded, &shape.path)
            .map_err(|cause| loaded.error(&Fault::new(format!("{key}.obj.path"), cause)))?;
        match mesh::read_obj(&text, shape.scale) {
            Ok((mesh, repairs)) => Ok(Self {
                mesh,
                repairs,
                file,
            }),
            Err(mesh::ObjError::Line { line, cause }) => Err(SceneError {
                file,
                line: Some(line),
                cause,
            }),
            Err(other) => Err(SceneError {
                file,
                line: None,
                cause: other.to_string(),
            }),
        }
    }

    /// A fault of the mesh.
    pub(super) fn error(&self, cause: String) -> SceneError {
        SceneError {
            file: self.file.clone(),
            line: None,
            cause,
        }
    }

    /// What was repaired, if anything.
    pub(super) fn note(&self) -> Option<String> {
        let Repairs {
            merged_vertices,
            degenerate_triangles,
            duplicate_triangles,
            turned,
            turned_triangles,
        } = self.repairs;
        let mut done = Vec::new();
        for (count, what) in [
            (merged_vertices, "repeated vertices merged"),
            (degenerate_triangles, "triangles without area dropped"),
            (duplicate_triangles, "repeated triangles dropped"),
            (
                turned_triangles,
                "triangles turned that faced the other way than their neighbours",
            ),
        ] {
            if count > 0 {
                done.push(format!("{count} {what}"));
            }
        }
        if turned {
            done.push("was inside out and was turned".to_owned());
        }
        (!done.is_empty()).then(|| format!("{}: {}", self.file, done.join(", ")))
    }
}
