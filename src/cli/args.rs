//! What can be typed.

use crate::scene::{IntegratorName, Step};
use crate::study::stability::Axis;
#[cfg(feature = "rerun")]
use clap::ArgGroup;
use clap::{Args, Parser, Subcommand};
use std::net::{Ipv4Addr, SocketAddr};
#[cfg(feature = "rerun")]
use std::num::NonZeroU64;
use std::path::PathBuf;

/// The whole command line.
#[derive(Debug, Parser)]
#[command(
    version,
    about = "Cloth and mass-spring simulation that streams to the Rerun viewer and says how wrong it is.",
    args_conflicts_with_subcommands = true,
    subcommand_precedence_over_arg = true
)]
pub(super) struct Cli {
    #[command(subcommand)]
    pub(super) command: Option<Command>,
    #[command(flatten)]
    pub(super) run: RunArgs,
}

#[derive(Debug, Subcommand)]
pub(super) enum Command {
    /// Run a scene and record it (also without the word `run`).
    Run(RunArgs),
    /// List the built-in scenes; with NAME, print its TOML.
    Scenes {
        /// A built-in scene.
        name: Option<String>,
    },
    /// Say what a scene models, its stable step and its cost.
    Check(SceneArgs),
    /// Go on from a checkpoint of a recording, bit for bit as if never stopped, or branch with a change.
    #[cfg(feature = "rerun")]
    Resume(ResumeArgs),
    /// Say how far two recordings are apart, and lay them over each other.
    #[cfg(feature = "rerun")]
    Compare(CompareArgs),
    /// Run the scene of a recording again and compare the states.
    #[cfg(feature = "rerun")]
    Verify(VerifyArgs),
    /// Write a recording in other formats: a table, OBJ or PLY meshes, an animated glTF.
    #[cfg(feature = "rerun")]
    Export(ExportArgs),
    /// Show recordings in a viewer again, at their pace.
    #[cfg(feature = "rerun")]
    Replay(ReplayArgs),
    /// Say what a recording holds: scene, scheme, energies, strain, checkpoints, sizes.
    #[cfg(feature = "rerun")]
    Info(InfoArgs),
    /// Test swatches of a scene's cloths: moduli by direction, and bending against the elastica.
    Lab(LabArgs),
    /// Measure what accuracy costs: every scheme over its steps against a reference.
    Study(StudyArgs),
    /// Write the mannequin's mesh again.
    Mannequin {
        /// The OBJ file to write.
        out: PathBuf,
        /// Write its poncho instead.
        #[arg(long)]
        poncho: bool,
    },
}

/// A scene and changes to it.
#[derive(Args, Debug)]
pub(super) struct SceneArgs {
    /// A built-in scene (see `muslin scenes`) or a TOML file.
    #[arg(default_value = "drape")]
    pub(super) scene: String,
    #[command(flatten)]
    pub(super) changes: ChangeArgs,
}

/// Changes to a scene.
#[derive(Args, Debug)]
pub(super) struct ChangeArgs {
    /// Time integration scheme: euler, symplectic-euler, verlet, rk4, dopri5, implicit-euler, newton,
    /// implicit-midpoint, bdf2, xpbd or projective.
    #[arg(long, value_name = "NAME")]
    integrator: Option<String>,
    /// Time step (s), or auto: by scheme and forecast.
    #[arg(long, value_name = "S|auto", allow_negative_numbers = true)]
    dt: Option<Step>,
    /// Simulated time (s).
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    duration: Option<f64>,
    /// Recorded frames in a simulated second.
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    fps: Option<f64>,
    /// Record meshes with normals; without them they take 16 bytes a particle and frame, not 28, and aren't shaded.
    #[arg(long, value_name = "true|false")]
    record_normals: Option<bool>,
    /// Springs to record: off, all, or auto: all below a few thousand, the most strained beyond.
    #[arg(long, value_name = "WHICH")]
    springs: Option<String>,
    /// Threads of the simulation; all cores by default. The result doesn't depend on it.
    #[arg(long, value_name = "N")]
    pub(super) threads: Option<usize>,
    /// Set a key of the scene, such as cloth.0.material.stretch=500, or with KEY= remove it (repeatable).
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
}

