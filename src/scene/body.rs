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
            let grid = grid(obstacle, &surface, notes).map_err(|cause| {
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
fn grid(
    obstacle: &schema::Obstacle,
    surface: &Surface,
    notes: &mut Vec<String>,
) -> Result<Option<DistanceGrid>, String> {
    let DistanceName::Grid(cell) = obstacle.distance else {
        return Ok(None);
    };
    let band = (2.0 * cell).max(3.0 * obstacle.thickness);
    let grid = DistanceGrid::new(surface, cell, band).map_err(|wrong| wrong.to_string())?;
    notes.extend(too_coarse(obstacle, &grid));
    Ok(Some(grid))
}

/// Share of the thickness by which a grid may be off without a note: half of it is left then.
const GRID_SHARE: f64 = 0.5;

/// What to say of a grid that is off by much of the distance that cloth keeps.
fn too_coarse(obstacle: &schema::Obstacle, grid: &DistanceGrid) -> Option<String> {
    let (error, thickness) = (grid.error().largest, obstacle.thickness);
    (error > GRID_SHARE * thickness).then(|| {
        format!(
            "obstacle {}: the distances of its grid are off by up to {:.2} mm, more than half of its thickness of {} mm; use a finer grid or distance = \"exact\"",
            obstacle.name,
            1000.0 * error,
            1000.0 * thickness
        )
    })
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

#[cfg(test)]
mod tests {
    use crate::scene::{build, load};

    /// Distances around a box of sharp edges are off by a share of the cell, from a brick with an edge in
    /// it on; what may be left of 3 mm is half of it.
    #[test]
    fn a_grid_that_is_off_by_half_the_thickness_is_noted() {
        let notes = |changes: &[&str]| {
            let mut all = vec!["cloth.0.shape.sheet.cells=[2, 2]".to_owned()];
            all.extend(changes.iter().map(|&change| change.to_owned()));
            let built = build(&load("table-cloth", &all).unwrap()).unwrap();
            let error = built.model.obstacles[0].shape.grid_error();
            (error.map(|error| error.largest), built.notes)
        };
        assert_eq!(notes(&[]), (None, Vec::new()));
        let grid = "obstacle.table.distance={ grid = 0.02 }";
        let (error, noted) = notes(&[grid]);
        let error = error.unwrap();
        assert!(error > 0.0015, "{error}");
        assert_eq!(noted.len(), 1, "{noted:?}");
        for words in [
            "obstacle table",
            "finer grid",
            &format!("{:.2} mm", 1000.0 * error),
        ] {
            assert!(noted[0].contains(words), "{words}: {}", noted[0]);
        }
        // The very same grid beside a thickness just above and just below twice its error.
        for (share, noted) in [(2.01, false), (1.99, true)] {
            let thickness = format!("obstacle.table.thickness={:?}", share * error);
            let (_, notes) = notes(&[grid, &thickness]);
            assert_eq!(notes.len(), usize::from(noted), "{share}: {notes:?}");
        }
    }
}
