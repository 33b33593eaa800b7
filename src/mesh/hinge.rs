//! Hinges: the edges across which a mesh can bend.

/// One side of a triangle.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Side {
    /// Its edge, lower vertex first.
    pub(super) edge: [u32; 2],
    /// Whether the triangle runs along it from the higher vertex to the lower.
    pub(super) backwards: bool,
    /// Index of the triangle.
    pub(super) triangle: usize,
    /// The triangle's third vertex.
    pub(super) opposite: u32,
}

/// The sides of all triangles, those along one edge in a row, forwards first.
pub(super) fn sides(triangles: &[[u32; 3]]) -> Vec<Side> {
    let mut sides = Vec::with_capacity(3 * triangles.len());
    for (triangle, &[a, b, c]) in triangles.iter().enumerate() {
        for [i, j, opposite] in [[a, b, c], [b, c, a], [c, a, b]] {
            sides.push(Side {
                edge: [i.min(j), i.max(j)],
                backwards: i > j,
                triangle,
                opposite,
            });
        }
    }
    sides.sort_unstable();
    sides
}

/// The hinges of a mesh in the order of their edges: `[a, b, c, d]` for the triangles a→b→c and
/// b→a→d with a < b.
///
/// For a manifold and consistently oriented mesh, see [`super::non_manifold_edge`] and
/// [`super::orient_consistently`]: there each edge is a hinge or lies on the border. An edge of
/// three or more triangles, or of two that run along it in the same direction, is left out.
pub fn hinges(triangles: &[[u32; 3]]) -> Vec<[u32; 4]> {
    sides(triangles)
        .chunk_by(|one, next| one.edge == next.edge)
        .filter_map(|along| match along {
            [there, back] if !there.backwards && back.backwards => {
                let [a, b] = there.edge;
                Some([a, b, there.opposite, back.opposite])
            }
            _ => None,
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{Diagonals, Opening, Sheet, edge_uses};

    fn runs_along(triangles: &[[u32; 3]], [a, b, c]: [u32; 3]) -> bool {
        [[a, b, c], [b, c, a], [c, a, b]]
            .iter()
            .any(|t| triangles.contains(t))
    }

    #[test]
    fn two_triangles_are_one_hinge() {
        assert_eq!(hinges(&[[0, 1, 2], [1, 0, 3]]), [[0, 1, 2, 3]]);
        assert_eq!(hinges(&[[7, 5, 9], [4, 5, 7]]), [[5, 7, 4, 9]]);
    }

    #[test]
    fn every_inner_edge_is_a_hinge_between_its_two_triangles() {
        let sheet = Sheet {
            size: [1.0, 1.0],
            cells: [12, 12],
            diagonals: Diagonals::Alternating,
            opening: Some(Opening {
                center: [0.0, 0.0],
                radius: 0.2,
            }),
        };
        let triangles = sheet.lattice().unwrap().mesh.triangles;
        let inner: Vec<[u32; 2]> = edge_uses(&triangles)
            .into_iter()
            .filter_map(|(edge, uses)| (uses == [1, 1]).then_some(edge))
            .collect();
        let hinges = hinges(&triangles);
        let edges: Vec<[u32; 2]> = hinges.iter().map(|&[a, b, _, _]| [a, b]).collect();
        assert_eq!(edges, inner);
        for [a, b, c, d] in hinges {
            assert!(runs_along(&triangles, [a, b, c]) && runs_along(&triangles, [b, a, d]));
        }
    }

    #[test]
    fn edges_without_two_opposed_triangles_are_left_out() {
        assert!(hinges(&[[0, 1, 2]]).is_empty(), "a border");
        assert!(hinges(&[[0, 1, 2], [0, 1, 3]]).is_empty(), "one direction");
        let book = [[0, 1, 2], [1, 0, 3], [1, 0, 4]];
        assert!(hinges(&book).is_empty(), "three triangles");
    }
}
