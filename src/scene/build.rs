//! From a scene to a model and its first state.

use super::body::read_obstacle;
use super::fault::{Fault, SceneError};
use super::load::LoadedScene;
use super::place::place;
use super::schema::{self, ChainShape, Select, Shape, SheetShape, SpringKind};
use super::stiffness;
use crate::collision::Obstacle;
use crate::force::{Gravity, MassDamping, Spring, SpringBatch, SpringDamping};
use crate::mesh::{self, Diagonals, Lattice, Segment, Sheet};
use crate::model::{Cloth, Model};
use crate::state::State;
use crate::strain_limit::StrainLimit;
use glam::DVec3;

/// A scene that is ready to run.
#[derive(Debug)]
pub struct Built {
    /// What is fixed.
    pub model: Model,
    /// The first state.
    pub state: State,
    /// What was repaired on the way, a line each.
    pub notes: Vec<String>,
}

/// Makes the model and the first state of a scene.
///
/// # Errors
///
/// A pin that selects nothing, an opening that doesn't fit, an obstacle that can't be read or isn't
/// closed.
pub fn build(loaded: &LoadedScene) -> Result<Built, SceneError> {
    let scene = &loaded.scene;
    let mut parts = Parts::default();
    for (i, cloth) in scene.cloth.iter().enumerate() {
        let lattice = lattice(i, cloth).map_err(|fault| loaded.error(&fault))?;
        let pins = scene
            .pin
            .iter()
            .enumerate()
            .filter(|(_, pin)| pin.cloth == cloth.name);
        parts
            .add(cloth, lattice, pins)
            .map_err(|fault| loaded.error(&fault))?;
    }
    let mut notes = Vec::new();
    let obstacles = scene
        .obstacle
        .iter()
        .enumerate()
        .map(|(i, obstacle)| read_obstacle(loaded, i, obstacle, &mut notes))
        .collect::<Result<_, _>>()?;
    let (model, state) = parts.model(scene, obstacles);
    Ok(Built {
        model,
        state,
        notes,
    })
}

/// A model in the making: what the cloths have brought so far.
#[derive(Default)]
struct Parts {
    cloths: Vec<Cloth>,
    positions: Vec<DVec3>,
    masses: Vec<f64>,
    pinned: Vec<bool>,
    drag: Vec<f64>,
    families: [Family; 3],
}

/// The springs of one kind, with the damping time τ of each (s).
#[derive(Default)]
struct Family {
    springs: Vec<Spring>,
    times: Vec<f64>,
}

impl Parts {
    fn add<'a>(
        &mut self,
        cloth: &schema::Cloth,
        mut lattice: Lattice,
        pins: impl Iterator<Item = (usize, &'a schema::Pin)>,
    ) -> Result<(), Fault> {
        let first = self.positions.len();
        for kind in [SpringKind::Structural, SpringKind::Shear, SpringKind::Bend] {
            if cloth.springs.contains(&kind) {
                self.add_springs(kind, cloth, &lattice);
            }
        }
        let density = cloth
            .material
            .area_density
            .or(cloth.material.linear_density)
            .unwrap_or(0.0);
        self.masses
            .extend(lattice.shares.iter().map(|share| share * density));
        let masses = self.masses[first..].to_vec();
        self.drag
            .extend(masses.iter().map(|m| m * cloth.damping.mass));
        place(&mut lattice.mesh.positions, cloth.rotate, cloth.translate);
        self.pinned.resize(first + masses.len(), false);
        for (i, pin) in pins {
            for vertex in select(&pin.select, &lattice)
                .map_err(|cause| Fault::new(format!("pin.{i}.select"), cause))?
            {
                self.pinned[first + vertex as usize] = true;
            }
        }
        let offset = index(first);
        self.cloths.push(Cloth {
            name: cloth.name.clone(),
            particles: first..first + masses.len(),
            triangles: lattice
                .mesh
                .triangles
                .iter()
                .map(|t| t.map(|vertex| vertex + offset))
                .collect(),
        });
        self.positions.extend(&lattice.mesh.positions);
        Ok(())
    }

    fn add_springs(&mut self, kind: SpringKind, cloth: &schema::Cloth, lattice: &Lattice) {
        let offset = index(self.positions.len());
        let family = &mut self.families[kind as usize];
        for segment in places(kind, lattice) {
            let [a, b] = segment.ends.map(|end| lattice.mesh.positions[end as usize]);
            let rest_length = (b - a).length();
            let stiffness = constant(kind, cloth, segment.area, rest_length);
            if stiffness > 0.0 {
                let ends = segment.ends.map(|end| end + offset);
                family.springs.push(Spring {
                    ends,
                    rest_length,
                    stiffness,
                });
                family.times.push(cloth.damping.stiffness);
            }
        }
    }

