//! The scene format. Every key is here; an unknown one is an error.

use super::step::Step;
use crate::mesh::{Diagonals, EdgeName, Opening};
use serde::{Deserialize, Serialize};

/// A scene.
#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Scene {
    /// Its name; the recording is called after it.
    pub name: String,
    /// Simulated time (s).
    pub duration: f64,
    /// Acceleration of gravity (m/s²).
    #[serde(default = "earth")]
    pub gravity: [f64; 3],
    /// The cloths.
    #[serde(default)]
    pub cloth: Vec<Cloth>,
    /// What holds them.
    #[serde(default)]
    pub pin: Vec<Pin>,
    /// What they collide with.
    #[serde(default)]
    pub obstacle: Vec<Obstacle>,
    /// How cloth collides with cloth; it passes through itself otherwise.
    pub self_collision: Option<SelfCollision>,
    /// Upper bound on strain.
    pub strain_limit: Option<StrainLimit>,
    /// How the motion is computed.
    #[serde(default)]
    pub solver: Solver,
    /// What is recorded.
    #[serde(default)]
    pub record: Record,
}

/// A cloth or a chain.
#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Cloth {
    /// Its name, unique in the scene.
    pub name: String,
    /// Its shape at rest.
    pub shape: Shape,
    /// Where its centre is put (m).
    #[serde(default)]
    pub translate: [f64; 3],
    /// How it is turned: degrees about x, then y, then z, before it is moved.
    #[serde(default)]
    pub rotate: [f64; 3],
    /// How it starts, other than at rest in its shape.
    #[serde(default)]
    pub start: Start,
    /// Its kinds of springs.
    #[serde(default = "structural_and_shear")]
    pub springs: Vec<SpringKind>,
    /// How its hinges bend.
    #[serde(default)]
    pub bending: BendingName,
    /// What it is made of.
    pub material: Material,
    /// What slows it down.
    #[serde(default)]
    pub damping: Damping,
}

/// The shape of a cloth at rest.
#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Shape {
    /// A rectangle in the xz plane.
    Sheet(SheetShape),
    /// Particles in a row along +x.
    Chain(ChainShape),
    /// A solid lattice of particles.
    Block(BlockShape),
    /// Any triangle mesh.
    Obj(ObjShape),
}

/// A rectangle in the xz plane.
#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct SheetShape {
    /// Width along x and z (m).
    pub size: [f64; 2],
    /// Number of cells along x and z.
    pub cells: [u32; 2],
    /// Diagonals of the cells.
    #[serde(default)]
    pub diagonals: Diagonals,
    /// A round hole.
    pub opening: Option<Opening>,
}

/// Particles in a row along +x.
#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct ChainShape {
    /// Its length (m).
    pub length: f64,
    /// Number of its links.
    pub links: u32,
}

/// A solid lattice of particles.
#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct BlockShape {
    /// Width along x, y and z (m).
    pub size: [f64; 3],
    /// Number of cells along x, y and z.
    pub cells: [u32; 3],
}

/// How a cloth starts. Pinned particles start at rest.
#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct Start {
    /// Velocity of every particle (m/s).
    pub velocity: [f64; 3],
    /// Angular velocity about its centre of mass (rad/s).
    pub spin: [f64; 3],
    /// Factors on its own coordinates before it is placed: how far it is stretched at first.
    pub stretch: [f64; 3],
}

impl Default for Start {
    fn default() -> Self {
        Self {
            velocity: [0.0; 3],
            spin: [0.0; 3],
            stretch: [1.0; 3],
        }
    }
}

/// How hinges bend.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum BendingName {
    /// Not at all: there are no hinges.
    #[default]
    None,
    /// By the sine of half their angle (Bridson, Marino and Fedkiw 2003).
    EdgeSpring,
    /// By their angle (Grinspun et al. 2003).
    DiscreteShell,
}

/// A family of springs (Provot 1995).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum SpringKind {
    /// Along the weave.
    Structural,
    /// Along the diagonals.
    Shear,
    /// Between second neighbours.
    Bend,
    /// Along the weave in place of structural springs, with no rest length: ideal springs.
    ZeroLength,
}

