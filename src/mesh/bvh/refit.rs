//! New boxes in an old tree.

use super::node::{Bounds, Child, Node};
use super::{Bvh, Part, WIDE};
use crate::mesh::Aabb;

/// Nodes from which on threads help: these take 8 µs, waking a thread takes 5.
const WORTH_SHARING: usize = 512;

impl Bvh {
    /// Takes over new boxes of the same items, `bounds(item)` each, in O(n) on all threads.
    ///
    /// The tree keeps its shape: answers stay right however the items move, and get slower when
    /// neighbours part.
    pub fn refit_with(&mut self, bounds: impl Fn(u32) -> Aabb + Sync) {
        self.refit_changed(|item| Some(Bounds::around(&bounds(item))));
    }

    /// Takes over new boxes of the items that have changed, as [`refit_with`](Self::refit_with) does of all. The tree
    /// remembers until the next time which ones these are.
    pub fn refit_changed(&mut self, bounds: impl Fn(u32) -> Option<Bounds> + Sync) {
        if self.nodes.len() < WORTH_SHARING {
            refit(&mut self.nodes, 0, &bounds);
            return;
        }
        refit_parts(&mut self.nodes, 0, &self.parts, &bounds);
        for &node in self.top.iter().rev() {
            // Its children stand after it, and are done.
            refit_first(&mut self.nodes[node..], node, &bounds);
        }
    }
}

/// Refits the nodes of some parts, which are among `nodes`, of which the first has number `first`.
fn refit_parts(
    nodes: &mut [Node],
    first: usize,
    parts: &[Part],
    bounds: &(impl Fn(u32) -> Option<Bounds> + Sync),
) {
    if let [Part { below, .. }] = parts {
        let own = &mut nodes[below.start - first..below.end - first];
        refit(own, below.start, bounds);
    } else {
        let (some, others) = parts.split_at(parts.len() / 2);
        let middle = others[0].below.start;
        let (nodes, other_nodes) = nodes.split_at_mut(middle - first);
        rayon::join(
            || refit_parts(nodes, first, some, bounds),
            || refit_parts(other_nodes, middle, others, bounds),
        );
    }
}

/// Refits nodes whose children are among them, from the last to the first.
fn refit(nodes: &mut [Node], first: usize, bounds: &impl Fn(u32) -> Option<Bounds>) {
    for k in (0..nodes.len()).rev() {
        refit_first(&mut nodes[k..], first + k, bounds);
    }
}

/// Refits the first of some nodes, which has number `first`.
fn refit_first(nodes: &mut [Node], first: usize, bounds: &impl Fn(u32) -> Option<Bounds>) {
    let mut changed = 0;
    for lane in 0..WIDE {
        let child = nodes[0].children[lane];
        if child != Child::NONE {
            let fitted = match child.known() {
                Ok(item) => bounds(item),
                Err(node) => {
                    let below = &nodes[node - first];
                    (below.changed != 0).then(|| below.boxes.around())
                }
            };
            if let Some(fitted) = fitted {
                nodes[0].boxes.set(lane, &fitted);
                changed |= 1 << lane;
            }
        }
    }
    nodes[0].changed = changed;
}
