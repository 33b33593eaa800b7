//! Looking at what is near or has drifted: most pairs are told apart by the direction that parted them last.

use super::Features;
use super::element::pairs;
use super::examine::of;
use super::ground::Ground;
use super::near::{BLOCK, Near, Part, between, group, round_down};
use super::search::Found;
use glam::{DVec3, Mat4, Vec3, Vec4};

/// What is needed to look at near features.
pub(super) struct Watch<'a> {
    pub(super) ground: &'a Ground,
    /// See [`Neighbours`](super::near::Neighbours).
    pub(super) places: &'a [DVec3],
    pub(super) changes: &'a [f32],
    pub(super) ways: &'a [[Vec4; 2]],
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

    /// Looks at what is tight, and at others of which one vertex has changed and one changed much.
    #[expect(clippy::cast_possible_truncation, reason = "numbers have 32 bits")]
    pub(super) fn look_again(&self, part: &mut Part, found: &mut Found) {
        for &k in &part.tight {
            self.look(&mut part.near[k as usize], found);
        }
        let blocks = part.near.chunks_mut(BLOCK).zip(&part.groups).enumerate();
        for (number, (block, groups)) in blocks {
            if groups & self.strayed == 0 || groups & self.stale == 0 {
                continue;
            }
            for (k, near) in block.iter_mut().enumerate() {
                if near.slack >= self.tight {
                    self.look(near, found);
                    if near.slack < self.tight {
                        part.tight.push((number * BLOCK + k) as u32);
                    }
                }
            }
        }
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
        if slack > 0.0 && !(self.first && began < self.reach) {
            near.slack = slack - changed;
            return;
        }
        let examined = self.ground.examine_layers(features, vertices, self.first);
        near.normal = examined.normal.as_vec3();
        near.slack = round_down(examined.slack) - changed;
        found.touches.extend(examined.touch);
    }

    /// Gaps of two features along a direction of length 1, at the start and at the end of their ways (m).
    #[inline]
    fn gaps(&self, features: Features, vertices: [u32; 4], normal: Vec3) -> [f32; 2] {
        let [a, b, c, d] = of(self.ways, vertices);
        let gap = |a: Vec4, b: Vec4, c: Vec4, d: Vec4| {
            let all = Mat4::from_cols(a, b, c, d).transpose();
            let along = all.x_axis * normal.x + all.y_axis * normal.y + all.z_axis * normal.z;
            let [a, b, c, d] = along.to_array();
            match features {
                Features::VertexFace => a - b.max(c).max(d),
                Features::EdgeEdge => a.min(b) - c.max(d),
            }
        };
        [gap(a[0], b[0], c[0], d[0]), gap(a[1], b[1], c[1], d[1])]
    }

    /// Looks whether features that aren't listed meet.
    pub(super) fn look_at_drifted(&self, drifted: &[[u32; 2]], found: &mut Found) {
        let enough = f64::from(if self.first { self.reach } else { self.band });
        for both in drifted {
            let [one, other] = both.map(|k| &self.ground.cloth[k as usize]);
            if self.ground.apart(one, other) > enough {
                continue;
            }
            pairs(one, other, false, |features, vertices| {
                let (mine, yours) = vertices.split_at(features.split());
                let apart = mine.iter().all(|i| !yours.contains(i));
                if apart && (self.first || self.ground.is_any_stale(vertices)) {
                    let examined = self.ground.examine_layers(features, vertices, self.first);
                    let listed =
                        || between(features, &of(self.places, vertices), self.thickness).is_some();
                    found.touches.extend(examined.touch.filter(|_| !listed()));
                }
            });
        }
    }
}
