//! Who meets whom in a step.

use super::element::{Element, pairs};
use super::solid::{LAYER_FLOOR, Layers};
use super::touch::{Touch, Vertices};
use super::{Closest, Features, meeting};
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

/// Everything that can meet.
#[derive(Clone, Debug)]
pub(super) struct Ground {
    pub(super) vertices: Vertices,
    /// Elements of all cloths.
    pub(super) cloth: Vec<Element>,
    /// Their boxes over the step; empty without layers.
    pub(super) cloth_tree: Bvh,
    /// Elements of all solids but planes; their numbers in `rules` begin at 1.
    pub(super) solid: Vec<Element>,
    /// Their boxes over the step.
    pub(super) solid_tree: Bvh,
    /// Number of the solid's vertex and unit normal of each plane, and its rules.
    pub(super) planes: Vec<(u32, DVec3, Rules)>,
    /// Of layers first, then of each solid.
    pub(super) rules: Vec<Rules>,
    pub(super) layers: Option<Layers>,
    /// Whether a vertex's way isn't the one that was last searched.
    pub(super) stale: Vec<bool>,
    /// The rigid zone of each vertex that moves with one.
    pub(super) zone: Vec<Option<u32>>,
    /// Whether floors are small because there is no room for more.
    pub(super) tight: bool,
}

/// What a task found.
#[derive(Clone, Debug, Default)]
pub(super) struct Found {
    pub(super) touches: Vec<Touch>,
    /// Elements and how far they are from the floor around all solids at the step's start (m), at least.
    pub(super) clear: Vec<(u32, f64)>,
}

/// The gap of a pair at the step's start may shrink to this share of it, where it is smaller than the
/// floor.
const KEPT: f64 = 0.6;

/// Width of the band in which detection stops, as a share of the separation.
const BAND: f64 = 0.25;

/// Gap after an impact, in floors: outside of the band of detection.
const CLEAR: f64 = 1.5;

/// Share of all floors that is left where there is no room for more, as between two bodies that close.
pub(super) const TIGHT: f64 = 0.1;

/// Share of a missing gap that a step brings back: a floor of 0.3 mm in 10 steps to 6 %.
const SHARE: f64 = 0.25;

/// Share of what lacks to the thickness by which layers are moved apart in a step (Bridson, Fedkiw and
/// Anderson 2002).
const REPULSION: f64 = 0.1;

/// An element is looked for around its way in a step and so many more, but no farther than [`FAR`]: as
/// long as nothing comes closer it needn't be looked for again. TODO
const AHEAD: f64 = 4.0;

/// See [`AHEAD`] (m). TODO
const FAR: f64 = 4e-3;

impl Rules {
    /// Gap from which on nothing has to be done (m).
    pub(super) fn free(&self) -> f64 {
        CLEAR * self.floor
    }
}

