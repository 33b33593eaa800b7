//! OBJ files in and out.
//!
//! Reading takes what people have: polygons, several objects, missing normals, negative indices,
//! doubled vertices. What can be repaired is repaired and counted; what can't is refused with its
//! place.

use super::{TriMesh, triangle_area};
use glam::{DVec3, dvec3};
use std::collections::BTreeMap;
use std::fmt::Write as _;

/// What was repaired while a mesh was read.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Repairs {
    /// Vertices that repeated another's position and were merged with it.
    pub merged_vertices: usize,
    /// Triangles without area, to rounding.
    pub degenerate_triangles: usize,
    /// Triangles that repeated another.
    pub duplicate_triangles: usize,
    /// Whether the mesh was inside out.
    pub turned: bool,
    /// Triangles that faced the other way than their neighbours.
    pub turned_triangles: usize,
}

/// Why an OBJ file can't be used.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ObjError {
    /// A line that can't be understood.
    #[error("line {line}: {cause}")]
    Line {
        /// Its number, from 1.
        line: usize,
        /// What is wrong with it, and the remedy.
        cause: String,
    },
    /// No triangle is left.
    #[error("holds no triangles; an OBJ needs \"v x y z\" and \"f a b c\" lines")]
    Empty,
    /// The OBJ reader refused it for another reason.
    #[error("can't be read as OBJ: {0}")]
    Unreadable(String),
}

/// Reads a triangle mesh from an OBJ file's text, positions multiplied by `scale`.
///
/// Polygons are cut into triangles and all objects are merged into one mesh. Vertices at the same
/// place are merged, so that objects that share a border are joined. Triangles without area and
/// repeated ones are dropped. Dropping one with three places in a row may leave a T-junction: its
/// middle vertex then lies on its neighbour's edge without being joined to it, and the mesh is open
/// there.
///
/// # Errors
///
/// A line with a bad number or an index out of range; a file without triangles.
pub fn read_obj(text: &str, scale: f64) -> Result<(TriMesh, Repairs), ObjError> {
    check_lines(text)?;
    let options = tobj::LoadOptions {
        triangulate: true,
        ignore_points: true,
        ignore_lines: true,
        ..tobj::LoadOptions::default()
    };
    // Materials don't matter here: an absent library must not keep a mesh from being read.
    let no_materials = |_: &std::path::Path| Err(tobj::LoadError::OpenFileFailed);
    let (models, _) = tobj::load_obj_buf(&mut text.as_bytes(), &options, no_materials)
        .map_err(|error| ObjError::Unreadable(error.to_string()))?;
    let mut soup = TriMesh::default();
    for model in &models {
        let first = index(soup.positions.len());
        let positions = model.mesh.positions.chunks_exact(3);
        soup.positions
            .extend(positions.map(|p| dvec3(p[0], p[1], p[2]) * scale));
        let corners = model.mesh.indices.chunks_exact(3);
        soup.triangles
            .extend(corners.map(|c| [c[0] + first, c[1] + first, c[2] + first]));
    }
    let (mesh, repairs) = weld(&soup);
    if mesh.triangles.is_empty() {
        Err(ObjError::Empty)
    } else {
        Ok((mesh, repairs))
    }
}

/// Writes a mesh as OBJ, positions to a hundredth of a millimetre.
pub fn write_obj(mesh: &TriMesh, comment: &str) -> String {
    let mut text = String::new();
    for line in comment.lines() {
        let _ = writeln!(text, "# {line}");
    }
    for p in &mesh.positions {
        let _ = writeln!(text, "v {:.5} {:.5} {:.5}", p.x, p.y, p.z);
    }
    for [a, b, c] in &mesh.triangles {
        let _ = writeln!(text, "f {} {} {}", a + 1, b + 1, c + 1);
    }
    text
}

/// Whether a closed and consistently oriented mesh is inside out: it encloses a negative volume. The
/// pieces of a mesh count together.
pub fn is_inside_out(mesh: &TriMesh) -> bool {
    mesh.volume() < 0.0
}

/// Turns an inside-out closed mesh, and says whether it did.
pub fn orient_outward(mesh: &mut TriMesh) -> bool {
    let inside_out = is_inside_out(mesh);
    if inside_out {
        for triangle in &mut mesh.triangles {
            triangle.swap(1, 2);
        }
    }
    inside_out
}

