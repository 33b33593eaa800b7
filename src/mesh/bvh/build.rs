//! The shape of a hierarchy: binned surface area heuristic, from the root down.
//!
//! A box is met by a query about as often as its surface is large, so a range of items is split
//! where Σ (half area × items) of both sides is smallest, at one of fifteen places along one axis.
//!
//! Sources: Goldsmith and Salmon 1987 (heuristic); Wald 2007 (bins).

use super::node::{Bounds, Child, Node};
use super::{Bvh, Part, WIDE};
use crate::mesh::Aabb;
use glam::DVec3;
use std::ops::Range;

/// Places along an axis that are told apart.
const BINS: usize = 16;

/// From this level on ranges are halved by number, which bounds the depth.
pub(super) const HALVED_FROM: usize = 24;

/// Parts that a tree falls into at least, if it has so many items: sixteen times two threads, so
/// that the last part to end keeps the other waiting little.
const PARTS: usize = 32;

pub(super) fn build(boxes: &[Aabb]) -> Bvh {
    assert!(boxes.len() < 1 << 31, "an item's number has 31 bits");
    let mut build = Build {
        boxes,
        order: (0..).take(boxes.len()).collect(),
        nodes: Vec::with_capacity(boxes.len() / 2 + 1),
        sizes: Vec::new(),
    };
    build.node(0..boxes.len(), 0);
    let parts = build.parts();
    let inside = |node: &usize| parts.iter().any(|part| part.below.contains(node));
    let top = (0..build.nodes.len())
        .filter(|node| !inside(node))
        .collect();
    Bvh {
        nodes: build.nodes,
        parts,
        top,
        items: boxes.len(),
    }
}

struct Build<'a> {
    boxes: &'a [Aabb],
    /// The items; each subtree's stand in a row.
    order: Vec<u32>,
    nodes: Vec<Node>,
    /// Nodes of the subtree that each node begins.
    sizes: Vec<usize>,
}

