//! Hinges in the making, and what clamps add to them.

use super::fault::Fault;
use super::rigidity::Rigidity;
use super::schema::{self, BendingName, Shape};
use crate::force::{
    BendingLaw, Dihedral, DiscreteShell, EdgeSpring, Hinge, HingeBatch, HingeDamping,
};
use crate::mesh::{self, Lattice};
use glam::DVec3;
use std::collections::BTreeSet;

/// The hinges that the cloths have brought so far.
#[derive(Default)]
pub(super) struct Bends {
    edge_springs: Batch,
    discrete_shells: Batch,
}

/// The hinges of one law, with the damping time τ of each (s), and those at clamps.
#[derive(Default)]
struct Batch {
    hinges: Vec<Hinge>,
    times: Vec<f64>,
    clamps: Vec<Clamp>,
}

/// A hinge on a clamped edge, whose far corner doesn't move with the cloth.
struct Clamp {
    /// The last corner is not set yet.
    hinge: Hinge,
    time: f64,
    far: Far,
}

/// The far corner of a clamp's hinge (m).
#[derive(Clone, Copy)]
pub(super) struct Far {
    /// Where it is held.
    pub(super) held: DVec3,
    /// Where it would be at rest.
    pub(super) rest: DVec3,
}

/// A cloth where it starts.
pub(super) struct Placed<'a> {
    pub(super) cloth: &'a schema::Cloth,
    /// Its shape, placed in the world.
    pub(super) lattice: &'a Lattice,
    /// Its vertices at rest (m), before it was stretched and placed.
    pub(super) rest: &'a [DVec3],
    /// Number of its first particle.
    pub(super) first: u32,
    /// Whether each of its particles is pinned.
    pub(super) pinned: &'a [bool],
    /// Number of each pin that clamps, and the vertices that it selects.
    pub(super) clamped: &'a [(usize, Vec<u32>)],
}

impl Bends {
    /// Adds the hinges of a cloth. Where a pin clamps an edge, each triangle beside it with a free
    /// corner gets a hinge of its own against its mirror image, which is held: that keeps the tangent.
    /// The mirrored curve is symmetric, so that such a hinge turns by half of what an inner one would
    /// and its half of the energy needs k twice.
    pub(super) fn add(&mut self, placed: &Placed<'_>) -> Result<(), Fault> {
        let bends = placed.cloth.material.bend.is_some_and(|bend| bend > 0.0);
        let batch = match placed.cloth.bending {
            _ if !bends => return no_clamps(placed.clamped),
            BendingName::None => return no_clamps(placed.clamped),
            BendingName::EdgeSpring => &mut self.edge_springs,
            BendingName::DiscreteShell => &mut self.discrete_shells,
        };
        let hinges = mesh::hinges(&placed.lattice.mesh.triangles);
        // A mesh's coordinates say nothing of warp and weft, a sheet's do.
        let is_sheet = matches!(placed.cloth.shape, Shape::Sheet(_));
        let axes = is_sheet.then_some([DVec3::X, DVec3::Z]);
        let rigidity = Rigidity::of(placed.rest, &hinges, axes);
        let clamps = clamp_edges(placed)?;
        let edge = |&[a, b, _]: &[u32; 3]| [a.min(b), a.max(b)];
        let clamped: BTreeSet<[u32; 2]> = clamps.iter().map(edge).collect();
        let inner = hinges
            .into_iter()
            .filter(|corners| !clamped.contains(&[corners[0], corners[1]]));
        batch.add_hinges(placed, &rigidity, inner);
        batch.add_clamps(placed, &rigidity, clamps);
        Ok(())
    }

    /// Makes the far corners of the clamps particles from number `first` on; returns where they are.
    pub(super) fn hold_clamps(&mut self, first: u32) -> Vec<Far> {
        let mut held = Vec::new();
        let mut next = first;
        for batch in [&mut self.edge_springs, &mut self.discrete_shells] {
            for mut clamp in std::mem::take(&mut batch.clamps) {
                clamp.hinge.corners[3] = next;
                next += 1;
                held.push(clamp.far);
                batch.hinges.push(clamp.hinge);
                batch.times.push(clamp.time);
            }
        }
        held
    }

