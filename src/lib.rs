//! wip
pub mod cli;
pub mod collision;
pub mod energy;
pub mod export;
pub mod force;
pub mod frame;
pub mod integrator;
pub mod linear;
pub mod mesh;
pub mod model;
pub mod pipeline;
pub mod recorder;
pub mod scene;
pub mod simulation;
pub mod state;
pub mod strain_limit;
