//! Fixed chunks of a list, whose results don't depend on the number of threads that work on them.

use super::{Ahead, CHUNK};
use std::ops::Range;

/// Lists of one length that threads share out.
pub trait Shared: Send + Sized {
    /// The first entries of each, and those behind.
    fn split_at(self, middle: usize) -> (Self, Self);

    /// Adds some entries of each to what is asked for ahead of its use.
    fn add_to(&self, ahead: &mut Ahead, entries: Range<usize>);
}

impl Shared for () {
    fn split_at(self, _: usize) -> (Self, Self) {
        ((), ())
    }

    fn add_to(&self, _: &mut Ahead, _: Range<usize>) {}
}

impl<T: Send> Shared for &mut [T] {
    fn split_at(self, middle: usize) -> (Self, Self) {
        self.split_at_mut(middle)
    }

    fn add_to(&self, ahead: &mut Ahead, entries: Range<usize>) {
        ahead.add(self, entries);
    }
}

impl<T: Sync> Shared for &[T] {
    fn split_at(self, middle: usize) -> (Self, Self) {
        self.split_at(middle)
    }

    fn add_to(&self, ahead: &mut Ahead, entries: Range<usize>) {
        ahead.add(self, entries);
    }
}

impl<A: Shared, B: Shared> Shared for (A, B) {
    fn split_at(self, middle: usize) -> (Self, Self) {
        let (a, b) = (self.0.split_at(middle), self.1.split_at(middle));
        ((a.0, b.0), (a.1, b.1))
    }

    fn add_to(&self, ahead: &mut Ahead, entries: Range<usize>) {
        self.0.add_to(ahead, entries.clone());
        self.1.add_to(ahead, entries);
    }
}

/// A list cut into chunks of one size; the last may be shorter.
///
/// The size depends on the list's length alone, so that sums taken chunk by chunk have the same bits
/// for any number of threads.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Chunks {
    length: usize,
    /// Entries of a chunk.
    size: usize,
}

/// Chunks at most. Rows of a sheet of 1000 × 1000 particles are as long as [`CHUNK`]: with chunks of
/// that size three springs of four would cross a border and be worked out twice, with 32 it is one
/// in 40.
const MOST: usize = 32;

impl Chunks {
    /// The chunks of a list.
    pub fn of(length: usize) -> Self {
        Self {
            length,
            size: CHUNK.max(length.div_ceil(MOST)),
        }
    }

    /// Number of chunks.
    pub fn count(self) -> usize {
        self.length.div_ceil(self.size)
    }

    /// Entries of a chunk.
    pub fn size(self) -> usize {
        self.size
    }

    /// Number of the chunk that an entry is in.
    pub fn at(self, entry: usize) -> usize {
        entry / self.size
    }

    /// The share of a chunk in another list, which is cut into as many parts.
    pub fn share(self, chunk: usize, length: usize) -> Range<usize> {
        let part = length.div_ceil(self.count().max(1));
        (chunk * part).min(length)..((chunk + 1) * part).min(length)
    }

    /// The entries of a chunk.
    pub fn range(self, chunk: usize) -> Range<usize> {
        chunk * self.size..((chunk + 1) * self.size).min(self.length)
    }

    /// Works on every chunk of a list, on all threads of the pool it is called in.
    pub fn for_each<T: Send>(self, list: &mut [T], work: impl Fn(usize, &mut [T]) + Sync) {
        self.for_each_of(list, work);
    }

    /// The same with lists of one length.
    pub fn for_each_of<S: Shared>(self, lists: S, work: impl Fn(usize, S) + Sync) {
        if self.count() > 0 {
            self.share_out(0..self.count(), lists, &work); // one chunk wakes nobody
        }
    }

    fn share_out<S: Shared>(
        self,
        chunks: Range<usize>,
        lists: S,
        work: &(impl Fn(usize, S) + Sync),
    ) {
        if chunks.len() < 2 {
            return work(chunks.start, lists);
        }
        let middle = chunks.start + chunks.len() / 2;
        let (first, second) = lists.split_at((middle - chunks.start) * self.size);
        rayon::join(
            || self.share_out(chunks.start..middle, first, work),
            || self.share_out(middle..chunks.end, second, work),
        );
    }

    /// What `look` finds in each chunk, in their order; found on all threads of the pool it is
    /// called in.
    pub fn map<T: Copy + Default + Send>(
        self,
        look: impl Fn(usize) -> T + Sync,
    ) -> impl Iterator<Item = T> {
        let mut found = [T::default(); MOST];
        let one_each = Self {
            size: 1,
            length: self.count(),
        };
        one_each.for_each(&mut found[..self.count()], |chunk, found| {
            found[0] = look(chunk);
        });
        found.into_iter().take(self.count())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_entry_is_in_one_chunk() {
        for length in [0, 1, 1024, 1025, 5000, 32 * 1024, 32 * 1024 + 1, 1_000_003] {
            let chunks = Chunks::of(length);
            assert!(chunks.count() <= MOST);
            let mut next = 0;
            let mut shared = 0;
            for chunk in 0..chunks.count() {
                let range = chunks.range(chunk);
                assert!(range.start == next && range.len() <= chunks.size());
                assert_eq!(chunks.at(range.start), chunk);
                assert_eq!(chunks.at(range.end - 1), chunk);
                next = range.end;
                let share = chunks.share(chunk, 3 * length / 2);
                assert_eq!(share.start, shared);
                shared = share.end;
            }
            assert_eq!((next, shared), (length, 3 * length / 2));
        }
    }

    #[test]
    fn results_come_in_order() {
        let chunks = Chunks::of(5000);
        let found: Vec<usize> = chunks.map(|chunk| chunk + 1).collect();
        assert_eq!(found, [1, 2, 3, 4, 5]);
        assert_eq!(Chunks::of(0).map(|chunk| chunk).count(), 0);
    }
}