/// What a cloth is made of, independent of its mesh.
#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Material {
    /// Mass by area (kg/m²), for sheets and meshes.
    pub area_density: Option<f64>,
    /// Mass by length (kg/m), for chains.
    pub linear_density: Option<f64>,
    /// Mass by volume (kg/m³), for blocks.
    pub density: Option<f64>,
    /// In-plane modulus E·h of a sheet or mesh (N/m); axial stiffness E·A of a chain (N); Young's
    /// modulus of a block (Pa).
    pub stretch: Option<f64>,
    /// In place of `stretch`: one k for every spring (N/m), whatever it stands for. What this makes
    /// of a cloth depends on its mesh.
    pub spring_constant: Option<f64>,
    /// Plate rigidity D of a sheet or mesh (N·m); bending stiffness E·I of a chain (N·m²).
    pub bend: Option<f64>,
}

/// What slows a cloth down.
#[derive(Clone, Debug, Default, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Damping {
    /// c in f = −c m v (1/s): drag on all motion.
    #[serde(default)]
    pub mass: f64,
    /// τ in f = −τ k d̂ (d̂·Δv) (s): only on change of length.
    #[serde(default)]
    pub stiffness: f64,
}

/// Particles that are held.
#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Pin {
    /// Name of the cloth.
    pub cloth: String,
    /// Which of its particles.
    pub select: Select,
    /// Whether the cloth's tangent is held too, along the edges whose two ends are selected.
    #[serde(default)]
    pub clamp: bool,
    /// How it moves; it holds still otherwise.
    pub motion: Option<PinMotion>,
    /// When it lets go (s); never otherwise.
    pub release: Option<f64>,
}

/// How a pin moves, as one rigid body.
#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct PinMotion {
    /// Where it is when. It goes smoothly from each to the next without overshooting, and rests before
    /// the first and after the last.
    pub keyframes: Vec<Keyframe>,
}

/// Where something is at a time, from where it starts.
#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Keyframe {
    /// The time (s).
    pub t: f64,
    /// How far it has moved (m).
    #[serde(default)]
    pub translate: [f64; 3],
    /// By how much it has turned: degrees about x, then y, then z, about the middle of the box around it
    /// (of a pin, around its particles) at the start. 720 is twice around.
    #[serde(default)]
    pub rotate: [f64; 3],
}

/// A choice of particles of a cloth.
#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Select {
    /// A whole edge of a sheet, or side of a block.
    Edge(EdgeName),
    /// Corners of a sheet (`left-near`, …) or block (`left-near-bottom`, …), ends of a chain (`left`,
    /// `right`).
    Corner(Vec<String>),
    /// Particles by number.
    Vertices(Vec<u32>),
    /// Particles between two corners of a box in the world (m), as placed at the start.
    Box([[f64; 3]; 2]),
}

/// A body that cloth collides with.
#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Obstacle {
    /// Its name, unique in the scene.
    pub name: String,
    /// Its shape.
    pub shape: ObstacleShape,
    /// Where its origin is put (m).
    #[serde(default)]
    pub translate: [f64; 3],
    /// How it is turned: degrees about x, then y, then z, before it is moved.
    #[serde(default)]
    pub rotate: [f64; 3],
    /// Coulomb's friction coefficient μ.
    #[serde(default = "friction")]
    pub friction: f64,
    /// Distance that cloth keeps from its surface (m).
    #[serde(default = "thickness")]
    pub thickness: f64,
    /// How the distances of particles from it are found.
    #[serde(default)]
    pub distance: DistanceName,
    /// Whether whole triangles and edges of cloth are kept out along their ways (continuous collision
    /// detection), and not particles alone.
    #[serde(default = "yes")]
    pub ccd: bool,
    /// How it moves; it holds still otherwise.
    pub motion: Option<ObstacleMotion>,
}

impl Obstacle {
    /// Whether a distance grid can stand for it: an OBJ that keeps its shape.
    pub fn takes_grid(&self) -> bool {
        matches!(self.shape, ObstacleShape::Obj(_))
            && matches!(self.motion, None | Some(ObstacleMotion::Keyframes(_)))
    }
}

/// How the distances of particles from an obstacle are found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum DistanceName {
    /// From its nearest triangle.
    #[default]
    Exact,
    /// On a grid with cells of so many metres, twenty times faster and off by a share of a cell.
    Grid(f64),
}