impl ChangeArgs {
    /// Every change to the scene as `key=value`.
    pub(super) fn list(&self) -> Vec<String> {
        let Self {
            integrator,
            dt,
            duration,
            fps,
            record_normals,
            springs,
            set,
            threads: _,
        } = self;
        let mut changes = set.clone();
        changes.extend(
            integrator
                .as_ref()
                .map(|name| format!("solver.integrator={name:?}")),
        );
        changes.extend(dt.map(|dt| match dt {
            Step::Auto => "solver.dt=\"auto\"".to_owned(),
            Step::Seconds(dt) => format!("solver.dt={}", toml_number(dt)),
        }));
        changes.extend(duration.map(|duration| format!("duration={}", toml_number(duration))));
        changes.extend(record_normals.map(|normals| format!("record.normals={normals}")));
        changes.extend(
            springs
                .as_ref()
                .map(|which| format!("record.springs={which:?}")),
        );
        changes.extend(fps.map(|fps| format!("record.fps={}", toml_number(fps))));
        changes
    }
}

/// A port of this machine alone, or an address with a port.
fn address(text: &str) -> Result<SocketAddr, String> {
    let port = text
        .parse()
        .map(|port: u16| (Ipv4Addr::LOCALHOST, port).into());
    port.or_else(|_| text.parse()).map_err(|_fault: std::net::AddrParseError| {
        "write a port, such as 9876, or an address, such as 0.0.0.0:9876 to be seen from other machines".to_owned()
    })
}

/// A number as TOML writes it: `nan`, not Rust's `NaN`.
fn toml_number(x: f64) -> String {
    format!("{x:?}").to_lowercase()
}

/// What to run and where it goes.
#[derive(Args, Debug)]
pub(super) struct RunArgs {
    #[command(flatten)]
    pub(super) scene: SceneArgs,
    /// Pick scheme and step by a calibration of about half a minute: the cheapest whose RMS error stays
    /// below this, such as 1mm; with --integrator, the step only.
    #[arg(long, value_name = "LENGTH", value_parser = super::quantity::length, allow_hyphen_values = true, conflicts_with_all = ["budget", "dt"])]
    pub(super) tolerance: Option<f64>,
    /// The same: the most exact that takes at most this, such as 16ms, of wall time for a simulated 1/60 s.
    #[arg(long, value_name = "TIME", value_parser = super::quantity::time, allow_hyphen_values = true, conflicts_with = "dt")]
    pub(super) budget: Option<f64>,
    #[command(flatten)]
    pub(super) output: OutputArgs,
}

/// Where a run goes.
#[derive(Args, Debug)]
pub(super) struct OutputArgs {
    /// Recording to write; SCENE.rrd by default, or SCENE-2.rrd and so on where that exists.
    #[arg(long, value_name = "FILE.rrd")]
    pub(super) save: Option<PathBuf>,
    /// Replace the recording if it exists: the one that --save names, or SCENE.rrd.
    #[arg(long, conflicts_with = "no_save")]
    pub(super) force: bool,
    /// Write no recording.
    #[arg(long, conflicts_with = "save")]
    pub(super) no_save: bool,
    /// Stream to a viewer that listens at URL.
    #[arg(long, value_name = "URL", num_args = 0..=1, default_missing_value = "rerun+http://127.0.0.1:9876/proxy")]
    pub(super) connect: Option<String>,
    /// Let viewers of this machine fetch the recording at this port; with an address, such as 0.0.0.0:9876, those of
    /// others, too.
    #[arg(long, value_name = "PORT", num_args = 0..=1, default_missing_value = "9876", value_parser = address)]
    pub(super) serve: Option<SocketAddr>,
    /// Start a viewer and stream to it.
    #[arg(long)]
    pub(super) spawn: bool,
    /// Write a machine-readable summary.
    #[arg(long, value_name = "FILE.json")]
    pub(super) report: Option<PathBuf>,
    /// Print nothing but errors.
    #[arg(long)]
    pub(super) quiet: bool,
}

/// What to test and where the results go.
#[derive(Args, Debug)]
pub(super) struct LabArgs {
    /// A built-in scene (see `muslin scenes`) or a TOML file; drape by default.
    pub(super) scene: Option<String>,
    /// A TOML file with a table `[material]` in place of a scene, and `springs`, `bending`, `diagonals`,
    /// `cell` (m) beside it.
    #[arg(long, value_name = "FILE", conflicts_with = "scene")]
    pub(super) material: Option<PathBuf>,
    /// Set a key of the scene or material, such as cloth.0.material.stretch=500 (repeatable).
    #[arg(long, value_name = "KEY=VALUE")]
    pub(super) set: Vec<String>,
    /// Folder for lab.csv, lab.md and the pictures; SCENE-lab by default.
    #[arg(long, value_name = "DIR")]
    pub(super) out: Option<PathBuf>,
}

