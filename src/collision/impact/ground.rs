//! Everything that can meet: vertices, elements, their boxes and the rules between them.

use super::element::{Element, elements};
use super::element_boxes::ElementBoxes;
use super::examine::CLEAR;
use super::solid::{LAYER_FLOOR, Layers, Shape, Solid};
use super::stage::Fabric;
use super::touch::Vertices;
use crate::mesh::{Aabb, Bvh};
use glam::DVec3;

/// What the search needs of a solid.
#[derive(Clone, Debug)]
pub(super) struct Rules {
    /// Coulomb's friction coefficient μ.
    pub(super) friction: f64,
    /// Distance that is always kept (m).
    pub(super) floor: f64,
    /// Distance of the surface from the features (m).
    pub(super) radius: f64,
}

/// A plane that is a solid's surface.
#[derive(Clone, Copy, Debug)]
pub(super) struct Plane {
    /// The solid's number in the rules.
    pub(super) solid: usize,
    /// Its vertex.
    pub(super) vertex: u32,
    /// Unit normal.
    pub(super) normal: DVec3,
}

/// Everything that can meet.
#[derive(Clone, Debug)]
pub(super) struct Ground {
    pub(super) vertices: Vertices,
    /// Elements of all cloths.
    pub(super) cloth: Vec<Element>,
    /// Their boxes when what is near was listed; empty without layers.
    pub(super) cloth_tree: Bvh,
    /// Boxes of their features then; empty without layers.
    pub(super) cloth_boxes: ElementBoxes,
    /// Elements of all solids but planes; their numbers in `rules` begin at 1.
    pub(super) solid: Vec<Element>,
    /// Their boxes over the step.
    pub(super) solid_tree: Bvh,
    pub(super) planes: Vec<Plane>,
    /// Of layers first, then of each solid.
    pub(super) rules: Vec<Rules>,
    pub(super) layers: Option<Layers>,
    /// Whether a vertex's way isn't the one that was last searched.
    pub(super) stale: Vec<bool>,
    /// Whether a vertex belongs to a face of cloth.
    pub(super) faced: Vec<bool>,
    /// The rigid zone of each vertex that moves with one.
    pub(super) zone: Vec<Option<u32>>,
    /// Particles that are left alone, since they start across something; empty where none does.
    pub(super) exempt: Vec<bool>,
    /// Whether floors are small because there is no room for more.
    pub(super) tight: bool,
}

impl Rules {
    /// Gap from which on nothing has to be done (m).
    pub(super) fn free(&self) -> f64 {
        CLEAR * self.floor
    }
}

