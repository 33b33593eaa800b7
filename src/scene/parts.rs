//! A model in the making: what the cloths have brought so far.

use super::bends::{Bends, Clamping, Placed};
use super::fault::Fault;
use super::hold::{Holds, until};
use super::place::place;
use super::schema::{self, SpringKind};
use super::select::select;
use super::spring_constant::spring_constant;
use crate::collision::{Obstacle, SelfCollision};
use crate::force::{Gravity, MassDamping, Spring, SpringBatch, SpringDamping};
use crate::mesh::{Lattice, Segment};
use crate::model::{Cloth, Model};
use crate::state::State;
use crate::strain_limit::StrainLimit;
use glam::DVec3;

#[derive(Default)]
pub(super) struct Parts {
    cloths: Vec<Cloth>,
    state: State,
    rest: Vec<DVec3>,
    masses: Vec<f64>,
    holds: Holds,
    drag: Vec<f64>,
    families: [Family; 4],
    bends: Bends,
}

/// The springs of one kind, with the damping time τ of each (s).
#[derive(Default)]
struct Family {
    springs: Vec<Spring>,
    times: Vec<f64>,
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
            let positions = &lattice.mesh.positions;
            self.holds.add(i, pin, first, &selected, positions)?;
            if pin.clamp {
                clamped.push(Clamping {
                    pin: i,
                    vertices: selected,
                    until: until(pin),
                });
            }
        }
        self.bends.add(&Placed {
            cloth,
            lattice: &lattice,
            rest: &rest,
            first: index(first),
            holds: &self.holds.each[first..],
            clamped: &clamped,
        })?;
        self.add_state(cloth, &lattice.mesh.positions);
        self.rest.extend(rest);
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
        let along = match kind {
            SpringKind::Structural => lattice.bends_along(),
            _ => Vec::new(),
        };
        let along = along.into_iter().chain(std::iter::repeat(0));
        for (segment, bends) in places(kind, lattice).iter().zip(along) {
            let [a, b] = segment.ends.map(|end| lattice.mesh.positions[end as usize]);
            let stiffness = spring_constant(kind, cloth, segment, b - a, bends);
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
        self.holds.each.resize(self.masses.len(), None);
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
        for (x, hold) in positions.iter().zip(&self.holds.each[first..]) {
            let moving = velocity + spin.cross(*x - center);
            let velocity = if hold.is_some() { DVec3::ZERO } else { moving };
            self.state.velocities.push(velocity);
        }
        self.state.positions.extend(positions);
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
            mut state,
            rest,
            masses,
            holds,
            drag,
            families,
            mut bends,
        } = self;
        let (springs, spring_damping) = spring_batches(families);
        let weave = springs.iter().filter(|batch| batch.is_weave());
        let limited = weave.flat_map(|batch| &batch.springs).copied();
        let limit = |limit: &schema::StrainLimit| StrainLimit {
            max: limit.max,
            springs: limited.collect(),
        };
        let strain_limit = scene.strain_limit.as_ref().map(limit);
        let inverse_masses = masses.iter().zip(&holds.each);
        let inverse_masses = inverse_masses.map(|(m, hold)| hold.map_or(1.0 / m, |_| 0.0));
        let hinge_damping = bends.damping();
        let switches = bends.switches();
        let (edge_springs, discrete_shells) = bends.batches();
        let model = Model {
            cloths,
            inverse_masses: inverse_masses.collect(),
            pins: holds.pins(&state.positions, switches),
            gravity: Gravity::new(DVec3::from_array(scene.gravity), &masses),
            masses,
            rest,
            strain_limit,
            springs,
            edge_springs,
            discrete_shells,
            mass_damping: drag
                .iter()
                .any(|&c| c > 0.0)
                .then_some(MassDamping { drag }),
            spring_damping,
            hinge_damping,
            obstacles,
            self_collision: scene.self_collision.as_ref().map(self_collision),
        };
        model.drive(&mut state);
        (model, state)
    }

    /// Puts the far corners of the clamps behind the particles of all cloths: pinned, without mass.
    fn hold_clamps(&mut self) {
        let held = self.bends.hold_clamps(index(self.masses.len()));
        let particles = self.masses.len() + held.len();
        for far in held {
            self.state.positions.push(far.held);
            self.rest.push(far.rest);
            self.holds.add_far(far.drive);
        }
        self.state.velocities.resize(particles, DVec3::ZERO);
        self.masses.resize(particles, 0.0);
        self.drag.resize(particles, 0.0);
    }
}

fn self_collision(asked: &schema::SelfCollision) -> SelfCollision {
    SelfCollision {
        thickness: asked.thickness,
        friction: asked.friction,
    }
}

/// The families that have springs, and the damping of those that have any.
fn spring_batches(families: [Family; 4]) -> (Vec<SpringBatch>, Vec<SpringDamping>) {
    let (mut batches, mut dampings) = (Vec::new(), Vec::new());
    for (Family { springs, times }, (_, family)) in families.into_iter().zip(KINDS) {
        if springs.is_empty() {
            continue;
        }
        let batch = SpringBatch { family, springs };
        if times.iter().any(|&time| time > 0.0) {
            let springs = batch.clone();
            dampings.push(SpringDamping { springs, times });
        }
        batches.push(batch);
    }
    (batches, dampings)
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