/// What to study and where the results go.
#[derive(Args, Debug)]
pub(super) struct StudyArgs {
    /// A built-in scene (see `muslin scenes`) or a TOML file.
    #[arg(default_value = "drape")]
    pub(super) scene: String,
    /// Schemes, separated by commas; all of them by default.
    #[arg(long, value_name = "NAME,…", value_delimiter = ',')]
    pub(super) schemes: Vec<IntegratorName>,
    /// Steps (s) of every scheme; shares of the stable one and parts of 1/60 s by default.
    #[arg(
        long,
        value_name = "S,…",
        value_delimiter = ',',
        allow_negative_numbers = true
    )]
    pub(super) steps: Vec<f64>,
    /// Sweeps of xpbd and iterations of projective.
    #[arg(long, value_name = "N,…", value_delimiter = ',')]
    pub(super) iterations: Vec<u32>,
    /// Tolerances (m) of dopri5; with --ablate the change (m) that counts as none.
    #[arg(
        long,
        value_name = "M,…",
        value_delimiter = ',',
        allow_negative_numbers = true
    )]
    pub(super) tolerance: Vec<f64>,
    /// Simulated time (s); the scene's own, at most 0.5 s (with --contact 1 s, with --ablate all of it), by
    /// default. The longer, the more every detail decides.
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    pub(super) duration: Option<f64>,
    /// Times up to the end at which states are compared.
    #[arg(long, value_name = "N")]
    pub(super) times: Option<u32>,
    /// The error of the mesh instead: the same scene at these cells along the longest side.
    #[arg(long, value_name = "N,…", value_delimiter = ',', conflicts_with_all = ["stability", "ablate", "contact"])]
    pub(super) cells: Vec<u32>,
    /// A map of what is stable instead, over the step and stiffness, mass-ratio or damping.
    #[arg(
        long,
        value_name = "AXIS",
        num_args = 0..=1,
        require_equals = true,
        default_missing_value = "stiffness",
        conflicts_with_all = ["ablate", "contact"]
    )]
    pub(super) stability: Option<Axis>,
    /// Switch off each part of the model in turn instead: what it changes, and what it costs.
    #[arg(long, conflicts_with = "contact")]
    pub(super) ablate: bool,
    /// Turn the dial of contact instead: exact distances and grids of 10, 5 and 2.5 mm, each with continuous
    /// detection and without; how deep cloth gets, how far it is moved, and what it costs.
    #[arg(long)]
    pub(super) contact: bool,
    /// Smallest error (m) that the reference should tell.
    #[arg(
        long,
        value_name = "M",
        default_value_t = 1e-5,
        allow_negative_numbers = true
    )]
    pub(super) smallest: f64,
    /// Wall time (s) that the reference may take.
    #[arg(
        long,
        value_name = "S",
        default_value_t = 150.0,
        allow_negative_numbers = true
    )]
    pub(super) patience: f64,
    /// Threads of each run; all cores by default.
    #[arg(long, value_name = "N")]
    pub(super) threads: Option<usize>,
    /// Set a key of the scene, such as cloth.0.material.stretch=500, or with KEY= remove it (repeatable).
    #[arg(long, value_name = "KEY=VALUE")]
    pub(super) set: Vec<String>,
    /// Folder for the results; SCENE-study by default.
    #[arg(long, value_name = "DIR")]
    pub(super) out: Option<PathBuf>,
}

