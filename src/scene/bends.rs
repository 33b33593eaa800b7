//! Hinges in the making, and what clamps add to them.

use super::fault::Fault;
use super::hold::{Hold, Switch};
use super::rigidity::Rigidity;
use super::schema::{self, BendingName, Shape};
use crate::force::{
    BendingLaw, Dihedral, DiscreteShell, EdgeSpring, Hinge, HingeBatch, HingeDamping,
};
use crate::mesh::{self, Lattice};
use glam::DVec3;
use std::collections::{BTreeMap, BTreeSet};

/// The hinges that the cloths have brought so far.
#[derive(Default)]
pub(super) struct Bends {
    edge_springs: Batch,
    discrete_shells: Batch,
    /// What changes when clamps are released.
    switches: Vec<Switch>,
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
    /// When the clamp lets go (s); ∞ for never.
    until: f64,
}

/// The far corner of a clamp's hinge.
#[derive(Clone, Copy)]
pub(super) struct Far {
    /// Where it is held at the start (m).
    pub(super) held: DVec3,
    /// Where it would be at rest (m).
    pub(super) rest: DVec3,
    /// Number of the motion that it follows: that of the clamped edge.
    pub(super) drive: Option<usize>,
}

/// What a pin clamps.
pub(super) struct Clamping {
    /// Number of the pin.
    pub(super) pin: usize,
    /// The vertices that it selects.
    pub(super) vertices: Vec<u32>,
    /// When it lets go (s); ∞ for never.
    pub(super) until: f64,
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
    /// How each of its particles is held.
    pub(super) holds: &'a [Option<Hold>],
    /// Its pins that clamp.
    pub(super) clamped: &'a [Clamping],
}

impl Bends {
    /// Adds the hinges of a cloth. Where a pin clamps an edge, each triangle beside it with a free
    /// corner gets a hinge of its own against its mirror image, which is held: that keeps the tangent.
    /// The mirrored curve is symmetric, so that such a hinge turns by half of what an inner one would
    /// and its half of the energy needs k twice. When the clamp is released, its hinges go slack and the
    /// one across the edge, which they stood for, acts.
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
        let mut clamped: BTreeMap<[u32; 2], f64> = BTreeMap::new();
        for (&[a, b, _], &until) in &clamps {
            let latest = clamped.entry([a.min(b), a.max(b)]).or_insert(until);
            *latest = latest.max(until);
        }
        for corners in hinges {
            let mut hinge = inner_hinge(placed, &rigidity, corners);
            match clamped.get(&[corners[0], corners[1]]) {
                Some(until) if until.is_infinite() => continue,
                Some(&time) => {
                    self.switches.push(Switch {
                        corners: hinge.corners,
                        stiffness: hinge.stiffness,
                        time,
                    });
                    hinge.stiffness = 0.0;
                }
                None => {}
            }
            batch.hinges.push(hinge);
            batch.times.push(placed.cloth.damping.stiffness);
        }
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
                self.switches.push(Switch {
                    corners: clamp.hinge.corners,
                    stiffness: 0.0,
                    time: clamp.until,
                });
                batch.hinges.push(clamp.hinge);
                batch.times.push(clamp.time);
            }
        }
        held
    }

    /// What changes when clamps are released; at ∞, never.
    pub(super) fn switches(&mut self) -> Vec<Switch> {
        std::mem::take(&mut self.switches)
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
    fn add_clamps(
        &mut self,
        placed: &Placed<'_>,
        rigidity: &Rigidity,
        clamps: BTreeMap<[u32; 3], f64>,
    ) {
        let bend = placed.cloth.material.bend.unwrap_or(0.0);
        let positions = &placed.lattice.mesh.positions;
        for (clamp, until) in clamps {
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
                    drive: placed.holds[clamp[0] as usize].and_then(|hold| hold.drive),
                },
                until,
            });
        }
    }

    fn batch<L: BendingLaw>(self) -> Option<HingeBatch<L>> {
        (!self.hinges.is_empty()).then(|| HingeBatch::new(self.hinges))
    }
}

/// The hinge of two triangles of a cloth, at rest where the cloth is.
fn inner_hinge(placed: &Placed<'_>, rigidity: &Rigidity, corners: [u32; 4]) -> Hinge {
    let at_rest = corners.map(|corner| placed.rest[corner as usize]);
    let bend = placed.cloth.material.bend.unwrap_or(0.0);
    Hinge {
        corners: corners.map(|corner| corner + placed.first),
        rest_angle: Dihedral::of(at_rest).fold.angle(),
        stiffness: rigidity.stiffness(at_rest, bend),
    }
}

/// Where a cloth doesn't bend, no pin can clamp it.
fn no_clamps(clamped: &[Clamping]) -> Result<(), Fault> {
    match clamped.first() {
        None => Ok(()),
        Some(clamping) => Err(Fault::new(
            format!("pin.{}.clamp", clamping.pin),
            "holds the tangent by hinges, and this cloth has none; give it bending = \"edge-spring\" or \"discrete-shell\" and material.bend above 0, or remove clamp",
        )),
    }
}

/// The clamped edges: start, end and the third vertex of each triangle beside one, which becomes free
/// before the clamp lets go if it isn't free; and when the last pin that clamps the edge does (s).
fn clamp_edges(placed: &Placed<'_>) -> Result<BTreeMap<[u32; 3], f64>, Fault> {
    let mut edges = BTreeMap::new();
    for Clamping {
        pin,
        vertices,
        until,
    } in placed.clamped
    {
        let held: BTreeSet<u32> = vertices.iter().copied().collect();
        let moves = |tip: u32| placed.holds[tip as usize].is_none_or(|hold| hold.until < *until);
        let mut holds = false;
        for &[a, b, c] in &placed.lattice.mesh.triangles {
            for [start, end, tip] in [[a, b, c], [b, c, a], [c, a, b]] {
                let both = held.contains(&start) && held.contains(&end);
                if both && moves(tip) {
                    let latest: &mut f64 = edges.entry([start, end, tip]).or_insert(*until);
                    *latest = latest.max(*until);
                    holds = true;
                }
            }
        }
        if !holds {
            return Err(Fault::new(
                format!("pin.{pin}.select"),
                "clamps no tangent: no edge of the cloth with a free triangle beside it has both its ends here; select two neighbouring vertices or more, or remove clamp",
            ));
        }
    }
    Ok(edges)
}

/// The hinge of a triangle and its mirror image in its first edge, in its own plane.
fn mirrored([a, b, c]: [DVec3; 3]) -> [DVec3; 4] {
    let e = b - a;
    let foot = a + e * ((c - a).dot(e) / e.length_squared());
    [a, b, c, foot * 2.0 - c]
}
