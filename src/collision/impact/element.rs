//! Meshes as lists of elements that own their features.
//!
//! A vertex belongs to several triangles and an edge to two. Each is given to one of them, so that
//! pairs of elements whose boxes overlap yield every pair of features once (Curtis, Tamstorf and
//! Manocha 2008, "representative triangles").

use super::Features;
use std::collections::BTreeSet;

/// A triangle, a lone edge (the last two corners are the same) or a lone vertex (all are).
#[derive(Clone, Copy, Debug)]
pub(super) struct Element {
    /// Its vertices.
    pub(super) corners: [u32; 3],
    /// Which of them it owns.
    pub(super) vertices: [bool; 3],
    /// Which of its edges it owns; each begins at the corner of its number.
    pub(super) edges: [bool; 3],
    /// Whether it is a triangle.
    pub(super) face: bool,
    /// The solid it belongs to; 0 for cloth.
    pub(super) solid: u32,
}

impl Element {
    /// Whether any of its corners is marked.
    #[inline]
    pub(super) fn has_any(&self, marked: &[bool]) -> bool {
        let [a, b, c] = self.corners.map(|i| marked[i as usize]);
        a || b || c
    }

    /// Whether it has a corner in common with another.
    #[inline]
    pub(super) fn adjoins(&self, other: &Self) -> bool {
        let [a, b, c] = self.corners;
        other.corners.iter().any(|&i| i == a || i == b || i == c)
    }

    /// The vertices of the edge that begins at a corner.
    #[inline]
    pub(super) fn edge(&self, k: usize) -> [u32; 2] {
        [self.corners[k], self.corners[(k + 1) % 3]]
    }
}

/// The elements of `count` vertices from `first` on, with triangles and edges between them, numbered from 0.
pub(super) fn elements(
    first: u32,
    count: u32,
    triangles: &[[u32; 3]],
    edges: &[[u32; 2]],
    solid: u32,
) -> Vec<Element> {
    let mut free = vec![true; count as usize];
    let mut seen = BTreeSet::new();
    let faces = triangles.iter().map(|&corners| (corners, true));
    let lines = edges.iter().map(|&[a, b]| ([a, b, b], false));
    let mut list = Vec::new();
    for (corners, face) in faces.chain(lines) {
        let edge = |k: usize| [corners[k], corners[(k + 1) % 3]];
        let edges = [0, 1, 2].map(|k| {
            let [a, b] = edge(k);
            a != b && seen.insert([a.min(b), a.max(b)])
        });
        let vertices = corners.map(|corner| std::mem::take(&mut free[corner as usize]));
        let corners = corners.map(|corner| first + corner);
        list.push(Element {
            corners,
            vertices,
            edges,
            face,
            solid,
        });
    }
    list.extend(
        (first..)
            .zip(free)
            .filter(|(_, free)| *free)
            .map(|(vertex, _)| Element {
                corners: [vertex; 3],
                vertices: [true, false, false],
                edges: [false; 3],
                face: false,
                solid,
            }),
    );
    list
}

/// Calls `visit` with every pair of features that two elements own. With `round`, the second element is
/// a ball around its vertex, which meets edges and vertices as it meets faces.
pub(super) fn pairs(
    one: &Element,
    other: &Element,
    round: bool,
    mut visit: impl FnMut(Features, [u32; 4]),
) {
    for (mine, yours) in [(one, other), (other, one)] {
        if yours.face || (round && mine.solid != 0) {
            let [a, b, c] = yours.corners;
            for k in 0..3 {
                if mine.vertices[k] {
                    visit(Features::VertexFace, [mine.corners[k], a, b, c]);
                }
            }
        }
    }
    for j in 0..3 {
        for k in 0..3 {
            if one.edges[j] && other.edges[k] {
                let ([a, b], [c, d]) = (one.edge(j), other.edge(k));
                visit(Features::EdgeEdge, [a, b, c, d]);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_feature_has_one_owner() {
        // Two triangles, a lone edge at one of their corners, and a lone vertex.
        let list = elements(10, 7, &[[0, 1, 2], [2, 1, 3]], &[[3, 4], [4, 5], [1, 2]], 0);
        assert_eq!(list.len(), 6);
        let mut vertices: Vec<u32> = Vec::new();
        let mut edges: Vec<[u32; 2]> = Vec::new();
        for element in &list {
            vertices.extend(
                (0..3)
                    .filter(|&k| element.vertices[k])
                    .map(|k| element.corners[k]),
            );
            edges.extend(
                (0..3)
                    .filter(|&k| element.edges[k])
                    .map(|k| element.edge(k)),
            );
        }
        vertices.sort_unstable();
        assert_eq!(vertices, [10, 11, 12, 13, 14, 15, 16]);
        assert_eq!(edges.len(), 7, "{edges:?}");
        let mut faces = 0;
        let mut crossings = 0;
        let other = elements(20, 3, &[[0, 1, 2]], &[], 1);
        for element in &list {
            pairs(
                element,
                &other[0],
                false,
                |features, vertices| match features {
                    Features::VertexFace if vertices[0] < 20 => faces += 1,
                    Features::VertexFace => assert_eq!(vertices[0] / 10, 2),
                    Features::EdgeEdge => crossings += 1,
                },
            );
        }
        assert_eq!((faces, crossings), (7, 7 * 3));
    }
}
