//! Rectangular blocks: lattices with an inside.

use super::{EdgeName, Lattice, Segment, TriMesh};
use glam::{DVec3, UVec3};

/// Offsets along the axes.
const EDGES: [[i32; 3]; 3] = [[1, 0, 0], [0, 1, 0], [0, 0, 1]];

/// Offsets along the diagonals of faces and of whole cells.
const DIAGONALS: [[i32; 3]; 10] = [
    [1, 1, 0],
    [1, -1, 0],
    [0, 1, 1],
    [0, 1, -1],
    [1, 0, 1],
    [-1, 0, 1],
    [1, 1, 1],
    [1, 1, -1],
    [1, -1, 1],
    [1, -1, -1],
];

/// A block of `size` (m) along x, y and z, centred on the origin, of `cells` cells along each (at
/// least 1).
///
/// Structural pieces run along the axes; shear pieces along both diagonals of every face, inner ones
/// once, and the four diagonals of every cell; there are no bend pieces. The triangles are the
/// surface only. The named edges are whole faces, the corners `left-near-bottom` to `right-far-top`.
pub fn block(size: [f64; 3], cells: [u32; 3]) -> Lattice {
    let grid = Grid { cells };
    let size = DVec3::from(size);
    let cell = size / UVec3::from(cells).as_dvec3();
    let volume = cell.element_product();
    let place = |point| UVec3::from(point).as_dvec3() * cell - 0.5 * size;
    Lattice {
        mesh: TriMesh {
            positions: grid.points().map(place).collect(),
            triangles: grid.surface(),
        },
        shares: grid
            .points()
            .map(|point| 0.125 * volume * grid.cells_around(point, [0, 0, 0]))
            .collect(),
        structural: grid.segments(&EDGES, volume),
        shear: grid.segments(&DIAGONALS, volume),
        bend: Vec::new(),
        edges: grid.faces(),
        corners: grid.corners(),
    }
}

/// Grid points `[i, j, k]` along x, y and z, i running fastest.
struct Grid {
    cells: [u32; 3],
}

impl Grid {
    fn points(&self) -> impl Iterator<Item = [u32; 3]> + use<> {
        let [nx, ny, nz] = self.cells;
        (0..=nz).flat_map(move |k| (0..=ny).flat_map(move |j| (0..=nx).map(move |i| [i, j, k])))
    }

    fn vertex(&self, [i, j, k]: [u32; 3]) -> u32 {
        let [nx, ny, _] = self.cells;
        i + (nx + 1) * (j + (ny + 1) * k)
    }

    /// The grid point at an offset from another.
    fn beside(&self, point: [u32; 3], offset: [i32; 3]) -> Option<[u32; 3]> {
        let mut there = point;
        for axis in 0..3 {
            there[axis] = point[axis]
                .checked_add_signed(offset[axis])
                .filter(|&i| i <= self.cells[axis])?;
        }
        Some(there)
    }

    /// Number of cells that hold both a point and the one at `offset` (−1, 0 or 1 along each axis):
    /// along an axis with offset 0, those on both sides of the point.
    fn cells_around(&self, point: [u32; 3], offset: [i32; 3]) -> f64 {
        let along = |axis: usize| {
            let (i, n) = (point[axis], self.cells[axis]);
            if offset[axis] == 0 {
                f64::from(u8::from(i > 0) + u8::from(i < n))
            } else {
                1.0
            }
        };
        along(0) * along(1) * along(2)
    }

    /// The pieces from every point to those at the offsets, in cells of `volume` (m³).
    fn segments(&self, offsets: &[[i32; 3]], volume: f64) -> Vec<Segment> {
        let mut segments = Vec::new();
        for point in self.points() {
            for &offset in offsets {
                if let Some(there) = self.beside(point, offset) {
                    segments.push(Segment {
                        ends: [self.vertex(point), self.vertex(there)],
                        area: volume * self.cells_around(point, offset),
                    });
                }
            }
        }
        segments
    }

