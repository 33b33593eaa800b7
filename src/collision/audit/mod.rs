//! How far contact has failed, measured on the state itself.
//!
//! Nothing here is shared with the code that answers contacts: crossings and sides are told by exact
//! predicates, depths by distances to triangles. So what a response misses, or believes to have mended,
//! shows.

mod crossing;
mod distance;
mod inside;
mod tangled;
#[cfg(test)]
mod tests;

use super::{Bodies, Obstacle, Solid};
use crate::linear::CHUNK;
use crate::mesh::{Aabb, Bvh};
use crossing::crosses;
use distance::closest_on_triangle;
use glam::DVec3;
use inside::winding;
use rayon::prelude::*;

pub(crate) use tangled::Crossings;
pub use tangled::Tangle;

/// What is measured of the cloths, and room for it.
#[derive(Clone, Debug)]
pub struct Audit {
    /// The cloths' triangles and edges, by particles.
    triangles: Vec<[u32; 3]>,
    edges: Vec<[u32; 2]>,
    /// Whether crossings of cloth with cloth count.
    with_self: bool,
    /// The cloths' triangles as they stand; empty where nobody asks.
    cloth: Option<Tree>,
    /// Each obstacle's triangles as they stand, of those that have any.
    bodies: Vec<Option<Tree>>,
    boxes: Vec<Aabb>,
}

/// Triangles as they stand.
#[derive(Clone, Debug)]
struct Tree {
    hierarchy: Bvh,
    /// The box around all of them.
    bounds: Aabb,
}

/// What one look at a state found.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Findings {
    /// By obstacle.
    pub bodies: Vec<Penetration>,
    /// Pairs of an edge and a triangle of cloth that cross; 0 where nobody asks.
    pub cloth_crossings: u32,
    /// Particles inside obstacles, and the middles of crossing edges (m).
    pub marks: Vec<DVec3>,
}

/// Cloth in an obstacle.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Penetration {
    /// Depth of the deepest particle below the surface (m); of a sphere, of the deepest point of cloth.
    pub depth: f64,
    /// Particles inside.
    pub inside: u32,
    /// Pairs of a cloth's edge and an obstacle's triangle, or the reverse, that cross.
    pub crossings: u32,
}

impl Findings {
    /// Nothing wrong with any of so many obstacles.
    pub fn none(obstacles: usize) -> Self {
        Self {
            bodies: vec![Penetration::default(); obstacles],
            ..Self::default()
        }
    }

    /// Depth of the deepest point of cloth in any obstacle (m).
    pub fn depth(&self) -> f64 {
        self.bodies
            .iter()
            .map(|body| body.depth)
            .fold(0.0, f64::max)
    }

    /// Particles inside obstacles.
    pub fn inside(&self) -> u32 {
        self.bodies.iter().map(|body| body.inside).sum()
    }

    /// Crossings of cloth with obstacles.
    pub fn crossings(&self) -> u32 {
        self.bodies.iter().map(|body| body.crossings).sum()
    }
}

impl Audit {
    /// Ready to look at cloths of some triangles and edges, by particles, and obstacles; `with_self` asks
    /// for crossings of cloth with cloth.
    pub fn new(
        triangles: Vec<[u32; 3]>,
        edges: Vec<[u32; 2]>,
        obstacles: &[Obstacle],
        with_self: bool,
    ) -> Self {
        Self {
            triangles,
            edges,
            with_self,
            cloth: None,
            bodies: vec![None; obstacles.len()],
            boxes: Vec::new(),
        }
    }

    /// The cloths' triangles, by particles.
    pub(super) fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// The cloths' edges, by particles.
    pub(super) fn edges(&self) -> &[[u32; 2]] {
        &self.edges
    }

