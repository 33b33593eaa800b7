//! **muslin** simulates cloth and other mass–spring structures, drapes them over triangle meshes and
//! streams what happens to the Rerun viewer.
//!
//! # The map
//!
//! Data flows one way through the rooms, and a room names only those before it:
//!
//! ```text
//! mesh → linear → state → motion → force → strain_limit → collision → model → energy → scene → integrator → simulation → frame → recorder → pipeline → replay → export → picture → lab → study → cli
//! ```
//!
//! - [`mesh`]: triangle meshes, the shapes of cloth, distances to bodies; no physics.
//! - [`linear`]: the matrix of the implicit schemes and its solvers.
//! - [`state`]: what moves. [`motion`]: what is moved. [`model`]: what doesn't. [`energy`]: what both have, and the ledger.
//! - [`force`], [`strain_limit`], [`collision`]: the laws.
//! - [`scene`]: from TOML to a model and a first state.
//! - [`integrator`]: the schemes. [`simulation`]: one step as named stages.
//! - [`frame`]: owned snapshots. [`recorder`]: where they go. [`pipeline`]: the two threads.
//! - [`replay`]: recordings read back. [`export`]: in other formats. [`picture`]: diagrams. [`lab`]: virtual swatch tests of cloths as they
//!   are discretised. [`study`]: what accuracy costs in time.
//! - [`cli`]: the program.
//!
//! # A tour
//!
//! A scene is read, with changes, and checked:
//!
//! ```
//! let changes = ["cloth.0.shape.sheet.cells=[20, 20]".to_owned()];
//! let loaded = muslin::scene::load("hanging-cloth", &changes)?;
//! let built = muslin::scene::build(&loaded)?;
//! assert_eq!(built.model.particles(), 21 * 21);
//! # Ok::<(), muslin::scene::SceneError>(())
//! ```
//!
//! How long may a step be for an explicit scheme?
//!
//! ```
//! # let loaded = muslin::scene::load("hanging-cloth", &[])?;
//! # let built = muslin::scene::build(&loaded)?;
//! let forecast = muslin::simulation::forecast(&built.model, &built.state);
//! let stable = forecast.stable_dt(muslin::integrator::Integrator::SymplecticEuler);
//! assert!(stable > 1e-4 && stable < 2e-3);
//! # Ok::<(), muslin::scene::SceneError>(())
//! ```
//!
//! An implicit scheme may take longer ones; energy is accounted for on the way:
//!
//! ```
//! use muslin::{energy::SCHEME, integrator::{Integrator, Linear}, simulation::Simulation};
//! # let loaded = muslin::scene::load("hanging-cloth", &[])?;
//! # let built = muslin::scene::build(&loaded)?;
//! let scheme = Integrator::ImplicitEuler(Linear::to(1e-4));
//! let mut simulation = Simulation::new(built.model, built.state, scheme, 0.001);
//! for _ in 0..100 {
//!     simulation.step()?;
//! }
//! let balance = simulation.balance();
//! let by_itself = balance.dissipated_by(SCHEME); // what the step's length costs
//! assert!(by_itself > 0.0 && by_itself < 0.1 * balance.energies.kinetic, "{by_itself} J");
//! assert!(balance.unexplained() < 1e-9);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Frames are taken from it and recorded; here in memory:
//!
//! ```
//! use muslin::recorder::{MemoryRecorder, Recorder};
//! # use muslin::{integrator::Integrator, simulation::Simulation};
//! # let loaded = muslin::scene::load("hanging-cloth", &[])?;
//! # let built = muslin::scene::build(&loaded)?;
//! # let simulation = Simulation::new(built.model, built.state, Integrator::SymplecticEuler, 1e-4);
//! let (mut capture, header) = muslin::frame::Capture::new(&loaded, &simulation);
//! let mut recorder = MemoryRecorder::new(header);
//! recorder.record(&capture.frame(&simulation, Vec::new(), true))?;
//! assert_eq!(recorder.finish()?.frames, 1);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod cli;
pub mod collision;
pub mod energy;
pub mod export;
pub mod force;
pub mod frame;
pub mod integrator;
pub mod lab;
pub mod linear;
pub mod mesh;
pub mod model;
pub mod motion;
pub mod picture;
pub mod pipeline;
pub mod recorder;
#[cfg(feature = "rerun")]
pub mod replay;
pub mod scene;
pub mod simulation;
pub mod state;
pub mod strain_limit;
pub mod study;
