//! Which features of layers are near each other: a list that is good for many steps.
//!
//! It holds every pair of features that were closer than [`NEAR`] when it was made (Verlet 1967, "neighbour list",
//! with exact distances). What isn't in it can meet only after its elements have moved far enough against each
//! other; these are looked for by a hierarchy of moves ([`Drift`]), in which what moves together is passed over,
//! however fast it is. Each pair keeps the direction that parted it last: as a rule it still does.

use super::examine::{BAND, gap_along, of};
use super::ground::Ground;
use super::prism::Prism;
use super::search::Found;
use super::solid::LAYER_FLOOR;
use super::touch::Vertices;
use super::watch::Watch;
use super::{Closest, Features};
use crate::mesh::{Aabb, Bounds, Bvh, Drift};
use crate::state::Archive;
use glam::{DVec3, Vec3, Vec4};
use rayon::prelude::*;

/// Distance below which features are listed, in thicknesses. All of `twist` takes 0.96 of the time of 1.6; with 1.25 more
/// drifts than a shorter list saves.
const NEAR: f64 = 1.35;

/// Distance at which features may meet, in thicknesses.
const NEEDED: f64 = (1.0 + BAND) * LAYER_FLOOR;

/// Change of the ends of ways within a step, in thicknesses, up to which what has drifted isn't looked for again. With 0.1
/// contact in `twist` takes 1.06 times as long.
const ROOM: f64 = 0.05;

/// Slack below which pairs are looked at in all rounds of a step, in thicknesses; others are passed over in blocks.
pub(super) const TIGHT: f64 = 0.25;

/// Steps after which the list is made anew. What has come near since then is held by impacts only, not pushed to the
/// thickness.
const OLDEST: u32 = 16;

/// Listed pairs that are passed over together in later rounds.
pub(super) const BLOCK: usize = 32;

/// Elements that a task fits at least: much longer than waking a thread.
const FEW: usize = 1024;

/// Edge–edge pairs have this bit in their first vertex.
const EDGES: u32 = 1 << 31;

/// Pairs that are only kept from meeting have this bit in their second vertex.
const KEPT: u32 = 1 << 31;

/// Two features that are near each other.
#[derive(Clone, Copy, Debug)]
pub(super) struct Near {
    /// Their vertices, [`EDGES`] and [`KEPT`].
    vertices: [u32; 4],
    /// A direction from the second to the first.
    pub(super) normal: Vec3,
    /// How much the ends of their ways may differ from the step's first, together, before they can meet (m).
    pub(super) slack: f32,
}

impl Near {
    fn new(features: Features, mut vertices: [u32; 4], closest: &Closest, pushed: bool) -> Self {
        if features == Features::EdgeEdge {
            vertices[0] |= EDGES;
        }
        if !pushed {
            vertices[1] |= KEPT;
        }
        Self {
            vertices,
            normal: closest.between.normalize_or_zero().as_vec3(),
            slack: 0.0,
        }
    }

    #[inline]
    pub(super) fn features(&self) -> (Features, [u32; 4]) {
        let [first, second, c, d] = self.vertices;
        let vertices = [first & !EDGES, second & !KEPT, c, d];
        if first & EDGES == 0 {
            (Features::VertexFace, vertices)
        } else {
            (Features::EdgeEdge, vertices)
        }
    }

    /// Whether it is pushed to the thickness. What an edge's end was nearest to when the list was made isn't: the end
    /// is pushed as a vertex. Not to look at these saves a quarter of a step's first look in a rope of folds.
    #[inline]
    pub(super) fn is_pushed(&self) -> bool {
        self.vertices[1] & KEPT == 0
    }
}

/// What one task keeps of a part of the cloths' hierarchy, and of later parts.
#[derive(Clone, Debug, Default)]
pub(super) struct Part {
    pub(super) near: Vec<Near>,
    /// Which of them have less slack than [`TIGHT`].
    pub(super) tight: Vec<u32>,
    /// The groups of vertices, see [`group`], that each [`BLOCK`] of the list has to do with.
    pub(super) groups: Vec<u128>,
    /// Elements between which pairs that aren't listed may meet.
    pub(super) drifted: Vec<[u32; 2]>,
}

