//! The settings of the dial, and the obstacles that take them.

use crate::scene::Scene;
use crate::study::ablate::key;
use crate::study::digits;

/// Cells of the grids (m).
pub const CELLS: [f64; 3] = [0.01, 0.005, 0.0025];

/// How contact with obstacles is computed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dial {
    /// Cell of the distance grids (m); exact distances without one.
    pub cell: Option<f64>,
    /// Whether whole triangles and edges are kept out along their ways.
    pub ccd: bool,
}

impl Dial {
    /// What the others are compared with.
    pub const EXACT: Self = Self {
        cell: None,
        ccd: true,
    };

    /// Every setting, exact first; without grids where no obstacle takes one.
    pub fn all(with_grids: bool) -> Vec<Self> {
        let grids = if with_grids { &CELLS[..] } else { &[] };
        let cells = std::iter::once(None).chain(grids.iter().copied().map(Some));
        cells
            .flat_map(|cell| [true, false].map(|ccd| Self { cell, ccd }))
            .collect()
    }

    /// How distances are found.
    pub fn distances(self) -> String {
        self.cell.map_or_else(
            || "exact".to_owned(),
            |cell| format!("grid of {} mm", digits(1000.0 * cell)),
        )
    }

    /// Whether continuous detection is on.
    pub fn continuous(self) -> &'static str {
        if self.ccd { "on" } else { "off" }
    }

    /// What sets the obstacles of a scene to it, as `--set` reads it.
    pub fn changes(self, scene: &Scene) -> Vec<String> {
        let mut changes = Vec::new();
        for (i, obstacle) in scene.obstacle.iter().enumerate() {
            let at = format!("obstacle.{}", key(i, &obstacle.name));
            let on_grid = self.cell.filter(|_| obstacle.takes_grid());
            let distance = on_grid.map_or_else(
                || "\"exact\"".to_owned(),
                |cell| format!("{{ grid = {cell:?} }}"),
            );
            changes.push(format!("{at}.distance={distance}"));
            changes.push(format!("{at}.ccd={}", self.ccd));
        }
        changes
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{BUILTIN, build, load};

    /// Every setting is taken by every obstacle of every scene, but for grids where none can be.
    #[test]
    fn what_is_turned_is_built() {
        for (scene, _) in BUILTIN {
            let loaded = load(scene, &[]).unwrap();
            for ccd in [true, false] {
                let dial = Dial {
                    cell: Some(0.02),
                    ccd,
                };
                let turned = loaded.with(&dial.changes(&loaded.scene)).unwrap();
                let again = turned.with(&Dial::EXACT.changes(&turned.scene)).unwrap();
                let obstacles = build(&turned).unwrap().model.obstacles;
                for (obstacle, asked) in obstacles.iter().zip(&loaded.scene.obstacle) {
                    assert_eq!(obstacle.continuous, ccd, "{scene}");
                    let on_grid = obstacle.shape.grid_error().is_some();
                    assert_eq!(on_grid, asked.takes_grid(), "{scene}: {}", asked.name);
                }
                for obstacle in build(&again).unwrap().model.obstacles {
                    assert!(obstacle.continuous && obstacle.shape.grid_error().is_none());
                }
            }
        }
    }

    #[test]
    fn exact_distances_come_first() {
        assert_eq!(Dial::all(true).len(), 8);
        assert_eq!(Dial::all(true)[0], Dial::EXACT);
        assert_eq!(Dial::all(false).len(), 2);
    }
}