    pub(super) fn damping(&self) -> Option<HingeDamping> {
        let mut damping = HingeDamping::default();
        for batch in [&self.edge_springs, &self.discrete_shells] {
            let each = batch.hinges.iter().zip(&batch.times);
            for (&hinge, &time) in each.filter(|(_, time)| **time > 0.0) {
                damping.hinges.push(hinge);
                damping.times.push(time);
            }
        }
        (!damping.hinges.is_empty()).then_some(damping)
    }

    /// The batches that have hinges.
    pub(super) fn batches(
        self,
    ) -> (
        Option<HingeBatch<EdgeSpring>>,
        Option<HingeBatch<DiscreteShell>>,
    ) {
        (self.edge_springs.batch(), self.discrete_shells.batch())
    }
}

impl Batch {
    fn add_hinges(
        &mut self,
        placed: &Placed<'_>,
        rigidity: &Rigidity,
        hinges: impl Iterator<Item = [u32; 4]>,
    ) {
        let bend = placed.cloth.material.bend.unwrap_or(0.0);
        for corners in hinges {
            let at_rest = corners.map(|corner| placed.rest[corner as usize]);
            self.hinges.push(Hinge {
                corners: corners.map(|corner| corner + placed.first),
                rest_angle: Dihedral::of(at_rest).fold.angle(),
                stiffness: rigidity.stiffness(at_rest, bend),
            });
            self.times.push(placed.cloth.damping.stiffness);
        }
    }

    fn add_clamps(&mut self, placed: &Placed<'_>, rigidity: &Rigidity, clamps: Vec<[u32; 3]>) {
        let bend = placed.cloth.material.bend.unwrap_or(0.0);
        let positions = &placed.lattice.mesh.positions;
        for clamp in clamps {
            let at_rest = clamp.map(|corner| placed.rest[corner as usize]);
            let [a, b, c] = clamp.map(|corner| corner + placed.first);
            self.clamps.push(Clamp {
                hinge: Hinge {
                    corners: [a, b, c, u32::MAX],
                    rest_angle: 0.0,
                    stiffness: 2.0 * rigidity.stiffness(mirrored(at_rest), bend),
                },
                time: placed.cloth.damping.stiffness,
                far: Far {
                    held: mirrored(clamp.map(|corner| positions[corner as usize]))[3],
                    rest: mirrored(at_rest)[3],
                },
            });
        }
    }

    fn batch<L: BendingLaw>(self) -> Option<HingeBatch<L>> {
        (!self.hinges.is_empty()).then(|| HingeBatch::new(self.hinges))
    }
}

/// Where a cloth doesn't bend, no pin of its can clamp.
fn no_clamps(clamped: &[(usize, Vec<u32>)]) -> Result<(), Fault> {
    match clamped.first() {
        None => Ok(()),
        Some((i, _)) => Err(Fault::new(
            format!("pin.{i}.clamp"),
            "holds the tangent by hinges, and this cloth has none; give it bending = \"edge-spring\" or \"discrete-shell\" and material.bend above 0, or remove clamp",
        )),
    }
}

/// The clamped edges: start, end and the free third vertex of each triangle beside one.
fn clamp_edges(placed: &Placed<'_>) -> Result<Vec<[u32; 3]>, Fault> {
    let mut edges = BTreeSet::new();
    for (i, selected) in placed.clamped {
        let held: BTreeSet<u32> = selected.iter().copied().collect();
        let mut holds = false;
        for &[a, b, c] in &placed.lattice.mesh.triangles {
            for [start, end, tip] in [[a, b, c], [b, c, a], [c, a, b]] {
                let both = held.contains(&start) && held.contains(&end);
                if both && !placed.pinned[tip as usize] {
                    edges.insert([start, end, tip]);
                    holds = true;
                }
            }
        }
        if !holds {
            return Err(Fault::new(
                format!("pin.{i}.select"),
                "clamps no tangent: no edge of the cloth with a free triangle beside it has both its ends here; select two neighbouring vertices or more, or remove clamp",
            ));
        }
    }
    Ok(edges.into_iter().collect())
}

/// The hinge of a triangle and its mirror image in its first edge, in its own plane.
fn mirrored([a, b, c]: [DVec3; 3]) -> [DVec3; 4] {
    let e = b - a;
    let foot = a + e * ((c - a).dot(e) / e.length_squared());
    [a, b, c, foot * 2.0 - c]
}