/// Finds the line of a fault: the OBJ reader names none, and takes NaN for a number.
fn check_lines(text: &str) -> Result<(), ObjError> {
    let total = text
        .lines()
        .filter(|line| line.split_whitespace().next() == Some("v"))
        .count();
    let mut seen = 0;
    for (number, line) in text.lines().enumerate() {
        let mut words = line.split_whitespace();
        let fault = match words.next() {
            Some("v") => {
                seen += 1;
                vertex_fault(words)
            }
            Some("f") => face_fault(words, seen, total),
            _ => None,
        };
        if let Some(cause) = fault {
            return Err(ObjError::Line {
                line: number + 1,
                cause,
            });
        }
    }
    Ok(())
}

fn vertex_fault<'a>(words: impl Iterator<Item = &'a str>) -> Option<String> {
    let coordinates: Vec<&str> = words.take(3).collect();
    if coordinates.len() < 3 {
        return Some("a vertex needs three coordinates".to_owned());
    }
    let bad = coordinates
        .iter()
        .find(|word| !word.parse::<f64>().is_ok_and(f64::is_finite))?;
    Some(format!(
        "\"{bad}\" is not a finite number; export the mesh again or remove its broken vertices"
    ))
}

/// Indices count from 1, or back from the vertices read so far when they are negative.
fn face_fault<'a>(words: impl Iterator<Item = &'a str>, seen: i64, total: usize) -> Option<String> {
    for word in words {
        let first = word.split('/').next().unwrap_or_default();
        let Ok(index) = first.parse::<i64>() else {
            return Some(format!("\"{word}\" is not a vertex index"));
        };
        let fits = if index < 0 {
            -index <= seen
        } else {
            index > 0 && index.unsigned_abs() <= total as u64
        };
        if !fits {
            return Some(format!(
                "vertex index {index} is out of range: the file has {total} vertices, counted from 1"
            ));
        }
    }
    None
}

/// Merges vertices at the same place; drops triangles without area and repeated ones.
fn weld(soup: &TriMesh) -> (TriMesh, Repairs) {
    let mut repairs = Repairs::default();
    let mut mesh = TriMesh::default();
    let mut at_place: BTreeMap<[u64; 3], u32> = BTreeMap::new();
    let vertex_of: Vec<u32> = soup
        .positions
        .iter()
        .map(|&p| {
            *at_place.entry(place(p)).or_insert_with(|| {
                mesh.positions.push(p);
                index(mesh.positions.len() - 1)
            })
        })
        .collect();
    repairs.merged_vertices = soup.positions.len() - mesh.positions.len();
    let mut known = std::collections::BTreeSet::new();
    for triangle in &soup.triangles {
        let triangle = triangle.map(|vertex| vertex_of[vertex as usize]);
        if is_sliver(mesh.corners(triangle)) {
            repairs.degenerate_triangles += 1;
        } else if !known.insert(smallest_first(triangle)) {
            repairs.duplicate_triangles += 1;
        } else {
            mesh.triangles.push(triangle);
        }
    }
    (drop_unused(&mesh), repairs)
}

/// Whether a triangle's area is 0 to rounding.
///
/// A sliver's height over its longest edge is below 2·10⁻¹² of that edge: ten times the error that
/// rounding leaves in three places in a row whose coordinates are 10³ times their distance.
fn is_sliver([a, b, c]: [DVec3; 3]) -> bool {
    let longest_squared = a
        .distance_squared(b)
        .max(b.distance_squared(c))
        .max(c.distance_squared(a));
    triangle_area([a, b, c]) <= 1e-12 * longest_squared
}

/// Bits that are equal for equal coordinates (−0 counts as 0).
fn place(p: DVec3) -> [u64; 3] {
    p.to_array().map(|x| (x + 0.0).to_bits())
}

/// The triangle with its smallest vertex first, its sense kept.
fn smallest_first([a, b, c]: [u32; 3]) -> [u32; 3] {
    if a < b && a < c {
        [a, b, c]
    } else if b < c {
        [b, c, a]
    } else {
        [c, a, b]
    }
}

/// The same mesh without vertices that no triangle uses.
fn drop_unused(mesh: &TriMesh) -> TriMesh {
    let mut new_index = vec![None; mesh.positions.len()];
    let mut positions = Vec::new();
    let triangles = mesh
        .triangles
        .iter()
        .map(|triangle| {
            triangle.map(|vertex| {
                *new_index[vertex as usize].get_or_insert_with(|| {
                    positions.push(mesh.positions[vertex as usize]);
                    index(positions.len() - 1)
                })
            })
        })
        .collect();
    TriMesh {
        positions,
        triangles,
    }
}

