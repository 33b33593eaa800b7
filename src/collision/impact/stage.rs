//! The impact stage: from a free start and a wished end to a way on which nothing meets.

use super::ground::Ground;
use super::halves::Halves;
use super::near::Neighbours;
use super::search::Found;
use super::solid::{Layers, Solid};
use super::touch::Touch;
use super::zone::Zones;
use glam::DVec3;

/// Cloth and what it must not pass through.
#[derive(Clone, Debug)]
pub struct Impacts {
    /// Number of the cloths' particles.
    pub(super) particles: usize,
    /// First vertex of each solid.
    pub(super) firsts: Vec<usize>,
    pub(super) ground: Ground,
    /// What is near each other of layers.
    pub(super) neighbours: Neighbours,
    /// Elements of cloth to look for, in order.
    pub(super) asked: Vec<u32>,
    /// What each task found.
    pub(super) found: Vec<Found>,
    /// All touches of the step.
    pub(super) touches: Vec<Touch>,
    /// Which of them two threads can work on at once.
    pub(super) halves: Halves,
    pub(super) zones: Zones,
    /// How far each element of cloth is from the floor around all solids at the last step's end (m), at least.
    pub(super) clear: Vec<f64>,
    /// Ends of the vertices' ways when they were searched last (m); of particles the last step's ends between
    /// steps.
    pub(super) searched: Vec<DVec3>,
    /// Whether nothing met on the ways from the vertices' starts to there when they were searched last.
    pub(super) free: bool,
    /// Longest way of a solid's vertex in the step (m).
    pub(super) solid_way: f64,
    /// Longest way from where a solid's vertex ended the last step to where it begins this one (m).
    pub(super) solid_jump: f64,
    /// Whether the solids' boxes are those of this step.
    pub(super) fitted: bool,
}

/// Meshes of cloth.
#[derive(Clone, Copy, Debug)]
pub struct Fabric<'a> {
    /// Number of particles.
    pub particles: usize,
    /// Triangles of sheets, and the surfaces of blocks.
    pub triangles: &'a [[u32; 3]],
    /// Edges that are of no triangle: links of chains.
    pub edges: &'a [[u32; 2]],
}

/// A step as it is wished.
#[derive(Clone, Copy, Debug)]
pub struct Step<'a> {
    /// Its length (s).
    pub dt: f64,
    /// Where the particles are at its start (m).
    pub before: &'a [DVec3],
    /// 1/mass of each particle (1/kg), 0 for pinned ones.
    pub inverse_masses: &'a [f64],
}

/// What the stage did.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Resolved {
    /// Pairs of features that were kept apart.
    pub impacts: usize,
    /// Searches for meetings.
    pub rounds: u32,
    /// Rigid zones of the fail-safe.
    pub zones: usize,
    /// Pairs that still meet: their way crosses.
    pub missed: usize,
    /// Whether any particle's position or velocity was changed.
    pub moved: bool,
    /// Kinetic energy taken with the approach (J).
    pub approach: f64,
    /// Kinetic energy taken by friction (J).
    pub friction: f64,
    /// Kinetic energy given by moving solids and pins (J).
    pub work: f64,
}

/// Elements that one task looks for.
pub(super) const TASK: usize = 64;

/// Parts of a hierarchy at most.
const MOST_PARTS: usize = 40;

impl Impacts {
    /// Nothing has been searched yet. Solids' vertices are to be [placed](Self::place) before a step.
    pub fn new(fabric: Fabric<'_>, solids: &[Solid], layers: Option<Layers>) -> Self {
        let particles = fabric.particles;
        let (ground, firsts) = Ground::new(fabric, solids, layers);
        let (count, elements) = (ground.vertices.end.len(), ground.cloth.len());
        Self {
            particles,
            firsts,
            neighbours: Neighbours::new(particles),
            asked: Vec::with_capacity(elements),
            found: vec![Found::default(); elements.div_ceil(TASK).max(MOST_PARTS)],
            touches: Vec::new(),
            halves: Halves::new(count),
            zones: Zones::new(count),
            clear: vec![f64::NEG_INFINITY; elements],
            searched: vec![DVec3::NAN; count],
            free: false,
            solid_way: 0.0,
            solid_jump: 0.0,
            fitted: false,
            ground,
        }
    }
}
