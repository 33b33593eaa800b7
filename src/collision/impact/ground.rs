//! Everything that can meet: vertices, elements, their boxes and the rules between them.

use super::element::{Element, elements};
use super::element_boxes::ElementBoxes;
use super::examine::CLEAR;
use super::slack::{LOOSE, Slack};
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
    /// Their boxes over the step; empty without layers.
    pub(super) cloth_tree: Bvh,
    /// Boxes of their features over the step; empty without layers.
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
    /// Ends of the vertices' ways when all layers were searched last (m).
    pub(super) layer_ends: Vec<DVec3>,
    /// How much the ways of each element of layers and of another may differ from those together before the two
    /// can meet (m), at least; 0 for elements that are looked for whenever their ways change.
    pub(super) slack: Vec<Slack>,
    /// Elements of layers that are looked for.
    pub(super) loose: Vec<bool>,
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
            vertices: Vertices {
                start: vec![DVec3::ZERO; count],
                end: vec![DVec3::ZERO; count],
                velocity: vec![DVec3::ZERO; count],
                inverse_mass: vec![0.0; count],
            },
            layer_ends: vec![DVec3::NAN; particles],
            slack: vec![Slack::default(); cloth.len()],
            loose: vec![true; cloth.len()],
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

    /// Brings the boxes of the cloths up to date, where they are layers.
    pub(super) fn fit_cloth(&mut self) {
        let Self {
            vertices,
            cloth,
            cloth_tree,
            cloth_boxes,
            layers,
            ..
        } = self;
        if let Some(layers) = layers {
            let margin = 0.5 * layers.thickness;
            cloth_boxes.fit(vertices, cloth, layers.rest.len(), margin);
            fit(cloth_tree, cloth.len(), |item| {
                swept(vertices, &cloth[item as usize]).grown(margin)
            });
        }
    }

    /// Box of an element of cloth: two overlap when the elements may come closer than their thickness.
    pub(super) fn layer_box(&self, element: &Element) -> Aabb {
        let thickness = self.layers.as_ref().map_or(0.0, |layers| layers.thickness);
        swept(&self.vertices, element).grown(0.5 * thickness)
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

    /// Notes that all layers are searched.
    pub(super) fn fasten(&mut self) {
        let thickness = self.layers.as_ref().map_or(0.0, |layers| layers.thickness);
        let particles = self.layer_ends.len();
        self.layer_ends
            .copy_from_slice(&self.vertices.end[..particles]);
        self.slack
            .iter()
            .for_each(|slack| slack.set(LOOSE * thickness));
    }

    /// Finds the elements of layers whose ways have changed so much that they may meet something. Returns whether
    /// there are any.
    ///
    /// Two that keep within half of their slacks can't meet. One that doesn't is looked for from then on whenever
    /// its way changes, and so is what it then has too close to it for its own slack.
    pub(super) fn loosen(&mut self) -> bool {
        let mut loose = std::mem::take(&mut self.loose);
        let mut any = false;
        for ((loose, element), slack) in loose.iter_mut().zip(&self.cloth).zip(&self.slack) {
            let change =
                |i: u32| (self.vertices.end[i as usize] - self.layer_ends[i as usize]).length();
            *loose = self.is_stale(element) && {
                let [a, b, c] = element.corners.map(change);
                2.0 * a.max(b).max(c) >= slack.get()
            };
            if *loose {
                slack.set(0.0);
                any = true;
            }
        }
        self.loose = loose;
        any
    }

    /// Whether the way of an element has changed since it was searched.
    pub(super) fn is_stale(&self, element: &Element) -> bool {
        element.corners.iter().any(|&i| self.stale[i as usize])
    }
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
