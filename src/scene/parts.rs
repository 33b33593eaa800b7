//! A model in the making: what the cloths have brought so far.

use super::fault::Fault;
use super::place::place;
use super::rigidity::Rigidity;
use super::schema::{self, BendingName, Shape, SpringKind};
use super::select::select;
use super::spring_constant::spring_constant;
use crate::collision::Obstacle;
use crate::force::{
    BendingLaw, Dihedral, Gravity, Hinge, HingeBatch, HingeDamping, MassDamping, Spring,
    SpringBatch, SpringDamping,
};
use crate::mesh::{self, Lattice, Segment};
use crate::model::{Cloth, Model};
use crate::state::State;
use crate::strain_limit::StrainLimit;
use glam::DVec3;
use std::collections::BTreeSet;

#[derive(Default)]
pub(super) struct Parts {
    cloths: Vec<Cloth>,
    state: State,
    masses: Vec<f64>,
    pinned: Vec<bool>,
    drag: Vec<f64>,
    families: [Family; 4],
    edge_springs: Bends,
    discrete_shells: Bends,
}

/// The springs of one kind, with the damping time τ of each (s).
#[derive(Default)]
struct Family {
    springs: Vec<Spring>,
    times: Vec<f64>,
}

/// The hinges of one law, with the damping time τ of each (s), and those at clamps.
#[derive(Default)]
struct Bends {
    hinges: Vec<Hinge>,
    times: Vec<f64>,
    clamps: Vec<Clamp>,
}

/// A hinge on a clamped edge, whose far corner doesn't move with the cloth.
struct Clamp {
    /// The last corner is not set yet.
    hinge: Hinge,
    time: f64,
    /// Where the far corner is held (m).
    far: DVec3,
}

/// The kinds of springs, in the order of their families.
const KINDS: [(SpringKind, &str); 4] = [
    (SpringKind::Structural, "structural"),
    (SpringKind::Shear, "shear"),
    (SpringKind::Bend, "bend"),
    (SpringKind::ZeroLength, "zero-length"),
];

impl Parts {
    /// Adds a cloth of a shape, held by its pins.
    pub(super) fn add<'a>(
        &mut self,
        cloth: &schema::Cloth,
        mut lattice: Lattice,
        pins: impl Iterator<Item = (usize, &'a schema::Pin)>,
    ) -> Result<(), Fault> {
        let first = self.masses.len();
        for (kind, _) in KINDS {
            if cloth.springs.contains(&kind) {
                self.add_springs(kind, cloth, &lattice);
            }
        }
        self.add_masses(cloth, &lattice);
        let rest = lattice.mesh.positions.clone();
        let stretch = DVec3::from_array(cloth.start.stretch);
        lattice
            .mesh
            .positions
            .iter_mut()
            .for_each(|x| *x *= stretch);
        place(&mut lattice.mesh.positions, cloth.rotate, cloth.translate);
        let mut clamped = Vec::new();
        for (i, pin) in pins {
            let fault = |cause: String| Fault::new(format!("pin.{i}.select"), cause);
            let selected = select(&pin.select, &lattice).map_err(fault)?;
            for &vertex in &selected {
                self.pinned[first + vertex as usize] = true;
            }
            if pin.clamp {
                clamped.push((i, selected));
            }
        }
        self.add_hinges(cloth, &lattice, &rest, &clamped)?;
        self.add_state(cloth, &lattice.mesh.positions);
        self.cloths.push(Cloth {
            name: cloth.name.clone(),
            particles: first..self.masses.len(),
            triangles: shifted(&lattice.mesh.triangles, index(first)),
        });
        Ok(())
    }

    fn add_springs(&mut self, kind: SpringKind, cloth: &schema::Cloth, lattice: &Lattice) {
        let offset = index(self.masses.len());
        let family = &mut self.families[kind as usize];
        for segment in places(kind, lattice) {
            let [a, b] = segment.ends.map(|end| lattice.mesh.positions[end as usize]);
            let stiffness = spring_constant(kind, cloth, segment, b - a);
            let rest_length = match kind {
                SpringKind::ZeroLength => 0.0,
                _ => (b - a).length(),
            };
            if stiffness > 0.0 {
                family.springs.push(Spring {
                    ends: segment.ends.map(|end| end + offset),
                    rest_length,
                    stiffness,
                });
                family.times.push(cloth.damping.stiffness);
            }
        }
    }

    fn add_masses(&mut self, cloth: &schema::Cloth, lattice: &Lattice) {
        let material = &cloth.material;
        let density = material
            .area_density
            .or(material.linear_density)
            .or(material.density)
            .unwrap_or(0.0);
        let masses = lattice.shares.iter().map(|share| share * density);
        self.drag
            .extend(masses.clone().map(|m| m * cloth.damping.mass));
        self.masses.extend(masses);
        self.pinned.resize(self.masses.len(), false);
    }

