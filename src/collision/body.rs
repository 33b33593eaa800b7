//! Where obstacles are, and how far they go in a step.

use super::obstacle::{BodyMotion, Obstacle};
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
            Some(BodyMotion::Rigid(motion, center)) => Body::Rigid {
                center: *center,
                from: motion.at(time),
                to: motion.at(time),
            },
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
            if let (Body::Rigid { from, to, .. }, Some(BodyMotion::Rigid(motion, _))) =
                (body, &obstacle.motion)
            {
                *from = *to;
                *to = motion.at(end);
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
            Body::Rigid { center, from, to } => {
                to.of(anchor.start, *center)[0] - from.of(anchor.start, *center)[0]
            }
        }
    }
}
