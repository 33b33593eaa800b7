//! A bounding volume hierarchy over a list of boxes.
//!
//! Nodes have four children whose boxes stand side by side, coordinate by coordinate, so that one
//! pass of vector instructions compares all four. A child is a node or one item of the list. The
//! shape of the tree is found once, by the surface area heuristic; boxes that move later are
//! [refitted](Bvh::refit) into it. The same boxes give the same tree and the same order of answers.
//!
//! Boxes must not hold NaN: such an item would never be found.

mod build;
mod drift;
mod node;
mod pairs;
mod refit;

#[cfg(test)]
mod tests;

pub use drift::Drift;
pub use node::{Bounds, FourBoxes, Lanes};

use super::Aabb;
use glam::DVec3;
use node::{Child, Node};
use std::ops::Range;

/// Children of a node: as many as numbers in a vector register.
const WIDE: usize = 4;

/// Levels of a tree at most: [`build`] splits in halves from the 24th on, and 2³² items are halved
/// away in 16 more, four at a time.
const DEEPEST: usize = 40;

/// Children that wait on the way down: all but one of each level, and the last.
const WAITING: usize = (WIDE - 1) * DEEPEST + 1;

/// A bounding volume hierarchy over a list of boxes.
#[derive(Clone, Debug)]
pub struct Bvh {
    /// Parents before their children; the first is the root. Never empty.
    nodes: Vec<Node>,
    /// Where the subtrees hang that the tree falls into without its top.
    parts: Vec<Part>,
    /// The nodes above, in their order.
    top: Vec<usize>,
    /// Number of items.
    items: usize,
}

/// A subtree or an item.
#[derive(Clone, Debug)]
struct Part {
    /// The node above it.
    node: usize,
    /// Which child of that it is.
    lane: usize,
    /// Its own nodes.
    below: Range<usize>,
}

impl Bvh {
    /// The hierarchy of a list of fewer than 2³¹ boxes.
    ///
    /// # Panics
    ///
    /// With more boxes than that.
    pub fn new(boxes: &[Aabb]) -> Self {
        build::build(boxes)
    }

    /// Number of items.
    pub fn len(&self) -> usize {
        self.items
    }

    /// Whether there is no item.
    pub fn is_empty(&self) -> bool {
        self.items == 0
    }

    /// Its size (B).
    pub fn bytes(&self) -> usize {
        size_of_val(&self.nodes[..]) + size_of_val(&self.parts[..]) + size_of_val(&self.top[..])
    }

    /// Takes over new boxes of the same items, see [`Bvh::refit_with`].
    ///
    /// # Panics
    ///
    /// When the number of boxes is another.
    pub fn refit(&mut self, boxes: &[Aabb]) {
        assert_eq!(boxes.len(), self.items, "refit takes a box for each item");
        self.refit_with(|item| boxes[item as usize]);
    }

    /// Calls `found` with every item whose box overlaps `bounds`, and maybe some that come within a
    /// quarter of a millionth of their coordinates.
    pub fn overlapping(&self, bounds: &Aabb, mut found: impl FnMut(u32)) {
        let bounds = Bounds::around(bounds);
        let mut waiting = [0; WAITING];
        let mut count = 1;
        while count > 0 {
            count -= 1;
            let node = &self.nodes[waiting[count]];
            for lane in node.boxes.overlapping(&bounds) {
                match node.children[lane].known() {
                    Ok(item) => found(item),
                    Err(child) => {
                        waiting[count] = child;
                        count += 1;
                    }
                }
            }
        }
    }

    /// Looks for the item nearest to a point: calls `measure` with items whose boxes are closer than
    /// a bound, the closer child first, and takes the bound that it returns for the next.
    ///
    /// The bound begins at `reach_squared`; both are squares of distances (m²). `measure` gets the
    /// bound and returns the square of its item's distance if that is less, else the bound.
    pub fn nearest(&self, p: DVec3, reach_squared: f64, mut measure: impl FnMut(u32, f64) -> f64) {
        let from = Bounds::around(&Aabb { min: p, max: p });
        let mut bound = reach_squared;
        let mut limit = limit_of(bound);
        let mut waiting = [(0, Child::ROOT); WAITING];
        let mut count = 1;
        while count > 0 {
            count -= 1;
            let (key, child) = waiting[count];
            if key >= limit {
                continue;
            }
            match child.known() {
                Ok(item) => {
                    bound = measure(item, bound);
                    limit = limit_of(bound);
                }
                Err(node) => {
                    let node = &self.nodes[node];
                    // The next is written over one that is too far: no branch to guess.
                    for key in sorted(keys(node.boxes.distances_squared(&from))) {
                        waiting[count] = (key, node.children[(key & 3) as usize]);
                        count += usize::from(key < limit);
                    }
                }
            }
        }
    }
}

/// Squared distances as whole numbers in the same order, with their lanes in the two lowest bits:
/// cut off, those make a bound smaller by a part in 2²¹, never larger.
#[inline]
fn keys(squared: [f32; WIDE]) -> [u32; WIDE] {
    let mut keys = squared.map(|squared| squared.to_bits() & !3);
    for (key, lane) in keys.iter_mut().zip(0..) {
        *key |= lane;
    }
    keys
}

/// A key that those of all smaller squares are below; at most that of a missing child.
#[expect(clippy::cast_possible_truncation, reason = "4 is more than it loses")]
fn limit_of(bound: f64) -> u32 {
    ((bound as f32).to_bits() + 4).min(f32::INFINITY.to_bits())
}

/// The largest first, by Batcher's network of five comparisons.
#[inline]
fn sorted([a, b, c, d]: [u32; WIDE]) -> [u32; WIDE] {
    let (a, b) = (a.max(b), a.min(b));
    let (c, d) = (c.max(d), c.min(d));
    let (a, c) = (a.max(c), a.min(c));
    let (b, d) = (b.max(d), b.min(d));
    [a, b.max(c), b.min(c), d]
}
