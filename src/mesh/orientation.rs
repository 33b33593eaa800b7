//! Making neighbouring triangles run the same way round.

use super::TriMesh;
use super::hinge::{Side, sides};
use super::topology::from_to;
use glam::DVec3;

/// A surface with one side only, as a Möbius strip.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error(
    "the surface has one side only: going round it, its triangles don't fit together at the edge \
     {}; cut the mesh through there and leave a gap, since vertices at the same place are merged",
    from_to(*.positions)
)]
pub struct OneSided {
    /// Vertices of an edge whose triangles can't agree.
    pub vertices: [u32; 2],
    /// Their positions (m).
    pub positions: [DVec3; 2],
}

/// Turns triangles until neighbours run along their common edge in opposite directions, and returns
/// how many it turned.
///
/// Each connected piece keeps the orientation of most of its triangles, at a tie that of its first,
/// so no fewer could be turned. Triangles are neighbours across edges of two triangles; an edge of
/// three or more joins nothing, see [`super::non_manifold_edge`].
///
/// # Errors
///
/// When a piece has one side only; the mesh is left as it was.
pub fn orient_consistently(mesh: &mut TriMesh) -> Result<usize, OneSided> {
    let neighbours = neighbours(&mesh.triangles);
    let mut turn = vec![None; mesh.triangles.len()];
    for seed in 0..turn.len() {
        if turn[seed].is_none() {
            let piece = flood(seed, &neighbours, &mut turn).map_err(|vertices| OneSided {
                vertices,
                positions: vertices.map(|vertex| mesh.positions[vertex as usize]),
            })?;
            keep_majority(&piece, &mut turn);
        }
    }
    let mut turned = 0;
    for (triangle, turn) in mesh.triangles.iter_mut().zip(turn) {
        if turn == Some(true) {
            triangle.swap(1, 2);
            turned += 1;
        }
    }
    Ok(turned)
}

/// A triangle across an edge.
#[derive(Clone, Copy)]
struct Neighbour {
    triangle: usize,
    edge: [u32; 2],
    /// Whether both run along the edge in the same direction: one of them is the wrong way round.
    against: bool,
}

/// The neighbours of each triangle.
fn neighbours(triangles: &[[u32; 3]]) -> Vec<Vec<Neighbour>> {
    let mut neighbours = vec![Vec::new(); triangles.len()];
    let sides = sides(triangles);
    for along in sides.chunk_by(|one, next| one.edge == next.edge) {
        if let [one, other] = along {
            let across = |to: &Side| Neighbour {
                triangle: to.triangle,
                edge: one.edge,
                against: one.backwards == other.backwards,
            };
            neighbours[one.triangle].push(across(other));
            neighbours[other.triangle].push(across(one));
        }
    }
    neighbours
}

/// Decides for all triangles connected with `seed` whether they must turn to agree with it, and
/// returns them; an edge at which two ways round disagree is the error.
fn flood(
    seed: usize,
    neighbours: &[Vec<Neighbour>],
    turn: &mut [Option<bool>],
) -> Result<Vec<usize>, [u32; 2]> {
    turn[seed] = Some(false);
    let mut piece = vec![seed];
    let mut next = 0;
    while let Some(&here) = piece.get(next) {
        next += 1;
        for there in &neighbours[here] {
            let needed = turn[here].map(|turn| turn != there.against);
            if turn[there.triangle].is_none() {
                turn[there.triangle] = needed;
                piece.push(there.triangle);
            } else if turn[there.triangle] != needed {
                return Err(there.edge);
            }
        }
    }
    Ok(piece)
}

