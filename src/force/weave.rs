//! The springs that stand for the weave, to be looked at tile by tile.

use super::SpringBatch;
use super::packed::SpringLists;
use super::pass::{Tiled, Tiles};
use glam::DVec3;

/// The springs whose strain counts, each once.
#[derive(Debug)]
pub struct Weave {
    families: Vec<(&'static str, SpringLists)>,
}

impl Weave {
    /// Sorts the springs of some families into tiles.
    pub fn of<'a>(tiles: Tiles, families: impl Iterator<Item = &'a SpringBatch>) -> Self {
        let lists = |batch: &SpringBatch| {
            let tiled = Tiled::once(tiles, &batch.springs, |spring| spring.ends);
            (batch.family, SpringLists::of(tiled))
        };
        Self {
            families: families.map(lists).collect(),
        }
    }

    /// Largest λ² = (ℓ/ℓ₀)² of a tile's springs, as [`super::largest_stretch_squared`] has it.
    pub fn largest_stretch_squared(&self, tile: usize, positions: &[DVec3]) -> f64 {
        let each = self.families.iter();
        each.map(|(_, lists)| lists.largest_stretch_squared(tile, positions))
            .fold(f64::NEG_INFINITY, f64::max)
    }

    /// Asks for a tile's springs ahead of their use.
    pub fn prefetch(&self, tile: usize) {
        for (_, lists) in &self.families {
            lists.prefetch(tile);
        }
    }

    /// Size of each family's lists (B).
    pub fn bytes(&self) -> impl Iterator<Item = (&'static str, usize)> + '_ {
        let each = self.families.iter();
        each.map(|(family, lists)| (*family, lists.bytes()))
    }
}
