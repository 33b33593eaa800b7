//! Where everything is recorded: the entity paths in one place.
//!
//! Names from the scene become one path part each, escaped by Rerun where needed.

use rerun::{EntityPath, EntityPathPart};

use crate::frame::ClothHeader;

/// Rerun's name for this program.
pub(crate) const APPLICATION: &str = "muslin";
/// Timeline of the simulated time (s).
pub(crate) const SIM_TIME: &str = "sim_time";
/// Timeline of the frame number.
pub(crate) const FRAME: &str = "frame";

/// Everything with a place in space.
pub(crate) const WORLD: &str = "world";
/// Particles in contact, below [`WORLD`].
pub(crate) const CONTACTS: &str = "contacts";
/// Where cloth is inside an obstacle or crosses something, below [`WORLD`].
pub(crate) const PENETRATIONS: &str = "penetrations";
/// The springs' strains in classes.
pub(crate) const HISTOGRAM: &str = "strain/histogram";
/// What there is to say during a run.
pub(crate) const LOG: &str = "log";
/// What is modelled, and the scene's TOML.
pub(crate) const SCENE: &str = "scene";
/// The `f64` states.
pub(crate) const CHECKPOINT: &str = "checkpoint";

/// What a branch started with.
pub(crate) const START: &str = "start";
/// The hash of the state in each frame.
pub(crate) const STATE_HASH: [&str; 2] = ["solver", "state_hash"];
/// Path and text of each OBJ mesh that the scene names, below [`SCENE`].
pub(crate) const MESHES: &str = "meshes";

/// The path whose parts are `parts`, whatever characters they hold.
pub(crate) fn path(parts: &[&str]) -> EntityPath {
    let parts = parts.iter().map(|&part| EntityPathPart::new(part));
    EntityPath::new(parts.collect())
}

/// `/world/<name>`: a cloth or an obstacle.
pub(crate) fn body(name: &str) -> EntityPath {
    path(&[WORLD, name])
}

/// `/checkpoint/<cloth>`: positions and velocities.
pub(crate) fn cloth_checkpoint(cloth: &str) -> EntityPath {
    path(&[CHECKPOINT, cloth])
}

/// `/start/<cloth>`: positions and velocities.
pub(crate) fn cloth_start(cloth: &str) -> EntityPath {
    path(&[START, cloth])
}

/// The path of a series such as `energy/kinetic`.
pub(crate) fn series(name: &str) -> EntityPath {
    path(&name.split('/').collect::<Vec<_>>())
}

/// The paths of one cloth.
#[derive(Clone, Debug)]
pub(crate) struct ClothPaths {
    /// Its mesh.
    pub(crate) mesh: EntityPath,
    /// Its springs by family.
    pub(crate) springs: Vec<EntityPath>,
    /// Its pins.
    pub(crate) pins: EntityPath,
}

impl ClothPaths {
    /// The paths of `cloth`.
    pub(crate) fn new(cloth: &ClothHeader) -> Self {
        let name = cloth.name.as_str();
        let families = cloth.springs.iter();
        Self {
            mesh: body(name),
            springs: families
                .map(|family| path(&[WORLD, name, "springs", family.name]))
                .collect(),
            pins: path(&[WORLD, name, "pins"]),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn odd_names_stay_one_part() {
        let path = body("my skirt/2.1");
        assert_eq!(path.len(), 2, "{path}");
        let last = path.last().map(|part| part.unescaped_str().to_owned());
        assert_eq!(last.as_deref(), Some("my skirt/2.1"));
    }

    #[test]
    fn series_paths_have_their_parts() {
        assert_eq!(series("energy/kinetic").to_string(), "/energy/kinetic");
    }
}
