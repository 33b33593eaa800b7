//! A cloth's net of hinges, and the patches that it is measured in.

use super::patch::{Patch, Stencil};
use super::{Plate, Spread};
use glam::{DVec2, DVec3};
use std::collections::{BTreeMap, BTreeSet, VecDeque};

/// Share of its area that a triangle may lose when its patch is laid flat.
const FLAT_ENOUGH: f64 = 0.7;

/// How far a patch goes, in rings of vertices around its centre.
#[derive(Clone, Copy, Debug)]
pub(super) struct Reach {
    /// Rings that are bent.
    pub(super) rings: usize,
    /// Inner rings that are measured.
    pub(super) core: usize,
    /// Least number of edges between the centre and the border.
    pub(super) depth: usize,
}

/// A cloth's hinges and who is beside whom.
#[derive(Debug)]
pub(super) struct Net<'a> {
    positions: &'a [DVec3],
    hinges: &'a [[u32; 4]],
    /// k of each hinge (N·m).
    weights: &'a [f64],
    /// Hinges around each vertex: those of vertex i are `around[first[i]..first[i + 1]]`.
    first: Vec<usize>,
    around: Vec<usize>,
    /// Edges between each vertex and the border, `usize::MAX` for cloth without border.
    depths: Vec<usize>,
}

impl<'a> Net<'a> {
    pub(super) fn new(positions: &'a [DVec3], hinges: &'a [[u32; 4]], weights: &'a [f64]) -> Self {
        let mut first = vec![0; positions.len() + 1];
        for vertex in hinges.iter().flatten() {
            first[*vertex as usize + 1] += 1;
        }
        for i in 0..positions.len() {
            first[i + 1] += first[i];
        }
        let mut next = first.clone();
        let mut around = vec![0; 4 * hinges.len()];
        for (index, hinge) in hinges.iter().enumerate() {
            for vertex in hinge {
                around[next[*vertex as usize]] = index;
                next[*vertex as usize] += 1;
            }
        }
        let mut net = Self {
            positions,
            hinges,
            weights,
            first,
            around,
            depths: Vec::new(),
        };
        net.depths = net.depths();
        net
    }

