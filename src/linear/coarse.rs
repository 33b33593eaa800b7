//! The coarse level of a two-level preconditioner.
//!
//! What a block-diagonal preconditioner can't see is smooth: an error that spreads over the whole
//! cloth moves by one row an iteration. Patches of some fifty rows, each moved as a whole, take it
//! away at once: with Z the matrix that gives every row the motion of its patch on its free
//! directions, Z (Zᵀ A Z)⁻¹ Zᵀ is added to the preconditioner, Zᵀ A Z factorised.
//!
//! Source: Nicolaides 1987 (patches of constant value); Tang, Nabben, Vuik and Erlangga 2009 (the
//! additive form among its relatives).

use super::{CHUNK, Cholesky, Constraint, NotPositiveDefinite, PairMatrix};
use glam::{DMat3, DVec3};
use std::collections::VecDeque;
use std::ops::Range;

/// Rows in a patch. On a sheet of 100 × 100 particles at dt² k/m = 870, one level takes 214 iterations,
/// patches of 100, 49 and 25 rows 86, 73 and 60, each waiting longer for the coarse solve; 49 take
/// least time, less than half of one level's.
const PATCH: usize = 49;

/// Patches of the rows of a matrix, and the matrix between them.
#[derive(Debug)]
pub struct Coarse {
    /// The patch of each row. A patch lies in one chunk of rows.
    patch: Vec<u32>,
    /// The patches of each chunk.
    chunks: Vec<Range<usize>>,
    /// Where each pair of the matrix goes.
    places: Vec<Place>,
    diagonal: Vec<DMat3>,
    off: Vec<DMat3>,
    pub(super) cholesky: Cholesky,
}

/// The rows of a pair, and the entry between their patches; none within one patch.
#[derive(Clone, Copy, Debug)]
struct Place {
    rows: [u32; 2],
    entry: Option<u32>,
}

impl Coarse {
    /// Cuts the rows of a matrix into patches of neighbours; `None` when even their matrix is too large.
    pub fn new(matrix: &PairMatrix) -> Option<Self> {
        let pairs = matrix.pairs();
        let (patch, chunks) = patches(matrix.masses.len(), &pairs);
        let count = chunks.last().map_or(0, |range| range.end);
        let between = |&[i, j]: &[u32; 2]| [patch[i as usize], patch[j as usize]];
        let mut entries: Vec<[u32; 2]> = pairs
            .iter()
            .map(between)
            .filter(|[a, b]| a != b)
            .map(|[a, b]| [a.min(b), a.max(b)])
            .collect();
        entries.sort_unstable();
        entries.dedup();
        let place = |pair: &[u32; 2]| {
            let [a, b] = between(pair);
            let found = entries.binary_search(&[a.min(b), a.max(b)]).ok();
            Place {
                rows: *pair,
                entry: found.and_then(|entry| u32::try_from(entry).ok()),
            }
        };
        Some(Self {
            places: pairs.iter().map(place).collect(),
            diagonal: vec![DMat3::ZERO; count],
            off: vec![DMat3::ZERO; entries.len()],
            cholesky: Cholesky::new(count, &entries)?,
            patch,
            chunks,
        })
    }

    /// Takes the values of a matrix with the same pairs, on the free directions of its rows.
    ///
    /// # Errors
    ///
    /// When the matrix isn't positive definite.
    pub fn prepare(
        &mut self,
        matrix: &PairMatrix,
        constraints: &[Constraint],
    ) -> Result<(), NotPositiveDefinite> {
        let Self {
            patch,
            places,
            diagonal,
            off,
            ..
        } = self;
        diagonal.fill(DMat3::ZERO);
        off.fill(DMat3::ZERO);
        for (&patch, &m) in patch.iter().zip(&matrix.masses) {
            diagonal[patch as usize] += DMat3::from_diagonal(DVec3::splat(m));
        }
        for (Place { rows, entry }, block) in places.iter().zip(matrix.off_diagonal()) {
            let [i, j] = rows.map(|row| constraints[row as usize]);
            let free = i == Constraint::Free && j == Constraint::Free;
            if entry.is_none() && free {
                continue; // a patch that moves as a whole doesn't feel what is inside
            }
            let (p, q) = (i.projection(), j.projection());
            let [a, b] = rows.map(|row| patch[row as usize] as usize);
            let across = if free { block } else { p * block * q };
            // The block between the rows is −B; B and its transpose stand on the diagonal.
            diagonal[a] -= if free { block } else { p * block * p };
            diagonal[b] -= if free {
                block.transpose()
            } else {
                q * block.transpose() * q
            };
            match entry {
                Some(entry) if a < b => off[*entry as usize] += across,
                Some(entry) => off[*entry as usize] += across.transpose(),
                None => diagonal[a] += across + across.transpose(),
            }
        }
        for block in diagonal.iter_mut() {
            if block.x_axis.x <= 0.0 {
                *block = DMat3::IDENTITY; // rows without mass that all are given
            }
        }
        self.cholesky.factor(diagonal, off)
    }

