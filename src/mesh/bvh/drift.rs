//! Pairs of items that have moved against each other since their boxes were taken.
//!
//! What moves with its surroundings, however fast, stays as near to them as it was. So a list of what is near is
//! good for many steps: only what two hierarchies of moves don't show to go along has to be looked for anew.

use super::node::{Bounds, Child, FourBoxes, Lanes};
use super::{Bvh, WIDE};
use glam::{BVec4A, Vec4};

/// Four hierarchies of the same shape, of items on a way in straight lines: where they are at its beginning and at its
/// end, and how far they have moved until then.
#[derive(Clone, Copy, Debug)]
pub struct Drift<'a> {
    /// Boxes of the items at the beginning and at the end of their way, grown by half of what is looked for (m).
    pub at: [&'a Bvh; 2],
    /// How far each item has moved at the beginning of its way, and at its end (m).
    pub moves: [&'a Bvh; 2],
    /// What may differ between the moves of two items that keep together (m).
    pub most: f32,
}

/// An item, or a node and all below it.
struct Subtree {
    child: Child,
    at: [Bounds; 2],
    moves: [Bounds; 2],
    /// Whether the last refit of the moves at the end changed anything of it.
    changed: bool,
}

impl<'a> Drift<'a> {
    /// Calls `found` once with every two items that don't keep together and whose boxes overlap on their way, the
    /// lower number first, of which one is in a part of the hierarchy and the other in this or a later one. At least
    /// one of them has changed its move at the end in the [last refit](Bvh::refit_changed).
    pub fn pairs(&self, part: usize, mut found: impl FnMut(u32, u32)) {
        let mut ordered = |a: u32, b: u32| found(a.min(b), a.max(b));
        let parts = &self.moves[0].parts;
        let mine = self.child(parts[part].node, parts[part].lane);
        self.within(&mine, &mut ordered);
        for later in &parts[part + 1..] {
            if self.near(&mine, later.node).any(|lane| lane == later.lane) {
                self.cross(&mine, &self.child(later.node, later.lane), &mut ordered);
            }
        }
    }

    fn child(&self, node: usize, lane: usize) -> Subtree {
        let boxes = |tree: &Bvh| tree.nodes[node].boxes.get(lane);
        Subtree {
            child: self.children(node)[lane],
            at: self.at.map(boxes),
            moves: self.moves.map(boxes),
            changed: self.changed(node) >> lane & 1 != 0,
        }
    }

    fn children(&self, node: usize) -> &[Child; WIDE] {
        &self.moves[0].nodes[node].children
    }

    /// The bits of a node's children that have changed.
    fn changed(&self, node: usize) -> u32 {
        self.moves[1].nodes[node].changed
    }

    /// The pairs within a subtree.
    fn within(&self, all: &Subtree, found: &mut impl FnMut(u32, u32)) {
        let Err(node) = all.child.known() else {
            return;
        };
        let together = |moves: &Bounds| {
            let extent = |axis: usize| moves.max[axis] - moves.min[axis];
            let [x, y, z] = [0, 1, 2].map(extent);
            x * x + y * y + z * z <= self.most * self.most
        };
        if !all.changed || all.moves.iter().all(together) {
            return;
        }
        for lane in (0..WIDE).filter(|&lane| self.children(node)[lane] != Child::NONE) {
            let one = self.child(node, lane);
            self.within(&one, found);
            for other in self.near(&one, node).filter(|&other| other > lane) {
                self.cross(&one, &self.child(node, other), found);
            }
        }
    }

    /// The pairs between two subtrees that are near each other.
    fn cross(&self, one: &Subtree, other: &Subtree, found: &mut impl FnMut(u32, u32)) {
        match (one.child.known(), other.child.known()) {
            (Ok(a), Ok(b)) => found(a, b),
            (Err(node), _) => self.open(other, node, found),
            (Ok(_), Err(node)) => self.open(one, node, found),
        }
    }

    /// The pairs between a subtree and the children of a node.
    fn open(&self, one: &Subtree, node: usize, found: &mut impl FnMut(u32, u32)) {
        for lane in self.near(one, node) {
            // What two items that are found don't need isn't made: 5 % of all contact in a rope of folds.
            match (one.child.known(), self.children(node)[lane].known()) {
                (Ok(a), Ok(b)) => found(a, b),
                _ => self.cross(one, &self.child(node, lane), found),
            }
        }
    }

    /// The children of a node that don't keep together with a subtree, and whose boxes overlap its own on their way:
    /// that aren't beyond it on the same side at both ends.
    fn near(&self, one: &Subtree, node: usize) -> Lanes {
        let asked = if one.changed {
            u32::MAX
        } else {
            self.changed(node)
        };
        if asked == 0 {
            return Lanes(0);
        }
        let boxes = |trees: [&'a Bvh; 2]| trees.map(|tree| &tree.nodes[node].boxes);
        let (mut apart, mut moved) = (BVec4A::FALSE, BVec4A::FALSE);
        for axis in 0..3 {
            let (mut below, mut above) = (BVec4A::TRUE, BVec4A::TRUE);
            for (mine, yours) in one.at.iter().zip(boxes(self.at)) {
                below &= yours.max[axis].cmplt(Vec4::splat(mine.min[axis]));
                above &= yours.min[axis].cmpgt(Vec4::splat(mine.max[axis]));
            }
            apart |= below | above;
        }
        for (mine, yours) in one.moves.iter().zip(boxes(self.moves)) {
            moved |= difference_squared(mine, yours).cmpgt(Vec4::splat(self.most * self.most));
        }
        Lanes((moved & !apart).bitmask() & asked)
    }
}

/// Largest squared difference between the moves in a box and in each of four (m²).
fn difference_squared(mine: &Bounds, yours: &FourBoxes) -> Vec4 {
    let mut squared = Vec4::ZERO;
    for axis in 0..3 {
        let over = Vec4::splat(mine.max[axis]) - yours.min[axis];
        let under = yours.max[axis] - Vec4::splat(mine.min[axis]);
        let most = over.max(under);
        squared += most * most;
    }
    squared
}
