//! wip
pub mod mesh;
pub mod linear;
pub mod state;
pub mod force;
pub mod strain_limit;
pub mod collision;
pub mod model;
pub mod scene;
pub mod integrator;
pub mod energy;
pub mod simulation;
pub mod frame;
