//! Where obstacles are, and how far they go in a step.

use super::obstacle::{BodyMotion, Obstacle, Solid};
use crate::mesh::{Nearest, Surface};
use crate::motion::{Deformation, Placement};
use crate::state::Archive;
use glam::DVec3;

/// The obstacles of a model as they stand.
#[derive(Clone, Debug, Default)]
pub struct Bodies {
    list: Vec<Body>,
    /// The time at which they stand (s).
    time: f64,
    /// How long the step was that brought them there (s).
    step: f64,
}

/// One obstacle where it is at the end of a step, and where it was at its start.
#[derive(Clone, Debug)]
enum Body {
    Resting,
    Rigid(Box<Rigid>),
    Deforming(Box<Deforming>),
}

/// Of one piece.
#[derive(Clone, Debug)]
struct Rigid {
    /// What it turns about, where it starts (m).
    center: DVec3,
    from: Placement,
    to: Placement,
    /// A mesh's vertices (m) at the start of the step and at its end.
    vertices: [Vec<DVec3>; 2],
}

/// A mesh whose vertices go their own ways.
#[derive(Clone, Debug)]
struct Deforming {
    /// Where its vertices are at the end of the step (m), and distances to it there.
    surface: Surface,
    /// Where they were at the start (m).
    from: Vec<DVec3>,
    /// Where they are to go next (m), scratch.
    next: Vec<DVec3>,
    /// Sum over all steps of how far the fastest vertex went (m).
    odometer: f64,
}

/// A point that goes with an obstacle.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Anchor {
    /// Number of the obstacle.
    pub obstacle: usize,
    /// The point where the obstacle starts (m), if it is of one piece.
    start: DVec3,
    /// The triangle that the point is on, and its place therein.
    triangle: u32,
    weights: [f64; 3],
}

impl Anchor {
    /// Carries all of it over.
    pub(super) fn carry(&mut self, archive: &mut Archive) {
        let Self {
            obstacle,
            start,
            triangle,
            weights,
        } = self;
        archive.index(obstacle);
        archive.vector(start);
        archive.small(triangle);
        weights.iter_mut().for_each(|weight| archive.real(weight));
    }
}

impl Bodies {
    /// All obstacles as they stand at a time (s).
    pub fn new(obstacles: &[Obstacle], time: f64) -> Self {
        let body = |obstacle: &Obstacle| match (&obstacle.motion, &obstacle.shape) {
            (Some(BodyMotion::Rigid(motion, center)), shape) => {
                Body::Rigid(Box::new(Rigid::new(shape, motion.at(time), *center)))
            }
            (Some(BodyMotion::Deforming(motion)), Solid::Mesh { surface, .. }) => {
                Body::Deforming(Box::new(Deforming::new(surface, motion.as_ref(), time)))
            }
            _ => Body::Resting,
        };
        Self {
            list: obstacles.iter().map(body).collect(),
            time,
            step: 0.0,
        }
    }

    /// Begins a step that ends at a time (s).
    pub fn begin_step(&mut self, obstacles: &[Obstacle], end: f64) {
        (self.step, self.time) = (end - self.time, end);
        for (body, obstacle) in self.list.iter_mut().zip(obstacles) {
            match (body, &obstacle.motion) {
                (Body::Rigid(body), Some(BodyMotion::Rigid(motion, _))) => {
                    body.move_to(&obstacle.shape, motion.at(end));
                }
                (Body::Deforming(body), Some(BodyMotion::Deforming(motion))) => {
                    body.move_to(motion.as_ref(), end);
                }
                _ => {}
            }
        }
    }

    /// Carries over what the time doesn't say.
    pub fn carry(&mut self, archive: &mut Archive) {
        for body in &mut self.list {
            if let Body::Deforming(body) = body {
                archive.real(&mut body.odometer);
            }
        }
    }

    /// The nearest point of an obstacle, closer than `reach` (m) to `p`: where it starts if it is of one
    /// piece, where it is otherwise.
    pub fn nearest(
        &self,
        obstacle: &Obstacle,
        number: usize,
        p: DVec3,
        reach: f64,
    ) -> Option<Nearest> {
        match &self.list[number] {
            Body::Deforming(body) => body.surface.nearest(p, reach),
            Body::Resting | Body::Rigid(_) => obstacle.shape.nearest(p, reach),
        }
    }

    /// How far the fastest vertex of an obstacle may have come (m); 0 of one piece.
    pub fn odometer(&self, obstacle: usize) -> f64 {
        match &self.list[obstacle] {
            Body::Deforming(body) => body.odometer,
            Body::Resting | Body::Rigid(_) => 0.0,
        }
    }

    /// Where a point (m) that goes with an obstacle of one piece, and is now at `x`, is when the obstacle
    /// starts; `x` itself otherwise.
    pub fn at_start(&self, obstacle: usize, x: DVec3) -> DVec3 {
        match &self.list[obstacle] {
            Body::Rigid(body) => body.to.back(x, body.center),
            Body::Resting | Body::Deforming(_) => x,
        }
    }

    /// Where a point (m) that goes with an obstacle of one piece is now.
    pub fn now(&self, obstacle: usize, start: DVec3) -> DVec3 {
        match &self.list[obstacle] {
            Body::Rigid(body) => body.to.of(start, body.center)[0],
            Body::Resting | Body::Deforming(_) => start,
        }
    }