    /// Positions of the vertices that hinges move (m).
    pub(super) fn used(&self) -> impl Iterator<Item = DVec3> + Clone + '_ {
        let used = |&vertex: &usize| !self.around(vertex).is_empty();
        let vertices = (0..self.positions.len()).filter(used);
        vertices.map(|vertex| self.positions[vertex])
    }

    fn around(&self, vertex: usize) -> &[usize] {
        &self.around[self.first[vertex]..self.first[vertex + 1]]
    }

    /// Other corners of the triangles at a vertex, with repetitions.
    fn neighbours(&self, vertex: usize) -> impl Iterator<Item = usize> + '_ {
        self.around(vertex).iter().flat_map(move |&hinge| {
            let [a, b, c, d] = self.hinges[hinge].map(|corner| corner as usize);
            let tip = vertex == c || vertex == d;
            let others = [a, b]
                .into_iter()
                .chain([c, d].into_iter().filter(move |_| !tip));
            others.filter(move |&other| other != vertex)
        })
    }

    /// Distances from the border, whose edges are those of triangles without a hinge.
    fn depths(&self) -> Vec<usize> {
        let sorted = |i: u32, j: u32| [i.min(j), i.max(j)];
        let inner: BTreeSet<_> = self.hinges.iter().map(|h| sorted(h[0], h[1])).collect();
        let mut depths = vec![usize::MAX; self.positions.len()];
        let mut queue = VecDeque::new();
        for &[a, b, c, d] in self.hinges {
            for [i, j] in [[a, c], [c, b], [a, d], [d, b]] {
                if !inner.contains(&sorted(i, j)) {
                    for end in [i as usize, j as usize] {
                        if depths[end] > 0 {
                            depths[end] = 0;
                            queue.push_back(end);
                        }
                    }
                }
            }
        }
        while let Some(vertex) = queue.pop_front() {
            for other in self.neighbours(vertex) {
                if depths[other] == usize::MAX {
                    depths[other] = depths[vertex] + 1;
                    queue.push_back(other);
                }
            }
        }
        depths
    }

    /// The plate of at most `most` patches spread over the cloth, and how many could be measured.
    ///
    /// `rings` around each centre are bent and the `core` inner ones measured; centres lie at least
    /// `depth` edges deep in the cloth.
    pub(super) fn measure(&self, along: DVec3, reach: Reach, most: usize) -> (Plate, usize) {
        let inside = |v: &usize| self.depths[*v] >= reach.depth && !self.around(*v).is_empty();
        let centers: Vec<_> = (0..self.positions.len()).filter(inside).collect();
        let count = centers.len().min(most);
        let (mut plate, mut patches) = (Plate::NONE, 0);
        for i in 0..count {
            let center = centers[(2 * i + 1) * centers.len() / (2 * count)];
            if let Some(patch) = self.patch(center, along, reach) {
                plate.add(&patch);
                patches += 1;
            }
        }
        (plate, patches)
    }

    /// The plate of all hinges as they are, with no vertex relaxed: stiffer than the net.
    pub(super) fn unrelaxed(&self, along: DVec3) -> Plate {
        let mut plate = Plate::NONE;
        for (hinge, weight) in self.hinges.iter().zip(self.weights) {
            let corners = hinge.map(|vertex| self.positions[vertex as usize]);
            let [x, y] = frame(normal(corners), along);
            let edge = corners[1] - corners[0];
            let edge = DVec2::new(edge.dot(x), edge.dot(y)).normalize_or_zero();
            let spread = Spread::new(corners);
            let theta = spread.reading(edge);
            if theta.is_finite() {
                plate.add_bent_hinge(*weight, theta, spread.areas().iter().sum::<f64>() / 3.0);
            }
        }
        plate
    }

    /// One patch's plate; `None` where it can't be laid flat or doesn't hold together.
    pub(super) fn patch(&self, center: usize, along: DVec3, reach: Reach) -> Option<Plate> {
        let (vertices, ends) = self.ball(center, reach.rings);
        let place: BTreeMap<_, _> = vertices.iter().enumerate().map(|(i, &v)| (v, i)).collect();
        let mut hinges: Vec<usize> = vertices
            .iter()
            .flat_map(|&vertex| self.around(vertex).iter().copied())
            .collect();
        hinges.sort_unstable();
        hinges.dedup();
        let within = |&hinge: &usize| {
            let corners = self.hinges[hinge];
            corners
                .iter()
                .all(|&vertex| place.contains_key(&(vertex as usize)))
        };
        hinges.retain(within);
        let flat = self.flatten(&vertices, &hinges, along);
        let mut patch = Patch {
            stencils: Vec::with_capacity(hinges.len()),
            held: vec![true; vertices.len()],
            heights: vec![DVec3::ZERO; vertices.len()],
        };
        for &hinge in &hinges {
            let corners = self.hinges[hinge].map(|vertex| place[&(vertex as usize)]);
            let stencil = Stencil::new(corners, self.weights[hinge], &flat);
            let true_areas = self.spread(hinge).areas();
            if (0..2).any(|i| {
                stencil.areas[i].is_nan() || stencil.areas[i] <= FLAT_ENOUGH * true_areas[i]
            }) {
                return None;
            }
            patch.stencils.push(stencil);
        }
        patch.hold();
        patch.relax()?;
        Some(patch.plate(ends[reach.core])).filter(Plate::is_measured)
    }

    fn spread(&self, hinge: usize) -> Spread {
        Spread::new(self.hinges[hinge].map(|vertex| self.positions[vertex as usize]))
    }

    /// Vertices up to `rings` edges away, nearest first, and how many there are within each ring.
    fn ball(&self, center: usize, rings: usize) -> (Vec<usize>, Vec<usize>) {
        let mut vertices = vec![center];
        let mut seen = BTreeSet::from([center]);
        let mut ends = vec![1];
        for ring in 0..rings {
            let start = if ring == 0 { 0 } else { ends[ring - 1] };
            for i in start..ends[ring] {
                let found = self
                    .neighbours(vertices[i])
                    .filter(|&other| seen.insert(other));
                let found: Vec<_> = found.collect();
                vertices.extend(found);
            }
            ends.push(vertices.len());
        }
        (vertices, ends)
    }

    /// A patch in its tangent plane, around its first vertex (m): each vertex in the direction of its
    /// projection, as far away as it is in space.
    fn flatten(&self, vertices: &[usize], hinges: &[usize], along: DVec3) -> Vec<DVec2> {
        let corners = |&hinge: &usize| self.hinges[hinge].map(|v| self.positions[v as usize]);
        let [x, y] = frame(
            hinges.iter().map(|hinge| normal(corners(hinge))).sum(),
            along,
        );
        let lay = |&vertex: &usize| {
            let d = self.positions[vertex] - self.positions[vertices[0]];
            d.length() * DVec2::new(d.dot(x), d.dot(y)).normalize_or_zero()
        };
        vertices.iter().map(lay).collect()
    }
}

/// Sum of the normals of a hinge's triangles, four times their areas together.
fn normal([a, b, c, d]: [DVec3; 4]) -> DVec3 {
    (b - a).cross(c - a) + (a - b).cross(d - b)
}

/// Unit vectors of the plane across a normal, the first close to `along`.
fn frame(normal: DVec3, along: DVec3) -> [DVec3; 2] {
    let normal = normal.try_normalize().unwrap_or(DVec3::Y);
    let flat = along - along.dot(normal) * normal;
    let x = flat.try_normalize().filter(|_| flat.length() > 1e-6);
    let x = x.unwrap_or_else(|| normal.any_orthonormal_vector());
    [x, normal.cross(x)]
}
