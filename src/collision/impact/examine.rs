//! What two features come to in a step: nothing, a touch to be held, or a meeting.

use super::ground::{Ground, Plane, Rules};
use super::solid::LAYER_FLOOR;
use super::touch::{Touch, Vertices};
use super::{Closest, Features, meeting};
use glam::DVec3;

/// The gap of a pair at the step's start may shrink to this share of it, where it is smaller than the
/// floor.
const KEPT: f64 = 0.6;

/// Width of the band in which detection stops, as a share of the separation.
pub(super) const BAND: f64 = 0.25;

/// Gap after an impact, in floors: outside of the band of detection.
pub(super) const CLEAR: f64 = 1.5;

/// Share of all floors that is left where there is no room for more, as between two bodies that close.
pub(super) const TIGHT: f64 = 0.1;

/// Share of a missing gap that a step brings back: a floor of 0.3 mm in 10 steps to 6 %.
const SHARE: f64 = 0.25;

/// Share of what lacks to the thickness by which layers are moved apart in a step (Bridson, Fedkiw and
/// Anderson 2002).
const REPULSION: f64 = 0.1;

/// Two features and the ways of their vertices.
struct Pair {
    features: Features,
    vertices: [u32; 4],
    start: [DVec3; 4],
    end: [DVec3; 4],
}

/// What is known of two features of layers.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Examined {
    /// How much the ends of their ways may change together before they can meet (m); not positive where any change
    /// counts.
    pub(super) slack: f64,
    /// Unit vector from the second to the first at the step's start.
    pub(super) normal: DVec3,
    pub(super) touch: Option<Touch>,
}

impl Ground {
    /// Gap of two features at the step's start (m), and what they come to.
    pub(super) fn examine(
        &self,
        features: Features,
        vertices: [u32; 4],
        rules: &Rules,
        first: bool,
    ) -> (f64, Option<Touch>) {
        if vertices.iter().any(|&i| self.is_exempt(i)) {
            return (f64::NEG_INFINITY, None);
        }
        let start = of(&self.vertices.start, vertices);
        let end = of(&self.vertices.end, vertices);
        let way = relative_way(features, &start, &end);
        let apart = boxes_apart(features, &start) - rules.radius;
        if apart > self.reach(rules) + way {
            return (apart, None);
        }
        let zone = vertices.map(|i| self.zone[i as usize]);
        if zone[0].is_some() && zone.iter().all(|other| *other == zone[0]) {
            return (f64::MAX, None); // an affine map keeps apart what is apart, however close
        }
        let pair = Pair {
            features,
            vertices,
            start,
            end,
        };
        let closest = features.closest(start);
        let distance = closest.between.length();
        let far = distance > rules.radius + (1.0 + BAND) * rules.floor + way;
        let touch = self.come_to(&pair, &closest, rules, first, far);
        (distance - rules.radius, touch)
    }

    /// What two features of layers come to that are near each other.
    pub(super) fn examine_layers(
        &self,
        features: Features,
        vertices: [u32; 4],
        first: bool,
    ) -> Examined {
        let zone = self.zone[vertices[0] as usize];
        let rigid = zone.is_some() && vertices.iter().all(|&i| self.zone[i as usize] == zone);
        if rigid || vertices.iter().any(|&i| self.is_exempt(i)) {
            return Examined::default(); // an affine map keeps apart what is apart, however close
        }
        let start = of(&self.vertices.start, vertices);
        let end = of(&self.vertices.end, vertices);
        let pair = Pair {
            features,
            vertices,
            start,
            end,
        };
        let rules = &self.rules[0];
        let closest = features.closest(start);
        let normal = closest.between.normalize_or_zero();
        let gap = |x| gap_along(features, x, normal);
        let slack = gap(&start).min(gap(&end)) - (1.0 + BAND) * rules.floor;
        let far = slack > 0.0;
        let pushed = first && closest.between.length_squared() < self.reach(rules).powi(2);
        let touch = if far && !pushed {
            None
        } else {
            self.come_to(&pair, &closest, rules, first, far)
        };
        Examined {
            slack,
            normal,
            touch,
        }
    }

    /// What two features come to with given closest points at the step's start, where they don't meet if they keep
    /// `far` on their way.
    fn come_to(
        &self,
        pair: &Pair,
        closest: &Closest,
        rules: &Rules,
        first: bool,
        far: bool,
    ) -> Option<Touch> {
        let &Pair {
            features,
            vertices,
            start,
            end,
        } = pair;
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
        let mut touch = Touch {
            vertices,
            tight: base + CLEAR * least,
            friction: rules.friction,
            ..Touch::default()
        };
        let met = if far {
            None
        } else {
            meeting(features, start, end, base + separation, band)
        };
        if let Some(met) = met {
            let free = rules.radius + rules.free();
            let full = self.rest_distance(features, vertices, free);
            let restored = distance + SHARE * (full - distance).max(0.0);
            touch.target = if self.tight {
                touch.tight
            } else {
                restored.min(full)
            };
            touch.meets = true;
            (touch.weights, touch.normal) = (met.weights, met.normal);
        } else if first && let Some(target) = self.pushed(pair, closest, rules) {
            touch.target = target;
            (touch.weights, touch.normal) = (closest.weights, closest.between / distance);
        } else {
            return None;
        }
        touch.weigh(&self.vertices);
        Some(touch)
    }

