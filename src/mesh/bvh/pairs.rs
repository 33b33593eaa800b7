//! Pairs of overlapping items, in one hierarchy or between two.
//!
//! Both trees are descended together, so that subtrees that are apart are left at once. The work
//! falls into [parts](Bvh::parts) that depend on the hierarchy alone: a task for each gives the
//! same pairs in the same order for any number of threads.

use super::node::{Bounds, Child};
use super::{Bvh, WIDE};

impl Bvh {
    /// Number of parts into which the search for pairs is cut: 32 to 34, as many as there are items
    /// when those are fewer.
    pub fn parts(&self) -> usize {
        self.parts.len()
    }

    /// Calls `found` with every item of a part of this hierarchy and every item of `other` whose
    /// boxes overlap.
    pub fn pairs(&self, part: usize, other: &Self, mut found: impl FnMut(u32, u32)) {
        let mine = self.part(part);
        let all = Subtree {
            tree: other,
            child: Child::ROOT,
            bounds: other.nodes[0].boxes.around(),
        };
        if mine.bounds.overlaps(&all.bounds) {
            cross(&mine, &all, &mut found);
        }
    }

    /// Calls `found` once with every two items whose boxes overlap, the lower number first, of which
    /// one is in a part and the other in this or a later one: all parts together give all pairs.
    pub fn self_pairs(&self, part: usize, mut found: impl FnMut(u32, u32)) {
        let mut ordered = |a: u32, b: u32| found(a.min(b), a.max(b));
        let mine = self.part(part);
        if let Err(node) = mine.child.known() {
            self.within(node, &mut ordered);
        }
        for later in part + 1..self.parts.len() {
            let later = self.part(later);
            if mine.bounds.overlaps(&later.bounds) {
                cross(&mine, &later, &mut ordered);
            }
        }
    }

    fn part(&self, part: usize) -> Subtree<'_> {
        self.child(self.parts[part].node, self.parts[part].lane)
    }

    fn child(&self, node: usize, lane: usize) -> Subtree<'_> {
        Subtree {
            tree: self,
            child: self.nodes[node].children[lane],
            bounds: self.nodes[node].boxes.get(lane),
        }
    }

    /// The pairs below one node.
    fn within(&self, node: usize, found: &mut impl FnMut(u32, u32)) {
        for lane in 0..WIDE {
            let one = self.child(node, lane);
            if let Err(below) = one.child.known() {
                self.within(below, found);
            }
            let overlapping = self.nodes[node].boxes.overlapping(&one.bounds);
            for other in overlapping.filter(|&other| other > lane) {
                cross(&one, &self.child(node, other), found);
            }
        }
    }
}

/// An item, or a node and all below it.
struct Subtree<'a> {
    tree: &'a Bvh,
    child: Child,
    bounds: Bounds,
}

impl Subtree<'_> {
    /// Calls `visit` with the children of a node that overlap a box.
    fn for_overlapping(&self, node: usize, bounds: &Bounds, mut visit: impl FnMut(&Self)) {
        for lane in self.tree.nodes[node].boxes.overlapping(bounds) {
            visit(&self.tree.child(node, lane));
        }
    }
}

/// The pairs between two subtrees whose boxes overlap.
fn cross(one: &Subtree<'_>, other: &Subtree<'_>, found: &mut impl FnMut(u32, u32)) {
    match (one.child.known(), other.child.known()) {
        (Ok(a), Ok(b)) => found(a, b),
        (Err(node), Ok(_)) => {
            one.for_overlapping(node, &other.bounds, |below| cross(below, other, found));
        }
        (Ok(_), Err(node)) => open(one, other, node, found),
        (Err(node), Err(node2)) => one.for_overlapping(node, &other.bounds, |below| {
            open(below, other, node2, found);
        }),
    }
}

/// The pairs between a subtree and the children of a node of another.
fn open(one: &Subtree<'_>, other: &Subtree<'_>, node: usize, found: &mut impl FnMut(u32, u32)) {
    let children = &other.tree.nodes[node].children;
    for lane in other.tree.nodes[node].boxes.overlapping(&one.bounds) {
        // What two items that are found don't need isn't made.
        match (one.child.known(), children[lane].known()) {
            (Ok(a), Ok(b)) => found(a, b),
            _ => cross(one, &other.tree.child(node, lane), found),
        }
    }
}
