//! Geometry without physics: triangle meshes, the shapes of cloth, distances to bodies.

mod block;
mod chain;
mod distance;
mod implicit;
mod lattice;
mod mannequin;
mod obj;
mod opening;
mod sheet;
mod topology;
mod tri_mesh;

pub use block::block;
pub use chain::chain;
pub use distance::{Nearest, Surface};
pub use lattice::{EdgeName, Lattice, Segment};
pub use mannequin::mannequin;
pub use obj::{ObjError, Repairs, orient_outward, read_obj, write_obj};
pub use opening::{Opening, OpeningTooLarge};
pub use sheet::{Diagonals, Sheet};
pub use topology::{OpenEdge, edge_uses, open_edge};
pub use tri_mesh::{TriMesh, triangle_area};
