//! The triangle mesh that every shape becomes.

use glam::DVec3;

/// A triangle mesh: positions and triangles, nothing that moves or weighs.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TriMesh {
    /// Vertex positions (m).
    pub positions: Vec<DVec3>,
    /// Vertex indices of one triangle an entry, counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
}

impl TriMesh {
    /// The three corners of a triangle (m).
    #[inline]
    pub fn corners(&self, [a, b, c]: [u32; 3]) -> [DVec3; 3] {
        let at = |vertex: u32| self.positions[vertex as usize];
        [at(a), at(b), at(c)]
    }

    /// Enclosed volume (m³), negative when the mesh is inside out.
    ///
    /// V = Σ a · (b × c) / 6 over the triangles (divergence theorem); meaningful for closed meshes.
    pub fn volume(&self) -> f64 {
        self.triangles
            .iter()
            .map(|&triangle| {
                let [a, b, c] = self.corners(triangle);
                a.dot(b.cross(c)) / 6.0
            })
            .sum()
    }

    /// Smallest and largest coordinates (m); `None` for a mesh without vertices.
    pub fn bounds(&self) -> Option<(DVec3, DVec3)> {
        let first = *self.positions.first()?;
        Some(
            self.positions
                .iter()
                .fold((first, first), |(low, high), &p| (low.min(p), high.max(p))),
        )
    }
}

/// Area of a triangle (m²): |(b − a) × (c − a)| / 2.
pub fn triangle_area([a, b, c]: [DVec3; 3]) -> f64 {
    0.5 * (b - a).cross(c - a).length()
}
