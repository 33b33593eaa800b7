//! What is recorded: owned `f32` snapshots that refer to nothing, so that they can cross threads.
//!
//! A [`Header`] says once what stays the same during a run; a [`Frame`] says what moved.
//! From here on everything is `f32`, except for times, energies and the checkpoint. [`Capture`] takes
//! frames from a simulation.

mod audited;
mod capture;
mod facts;
mod series;

pub use audited::Audited;
pub use capture::Capture;
pub use facts::Facts;
pub use series::mean_strain;

use crate::state::State;
use glam::DVec3;

/// What stays the same in every frame of a run; recorded once, before the first frame.
#[derive(Clone, Debug, Default)]
pub struct Header {
    /// The scene's name.
    pub scene: String,
    /// The scene's TOML, as it was run (with the changes made by the command line).
    pub scene_toml: String,
    /// Path in the scene and text of each OBJ mesh that it names, but for built-in ones.
    pub meshes: Vec<(String, String)>,
    /// Of which recording this is a branch, and how; nothing otherwise.
    pub branch: String,
    /// What a branch started with.
    pub start: Option<Checkpoint>,
    /// What is modelled, as Markdown.
    pub model_list: String,
    /// What the recording says about itself.
    pub facts: Facts,
    /// Strain at the ends of the colour map (m/m).
    pub strain_range: f32,
    /// Two corners of the box that is looked at when the recording is opened (m), if the scene says.
    pub view: Option<[[f32; 3]; 2]>,
    /// Whether meshes are recorded without normals.
    pub flat: bool,
    /// Which springs are recorded.
    pub spring_detail: SpringDetail,
    /// The cloths, in the order of [`Frame::cloths`].
    pub cloths: Vec<ClothHeader>,
    /// The obstacles where they start.
    pub obstacles: Vec<ObstacleHeader>,
    /// The time series, in the order of [`Frame::values`].
    pub series: Vec<Series>,
}

/// A time series.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Series {
    /// Entity path without the leading slash, such as `energy/kinetic`.
    pub path: String,
    /// What the plot calls it, with its unit, such as `kinetic (J)`.
    pub label: String,
}

/// Which springs are recorded as lines.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SpringDetail {
    /// None.
    Off,
    /// Every spring.
    All,
    /// Every spring below a few thousand, the most strained beyond.
    #[default]
    Auto,
}

/// The fixed part of a cloth.
#[derive(Clone, Debug, Default)]
pub struct ClothHeader {
    /// The cloth's name, unique in the scene.
    pub name: String,
    /// Number of particles.
    pub particles: usize,
    /// Vertex indices of one triangle an entry, counter-clockwise; empty for a chain.
    pub triangles: Vec<[u32; 3]>,
    /// The springs by family.
    pub springs: Vec<SpringFamily>,
    /// Pinned particles, until some are released.
    pub pins: Vec<u32>,
}

/// One family of springs of a cloth.
#[derive(Clone, Debug, Default)]
pub struct SpringFamily {
    /// `structural`, `shear` or `bend`.
    pub name: &'static str,
    /// Particle indices of one spring an entry.
    pub pairs: Vec<[u32; 2]>,
}

/// The mesh of an obstacle.
#[derive(Clone, Debug, Default)]
pub struct ObstacleHeader {
    /// The obstacle's name, unique in the scene.
    pub name: String,
    /// Whether it moves: then every frame has its positions.
    pub moves: bool,
    /// Vertex positions at the start (m).
    pub positions: Vec<[f32; 3]>,
    /// Vertex indices of one triangle an entry, counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
}

/// The state of a run at one time.
#[derive(Clone, Debug, Default)]
pub struct Frame {
    /// Number of this frame, from 0.
    pub index: u64,
    /// Steps done so far.
    pub step: u64,
    /// Simulated time (s).
    pub time: f64,
    /// One entry a cloth.
    pub cloths: Vec<ClothFrame>,
    /// Particles that touch an obstacle.
    pub contacts: Vec<ContactMark>,
    /// Vertex positions (m) of each obstacle that moves.
    pub obstacles: Vec<Option<Vec<[f32; 3]>>>,
    /// Where cloth is inside an obstacle or crosses something (m).
    pub penetrations: Vec<[f32; 3]>,
    /// Energies, strains, contact and solver figures: one value a series of [`Header::series`].
    pub values: Vec<f64>,
    /// Springs by strain.
    pub histogram: Histogram,
    /// What there is to say at this time.
    pub events: Vec<Event>,
    /// Tells states apart that differ in any bit: see [`State::hash`](crate::state::State::hash).
    pub hash: u64,
    /// The whole `f64` state, every so many frames and in the last one.
    pub checkpoint: Option<Checkpoint>,
}

/// The moving part of a cloth.
#[derive(Clone, Debug, Default)]
pub struct ClothFrame {
    /// Particle positions (m).
    pub positions: Vec<[f32; 3]>,
    /// Strain at each particle: the mean over its structural and shear springs (m/m).
    pub strain: Vec<f32>,
    /// Strain of each spring by family, in the order of [`ClothHeader::springs`] (m/m).
    pub spring_strain: Vec<Vec<f32>>,
    /// Particles that are still pinned, once pins have been released; `None` while they are the
    /// header's.
    pub pins: Option<Vec<u32>>,
}

impl ClothFrame {
    /// Where the pinned particles are (m).
    pub fn pin_positions<'a>(
        &'a self,
        header: &'a ClothHeader,
    ) -> impl Iterator<Item = [f32; 3]> + 'a {
        let pins = self.pins.as_ref().unwrap_or(&header.pins);
        let position = |&pin: &u32| self.positions.get(pin as usize).copied();
        pins.iter().filter_map(position)
    }
}

/// A particle in contact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactMark {
    /// Its position (m).
    pub position: [f32; 3],
    /// How far it is below the obstacle's surface (m); 0 when it is outside.
    pub depth: f32,
}

/// Number of springs by strain, in classes of equal width.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Histogram {
    /// Strain in the middle of the first class (m/m).
    pub first: f32,
    /// Width of a class (m/m).
    pub width: f32,
    /// Springs in each class; those beyond the ends are counted in the outermost.
    pub counts: Vec<u32>,
}

/// Something to say in the recording's log.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Event {
    /// How serious it is.
    pub level: Level,
    /// The text.
    pub text: String,
}

/// How serious an [`Event`] is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Level {
    /// Good to know.
    Info,
    /// Worth a look.
    Warning,
    /// The run can't go on.
    Error,
}

/// The `f64` state from which a run can go on.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Checkpoint {
    /// Steps done so far.
    pub step: u64,
    /// Simulated time (s).
    pub time: f64,
    /// One entry a cloth.
    pub cloths: Vec<ClothCheckpoint>,
    /// What the simulation and the capture carry over besides: see [`Capture::checkpoint_frame`].
    pub luggage: Vec<u8>,
}

impl Checkpoint {
    /// The state of all cloths' particles.
    pub fn state(&self) -> State {
        let particles = self.cloths.iter().flat_map(|cloth| &cloth.particles);
        let half = |from: usize| {
            let of = move |p: &[f64; 6]| DVec3::new(p[from], p[from + 1], p[from + 2]);
            particles.clone().map(of).collect()
        };
        State {
            time: self.time,
            positions: half(0),
            velocities: half(3),
        }
    }
}

/// The `f64` state of one cloth.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ClothCheckpoint {
    /// The cloth's name.
    pub name: String,
    /// x, y, z (m) and vx, vy, vz (m/s) of one particle an entry.
    pub particles: Vec<[f64; 6]>,
}
