//! What cloth collides with.

use crate::mesh::{self, DistanceGrid, GridError, Nearest, Surface, TriMesh};
use crate::motion::{Deformation, Motion};
use glam::DVec3;
use std::sync::Arc;

/// A body whose motion is prescribed.
#[derive(Clone, Debug)]
pub struct Obstacle {
    /// Its name in the scene.
    pub name: String,
    /// Its shape where it starts.
    pub shape: Solid,
    /// How it moves; it rests otherwise.
    pub motion: Option<BodyMotion>,
    /// Coulomb's friction coefficient μ.
    pub friction: f64,
    /// Distance that cloth keeps from it (m).
    pub thickness: f64,
    /// Whether whole triangles and edges of cloth are followed along their ways, and not particles alone.
    pub continuous: bool,
}

/// How cloth collides with itself and with other cloth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SelfCollision {
    /// Distance that layers keep (m).
    pub thickness: f64,
    /// Coulomb's friction coefficient μ between them.
    pub friction: f64,
}

/// The shape of an obstacle.
#[derive(Clone, Debug)]
pub enum Solid {
    /// The inside of a closed mesh, placed in the world (m).
    Mesh {
        /// The mesh.
        mesh: TriMesh,
        /// Distances to it.
        surface: Surface,
        /// Distances to it on a grid, where those are asked for: particles then go by them.
        grid: Option<Box<DistanceGrid>>,
    },
    /// Everything below a plane.
    Plane {
        /// A point of it (m).
        point: DVec3,
        /// Its unit normal, pointing out.
        normal: DVec3,
    },
    /// A ball.
    Sphere {
        /// Its centre (m).
        center: DVec3,
        /// Its radius (m).
        radius: f64,
    },
}

/// How an obstacle moves.
#[derive(Clone, Debug)]
pub enum BodyMotion {
    /// As one piece, turning about a centre (m), where it starts.
    Rigid(Motion, DVec3),
    /// A mesh whose vertices go their own ways.
    Deforming(Arc<dyn Deformation>),
}

/// Half of the side of the square that is drawn for a plane (m).
const DRAWN: f64 = 2.0;

impl Solid {
    /// The nearest point of the surface within `reach` (m) of `p`, the shape being where it starts; `None`
    /// when there is none.
    pub fn nearest(&self, p: DVec3, reach: f64) -> Option<Nearest> {
        let (point, normal) = match self {
            Self::Mesh {
                grid: Some(grid), ..
            } => {
                let found = grid.nearest(p, reach)?;
                let point = p - found.normal * found.distance;
                return Some(Nearest::new(point, found.normal, found.distance));
            }
            Self::Mesh { surface, .. } => return surface.nearest(p, reach),
            Self::Plane { point, normal } => (p - *normal * normal.dot(p - *point), *normal),
            Self::Sphere { center, radius } => {
                let out = (p - *center).try_normalize().unwrap_or(DVec3::Y);
                (*center + out * *radius, out)
            }
        };
        let nearest = Nearest::new(point, normal, normal.dot(p - point));
        (nearest.distance.abs() <= reach).then_some(nearest)
    }

    /// What is drawn of it.
    pub fn drawing(&self) -> TriMesh {
        match self {
            Self::Mesh { mesh, .. } => mesh.clone(),
            Self::Plane { point, normal } => mesh::square(*point, *normal, DRAWN),
            Self::Sphere { center, radius } => mesh::ball(*center, *radius),
        }
    }

    /// How far the distances of its grid are off, if it has one.
    pub fn grid_error(&self) -> Option<GridError> {
        match self {
            Self::Mesh { grid, .. } => grid.as_ref().map(|grid| grid.error()),
            Self::Plane { .. } | Self::Sphere { .. } => None,
        }
    }

    /// Its triangles, if it has any.
    pub fn triangles(&self) -> usize {
        match self {
            Self::Mesh { mesh, .. } => mesh.triangles.len(),
            Self::Plane { .. } | Self::Sphere { .. } => 0,
        }
    }
}