    /// The triangles of the six faces, counter-clockwise seen from outside.
    fn surface(&self) -> Vec<[u32; 3]> {
        let mut triangles = Vec::new();
        for normal in 0..3 {
            let (u, v) = ((normal + 1) % 3, (normal + 2) % 3);
            for point in self.points() {
                let on_face = point[normal] == 0 || point[normal] == self.cells[normal];
                if on_face && point[u] < self.cells[u] && point[v] < self.cells[v] {
                    let outward = point[normal] > 0;
                    triangles.extend(self.square(point, u, v, outward));
                }
            }
        }
        triangles
    }

    /// Two triangles on the square from `point` along the axes u and v, facing u × v or against it.
    ///
    /// Diagonals alternate: each joins points whose indices have an even sum.
    fn square(&self, point: [u32; 3], u: usize, v: usize, along_normal: bool) -> [[u32; 3]; 2] {
        let corner = |du, dv| {
            let mut corner = point;
            corner[u] += du;
            corner[v] += dv;
            self.vertex(corner)
        };
        let [a, b, c, d] = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
        let triangles = if point.iter().sum::<u32>().is_multiple_of(2) {
            [[a, b, c], [a, c, d]]
        } else {
            [[a, b, d], [b, c, d]]
        };
        if along_normal {
            triangles
        } else {
            triangles.map(|[a, b, c]| [a, c, b])
        }
    }

    fn faces(&self) -> Vec<(EdgeName, Vec<u32>)> {
        let [nx, _, nz] = self.cells;
        let face = |axis: usize, at: u32| {
            let on_face = self.points().filter(|point| point[axis] == at);
            on_face.map(|point| self.vertex(point)).collect()
        };
        vec![
            (EdgeName::Left, face(0, 0)),
            (EdgeName::Right, face(0, nx)),
            (EdgeName::Near, face(2, 0)),
            (EdgeName::Far, face(2, nz)),
        ]
    }

