//! One pass over all elements on all threads.
//!
//! The particles are cut into fixed chunks. Each chunk has a list of the elements that touch its
//! particles, and whoever works on it adds their forces to these particles only: an element that
//! crosses the border of two chunks is worked out in both, and each takes its own side. So no two
//! threads write to one place, and every particle's forces are added up in one order, whatever the
//! number of threads.
//!
//! A chunk is gone through tile by tile, all laws on one before the next, and particles that no later
//! tile touches are handed on at once: what is beyond the caches is read once and written once.

use super::{Damping, Force};
use crate::linear::{Ahead, BATCH, Chunks, Shared};
use crate::state::State;
use glam::DVec3;
use std::fmt::Debug;
use std::ops::Range;

/// A law, or a damping, cut by tiles of the particles.
pub trait Cut: Debug + Send + Sync {
    /// Adds the forces (N) of a tile's elements on the particles that the window shows.
    fn add_forces(&self, tile: usize, state: &State, window: &mut Window<'_>);

    /// Adds a tile's elements, or what it has of the tile's particles, to what is asked for ahead of its use.
    fn add_to(&self, _ahead: &mut Ahead, _tile: usize, _particles: Range<usize>) {}

    /// How many batches a tile's elements have: with each, it asks for a share of what comes next.
    fn batches(&self, _tile: usize) -> usize {
        0
    }

    /// The lowest of a chunk's particles that elements of one of its tiles act on, where that may be
    /// below the tile's own.
    fn lowest(&self, _tile: usize) -> usize {
        usize::MAX
    }
}

/// Particles in a tile: what belongs to them stays in the first-level cache from law to law. Twice as
/// many or half as many are as good.
const TILE: usize = 128;

/// Chunks of the particles, cut into tiles.
#[derive(Clone, Copy, Debug)]
pub struct Tiles {
    chunks: Chunks,
    /// Tiles of a chunk.
    each: usize,
}

impl Tiles {
    /// The tiles of some particles.
    pub fn of(particles: usize) -> Self {
        let chunks = Chunks::of(particles);
        let each = chunks.size().div_ceil(TILE);
        Self { chunks, each }
    }

    /// Number of tiles.
    pub(super) fn count(self) -> usize {
        self.chunks.count() * self.each
    }

    /// The chunks.
    pub fn chunks(self) -> Chunks {
        self.chunks
    }

    /// The tiles of a chunk.
    pub fn of_chunk(self, chunk: usize) -> Range<usize> {
        chunk * self.each..(chunk + 1) * self.each
    }

    /// The particles of a tile.
    pub fn range(self, tile: usize) -> Range<usize> {
        let chunk = self.chunks.range(tile / self.each);
        let start = chunk.start + tile % self.each * TILE;
        start.min(chunk.end)..(start + TILE).min(chunk.end)
    }

    /// The tile that a particle is in.
    fn at(self, particle: usize) -> usize {
        let chunk = self.chunks.at(particle);
        chunk * self.each + (particle - self.chunks.range(chunk).start) / TILE
    }
}

/// The forces on neighbouring particles.
#[derive(Debug)]
pub struct Window<'a> {
    /// Number of the first particle.
    first: usize,
    /// Force on each (N).
    forces: &'a mut [DVec3],
    /// The particles of the tile that is worked on.
    tile: Range<usize>,
    /// What the next tile needs.
    pub(super) ahead: Ahead,
}

impl<'a> Window<'a> {
    /// The forces on all particles.
    pub(super) fn whole(forces: &'a mut [DVec3]) -> Self {
        Self {
            first: 0,
            tile: 0..forces.len(),
            ahead: Ahead::default(),
            forces,
        }
    }

    /// The numbers of the tile's particles, and the forces on them.
    pub(super) fn tile(&mut self) -> (Range<usize>, &mut [DVec3]) {
        let Range { start, end } = self.tile;
        (
            start..end,
            &mut self.forces[start - self.first..end - self.first],
        )
    }

    /// Prepares to ask for what the next tile's particles need, in a number of shares.
    fn expect(&mut self, state: &State, particles: Range<usize>, shares: usize) {
        let Range { start, end } = particles;
        self.ahead.begin(shares);
        self.ahead.add(&state.positions, start..end);
        self.ahead.add(&state.velocities, start..end);
        let ours = start - self.first..end - self.first;
        self.ahead.add(self.forces, ours);
    }

    /// Adds a force on a particle, if the window shows it.
    #[inline(always)]
    pub(super) fn add(&mut self, particle: u32, force: DVec3) {
        if let Some(sum) = self
            .forces
            .get_mut((particle as usize).wrapping_sub(self.first))
        {
            *sum += force;
        }
    }
}