    /// Adds the positions, and the velocities that the cloth starts with.
    fn add_state(&mut self, cloth: &schema::Cloth, positions: &[DVec3]) {
        let first = self.state.positions.len();
        let masses = &self.masses[first..];
        let moments = masses.iter().zip(positions).map(|(&m, &x)| x * m);
        let center = moments.sum::<DVec3>() / masses.iter().sum::<f64>();
        let start = &cloth.start;
        let (velocity, spin) = (
            DVec3::from_array(start.velocity),
            DVec3::from_array(start.spin),
        );
        for (x, pinned) in positions.iter().zip(&self.pinned[first..]) {
            let moving = velocity + spin.cross(*x - center);
            let velocity = if *pinned { DVec3::ZERO } else { moving };
            self.state.velocities.push(velocity);
        }
        self.state.positions.extend(positions);
    }

    /// Adds the hinges of a placed cloth of the shape `rest`. Where a pin clamps an edge, each
    /// triangle beside it with a free corner gets a hinge of its own against its mirror image, which
    /// is held: that keeps the tangent. The mirrored curve is symmetric, so that such a hinge turns
    /// by half of what an inner one would and its half of the energy needs k twice.
    fn add_hinges(
        &mut self,
        cloth: &schema::Cloth,
        lattice: &Lattice,
        rest: &[DVec3],
        clamped: &[(usize, Vec<u32>)],
    ) -> Result<(), Fault> {
        let first = self.state.positions.len();
        let bends = match cloth.bending {
            BendingName::None => return no_clamps(clamped),
            BendingName::EdgeSpring => &mut self.edge_springs,
            BendingName::DiscreteShell => &mut self.discrete_shells,
        };
        let hinges = mesh::hinges(&lattice.mesh.triangles);
        // A mesh's coordinates say nothing of warp and weft, a sheet's do.
        let axes = matches!(cloth.shape, Shape::Sheet(_)).then_some([DVec3::X, DVec3::Z]);
        let rigidity = Rigidity::of(rest, &hinges, axes);
        let bend = cloth.material.bend.unwrap_or(0.0);
        let clamps = clamp_edges(lattice, clamped, &self.pinned[first..])?;
        let time = cloth.damping.stiffness;
        let offset = index(first);
        let clamped: BTreeSet<[u32; 2]> = clamps
            .iter()
            .map(|&[a, b, _]| [a.min(b), a.max(b)])
            .collect();
        for corners in hinges {
            if clamped.contains(&[corners[0], corners[1]]) {
                continue;
            }
            let at_rest = corners.map(|corner| rest[corner as usize]);
            bends.hinges.push(Hinge {
                corners: corners.map(|corner| corner + offset),
                rest_angle: Dihedral::of(at_rest).fold.angle(),
                stiffness: rigidity.stiffness(at_rest, bend),
            });
            bends.times.push(time);
        }
        for clamp in clamps {
            let at_rest = clamp.map(|corner| rest[corner as usize]);
            let [a, b, c] = clamp.map(|corner| lattice.mesh.positions[corner as usize]);
            let [p, q, r] = clamp.map(|corner| corner + offset);
            bends.clamps.push(Clamp {
                hinge: Hinge {
                    corners: [p, q, r, u32::MAX],
                    rest_angle: 0.0,
                    stiffness: 2.0 * rigidity.stiffness(mirrored(at_rest), bend),
                },
                time,
                far: mirrored([a, b, c])[3],
            });
        }
        Ok(())
    }

    /// The model and its first state.
    pub(super) fn model(
        mut self,
        scene: &schema::Scene,
        obstacles: Vec<Obstacle>,
    ) -> (Model, State) {
        self.hold_clamps();
        let Self {
            cloths,
            state,
            masses,
            pinned,
            drag,
            families,
            edge_springs,
            discrete_shells,
        } = self;
        let (mut springs, mut spring_damping, mut limited) = (Vec::new(), Vec::new(), Vec::new());
        for (
            Family {
                springs: family,
                times,
            },
            (_, name),
        ) in families.into_iter().zip(KINDS)
        {
            if family.is_empty() {
                continue;
            }
            let batch = SpringBatch {
                family: name,
                springs: family,
            };
            if batch.is_weave() {
                limited.extend_from_slice(&batch.springs);
            }
            if times.iter().any(|&time| time > 0.0) {
                let springs = batch.clone();
                spring_damping.push(SpringDamping { springs, times });
            }
            springs.push(batch);
        }
        let inverse = |(&m, &pinned): (&f64, &bool)| if pinned { 0.0 } else { 1.0 / m };
        let model = Model {
            cloths,
            inverse_masses: masses.iter().zip(&pinned).map(inverse).collect(),
            gravity: Gravity {
                acceleration: DVec3::from_array(scene.gravity),
                masses: masses.clone(),
            },
            masses,
            springs,
            hinge_damping: hinge_damping([&edge_springs, &discrete_shells]),
            edge_springs: edge_springs.batch(),
            discrete_shells: discrete_shells.batch(),
            mass_damping: drag
                .iter()
                .any(|&c| c > 0.0)
                .then_some(MassDamping { drag }),
            spring_damping,
            strain_limit: scene.strain_limit.as_ref().map(|limit| StrainLimit {
                max: limit.max,
                springs: limited,
            }),
            obstacles,
        };
        (model, state)
    }