/// Meshes of more than 2³² vertices don't fit into the machine's memory.
#[expect(clippy::cast_possible_truncation, reason = "see above")]
fn index(i: usize) -> u32 {
    i as u32
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::open_edge;

    const CUBE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n\
        o bottom\nf 4 3 2 1\nf -4 -3 -2 -1\no sides\nf 1 2 6 5\nf 2/1 3/2 7/3 6/4\nf 3 4 8 7\nf 4 1 5 8\n";

    #[test]
    fn polygons_objects_and_negative_indices_become_one_closed_mesh() {
        let (mesh, repairs) = read_obj(CUBE, 2.0).unwrap();
        assert_eq!((mesh.positions.len(), mesh.triangles.len()), (8, 12));
        assert!(open_edge(&mesh).is_none());
        assert!((mesh.volume() - 8.0).abs() < 1e-12);
        assert_eq!(
            (repairs.degenerate_triangles, repairs.duplicate_triangles),
            (0, 0)
        );
    }

    #[test]
    fn duplicates_and_degenerates_are_dropped_and_counted() {
        let text = format!("{CUBE}f 1 2 6\nf 1 1 2\nf 1 2 2\n");
        let (mesh, repairs) = read_obj(&text, 1.0).unwrap();
        assert_eq!(
            (repairs.degenerate_triangles, repairs.duplicate_triangles),
            (2, 1)
        );
        assert!(open_edge(&mesh).is_none());
    }

    #[test]
    fn slivers_are_without_area_whatever_their_size() {
        let row = [0.1, 0.2, 0.7].map(|t| dvec3(t, 3.0 * t, 0.3 * t));
        assert!(triangle_area(row) > 0.0, "rounding leaves an area");
        for scale in [1e-6, 1.0, 1e6] {
            let degenerate = |height: f64| {
                let text = format!("{CUBE}v 2 0 0\nv 3 0 0\nv 2.5 {height:e} 0\nf 9 10 11\n");
                let (mesh, repairs) = read_obj(&text, scale).unwrap();
                assert_eq!(
                    mesh.triangles.len() + repairs.degenerate_triangles,
                    13,
                    "nothing else is dropped"
                );
                repairs.degenerate_triangles
            };
            assert_eq!([1e-9, 1e-11, 1e-13, 0.0].map(degenerate), [0, 0, 1, 1]);
            assert!(is_sliver(row.map(|p| p * scale)));
        }
    }

    #[test]
    fn an_inside_out_mesh_is_turned() {
        let (mut mesh, _) =
            read_obj(&CUBE.replace("v 0", "v -0").replace("v 1", "v -1"), 1.0).unwrap();
        assert!(is_inside_out(&mesh) && orient_outward(&mut mesh) && mesh.volume() > 0.0);
        assert!(!is_inside_out(&mesh) && !orient_outward(&mut mesh));
    }

    #[test]
    fn faults_name_their_line() {
        let at = |text: &str| read_obj(text, 1.0).unwrap_err().to_string();
        assert!(at("v 0 0 0\nv 1 nan 0\n").starts_with("line 2: \"nan\""));
        assert!(at("v 0 0\n").starts_with("line 1: a vertex needs"));
        assert!(at("v 0 0 0\nf 1 2 3\n").starts_with("line 2: vertex index 2 is out of range"));
        assert!(at("v 0 0 0\nf 1 -2 1\n").starts_with("line 2: vertex index -2"));
        assert_eq!(read_obj("# nothing\n", 1.0), Err(ObjError::Empty));
        assert!(matches!(
            read_obj("v 0 0 0\nv 1 0 0\nf 1 2 1\n", 1.0),
            Err(ObjError::Empty)
        ));
    }

    #[test]
    fn an_open_mesh_says_where() {
        let open = CUBE.replace("f 4 1 5 8\n", "");
        let (mesh, _) = read_obj(&open, 1.0).unwrap();
        let edge = open_edge(&mesh).unwrap();
        assert_eq!(edge.total, 4);
        assert!(
            edge.to_string().contains("one side only (4 such edges)"),
            "{edge}"
        );
    }

    #[test]
    fn written_meshes_read_back() {
        let (mesh, _) = read_obj(CUBE, 1.0).unwrap();
        let (again, _) = read_obj(&write_obj(&mesh, "a cube\nof one metre"), 1.0).unwrap();
        assert_eq!(mesh, again);
    }
}
