//! Reading the obstacles of a scene.

use super::fault::SceneError;
use super::load::LoadedScene;
use super::place::place;
use super::read_mesh::ReadMesh;
use super::schema::{self, ObstacleShape};
use crate::collision::Obstacle;
use crate::mesh::{self, Surface};

/// Reads, repairs and places an obstacle; what was repaired is added to `notes`.
pub(super) fn read_obstacle(
    loaded: &LoadedScene,
    i: usize,
    obstacle: &schema::Obstacle,
    notes: &mut Vec<String>,
) -> Result<Obstacle, SceneError> {
    let ObstacleShape::Obj(shape) = &obstacle.shape;
    let mut read = ReadMesh::new(loaded, &format!("obstacle.{i}.shape"), shape)?;
    if let Some(edge) = mesh::open_edge(&read.mesh) {
        return Err(read.error(format!(
            "the mesh isn't closed: {edge}; fill its holes, inside and outside can't be told otherwise"
        )));
    }
    read.repairs.turned = mesh::orient_outward(&mut read.mesh);
    place(
        &mut read.mesh.positions,
        obstacle.rotate,
        obstacle.translate,
    );
    notes.extend(read.note());
    let surface =
        Surface::new(&read.mesh).ok_or_else(|| read.error("holds no triangles".to_owned()))?;
    let schema::Obstacle {
        name,
        friction,
        thickness,
        ..
    } = obstacle.clone();
    Ok(Obstacle {
        name,
        mesh: read.mesh,
        surface,
        friction,
        thickness,
    })
}
