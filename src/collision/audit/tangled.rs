//! Which particles contact can't answer for, since something crosses where it begins.

use super::crossing::crosses;
use super::distance::closest_on_triangle;
use super::inside::winding;
use super::{Audit, ROUNDING, Tree, gather};
use crate::collision::{Bodies, Obstacle, Solid};
use crate::mesh::Aabb;
use crate::state::Archive;
use glam::DVec3;

/// What a particle is caught in.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum Tangle {
    /// Nothing.
    #[default]
    Free,
    /// An edge or triangle of its crosses other cloth.
    Cloth,
    /// An edge or triangle of its crosses an obstacle, beside a particle that is inside.
    Beside,
    /// An edge or triangle of its, whose corners are all outside, crosses the obstacle of this number.
    Through(usize),
    /// It is inside the obstacle of this number.
    Inside(usize),
}

impl Tangle {
    /// Carries it over.
    pub(crate) fn carry(&mut self, archive: &mut Archive) {
        let (mut kind, mut body) = match *self {
            Self::Free => (0, 0),
            Self::Cloth => (1, 0),
            Self::Beside => (2, 0),
            Self::Through(body) => (3, body),
            Self::Inside(body) => (4, body),
        };
        archive.small(&mut kind);
        archive.index(&mut body);
        *self = match kind {
            0 => Self::Free,
            1 => Self::Cloth,
            2 => Self::Beside,
            3 => Self::Through(body),
            4 => Self::Inside(body),
            _ => return archive.damage(),
        };
    }
}

/// What crosses, apart from what has a corner inside a body.
#[derive(Clone, Debug, Default)]
pub(crate) struct Crossings {
    /// Number of an obstacle, and the corners of an edge or triangle of cloth that crosses it; the last of an
    /// edge is there twice.
    pub(crate) bodies: Vec<(usize, [u32; 3])>,
    /// An edge of cloth and a triangle of cloth that it crosses.
    pub(crate) cloth: Vec<([u32; 2], [u32; 3])>,
}

impl Audit {
    /// What each particle is caught in, and what crosses: with cloth where that counts, with obstacles where their detection is continuous: the others don't keep edges out.
    pub(crate) fn tangles(
        &mut self,
        obstacles: &[Obstacle],
        bodies: &Bodies,
        positions: &[DVec3],
        tangles: &mut [Tangle],
    ) -> Crossings {
        self.renew(obstacles, bodies, positions);
        tangles.fill(Tangle::Free);
        for (k, obstacle) in obstacles.iter().enumerate() {
            for (particle, tangle) in tangles.iter_mut().enumerate() {
                if self.is_inside(k, obstacle, bodies, positions[particle], obstacles) {
                    *tangle = Tangle::Inside(k);
                }
            }
        }
        let mut crossings = Crossings::default();
        for (k, obstacle) in obstacles.iter().enumerate() {
            if obstacle.continuous {
                for corners in self.through(k, obstacles, bodies, positions) {
                    if catch(tangles, &corners, k) {
                        crossings.bodies.push((k, corners));
                    }
                }
            }
        }
        if self.with_self {
            crossings.cloth = self.cloth_pairs(positions);
        }
        for (edge, triangle) in &crossings.cloth {
            for &i in edge.iter().chain(triangle) {
                let tangle = &mut tangles[i as usize];
                *tangle = (*tangle).max(Tangle::Cloth);
            }
        }
        crossings
    }

    fn is_inside(
        &self,
        k: usize,
        obstacle: &Obstacle,
        bodies: &Bodies,
        p: DVec3,
        obstacles: &[Obstacle],
    ) -> bool {
        match &obstacle.shape {
            Solid::Mesh { mesh, .. } => {
                let Some(body) = &self.bodies[k] else {
                    return false;
                };
                let column = Aabb {
                    min: p,
                    max: p.with_y(body.bounds.max.y),
                };
                if !column.overlaps(body.bounds) {
                    return false;
                }
                let vertices = bodies.vertices(obstacles, k)[1];
                let mut turns = 0;
                body.hierarchy.overlapping(&column, |t| {
                    let corners = mesh.triangles[t as usize].map(|v| vertices[v as usize]);
                    turns += winding([corners].into_iter(), p);
                });
                turns != 0
            }
            Solid::Plane { point, normal } => {
                let height = bodies.turned(k, *normal).dot(p - bodies.now(k, *point));
                height < -ROUNDING
            }
            Solid::Sphere { center, radius } => {
                p.distance(bodies.now(k, *center)) < radius - ROUNDING
            }
        }
    }