    /// Looks at a state of the cloths with the obstacles as they stand.
    pub fn look(
        &mut self,
        obstacles: &[Obstacle],
        bodies: &Bodies,
        positions: &[DVec3],
    ) -> Findings {
        self.renew(obstacles, bodies, positions);
        let mut findings = Findings::default();
        for (k, obstacle) in obstacles.iter().enumerate() {
            let found = match &obstacle.shape {
                Solid::Mesh { mesh, .. } => {
                    let vertices = bodies.vertices(obstacles, k)[1];
                    self.in_mesh(k, &mesh.triangles, vertices, positions, &mut findings.marks)
                }
                Solid::Plane { point, normal } => {
                    let (point, normal) = (bodies.now(k, *point), bodies.turned(k, *normal));
                    let height = |x: DVec3| normal.dot(x - point);
                    below(positions, height, &mut findings.marks)
                }
                Solid::Sphere { center, radius } => {
                    let center = bodies.now(k, *center);
                    self.in_sphere(center, *radius, positions, &mut findings.marks)
                }
            };
            findings.bodies.push(found);
        }
        if self.with_self {
            findings.cloth_crossings = self.in_cloth(positions, &mut findings.marks);
        }
        findings
    }

    /// Brings the hierarchies up to date, of those that are needed.
    fn renew(&mut self, obstacles: &[Obstacle], bodies: &Bodies, positions: &[DVec3]) {
        let Self {
            triangles,
            cloth,
            bodies: trees,
            boxes,
            ..
        } = self;
        let mut has_mesh = false;
        for (k, obstacle) in obstacles.iter().enumerate() {
            if let Solid::Mesh { mesh, .. } = &obstacle.shape {
                has_mesh = true;
                if trees[k].is_none() || obstacle.motion.is_some() {
                    let vertices = bodies.vertices(obstacles, k)[1];
                    renew(&mut trees[k], boxes, &mesh.triangles, vertices);
                }
            }
        }
        if self.with_self || has_mesh {
            renew(cloth, boxes, triangles, positions);
        }
    }

    fn in_mesh(
        &self,
        k: usize,
        triangles: &[[u32; 3]],
        vertices: &[DVec3],
        positions: &[DVec3],
        marks: &mut Vec<DVec3>,
    ) -> Penetration {
        let (Some(body), Some(cloth)) = (&self.bodies[k], &self.cloth) else {
            return Penetration::default();
        };
        let corners = |t: u32| triangles[t as usize].map(|v| vertices[v as usize]);
        let around = body.bounds;
        let inside = gather(positions, |&p| {
            let column = Aabb {
                min: p,
                max: p.with_y(around.max.y),
            };
            if !column.overlaps(around) {
                return None;
            }
            let mut turns = 0;
            body.hierarchy
                .overlapping(&column, |t| turns += winding([corners(t)].into_iter(), p));
            (turns != 0).then(|| (p, depth_below(body, &corners, p)))
        });
        let mut found = Penetration::default();
        for (p, depth) in inside {
            found.inside += 1;
            found.depth = found.depth.max(depth);
            marks.push(p);
        }
        let crossing = gather(&self.edges, |edge| {
            let ends = edge.map(|i| positions[i as usize]);
            count(body, ends, corners)
        });
        let own = |t: u32| self.triangles[t as usize].map(|i| positions[i as usize]);
        let reach = cloth.bounds;
        // Each edge of a closed mesh is taken once, from the triangle that runs along it upward in number.
        let poking = gather(triangles, |&[a, b, c]| {
            let edges = [[a, b], [b, c], [c, a]].into_iter().filter(|[u, v]| u < v);
            let near = |ends: &[DVec3; 2]| Aabb::around(*ends).overlaps(reach);
            let ends = edges.map(|edge| edge.map(|v| vertices[v as usize]));
            let each = ends.filter(near).filter_map(|ends| count(cloth, ends, own));
            each.reduce(|(p, n), (_, m)| (p, n + m))
        });
        for (middle, crossings) in crossing.into_iter().chain(poking) {
            found.crossings += crossings;
            marks.push(middle);
        }
        found
    }

    fn in_sphere(
        &self,
        center: DVec3,
        radius: f64,
        positions: &[DVec3],
        marks: &mut Vec<DVec3>,
    ) -> Penetration {
        let mut found = below(positions, |x| x.distance(center) - radius, marks);
        for triangle in &self.triangles {
            let corners = triangle.map(|i| positions[i as usize]);
            let depth = radius - closest_on_triangle(center, corners).distance(center);
            found.depth = found.depth.max(depth);
        }
        for edge in &self.edges {
            let [a, b] = edge.map(|i| positions[i as usize]);
            let along = b - a;
            let t = (center - a).dot(along) / along.length_squared().max(f64::MIN_POSITIVE);
            let nearest = a + along * t.clamp(0.0, 1.0);
            if nearest.distance(center) < radius - ROUNDING {
                found.crossings += 1;
                marks.push(nearest);
            }
        }
        found
    }

