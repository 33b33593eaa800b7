//! The mannequin's walk, placed in the world.

use super::place::Place;
use super::schema::{Obstacle, WalkMotion};
use crate::collision::Solid;
use crate::motion::{Deformation, Gait, Walk};
use glam::DVec3;

/// A walk in the mannequin's coordinates, and where these are in the world.
#[derive(Debug)]
pub(super) struct PlacedWalk {
    walk: Walk,
    place: Place,
}

impl PlacedWalk {
    /// The walk of an obstacle whose placed mesh is given.
    pub(super) fn new(
        obstacle: &Obstacle,
        asked: &WalkMotion,
        shape: &Solid,
    ) -> Result<Self, String> {
        let Solid::Mesh { mesh, .. } = shape else {
            return Err("needs a mesh".to_owned());
        };
        let place = Place::new(obstacle.rotate, obstacle.translate);
        let standing: Vec<DVec3> = mesh.positions.iter().map(|&p| place.undo(p)).collect();
        let gait = Gait {
            speed: asked.speed,
            start: asked.start,
            on_the_spot: asked.on_the_spot,
        };
        let walk = Walk::new(&standing, gait)?;
        Ok(Self { walk, place })
    }
}

impl Deformation for PlacedWalk {
    fn positions(&self, time: f64, positions: &mut [DVec3]) {
        self.walk.positions(time, positions);
        for position in positions {
            *position = self.place.of(*position);
        }
    }
}