/// The shape of an obstacle.
#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum ObstacleShape {
    /// A closed triangle mesh.
    Obj(ObjShape),
    /// Everything below a plane.
    Plane(PlaneShape),
    /// A ball.
    Sphere(SphereShape),
}

/// A plane without end.
#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct PlaneShape {
    /// A point of it (m).
    #[serde(default)]
    pub point: [f64; 3],
    /// Its normal, of any length, on the cloth's side.
    pub normal: [f64; 3],
}

/// A ball.
#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct SphereShape {
    /// Its centre (m).
    #[serde(default)]
    pub center: [f64; 3],
    /// Its radius (m).
    pub radius: f64,
}

/// How an obstacle moves.
#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum ObstacleMotion {
    /// As one piece. It goes smoothly from each keyframe to the next without overshooting, and rests before
    /// the first and after the last.
    Keyframes(Vec<Keyframe>),
    /// As a mannequin walks: the body has to be `mannequin.obj`.
    Walk(WalkMotion),
    /// As the meshes of OBJ files say, in straight lines from each to the next.
    Sequence(SequenceMotion),
}

/// A walk along the mannequin's own +z, after it has stood until `start`.
#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct WalkMotion {
    /// Mean speed (m/s).
    pub speed: f64,
    /// Until when it stands (s).
    #[serde(default = "second")]
    pub start: f64,
    /// Whether it walks on the spot, as on a treadmill.
    #[serde(default)]
    pub on_the_spot: bool,
}

/// A motion given by OBJ files of one topology: one a frame, in the order of the numbers at the ends of
/// their names, placed like the obstacle.
#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct SequenceMotion {
    /// Their folder, relative to the scene's file.
    pub dir: String,
    /// Frames a second.
    pub fps: f64,
    /// When the first frame is (s).
    #[serde(default)]
    pub start: f64,
}

/// A triangle mesh in an OBJ file.
#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct ObjShape {
    /// The file, relative to the scene's.
    pub path: String,
    /// Factor on its coordinates.
    #[serde(default = "one")]
    pub scale: f64,
}

/// How cloth collides with itself and with other cloth (Bridson, Fedkiw and Anderson 2002).
#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct SelfCollision {
    /// Distance that layers keep (m).
    #[serde(default = "layer_thickness")]
    pub thickness: f64,
    /// Coulomb's friction coefficient μ between them.
    #[serde(default = "friction")]
    pub friction: f64,
}

/// Upper bound on strain (Provot 1995).
#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct StrainLimit {
    /// Largest ε = ℓ/ℓ₀ − 1 of structural and shear springs.
    pub max: f64,
}

/// How the motion is computed. None of these changes the material.
#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct Solver {
    /// The scheme.
    pub integrator: IntegratorName,
    /// Time step (s), or `"auto"`.
    pub dt: Step,
    /// How the linear systems of implicit schemes are solved.
    pub linear: LinearSolverName,
    /// Residual at which a linear solve by conjugate gradients ends, relative to its start.
    pub linear_tolerance: f64,
    /// Force out of balance at which a nonlinear solve ends, relative to the forces that move the
    /// cloth.
    pub residual: f64,
    /// Error of the position of any particle that `dopri5` allows in each of its steps (m).
    pub tolerance: f64,
    /// Iterations of a step: sweeps of `xpbd` (1 by default), the most of `projective` (100) and, as Newton
    /// steps, of `newton`, `implicit-midpoint` and `bdf2` (50).
    pub iterations: Option<u32>,
}

/// How linear systems are solved.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum LinearSolverName {
    /// By conjugate gradients, with a coarse level where they take long, or a factorisation where that
    /// takes less.
    #[default]
    Auto,
    /// By conjugate gradients, to `linear_tolerance`.
    ConjugateGradient,
    /// By a sparse Cholesky factorisation, to rounding; by conjugate gradients where the factor is too
    /// large.
    Cholesky,
}