impl Ground {
    /// The ground, and the first vertex of each solid.
    #[expect(
        clippy::cast_possible_truncation,
        reason = "meshes have fewer than 2³² vertices"
    )]
    pub(super) fn new(
        fabric: Fabric<'_>,
        solids: &[Solid],
        layers: Option<Layers>,
    ) -> (Self, Vec<usize>) {
        let particles = fabric.particles;
        let (thickness, friction) = layers
            .as_ref()
            .map_or((0.0, 0.0), |own| (own.thickness, own.friction));
        let mut rules = vec![Rules {
            friction,
            floor: LAYER_FLOOR * thickness,
            radius: 0.0,
        }];
        let (mut firsts, mut planes, mut solid) = (Vec::new(), Vec::new(), Vec::new());
        let mut count = particles;
        for (k, one) in (1..).zip(solids) {
            let (first, vertices) = (count as u32, one.shape.vertices() as u32);
            let triangles = match &one.shape {
                Shape::Mesh { triangles, .. } => &triangles[..],
                Shape::Sphere { .. } | Shape::Plane { .. } => &[],
            };
            if let Shape::Plane { normal } = one.shape {
                planes.push(Plane {
                    solid: k as usize,
                    vertex: first,
                    normal,
                });
            } else {
                solid.extend(elements(first, vertices, triangles, &[], k));
            }
            rules.push(Rules {
                friction: one.friction,
                floor: one.floor,
                radius: one.shape.radius(),
            });
            firsts.push(count);
            count += one.shape.vertices();
        }
        let cloth = elements(0, particles as u32, fabric.triangles, fabric.edges, 0);
        let ground = Self {
            faced: faced(count, &cloth),
            vertices: Vertices {
                start: vec![DVec3::ZERO; count],
                end: vec![DVec3::ZERO; count],
                velocity: vec![DVec3::ZERO; count],
                inverse_mass: vec![0.0; count],
            },
            cloth,
            cloth_tree: Bvh::new(&[]),
            cloth_boxes: ElementBoxes::default(),
            solid,
            solid_tree: Bvh::new(&[]),
            planes,
            rules,
            layers,
            stale: vec![true; count],
            zone: vec![None; count],
            exempt: Vec::new(),
            tight: false,
        };
        (ground, firsts)
    }

    /// Brings the boxes of the solids up to date.
    pub(super) fn fit_solids(&mut self) {
        let Self {
            vertices,
            solid,
            solid_tree,
            rules,
            ..
        } = self;
        fit(solid_tree, solid.len(), |item| {
            let element = &solid[item as usize];
            swept(vertices, element).grown(rules[element.solid as usize].radius)
        });
    }

    /// Fits the boxes of the cloths around some positions of the particles, grown by a margin (m).
    pub(super) fn fit_cloth(&mut self, places: &[DVec3], margin: f64) {
        let Self {
            cloth,
            cloth_tree,
            cloth_boxes,
            ..
        } = self;
        cloth_boxes.fit(places, cloth, margin);
        fit(cloth_tree, cloth.len(), |item| {
            let corners = cloth[item as usize].corners;
            Aabb::around(corners.map(|i| places[i as usize])).grown(margin)
        });
    }

    /// Longest way of an element's vertices (m).
    pub(super) fn way(&self, element: &Element) -> f64 {
        let Vertices { start, end, .. } = &self.vertices;
        let way = |i: u32| (end[i as usize] - start[i as usize]).length_squared();
        let [a, b, c] = element.corners;
        way(a).max(way(b)).max(way(c)).sqrt()
    }

    /// Whether a vertex is left alone.
    #[inline]
    pub(super) fn is_exempt(&self, vertex: u32) -> bool {
        self.exempt
            .get(vertex as usize)
            .is_some_and(|&exempt| exempt)
    }

    /// Whether any way of four vertices has changed since it was searched.
    #[inline]
    pub(super) fn is_any_stale(&self, [a, b, c, d]: [u32; 4]) -> bool {
        let stale = |i: u32| self.stale[i as usize];
        stale(a) || stale(b) || stale(c) || stale(d)
    }

    /// Whether the way of an element has changed since it was searched.
    pub(super) fn is_stale(&self, element: &Element) -> bool {
        element.has_any(&self.stale)
    }
}

/// Which of so many vertices belong to faces of some elements.
fn faced(count: usize, elements: &[Element]) -> Vec<bool> {
    let mut faced = vec![false; count];
    let faces = elements.iter().filter(|element| element.face);
    faces.for_each(|face| face.corners.iter().for_each(|&i| faced[i as usize] = true));
    faced
}

/// Box of an element's way (m).
pub(super) fn swept(vertices: &Vertices, element: &Element) -> Aabb {
    let Vertices { start, end, .. } = vertices;
    let mut bounds = Aabb::EMPTY;
    for &i in &element.corners {
        for x in [start[i as usize], end[i as usize]] {
            bounds.min = bounds.min.min(x);
            bounds.max = bounds.max.max(x);
        }
    }
    bounds
}

/// Gives a tree new boxes; the first ones decide its shape.
fn fit(tree: &mut Bvh, count: usize, bounds: impl Fn(u32) -> Aabb + Sync) {
    if tree.len() == count {
        tree.refit_with(bounds);
    } else {
        let boxes: Vec<Aabb> = (0..).take(count).map(bounds).collect();
        *tree = Bvh::new(&boxes);
    }
}