    /// Number of patches.
    pub(super) fn count(&self) -> usize {
        self.diagonal.len()
    }

    /// The patches of a chunk of rows.
    pub(super) fn of_chunk(&self, chunk: usize) -> Range<usize> {
        self.chunks[chunk].clone()
    }

    /// The patch of a row.
    pub(super) fn of_row(&self, row: usize) -> usize {
        self.patch[row] as usize
    }
}

/// Patches of up to [`PATCH`] neighbours, grown row by row within each chunk.
fn patches(rows: usize, pairs: &[[u32; 2]]) -> (Vec<u32>, Vec<Range<usize>>) {
    let mut neighbours = vec![Vec::new(); rows];
    for &[i, j] in pairs {
        neighbours[i as usize].push(j);
        neighbours[j as usize].push(i);
    }
    let mut patch = vec![u32::MAX; rows];
    let mut count = 0;
    let mut chunks = Vec::new();
    for start in (0..rows).step_by(CHUNK) {
        let chunk = start..(start + CHUNK).min(rows);
        let first = count as usize;
        for seed in chunk.clone() {
            if patch[seed] != u32::MAX {
                continue;
            }
            let (mut size, mut next) = (0, VecDeque::from([seed]));
            while let Some(row) = next.pop_front() {
                if patch[row] != u32::MAX || size == PATCH {
                    continue;
                }
                patch[row] = count;
                size += 1;
                let around = neighbours[row].iter().map(|&other| other as usize);
                next.extend(around.filter(|other| chunk.contains(other)));
            }
            count += 1;
        }
        chunks.push(first..count as usize);
    }
    (patch, chunks)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linear::{Assembly, ConjugateGradient, Limits, LineBlock, Pattern, System};

    /// A long chain of light rows, held at one end: one level moves an error by a row an iteration, the
    /// second across a patch.
    #[test]
    fn a_coarse_level_takes_away_what_is_smooth() {
        let rows = 2500_u32;
        let pairs: Vec<[u32; 2]> = (1..rows).map(|j| [j - 1, j]).collect();
        let pattern = Pattern::Lines(pairs.clone());
        let mut matrix = PairMatrix::with_patterns(rows as usize, std::slice::from_ref(&pattern));
        matrix.clear(&vec![1e-4; rows as usize]);
        let slots = matrix.slots(&pattern);
        let mut assembly = Assembly {
            matrix: &mut matrix,
            slots: &slots,
        };
        for element in 0..pairs.len() {
            let d = DVec3::X;
            assembly.add(element, LineBlock { a: 1.0, e: 1.0, d });
        }
        let mut constraints = vec![Constraint::Free; rows as usize];
        constraints[0] = Constraint::Fixed;
        let mut diagonal = vec![DMat3::ZERO; rows as usize];
        matrix.diagonal(&mut diagonal);
        let blocks = constraints.iter().zip(&diagonal);
        let inverse: Vec<DMat3> = blocks.map(|(held, block)| held.inverse(*block)).collect();
        let mut level = Coarse::new(&matrix).unwrap();
        level.prepare(&matrix, &constraints).unwrap();
        let b = vec![DVec3::ONE; rows as usize];
        let [one, two] = [None, Some(&level)].map(|coarse| {
            let system = System {
                matrix: &matrix,
                constraints: &constraints,
                inverse: &inverse,
                coarse,
                b: &b,
            };
            let limits = Limits {
                tolerance: 1e-6,
                floor: 0.0,
                max_iterations: 5000,
            };
            let mut x = vec![DVec3::ZERO; rows as usize];
            let solve = ConjugateGradient::new(rows as usize).solve(system, &mut x, limits);
            assert!(solve.converged, "{solve:?}");
            solve.iterations
        });
        // 2126 and 253; 353 when the patches don't pull at each other.
        assert!(
            7 * two < one,
            "{one} iterations with one level, {two} with two"
        );
    }
}
