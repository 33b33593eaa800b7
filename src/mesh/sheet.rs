//! Rectangular sheets in the xz plane, with or without a round opening.

use super::opening::{Hole, Opening, OpeningTooLarge};
use super::{EdgeName, Lattice, Segment, TriMesh};
use glam::{DVec2, DVec3, dvec3};
use serde::{Deserialize, Serialize};

/// A rectangular sheet, centred on the origin: u along +x, v along +z.
#[derive(Clone, Debug, PartialEq)]
pub struct Sheet {
    /// Width along x and along z (m).
    pub size: [f64; 2],
    /// Number of cells along x and along z, at least 1.
    pub cells: [u32; 2],
    /// Which diagonals the cells have.
    pub diagonals: Diagonals,
    /// A round hole.
    pub opening: Option<Opening>,
}

/// Which diagonals of a sheet's cells carry shear springs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Diagonals {
    /// None: nothing resists shear (triangles as with `Alternating`).
    None,
    /// All in one direction: biased.
    OneWay,
    /// Neighbouring cells differ: unbiased with one spring a cell.
    #[default]
    Alternating,
    /// Two a cell: unbiased (triangles as with `Alternating`).
    Both,
}

impl Sheet {
    /// The sheet's vertices, triangles and spring places.
    ///
    /// # Errors
    ///
    /// When the opening doesn't fit into the sheet.
    pub fn lattice(&self) -> Result<Lattice, OpeningTooLarge> {
        let hole = self
            .opening
            .as_ref()
            .map(|opening| Hole::new(self, opening))
            .transpose()?;
        let grid = Grid::new(self, hole.as_ref());
        if let (Some(opening), true) = (&self.opening, grid.folds()) {
            return Err(OpeningTooLarge::of(opening));
        }
        let mut lattice = Lattice {
            mesh: grid.mesh(self),
            ..Lattice::default()
        };
        lattice.shares = grid.shares(&lattice.mesh.positions);
        lattice.structural = grid.structural(&lattice.mesh.positions);
        lattice.shear = grid.shear(&lattice.mesh.positions, self.diagonals);
        lattice.bend = grid.bend(&lattice.mesh.positions);
        lattice.edges = grid.edges();
        lattice.corners = grid.corners();
        Ok(lattice)
    }

    /// Width of a cell along x and z (m).
    pub(super) fn cell_size(&self) -> DVec2 {
        DVec2::new(
            self.size[0] / f64::from(self.cells[0]),
            self.size[1] / f64::from(self.cells[1]),
        )
    }

    fn grid_point(&self, i: u32, j: u32) -> DVec2 {
        let h = self.cell_size();
        DVec2::new(
            f64::from(i) * h.x - 0.5 * self.size[0],
            f64::from(j) * h.y - 0.5 * self.size[1],
        )
    }
}

/// The grid's vertices and cells that are left beside an opening.
struct Grid {
    cells: [u32; 2],
    /// Vertex of each grid point, row by row; `None` inside the opening.
    vertex: Vec<Option<u32>>,
    points: Vec<DVec2>,
    /// Cells inside the opening are gone.
    open: Vec<bool>,
}

impl Grid {
    fn new(sheet: &Sheet, hole: Option<&Hole>) -> Self {
        let [columns, rows] = sheet.cells;
        let mut grid = Self {
            cells: sheet.cells,
            vertex: Vec::new(),
            points: Vec::new(),
            open: Vec::new(),
        };
        let mut next = 0;
        for j in 0..=rows {
            for i in 0..=columns {
                let inside = hole.is_some_and(|hole| hole.ring(i, j) < hole.inner);
                grid.vertex.push((!inside).then_some(next));
                if !inside {
                    next += 1;
                    let point = sheet.grid_point(i, j);
                    grid.points
                        .push(hole.map_or(point, |hole| hole.bend(i, j, point)));
                }
            }
        }
        for j in 0..rows {
            for i in 0..columns {
                let within = |(i, j)| hole.is_some_and(|hole| hole.ring(i, j) <= hole.inner);
                grid.open.push(
                    [(i, j), (i + 1, j), (i, j + 1), (i + 1, j + 1)]
                        .into_iter()
                        .all(within),
                );
            }
        }
        grid
    }

    fn at(&self, i: u32, j: u32) -> Option<u32> {
        let [columns, rows] = self.cells;
        (i <= columns && j <= rows).then(|| self.vertex[(j * (columns + 1) + i) as usize])?
    }

    /// The cell's vertices, clockwise seen from +y: (i, j), (i+1, j), (i+1, j+1), (i, j+1).
    fn cell(&self, i: u32, j: u32) -> Option<[u32; 4]> {
        let [columns, rows] = self.cells;
        if i >= columns || j >= rows || self.open[(j * columns + i) as usize] {
            return None;
        }
        Some([
            self.at(i, j)?,
            self.at(i + 1, j)?,
            self.at(i + 1, j + 1)?,
            self.at(i, j + 1)?,
        ])
    }