impl Ground {
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
            layers,
            ..
        } = self;
        if layers.is_some() {
            fit(cloth_tree, cloth.len(), |item| {
                swept(vertices, &cloth[item as usize])
            });
        }
    }

    /// Longest way of an element's vertices (m).
    pub(super) fn way(&self, element: &Element) -> f64 {
        let Vertices { start, end, .. } = &self.vertices;
        let way = |i: u32| (end[i as usize] - start[i as usize]).length();
        element.corners.map(way).into_iter().fold(0.0, f64::max)
    }

    /// Whether the way of an element has changed since it was searched.
    pub(super) fn is_stale(&self, element: &Element) -> bool {
        element.corners.iter().any(|&i| self.stale[i as usize])
    }

    /// Looks for meetings of an element of cloth with solids.
    pub(super) fn against_solids(&self, number: u32, first: bool, found: &mut Found) {
        let one = &self.cloth[number as usize];
        let widest = self.rules[1..].iter().map(Rules::free).fold(0.0, f64::max);
        let reach = widest + (AHEAD * self.way(one)).min(FAR);
        let mut clear = reach;
        self.solid_tree
            .overlapping(&swept(&self.vertices, one).grown(reach), |item| {
                let other = &self.solid[item as usize];
                let rules = &self.rules[other.solid as usize];
                let apart = self.apart(one, other) - rules.radius;
                if apart > widest {
                    clear = clear.min(apart);
                    return;
                }
                pairs(one, other, rules.radius > 0.0, |features, vertices| {
                    let (gap, touch) = self.examine(features, vertices, rules, first);
                    clear = clear.min(gap);
                    found.touches.extend(touch);
                });
            });
        found.clear.push((number, clear - widest));
    }

    /// Looks for meetings of an element of cloth with others: all with a higher number, in later rounds also
    /// those with a lower one whose way is still the same.
    pub(super) fn against_layers(&self, number: u32, first: bool, found: &mut Found) {
        let (Some(layers), one) = (&self.layers, &self.cloth[number as usize]) else {
            return;
        };
        let reach = layers.thickness;
        self.cloth_tree
            .overlapping(&swept(&self.vertices, one).grown(reach), |item| {
                let other = &self.cloth[item as usize];
                let twice = item < number && (first || self.is_stale(other));
                if twice || item == number {
                    return;
                }
                pairs(one, other, false, |features, vertices| {
                    let split = features.split();
                    let (mine, yours) = vertices.split_at(split);
                    if mine.iter().all(|i| !yours.contains(i)) {
                        let touch = self.examine(features, vertices, &self.rules[0], first).1;
                        found.touches.extend(touch);
                    }
                });
            });
    }

    /// Gap of two elements over the whole step along the normal of one of them (m); they are at least as far apart.
    fn apart(&self, one: &Element, other: &Element) -> f64 {
        let Vertices { start, end, .. } = &self.vertices;
        let corners = |element: &Element| {
            element
                .corners
                .map(|i| (start[i as usize], end[i as usize]))
        };
        let (one, other) = (corners(one), corners(other));
        let along = |[(a, _), (b, _), (c, _)]: [(DVec3, DVec3); 3]| {
            let normal = (b - a).cross(c - a).normalize_or_zero();
            let range = |corners: &[(DVec3, DVec3); 3]| {
                let both = corners.map(|(start, end)| (normal.dot(start), normal.dot(end)));
                both.into_iter()
                    .fold((f64::MAX, f64::MIN), |(low, high), (start, end)| {
                        (low.min(start).min(end), high.max(start).max(end))
                    })
            };
            let (mine, yours) = (range(&one), range(&other));
            (mine.0 - yours.1).max(yours.0 - mine.1)
        };
        along(other).max(along(one))
    }

    /// Gap of two features at the step's start (m), and what they come to.
    fn examine(
        &self,
        features: Features,
        vertices: [u32; 4],
        rules: &Rules,
        first: bool,
    ) -> (f64, Option<Touch>) {
        let zone = vertices.map(|i| self.zone[i as usize]);
        if zone[0].is_some() && zone.iter().all(|other| *other == zone[0]) {
            return (f64::MAX, None); // an affine map keeps apart what is apart, however close
        }
        let start = vertices.map(|i| self.vertices.start[i as usize]);
        let end = vertices.map(|i| self.vertices.end[i as usize]);
        let closest = features.closest(start);
        let distance = closest.between.length();
        let gap = distance - rules.radius;
        // What starts inside a ball at least comes no closer to its centre.
        let (base, room) = if gap > 0.0 {
            (rules.radius, gap)
        } else {
            (0.0, distance)
        };
        let least = TIGHT * rules.floor.min(KEPT * room);
        let separation = if self.tight { least } else { least / TIGHT };
        let band = BAND * separation;
        let full = rules.radius + rules.free();
        let touch = |weights, normal, target| Touch {
            vertices,
            weights,
            normal,
            target,
            tight: base + CLEAR * least,
            friction: rules.friction,
            ..Touch::default()
        };
        let far = distance > base + separation + band + relative_way(features, &start, &end);
        let met = if far {
            None
        } else {
            meeting(features, start, end, base + separation, band)
        };
        let Some(met) = met else {
            let pushed = first
                .then(|| self.pushed(features, vertices, &closest, rules))
                .flatten();
            let along = closest.between / distance;
            return (
                gap,
                pushed.map(|target| touch(closest.weights, along, target)),
            );
        };
        let full = self.rest_distance(features, vertices, full);
        let target = if distance < full {
            distance + SHARE * (full - distance)
        } else {
            full
        };
        let target = if self.tight {
            base + CLEAR * least
        } else {
            target
        };
        (gap, Some(touch(met.weights, met.normal, target)))
    }

    /// The gap (m) that two features which don't meet should end the step with, if that is more than they will have
    /// and they are closer than they should be.
    fn pushed(
        &self,
        features: Features,
        vertices: [u32; 4],
        closest: &Closest,
        rules: &Rules,
    ) -> Option<f64> {
        let distance = closest.between.length();
        let (full, share) = match &self.layers {
            Some(layers) if (vertices[0].max(vertices[3]) as usize) < layers.rest.len() => {
                (layers.thickness, REPULSION)
            }
            _ => (rules.radius + rules.free(), SHARE),
        };
        if distance >= full || distance == 0.0 {
            return None;
        }
        let full = self.rest_distance(features, vertices, full);
        let target = distance + share * (full - distance);
        let normal = closest.between / distance;
        let ends = (0..4).map(|k| self.vertices.end[vertices[k] as usize] * closest.weights[k]);
        let gap = normal.dot(ends.sum());
        (distance < full && gap < target).then_some(target)
    }

    /// A distance, or that of two features of one cloth at rest if that is less (m).
    fn rest_distance(&self, features: Features, vertices: [u32; 4], distance: f64) -> f64 {
        let Some(layers) = &self.layers else {
            return distance;
        };
        let cloth = |i: u32| layers.cloth.get(i as usize);
        let own = cloth(vertices[0]);
        if own.is_none() || vertices.iter().any(|&i| cloth(i) != own) {
            return distance;
        }
        let rest = vertices.map(|i| layers.rest[i as usize]);
        let apart = features.closest(rest).between.length();
        distance.min(apart * (1.0 - LAYER_FLOOR))
    }

    /// Looks for particles that end a step below a plane: what is above at both ends always was.
    pub(super) fn against_planes(&self, particles: usize, first: bool, touches: &mut Vec<Touch>) {
        let Vertices { start, end, .. } = &self.vertices;
        for (vertex, normal, rules) in &self.planes {
            let k = *vertex as usize;
            for i in 0..particles {
                let began = normal.dot(start[i] - start[k]);
                let ends = normal.dot(end[i] - end[k]);
                let free = rules.free();
                let floor = if began > 0.0 {
                    rules.floor.min(KEPT * began)
                } else {
                    began
                };
                let tight = if began > 0.0 { TIGHT * floor } else { floor };
                let least = if self.tight { tight } else { floor } * (1.0 + BAND);
                let held = if began < free {
                    began + SHARE * (free - began)
                } else {
                    free
                };
                let target = if self.tight { CLEAR * tight } else { held };
                if ends >= if first && began < free { target } else { least } {
                    continue;
                }
                #[expect(clippy::cast_possible_truncation, reason = "particles have 32 bits")]
                touches.push(Touch {
                    vertices: [i as u32, *vertex, *vertex, *vertex],
                    weights: [1.0, -1.0, 0.0, 0.0],
                    normal: *normal,
                    target,
                    tight: CLEAR * tight,
                    friction: rules.friction,
                    ..Touch::default()
                });
            }
        }
    }
}

/// How much closer two features may come in a step at most (m).
fn relative_way(features: Features, start: &[DVec3; 4], end: &[DVec3; 4]) -> f64 {
    let common = end[3] - start[3];
    let way = |k: usize| (end[k] - start[k] - common).length_squared();
    let longest = |range: std::ops::Range<usize>| range.map(way).fold(0.0, f64::max).sqrt();
    let split = features.split();
    longest(0..split) + longest(split..4)
}

/// Box of an element's way (m).
fn swept(vertices: &Vertices, element: &Element) -> Aabb {
    let Vertices { start, end, .. } = vertices;
    let corners = element.corners.map(|i| i as usize);
    Aabb::around(corners.into_iter().flat_map(|i| [start[i], end[i]]))
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
