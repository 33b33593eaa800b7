//! Boxes of the features of layers, which leave few pairs to be looked at closely.

use super::Features;
use super::element::Element;
use crate::mesh::{Aabb, Bounds, FourBoxes};
use glam::DVec3;
use rayon::prelude::*;

/// Which of an element's four boxes is that of its face; the others are those of the edges that it owns.
const FACE: usize = 3;

/// Vertices or elements that a task fits at least: much longer than waking a thread.
const TASK: usize = 1024;

/// Boxes of particles and elements of cloth, grown by half a reach: two overlap when the features may be closer than
/// that. In a rope of folds two pairs of features in three are told apart here,
/// four at a time.
#[derive(Clone, Debug, Default)]
pub(super) struct ElementBoxes {
    vertices: Vec<Bounds>,
    elements: Vec<FourBoxes>,
}

impl ElementBoxes {
    /// Fits the boxes around positions of the particles.
    pub(super) fn fit(&mut self, places: &[DVec3], cloth: &[Element], margin: f64) {
        self.vertices.resize(places.len(), Bounds::EMPTY);
        self.elements.resize(cloth.len(), FourBoxes::EMPTY);
        let vertices = self.vertices.par_iter_mut().with_min_len(TASK);
        vertices.zip(places).for_each(|(bounds, place)| {
            *bounds = Bounds::around(&Aabb::around([*place]).grown(margin));
        });
        let around = &self.vertices;
        let elements = self.elements.par_iter_mut().with_min_len(TASK).zip(cloth);
        elements.for_each(|(boxes, element)| {
            let [a, b, c] = element.corners.map(|i| &around[i as usize]);
            let edges = [a.union(b), b.union(c), c.union(a)];
            for k in 0..3 {
                boxes.set(
                    k,
                    if element.edges[k] {
                        &edges[k]
                    } else {
                        &Bounds::EMPTY
                    },
                );
            }
            let face = edges[0].union(c);
            boxes.set(FACE, if element.face { &face } else { &Bounds::EMPTY });
        });
    }

    /// Calls `visit` with every pair of features that two elements own, have no vertex in common and may be
    /// closer than the reach.
    #[inline]
    pub(super) fn pairs(
        &self,
        [one, other]: [(usize, &Element); 2],
        mut visit: impl FnMut(Features, [u32; 4]),
    ) {
        for ((_, mine), (number, yours)) in [(one, other), (other, one)] {
            let [a, b, c] = yours.corners;
            for k in 0..3 {
                let vertex = mine.corners[k];
                if mine.vertices[k] && vertex != a && vertex != b && vertex != c {
                    let bounds = &self.vertices[vertex as usize];
                    if self.elements[number]
                        .overlapping(bounds)
                        .any(|lane| lane == FACE)
                    {
                        visit(Features::VertexFace, [vertex, a, b, c]);
                    }
                }
            }
        }
        let ((number, mine), (other, yours)) = (one, other);
        for j in (0..3).filter(|&j| mine.edges[j]) {
            let [a, b] = mine.edge(j);
            let bounds = self.elements[number].get(j);
            for k in self.elements[other].overlapping(&bounds) {
                if k == FACE {
                    continue;
                }
                let [c, d] = yours.edge(k);
                if a != c && a != d && b != c && b != d {
                    visit(Features::EdgeEdge, [a, b, c, d]);
                }
            }
        }
    }
}