/// What to export and where it goes.
#[cfg(feature = "rerun")]
#[derive(Args, Debug)]
#[command(group = ArgGroup::new("format").args(["csv", "obj", "ply", "glb"]).required(true).multiple(true))]
pub(super) struct ExportArgs {
    /// A recording.
    pub(super) recording: PathBuf,
    /// Table of the exact state at one time: cloth,particle,x,y,z,vx,vy,vz in m and m/s.
    #[arg(long, value_name = "FILE")]
    pub(super) csv: Option<PathBuf>,
    /// Folder for a mesh file a frame, frame-000123.obj and so on: an object for each cloth and obstacle, in
    /// m, y up; chains as lines.
    #[arg(long, value_name = "DIR")]
    pub(super) obj: Option<PathBuf>,
    /// The same as binary PLY: all in one mesh, coloured by strain, each vertex with the number of its body
    /// (named in the file's head).
    #[arg(long, value_name = "DIR")]
    pub(super) ply: Option<PathBuf>,
    /// One animated file for Blender, three.js and others: binary glTF, with morph targets.
    #[arg(long, value_name = "FILE")]
    pub(super) glb: Option<PathBuf>,
    /// One frame: `last`, or the last at or before a time (s). Of --csv the last checkpoint at or before it,
    /// which is the last of all by default.
    #[arg(long, value_name = "T|last", allow_negative_numbers = true)]
    pub(super) at: Option<String>,
    /// Every Nth frame; all by default.
    #[arg(long, value_name = "N", conflicts_with = "at")]
    pub(super) every: Option<NonZeroU64>,
    /// Replace existing files.
    #[arg(long)]
    pub(super) force: bool,
}

/// What to go on with.
#[cfg(feature = "rerun")]
#[derive(Args, Debug)]
pub(super) struct ResumeArgs {
    /// A recording, also of a run that was killed.
    pub(super) recording: PathBuf,
    /// Go on from the last checkpoint at or before this time (s); from the last of all by default.
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    pub(super) at: Option<f64>,
    #[command(flatten)]
    pub(super) changes: ChangeArgs,
    #[command(flatten)]
    pub(super) output: OutputArgs,
}

/// What to run again.
#[cfg(feature = "rerun")]
#[derive(Args, Debug)]
pub(super) struct VerifyArgs {
    /// A recording.
    pub(super) recording: PathBuf,
    /// Threads of the simulation; all cores by default.
    #[arg(long, value_name = "N")]
    pub(super) threads: Option<usize>,
    /// Print nothing but errors.
    #[arg(long)]
    pub(super) quiet: bool,
}

/// What to compare.
#[cfg(feature = "rerun")]
#[derive(Args, Debug)]
pub(super) struct CompareArgs {
    /// A recording.
    pub(super) a: PathBuf,
    /// Another one of the same scene, also with other resolutions, solvers or materials.
    pub(super) b: PathBuf,
    /// Recording to write: both runs on one timeline, coloured by their distance.
    #[arg(long, value_name = "OUT.rrd")]
    pub(super) save: Option<PathBuf>,
    /// Replace the file that --save names.
    #[arg(long, requires = "save")]
    pub(super) force: bool,
    /// From which distance on the runs count as visibly apart.
    #[arg(long, value_name = "LENGTH", value_parser = super::quantity::length, default_value = "5mm")]
    pub(super) visible: f64,
}

/// What to replay, where to and how.
#[cfg(feature = "rerun")]
#[derive(Args, Debug)]
pub(super) struct ReplayArgs {
    /// Recordings; several are shown over each other.
    #[arg(required = true, value_name = "FILE.rrd")]
    pub(super) recordings: Vec<PathBuf>,
    /// Stream to a viewer that listens at URL.
    #[arg(long, value_name = "URL", num_args = 0..=1, default_missing_value = "rerun+http://127.0.0.1:9876/proxy")]
    pub(super) connect: Option<String>,
    /// Let viewers fetch the replay at this port of this machine.
    #[arg(long, value_name = "PORT", num_args = 0..=1, default_missing_value = "9876", value_parser = address)]
    pub(super) serve: Option<SocketAddr>,
    /// Start a viewer and stream to it.
    #[arg(long)]
    pub(super) spawn: bool,
    /// Simulated seconds in a second; 1e9 for as fast as the viewer takes it.
    #[arg(
        long,
        value_name = "X",
        default_value_t = 1.0,
        allow_negative_numbers = true
    )]
    pub(super) speed: f64,
    /// Time to begin at (s).
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    pub(super) from: Option<f64>,
    /// Time to end at (s).
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    pub(super) to: Option<f64>,
    /// Over and over, until q or Ctrl-C.
    #[arg(long = "loop")]
    pub(super) looped: bool,
    /// Print nothing but errors.
    #[arg(long)]
    pub(super) quiet: bool,
}

/// What to tell about.
#[cfg(feature = "rerun")]
#[derive(Args, Debug)]
pub(super) struct InfoArgs {
    /// A recording.
    #[arg(value_name = "FILE.rrd")]
    pub(super) recording: PathBuf,
    /// For machines.
    #[arg(long)]
    pub(super) json: bool,
}
