//! Which triangles share an edge, and whether a mesh encloses a volume.

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
        let [a, b] = self.positions;
        let [forwards, backwards] = self.uses;
        let fault = if forwards + backwards == 1 {
            "has a triangle on one side only"
        } else {
            "is not used equally in both directions"
        };
        write!(
            f,
            "the edge from ({:.4}, {:.4}, {:.4}) to ({:.4}, {:.4}, {:.4}) {fault} ({} such edges)",
            a.x, a.y, a.z, b.x, b.y, b.z, self.total
        )
    }
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
