//! Geometry without physics: triangle meshes, the shapes of cloth, distances to bodies.

mod aabb;
mod block;
mod bvh;
mod chain;
mod closest_point;
mod cloth;
mod distance;
mod distance_grid;
mod hinge;
mod implicit;
mod lattice;
mod mannequin;
mod obj;
mod opening;
mod orientation;
mod sheet;
mod topology;
mod tri_mesh;

pub use aabb::Aabb;
pub use block::block;
pub use bvh::Bvh;
pub use chain::chain;
pub use closest_point::{OnTriangle, closest_point};
pub use cloth::cloth;
pub use distance::{Nearest, Surface};
pub use distance_grid::{BadGrid, DistanceGrid, GridError, GridNearest};
pub use hinge::hinges;
pub use lattice::{EdgeName, Lattice, Segment};
pub use mannequin::mannequin;
pub use obj::{ObjError, Repairs, orient_outward, read_obj, write_obj};
pub use opening::{Opening, OpeningTooLarge};
pub use orientation::{OneSided, orient_consistently};
pub use sheet::{Diagonals, Sheet};
pub use topology::{NonManifoldEdge, OpenEdge, edge_uses, non_manifold_edge, open_edge};
pub use tri_mesh::{TriMesh, triangle_area};
