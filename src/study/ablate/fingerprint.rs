//! What tells whether a table is of a scene as it is now.

use crate::model::Model;
use crate::scene::{Record, Scene};
use crate::state::State;
use glam::DVec3;

/// A hash of a scene and of the meshes that it names, by this version of the program. What is recorded
/// of a run doesn't count, nor how the scene's file is laid out.
pub fn fingerprint(scene: &Scene, model: &Model, state: &State) -> u64 {
    let scene = Scene {
        record: Record::default(),
        ..scene.clone()
    };
    let mut hash = Fnv(0xcbf2_9ce4_8422_2325);
    hash.add(env!("CARGO_PKG_VERSION").as_bytes());
    hash.add(format!("{scene:?}").as_bytes());
    hash.add_points(&model.rest);
    hash.add_points(&state.positions);
    for obstacle in &model.obstacles {
        hash.add_points(&obstacle.shape.drawing().positions);
    }
    hash.0
}

/// FNV-1a with 64 bits.
///
/// Source: Fowler, Noll and Vo 1991.
struct Fnv(u64);

impl Fnv {
    fn add(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        }
    }

    fn add_points(&mut self, points: &[DVec3]) {
        for number in points.iter().flat_map(DVec3::to_array) {
            self.add(&number.to_bits().to_le_bytes());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{build, load};

    #[test]
    fn of_known_bytes() {
        // From the authors' own table of test vectors.
        let mut hash = Fnv(0xcbf2_9ce4_8422_2325);
        hash.add(b"foobar");
        assert_eq!(hash.0, 0x8594_4171_f739_67e8);
    }

    #[test]
    fn what_changes_the_motion_changes_it() {
        let of = |changes: &[&str]| {
            let changes: Vec<String> = changes.iter().map(|&change| change.to_owned()).collect();
            let loaded = load("drape", &changes).unwrap();
            let built = build(&loaded).unwrap();
            fingerprint(&loaded.scene, &built.model, &built.state)
        };
        let plain = of(&[]);
        assert_eq!(plain, of(&["record.fps=30"]));
        assert_eq!(plain, of(&["duration=4"]));
        for change in [
            "duration=5",
            "obstacle.0.friction=0.5",
            "obstacle.0.shape.obj.scale=1.01",
            "solver.dt=0.002",
            "cloth.0.shape.sheet.cells=[61, 60]",
        ] {
            assert_ne!(plain, of(&[change]), "{change}");
        }
    }
}