    fn corners(&self) -> Vec<(String, u32)> {
        let [nx, ny, nz] = self.cells;
        let mut corners = Vec::new();
        for (height, j) in [("bottom", 0), ("top", ny)] {
            for (depth, k) in [("near", 0), ("far", nz)] {
                for (side, i) in [("left", 0), ("right", nx)] {
                    let name = format!("{side}-{depth}-{height}");
                    corners.push((name, self.vertex([i, j, k])));
                }
            }
        }
        corners
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::open_edge;
    use std::collections::BTreeMap;

    const SIZE: [f64; 3] = [0.3, 0.5, 0.7];
    const CELLS: [[u32; 3]; 4] = [[1, 1, 1], [2, 3, 4], [5, 1, 2], [3, 3, 3]];

    /// Pieces by the number of axes that they run along, each once.
    fn pieces(lattice: &Lattice, segments: &[Segment], axes: usize) -> BTreeMap<[u32; 2], f64> {
        let mut pieces = BTreeMap::new();
        for &Segment { ends: [a, b], area } in segments {
            let [p, q] = [a, b].map(|vertex| lattice.mesh.positions[vertex as usize]);
            let along = (q - p).to_array().iter().filter(|d| d.abs() > 1e-9).count();
            if along == axes {
                let repeated = pieces.insert([a.min(b), a.max(b)], area);
                assert_eq!(repeated, None, "{a}–{b} twice");
            }
        }
        pieces
    }

    fn close(value: f64, exact: f64) -> bool {
        (value - exact).abs() < 1e-12 * exact.abs()
    }

    #[test]
    fn the_surface_is_closed_and_encloses_the_block() {
        for cells in CELLS {
            let mesh = block(SIZE, cells).mesh;
            let [x, y, z] = cells;
            assert_eq!(mesh.positions.len(), ((x + 1) * (y + 1) * (z + 1)) as usize);
            assert_eq!(mesh.triangles.len(), (4 * (x * y + y * z + z * x)) as usize);
            assert!(open_edge(&mesh).is_none(), "{cells:?}");
            assert!(close(mesh.volume(), 0.105), "{} m³", mesh.volume());
            let (low, high) = mesh.bounds().unwrap();
            assert!((low + 0.5 * DVec3::from(SIZE)).length() < 1e-15, "{low}");
            assert!((high - 0.5 * DVec3::from(SIZE)).length() < 1e-15, "{high}");
        }
    }

    #[test]
    fn shares_add_up_to_the_volume() {
        for cells in CELLS {
            let shared: f64 = block(SIZE, cells).shares.iter().sum();
            assert!(close(shared, 0.105), "{cells:?}: {shared} m³");
        }
    }

    /// A cell borders 12 edges and 12 face diagonals and holds 4 diagonals of its own, so their
    /// volumes add up to 12, 12 and 4 times the whole.
    #[test]
    fn every_piece_appears_once_with_the_volume_of_its_cells() {
        for cells in CELLS {
            let lattice = block(SIZE, cells);
            let [x, y, z] = cells;
            let edges = x * (y + 1) * (z + 1) + (x + 1) * y * (z + 1) + (x + 1) * (y + 1) * z;
            let faces = x * y * (z + 1) + (x + 1) * y * z + x * (y + 1) * z;
            for (segments, axes, count, times) in [
                (&lattice.structural, 1, edges, 12.0),
                (&lattice.shear, 2, 2 * faces, 12.0),
                (&lattice.shear, 3, 4 * x * y * z, 4.0),
            ] {
                let pieces = pieces(&lattice, segments, axes);
                assert_eq!(pieces.len(), count as usize, "{cells:?} along {axes} axes");
                let volume: f64 = pieces.values().sum();
                assert!(close(volume, times * 0.105), "{cells:?}: {volume} m³");
            }
            assert_eq!(lattice.structural.len(), edges as usize);
            assert_eq!(lattice.shear.len(), (2 * faces + 4 * x * y * z) as usize);
        }
    }

    #[test]
    fn surface_diagonals_have_shear_pieces_and_alternate() {
        let lattice = block(SIZE, [4, 2, 4]);
        let diagonals = pieces(&lattice, &lattice.shear, 2);
        let edges = pieces(&lattice, &lattice.structural, 1);
        let mut at_vertex = vec![0; lattice.mesh.positions.len()];
        for &edge in crate::mesh::edge_uses(&lattice.mesh.triangles).keys() {
            if diagonals.contains_key(&edge) {
                for vertex in edge {
                    at_vertex[vertex as usize] += 1;
                }
            } else {
                assert!(edges.contains_key(&edge));
            }
        }
        // The middle of the bottom, of even indices, has all four; its neighbour none.
        let middle = at_vertex[(2 + 5 * 3 * 2) as usize];
        let beside = at_vertex[(3 + 5 * 3 * 2) as usize];
        assert_eq!([middle, beside], [4, 0]);
    }

    #[test]
    fn faces_and_corners_lie_where_their_names_say() {
        let lattice = block(SIZE, [2, 3, 4]);
        let at = |vertex: u32| lattice.mesh.positions[vertex as usize];
        for ((name, vertices), (axis, place, count)) in lattice.edges.iter().zip([
            (DVec3::X, -0.15, 20),
            (DVec3::X, 0.15, 20),
            (DVec3::Z, -0.35, 12),
            (DVec3::Z, 0.35, 12),
        ]) {
            assert_eq!(vertices.len(), count, "{name:?}");
            for &vertex in vertices {
                let off = at(vertex).dot(axis) - place;
                assert!(off.abs() < 1e-15, "{name:?}: {}", at(vertex));
            }
        }
        assert_eq!(lattice.corners.len(), 8);
        for (name, vertex) in &lattice.corners {
            let side = |word, high: f64| if name.contains(word) { high } else { -high };
            let place = DVec3::new(side("right", 0.15), side("top", 0.25), side("far", 0.35));
            assert!(at(*vertex).distance(place) < 1e-15, "{name}");
        }
    }
}
