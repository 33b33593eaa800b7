//! The parts of a scene that can be taken out of it, by the changes that do so.

use crate::model::Model;
use crate::scene::{BendingName, Scene, SpringKind};

/// A part of what a scene models.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Part {
    /// What it is.
    pub name: String,
    /// What takes it out of the scene: each as `--set` reads it.
    pub changes: Vec<String>,
}

/// Everything that a scene models and could do without; of several cloths, one kind of part at once.
///
/// Structural springs, without which cloth falls apart, pins and gravity are not parts in this sense.
pub fn parts(scene: &Scene, model: &Model) -> Vec<Part> {
    let mut parts = vec![
        springs(scene, model, SpringKind::Shear, "shear"),
        springs(scene, model, SpringKind::Bend, "bend"),
        hinges(scene, model),
        damping(scene, "drag on all motion", "mass"),
        damping(scene, "damping of deformation", "stiffness"),
        Part {
            name: "strain limit".to_owned(),
            changes: scene
                .strain_limit
                .iter()
                .map(|_| "strain_limit=".to_owned())
                .collect(),
        },
    ];
    for (i, obstacle) in scene.obstacle.iter().enumerate() {
        let at = format!("obstacle.{}", key(i, &obstacle.name));
        let rubs = obstacle.friction > 0.0;
        parts.push(Part {
            name: format!("friction on {}", obstacle.name),
            changes: rubs
                .then(|| format!("{at}.friction=0"))
                .into_iter()
                .collect(),
        });
        parts.push(Part {
            name: format!("contact with {}", obstacle.name),
            changes: vec![format!("{at}=")],
        });
    }
    parts.retain(|part| !part.changes.is_empty());
    parts
}

/// How changes call an entry: by its name, or by its number where the name could be read otherwise.
pub(in crate::study) fn key(number: usize, name: &str) -> String {
    let plain = |c: char| c.is_alphanumeric() || c == '-' || c == '_';
    let digits = name.chars().all(|c| c.is_ascii_digit());
    if name.chars().all(plain) && !digits {
        name.to_owned()
    } else {
        number.to_string()
    }
}

fn springs(scene: &Scene, model: &Model, kind: SpringKind, family: &str) -> Part {
    let mut changes = Vec::new();
    for (i, (cloth, built)) in scene.cloth.iter().zip(&model.cloths).enumerate() {
        let own = |end: u32| built.particles.contains(&(end as usize));
        let mut batches = model.springs.iter().filter(|batch| batch.family == family);
        if !batches.any(|batch| batch.springs.iter().any(|spring| own(spring.ends[0]))) {
            continue;
        }
        let others = cloth.springs.iter().filter(|other| **other != kind);
        let others: Vec<String> = others.map(|other| format!("{:?}", name(*other))).collect();
        changes.push(format!(
            "cloth.{}.springs=[{}]",
            key(i, &cloth.name),
            others.join(", ")
        ));
    }
    Part {
        name: format!("{family} springs"),
        changes,
    }
}

/// A kind of springs as scenes name it.
fn name(kind: SpringKind) -> &'static str {
    match kind {
        SpringKind::Structural => "structural",
        SpringKind::Shear => "shear",
        SpringKind::Bend => "bend",
        SpringKind::ZeroLength => "zero-length",
    }
}

/// Hinges, and the clamps that hold a tangent by them.
fn hinges(scene: &Scene, model: &Model) -> Part {
    let mut changes = Vec::new();
    let mut clamps = Vec::new();
    for (i, (cloth, built)) in scene.cloth.iter().zip(&model.cloths).enumerate() {
        let own = |corner: u32| built.particles.contains(&(corner as usize));
        let has_hinges = model.hinges().any(|hinge| own(hinge.corners[0]));
        if cloth.bending == BendingName::None || !has_hinges {
            continue;
        }
        changes.push(format!("cloth.{}.bending=none", key(i, &cloth.name)));
        let pins = scene.pin.iter().enumerate();
        let clamping = pins.filter(|(_, pin)| pin.clamp && pin.cloth == cloth.name);
        clamps.extend(clamping.map(|(pin, _)| format!("pin.{pin}.clamp=false")));
    }
    let with_clamps = if clamps.is_empty() {
        ""
    } else {
        ", with the clamps"
    };
    changes.extend(clamps);
    Part {
        name: format!("bending by hinges{with_clamps}"),
        changes,
    }
}

fn damping(scene: &Scene, name: &str, which: &str) -> Part {
    let damped = scene.cloth.iter().enumerate().filter(|(_, cloth)| {
        let value = match which {
            "mass" => cloth.damping.mass,
            _ => cloth.damping.stiffness,
        };
        value > 0.0
    });
    Part {
        name: name.to_owned(),
        changes: damped
            .map(|(i, cloth)| format!("cloth.{}.damping.{which}=0", key(i, &cloth.name)))
            .collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{BUILTIN, build, load};

    /// Every change is taken, and leaves a scene without the part that can be run.
    #[test]
    fn what_is_taken_out_is_gone() {
        for (scene, _) in BUILTIN {
            let loaded = load(scene, &[]).unwrap();
            let built = build(&loaded).unwrap();
            let all = parts(&loaded.scene, &built.model);
            for part in &all {
                let without = loaded.with(&part.changes).unwrap();
                let less = build(&without).unwrap();
                assert_eq!(
                    less.model.cloth_particles(),
                    built.model.cloth_particles(),
                    "{scene}: {}",
                    part.name
                );
                let left = parts(&without.scene, &less.model);
                assert!(
                    left.iter().all(|other| other.name != part.name),
                    "{scene}: {} is still there",
                    part.name
                );
            }
        }
    }

    #[test]
    fn of_the_drape() {
        let loaded = load("drape", &[]).unwrap();
        let built = build(&loaded).unwrap();
        let all = parts(&loaded.scene, &built.model);
        let list: Vec<String> = all
            .iter()
            .map(|part| format!("{}: {}", part.name, part.changes.join(" ")))
            .collect();
        assert_eq!(
            list,
            [
                r#"shear springs: cloth.poncho.springs=["structural", "bend"]"#,
                r#"bend springs: cloth.poncho.springs=["structural", "shear"]"#,
                "drag on all motion: cloth.poncho.damping.mass=0",
                "damping of deformation: cloth.poncho.damping.stiffness=0",
                "strain limit: strain_limit=",
                "friction on mannequin: obstacle.mannequin.friction=0",
                "contact with mannequin: obstacle.mannequin=",
            ]
        );
    }

    #[test]
    fn a_name_that_could_be_read_otherwise_gives_way_to_the_number() {
        assert_eq!(key(2, "wall-1"), "wall-1");
        assert_eq!(key(2, "7"), "2");
        assert_eq!(key(2, "left.wall"), "2");
        assert_eq!(key(2, "it's = one"), "2");
    }
}