    /// The same where the last step began.
    pub fn before(&self, obstacle: usize, start: DVec3) -> DVec3 {
        match &self.list[obstacle] {
            Body::Rigid(body) => body.from.of(start, body.center)[0],
            Body::Resting | Body::Deforming(_) => start,
        }
    }

    /// A direction, given where an obstacle of one piece starts, as it is now.
    pub fn turned(&self, obstacle: usize, direction: DVec3) -> DVec3 {
        match &self.list[obstacle] {
            Body::Rigid(body) => body.to.turned(direction),
            Body::Resting | Body::Deforming(_) => direction,
        }
    }

    /// A mesh's vertices (m) where the last step began, and now; none of other shapes.
    pub fn vertices<'a>(&'a self, obstacles: &'a [Obstacle], obstacle: usize) -> [&'a [DVec3]; 2] {
        match (&self.list[obstacle], &obstacles[obstacle].shape) {
            (Body::Rigid(body), _) => body.vertices.each_ref().map(Vec::as_slice),
            (Body::Deforming(body), _) => [&body.from, &body.surface.mesh().positions],
            (Body::Resting, Solid::Mesh { mesh, .. }) => [&mesh.positions; 2],
            (Body::Resting, _) => [&[]; 2],
        }
    }

    /// Speed of the fastest vertex, centre or point of a plane in the last step (m/s).
    pub fn fastest(&self, obstacles: &[Obstacle]) -> f64 {
        let mut way = 0.0_f64;
        for (k, obstacle) in obstacles.iter().enumerate() {
            let [from, to] = self.vertices(obstacles, k);
            let ways = from.iter().zip(to).map(|(a, b)| a.distance(*b));
            way = ways.fold(way, f64::max);
            if let Solid::Sphere { center: x, .. } | Solid::Plane { point: x, .. } = &obstacle.shape
            {
                way = way.max(self.before(k, *x).distance(self.now(k, *x)));
            }
        }
        if self.step > 0.0 {
            way / self.step
        } else {
            0.0
        }
    }

    /// The point of an obstacle that was found nearest to another.
    pub fn anchor(obstacle: usize, nearest: &Nearest) -> Anchor {
        Anchor {
            obstacle,
            start: nearest.point,
            triangle: nearest.triangle,
            weights: nearest.weights,
        }
    }

    /// Velocity of a point of an obstacle now (m/s); of one that deforms, the mean over the last step.
    pub fn velocity(&self, anchor: &Anchor) -> DVec3 {
        match &self.list[anchor.obstacle] {
            Body::Resting => DVec3::ZERO,
            Body::Rigid(body) => body.to.of(anchor.start, body.center)[1],
            Body::Deforming(_) if self.step > 0.0 => self.travel(anchor) / self.step,
            Body::Deforming(_) => DVec3::ZERO,
        }
    }

    /// How far a point of an obstacle goes in the step (m).
    pub fn travel(&self, anchor: &Anchor) -> DVec3 {
        match &self.list[anchor.obstacle] {
            Body::Resting => DVec3::ZERO,
            Body::Rigid(body) => {
                let [to, from] = [&body.to, &body.from];
                to.of(anchor.start, body.center)[0] - from.of(anchor.start, body.center)[0]
            }
            Body::Deforming(body) => {
                let corners = body.surface.mesh().triangles[anchor.triangle as usize];
                let each = corners.iter().zip(anchor.weights);
                each.map(|(&v, weight)| body.way(v as usize) * weight).sum()
            }
        }
    }
}

impl Rigid {
    fn new(shape: &Solid, to: Placement, center: DVec3) -> Self {
        let starts = match shape {
            Solid::Mesh { mesh, .. } => mesh.positions.clone(),
            Solid::Plane { .. } | Solid::Sphere { .. } => Vec::new(),
        };
        let mut body = Self {
            center,
            from: to,
            to,
            vertices: [starts.clone(), starts],
        };
        // Twice: it has not moved.
        body.move_to(shape, to);
        body.move_to(shape, to);
        body
    }

    fn move_to(&mut self, shape: &Solid, to: Placement) {
        (self.from, self.to) = (self.to, to);
        self.vertices.swap(0, 1);
        if let Solid::Mesh { mesh, .. } = shape {
            for (vertex, start) in self.vertices[1].iter_mut().zip(&mesh.positions) {
                *vertex = to.of(*start, self.center)[0];
            }
        }
    }
}

impl Deforming {
    fn new(surface: &Surface, motion: &dyn Deformation, time: f64) -> Self {
        let mut from = surface.mesh().positions.clone();
        motion.positions(time, &mut from);
        let mut surface = surface.clone();
        surface.move_to(&from);
        Self {
            surface,
            next: from.clone(),
            from,
            odometer: 0.0,
        }
    }

    fn move_to(&mut self, motion: &dyn Deformation, time: f64) {
        motion.positions(time, &mut self.next);
        self.from.copy_from_slice(&self.surface.mesh().positions);
        self.surface.move_to(&self.next);
        let ways = (0..self.from.len()).map(|v| self.way(v).length_squared());
        self.odometer += ways.fold(0.0, f64::max).sqrt();
    }

    /// How far a vertex goes in the step (m).
    fn way(&self, vertex: usize) -> DVec3 {
        self.surface.mesh().positions[vertex] - self.from[vertex]
    }
}