/// A scheme's name.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum IntegratorName {
    /// Explicit, of first order, feeds energy into every oscillation: shows why not.
    Euler,
    /// Explicit, cheap, stable below a largest step.
    SymplecticEuler,
    /// Explicit, of second order, as cheap.
    Verlet,
    /// Explicit, of fourth order, four passes a step.
    Rk4,
    /// Explicit, of fifth order, with steps as long as `tolerance` allows.
    Dopri5,
    /// One linearised solve a step, stable at any.
    #[default]
    ImplicitEuler,
    /// Implicit Euler, its nonlinear equation solved.
    Newton,
    /// Implicit, of second order, keeps the energy.
    ImplicitMidpoint,
    /// Implicit, of second order, damps what it can't see.
    Bdf2,
    /// Springs and hinges relaxed one by one, cheap, stable at any step; softens cloth at long ones.
    Xpbd,
    /// Implicit Euler solved by local and global steps with one factorised matrix.
    Projective,
}

impl IntegratorName {
    /// Every scheme: explicit ones, implicit ones, those that relax constraints.
    pub const ALL: [Self; 11] = [
        Self::Euler,
        Self::SymplecticEuler,
        Self::Verlet,
        Self::Rk4,
        Self::Dopri5,
        Self::ImplicitEuler,
        Self::Newton,
        Self::ImplicitMidpoint,
        Self::Bdf2,
        Self::Xpbd,
        Self::Projective,
    ];

    /// Its name in scenes.
    pub fn name(self) -> &'static str {
        match self {
            Self::Euler => "euler",
            Self::SymplecticEuler => "symplectic-euler",
            Self::Verlet => "verlet",
            Self::Rk4 => "rk4",
            Self::Dopri5 => "dopri5",
            Self::ImplicitEuler => "implicit-euler",
            Self::Newton => "newton",
            Self::ImplicitMidpoint => "implicit-midpoint",
            Self::Bdf2 => "bdf2",
            Self::Xpbd => "xpbd",
            Self::Projective => "projective",
        }
    }
}

impl std::str::FromStr for IntegratorName {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let found = Self::ALL.into_iter().find(|scheme| scheme.name() == text);
        found.ok_or_else(|| {
            let known = Self::ALL.map(Self::name).join(", ");
            format!("\"{text}\" is no scheme: use {known}")
        })
    }
}

/// What is recorded.
#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct Record {
    /// Frames in a simulated second.
    pub fps: f64,
    /// Which springs are drawn.
    pub springs: SpringDetailName,
    /// Whether meshes are drawn with normals: 12 of their 28 bytes a particle and frame. Without them nothing shades
    /// them.
    pub normals: bool,
    /// Strain at the ends of the colour map.
    pub strain_range: f64,
    /// Simulated time between checkpoints (s); there is always one at the end.
    pub checkpoint: f64,
    /// Share of the run's time that goes into estimating the error of the time step; 0 for no estimate.
    pub error: f64,
    /// Two corners of the box that is looked at when the recording is opened (m); around the cloths
    /// and what is near them by default.
    pub view: Option<[[f64; 3]; 2]>,
}

/// Which springs are drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum SpringDetailName {
    /// None.
    Off,
    /// Every one.
    All,
    /// Every one below a few thousand, the most strained beyond.
    #[default]
    Auto,
}

impl Default for Solver {
    fn default() -> Self {
        Self {
            integrator: IntegratorName::default(),
            dt: Step::Seconds(0.004),
            linear: LinearSolverName::default(),
            linear_tolerance: 1e-4,
            residual: 1e-6,
            tolerance: 1e-4,
            iterations: None,
        }
    }
}

impl Default for Record {
    fn default() -> Self {
        Self {
            fps: 60.0,
            springs: SpringDetailName::default(),
            normals: true,
            strain_range: 0.05,
            checkpoint: 1.0,
            error: 0.05,
            view: None,
        }
    }
}

fn earth() -> [f64; 3] {
    [0.0, -9.81, 0.0]
}

pub(super) fn structural_and_shear() -> Vec<SpringKind> {
    vec![SpringKind::Structural, SpringKind::Shear]
}

fn friction() -> f64 {
    0.4
}

fn layer_thickness() -> f64 {
    0.002
}

fn thickness() -> f64 {
    0.003
}

fn second() -> f64 {
    1.0
}

fn yes() -> bool {
    true
}

fn one() -> f64 {
    1.0
}