    fn in_cloth(&self, positions: &[DVec3], marks: &mut Vec<DVec3>) -> u32 {
        let Some(cloth) = &self.cloth else {
            return 0;
        };
        let crossing = gather(&self.edges, |edge| {
            let ends = edge.map(|i| positions[i as usize]);
            let mut crossings = 0;
            cloth.hierarchy.overlapping(&Aabb::around(ends), |t| {
                let triangle = self.triangles[t as usize];
                let apart = !triangle.iter().any(|corner| edge.contains(corner));
                let corners = triangle.map(|i| positions[i as usize]);
                crossings += u32::from(apart && crosses(ends, corners));
            });
            (crossings > 0).then(|| (0.5 * (ends[0] + ends[1]), crossings))
        });
        marks.extend(crossing.iter().map(|(middle, _)| *middle));
        crossing.iter().map(|(_, crossings)| crossings).sum()
    }
}

/// Where spheres and planes are concerned, a depth below this (m) is rounding.
const ROUNDING: f64 = 1e-12;

/// The middle of a segment, and how many triangles of a hierarchy it crosses, if it crosses any.
fn count(
    tree: &Tree,
    ends: [DVec3; 2],
    corners: impl Fn(u32) -> [DVec3; 3],
) -> Option<(DVec3, u32)> {
    let mut crossings = 0;
    tree.hierarchy.overlapping(&Aabb::around(ends), |t| {
        crossings += u32::from(crosses(ends, corners(t)));
    });
    (crossings > 0).then(|| (0.5 * (ends[0] + ends[1]), crossings))
}

/// Distance of a point from the nearest triangle of a body (m).
fn depth_below(body: &Tree, corners: &impl Fn(u32) -> [DVec3; 3], p: DVec3) -> f64 {
    let mut nearest = f64::INFINITY;
    body.hierarchy.nearest(p, f64::INFINITY, |t, bound| {
        nearest = bound.min(closest_on_triangle(p, corners(t)).distance_squared(p));
        nearest
    });
    nearest.sqrt()
}

/// Particles of negative height.
fn below(
    positions: &[DVec3],
    height: impl Fn(DVec3) -> f64,
    marks: &mut Vec<DVec3>,
) -> Penetration {
    let mut found = Penetration::default();
    for &x in positions {
        let depth = -height(x);
        if depth > ROUNDING {
            found.inside += 1;
            found.depth = found.depth.max(depth);
            marks.push(x);
        }
    }
    found
}

/// Takes over where triangles are.
fn renew(
    tree: &mut Option<Tree>,
    boxes: &mut Vec<Aabb>,
    triangles: &[[u32; 3]],
    positions: &[DVec3],
) {
    let corners = |triangle: &[u32; 3]| triangle.map(|vertex| positions[vertex as usize]);
    boxes.clear();
    boxes.extend(
        triangles
            .iter()
            .map(|triangle| Aabb::around(corners(triangle))),
    );
    let bounds = boxes.iter().copied().fold(Aabb::EMPTY, Aabb::union);
    match tree {
        Some(tree) => {
            tree.hierarchy.refit(boxes);
            tree.bounds = bounds;
        }
        None => {
            let hierarchy = Bvh::new(boxes);
            *tree = Some(Tree { hierarchy, bounds });
        }
    }
}

/// What `look` finds in a list, in its order, looked for on all threads of the pool it is called in.
fn gather<T: Sync, U: Send>(list: &[T], look: impl Fn(&T) -> Option<U> + Sync) -> Vec<U> {
    let parts = list.par_chunks(CHUNK);
    let found: Vec<Vec<U>> = parts
        .map(|part| part.iter().filter_map(&look).collect())
        .collect();
    found.into_iter().flatten().collect()
}