    /// Every cell that is left, with its indices.
    fn each_cell(&self) -> impl Iterator<Item = ([u32; 2], [u32; 4])> + '_ {
        let [columns, rows] = self.cells;
        (0..rows)
            .flat_map(move |j| (0..columns).map(move |i| [i, j]))
            .filter_map(|[i, j]| Some(([i, j], self.cell(i, j)?)))
    }

    /// Whether bending has turned a cell over, as it does where cells are much longer than wide.
    fn folds(&self) -> bool {
        self.each_cell().any(|(_, [a, b, c, d])| {
            let [a, b, c, d] = [a, b, c, d].map(|vertex| self.points[vertex as usize]);
            let corners = [
                (b - a, d - a),
                (c - b, a - b),
                (d - c, b - c),
                (a - d, c - d),
            ];
            corners.iter().any(|(p, q)| p.perp_dot(*q) <= 0.0)
        })
    }

    fn mesh(&self, sheet: &Sheet) -> TriMesh {
        let mut triangles = Vec::new();
        for ([i, j], [a, b, c, d]) in self.each_cell() {
            // Counter-clockwise seen from +y, where u × v points down: normals point up.
            if falling(sheet.diagonals, i, j) {
                triangles.extend([[a, d, b], [b, d, c]]);
            } else {
                triangles.extend([[a, c, b], [a, d, c]]);
            }
        }
        let positions = self.points.iter().map(|p| dvec3(p.x, 0.0, p.y)).collect();
        TriMesh {
            positions,
            triangles,
        }
    }

    fn shares(&self, positions: &[DVec3]) -> Vec<f64> {
        let mut shares = vec![0.0; positions.len()];
        for (_, cell) in self.each_cell() {
            for vertex in cell {
                shares[vertex as usize] += 0.25 * cell_area(positions, cell);
            }
        }
        shares
    }

    /// Area of the cells on both sides of the piece from (i, j) to the next grid point along x or z.
    fn beside(&self, i: u32, j: u32, along_x: bool, positions: &[DVec3]) -> f64 {
        let area = |i, j| {
            self.cell(i, j)
                .map_or(0.0, |cell| cell_area(positions, cell))
        };
        let other = if along_x {
            j.checked_sub(1).map(|j| (i, j))
        } else {
            i.checked_sub(1).map(|i| (i, j))
        };
        area(i, j) + other.map_or(0.0, |(i, j)| area(i, j))
    }

    fn structural(&self, positions: &[DVec3]) -> Vec<Segment> {
        self.segments(|i, j, along_x| {
            let there = if along_x {
                self.at(i + 1, j)
            } else {
                self.at(i, j + 1)
            };
            Some((there?, self.beside(i, j, along_x, positions)))
        })
    }

    /// Second neighbours; a spring stands for the cells beside both pieces that it spans.
    fn bend(&self, positions: &[DVec3]) -> Vec<Segment> {
        self.segments(|i, j, along_x| {
            let [middle, there] = [1, 2].map(|step| {
                if along_x {
                    (i + step, j)
                } else {
                    (i, j + step)
                }
            });
            let first = self.beside(i, j, along_x, positions);
            let second = self
                .at(middle.0, middle.1)
                .map(|_| self.beside(middle.0, middle.1, along_x, positions))?;
            let whole = if first > 0.0 && second > 0.0 {
                first + second
            } else {
                0.0
            };
            Some((self.at(there.0, there.1)?, whole))
        })
    }

    /// Segments from every grid point along x and along z, given their other end and area; those
    /// without cloth beside them are left out.
    fn segments(&self, to: impl Fn(u32, u32, bool) -> Option<(u32, f64)>) -> Vec<Segment> {
        let [columns, rows] = self.cells;
        let mut segments = Vec::new();
        for j in 0..=rows {
            for i in 0..=columns {
                let Some(here) = self.at(i, j) else { continue };
                for along_x in [true, false] {
                    if let Some((there, area)) = to(i, j, along_x).filter(|(_, area)| *area > 0.0) {
                        segments.push(Segment {
                            ends: [here, there],
                            area,
                        });
                    }
                }
            }
        }
        segments
    }

    fn shear(&self, positions: &[DVec3], diagonals: Diagonals) -> Vec<Segment> {
        let mut segments = Vec::new();
        for ([i, j], cell) in self.each_cell() {
            let area = cell_area(positions, cell);
            let [a, b, c, d] = cell;
            let (rising, falls) = (
                Segment { ends: [a, c], area },
                Segment { ends: [b, d], area },
            );
            match diagonals {
                Diagonals::None => {}
                Diagonals::Both => segments.extend([rising, falls]),
                _ if falling(diagonals, i, j) => segments.push(falls),
                _ => segments.push(rising),
            }
        }
        segments
    }

    fn edges(&self) -> Vec<(EdgeName, Vec<u32>)> {
        let [columns, rows] = self.cells;
        let column = |i| (0..=rows).filter_map(|j| self.at(i, j)).collect();
        let row = |j| (0..=columns).filter_map(|i| self.at(i, j)).collect();
        vec![
            (EdgeName::Left, column(0)),
            (EdgeName::Right, column(columns)),
            (EdgeName::Near, row(0)),
            (EdgeName::Far, row(rows)),
        ]
    }

    fn corners(&self) -> Vec<(String, u32)> {
        let [columns, rows] = self.cells;
        [
            ("left-near", 0, 0),
            ("right-near", columns, 0),
            ("left-far", 0, rows),
            ("right-far", columns, rows),
        ]
        .into_iter()
        .filter_map(|(name, i, j)| Some((name.to_owned(), self.at(i, j)?)))
        .collect()
    }
}