/// The list of what is near, and what is needed to know how long it is good.
#[derive(Clone, Debug)]
pub(super) struct Neighbours {
    parts: Vec<Part>,
    /// Positions for which the list was made (m).
    places: Vec<DVec3>,
    /// Where each element is at the start and at the end of its way, with half of what two of them need and what isn't
    /// looked for again, and how far it has moved until then.
    at: [Bvh; 2],
    moves: [Bvh; 2],
    /// Steps since.
    age: u32,
    /// Pairs of elements that had drifted in the list's first step: its way alone.
    usual: usize,
    /// Those looked at since beyond that.
    extra: usize,
    /// Ends of the ways when the step was searched first (m).
    first_ends: Vec<DVec3>,
    /// How far each end is from there (m).
    changes: Vec<f32>,
    /// The same of each particle, as it was fitted last: where it is, and how far it has moved.
    fitted: [Vec<[Bounds; 2]>; 2],
    /// Ends of the ways then (m).
    fitted_ends: Vec<DVec3>,
    /// Particles that are to be fitted anew, or were the last time.
    refitted: Vec<bool>,
    /// Starts and ends of the ways in single precision, from [`origin`](Self::origin) on (m).
    ways: Vec<[Vec4; 2]>,
    /// What each element sweeps.
    prisms: Vec<Prism>,
    origin: DVec3,
    /// Rounding of a gap between them (m).
    rounding: f32,
}

impl Neighbours {
    pub(super) fn new(particles: usize) -> Self {
        Self {
            parts: Vec::new(),
            places: vec![DVec3::NAN; particles],
            at: [0, 1].map(|_| Bvh::new(&[])),
            moves: [0, 1].map(|_| Bvh::new(&[])),
            age: OLDEST,
            usual: 0,
            extra: 0,
            first_ends: vec![DVec3::NAN; particles],
            changes: vec![0.0; particles],
            fitted: [0, 1].map(|_| vec![[Bounds::EMPTY; 2]; particles]),
            fitted_ends: vec![DVec3::NAN; particles],
            refitted: vec![true; particles],
            ways: vec![[Vec4::ZERO; 2]; particles],
            prisms: Vec::new(),
            origin: DVec3::ZERO,
            rounding: 0.0,
        }
    }

    /// Brings the list up to date for a search, the first one of a step or a later one.
    pub(super) fn renew(&mut self, ground: &mut Ground, thickness: f64, first: bool) {
        if first {
            self.age += 1;
            if self.age > OLDEST {
                self.list(ground, thickness);
            }
            self.first_ends
                .copy_from_slice(&ground.vertices.end[..self.changes.len()]);
            self.changes.fill(0.0);
            self.refitted.fill(true);
            self.fit(ground, thickness, 0);
            self.fit(ground, thickness, 1);
            self.look_for_drifted(ground, thickness);
            self.weigh_drift();
        } else {
            let ways = ground.vertices.end.iter().zip(&self.first_ends);
            for (change, (end, first)) in self.changes.iter_mut().zip(ways) {
                *change = round_up((*end - *first).length());
            }
            let square = (ROOM * thickness).powi(2);
            let ways = ground.vertices.end.iter().zip(&self.fitted_ends);
            for (refitted, (end, fitted)) in self.refitted.iter_mut().zip(ways) {
                *refitted = end.distance_squared(*fitted) > square;
            }
            if self.refitted.contains(&true) {
                self.fit(ground, thickness, 1);
                self.look_for_drifted(ground, thickness);
            }
        }
    }

    /// Carries over where the list was made and how old it is.
    pub(super) fn carry(&mut self, ground: &mut Ground, thickness: f64, archive: &mut Archive) {
        archive.vectors(&mut self.places);
        archive.small(&mut self.age);
        archive.index(&mut self.usual);
        archive.index(&mut self.extra);
        if archive.unpacks() && self.age < OLDEST {
            self.list_places(ground, thickness);
        }
    }

    /// Makes the list for where the step begins.
    fn list(&mut self, ground: &mut Ground, thickness: f64) {
        self.age = 0;
        let particles = self.places.len();
        self.places
            .copy_from_slice(&ground.vertices.start[..particles]);
        self.list_places(ground, thickness);
    }