/// The lowest and the highest of an element's particles.
struct Placed {
    low: usize,
    high: usize,
}

impl Placed {
    fn of<'a>(particles: impl Iterator<Item = &'a u32>) -> Self {
        let (low, high) = particles.fold((usize::MAX, 0), |(low, high), &i| {
            (low.min(i as usize), high.max(i as usize))
        });
        Self { low, high }
    }
}

/// Elements in the order in which a pass goes through them.
pub(super) struct Tiled<E> {
    pub(super) elements: Vec<E>,
    /// Where each tile's elements end.
    ends: Vec<usize>,
    /// The lowest of the chunk's particles that each tile's elements touch.
    lowest: Vec<usize>,
}

impl<E: Copy> Tiled<E> {
    /// Sorts elements by the tiles that they belong to, in every chunk that they touch the one of their
    /// highest particle there. In a tile come first those that touch no other chunk, each in the order
    /// of their lowest particles, so that what is next in the list is near in memory.
    pub(super) fn new<const N: usize>(
        tiles: Tiles,
        elements: &[E],
        particles: impl Fn(&E) -> [u32; N],
    ) -> Self {
        let chunks = tiles.chunks;
        let mut found = Vec::with_capacity(elements.len());
        for element in elements {
            let corners = particles(element);
            let touched = corners.map(|i| chunks.at(i as usize));
            let crosses = touched.iter().any(|chunk| *chunk != touched[0]);
            for (corner, &chunk) in touched.iter().enumerate() {
                if !touched[..corner].contains(&chunk) {
                    let there = |&&i: &&u32| chunks.at(i as usize) == chunk;
                    found.push((crosses, Placed::of(corners.iter().filter(there)), *element));
                }
            }
        }
        found.sort_by_key(|(crosses, at, _)| (tiles.at(at.high), *crosses, at.low));
        let sorted = found.into_iter().map(|(_, at, element)| (at, element));
        Self::sorted(tiles, sorted)
    }

    /// Sorts elements into the tiles of their highest particles, each once.
    pub(super) fn once<const N: usize>(
        tiles: Tiles,
        elements: &[E],
        particles: impl Fn(&E) -> [u32; N],
    ) -> Self {
        let placed = |element: &E| (Placed::of(particles(element).iter()), *element);
        let mut found: Vec<_> = elements.iter().map(placed).collect();
        found.sort_by_key(|(at, _)| (tiles.at(at.high), at.low));
        Self::sorted(tiles, found.into_iter())
    }

    fn sorted(tiles: Tiles, found: impl Iterator<Item = (Placed, E)>) -> Self {
        let mut ends = vec![0; tiles.count()];
        let mut lowest = vec![usize::MAX; tiles.count()];
        let mut elements = Vec::new();
        for (at, element) in found {
            let tile = tiles.at(at.high);
            lowest[tile] = lowest[tile].min(at.low);
            elements.push(element);
            ends[tile] = elements.len();
        }
        for tile in 1..ends.len() {
            ends[tile] = ends[tile].max(ends[tile - 1]);
        }
        elements.shrink_to_fit();
        Self {
            elements,
            ends,
            lowest,
        }
    }

    /// The same order of others, one for each element.
    pub(super) fn with<F>(&self, elements: Vec<F>) -> Tiled<F> {
        Tiled {
            elements,
            ends: self.ends.clone(),
            lowest: self.lowest.clone(),
        }
    }
}

impl<E> Tiled<E> {
    /// The elements of a tile.
    pub(super) fn of(&self, tile: usize) -> &[E] {
        let start = tile.checked_sub(1).map_or(0, |before| self.ends[before]);
        &self.elements[start..self.ends[tile]]
    }

    /// The elements of a tile in batches.
    pub(super) fn batches(&self, tile: usize) -> std::slice::Chunks<'_, E> {
        self.of(tile).chunks(BATCH)
    }

    /// Adds a tile's elements, where there is such a tile, to what is asked for ahead of its use.
    pub(super) fn add_to(&self, ahead: &mut Ahead, tile: usize) {
        if tile < self.ends.len() {
            let elements = self.of(tile);
            ahead.add(elements, 0..elements.len());
        }
    }

    pub(super) fn tiles(&self) -> usize {
        self.ends.len()
    }

    pub(super) fn lowest(&self, tile: usize) -> usize {
        self.lowest[tile]
    }
}

impl<E> Debug for Tiled<E> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_list().entries(&self.ends).finish()
    }
}

/// The elements of one law by tile, and how their forces are added.
#[derive(Debug)]
pub(super) struct Lists<E> {
    pub(super) tiled: Tiled<E>,
    pub(super) add: fn(&[E], &State, &mut Window<'_>),
}

impl<E: Debug + Send + Sync> Cut for Lists<E> {
    fn add_forces(&self, tile: usize, state: &State, window: &mut Window<'_>) {
        for batch in self.tiled.batches(tile) {
            window.ahead.ask();
            (self.add)(batch, state, window);
        }
    }

