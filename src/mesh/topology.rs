//! Which triangles share an edge: whether a mesh encloses a volume, or is a surface at all.

use super::TriMesh;
use glam::DVec3;
use std::collections::BTreeMap;
use std::fmt;

/// An edge at which a mesh is open or inconsistently oriented.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OpenEdge {
    /// Its vertices.
    pub vertices: [u32; 2],
    /// Their positions (m).
    pub positions: [DVec3; 2],
    /// Triangles that run along it forwards and backwards.
    pub uses: [usize; 2],
    /// Number of such edges in the whole mesh.
    pub total: usize,
}

impl fmt::Display for OpenEdge {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [forwards, backwards] = self.uses;
        let fault = if forwards + backwards == 1 {
            "has a triangle on one side only"
        } else {
            "is not used equally in both directions"
        };
        write!(
            f,
            "the edge {} {fault} ({} such edges)",
            from_to(self.positions),
            self.total
        )
    }
}

/// An edge of three or more triangles: no surface there, but several that meet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NonManifoldEdge {
    /// Its vertices.
    pub vertices: [u32; 2],
    /// Their positions (m).
    pub positions: [DVec3; 2],
    /// Number of triangles at it.
    pub triangles: usize,
    /// Number of such edges in the whole mesh.
    pub total: usize,
}

impl fmt::Display for NonManifoldEdge {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "the edge {} has {} triangles, cloth has at most two ({} such edges); remove the extra \
             triangles, or split the mesh there and leave a gap, since vertices at the same place \
             are merged",
            from_to(self.positions),
            self.triangles,
            self.total
        )
    }
}

/// Where an edge is, to a tenth of a millimetre.
pub(super) fn from_to([a, b]: [DVec3; 2]) -> String {
    let place = |p: DVec3| format!("({:.4}, {:.4}, {:.4})", p.x, p.y, p.z);
    format!("from {} to {}", place(a), place(b))
}

/// Number of triangles along each undirected edge, forwards (from the lower index) and backwards.
pub fn edge_uses(triangles: &[[u32; 3]]) -> BTreeMap<[u32; 2], [usize; 2]> {
    let mut uses: BTreeMap<[u32; 2], [usize; 2]> = BTreeMap::new();
    for &[a, b, c] in triangles {
        for [i, j] in [[a, b], [b, c], [c, a]] {
            let direction = usize::from(i > j);
            uses.entry([i.min(j), i.max(j)]).or_default()[direction] += 1;
        }
    }
    uses
}

/// The first edge at which a mesh doesn't close, `None` for a closed and consistently oriented one.
///
/// Closed: each edge is used equally often in both directions. An edge of four triangles, where two
/// bodies touch, is fine.
pub fn open_edge(mesh: &TriMesh) -> Option<OpenEdge> {
    let uses = edge_uses(&mesh.triangles);
    let mut open = uses.iter().filter(|(_, [there, back])| there != back);
    let (&vertices, &uses) = open.next()?;
    Some(OpenEdge {
        vertices,
        positions: vertices.map(|vertex| mesh.positions[vertex as usize]),
        uses,
        total: 1 + open.count(),
    })
}

/// The first edge of three or more triangles, `None` for a mesh that can be cloth.
pub fn non_manifold_edge(mesh: &TriMesh) -> Option<NonManifoldEdge> {
    let uses = edge_uses(&mesh.triangles);
    let mut crowded = uses
        .iter()
        .map(|(vertices, [there, back])| (vertices, there + back))
        .filter(|(_, triangles)| *triangles > 2);
    let (&vertices, triangles) = crowded.next()?;
    Some(NonManifoldEdge {
        vertices,
        positions: vertices.map(|vertex| mesh.positions[vertex as usize]),
        triangles,
        total: 1 + crowded.count(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{block, read_obj};

    #[test]
    fn an_edge_of_three_triangles_is_found_with_place_and_remedy() {
        // Three pages at the spine 0–1 and two more, of four, at the edge 2–3.
        let pages = "v 0 0 0\nv 0 1 0\nv 1 0.5 0\nv -1 0.5 0\nv 0 0.5 1\nv 0 0.5 2\nv 0 0.5 3\n\
            f 1 2 3\nf 2 1 4\nf 2 1 5\nf 3 4 5\nf 4 3 6\nf 3 4 6\nf 3 4 7\n";
        let (mesh, _) = read_obj(pages, 0.5).unwrap();
        let edge = non_manifold_edge(&mesh).unwrap();
        assert_eq!((edge.vertices, edge.triangles, edge.total), ([0, 1], 3, 2));
        let said = edge.to_string();
        assert!(
            said.starts_with(
                "the edge from (0.0000, 0.0000, 0.0000) to (0.0000, 0.5000, 0.0000) has 3 triangles"
            ),
            "{said}"
        );
        assert!(
            said.contains("(2 such edges); remove the extra triangles"),
            "{said}"
        );
    }

    #[test]
    fn closed_and_open_surfaces_are_manifold() {
        let mut mesh = block([1.0, 1.0, 1.0], [2, 3, 4]).mesh;
        assert_eq!(non_manifold_edge(&mesh), None);
        mesh.triangles.truncate(9);
        assert_eq!(non_manifold_edge(&mesh), None);
    }
}
