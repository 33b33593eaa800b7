//! Keeping whole edges and triangles apart: the last stage that moves anything.

use super::correct::hand_over;
use super::{Simulation, Stage};
use crate::collision::Solid as Body;
use crate::collision::impact::{Fabric, Impacts, Layers, Shape, Solid, Step};
use crate::energy::{CONTACT, FRICTION};
use crate::model::Model;
use crate::state::State;

/// Share of an obstacle's thickness that edges and triangles always keep. Particles rest a whole thickness
/// away, so that only what they don't hold comes so close: edges at sharp corners, and what is between
/// particles over a curved body.
const FLOOR: f64 = 0.1;

/// The stage for the obstacles that ask for it, and for cloth with cloth; none where nobody asks.
pub(super) fn of(model: &Model, start: &State) -> Option<Impacts> {
    let any = model.obstacles.iter().any(|obstacle| obstacle.continuous);
    if !any && model.self_collision.is_none() {
        return None;
    }
    let meshes = model.cloths.iter().flat_map(|cloth| &cloth.triangles);
    let triangles: Vec<[u32; 3]> = meshes.copied().collect();
    let links = model.links();
    let fabric = Fabric {
        particles: model.cloth_particles(),
        triangles: &triangles,
        edges: &links,
    };
    let mut impacts = Impacts::new(fabric, &solids(model), layers(model));
    let asked = model.obstacles.iter().filter(|body| body.continuous);
    for (number, obstacle) in asked.enumerate() {
        match &obstacle.shape {
            Body::Mesh { mesh, .. } => impacts.place(number, &mesh.positions, &mesh.positions),
            Body::Plane { point, .. } => impacts.place(number, &[*point], &[*point]),
            Body::Sphere { center, .. } => impacts.place(number, &[*center], &[*center]),
        }
    }
    impacts.shape(&start.positions[..model.cloth_particles()]);
    Some(impacts)
}

fn solids(model: &Model) -> Vec<Solid> {
    let asked = model.obstacles.iter().filter(|body| body.continuous);
    let solid = asked.map(|obstacle| Solid {
        shape: match &obstacle.shape {
            Body::Mesh { mesh, .. } => Shape::Mesh {
                vertices: mesh.positions.len(),
                triangles: mesh.triangles.clone(),
            },
            Body::Plane { normal, .. } => Shape::Plane { normal: *normal },
            Body::Sphere { radius, .. } => Shape::Sphere { radius: *radius },
        },
        friction: obstacle.friction,
        floor: FLOOR * obstacle.thickness,
    });
    solid.collect()
}

fn layers(model: &Model) -> Option<Layers> {
    let asked = model.self_collision.as_ref()?;
    let particles = model.cloth_particles();
    let mut cloth = vec![0; particles];
    for (number, one) in (0..).zip(&model.cloths) {
        cloth[one.particles.clone()].fill(number);
    }
    Some(Layers {
        thickness: asked.thickness,
        friction: asked.friction,
        rest: model.rest[..particles].to_vec(),
        cloth,
    })
}

impl Simulation {
    /// Keeps edges and triangles apart on their ways since the step's start, or only [parts](Impacts::part_once) them
    /// for now; whether anything was moved.
    pub(super) fn resolve_impacts(&mut self, settle: bool) -> bool {
        self.place_obstacles();
        let Self {
            model,
            state,
            before,
            impacts,
            ledger,
            mover,
            dt,
            stats,
            ..
        } = self;
        let Some(impacts) = impacts else {
            return false;
        };
        let cloth = ..model.cloth_particles();
        let step = Step {
            dt: *dt,
            before: &before.positions[cloth],
            inverse_masses: &model.inverse_masses[cloth],
        };
        let last = *mover;
        let resolved = stats.times.time(Stage::ResolveImpacts, || {
            hand_over(mover, CONTACT, ledger, model, &state.positions);
            let positions = &mut state.positions[cloth];
            let velocities = &mut state.velocities[cloth];
            if settle {
                impacts.resolve(step, positions, velocities)
            } else {
                impacts.part_once(step, positions, velocities)
            }
        });
        let sums = &mut stats.impacts;
        sums.impacts += resolved.impacts as u64;
        sums.zones += resolved.zones as u64;
        sums.missed += resolved.missed as u64;
        if !resolved.moved {
            if last != Some(CONTACT) {
                *mover = None;
            }
            return false;
        }
        ledger.slowed(CONTACT, resolved.approach);
        ledger.slowed(FRICTION, resolved.friction);
        ledger.pushed(resolved.work);
        // Gaps are those of where the particles are now.
        if !self.model.obstacles.is_empty() {
            self.detect_contacts();
        }
        true
    }

    /// Tells how obstacles that move go in the step.
    fn place_obstacles(&mut self) {
        let Self {
            model,
            bodies,
            impacts,
            ..
        } = self;
        let Some(impacts) = impacts else {
            return;
        };
        let asked = model.obstacles.iter().enumerate();
        let asked = asked.filter(|(_, body)| body.continuous).enumerate();
        for (number, (k, obstacle)) in asked {
            if obstacle.motion.is_none() {
                continue;
            }
            let ways = |start| [bodies.before(k, start), bodies.now(k, start)];
            match &obstacle.shape {
                Body::Mesh { .. } => {
                    let [before, after] = bodies.vertices(&model.obstacles, k);
                    impacts.place(number, before, after);
                }
                Body::Sphere { center, .. } => {
                    let [before, after] = ways(*center);
                    impacts.place(number, &[before], &[after]);
                }
                Body::Plane { point, normal } => {
                    let [before, after] = ways(*point);
                    impacts.place(number, &[before], &[after]);
                    impacts.tilt(number, bodies.turned(k, *normal));
                }
            }
        }
    }
}