    /// The corners of edges and triangles of cloth that cross an obstacle; the last of an edge is there twice.
    fn through(
        &self,
        k: usize,
        obstacles: &[Obstacle],
        bodies: &Bodies,
        positions: &[DVec3],
    ) -> Vec<[u32; 3]> {
        match &obstacles[k].shape {
            Solid::Mesh { mesh, .. } => {
                let vertices = bodies.vertices(obstacles, k)[1];
                self.through_mesh(k, &mesh.triangles, vertices, positions)
            }
            Solid::Sphere { center, radius } => {
                let center = bodies.now(k, *center);
                let edges = self.edges.iter().map(|&[a, b]| [a, b, b]);
                let all = self.triangles.iter().copied().chain(edges);
                let meets = |corners: &[u32; 3]| {
                    let corners = corners.map(|i| positions[i as usize]);
                    closest_on_triangle(center, corners).distance(center) < radius - ROUNDING
                };
                all.filter(meets).collect()
            }
            Solid::Plane { .. } => Vec::new(),
        }
    }

    fn through_mesh(
        &self,
        k: usize,
        triangles: &[[u32; 3]],
        vertices: &[DVec3],
        positions: &[DVec3],
    ) -> Vec<[u32; 3]> {
        let (Some(body), Some(cloth)) = (&self.bodies[k], &self.cloth) else {
            return Vec::new();
        };
        let mut found = gather(&self.edges, |&[a, b]| {
            let ends = [a, b].map(|i| positions[i as usize]);
            let corners = |t: u32| triangles[t as usize].map(|v| vertices[v as usize]);
            (!crossed(body, ends, corners).is_empty()).then_some([a, b, b])
        });
        let own = |t: u32| self.triangles[t as usize].map(|i| positions[i as usize]);
        let poked = gather(triangles, |&[a, b, c]| {
            let edges = [[a, b], [b, c], [c, a]].into_iter().filter(|[u, v]| u < v);
            let ends = edges.map(|edge| edge.map(|v| vertices[v as usize]));
            let near = |ends: &[DVec3; 2]| Aabb::around(*ends).overlaps(cloth.bounds);
            let met: Vec<u32> = (ends.filter(near))
                .flat_map(|ends| crossed(cloth, ends, own))
                .collect();
            (!met.is_empty()).then_some(met)
        });
        found.extend(poked.iter().flatten().map(|&t| self.triangles[t as usize]));
        found
    }

    /// The edges and triangles of cloth that cross each other, in order.
    fn cloth_pairs(&self, positions: &[DVec3]) -> Vec<([u32; 2], [u32; 3])> {
        let Some(cloth) = &self.cloth else {
            return Vec::new();
        };
        let own = |t: u32| self.triangles[t as usize].map(|i| positions[i as usize]);
        let pairs = gather(&self.edges, |edge| {
            let ends = edge.map(|i| positions[i as usize]);
            let met = crossed(cloth, ends, own).into_iter();
            let triangles = met.map(|t| self.triangles[t as usize]);
            let apart = triangles.filter(|t| !t.iter().any(|corner| edge.contains(corner)));
            let pairs: Vec<_> = apart.map(|triangle| (*edge, triangle)).collect();
            (!pairs.is_empty()).then_some(pairs)
        });
        pairs.into_iter().flatten().collect()
    }
}

/// Marks the corners of something that crosses an obstacle; whether all of them are outside of everything.
fn catch(tangles: &mut [Tangle], corners: &[u32; 3], obstacle: usize) -> bool {
    let is_inside = |&i: &u32| matches!(tangles[i as usize], Tangle::Inside(_));
    let caught = if corners.iter().any(is_inside) {
        Tangle::Beside
    } else {
        Tangle::Through(obstacle)
    };
    for &i in corners {
        let tangle = &mut tangles[i as usize];
        *tangle = (*tangle).max(caught);
    }
    caught != Tangle::Beside
}

/// The triangles of a hierarchy that a segment crosses.
fn crossed(tree: &Tree, ends: [DVec3; 2], corners: impl Fn(u32) -> [DVec3; 3]) -> Vec<u32> {
    let mut found = Vec::new();
    tree.hierarchy.overlapping(&Aabb::around(ends), |t| {
        if crosses(ends, corners(t)) {
            found.push(t);
        }
    });
    found
}