impl Build<'_> {
    /// Adds the node of a range of `order`, and all below it.
    fn node(&mut self, range: Range<usize>, level: usize) -> Child {
        let at = self.nodes.len();
        self.nodes.push(Node::EMPTY);
        self.sizes.push(0);
        let (ranges, count) = self.four(range, level);
        for (lane, range) in ranges.into_iter().take(count).enumerate() {
            let bounds = Bounds::around(&self.bounds(&range));
            let child = if range.len() == 1 {
                Child::item(self.order[range.start])
            } else {
                self.node(range, level + 1)
            };
            self.nodes[at].boxes.set(lane, &bounds);
            self.nodes[at].children[lane] = child;
        }
        self.sizes[at] = self.nodes.len() - at;
        Child::node(at)
    }

    /// Splits a range into at most four, each time the one with the largest surface.
    fn four(&mut self, range: Range<usize>, level: usize) -> ([Range<usize>; WIDE], usize) {
        let mut ranges = [range, 0..0, 0..0, 0..0];
        if ranges[0].is_empty() {
            return (ranges, 0);
        }
        for count in 1..WIDE {
            let halved = level >= HALVED_FROM;
            let weight = |range: &Range<usize>| match range.len() {
                0 | 1 => (-1.0, 0),
                length if halved => (0.0, length),
                length => (self.bounds(range).half_area(), length),
            };
            let mut largest = 0;
            for other in 1..count {
                if weight(&ranges[other]) > weight(&ranges[largest]) {
                    largest = other;
                }
            }
            let whole = ranges[largest].clone();
            if whole.len() < 2 {
                return (ranges, count);
            }
            let middle = if halved {
                self.halve(&whole)
            } else {
                self.split(&whole)
            };
            ranges[largest] = whole.start..middle;
            ranges[count] = middle..whole.end;
        }
        (ranges, WIDE)
    }

    fn bounds(&self, range: &Range<usize>) -> Aabb {
        let boxes = self.order[range.clone()].iter();
        boxes.fold(Aabb::EMPTY, |whole, &item| {
            whole.union(self.boxes[item as usize])
        })
    }

    /// Sorts a range into two where the heuristic says, and returns where the second begins.
    fn split(&mut self, range: &Range<usize>) -> usize {
        let centers = self.order[range.clone()].iter();
        let centers = Aabb::around(centers.map(|&item| self.boxes[item as usize].center()));
        let Some(plane) = self.best_plane(range, centers) else {
            return self.halve(range);
        };
        let mut middle = range.start;
        for k in range.clone() {
            if plane.bins.bin(self.boxes[self.order[k] as usize].center()) <= plane.last {
                self.order.swap(k, middle);
                middle += 1;
            }
        }
        middle
    }

    /// The best place to split, `None` where all middles are the same or no box has a surface.
    fn best_plane(&self, range: &Range<usize>, centers: Aabb) -> Option<Plane> {
        let mut best: Option<(f64, Plane)> = None;
        for axis in 0..3 {
            let Some(bins) = Bins::new(centers, axis) else {
                continue;
            };
            let mut filled = [(Aabb::EMPTY, 0.0); BINS];
            for &item in &self.order[range.clone()] {
                let bounds = self.boxes[item as usize];
                let (whole, items) = &mut filled[bins.bin(bounds.center())];
                *whole = whole.union(bounds);
                *items += 1.0;
            }
            let (last, cost) = cheapest(&filled);
            if best.as_ref().is_none_or(|(least, _)| cost < *least) {
                best = Some((cost, Plane { bins, last }));
            }
        }
        best.filter(|(cost, _)| *cost > 0.0).map(|(_, plane)| plane)
    }

    /// Splits a range in the middle along the longest axis of its items' middles.
    fn halve(&mut self, range: &Range<usize>) -> usize {
        let boxes = self.boxes;
        let center = |item: u32| boxes[item as usize].center();
        let items = &mut self.order[range.clone()];
        let extent = Aabb::around(items.iter().map(|&item| center(item)));
        let axis = (extent.max - extent.min).max_position();
        items.select_nth_unstable_by(range.len() / 2, |&a, &b| {
            let order = center(a)[axis].total_cmp(&center(b)[axis]);
            order.then(a.cmp(&b))
        });
        range.start + range.len() / 2
    }

    /// Opens the largest subtree until there are enough.
    fn parts(&self) -> Vec<Part> {
        let mut parts = self.children(0);
        while parts.len() < PARTS {
            let mut largest = 0;
            for other in 1..parts.len() {
                if parts[other].below.len() > parts[largest].below.len() {
                    largest = other;
                }
            }
            match parts.get(largest).map(|part| part.below.clone()) {
                Some(below) if !below.is_empty() => {
                    parts.splice(largest..=largest, self.children(below.start));
                }
                _ => break,
            }
        }
        parts
    }

    /// The children of a node. Their nodes follow it in a row.
    fn children(&self, node: usize) -> Vec<Part> {
        let mut next = node + 1;
        let mut children = Vec::new();
        for lane in 0..WIDE {
            let start = next;
            match self.nodes[node].children[lane] {
                Child::NONE => continue,
                child => next += child.known().map_or_else(|node| self.sizes[node], |_| 0),
            }
            children.push(Part {
                node,
                lane,
                below: start..next,
            });
        }
        children
    }
}

/// Bins of equal width along an axis.
struct Bins {
    axis: usize,
    start: f64,
    /// Bins a metre.
    scale: f64,
}

impl Bins {
    /// `None` for no width, and for one so small that the scale overflows.
    #[expect(clippy::cast_precision_loss, reason = "sixteen")]
    fn new(centers: Aabb, axis: usize) -> Option<Self> {
        let (start, end) = (centers.min[axis], centers.max[axis]);
        let scale = BINS as f64 / (end - start);
        (scale > 0.0 && scale < f64::INFINITY).then_some(Self { axis, start, scale })
    }

    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "not negative, and cut off at the last bin"
    )]
    fn bin(&self, center: DVec3) -> usize {
        (((center[self.axis] - self.start) * self.scale) as usize).min(BINS - 1)
    }
}

/// A place between two bins.
struct Plane {
    bins: Bins,
    /// The last bin of the first side.
    last: usize,
}

/// The last bin of the first side, and the cost, of the cheapest split into two that aren't empty.
/// The first and the last bin never are.
fn cheapest(filled: &[(Aabb, f64); BINS]) -> (usize, f64) {
    let mut above = [0.0; BINS];
    let (mut whole, mut items) = (Aabb::EMPTY, 0.0);
    for bin in (1..BINS).rev() {
        whole = whole.union(filled[bin].0);
        items += filled[bin].1;
        above[bin - 1] = whole.half_area() * items;
    }
    let mut best = (0, f64::INFINITY);
    (whole, items) = (Aabb::EMPTY, 0.0);
    for bin in 0..BINS - 1 {
        whole = whole.union(filled[bin].0);
        items += filled[bin].1;
        let cost = whole.half_area() * items + above[bin];
        if cost < best.1 {
            best = (bin, cost);
        }
    }
    best
}