/// Turns the others instead when more than half of a piece would turn.
fn keep_majority(piece: &[usize], turn: &mut [Option<bool>]) {
    let turning = piece.iter().filter(|&&t| turn[t] == Some(true)).count();
    if 2 * turning > piece.len() {
        for &triangle in piece {
            turn[triangle] = turn[triangle].map(|turn| !turn);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{block, hinges};
    use std::f64::consts::TAU;

    /// Two boxes side by side, not connected.
    fn two_boxes() -> TriMesh {
        let mut mesh = block([1.0, 2.0, 3.0], [2, 3, 4]).mesh;
        let first = u32::try_from(mesh.positions.len()).unwrap();
        let other = block([1.0, 1.0, 1.0], [3, 3, 3]).mesh;
        mesh.positions
            .extend(other.positions.iter().map(|&p| p + DVec3::X * 4.0));
        let moved = other.triangles.iter().map(|t| t.map(|v| v + first));
        mesh.triangles.extend(moved);
        mesh
    }

    /// A band of `cells` quads round the y axis that makes half a turn.
    fn moebius(cells: u32) -> TriMesh {
        let mut mesh = TriMesh::default();
        for i in 0..cells {
            let angle = TAU * f64::from(i) / f64::from(cells);
            let out = DVec3::new(angle.cos(), 0.0, angle.sin());
            let across = out * (0.5 * angle).cos() + DVec3::Y * (0.5 * angle).sin();
            mesh.positions
                .extend([out - 0.2 * across, out + 0.2 * across]);
            let [a, b] = [2 * i, 2 * i + 1];
            let [c, d] = if i + 1 < cells {
                [a + 2, b + 2]
            } else {
                [1, 0]
            };
            mesh.triangles.extend([[a, b, c], [c, b, d]]);
        }
        mesh
    }

    #[test]
    fn turned_triangles_are_turned_back_and_counted() {
        let good = two_boxes();
        let mut mesh = good.clone();
        let scrambled: Vec<usize> = (0..good.triangles.len()).filter(|t| t % 5 < 2).collect();
        for &triangle in &scrambled {
            mesh.triangles[triangle].swap(1, 2);
        }
        assert_eq!(orient_consistently(&mut mesh), Ok(scrambled.len()));
        assert_eq!(mesh, good);
        assert_eq!(orient_consistently(&mut mesh), Ok(0));
    }

    #[test]
    fn each_piece_keeps_the_orientation_of_its_majority() {
        let mut mesh = two_boxes();
        let first = block([1.0, 2.0, 3.0], [2, 3, 4]).mesh.triangles.len();
        // The first box inside out but for three triangles, its first among them.
        let inside_out = |t: &usize| ![0, 7, 11].contains(t);
        for triangle in (0..first).filter(inside_out) {
            mesh.triangles[triangle].swap(1, 2);
        }
        assert_eq!(orient_consistently(&mut mesh), Ok(3));
        assert!((mesh.volume() - (1.0 - 6.0)).abs() < 1e-12);
        assert_eq!(
            hinges(&mesh.triangles).len(),
            3 * mesh.triangles.len() / 2,
            "every edge of a closed mesh is a hinge"
        );
    }

    #[test]
    fn a_moebius_strip_is_refused_with_its_place() {
        let mut mesh = moebius(20);
        let before = mesh.clone();
        let fault = orient_consistently(&mut mesh).unwrap_err();
        assert_eq!(mesh, before);
        let places = fault.vertices.map(|v| mesh.positions[v as usize]);
        assert_eq!(fault.positions, places);
        let said = fault.to_string();
        assert!(said.contains(&from_to(places)), "{said}");
        assert!(said.contains("cut the mesh through there"), "{said}");
        // Cut through, it is a band with two sides.
        mesh.triangles.truncate(mesh.triangles.len() - 2);
        assert_eq!(orient_consistently(&mut mesh), Ok(0));
    }

    #[test]
    fn an_edge_of_three_triangles_joins_nothing() {
        let mut book = TriMesh {
            positions: vec![DVec3::ZERO; 5],
            triangles: vec![[0, 1, 2], [0, 1, 3], [1, 0, 4]],
        };
        assert_eq!(orient_consistently(&mut book), Ok(0));
    }
}
