//! Reading the obstacles of a scene.

use super::fault::{Fault, SceneError};
use super::hold::rigid;
use super::load::LoadedScene;
use super::place::place;
use super::read_mesh::ReadMesh;
use super::schema::{self, DistanceName, ObjShape, ObstacleMotion, ObstacleShape};
use super::sequence::read_sequence;
use super::walk::PlacedWalk;
use crate::collision::{BodyMotion, Obstacle, Solid};
use crate::mesh::{self, DistanceGrid, Surface, TriMesh};
use glam::DVec3;
use std::sync::Arc;

/// Reads, repairs and places an obstacle; what was repaired is added to `notes`.
pub(super) fn read_obstacle(
    loaded: &LoadedScene,
    i: usize,
    obstacle: &schema::Obstacle,
    notes: &mut Vec<String>,
) -> Result<Obstacle, SceneError> {
    let placed = |x: [f64; 3]| {
        let mut points = [DVec3::from_array(x)];
        place(&mut points, obstacle.rotate, obstacle.translate);
        points[0]
    };
    let shape = match &obstacle.shape {
        ObstacleShape::Obj(shape) => {
            let (mesh, surface) = read_body(loaded, i, obstacle, shape, notes)?;
            let grid = grid(obstacle, &surface).map_err(|cause| {
                loaded.error(&Fault::new(format!("obstacle.{i}.distance"), cause))
            })?;
            Solid::Mesh {
                mesh,
                surface,
                grid: grid.map(Box::new),
            }
        }
        ObstacleShape::Plane(plane) => {
            let (origin, tip) = (placed([0.0; 3]), placed(plane.normal));
            Solid::Plane {
                point: placed(plane.point),
                normal: (tip - origin).normalize_or(DVec3::Y),
            }
        }
        ObstacleShape::Sphere(sphere) => Solid::Sphere {
            center: placed(sphere.center),
            radius: sphere.radius,
        },
    };
    let motion = match &obstacle.motion {
        None => None,
        Some(ObstacleMotion::Keyframes(keys)) => {
            Some(BodyMotion::Rigid(rigid(keys), center(&shape)))
        }
        Some(ObstacleMotion::Walk(asked)) => {
            let walk = PlacedWalk::new(obstacle, asked, &shape).map_err(|cause| {
                loaded.error(&Fault::new(format!("obstacle.{i}.motion.walk"), cause))
            })?;
            Some(BodyMotion::Deforming(Arc::new(walk)))
        }
        Some(ObstacleMotion::Sequence(asked)) => {
            let sequence = read_sequence(loaded, i, obstacle, asked, &shape)?;
            Some(BodyMotion::Deforming(Arc::new(sequence)))
        }
    };
    let schema::Obstacle {
        name,
        friction,
        thickness,
        ccd,
        ..
    } = obstacle.clone();
    Ok(Obstacle {
        name,
        shape,
        motion,
        friction,
        thickness,
        continuous: ccd,
    })
}

/// The distance grid that is asked for, wide enough for particles that are as close as contact is noticed.
fn grid(obstacle: &schema::Obstacle, surface: &Surface) -> Result<Option<DistanceGrid>, String> {
    let DistanceName::Grid(cell) = obstacle.distance else {
        return Ok(None);
    };
    let band = (2.0 * cell).max(3.0 * obstacle.thickness);
    let grid = DistanceGrid::new(surface, cell, band).map_err(|wrong| wrong.to_string())?;
    Ok(Some(grid))
}

/// A closed mesh, turned outward and placed.
fn read_body(
    loaded: &LoadedScene,
    i: usize,
    obstacle: &schema::Obstacle,
    shape: &ObjShape,
    notes: &mut Vec<String>,
) -> Result<(TriMesh, Surface), SceneError> {
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
    if let Some(wrong) = mesh::misscaled(&read.mesh) {
        notes.push(format!("obstacle {}: {wrong}", obstacle.name));
    }
    let surface =
        Surface::new(&read.mesh).ok_or_else(|| read.error("holds no triangles".to_owned()))?;
    Ok((read.mesh, surface))
}

/// What an obstacle turns about: the middle of the box around it, or a plane's point (m).
fn center(shape: &Solid) -> DVec3 {
    match shape {
        Solid::Mesh { mesh, .. } => mesh.bounds().map_or(DVec3::ZERO, |(a, b)| 0.5 * (a + b)),
        Solid::Plane { point, .. } => *point,
        Solid::Sphere { center, .. } => *center,
    }
}