    fn add_to(&self, ahead: &mut Ahead, tile: usize, _: Range<usize>) {
        self.tiled.add_to(ahead, tile);
    }

    fn batches(&self, tile: usize) -> usize {
        self.tiled.batches(tile).len()
    }

    fn lowest(&self, tile: usize) -> usize {
        self.tiled.lowest(tile)
    }
}

/// All laws and dampings of a model, cut by tiles of its particles. When elements come or go, a new
/// one has to be made.
#[derive(Debug)]
pub struct ForcePass {
    tiles: Tiles,
    laws: Vec<Box<dyn Cut>>,
    dampings: Vec<Box<dyn Cut>>,
    /// For each tile, the first particle that it or later ones of its chunk have elements on once it is
    /// done.
    settled: Vec<usize>,
}

impl ForcePass {
    /// Cuts laws and dampings of a number of particles.
    pub fn new<'a>(
        particles: usize,
        forces: impl Iterator<Item = &'a dyn Force>,
        dampings: impl Iterator<Item = &'a dyn Damping>,
    ) -> Self {
        let tiles = Tiles::of(particles);
        let laws: Vec<_> = forces.map(|law| law.cut(tiles)).collect();
        let dampings: Vec<_> = dampings.map(|damping| damping.cut(tiles)).collect();
        let mut settled = vec![0; tiles.count()];
        for chunk in 0..tiles.chunks.count() {
            let mut least = usize::MAX;
            for tile in tiles.of_chunk(chunk).rev() {
                settled[tile] = least.min(tiles.range(tile).end);
                let lowest = laws.iter().chain(&dampings).map(|law| law.lowest(tile));
                least = lowest.fold(least, usize::min);
            }
        }
        Self {
            tiles,
            laws,
            dampings,
            settled,
        }
    }

    /// Whether there is any damping.
    pub fn is_damped(&self) -> bool {
        !self.dampings.is_empty()
    }

    /// Sets the forces of all laws and dampings (N). Particles are handed to `finish` as soon as theirs
    /// are known, with the number of the first, and with them the same particles' share of other lists.
    pub fn set_all<S: Shared>(
        &self,
        state: &State,
        forces: &mut [DVec3],
        own: S,
        finish: impl Fn(usize, &mut [DVec3], S) + Sync,
    ) {
        self.set(&[&self.laws, &self.dampings], state, forces, own, finish);
    }

    /// Sets the forces of all laws without damping (N).
    pub fn set_laws<S: Shared>(
        &self,
        state: &State,
        forces: &mut [DVec3],
        own: S,
        finish: impl Fn(usize, &mut [DVec3], S) + Sync,
    ) {
        self.set(&[&self.laws], state, forces, own, finish);
    }

    /// Sets the forces of all dampings (N).
    pub fn set_dampings<S: Shared>(
        &self,
        state: &State,
        forces: &mut [DVec3],
        own: S,
        finish: impl Fn(usize, &mut [DVec3], S) + Sync,
    ) {
        self.set(&[&self.dampings], state, forces, own, finish);
    }

    fn set<S: Shared>(
        &self,
        lists: &[&[Box<dyn Cut>]],
        state: &State,
        forces: &mut [DVec3],
        own: S,
        finish: impl Fn(usize, &mut [DVec3], S) + Sync,
    ) {
        let laws = || lists.iter().copied().flatten();
        let chunks = self.tiles.chunks;
        chunks.for_each_of((forces, own), |chunk, (forces, mut own)| {
            let first = chunks.range(chunk).start;
            let mut window = Window {
                first,
                forces,
                tile: first..first,
                ahead: Ahead::default(),
            };
            let mut done = first;
            for tile in self.tiles.of_chunk(chunk) {
                window.tile = self.tiles.range(tile);
                window.tile().1.fill(DVec3::ZERO);
                let settled = self.settled[tile].max(done);
                let next = tile + 1;
                let soon = self.tiles.range(next);
                let shares = laws().map(|law| law.batches(tile)).sum();
                window.expect(state, soon.clone(), shares);
                laws().for_each(|law| law.add_to(&mut window.ahead, next, soon.clone()));
                let later = self.settled.get(next);
                let later = later.map_or(settled, |&later| later.max(settled));
                own.add_to(&mut window.ahead, settled - done..later - done);
                for law in laws() {
                    law.add_forces(tile, state, &mut window);
                }
                let (now, later) = own.split_at(settled - done);
                finish(done, &mut window.forces[done - first..settled - first], now);
                (done, own) = (settled, later);
            }
        });
    }
}
