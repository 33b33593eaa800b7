//! Springs in six bytes each.
//!
//! Beyond the caches an explicit step takes as long as its memory traffic. A spring has 24 bytes, and a
//! particle of a sheet four springs. Springs of a regular sheet differ in their places alone: a few
//! hundred pairs of rest length and stiffness stand for all of them, bit for bit.

use super::pass::Tiled;
use super::spring::{Largest, Spring, add_forces, force};
use super::{Cut, Window};
use crate::linear::Ahead;
use crate::state::State;
use glam::DVec3;
use std::collections::BTreeMap;
use std::ops::Range;

/// A spring, by its places from the tile's first on and its kind.
#[derive(Clone, Copy, Debug)]
struct Packed {
    ends: [u16; 2],
    kind: u16,
}

/// Rest length (m) and stiffness (N/m).
type Kind = [f64; 2];

/// Kinds at most: 64 KiB, which leave room in the second-level cache.
const KINDS: usize = 4096;

/// Springs by tile, packed.
#[derive(Debug)]
pub(super) struct PackedSprings {
    tiled: Tiled<Packed>,
    /// The particle from which each tile's places count.
    first: Vec<u32>,
    kinds: Vec<Kind>,
}

impl PackedSprings {
    /// Packs springs, where they are of few kinds and their ends near to each other.
    fn of(springs: &Tiled<Spring>) -> Option<Self> {
        let (mut kinds, mut numbers) = (Vec::new(), BTreeMap::new());
        let mut packed = Vec::with_capacity(springs.elements.len());
        let mut first = Vec::with_capacity(springs.tiles());
        for tile in 0..springs.tiles() {
            let springs = springs.of(tile);
            let least = springs.iter().flat_map(|spring| spring.ends).min();
            let least = least.unwrap_or_default();
            first.push(least);
            for &Spring {
                ends,
                rest_length,
                stiffness,
            } in springs
            {
                let kind = [rest_length, stiffness];
                let next = u16::try_from(kinds.len()).ok()?;
                let kind = *numbers.entry(kind.map(f64::to_bits)).or_insert_with(|| {
                    kinds.push(kind);
                    next
                });
                if kinds.len() > KINDS {
                    return None;
                }
                let place = |end: u32| u16::try_from(end - least).ok();
                packed.push(Packed {
                    ends: [place(ends[0])?, place(ends[1])?],
                    kind,
                });
            }
        }
        Some(Self {
            tiled: springs.with(packed),
            first,
            kinds,
        })
    }
}

impl PackedSprings {
    /// Span (m) of a spring of a tile whose first particle has the first of some positions.
    #[inline(always)]
    fn span(spring: Packed, positions: &[DVec3]) -> DVec3 {
        let [a, b] = spring.ends.map(usize::from);
        positions[b] - positions[a]
    }

    /// λ² of a spring of such a tile.
    #[inline(always)]
    fn stretch_squared(&self, spring: Packed, positions: &[DVec3]) -> f64 {
        let [rest_length, _] = self.kinds[usize::from(spring.kind)];
        Self::span(spring, positions).length_squared() / (rest_length * rest_length)
    }
}

/// The springs of one family by tile.
#[derive(Debug)]
pub(super) enum SpringLists {
    /// Springs of few kinds.
    Packed(PackedSprings),
    /// Any springs.
    Whole(Tiled<Spring>),
}

impl SpringLists {
    pub(super) fn of(springs: Tiled<Spring>) -> Self {
        match PackedSprings::of(&springs) {
            Some(packed) => Self::Packed(packed),
            None => Self::Whole(springs),
        }
    }

    /// Looks for the largest λ² of a tile's springs; asks for a share of what comes next with every batch.
    pub(super) fn look_at(
        &self,
        tile: usize,
        positions: &[DVec3],
        largest: &mut Largest,
        ahead: &mut Ahead,
    ) {
        match self {
            Self::Packed(packed) => {
                let positions = &positions[packed.first[tile] as usize..];
                for batch in packed.tiled.batches(tile) {
                    ahead.ask();
                    largest.look_at(batch, |&spring| packed.stretch_squared(spring, positions));
                }
            }
            Self::Whole(tiled) => {
                for batch in tiled.batches(tile) {
                    ahead.ask();
                    largest.look_at(batch, |spring| spring.stretch_squared(positions));
                }
            }
        }
    }

    /// Size of the lists (B).
    pub(super) fn bytes(&self) -> usize {
        match self {
            Self::Packed(packed) => size_of_val(&packed.tiled.elements[..]),
            Self::Whole(tiled) => size_of_val(&tiled.elements[..]),
        }
    }
}

impl Cut for SpringLists {
    /// One spring after the other: four or eight at once take as long, 3.0 to 3.3 ns each.
    fn add_forces(&self, tile: usize, state: &State, window: &mut Window<'_>) {
        match self {
            Self::Packed(packed) => {
                let first = packed.first[tile];
                let positions = &state.positions[first as usize..];
                for batch in packed.tiled.batches(tile) {
                    window.ahead.ask();
                    for &spring in batch {
                        let [rest_length, stiffness] = packed.kinds[usize::from(spring.kind)];
                        let d = PackedSprings::span(spring, positions);
                        let f = force(d, stiffness, rest_length);
                        let [a, b] = spring.ends.map(|end| first + u32::from(end));
                        window.add(a, f);
                        window.add(b, -f);
                    }
                }
            }
            Self::Whole(tiled) => {
                for batch in tiled.batches(tile) {
                    window.ahead.ask();
                    add_forces(batch, state, window);
                }
            }
        }
    }

    fn add_to(&self, ahead: &mut Ahead, tile: usize, _: Range<usize>) {
        match self {
            Self::Packed(packed) => packed.tiled.add_to(ahead, tile),
            Self::Whole(tiled) => tiled.add_to(ahead, tile),
        }
    }

    fn batches(&self, tile: usize) -> usize {
        match self {
            Self::Packed(packed) => packed.tiled.batches(tile).len(),
            Self::Whole(tiled) => tiled.batches(tile).len(),
        }
    }

    fn lowest(&self, tile: usize) -> usize {
        match self {
            Self::Packed(packed) => packed.tiled.lowest(tile),
            Self::Whole(tiled) => tiled.lowest(tile),
        }
    }
}
