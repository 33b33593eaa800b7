//! Where obstacles are, and how far they go in a step.

use super::obstacle::{BodyMotion, Obstacle, Solid};
use crate::mesh::Nearest;
use crate::motion::Placement;
use glam::DVec3;

/// The obstacles of a model as they stand.
#[derive(Clone, Debug, Default)]
pub struct Bodies {
    list: Vec<Body>,
    /// The time at which they stand (s).
    time: f64,
}

/// One obstacle where it is at the end of a step, and where it was at its start.
#[derive(Clone, Debug)]
#[expect(clippy::large_enum_variant, reason = "a scene has a handful")]
enum Body {
    /// Where it starts.
    Resting,
    /// As one piece, about a centre (m).
    Rigid {
        center: DVec3,
        from: Placement,
        to: Placement,
        /// A mesh's vertices (m) at the start of the step and at its end.
        vertices: [Vec<DVec3>; 2],
    },
}

/// A point that goes with an obstacle.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Anchor {
    /// Number of the obstacle.
    pub obstacle: usize,
    /// The point where the obstacle starts (m).
    start: DVec3,
}

impl Bodies {
    /// All obstacles as they stand at a time (s).
    pub fn new(obstacles: &[Obstacle], time: f64) -> Self {
        let body = |obstacle: &Obstacle| match &obstacle.motion {
            None => Body::Resting,
            Some(BodyMotion::Rigid(motion, center)) => {
                let to = motion.at(time);
                let vertices = moved(obstacle, to, *center);
                Body::Rigid {
                    center: *center,
                    from: to,
                    to,
                    vertices: [vertices.clone(), vertices],
                }
            }
        };
        Self {
            list: obstacles.iter().map(body).collect(),
            time,
        }
    }

    /// Whether any obstacle moves.
    pub fn any_moves(&self) -> bool {
        let moves = |body: &Body| !matches!(body, Body::Resting);
        self.list.iter().any(moves)
    }

    /// Begins a step that ends at a time (s).
    pub fn begin_step(&mut self, obstacles: &[Obstacle], end: f64) {
        self.time = end;
        for (body, obstacle) in self.list.iter_mut().zip(obstacles) {
            let Some(BodyMotion::Rigid(motion, center)) = &obstacle.motion else {
                continue;
            };
            if let Body::Rigid {
                from, to, vertices, ..
            } = body
            {
                *from = *to;
                *to = motion.at(end);
                vertices.swap(0, 1);
                move_to(obstacle, *to, *center, &mut vertices[1]);
            }
        }
    }

    /// Where a point (m) that goes with an obstacle, and is now at `x`, is when the obstacle starts.
    pub fn at_start(&self, obstacle: usize, x: DVec3) -> DVec3 {
        match &self.list[obstacle] {
            Body::Resting => x,
            Body::Rigid { center, to, .. } => to.back(x, *center),
        }
    }

    /// Where a point (m) that goes with an obstacle is now.
    pub fn now(&self, obstacle: usize, start: DVec3) -> DVec3 {
        match &self.list[obstacle] {
            Body::Resting => start,
            Body::Rigid { center, to, .. } => to.of(start, *center)[0],
        }
    }

    /// A mesh's vertices now (m); none of other shapes.
    pub fn vertices<'a>(&'a self, obstacles: &'a [Obstacle], obstacle: usize) -> &'a [DVec3] {
        match (&self.list[obstacle], &obstacles[obstacle].shape) {
            (Body::Rigid { vertices, .. }, _) => &vertices[1],
            (Body::Resting, Solid::Mesh { mesh, .. }) => &mesh.positions,
            _ => &[],
        }
    }

    /// A direction, given where the obstacle starts, as it is now.
    pub fn turned(&self, obstacle: usize, direction: DVec3) -> DVec3 {
        match &self.list[obstacle] {
            Body::Resting => direction,
            Body::Rigid { to, .. } => to.turned(direction),
        }
    }

    /// The point of an obstacle that is nearest to another point; both where the obstacle starts (m).
    pub fn anchor(obstacle: usize, nearest: &Nearest) -> Anchor {
        Anchor {
            obstacle,
            start: nearest.point,
        }
    }

    /// Velocity of a point of an obstacle now (m/s).
    pub fn velocity(&self, anchor: &Anchor) -> DVec3 {
        match &self.list[anchor.obstacle] {
            Body::Resting => DVec3::ZERO,
            Body::Rigid { center, to, .. } => to.of(anchor.start, *center)[1],
        }
    }

    /// How far a point of an obstacle goes in the step (m).
    pub fn travel(&self, anchor: &Anchor) -> DVec3 {
        match &self.list[anchor.obstacle] {
            Body::Resting => DVec3::ZERO,
            Body::Rigid {
                center, from, to, ..
            } => to.of(anchor.start, *center)[0] - from.of(anchor.start, *center)[0],
        }
    }
}

/// A mesh's vertices (m) as a rigid motion has placed them.
fn moved(obstacle: &Obstacle, to: Placement, center: DVec3) -> Vec<DVec3> {
    let mut vertices = match &obstacle.shape {
        Solid::Mesh { mesh, .. } => mesh.positions.clone(),
        Solid::Plane { .. } | Solid::Sphere { .. } => Vec::new(),
    };
    move_to(obstacle, to, center, &mut vertices);
    vertices
}

fn move_to(obstacle: &Obstacle, to: Placement, center: DVec3, vertices: &mut [DVec3]) {
    if let Solid::Mesh { mesh, .. } = &obstacle.shape {
        for (vertex, start) in vertices.iter_mut().zip(&mesh.positions) {
            *vertex = to.of(*start, center)[0];
        }
    }
}
