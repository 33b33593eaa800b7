//! Signed distance to a closed triangle mesh: closest point through a bounding volume hierarchy.
//!
//! Inside and outside are told by angle weighted pseudo-normals (Bærentzen and Aanæs 2005), which
//! are right near edges and vertices, where the nearest triangle's own normal isn't. They are worked
//! out when asked for: a body that moves then only has to refit its hierarchy, and a query needs
//! them only where the triangles around a vertex disagree.

#[cfg(test)]
mod tests;

use super::closest_point::{OnTriangle, closest_point};
use super::{Aabb, Bvh, TriMesh};
use glam::DVec3;

/// A closed surface that answers how far a point is from it.
#[derive(Clone)]
pub struct Surface {
    mesh: TriMesh,
    hierarchy: Bvh,
    incident: Incident,
}

/// The nearest point of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nearest {
    /// The point on the surface (m).
    pub point: DVec3,
    /// Unit normal there, pointing out of the body.
    pub normal: DVec3,
    /// Distance from the surface (m), negative inside.
    pub distance: f64,
    /// The triangle that the point is on; at an edge or a vertex, one of them.
    pub triangle: u32,
    /// Barycentric coordinates of the point in that triangle: of the velocities vᵢ of its corners
    /// Σ wᵢ vᵢ is that of the surface there.
    pub weights: [f64; 3],
}

/// Below this distance (m) the direction from the surface to the point is rounding noise, and the
/// surface's own pseudo-normal is taken: at 1 m from the origin positions carry 2e-16 m, so 1e-9 m
/// still has seven good digits.
const TOUCHING: f64 = 1e-9;

impl Surface {
    /// The surface of a closed, outward oriented mesh; `None` without triangles.
    pub fn new(mesh: &TriMesh) -> Option<Self> {
        if mesh.triangles.is_empty() {
            return None;
        }
        let boxes = mesh
            .triangles
            .iter()
            .map(|&t| Aabb::around(mesh.corners(t)));
        Some(Self {
            hierarchy: Bvh::new(&boxes.collect::<Vec<_>>()),
            incident: Incident::of(mesh),
            mesh: mesh.clone(),
        })
    }

    /// Where its vertices are, and its triangles.
    pub fn mesh(&self) -> &TriMesh {
        &self.mesh
    }

    /// The hierarchy of its triangles' boxes.
    pub fn hierarchy(&self) -> &Bvh {
        &self.hierarchy
    }

    /// Moves its vertices, on all threads and without allocation.
    ///
    /// # Panics
    ///
    /// When there are more or fewer vertices than before.
    pub fn move_to(&mut self, positions: &[DVec3]) {
        self.mesh.positions.copy_from_slice(positions);
        let mesh = &self.mesh;
        let bounds = |t: u32| Aabb::around(mesh.corners(mesh.triangles[t as usize]));
        self.hierarchy.refit_with(bounds);
    }

    /// The nearest point closer than `reach` (m) to `p`; `None` when there is none.
    pub fn nearest(&self, p: DVec3, reach: f64) -> Option<Nearest> {
        let mut nearest = None;
        self.hierarchy.nearest(p, reach * reach, |triangle, bound| {
            let found = closest_point(self.corners(triangle), p);
            let squared = (p - found.point).length_squared();
            if squared < bound {
                nearest = Some((triangle, found));
                squared
            } else {
                bound
            }
        });
        let (triangle, found) = nearest?;
        let away = p - found.point;
        let length = away.length();
        let sign = if self.is_inside(triangle, found.weights, away) {
            -1.0
        } else {
            1.0
        };
        let normal = if length > TOUCHING {
            away * (sign / length)
        } else {
            self.pseudo_normal(triangle, found.weights)
        };
        let OnTriangle { point, weights } = found;
        Some(Nearest {
            point,
            normal,
            distance: sign * length,
            triangle,
            weights,
        })
    }

    /// Unit pseudo-normal of the vertex, edge or triangle that barycentric coordinates are on.
    ///
    /// n = Σ αᵢ nᵢ / |Σ αᵢ nᵢ| with the unit normals nᵢ of the triangles around it, weighted by
    /// their angles αᵢ at a vertex and equally at an edge.
    pub fn pseudo_normal(&self, triangle: u32, weights: [f64; 3]) -> DVec3 {
        let face = || {
            self.area_normal(triangle)
                .try_normalize()
                .unwrap_or(DVec3::Y)
        };
        let feature = Feature::of(self.mesh.triangles[triangle as usize], weights);
        let normal = match feature {
            Feature::Face => return face(),
            Feature::Edge(edge) => self
                .at_edge(edge)
                .map(|t| self.area_normal(t).normalize_or_zero())
                .sum(),
            Feature::Vertex(vertex) => {
                let around = self.incident.at(vertex).iter();
                around
                    .map(|&t| self.area_normal(t).normalize_or_zero() * self.angle(t, vertex))
                    .sum::<DVec3>()
            }
        };
        normal.try_normalize().unwrap_or_else(face)
    }

