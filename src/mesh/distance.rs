//! Signed distance to a closed triangle mesh: closest point through a bounding volume hierarchy.
//!
//! The hierarchy and the projection on triangles are parry's. Inside and outside are told by angle
//! weighted pseudo-normals (Bærentzen and Aanæs 2005), which are right near edges and vertices,
//! where the nearest triangle's own normal isn't.

use super::TriMesh;
use glam::{DVec3, dvec3};
use parry3d_f64::math::Vector;
use parry3d_f64::query::PointQueryWithLocation as _;
use parry3d_f64::shape::{TriMesh as ParryMesh, TriMeshFlags, TrianglePointLocation};

/// A closed surface that answers how far a point is from it.
#[derive(Clone)]
pub struct Surface {
    mesh: ParryMesh,
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
}

impl Nearest {
    /// A point with its normal, and how far it is.
    pub fn new(point: DVec3, normal: DVec3, distance: f64) -> Self {
        Self {
            point,
            normal,
            distance,
        }
    }
}

/// Below this distance (m) the direction from the surface to the point is rounding noise, and the
/// surface's own pseudo-normal is taken: at 1 m from the origin positions carry 2e-16 m, so 1e-9 m
/// still has seven good digits.
const TOUCHING: f64 = 1e-9;

impl Surface {
    /// The surface of a closed, outward oriented mesh; `None` without triangles.
    pub fn new(mesh: &TriMesh) -> Option<Self> {
        let vertices = mesh.positions.iter().map(|&p| to_parry(p)).collect();
        let mesh = ParryMesh::with_flags(vertices, mesh.triangles.clone(), TriMeshFlags::ORIENTED);
        mesh.ok().map(|mesh| Self { mesh })
    }

    /// The nearest point within `reach` (m) of `p`; `None` when there is none.
    pub fn nearest(&self, p: DVec3, reach: f64) -> Option<Nearest> {
        let (projection, (triangle, location)) = self
            .mesh
            .project_local_point_and_get_location_with_max_dist(to_parry(p), false, reach)?;
        let point = from_parry(projection.point);
        let sign = if projection.is_inside { -1.0 } else { 1.0 };
        let away = p - point;
        let length = away.length();
        let normal = if length > TOUCHING {
            away * (sign / length)
        } else {
            self.pseudo_normal(triangle, location)
        };
        Some(Nearest {
            point,
            normal,
            distance: sign * length,
        })
    }

    /// Pseudo-normal of the vertex, edge or triangle on which a projection landed.
    fn pseudo_normal(&self, triangle: u32, location: TrianglePointLocation) -> DVec3 {
        let corners = self.mesh.indices()[triangle as usize];
        let face = || from_parry(self.mesh.triangle(triangle).normal().unwrap_or(Vector::Y));
        let normal = match (self.mesh.pseudo_normals(), location) {
            (Some(normals), TrianglePointLocation::OnVertex(corner)) => {
                from_parry(normals.vertices_pseudo_normal[corners[corner as usize] as usize])
            }
            (Some(normals), TrianglePointLocation::OnEdge(edge, _)) => {
                from_parry(normals.edges_pseudo_normal[triangle as usize][edge as usize])
            }
            _ => face(),
        };
        normal.try_normalize().unwrap_or_else(face)
    }
}

impl std::fmt::Debug for Surface {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Surface of {} triangles", self.mesh.indices().len())
    }
}

/// parry has its own version of the vector crate.
fn to_parry(p: DVec3) -> Vector {
    Vector::new(p.x, p.y, p.z)
}

fn from_parry(p: Vector) -> DVec3 {
    dvec3(p.x, p.y, p.z)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A thin wedge: its sharp edges and vertices are where a triangle's own normal misleads.
    fn wedge() -> TriMesh {
        let positions = vec![
            dvec3(0.0, 0.0, 0.0),
            dvec3(1.0, 0.1, 0.0),
            dvec3(1.0, -0.1, 0.0),
            dvec3(0.0, 0.0, 1.0),
            dvec3(1.0, 0.1, 1.0),
            dvec3(1.0, -0.1, 1.0),
        ];
        let triangles = vec![
            [0, 1, 2],
            [3, 5, 4],
            [0, 4, 1],
            [0, 3, 4],
            [0, 2, 5],
            [0, 5, 3],
            [1, 5, 2],
            [1, 4, 5],
        ];
        TriMesh {
            positions,
            triangles,
        }
    }

    /// Inside by half-spaces: the wedge is convex.
    fn inside(mesh: &TriMesh, p: DVec3) -> bool {
        mesh.triangles.iter().all(|&triangle| {
            let [a, b, c] = mesh.corners(triangle);
            (b - a).cross(c - a).dot(p - a) < 0.0
        })
    }

    #[test]
    fn the_sign_is_right_near_edges_and_vertices() {
        let mesh = wedge();
        assert!(crate::mesh::open_edge(&mesh).is_none() && mesh.volume() > 0.0);
        let surface = Surface::new(&mesh).unwrap();
        let mut tried = 0;
        for corner in &mesh.positions {
            for i in 0..1000_u32 {
                let turn = f64::from(i);
                let direction = dvec3((turn * 0.7).sin(), (turn * 1.3).cos(), (turn * 2.1).sin());
                for scale in [1e-6, 1e-3, 0.05] {
                    let p = *corner + direction * scale;
                    let nearest = surface.nearest(p, f64::MAX).unwrap();
                    if nearest.distance.abs() < 1e-12 {
                        continue; // on the surface: neither side
                    }
                    assert_eq!(
                        nearest.distance < 0.0,
                        inside(&mesh, p),
                        "at {p}: {nearest:?}"
                    );
                    assert!(
                        (nearest.point + nearest.normal * nearest.distance - p).length() < 1e-12
                    );
                    tried += 1;
                }
            }
        }
        assert!(tried > 17_900, "{tried}");
    }

    #[test]
    fn a_point_on_an_edge_has_a_normal_that_points_out() {
        let surface = Surface::new(&wedge()).unwrap();
        let nearest = surface.nearest(dvec3(0.0, 0.0, 0.5), 1.0).unwrap();
        assert!(
            nearest.distance.abs() < 1e-12 && nearest.normal.x < -0.09,
            "{nearest:?}"
        );
        assert!(surface.nearest(dvec3(0.0, 2.0, 0.5), 1.0).is_none());
    }
}
