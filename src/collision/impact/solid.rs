//! What the impact stage is told of obstacles and of layers of cloth.

use glam::DVec3;

/// An obstacle whose surface cloth must not pass through.
#[derive(Clone, Debug)]
pub struct Solid {
    /// Its form.
    pub shape: Shape,
    /// Coulomb's friction coefficient μ.
    pub friction: f64,
    /// Distance that is always kept from the surface (m): a small share of the thickness at which
    /// particles rest, so that only what those don't hold comes so close.
    pub floor: f64,
}

/// Forms of obstacles.
#[derive(Clone, Debug)]
pub enum Shape {
    /// A triangle mesh of so many vertices.
    Mesh {
        /// Number of vertices.
        vertices: usize,
        /// Vertices of each triangle.
        triangles: Vec<[u32; 3]>,
    },
    /// A ball; its one vertex is the centre.
    Sphere {
        /// Radius (m).
        radius: f64,
    },
    /// All below a plane; its one vertex is a point of it.
    Plane {
        /// Unit normal, pointing out of the obstacle.
        normal: DVec3,
    },
}

impl Shape {
    /// Vertices that are told where they are.
    pub(super) fn vertices(&self) -> usize {
        match self {
            Self::Mesh { vertices, .. } => *vertices,
            Self::Sphere { .. } | Self::Plane { .. } => 1,
        }
    }

    /// Distance of the surface from the shape's own features (m).
    pub(super) fn radius(&self) -> f64 {
        match self {
            Self::Sphere { radius } => *radius,
            Self::Mesh { .. } | Self::Plane { .. } => 0.0,
        }
    }
}

/// Collision of cloth with cloth.
#[derive(Clone, Debug)]
pub struct Layers {
    /// Distance at which layers rest on each other (m).
    pub thickness: f64,
    /// Coulomb's friction coefficient μ between them.
    pub friction: f64,
    /// Positions at rest (m) of all particles, each cloth's in coordinates of its own: what is closer than the
    /// thickness there isn't pushed apart.
    pub rest: Vec<DVec3>,
    /// The cloth of each particle.
    pub cloth: Vec<u32>,
}

/// The smallest distance between layers, as a share of their thickness.
pub(super) const LAYER_FLOOR: f64 = 0.1;
