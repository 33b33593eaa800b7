//! A node of a hierarchy, and the single precision of its boxes.

use super::WIDE;
use crate::mesh::Aabb;
use glam::{BVec4A, Vec4};

/// A box in single precision, never smaller than the one it stands for.
///
/// Four numbers then fill one SSE2 register, and a node two cache lines: a query 5 mm from a body
/// takes 0.7 of the time. What is compared is a little larger than what was given, by
/// `ROUNDING`: an answer may be too many, never too few.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    pub(super) min: [f32; 3],
    pub(super) max: [f32; 3],
}

/// Boxes grow by this share of their coordinates: a quarter of a micrometre at 1 m. 2⁻²⁴ is lost in
/// the conversion and as much in the growth itself.
const ROUNDING: f32 = 1.0 / (1 << 22) as f32;

/// Coordinates (m) are cut off here, so that squares of distances don't overflow. Cutting never
/// parts what overlaps, and makes no distance larger.
const FARTHEST: f64 = 1e18;

/// Squares of distances are taken this much smaller: a sum of three squares of differences loses at
/// most 5 parts in 2²⁴.
const SHRINK: f32 = 1.0 - 1.0 / (1 << 20) as f32;

impl Bounds {
    /// The box of nothing.
    pub const EMPTY: Self = Self {
        min: [f32::INFINITY; 3],
        max: [f32::NEG_INFINITY; 3],
    };

    /// A box around another.
    #[inline]
    pub fn around(exact: &Aabb) -> Self {
        Self {
            min: exact.min.to_array().map(|x| round(x, -ROUNDING)),
            max: exact.max.to_array().map(|x| round(x, ROUNDING)),
        }
    }

    /// The smallest box around two.
    #[inline]
    #[must_use]
    pub fn union(&self, other: &Self) -> Self {
        Self {
            min: std::array::from_fn(|axis| self.min[axis].min(other.min[axis])),
            max: std::array::from_fn(|axis| self.max[axis].max(other.max[axis])),
        }
    }

    #[inline]
    pub(super) fn overlaps(&self, other: &Self) -> bool {
        (0..3).all(|axis| self.min[axis] <= other.max[axis] && other.min[axis] <= self.max[axis])
    }
}

/// A number that differs from `x` by about a share of it.
#[expect(
    clippy::cast_possible_truncation,
    reason = "the growth is larger than what is cut off"
)]
#[inline]
fn round(x: f64, share: f32) -> f32 {
    let x = x.clamp(-FARTHEST, FARTHEST) as f32;
    // The product of the smallest numbers would vanish.
    x + (x.abs() + f32::MIN_POSITIVE / ROUNDING) * share
}

/// A node or an item.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Child(u32);

impl Child {
    const ITEM: u32 = 1 << 31;
    /// Stands where there is no child; its box is empty.
    pub(super) const NONE: Self = Self(u32::MAX);
    pub(super) const ROOT: Self = Self(0);

    pub(super) fn item(item: u32) -> Self {
        Self(item | Self::ITEM)
    }

    #[expect(clippy::cast_possible_truncation, reason = "fewer nodes than items")]
    pub(super) fn node(node: usize) -> Self {
        Self(node as u32)
    }

    /// The item or the node.
    #[inline]
    pub(super) fn known(self) -> Result<u32, usize> {
        if self.0 & Self::ITEM == 0 {
            Err(self.0 as usize)
        } else {
            Ok(self.0 & !Self::ITEM)
        }
    }
}

/// Four boxes side by side, coordinate by coordinate: one pass of vector instructions compares all with another.
#[derive(Clone, Copy, Debug)]
pub struct FourBoxes {
    /// Smallest x, y, z of each (m).
    pub(super) min: [Vec4; 3],
    /// Largest x, y, z of each (m).
    pub(super) max: [Vec4; 3],
}

impl FourBoxes {
    /// Boxes of nothing, which overlap nothing.
    pub const EMPTY: Self = Self {
        min: [Vec4::INFINITY; 3],
        max: [Vec4::NEG_INFINITY; 3],
    };

    /// Replaces one of them.
    #[inline]
    pub fn set(&mut self, lane: usize, bounds: &Bounds) {
        for axis in 0..3 {
            self.min[axis][lane] = bounds.min[axis];
            self.max[axis][lane] = bounds.max[axis];
        }
    }

    /// One of them.
    #[inline]
    pub fn get(&self, lane: usize) -> Bounds {
        Bounds {
            min: self.min.map(|of| of[lane]),
            max: self.max.map(|of| of[lane]),
        }
    }

    /// The numbers of those that overlap a box.
    #[inline]
    pub fn overlapping(&self, bounds: &Bounds) -> Lanes {
        let mut overlap = BVec4A::TRUE;
        for axis in 0..3 {
            overlap &= self.min[axis].cmple(Vec4::splat(bounds.max[axis]));
            overlap &= self.max[axis].cmpge(Vec4::splat(bounds.min[axis]));
        }
        Lanes(overlap.bitmask())
    }

    /// The box around all four.
    #[inline]
    pub(super) fn around(&self) -> Bounds {
        Bounds {
            min: self.min.map(Vec4::min_element),
            max: self.max.map(Vec4::max_element),
        }
    }

    /// Lower bounds of the squared distances (m²) from a small box, infinite to a box of nothing.
    #[inline]
    pub(super) fn distances_squared(&self, from: &Bounds) -> [f32; WIDE] {
        let mut squared = Vec4::ZERO;
        for axis in 0..3 {
            let below = self.min[axis] - Vec4::splat(from.max[axis]);
            let above = Vec4::splat(from.min[axis]) - self.max[axis];
            // In this order NaN stays NaN, and a point that is none finds nothing.
            let outside = Vec4::ZERO.max(below.max(above));
            squared += outside * outside;
        }
        (squared * SHRINK).to_array()
    }
}

/// The children of a node and their boxes, of nothing where there is no child.
#[derive(Clone, Copy, Debug)]
pub(super) struct Node {
    pub(super) boxes: FourBoxes,
    pub(super) children: [Child; WIDE],
    /// The bits of those in which the last refit changed anything.
    pub(super) changed: u32,
}

impl Node {
    pub(super) const EMPTY: Self = Self {
        boxes: FourBoxes::EMPTY,
        children: [Child::NONE; WIDE],
        changed: 0,
    };
}

/// Numbers of boxes, the lowest first.
#[derive(Clone, Debug)]
pub struct Lanes(pub(super) u32);

impl Iterator for Lanes {
    type Item = usize;

    #[inline]
    fn next(&mut self) -> Option<usize> {
        let lane = self.0.trailing_zeros();
        self.0 &= self.0.wrapping_sub(1);
        (lane < u32::BITS).then_some(lane as usize)
    }
}