    /// Makes the list for some places.
    fn list_places(&mut self, ground: &mut Ground, thickness: f64) {
        let particles = self.places.len();
        self.origin = self.places.first().copied().unwrap_or_default();
        ground.fit_cloth(&self.places, 0.5 * NEAR * thickness);
        if self.moves[0].len() != ground.cloth.len() {
            self.at = [0, 1].map(|_| ground.cloth_tree.clone());
            self.moves = self.at.clone();
        }
        self.parts
            .resize(ground.cloth_tree.parts(), Part::default());
        let (ground, places) = (&*ground, &self.places);
        self.parts
            .par_iter_mut()
            .with_max_len(1)
            .enumerate()
            .for_each(|(number, part)| {
                part.near.clear();
                ground.cloth_tree.self_pairs(number, |one, other| {
                    let both = [one as usize, other as usize].map(|k| (k, &ground.cloth[k]));
                    ground.cloth_boxes.pairs(both, |features, vertices| {
                        let closest = near_points(features, &of(places, vertices), thickness);
                        if let Some(closest) = closest {
                            let pushed = !ground.is_pushed_as_vertex(features, vertices, &closest);
                            let near = Near::new(features, vertices, &closest, pushed);
                            part.near.push(near);
                        }
                    });
                });
                part.groups.clear();
                part.groups.extend(part.near.chunks(BLOCK).map(|block| {
                    let all = block.iter().flat_map(|near| near.features().1);
                    all.fold(0, |groups, i| groups | group(i as usize, particles))
                }));
            });
    }

    /// Fits the hierarchies of one end of the ways to the particles that are to be fitted anew.
    fn fit(&mut self, ground: &Ground, thickness: f64, time: usize) {
        let margin = (0.5 * NEEDED + ROOM) * thickness;
        let Vertices { start, end, .. } = &ground.vertices;
        let refitted = &self.refitted;
        let ways = [start, end][time].par_iter().zip(&self.places);
        let each = self.fitted[time].par_iter_mut().with_min_len(FEW);
        each.zip(ways)
            .zip(refitted)
            .for_each(|((fitted, (now, place)), refitted)| {
                if *refitted {
                    *fitted = [
                        Bounds::around(&Aabb::around([*now]).grown(margin)),
                        Bounds::around(&Aabb::around([*now - *place])),
                    ];
                }
            });
        if time == 1 {
            let ends = self.fitted_ends.iter_mut().zip(end).zip(refitted);
            ends.filter(|(_, refitted)| **refitted)
                .for_each(|((fitted, end), _)| *fitted = *end);
        }
        let fitted = &self.fitted[time];
        let trees = [&mut self.at[time], &mut self.moves[time]];
        for (which, tree) in trees.into_iter().enumerate() {
            tree.refit_changed(|item| {
                let element = &ground.cloth[item as usize];
                let [a, b, c] = element.corners.map(|i| &fitted[i as usize][which]);
                element.has_any(refitted).then(|| a.union(b).union(c))
            });
        }
    }

    /// Looks for elements that have moved so far against each other that what isn't listed may meet, among those that
    /// have been fitted anew.
    fn look_for_drifted(&mut self, ground: &Ground, thickness: f64) {
        let drift = Drift {
            at: self.at.each_ref(),
            moves: self.moves.each_ref(),
            most: round_down((NEAR - NEEDED - 2.0 * ROOM) * thickness),
        };
        let refitted = &self.refitted;
        let is_known = |element: u32| !ground.cloth[element as usize].has_any(refitted);
        self.parts
            .par_iter_mut()
            .with_max_len(1)
            .enumerate()
            .for_each(|(number, part)| {
                part.drifted
                    .retain(|pair| pair.iter().all(|&k| is_known(k)));
                drift.pairs(number, |one, other| part.drifted.push([one, other]));
            });
    }