/// Whether a cell's triangles meet along the diagonal from (i+1, j) to (i, j+1).
fn falling(diagonals: Diagonals, i: u32, j: u32) -> bool {
    diagonals != Diagonals::OneWay && (i + j) % 2 == 1
}

/// Area of a flat cell (m²): half the cross product of its diagonals.
fn cell_area(positions: &[DVec3], [a, b, c, d]: [u32; 4]) -> f64 {
    let [a, b, c, d] = [a, b, c, d].map(|vertex| positions[vertex as usize]);
    0.5 * (c - a).cross(d - b).length()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::triangle_area;
    use std::f64::consts::PI;

    fn sheet(diagonals: Diagonals, opening: Option<Opening>) -> Sheet {
        Sheet {
            size: [1.3, 1.3],
            cells: [60, 60],
            diagonals,
            opening,
        }
    }

    /// Area of all triangles (m²).
    fn covered(lattice: &Lattice) -> f64 {
        let mesh = &lattice.mesh;
        let areas = mesh
            .triangles
            .iter()
            .map(|&t| triangle_area(mesh.corners(t)));
        areas.sum()
    }

    fn smallest_angle(mesh: &TriMesh) -> f64 {
        let mut smallest = PI;
        for &triangle in &mesh.triangles {
            let [a, b, c] = mesh.corners(triangle);
            for (p, q, r) in [(a, b, c), (b, c, a), (c, a, b)] {
                smallest = smallest.min((q - p).angle_between(r - p));
            }
        }
        smallest
    }

    #[test]
    fn shares_and_triangles_cover_the_sheet() {
        for diagonals in [
            Diagonals::None,
            Diagonals::OneWay,
            Diagonals::Alternating,
            Diagonals::Both,
        ] {
            let lattice = sheet(diagonals, None).lattice().unwrap();
            let covered = covered(&lattice);
            let shared: f64 = lattice.shares.iter().sum();
            assert!(
                (covered - 1.69).abs() < 1e-12,
                "{diagonals:?}: triangles cover {covered} m²"
            );
            assert!(
                (shared - 1.69).abs() < 1e-12,
                "{diagonals:?}: shares sum to {shared} m²"
            );
            assert!(lattice.mesh.triangles.iter().all(|&t| {
                let [a, b, c] = lattice.mesh.corners(t);
                (b - a).cross(c - a).y > 0.0
            }));
        }
    }

    #[test]
    fn opening_has_a_round_border_and_good_triangles_wherever_it_is() {
        for (center, radius) in [([0.0, 0.0], 0.11), ([0.013, -0.2], 0.07), ([0.3, 0.3], 0.2)] {
            let opening = Opening { center, radius };
            let lattice = sheet(Diagonals::Alternating, Some(opening))
                .lattice()
                .unwrap();
            let away = |vertex: u32| {
                let p = lattice.mesh.positions[vertex as usize];
                (p.x - center[0]).hypot(p.z - center[1])
            };
            let uses = crate::mesh::edge_uses(&lattice.mesh.triangles);
            let border: Vec<_> = uses
                .iter()
                .filter(|(ends, uses)| uses[0] + uses[1] == 1 && away(ends[0]) < 1.2 * radius)
                .collect();
            assert!(border.len() >= 16, "{} border edges", border.len());
            for (ends, _) in border {
                for vertex in *ends {
                    assert!(
                        (away(vertex) - radius).abs() < 1e-12,
                        "border vertex at {}",
                        away(vertex)
                    );
                }
            }
            let covered = covered(&lattice);
            let exact = 1.69 - PI * radius * radius;
            assert!(
                (covered - exact).abs() < 0.02 * PI * radius * radius,
                "{covered} m² against {exact}"
            );
            assert!(
                smallest_angle(&lattice.mesh) > 0.3,
                "smallest angle {} rad",
                smallest_angle(&lattice.mesh)
            );
        }
    }

    #[test]
    fn an_opening_that_does_not_fit_is_refused() {
        let opening = Some(Opening {
            center: [0.6, 0.0],
            radius: 0.11,
        });
        assert!(sheet(Diagonals::Both, opening).lattice().is_err());
    }
}
