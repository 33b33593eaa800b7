//! A bounding volume hierarchy over a list of boxes.
//!
//! Nodes have four children whose boxes stand side by side, coordinate by coordinate, so that one
//! pass of vector instructions compares all four. A child is a node or one item of the list. The
//! shape of the tree is found once, by the surface area heuristic; boxes that move later are
//! [refitted](Bvh::refit) into it. The same boxes give the same tree and the same order of answers.
//!
//! Boxes must not hold NaN: such an item would never be found.

mod build;
mod pairs;

#[cfg(test)]
mod tests;

use super::Aabb;
use glam::DVec3;

/// Children of a node. Four are two SSE2 registers a coordinate.
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
    parts: Vec<Slot>,
    /// Number of items.
    items: usize,
}

/// A node or an item.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Child(u32);

impl Child {
    const ITEM: u32 = 1 << 31;
    /// Stands where there is no child; its box is empty.
    const NONE: Self = Self(u32::MAX);
    const ROOT: Self = Self(0);

    fn item(item: u32) -> Self {
        Self(item | Self::ITEM)
    }

    /// The item or the node.
    fn known(self) -> Result<u32, usize> {
        if self.0 & Self::ITEM == 0 {
            Err(self.0 as usize)
        } else {
            Ok(self.0 & !Self::ITEM)
        }
    }
}

/// A child's place.
#[derive(Clone, Copy, Debug)]
struct Slot {
    node: usize,
    lane: usize,
}

/// The children of a node and their boxes.
#[derive(Clone, Copy, Debug)]
struct Node {
    /// Smallest x, y, z of each child (m).
    min: [[f64; WIDE]; 3],
    /// Largest x, y, z of each child (m).
    max: [[f64; WIDE]; 3],
    children: [Child; WIDE],
}

impl Node {
    const EMPTY: Self = Self {
        min: [[f64::INFINITY; WIDE]; 3],
        max: [[f64::NEG_INFINITY; WIDE]; 3],
        children: [Child::NONE; WIDE],
    };

    fn set(&mut self, lane: usize, bounds: Aabb) {
        for axis in 0..3 {
            self.min[axis][lane] = bounds.min[axis];
            self.max[axis][lane] = bounds.max[axis];
        }
    }

    fn get(&self, lane: usize) -> Aabb {
        let of =
            |side: &[[f64; WIDE]; 3]| DVec3::from_array([0, 1, 2].map(|axis| side[axis][lane]));
        Aabb {
            min: of(&self.min),
            max: of(&self.max),
        }
    }

    /// The box around all children.
    fn bounds(&self) -> Aabb {
        (0..WIDE).fold(Aabb::EMPTY, |whole, lane| whole.union(self.get(lane)))
    }

    /// Which children overlap a box.
    fn overlaps(&self, bounds: &Aabb) -> [bool; WIDE] {
        // An unbounded box overlaps even the empty one of a missing child.
        let mut overlaps = self.children.map(|child| child != Child::NONE);
        for axis in 0..3 {
            let (low, high) = (bounds.min[axis], bounds.max[axis]);
            for lane in 0..WIDE {
                overlaps[lane] &= self.min[axis][lane] <= high;
                overlaps[lane] &= low <= self.max[axis][lane];
            }
        }
        overlaps
    }

    /// Squares of a point's distances from the children's boxes (m²), infinite where there is none.
    fn distances_squared(&self, p: DVec3) -> [f64; WIDE] {
        let mut squared = [0.0; WIDE];
        for axis in 0..3 {
            for lane in 0..WIDE {
                let below = self.min[axis][lane] - p[axis];
                let above = p[axis] - self.max[axis][lane];
                // Not `f64::max`, whose care for NaN takes four instructions more.
                let outside = if below > above { below } else { above };
                let outside = if outside > 0.0 { outside } else { 0.0 };
                squared[lane] += outside * outside;
            }
        }
        squared
    }
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
        size_of_val(&self.nodes[..]) + size_of_val(&self.parts[..])
    }

    /// Takes over new boxes of the same items. The tree keeps its shape: answers stay right however
    /// the items move, and get slower when neighbours part.
    ///
    /// # Panics
    ///
    /// When the number of boxes is another.
    pub fn refit(&mut self, boxes: &[Aabb]) {
        assert_eq!(boxes.len(), self.items, "refit takes a box for each item");
        for node in (0..self.nodes.len()).rev() {
            let mut here = self.nodes[node];
            for lane in 0..WIDE {
                if here.children[lane] != Child::NONE {
                    here.set(
                        lane,
                        match here.children[lane].known() {
                            Ok(item) => boxes[item as usize],
                            Err(child) => self.nodes[child].bounds(),
                        },
                    );
                }
            }
            self.nodes[node] = here;
        }
    }

    /// The box around all items.
    pub fn bounds(&self) -> Aabb {
        self.nodes[0].bounds()
    }

    /// Calls `found` with every item whose box overlaps `bounds`.
    pub fn overlapping(&self, bounds: &Aabb, mut found: impl FnMut(u32)) {
        let mut waiting = [0; WAITING];
        let mut count = 1;
        while count > 0 {
            count -= 1;
            let node = &self.nodes[waiting[count]];
            let overlaps = node.overlaps(bounds);
            for lane in 0..WIDE {
                if overlaps[lane] {
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
    }

    /// Looks for the item nearest to a point: calls `measure` with items whose boxes are closer than
    /// a bound, the closer child first, and takes the bound that it returns for the next.
    ///
    /// The bound begins at `reach_squared`; both are squares of distances (m²). `measure` gets the
    /// bound and returns the square of its item's distance if that is less, else the bound.
    pub fn nearest(&self, p: DVec3, reach_squared: f64, mut measure: impl FnMut(u32, f64) -> f64) {
        let mut bound = reach_squared;
        let mut waiting = [(0, Child::ROOT); WAITING];
        let mut count = 1;
        while count > 0 {
            count -= 1;
            let (key, child) = waiting[count];
            if squared(key) >= bound {
                continue;
            }
            match child.known() {
                Ok(item) => bound = measure(item, bound),
                Err(node) => {
                    let node = &self.nodes[node];
                    for key in sorted(keys(node.distances_squared(p))) {
                        if squared(key) < bound {
                            waiting[count] = (key, node.children[lane(key)]);
                            count += 1;
                        }
                    }
                }
            }
        }
    }
}

/// Squared distances as whole numbers in the same order, with their lanes in the two lowest bits:
/// cut off, those make a bound smaller by a part in 2⁵⁰, never larger.
fn keys(squared: [f64; WIDE]) -> [u64; WIDE] {
    let mut keys = squared.map(|squared| squared.to_bits() & !3);
    for lane in 0..WIDE {
        keys[lane] |= lane as u64;
    }
    keys
}

fn squared(key: u64) -> f64 {
    f64::from_bits(key & !3)
}

fn lane(key: u64) -> usize {
    (key & 3) as usize
}

/// The largest first, by Batcher's network of five comparisons.
fn sorted([a, b, c, d]: [u64; WIDE]) -> [u64; WIDE] {
    let (a, b) = (a.max(b), a.min(b));
    let (c, d) = (c.max(d), c.min(d));
    let (a, c) = (a.max(c), a.min(c));
    let (b, d) = (b.max(d), b.min(d));
    [a, b.max(c), b.min(c), d]
}
