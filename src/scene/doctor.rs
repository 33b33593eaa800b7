//! What a scene models, in words.

use super::schema::Scene;
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
    for batch in &model.springs {
        let _ = writeln!(text, "- {} springs: {}", batch.family, batch.springs.len());
    }
    let hinges = model.hinges().count();
    match hinges {
        0 => part(&mut text, "bending by hinges", false),
        _ => {
            let _ = writeln!(text, "- hinges: {hinges}{}", laws(model));
        }
    }
    let clamps = model.particles() - model.cloth_particles();
    if clamps > 0 {
        let _ = writeln!(text, "- clamped edges: {clamps}");
    }
    let pinned = (0..model.cloth_particles())
        .filter(|&i| model.is_pinned(i))
        .count();
    let _ = writeln!(text, "- pinned particles: {pinned}");
    part(
        &mut text,
        "drag on all motion",
        model.mass_damping.is_some(),
    );
    part(
        &mut text,
        "damping of change of length",
        !model.spring_damping.is_empty(),
    );
    part(
        &mut text,
        "damping of bending",
        model.hinge_damping.is_some(),
    );
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
    for obstacle in &model.obstacles {
        let _ = writeln!(
            text,
            "- obstacle {}: {} triangles, thickness {} m, friction {}",
            obstacle.name,
            obstacle.mesh.triangles.len(),
            obstacle.thickness,
            obstacle.friction
        );
    }
    part(&mut text, "contact", !model.obstacles.is_empty());
    let _ = writeln!(text, "- gravity {:?} m/s²", scene.gravity);
    text
}

/// How the hinges bend.
fn laws(model: &Model) -> String {
    let mut text = String::new();
    if let Some(batch) = &model.edge_springs {
        let _ = write!(text, ", {} edge springs", batch.hinges.len());
    }
    if let Some(batch) = &model.discrete_shells {
        let _ = write!(text, ", {} of discrete shells", batch.hinges.len());
    }
    text
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
