//! Scenes: what a user asks for, and how it becomes a model.
//!
//! A scene is TOML in SI units, y up, right-handed. [`load()`] reads and checks one, [`build()`] makes
//! the [`Model`](crate::model::Model) and the first [`State`](crate::state::State) from it.

mod bends;
mod body;
mod build;
mod builtin;
mod doctor;
mod fault;
mod hold;
mod load;
mod material_file;
mod parts;
mod place;
mod read_mesh;
mod rigidity;
mod room;
mod schema;
mod select;
mod sequence;
mod spring_constant;
mod step;
mod stiffness;
mod texts;
mod validate;
mod walk;

pub use build::{Built, build};
pub use builtin::{BUILTIN, builtin_mesh, builtin_scene};
pub use doctor::model_list;
pub use fault::SceneError;
pub use load::{LoadedScene, load, load_text};
pub use material_file::load_material;
pub use schema::{
    BendingName, BlockShape, ChainShape, Cloth, Damping, IntegratorName, Keyframe,
    LinearSolverName, Material, ObjShape, Obstacle, ObstacleShape, Pin, PinMotion, Record, Scene,
    Select, Shape, SheetShape, Solver, SpringDetailName, SpringKind, Start, StrainLimit,
};
pub use step::Step;
pub use texts::mesh_texts;