    /// Whether `away` from a point of the surface leads inside.
    ///
    /// Where all triangles around it agree no weights can change what their sum says.
    fn is_inside(&self, triangle: u32, weights: [f64; 3], away: DVec3) -> bool {
        let rise = |t: u32| self.area_normal(t).dot(away);
        let mut span = (0.0_f64, 0.0_f64);
        let mut see = |t: u32| {
            let rise = rise(t);
            span = (span.0.min(rise), span.1.max(rise));
        };
        match Feature::of(self.mesh.triangles[triangle as usize], weights) {
            Feature::Face => see(triangle),
            Feature::Edge(edge) => self.at_edge(edge).for_each(&mut see),
            Feature::Vertex(vertex) => self.incident.at(vertex).iter().for_each(|&t| see(t)),
        }
        match span {
            (lowest, 0.0) => lowest < 0.0,
            (0.0, _) => false,
            _ => self.pseudo_normal(triangle, weights).dot(away) < 0.0,
        }
    }

    fn corners(&self, triangle: u32) -> [DVec3; 3] {
        self.mesh.corners(self.mesh.triangles[triangle as usize])
    }

    /// Normal of a triangle, as long as twice its area (m²).
    fn area_normal(&self, triangle: u32) -> DVec3 {
        let [a, b, c] = self.corners(triangle);
        (b - a).cross(c - a)
    }

    /// Angle of a triangle at one of its vertices (rad).
    fn angle(&self, triangle: u32, vertex: u32) -> f64 {
        let [a, b, c] = self.mesh.triangles[triangle as usize];
        let others = if vertex == a {
            [b, c]
        } else if vertex == b {
            [c, a]
        } else {
            [a, b]
        };
        let [u, v] = others.map(|other| {
            self.mesh.positions[other as usize] - self.mesh.positions[vertex as usize]
        });
        u.cross(v).length().atan2(u.dot(v))
    }

    /// The triangles at an edge.
    fn at_edge(&self, [a, b]: [u32; 2]) -> impl Iterator<Item = u32> {
        let around = self.incident.at(a).iter().copied();
        around.filter(move |&t| self.mesh.triangles[t as usize].contains(&b))
    }
}

/// What a point of a triangle is on.
enum Feature {
    Vertex(u32),
    Edge([u32; 2]),
    Face,
}

impl Feature {
    fn of([a, b, c]: [u32; 3], weights: [f64; 3]) -> Self {
        match weights.map(|weight| weight > 0.0) {
            [true, false, false] => Self::Vertex(a),
            [false, true, false] => Self::Vertex(b),
            [false, false, true] => Self::Vertex(c),
            [true, true, false] => Self::Edge([a, b]),
            [false, true, true] => Self::Edge([b, c]),
            [true, false, true] => Self::Edge([c, a]),
            _ => Self::Face,
        }
    }
}

/// The triangles around each vertex.
#[derive(Clone)]
struct Incident {
    /// Where each vertex's triangles begin in the list, and where the last's end.
    starts: Vec<u32>,
    triangles: Vec<u32>,
}

impl Incident {
    fn of(mesh: &TriMesh) -> Self {
        let mut starts = vec![0; mesh.positions.len() + 1];
        let corners = || {
            (0..)
                .zip(&mesh.triangles)
                .flat_map(|(t, corners)| corners.map(|v| (v as usize, t)))
        };
        for (vertex, _) in corners() {
            starts[vertex + 1] += 1;
        }
        for vertex in 0..mesh.positions.len() {
            starts[vertex + 1] += starts[vertex];
        }
        let mut next = starts.clone();
        let mut triangles = vec![0; 3 * mesh.triangles.len()];
        for (vertex, triangle) in corners() {
            triangles[next[vertex] as usize] = triangle;
            next[vertex] += 1;
        }
        Self { starts, triangles }
    }

    fn at(&self, vertex: u32) -> &[u32] {
        let vertex = vertex as usize;
        &self.triangles[self.starts[vertex] as usize..self.starts[vertex + 1] as usize]
    }
}

impl std::fmt::Debug for Surface {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Surface of {} triangles", self.mesh.triangles.len())
    }
}
