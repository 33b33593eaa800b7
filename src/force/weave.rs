//! The springs that stand for the weave, to be looked at tile by tile.

use super::packed::SpringLists;
use super::pass::{Tiled, Tiles};
use super::spring::Largest;
use super::{Cut as _, SpringBatch};
use crate::linear::Ahead;
use glam::DVec3;
use std::ops::Range;

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
    /// Asks for a share of what comes next with every batch.
    pub fn largest_stretch_squared(
        &self,
        tile: usize,
        positions: &[DVec3],
        ahead: &mut Ahead,
    ) -> f64 {
        let mut largest = Largest::default();
        for (_, lists) in &self.families {
            lists.look_at(tile, positions, &mut largest, ahead);
        }
        largest.of_all()
    }

    /// Adds a tile's springs to what is asked for ahead of its use.
    pub fn add_to(&self, ahead: &mut Ahead, tile: usize, particles: &Range<usize>) {
        for (_, lists) in &self.families {
            lists.add_to(ahead, tile, particles.clone());
        }
    }

    /// Number of a tile's batches.
    pub fn batches(&self, tile: usize) -> usize {
        let each = self.families.iter();
        each.map(|(_, lists)| lists.batches(tile)).sum()
    }

    /// Size of each family's lists (B).
    pub fn bytes(&self) -> impl Iterator<Item = (&'static str, usize)> + '_ {
        let each = self.families.iter();
        each.map(|(family, lists)| (*family, lists.bytes()))
    }
}