    /// Puts the far corners of the clamps behind the particles of all cloths: pinned, without mass.
    fn hold_clamps(&mut self) {
        for bends in [&mut self.edge_springs, &mut self.discrete_shells] {
            for Clamp {
                mut hinge,
                time,
                far,
            } in std::mem::take(&mut bends.clamps)
            {
                hinge.corners[3] = index(self.masses.len());
                bends.hinges.push(hinge);
                bends.times.push(time);
                self.state.positions.push(far);
                self.state.velocities.push(DVec3::ZERO);
                self.masses.push(0.0);
                self.pinned.push(true);
                self.drag.push(0.0);
            }
        }
    }
}

impl Bends {
    fn batch<L: BendingLaw>(self) -> Option<HingeBatch<L>> {
        (!self.hinges.is_empty()).then(|| HingeBatch::new(self.hinges))
    }
}

fn hinge_damping(bends: [&Bends; 2]) -> Option<HingeDamping> {
    let mut damping = HingeDamping::default();
    for bends in bends {
        let each = bends.hinges.iter().zip(&bends.times);
        for (&hinge, &time) in each.filter(|(_, time)| **time > 0.0) {
            damping.hinges.push(hinge);
            damping.times.push(time);
        }
    }
    (!damping.hinges.is_empty()).then_some(damping)
}

/// Where a cloth doesn't bend, no pin of its can clamp.
fn no_clamps(clamped: &[(usize, Vec<u32>)]) -> Result<(), Fault> {
    match clamped.first() {
        None => Ok(()),
        Some((i, _)) => Err(Fault::new(
            format!("pin.{i}.clamp"),
            "holds the tangent by hinges, and this cloth has none; give it bending = \"edge-spring\" or \"discrete-shell\", or remove clamp",
        )),
    }
}

/// The clamped edges: start, end and the free third vertex of each triangle beside one.
fn clamp_edges(
    lattice: &Lattice,
    clamped: &[(usize, Vec<u32>)],
    pinned: &[bool],
) -> Result<Vec<[u32; 3]>, Fault> {
    let mut edges = Vec::new();
    for (i, selected) in clamped {
        let mut held = vec![false; pinned.len()];
        selected
            .iter()
            .for_each(|&vertex| held[vertex as usize] = true);
        let before = edges.len();
        for &[a, b, c] in &lattice.mesh.triangles {
            for [start, end, tip] in [[a, b, c], [b, c, a], [c, a, b]] {
                if held[start as usize] && held[end as usize] && !pinned[tip as usize] {
                    edges.push([start, end, tip]);
                }
            }
        }
        if edges.len() == before {
            return Err(Fault::new(
                format!("pin.{i}.select"),
                "clamps no tangent: no edge of the cloth with a free triangle beside it has both its ends here; select two neighbouring vertices or more, or remove clamp",
            ));
        }
    }
    edges.sort_unstable();
    edges.dedup();
    Ok(edges)
}

/// The hinge of a triangle and its mirror image in its first edge, in its own plane.
fn mirrored([a, b, c]: [DVec3; 3]) -> [DVec3; 4] {
    let e = b - a;
    let foot = a + e * ((c - a).dot(e) / e.length_squared());
    [a, b, c, foot * 2.0 - c]
}

fn places(kind: SpringKind, lattice: &Lattice) -> &[Segment] {
    match kind {
        SpringKind::Structural | SpringKind::ZeroLength => &lattice.structural,
        SpringKind::Shear => &lattice.shear,
        SpringKind::Bend => &lattice.bend,
    }
}

fn shifted(triangles: &[[u32; 3]], offset: u32) -> Vec<[u32; 3]> {
    let moved = triangles.iter().map(|t| t.map(|vertex| vertex + offset));
    moved.collect()
}

/// More than 2³² particles don't fit into any memory that runs this.
#[expect(clippy::cast_possible_truncation, reason = "see above")]
fn index(i: usize) -> u32 {
    i as u32
}
