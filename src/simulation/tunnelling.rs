//! How far things go in a step, against what they could pass through.

use super::Simulation;
use crate::collision::{Bodies, Solid};
use crate::model::Model;
use glam::DVec3;

/// The fastest expected motion of cloth against obstacles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tunnelling {
    /// Speed of the cloth (m/s): its fastest particle at the start or, driven by a pin, later, and what it
    /// gains by falling.
    pub cloth: f64,
    /// Speed of the fastest obstacle (m/s).
    pub obstacle: f64,
    /// How far they go against each other in a step (m).
    pub way: f64,
    /// Least thickness (m).
    pub thickness: f64,
    /// Longest step (s) in which nothing goes farther than the thickness: without continuous detection a
    /// longer one may miss what it passes through.
    pub needed_dt: f64,
    /// Whether continuous detection is on everywhere.
    pub continuous: bool,
}

/// Times at which motions are looked at.
const LOOKS: u32 = 400;

/// What may be expected of a simulation of some duration (s) from its first state; `None` without contact.
pub fn tunnelling(run: &Simulation, duration: f64) -> Option<Tunnelling> {
    let model = run.model();
    let layers = model.self_collision.iter().map(|layers| layers.thickness);
    let bodies = model.obstacles.iter().map(|obstacle| obstacle.thickness);
    let thickness = layers.chain(bodies).reduce(f64::min)?;
    let still = run.state().velocities.iter();
    let first = still.map(|v| v.length()).fold(0.0, f64::max);
    let cloth = first.max(pins(model, duration)) + fall(run, duration);
    let obstacle = obstacles(model, duration);
    let way = (cloth + obstacle) * run.dt();
    Some(Tunnelling {
        cloth,
        obstacle,
        way,
        thickness,
        needed_dt: thickness / (cloth + obstacle).max(f64::MIN_POSITIVE),
        continuous: model.obstacles.iter().all(|obstacle| obstacle.continuous),
    })
}

/// Speed (m/s) of a free fall of the whole duration, or from the highest particle to below everything: the
/// cloth's own height, and that of the obstacles under it. A hanging cloth falls by no more than its size.
fn fall(run: &Simulation, duration: f64) -> f64 {
    let model = run.model();
    let g = model.gravity.acceleration;
    let up = -g.normalize_or_zero();
    let heights = run.state().positions.iter().map(|x| x.dot(up));
    let (low, high) = heights.fold((f64::MAX, f64::MIN), |(low, high), h| {
        (low.min(h), high.max(h))
    });
    let size = model.rest.iter().copied();
    let box_of = size.clone().reduce(DVec3::min).zip(size.reduce(DVec3::max));
    let size = box_of.map_or(0.0, |(a, b)| a.distance(b));
    let bottom = (model
        .obstacles
        .iter()
        .map(|obstacle| lowest(&obstacle.shape, up)))
    .fold(low, f64::min);
    let way = (high - bottom).max(size).max(0.0);
    (g.length() * duration).min((2.0 * g.length() * way).sqrt())
}

/// Lowest height (m) of a shape where it starts.
fn lowest(shape: &Solid, up: DVec3) -> f64 {
    match shape {
        Solid::Mesh { mesh, .. } => {
            let heights = mesh.positions.iter().map(|x| x.dot(up));
            heights.fold(f64::MAX, f64::min)
        }
        Solid::Plane { point, .. } => point.dot(up),
        Solid::Sphere { center, radius } => center.dot(up) - radius,
    }
}

/// Speed of the fastest driven pin (m/s).
fn pins(model: &Model, duration: f64) -> f64 {
    let times = (0..=LOOKS).map(|k| duration * f64::from(k) / f64::from(LOOKS));
    let drives = |time: f64| {
        model.pins.drives.iter().map(move |drive| {
            let placement = drive.motion.at(time);
            let speeds = drive.starts.iter();
            let speeds = speeds.map(|&start| placement.of(start, drive.center)[1].length());
            speeds.fold(0.0, f64::max)
        })
    };
    times.flat_map(drives).fold(0.0, f64::max)
}

/// Speed of the obstacles' fastest point (m/s).
fn obstacles(model: &Model, duration: f64) -> f64 {
    if model
        .obstacles
        .iter()
        .all(|obstacle| obstacle.motion.is_none())
    {
        return 0.0;
    }
    let step = duration / f64::from(LOOKS);
    let mut bodies = Bodies::new(&model.obstacles, 0.0);
    let mut fastest: f64 = 0.0;
    for k in 1..=LOOKS {
        bodies.begin_step(&model.obstacles, step * f64::from(k));
        for (number, obstacle) in model.obstacles.iter().enumerate() {
            let [from, to] = bodies.vertices(&model.obstacles, number);
            let ways = from.iter().zip(to).map(|(a, b)| a.distance(*b));
            let centre = match &obstacle.shape {
                Solid::Sphere { center: x, .. } | Solid::Plane { point: x, .. } => {
                    bodies.before(number, *x).distance(bodies.now(number, *x))
                }
                Solid::Mesh { .. } => 0.0,
            };
            fastest = ways.fold(fastest.max(centre / step), |most, way| most.max(way / step));
        }
    }
    fastest
}