    /// Gap from which on features need nothing (m).
    pub(super) fn reach(&self, rules: &Rules) -> f64 {
        let thickness = self.layers.as_ref().map_or(0.0, |layers| layers.thickness);
        rules.free().max(thickness)
    }

    /// The gap (m) that two features which don't meet should end the step with, if that is more than they will have
    /// and they are closer than they should be.
    fn pushed(&self, pair: &Pair, closest: &Closest, rules: &Rules) -> Option<f64> {
        let &Pair {
            features,
            vertices,
            ref end,
            ..
        } = pair;
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
        if self.is_pushed_as_vertex(features, vertices, closest) {
            return None;
        }
        let normal = closest.between / distance;
        let ends = (0..4).map(|k| end[k] * closest.weights[k]);
        let gap = normal.dot(ends.sum());
        if gap >= distance + share * (full - distance) {
            return None; // whatever the features' distance at rest
        }
        let full = self.rest_distance(features, vertices, full);
        let target = distance + share * (full - distance);
        (distance < full && gap < target).then_some(target)
    }

    /// Whether two features are edges whose closest point is an end, which is pushed as a vertex.
    pub(super) fn is_pushed_as_vertex(
        &self,
        features: Features,
        vertices: [u32; 4],
        closest: &Closest,
    ) -> bool {
        let at_end = closest.weights.contains(&0.0);
        features == Features::EdgeEdge && at_end && vertices.iter().all(|&i| self.faced[i as usize])
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
        let rest = of(&layers.rest, vertices);
        if boxes_apart(features, &rest) * (1.0 - LAYER_FLOOR) >= distance {
            return distance;
        }
        let apart = features.closest(rest).between.length();
        distance.min(apart * (1.0 - LAYER_FLOOR))
    }

    /// Looks for particles that end a step below a plane: what is above at both ends always was.
    pub(super) fn against_planes(&self, particles: usize, first: bool, touches: &mut Vec<Touch>) {
        let Vertices { start, end, .. } = &self.vertices;
        for Plane {
            solid,
            vertex,
            normal,
        } in &self.planes
        {
            let (k, rules) = (*vertex as usize, &self.rules[*solid]);
            for i in 0..particles {
                #[expect(clippy::cast_possible_truncation, reason = "particles have 32 bits")]
                if self.is_exempt(i as u32) {
                    continue;
                }
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
                let mut touch = Touch {
                    vertices: [i as u32, *vertex, *vertex, *vertex],
                    weights: [1.0, -1.0, 0.0, 0.0],
                    normal: *normal,
                    target,
                    tight: CLEAR * tight,
                    meets: ends < least,
                    friction: rules.friction,
                    ..Touch::default()
                };
                touch.weigh(&self.vertices);
                touches.push(touch);
            }
        }
    }
}

/// Gap of two features along a direction of length 1 (m); they are at least as far apart.
#[inline]
pub(super) fn gap_along(features: Features, x: &[DVec3; 4], direction: DVec3) -> f64 {
    let [a, b, c, d] = places(x, direction);
    match features {
        Features::VertexFace => a - b.max(c).max(d),
        Features::EdgeEdge => a.min(b) - c.max(d),
    }
}

/// Places of four vertices along a direction, from the first one's.
#[inline]
fn places([a, b, c, d]: &[DVec3; 4], direction: DVec3) -> [f64; 4] {
    let place = |x: &DVec3| direction.dot(*x - *a);
    [0.0, place(b), place(c), place(d)]
}

/// How much closer two features may come in a step at most (m).
fn relative_way(features: Features, start: &[DVec3; 4], end: &[DVec3; 4]) -> f64 {
    let common = end[3] - start[3];
    let way = |k: usize| (end[k] - start[k] - common).length_squared();
    match features {
        Features::VertexFace => way(0).sqrt() + way(1).max(way(2)).sqrt(),
        Features::EdgeEdge => way(0).max(way(1)).sqrt() + way(2).sqrt(),
    }
}

/// Distance of the features' boxes (m).
fn boxes_apart(features: Features, x: &[DVec3; 4]) -> f64 {
    let [a, b, c, d] = *x;
    let ((low, high), (other_low, other_high)) = match features {
        Features::VertexFace => ((a, a), (b.min(c).min(d), b.max(c).max(d))),
        Features::EdgeEdge => ((a.min(b), a.max(b)), (c.min(d), c.max(d))),
    };
    (low - other_high)
        .max(other_low - high)
        .max(DVec3::ZERO)
        .length()
}

/// Four entries of a list: an array's `map` wasn't made one with the loop, and took a tenth of the search.
#[inline]
pub(super) fn of<T: Copy>(list: &[T], [a, b, c, d]: [u32; 4]) -> [T; 4] {
    [
        list[a as usize],
        list[b as usize],
        list[c as usize],
        list[d as usize],
    ]
}
