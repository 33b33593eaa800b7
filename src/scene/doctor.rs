//! What a scene models, in words.

use super::schema::{ObstacleMotion, Pin, Scene};
use crate::model::Model;
use std::fmt::Write as _;

/// The parts of a model as a Markdown list: what is modelled, and what is not.
pub fn model_list(scene: &Scene, model: &Model) -> String {
    let mut text = String::new();
    let triangles: usize = model.cloths.iter().map(|cloth| cloth.triangles.len()).sum();
    let _ = writeln!(
        text,
        "- {} particles, {} springs, {triangles} triangles in {} cloth(s)",
        model.cloth_particles(),
        model.spring_count(),
        model.cloths.len()
    );
    elements(&mut text, model);
    let pinned = (0..model.cloth_particles())
        .filter(|&i| model.is_pinned(i))
        .count();
    let _ = writeln!(text, "- pinned particles: {pinned}");
    scene
        .pin
        .iter()
        .enumerate()
        .for_each(|(i, p)| pin(&mut text, i, p));
    for (what, modelled) in [
        ("drag on all motion", model.mass_damping.is_some()),
        (
            "damping of change of length",
            !model.spring_damping.is_empty(),
        ),
        ("damping of bending", model.hinge_damping.is_some()),
    ] {
        part(&mut text, what, modelled);
    }
    match &model.strain_limit {
        Some(limit) => {
            let _ = writeln!(
                text,
                "- strain limit {:.3} on {} springs",
                limit.max,
                limit.springs.len()
            );
        }
        None => part(&mut text, "strain limit", false),
    }
    contact(&mut text, scene, model);
    let _ = writeln!(text, "- gravity {:?} m/s²", scene.gravity);
    text
}

/// Obstacles, how they move and how distances from them are found; cloth with cloth.
fn contact(text: &mut String, scene: &Scene, model: &Model) {
    for (obstacle, asked) in model.obstacles.iter().zip(&scene.obstacle) {
        let motion = match &asked.motion {
            None => "at rest",
            Some(ObstacleMotion::Keyframes(_)) => "moves by keyframes",
            Some(ObstacleMotion::Walk(_)) => "walks",
            Some(ObstacleMotion::Sequence(_)) => "moves by a sequence",
        };
        let ccd = if asked.ccd { "on" } else { "off" };
        let _ = writeln!(
            text,
            "- obstacle {}: {} triangles, thickness {} m, friction {}, {motion}, continuous detection {ccd}",
            obstacle.name,
            obstacle.shape.triangles(),
            obstacle.thickness,
            obstacle.friction
        );
        if let Some(error) = obstacle.shape.grid_error() {
            let _ = writeln!(
                text,
                "  distances of particles on a grid, off by {:.1e} m at most and {:.1e} m in the mean (root of squares)",
                error.largest, error.root_mean_square
            );
        }
    }
    part(text, "contact with obstacles", !model.obstacles.is_empty());
    part(
        text,
        "contact of cloth with cloth",
        model.self_collision.is_some(),
    );
}

/// How a pin moves, and when it lets go; nothing of one that holds still for ever.
fn pin(text: &mut String, i: usize, pin: &Pin) {
    let mut what = Vec::new();
    let motion = pin.motion.as_ref().map(|motion| &motion.keyframes[..]);
    let end = motion.and_then(<[_]>::last).map(|key| key.t);
    match (end, pin.release) {
        (Some(end), Some(release)) if release <= end => {
            what.push(format!("moves until it is released at {release} s"));
        }
        _ => {
            what.extend(end.map(|t| format!("moves until {t} s")));
            what.extend(pin.release.map(|t| format!("is released at {t} s")));
        }
    }
    if !what.is_empty() {
        let _ = writeln!(text, "- pin {i} of {}: {}", pin.cloth, what.join(", "));
    }
}

/// Springs by family, hinges by law, clamps.
fn elements(text: &mut String, model: &Model) {
    for batch in &model.springs {
        let _ = writeln!(text, "- {} springs: {}", batch.family, batch.springs.len());
    }
    let edge_springs = model.edge_springs.as_ref().map(|batch| batch.hinges.len());
    let shells = model
        .discrete_shells
        .as_ref()
        .map(|batch| batch.hinges.len());
    for (law, hinges) in [("edge-spring", edge_springs), ("discrete-shell", shells)] {
        if let Some(hinges) = hinges {
            let _ = writeln!(text, "- {law} hinges: {hinges}");
        }
    }
    if edge_springs.or(shells).is_none() {
        part(text, "bending by hinges", false);
    }
    let clamps = model.particles() - model.cloth_particles();
    if clamps > 0 {
        let _ = writeln!(text, "- clamped edges: {clamps}");
    }
}

fn part(text: &mut String, what: &str, modelled: bool) {
    let _ = writeln!(
        text,
        "- {what}: {}",
        if modelled {
            "modelled"
        } else {
            "not modelled, costs nothing"
        }
    );
}
