//! Looking at what is near or has drifted: most pairs are told apart by the direction that parted them last.

use super::Features;
use super::element::pairs;
use super::examine::of;
use super::ground::Ground;
use super::near::{BLOCK, Near, Part, group, near_points, round_down};
use super::prism::{Prism, boxes_are_apart};
use super::search::Found;
use glam::{DVec3, Mat4, Vec3, Vec4};

/// What is needed to look at near features.
pub(super) struct Watch<'a> {
    pub(super) ground: &'a Ground,
    /// See [`Neighbours`](super::near::Neighbours).
    pub(super) places: &'a [DVec3],
    pub(super) changes: &'a [f32],
    pub(super) ways: &'a [[Vec4; 2]],
    pub(super) prisms: &'a [Prism],
    /// Gaps that are looked at closely: on the way, and at first at its beginning (m).
    pub(super) band: f32,
    pub(super) reach: f32,
    pub(super) thickness: f64,
    /// See [`TIGHT`](super::near::TIGHT) (m).
    pub(super) tight: f32,
    /// Groups of vertices whose ways have changed since the last search.
    pub(super) stale: u128,
    /// Groups of vertices with changes that may use up more than what is tight.
    pub(super) strayed: u128,
    pub(super) first: bool,
}

impl Watch<'_> {
    pub(super) fn group_changed(&mut self) {
        for (i, change) in self.changes.iter().enumerate() {
            let bit = group(i, self.changes.len());
            if 2.0 * change >= self.tight {
                self.strayed |= bit;
            }
            if self.ground.stale[i] {
                self.stale |= bit;
            }
        }
    }

    #[expect(clippy::cast_possible_truncation, reason = "numbers have 32 bits")]
    pub(super) fn look_at_all(&self, part: &mut Part, found: &mut Found) {
        part.tight.clear();
        for (k, near) in part.near.iter_mut().enumerate() {
            self.look(near, found);
            if near.slack < self.tight {
                part.tight.push(k as u32);
            }
        }
    }

    /// Looks at what is tight, and at blocks of which one vertex has changed and one changed much: in the list's order,
    /// whatever is tight. How much slack is known depends on the last directions, which a resumed run doesn't have.
    #[expect(clippy::cast_possible_truncation, reason = "numbers have 32 bits")]
    pub(super) fn look_again(&self, part: &mut Part, found: &mut Found) {
        let Part {
            near,
            tight,
            groups,
            ..
        } = part;
        let (known, mut next) = (tight.len(), 0);
        for (number, (block, groups)) in near.chunks_mut(BLOCK).zip(groups).enumerate() {
            let first = number * BLOCK;
            let whole = *groups & self.strayed != 0 && *groups & self.stale != 0;
            if !whole {
                while next < known && (tight[next] as usize) < first + block.len() {
                    self.look(&mut block[tight[next] as usize - first], found);
                    next += 1;
                }
                continue;
            }
            for (k, near) in (first..).zip(block) {
                let is_tight = next < known && tight[next] as usize == k;
                next += usize::from(is_tight);
                self.look(near, found);
                if !is_tight && near.slack < self.tight {
                    tight.push(k as u32);
                }
            }
        }
        tight.sort_unstable();
    }

    /// Looks whether two features that are near each other meet.
    #[inline]
    fn look(&self, near: &mut Near, found: &mut Found) {
        let (features, vertices) = near.features();
        let mut changed = 0.0;
        if !self.first {
            let [a, b, c, d] = of(self.changes, vertices);
            changed = match features {
                Features::VertexFace => a + b.max(c).max(d),
                Features::EdgeEdge => a.max(b) + c.max(d),
            };
            if changed < near.slack || !self.ground.is_any_stale(vertices) {
                return;
            }
        }
        let [began, ends] = self.gaps(features, vertices, near.normal);
        let slack = began.min(ends) - self.band;
        let pushed = self.first && near.is_pushed();
        if slack > 0.0 && !(pushed && began < self.reach) {
            near.slack = slack - changed;
            return;
        }
        // Whether it is examined depends on the last direction, what comes of it must not: a resumed run has others.
        let examined = self.ground.examine_layers(features, vertices, pushed);
        near.normal = examined.normal.as_vec3();
        near.slack = round_down(examined.slack) - changed;
        found.touches.extend(examined.touch);
    }

    /// Gaps of two features along a direction of length 1, at the start and at the end of their ways (m).
    #[inline]
    fn gaps(&self, features: Features, vertices: [u32; 4], normal: Vec3) -> [f32; 2] {
        let [a, b, c, d] = of(self.ways, vertices);
        let gap = |time: usize| {
            let heights = heights([a[time], b[time], c[time], d[time]], normal);
            let [a, b, c, d] = heights.to_array();
            match features {
                Features::VertexFace => a - b.max(c).max(d),
                Features::EdgeEdge => a.min(b) - c.max(d),
            }
        };
        [gap(0), gap(1)]
    }

    /// Looks whether features that aren't listed meet. They aren't pushed: most are listed soon.
    pub(super) fn look_at_drifted(&self, drifted: &[[u32; 2]], found: &mut Found) {
        for both in drifted {
            let [one, other] = both.map(|k| &self.ground.cloth[k as usize]);
            if !self.first && !self.ground.is_stale(one) && !self.ground.is_stale(other) {
                continue;
            }
            let [prism, other_prism] = both.map(|k| &self.prisms[k as usize]);
            if !one.adjoins(other) && prism.are_apart(other_prism, self.band) {
                continue;
            }
            pairs(one, other, false, |features, vertices| {
                let (mine, yours) = vertices.split_at(features.split());
                let apart = mine.iter().all(|i| !yours.contains(i));
                if apart
                    && (self.first || self.ground.is_any_stale(vertices))
                    && !self.boxes_are_apart(features, vertices, self.band)
                    && !self.are_parted(features, vertices, self.band)
                    && near_points(features, &of(self.places, vertices), self.thickness).is_none()
                {
                    let examined = self.ground.examine_layers(features, vertices, false);
                    found.touches.extend(examined.touch);
                }
            });
        }
    }

    /// Whether two features keep a gap (m) along the line between their middles, or across both.
    #[inline]
    fn are_parted(&self, features: Features, vertices: [u32; 4], gap: f32) -> bool {
        let keep = |direction: Vec3| {
            let [began, ends] = self.gaps(features, vertices, direction);
            began.min(ends) > gap
        };
        let [a, b, c, d] = of(self.ways, vertices).map(|[start, end]| (start + end).truncate());
        let (between, across) = match features {
            Features::VertexFace => (a * 3.0 - b - c - d, (c - b).cross(d - b)),
            Features::EdgeEdge => (a + b - c - d, (b - a).cross(d - c)),
        };
        keep(between.normalize_or_zero())
            || keep(across.normalize_or_zero() * between.dot(across).signum())
    }

    /// Whether the boxes of two features keep a gap (m) along an axis, on the same side at both ends of their ways.
    #[inline]
    fn boxes_are_apart(&self, features: Features, vertices: [u32; 4], gap: f32) -> bool {
        let [a, b, c, d] = of(self.ways, vertices);
        let boxes = |time: usize| {
            let (a, b, c, d) = (a[time], b[time], c[time], d[time]);
            match features {
                Features::VertexFace => ([a, a], [b.min(c).min(d), b.max(c).max(d)]),
                Features::EdgeEdge => ([a.min(b), a.max(b)], [c.min(d), c.max(d)]),
            }
        };
        let (start, end) = (boxes(0), boxes(1));
        boxes_are_apart([start.0, end.0], [start.1, end.1], gap)
    }
}

/// Heights of four points along a direction.
#[inline]
fn heights([a, b, c, d]: [Vec4; 4], direction: Vec3) -> Vec4 {
    let all = Mat4::from_cols(a, b, c, d).transpose();
    all.x_axis * direction.x + all.y_axis * direction.y + all.z_axis * direction.z
}
