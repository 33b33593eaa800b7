//! One pass over all elements on all threads.
//!
//! The particles are cut into fixed chunks. Each chunk has a list of the elements that touch its
//! particles, and whoever works on it adds their forces to these particles only: an element that
//! crosses the border of two chunks is worked out in both, and each takes its own side. So no two
//! threads write to one place, and every particle's forces are added up in one order, whatever the
//! number of threads.

use super::{Damping, Force};
use crate::linear::Chunks;
use crate::state::State;
use glam::DVec3;
use std::fmt::Debug;
use std::ops::Range;

/// A law, or a damping, cut by chunks of the particles.
pub trait Cut: Debug + Send + Sync {
    /// Adds the forces (N) on the particles of a chunk, which the window shows.
    fn add_forces(&self, chunk: usize, state: &State, window: &mut Window<'_>);
}

/// The forces on neighbouring particles.
#[derive(Debug)]
pub struct Window<'a> {
    /// Number of the first particle.
    first: usize,
    /// Force on each (N).
    pub(super) forces: &'a mut [DVec3],
}

impl<'a> Window<'a> {
    /// The forces on all particles.
    pub(super) fn whole(forces: &'a mut [DVec3]) -> Self {
        Self { first: 0, forces }
    }

    /// The numbers of its particles.
    pub(super) fn range(&self) -> Range<usize> {
        self.first..self.first + self.forces.len()
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

/// The elements of one law by chunk, and how their forces are added.
pub(super) struct Lists<E> {
    chunks: Vec<Vec<E>>,
    add: fn(&[E], &State, &mut Window<'_>),
}

impl<E: Copy> Lists<E> {
    /// Sorts elements into the lists of the chunks that they touch: those that touch no other chunk
    /// first, each in the order of their lowest particles, so that what is next in the list is near
    /// in memory.
    pub(super) fn new<const N: usize>(
        chunks: Chunks,
        elements: &[E],
        particles: impl Fn(&E) -> [u32; N],
        add: fn(&[E], &State, &mut Window<'_>),
    ) -> Self {
        let touched = |element: &E| particles(element).map(|i| chunks.at(i as usize));
        let mut lists = vec![Vec::new(); chunks.count()];
        for element in elements {
            let touched = touched(element);
            for (corner, &chunk) in touched.iter().enumerate() {
                if !touched[..corner].contains(&chunk) {
                    lists[chunk].push(*element);
                }
            }
        }
        for list in &mut lists {
            list.sort_by_key(|element| {
                let touched = touched(element);
                let crosses = touched.iter().any(|chunk| *chunk != touched[0]);
                (crosses, particles(element).into_iter().min())
            });
            list.shrink_to_fit();
        }
        Self { chunks: lists, add }
    }
}

impl<E> Debug for Lists<E> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let lengths = self.chunks.iter().map(Vec::len);
        f.debug_list().entries(lengths).finish()
    }
}

impl<E: Send + Sync> Cut for Lists<E> {
    fn add_forces(&self, chunk: usize, state: &State, window: &mut Window<'_>) {
        (self.add)(&self.chunks[chunk], state, window);
    }
}

/// All laws and dampings of a model, cut by chunks of its particles. When elements come or go, a new
/// one has to be made.
#[derive(Debug)]
pub struct ForcePass {
    chunks: Chunks,
    laws: Vec<Box<dyn Cut>>,
    dampings: Vec<Box<dyn Cut>>,
}

impl ForcePass {
    /// Cuts laws and dampings of a number of particles.
    pub fn new<'a>(
        particles: usize,
        forces: impl Iterator<Item = &'a dyn Force>,
        dampings: impl Iterator<Item = &'a dyn Damping>,
    ) -> Self {
        let chunks = Chunks::of(particles);
        Self {
            chunks,
            laws: forces.map(|law| law.cut(chunks)).collect(),
            dampings: dampings.map(|damping| damping.cut(chunks)).collect(),
        }
    }

    /// Sets the forces of all laws and dampings (N). Each chunk is handed to `finish` when it is
    /// done, with the number of its first particle, and with it the same particles' share of another
    /// list.
    pub fn set_all<T: Send>(
        &self,
        state: &State,
        forces: &mut [DVec3],
        own: &mut [T],
        finish: impl Fn(usize, &mut [DVec3], &mut [T]) + Sync,
    ) {
        self.set(&[&self.laws, &self.dampings], state, forces, own, finish);
    }

    /// Sets the forces of all laws without damping (N).
    pub fn set_laws(&self, state: &State, forces: &mut [DVec3]) {
        let nothing = &mut vec![(); forces.len()]; // takes no memory
        self.set(&[&self.laws], state, forces, nothing, |_, _, _| {});
    }

    /// Sets the forces of all dampings (N).
    pub fn set_dampings(&self, state: &State, forces: &mut [DVec3]) {
        let nothing = &mut vec![(); forces.len()];
        self.set(&[&self.dampings], state, forces, nothing, |_, _, _| {});
    }

    fn set<T: Send>(
        &self,
        lists: &[&[Box<dyn Cut>]],
        state: &State,
        forces: &mut [DVec3],
        own: &mut [T],
        finish: impl Fn(usize, &mut [DVec3], &mut [T]) + Sync,
    ) {
        self.chunks
            .for_each_of_two(forces, own, |chunk, forces, own| {
                forces.fill(DVec3::ZERO);
                let first = self.chunks.range(chunk).start;
                let mut window = Window { first, forces };
                for law in lists.iter().copied().flatten() {
                    law.add_forces(chunk, state, &mut window);
                }
                finish(first, window.forces, own);
            });
    }
}
