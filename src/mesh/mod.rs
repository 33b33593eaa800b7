//! Geometry without physics: triangle meshes, the shapes of cloth, distances to bodies.

mod block;
mod chain;
mod cloth;
mod distance;
mod hinge;
mod implicit;
mod lattice;
pub(crate) mod mannequin;
mod obj;
mod opening;
mod orientation;
mod poncho;
mod sheet;
mod topology;
mod tri_mesh;

pub use block::block;
pub use chain::chain;
pub use cloth::cloth;
pub use distance::{Nearest, Surface};
pub use hinge::hinges;
pub use lattice::{EdgeName, Lattice, Segment};
pub use mannequin::mannequin;
pub use obj::{ObjError, Repairs, orient_outward, read_obj, write_obj};
pub use opening::{Opening, OpeningTooLarge};
pub use orientation::{OneSided, orient_consistently};
pub use poncho::poncho;
pub use sheet::{Diagonals, Sheet};
pub use topology::{NonManifoldEdge, OpenEdge, edge_uses, non_manifold_edge, open_edge};
pub use tri_mesh::{TriMesh, triangle_area};