    /// Counts what has drifted more than when the list was made: to look at a pair of elements takes about as long as
    /// to list a pair of features. When as many have been looked at as are listed, and two a particle for its neighbours in
    /// the cloth, a new list is cheaper.
    fn weigh_drift(&mut self) {
        let count = |length: fn(&Part) -> usize| self.parts.iter().map(length).sum::<usize>();
        let drifted = count(|part| part.drifted.len());
        if self.age == 0 {
            (self.usual, self.extra) = (drifted, 0);
        }
        self.extra += drifted.saturating_sub(self.usual);
        if self.extra > count(|part| part.near.len()) + 2 * self.places.len() {
            self.age = OLDEST;
        }
    }

    /// Takes over starts and ends in single precision.
    fn round(&mut self, vertices: &Vertices) {
        let origin = self.origin;
        let all = vertices.start.iter().zip(&vertices.end);
        let mut largest = 0.0_f32;
        for (way, (start, end)) in self.ways.iter_mut().zip(all) {
            *way = [start, end].map(|x| (*x - origin).as_vec3().extend(0.0));
            largest = largest.max((way[0].abs().max(way[1].abs())).max_element());
        }
        // Of three products and their sums, twice, and of the normal's length: 20 roundings of half of that.
        self.rounding = 16.0 * f32::EPSILON * largest;
    }

    /// Fits what the elements sweep to the ways, or to those that have changed.
    fn sweep(&mut self, ground: &Ground, first: bool) {
        let Self { prisms, ways, .. } = self;
        prisms.resize(ground.cloth.len(), Prism::NONE);
        let each = prisms.par_iter_mut().zip(&ground.cloth);
        each.with_min_len(FEW).for_each(|(prism, element)| {
            if first || ground.is_stale(element) {
                *prism = Prism::of(element, ways);
            }
        });
    }

    /// Number of tasks.
    pub(super) fn parts(&self) -> usize {
        self.parts.len()
    }

    /// Looks for meetings among what is near or has drifted.
    pub(super) fn search(
        &mut self,
        ground: &Ground,
        thickness: f64,
        first: bool,
        found: &mut [Found],
    ) {
        self.round(&ground.vertices);
        self.sweep(ground, first);
        let Self {
            parts,
            places,
            changes,
            ways,
            prisms,
            rounding,
            ..
        } = self;
        let band = NEEDED * thickness;
        let mut watch = Watch {
            ground,
            places,
            changes,
            ways,
            prisms,
            band: round_up(band) + *rounding,
            reach: round_up(thickness) + *rounding,
            thickness,
            tight: round_down(TIGHT * thickness),
            stale: 0,
            strayed: 0,
            first,
        };
        if !first {
            watch.group_changed();
        }
        let tasks = parts.par_iter_mut().zip(found).with_max_len(1);
        tasks.for_each(|(part, found)| {
            found.touches.clear();
            if first {
                watch.look_at_all(part, found);
            } else {
                watch.look_again(part, found);
            }
            watch.look_at_drifted(&part.drifted, found);
        });
    }
}

/// The bit of the group that a vertex of so many is in: 128 ranges of numbers.
pub(super) fn group(vertex: usize, count: usize) -> u128 {
    1 << (vertex * 128 / count)
}

/// A length (m) in single precision, a little less.
#[expect(clippy::cast_possible_truncation, reason = "rounded down")]
pub(super) fn round_down(length: f64) -> f32 {
    (length - 1e-6 * length.abs()) as f32
}

/// A length (m) in single precision, a little more.
#[expect(clippy::cast_possible_truncation, reason = "rounded up")]
pub(super) fn round_up(length: f64) -> f32 {
    (length * (1.0 + 1e-6)) as f32
}

/// The closest points of two features, if they are near each other.
#[inline]
pub(super) fn near_points(features: Features, x: &[DVec3; 4], thickness: f64) -> Option<Closest> {
    let [a, b, c, d] = *x;
    let reach_squared = (NEAR * thickness).powi(2);
    // Most are clearly apart along the line between their middles.
    let direction = match features {
        Features::VertexFace => a * 3.0 - b - c - d,
        Features::EdgeEdge => a + b - c - d,
    };
    let gap = gap_along(features, x, direction);
    if gap > 0.0 && gap * gap > reach_squared * direction.length_squared() {
        return None;
    }
    let closest = features.closest(*x);
    (closest.between.length_squared() < reach_squared).then_some(closest)
}
