//! Is there room for what contact keeps apart? Thicknesses against the cells of the cloth.

use super::fault::Fault;
use super::schema::Scene;
use crate::model::Model;
use glam::DVec3;

/// Refuses layers thicker than most cells, and says where cells are smaller than a thickness: folds can't be
/// sharper than the thickness then, and detail of the mesh is lost.
pub(super) fn check(scene: &Scene, model: &Model, notes: &mut Vec<String>) -> Result<(), Fault> {
    let mut lengths: Vec<f64> = model
        .edges()
        .iter()
        .map(|[i, j]| at(model, *i).distance(at(model, *j)))
        .collect();
    lengths.sort_by(f64::total_cmp);
    let Some(&median) = lengths.get(lengths.len() / 2) else {
        return Ok(());
    };
    if let Some(asked) = &scene.self_collision {
        let thickness = asked.thickness;
        if thickness > median {
            return Err(Fault::new(
                "self_collision.thickness",
                format!(
                    "is {thickness} m, more than the {median:.4} m of most edges of the cloth, which would push each other away; use {:.1e} or less, or larger cells",
                    0.5 * median
                ),
            ));
        }
        let shorter = lengths.partition_point(|length| *length < thickness);
        if shorter > 0 {
            notes.push(format!(
                "self_collision: {shorter} of {} edges are shorter than the thickness of {thickness} m; their ends are kept only as far apart as they are at rest",
                lengths.len()
            ));
        }
    }
    for obstacle in &scene.obstacle {
        let thickness = obstacle.thickness;
        let shorter = lengths.partition_point(|length| *length < thickness);
        if 2 * shorter > lengths.len() {
            notes.push(format!(
                "obstacle {}: its thickness of {thickness} m is more than the length of {shorter} of {} edges of cloth; use {:.1e} or less for a closer fit",
                obstacle.name,
                lengths.len(),
                0.5 * median
            ));
        }
    }
    Ok(())
}

/// Where a particle is at rest (m).
fn at(model: &Model, particle: u32) -> DVec3 {
    model.rest[particle as usize]
}
