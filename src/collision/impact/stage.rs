//! The impact stage: from a free start and a wished end to a way on which nothing meets.

use super::element::elements;
use super::search::{Found, Ground, Rules};
use super::solid::{LAYER_FLOOR, Layers, Shape, Solid};
use super::touch::{Touch, Vertices};
use super::zone::Zones;
use crate::mesh::Bvh;
use glam::DVec3;

/// Cloth and what it must not pass through.
#[derive(Clone, Debug)]
pub struct Impacts {
    /// Number of the cloths' particles.
    pub(super) particles: usize,
    /// First vertex of each solid.
    pub(super) firsts: Vec<usize>,
    /// Which of the planes each solid is, if it is one.
    pub(super) planes: Vec<Option<usize>>,
    pub(super) ground: Ground,
    /// Elements of cloth to look for, in order.
    pub(super) asked: Vec<u32>,
    /// What each task found.
    pub(super) found: Vec<Found>,
    /// All touches of the step.
    pub(super) touches: Vec<Touch>,
    pub(super) zones: Zones,
    /// How far each element of cloth is from the floor around all solids at the last step's end (m), at least.
    pub(super) clear: Vec<f64>,
    /// Ends of the vertices' ways when they were searched last (m); of particles the last step's ends between
    /// steps.
    pub(super) searched: Vec<DVec3>,
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

impl Impacts {
    /// Nothing has been searched yet. Solids' vertices are to be [placed](Self::place) before a step.
    #[expect(
        clippy::cast_possible_truncation,
        reason = "a mesh has fewer than 2³² vertices"
    )]
    pub fn new(fabric: Fabric<'_>, solids: &[Solid], layers: Option<Layers>) -> Self {
        let particles = fabric.particles;
        let cloth = elements(0, particles as u32, fabric.triangles, fabric.edges, 0);
        let mut rules = vec![layers.as_ref().map_or(
            Rules {
                friction: 0.0,
                floor: 0.0,
                radius: 0.0,
            },
            |layers| Rules {
                friction: layers.friction,
                floor: LAYER_FLOOR * layers.thickness,
                radius: 0.0,
            },
        )];
        let (mut firsts, mut planes, mut flat) = (Vec::new(), Vec::new(), Vec::new());
        let (mut solid, mut count) = (Vec::new(), particles);
        for (
            k,
            Solid {
                shape,
                friction,
                floor,
            },
        ) in (1..).zip(solids)
        {
            let own = Rules {
                friction: *friction,
                floor: *floor,
                radius: shape.radius(),
            };
            firsts.push(count);
            planes.push(None);
            let (first, vertices) = (count as u32, shape.vertices() as u32);
            match shape {
                Shape::Mesh { triangles, .. } => {
                    solid.extend(elements(first, vertices, triangles, &[], k));
                }
                Shape::Sphere { .. } => solid.extend(elements(first, 1, &[], &[], k)),
                Shape::Plane { normal } => {
                    planes[k as usize - 1] = Some(flat.len());
                    flat.push((first, *normal, own.clone()));
                }
            }
            rules.push(own);
            count += shape.vertices();
        }
        let vertices = Vertices {
            start: vec![DVec3::ZERO; count],
            end: vec![DVec3::ZERO; count],
            velocity: vec![DVec3::ZERO; count],
            inverse_mass: vec![0.0; count],
        };
        Self {
            particles,
            firsts,
            planes,
            asked: Vec::with_capacity(cloth.len()),
            found: vec![Found::default(); cloth.len().div_ceil(TASK)],
            touches: Vec::new(),
            zones: Zones::new(count),
            clear: vec![f64::NEG_INFINITY; cloth.len()],
            searched: vec![DVec3::NAN; count],
            solid_way: 0.0,
            solid_jump: 0.0,
            fitted: false,
            ground: Ground {
                vertices,
                cloth_tree: Bvh::new(&[]),
                solid_tree: Bvh::new(&[]),
                cloth,
                solid,
                planes: flat,
                rules,
                layers,
                stale: vec![true; count],
                zone: vec![None; count],
                tight: false,
            },
        }
    }
}