    fn model(self, scene: &schema::Scene, obstacles: Vec<Obstacle>) -> (Model, State) {
        let Self {
            cloths,
            positions,
            masses,
            pinned,
            drag,
            families,
        } = self;
        let names = ["structural", "shear", "bend"];
        let (mut springs, mut spring_damping, mut limited) = (Vec::new(), Vec::new(), Vec::new());
        for (family, name) in families.into_iter().zip(names) {
            if family.springs.is_empty() {
                continue;
            }
            let batch = SpringBatch {
                family: name,
                springs: family.springs,
            };
            if name != "bend" {
                limited.extend_from_slice(&batch.springs);
            }
            if family.times.iter().any(|&time| time > 0.0) {
                spring_damping.push(SpringDamping {
                    springs: batch.clone(),
                    times: family.times,
                });
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
        (model, State::at_rest(positions))
    }
}

fn lattice(i: usize, cloth: &schema::Cloth) -> Result<Lattice, Fault> {
    match &cloth.shape {
        Shape::Chain(ChainShape { length, links }) => Ok(mesh::chain(*length, *links)),
        Shape::Sheet(SheetShape {
            size,
            cells,
            diagonals,
            opening,
        }) => {
            let sheet = Sheet {
                size: *size,
                cells: *cells,
                diagonals: *diagonals,
                opening: opening.clone(),
            };
            let fault = |cause: mesh::OpeningTooLarge| {
                Fault::new(format!("cloth.{i}.shape.sheet.opening"), cause.to_string())
            };
            sheet.lattice().map_err(fault)
        }
    }
}

fn places(kind: SpringKind, lattice: &Lattice) -> &[Segment] {
    match kind {
        SpringKind::Structural => &lattice.structural,
        SpringKind::Shear => &lattice.shear,
        SpringKind::Bend => &lattice.bend,
    }
}

/// Spring constant (N/m) of a spring of a cloth.
fn constant(kind: SpringKind, cloth: &schema::Cloth, area: f64, length: f64) -> f64 {
    let has = |kind| cloth.springs.contains(&kind);
    let stretch = cloth.material.stretch;
    let rigidity = if has(SpringKind::Bend) {
        cloth.material.bend.unwrap_or(0.0)
    } else {
        0.0
    };
    let Shape::Sheet(SheetShape { diagonals, .. }) = cloth.shape else {
        return match kind {
            SpringKind::Bend => stiffness::bend_chain(rigidity, stretch, length),
            _ => stiffness::link(stretch, rigidity, length),
        };
    };
    // Without shear springs the weave carries the load alone, whatever the triangles look like.
    let carrying = if has(SpringKind::Shear) {
        diagonals
    } else {
        Diagonals::None
    };
    match kind {
        SpringKind::Structural => stiffness::structural(stretch, rigidity, area, length, carrying),
        SpringKind::Shear => stiffness::shear(stretch, area, length, diagonals),
        SpringKind::Bend => stiffness::bend(rigidity, stretch, area, length, carrying),
    }
}

/// The vertices of a placed cloth that a pin selects; at least one.
fn select(select: &Select, lattice: &Lattice) -> Result<Vec<u32>, String> {
    let positions = &lattice.mesh.positions;
    let vertices: Vec<u32> = match select {
        Select::Edge(name) => {
            let edge = lattice.edges.iter().find(|(known, _)| known == name);
            edge.map(|(_, vertices)| vertices.clone())
                .ok_or("this shape has no edges; select a corner")?
        }
        Select::Corner(names) => names
            .iter()
            .map(|name| corner(name, lattice))
            .collect::<Result<_, _>>()?,
        Select::Vertices(vertices) => vertices.clone(),
        Select::Box([low, high]) => {
            // A micrometre of grace: placing rounds, and boxes are drawn along rows of vertices.
            let (low, high) = (
                DVec3::from_array(*low) - 1e-6,
                DVec3::from_array(*high) + 1e-6,
            );
            let inside = |p: &DVec3| p.cmpge(low).all() && p.cmple(high).all();
            (0..index(positions.len()))
                .filter(|&i| inside(&positions[i as usize]))
                .collect()
        }
    };
    if let Some(beyond) = vertices
        .iter()
        .find(|&&vertex| vertex as usize >= positions.len())
    {
        return Err(format!(
            "there is no vertex {beyond}: the cloth has {}, counted from 0",
            positions.len()
        ));
    }
    if vertices.is_empty() {
        return Err(
            "selects no particle; name some, or make the box larger or move it (it is in world coordinates)"
                .to_owned(),
        );
    }
    Ok(vertices)
}

fn corner(name: &str, lattice: &Lattice) -> Result<u32, String> {
    let known = || {
        lattice
            .corners
            .iter()
            .map(|(name, _)| name.as_str())
            .collect::<Vec<_>>()
            .join(", ")
    };
    let found = lattice.corners.iter().find(|(corner, _)| corner == name);
    found
        .map(|(_, vertex)| *vertex)
        .ok_or_else(|| format!("there is no corner \"{name}\"; this shape has {}", known()))
}

/// More than 2³² particles don't fit into any memory that runs this.
#[expect(clippy::cast_possible_truncation, reason = "see above")]
fn index(i: usize) -> u32 {
    i as u32
}
