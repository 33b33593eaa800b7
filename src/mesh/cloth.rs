//! Any triangle mesh as cloth.

use super::{Lattice, Segment, TriMesh, triangle_area};
use std::collections::BTreeMap;

/// A triangle mesh as cloth: one structural piece an edge, in the order of the edges.
///
/// The area of a piece is that of the one or two triangles at it, from which Van Gelder derives the
/// stiffness that gives an elastic sheet; a vertex stands for a third of each triangle at it. Shear
/// is carried by the edges already, bending belongs to the hinges ([`super::hinges`]); nothing has a
/// name. For a manifold, consistently oriented mesh without unused vertices, whose share would be 0.
///
/// Source: Van Gelder 1998, "Approximate simulation of elastic membranes by triangulated spring
/// meshes".
pub fn cloth(mesh: TriMesh) -> Lattice {
    let mut shares = vec![0.0; mesh.positions.len()];
    let mut beside: BTreeMap<[u32; 2], f64> = BTreeMap::new();
    for &triangle in &mesh.triangles {
        let area = triangle_area(mesh.corners(triangle));
        let [a, b, c] = triangle;
        for [i, j] in [[a, b], [b, c], [c, a]] {
            *beside.entry([i.min(j), i.max(j)]).or_default() += area;
            shares[i as usize] += area / 3.0;
        }
    }
    Lattice {
        mesh,
        shares,
        structural: beside
            .into_iter()
            .map(|(ends, area)| Segment { ends, area })
            .collect(),
        ..Lattice::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{Diagonals, Opening, Sheet, block};

    fn sheet(opening: Option<Opening>) -> TriMesh {
        let sheet = Sheet {
            size: [0.8, 1.1],
            cells: [9, 14],
            diagonals: Diagonals::Alternating,
            opening,
        };
        sheet.lattice().unwrap().mesh
    }

    fn disc() -> TriMesh {
        sheet(None)
    }

    fn ring() -> TriMesh {
        sheet(Some(Opening {
            center: [0.0, 0.1],
            radius: 0.2,
        }))
    }

    fn closed() -> TriMesh {
        block([0.3, 0.4, 0.5], [1, 1, 1]).mesh
    }

    #[test]
    fn every_edge_is_a_piece_once() {
        for (name, mesh, characteristic) in [
            ("disc", disc(), 1),
            ("ring", ring(), 0),
            ("closed", closed(), 2),
        ] {
            let lattice = cloth(mesh);
            let [vertices, edges, triangles] = [
                lattice.shares.len(),
                lattice.structural.len(),
                lattice.mesh.triangles.len(),
            ];
            assert_eq!(vertices + triangles, edges + characteristic, "{name}");
        }
    }

    #[test]
    fn shares_cover_the_mesh_once_and_pieces_three_times() {
        for mesh in [disc(), ring(), closed()] {
            let areas = mesh
                .triangles
                .iter()
                .map(|&t| triangle_area(mesh.corners(t)));
            let area: f64 = areas.sum();
            let lattice = cloth(mesh);
            let shared: f64 = lattice.shares.iter().sum();
            let pieces: f64 = lattice.structural.iter().map(|piece| piece.area).sum();
            assert!((shared - area).abs() < 1e-12, "{shared} m² of {area}");
            assert!(
                (pieces - 3.0 * area).abs() < 1e-12,
                "{pieces} m² of 3·{area}"
            );
        }
    }

    #[test]
    fn a_border_piece_has_one_triangle_and_an_inner_one_two() {
        use glam::dvec3;
        // Right triangles of 1/2 m² and 1 m² on the edge 0–1.
        let lattice = cloth(TriMesh {
            positions: vec![
                dvec3(0.0, 0.0, 0.0),
                dvec3(1.0, 0.0, 0.0),
                dvec3(0.0, 1.0, 0.0),
                dvec3(0.0, -2.0, 0.0),
            ],
            triangles: vec![[0, 1, 2], [1, 0, 3]],
        });
        let pieces: Vec<_> = lattice
            .structural
            .iter()
            .map(|s| (s.ends, s.area))
            .collect();
        assert_eq!(
            pieces,
            [
                ([0, 1], 1.5),
                ([0, 2], 0.5),
                ([0, 3], 1.0),
                ([1, 2], 0.5),
                ([1, 3], 1.0)
            ]
        );
        assert_eq!(lattice.shares, [0.5, 0.5, 0.5 / 3.0, 1.0 / 3.0]);
    }
}
