//! What cloth collides with.

use crate::mesh::{Surface, TriMesh};

/// A body at rest.
#[derive(Clone, Debug)]
pub struct Obstacle {
    /// Its name in the scene.
    pub name: String,
    /// Its closed mesh, placed in the world (m).
    pub mesh: TriMesh,
    /// Distances to it.
    pub surface: Surface,
    /// Coulomb's friction coefficient μ.
    pub friction: f64,
    /// Distance that cloth keeps from it (m).
    pub thickness: f64,
}
