//! What a cloth is made of before it has mass: vertices, triangles and the places of its springs.

use super::TriMesh;

/// A cloth's shape at rest, in its own coordinates.
#[derive(Clone, Debug, Default)]
pub struct Lattice {
    /// Vertices (m) and triangles; a chain has no triangles.
    pub mesh: TriMesh,
    /// Share of the whole that each vertex stands for: area (m²) of a sheet, length (m) of a chain,
    /// volume (m³) of a block.
    pub shares: Vec<f64>,
    /// Places of the springs along the weave; of a mesh without one, along its edges.
    pub structural: Vec<Segment>,
    /// Places of the springs along the cells' diagonals.
    pub shear: Vec<Segment>,
    /// Places of the springs between second neighbours.
    pub bend: Vec<Segment>,
    /// Vertices of each named edge.
    pub edges: Vec<(EdgeName, Vec<u32>)>,
    /// Vertices of each named corner.
    pub corners: Vec<(String, u32)>,
}

impl Lattice {
    /// How many pieces between second neighbours run along each structural one: two inside, one at an
    /// end of a row, none in a row of one piece.
    pub fn bends_along(&self) -> Vec<u32> {
        let mut neighbours = vec![Vec::new(); self.mesh.positions.len()];
        for (piece, Segment { ends: [a, b], .. }) in self.structural.iter().enumerate() {
            neighbours[*a as usize].push((*b, piece));
            neighbours[*b as usize].push((*a, piece));
        }
        let mut along = vec![0; self.structural.len()];
        for Segment { ends: [a, c], .. } in &self.bend {
            for &(middle, first) in &neighbours[*a as usize] {
                let onward = neighbours[middle as usize].iter();
                for &(_, second) in onward.filter(|(end, _)| end == c) {
                    along[first] += 1;
                    along[second] += 1;
                }
            }
        }
        along
    }
}

/// A straight piece between two vertices.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Segment {
    /// Its vertices.
    pub ends: [u32; 2],
    /// Area of the cells that it borders or crosses (m²); of a block, their volume (m³); 0 in a
    /// chain.
    pub area: f64,
}

/// An edge of a sheet, or a face of a block, before it is placed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Deserialize, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum EdgeName {
    /// At −x.
    Left,
    /// At +x.
    Right,
    /// At −z.
    Near,
    /// At +z.
    Far,
}
