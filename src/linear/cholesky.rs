//! Sparse Cholesky factorisation of symmetric positive definite matrices of 3 × 3 blocks.

use std::fmt;

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor::LltRegularization;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, LltRef, SymbolicCholesky, SymmetricOrdering,
    factorize_symbolic_cholesky,
};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMat};
use faer::{Conj, MatMut, Par, Side, Spec};
use glam::{DMat3, DVec3};

/// A factorisation P A Pᵀ = L Lᵀ of a symmetric positive definite matrix of 3 × 3 blocks, one row a
/// particle.
///
/// The order P of the rows (approximate minimum degree) and the pattern of L are found once;
/// [`Cholesky::factor`] then takes any values. One thread, so that the same matrix gives the same
/// bits.
///
/// Source: Amestoy, Davis and Duff 1996 (the order); Davis 2006, chapter 4 (the factorisation).
pub struct Cholesky {
    /// Rows of A, scalars: A's upper half, column by column.
    pattern: SymbolicSparseColMat<u32>,
    /// Values of A's upper half.
    values: Vec<f64>,
    /// Where each pair's block is.
    places: Vec<Place>,
    /// Order of the rows and pattern of L.
    symbolic: SymbolicCholesky<u32>,
    /// Values of L.
    factor: Vec<f64>,
    /// Whether `factor` holds a whole factorisation.
    factored: bool,
    /// Work space of the numeric factorisation.
    work: MemBuffer,
}

/// Entries of the largest factor: 4 GB, of a sheet of some 500 × 500 particles.
const MOST_ENTRIES: usize = 500_000_000;

/// Rows beyond which nobody wants to wait for the order alone: 10 s for a million.
const MOST_ROWS: usize = 400_000;

/// The matrix has a direction in which it is not positive: x·A x ≤ 0 for some x, or not a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the matrix is not positive definite")]
pub struct NotPositiveDefinite;

/// Work space of a solve.
pub(super) struct Work {
    scalars: Vec<f64>,
    buffer: MemBuffer,
}

/// Where the block of a pair is in the upper half of A.
#[derive(Clone, Copy, Debug)]
struct Place {
    /// Index in the values of the first entry in each of the block's columns.
    columns: [usize; 3],
    /// Whether the pair's block is the transpose of the one in the upper half.
    transposed: bool,
}

impl fmt::Debug for Cholesky {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Cholesky")
            .field("rows", &self.rows())
            .field("pairs", &self.places.len())
            .field("factor_entries", &self.factor.len())
            .field("factored", &self.factored)
            .finish_non_exhaustive()
    }
}

impl Cholesky {
    /// Finds the order of elimination and the pattern of the factor for a matrix with blocks on its
    /// diagonal and at `pairs` (i, j), i ≠ j, in any order and direction, repeated or not; `None` when there
    /// are too many of them: 400,000 rows, or a factor of 500 million entries (4 GB).
    ///
    /// # Panics
    ///
    /// When a pair is (i, i) or names a row that isn't there.
    pub fn new(rows: usize, pairs: &[[u32; 2]]) -> Option<Self> {
        if rows > MOST_ROWS {
            return None;
        }
        let (pattern, places) = upper_half(rows, pairs);
        let symbolic = factorize_symbolic_cholesky(
            pattern.as_ref(),
            Side::Upper,
            SymmetricOrdering::Amd,
            CholeskySymbolicParams::default(),
        );
        let symbolic = symbolic.ok().filter(|s| s.len_val() <= MOST_ENTRIES)?;
        let work = symbolic.factorize_numeric_llt_scratch::<f64>(Par::Seq, Spec::default());
        Some(Self {
            values: vec![0.0; pattern.row_idx().len()],
            factor: vec![0.0; symbolic.len_val()],
            work: MemBuffer::new(work),
            factored: false,
            pattern,
            places,
            symbolic,
        })
    }

    /// Block rows of the matrix.
    pub fn rows(&self) -> usize {
        self.pattern.ncols() / 3
    }

    /// Multiplications that a factorisation takes, about: the squares of the entries of L by column, at
    /// their mean.
    pub fn operations(&self) -> f64 {
        #[expect(clippy::cast_precision_loss, reason = "a rough figure")]
        let [entries, columns] = [self.factor.len(), 3 * self.rows()].map(|n| n as f64);
        entries * entries / columns.max(1.0)
    }

    /// Factorises the matrix with block `diagonal[i]` at (i, i), of which the upper half is read, and
    /// for every pair (i, j) the block `off[pair]` at (i, j) and its transpose at (j, i). Blocks of
    /// pairs that were given twice are added.
    ///
    /// # Errors
    ///
    /// When the matrix is not positive definite.
    ///
    /// # Panics
    ///
    /// When there aren't as many blocks as rows and pairs.
    pub fn factor(&mut self, diagonal: &[DMat3], off: &[DMat3]) -> Result<(), NotPositiveDefinite> {
        self.fill(diagonal, off);
        let matrix = SparseColMatRef::new(self.pattern.as_ref(), &self.values);
        let done = self.symbolic.factorize_numeric_llt(
            &mut self.factor,
            matrix,
            Side::Upper,
            LltRegularization::default(),
            Par::Seq,
            MemStack::new(&mut self.work),
            Spec::default(),
        );
        self.factored = done.is_ok();
        match done {
            Ok(_) => Ok(()),
            Err(_not_positive) => Err(NotPositiveDefinite),
        }
    }

    /// Replaces b by the x of A x = b.
    ///
    /// # Panics
    ///
    /// When `x` has another length than the matrix, or the last factorisation was refused or none was
    /// asked for.
    pub fn solve(&self, x: &mut [DVec3]) {
        self.solve_with(&mut self.work(), x);
    }

    /// Work space of [`Cholesky::solve_with`].
    pub(super) fn work(&self) -> Work {
        let bytes = self.symbolic.solve_in_place_scratch::<f64>(1, Par::Seq);
        Work {
            scalars: vec![0.0; 3 * self.rows()],
            buffer: MemBuffer::new(bytes),
        }
    }

    /// [`Cholesky::solve`] without allocating.
    pub(super) fn solve_with(&self, work: &mut Work, x: &mut [DVec3]) {
        assert!(self.factored, "a solve needs a factorisation");
        assert_eq!(x.len(), self.rows(), "one vector a row");
        let Work { scalars, buffer } = work;
        for (scalars, x) in scalars.as_chunks_mut::<3>().0.iter_mut().zip(&*x) {
            *scalars = x.to_array();
        }
        let rows = scalars.len();
        LltRef::new(&self.symbolic, &self.factor).solve_in_place_with_conj(
            Conj::No,
            MatMut::from_column_major_slice_mut(scalars, rows, 1),
            Par::Seq,
            MemStack::new(buffer),
        );
        for (x, scalars) in x.iter_mut().zip(scalars.as_chunks::<3>().0) {
            *x = DVec3::from_array(*scalars);
        }
    }

    /// Sets the values of A's upper half.
    fn fill(&mut self, diagonal: &[DMat3], off: &[DMat3]) {
        assert_eq!(diagonal.len(), self.rows(), "one block a row");
        assert_eq!(off.len(), self.places.len(), "one block a pair");
        self.values.fill(0.0);
        for (i, block) in diagonal.iter().enumerate() {
            for c in 0..3 {
                // The diagonal block stands last in its columns, c + 1 entries high.
                let end = self.pattern.col_ptr()[3 * i + c + 1] as usize;
                let column = &mut self.values[end - c - 1..end];
                column.copy_from_slice(&block.col(c).to_array()[..=c]);
            }
        }
        for (place, block) in self.places.iter().zip(off) {
            let block = if place.transposed {
                block.transpose()
            } else {
                *block
            };
            for (c, &start) in place.columns.iter().enumerate() {
                for (value, entry) in self.values[start..].iter_mut().zip(block.col(c).to_array()) {
                    *value += entry;
                }
            }
        }
    }
}

/// Pattern of the upper half of A in scalars, and where each pair's block is in it.
fn upper_half(rows: usize, pairs: &[[u32; 2]]) -> (SymbolicSparseColMat<u32>, Vec<Place>) {
    // Block column and block row of each, sorted.
    let mut blocks: Vec<[u32; 2]> = pairs.iter().map(|&[i, j]| [i.max(j), i.min(j)]).collect();
    assert!(
        blocks.iter().all(|&[j, i]| i < j && (j as usize) < rows),
        "pairs are of two different rows of {rows}"
    );
    blocks.sort_unstable();
    blocks.dedup();
    let mut first = vec![0; rows + 1];
    for &[column, _] in &blocks {
        first[column as usize + 1] += 1;
    }
    for column in 0..rows {
        first[column + 1] += first[column];
    }
    let mut starts = vec![0_u32];
    let mut entries = Vec::new();
    for column in 0..rows {
        let above = &blocks[first[column]..first[column + 1]];
        let own = 3 * index(column);
        for c in 0..3 {
            entries.extend(above.iter().flat_map(|&[_, i]| 3 * i..3 * i + 3));
            entries.extend(own..=own + c);
            starts.push(index(entries.len()));
        }
    }
    let place = |&[i, j]: &[u32; 2]| {
        let block = [i.max(j), i.min(j)];
        let (column, at) = (block[0] as usize, blocks.partition_point(|b| *b < block));
        let above = 3 * (at - first[column]);
        Place {
            columns: [0, 1, 2].map(|c| starts[3 * column + c] as usize + above),
            transposed: i > j,
        }
    };
    let places = pairs.iter().map(place).collect();
    let pattern = SymbolicSparseColMat::new_checked(3 * rows, 3 * rows, starts, None, entries);
    (pattern, places)
}

/// A count as faer's index.
fn index(count: usize) -> u32 {
    u32::try_from(count).expect("fewer than 2³² entries")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A block of numbers that follow no pattern, within ±1.
    fn block(seed: f64) -> DMat3 {
        let number = |k: u32| (seed * 12.9898 + f64::from(k) * 78.233).sin();
        DMat3::from_cols_array(&[0, 1, 2, 3, 4, 5, 6, 7, 8].map(number))
    }

    /// A band and pairs far apart, in both directions; some are given twice.
    fn pairs(rows: u32) -> Vec<[u32; 2]> {
        let steps = [1, 2, 17, 41].into_iter();
        let near = steps.flat_map(|step| (0..rows - step).map(move |i| [i, i + step]));
        let far = (0..rows / 5).map(|i| [rows - 1 - 2 * i, i]);
        near.chain(far).chain([[3, 2], [2, 3]]).collect()
    }

    /// Diagonal blocks that outweigh their rows, so that the matrix is positive definite.
    fn diagonal(rows: u32, pairs: &[[u32; 2]], scale: f64) -> Vec<DMat3> {
        let mut weights = vec![1.0; rows as usize];
        for pair in pairs {
            for &row in pair {
                weights[row as usize] += 3.0;
            }
        }
        let blocks = weights.iter().zip(0..rows).map(|(&weight, i)| {
            let skewed = block(f64::from(i) + 0.5) * 0.1;
            DMat3::from_diagonal(DVec3::splat(weight)) + skewed + skewed.transpose()
        });
        blocks.map(|block| block * scale).collect()
    }

    fn off(pairs: &[[u32; 2]], scale: f64) -> Vec<DMat3> {
        let seeds = (0_u32..).zip(pairs).map(|(k, _)| f64::from(k));
        seeds.map(|seed| block(seed) * scale).collect()
    }

    fn multiply(diagonal: &[DMat3], pairs: &[[u32; 2]], off: &[DMat3], x: &[DVec3]) -> Vec<DVec3> {
        let mut y: Vec<DVec3> = diagonal.iter().zip(x).map(|(d, x)| *d * *x).collect();
        for (&[i, j], block) in pairs.iter().zip(off) {
            let (i, j) = (i as usize, j as usize);
            y[i] += *block * x[j];
            y[j] += block.transpose() * x[i];
        }
        y
    }

    /// Solves against products, for a small matrix and one with dense parts in its factor, and twice
    /// with other values.
    #[test]
    fn solutions_give_back_the_right_hand_side() {
        for rows in [45, 400] {
            let pairs = pairs(rows);
            let mut cholesky = Cholesky::new(rows as usize, &pairs).unwrap();
            for scale in [1.0, 1e3, 1e-3] {
                let (diagonal, off) = (diagonal(rows, &pairs, scale), off(&pairs, scale));
                cholesky.factor(&diagonal, &off).unwrap();
                let b: Vec<DVec3> = (0..rows).map(|i| block(f64::from(i)).x_axis).collect();
                let mut x = b.clone();
                cholesky.solve(&mut x);
                for (product, b) in multiply(&diagonal, &pairs, &off, &x).iter().zip(&b) {
                    assert!((product - b).length() < 1e-10, "{product} against {b}");
                }
                let mut again = b.clone();
                cholesky.factor(&diagonal, &off).unwrap();
                cholesky.solve(&mut again);
                assert_eq!(x, again, "bits differ between two solves");
            }
        }
    }

    /// A block is told from its transpose: two rows whose solution is known.
    #[test]
    fn blocks_stand_at_their_pair_in_its_direction() {
        let off = DMat3::from_cols_array(&[0.0, 1.0, 2.0, 0.0, 0.0, 3.0, 0.0, 0.0, 0.0]);
        let diagonal = [DMat3::from_diagonal(DVec3::splat(10.0)); 2];
        for (pair, ahead) in [([0, 1], off), ([1, 0], off.transpose())] {
            let mut cholesky = Cholesky::new(2, &[pair]).unwrap();
            cholesky.factor(&diagonal, &[ahead]).unwrap();
            let exact = [DVec3::new(1.0, 2.0, 3.0), DVec3::new(-1.0, 0.5, 4.0)];
            let mut x = [
                exact[0] * 10.0 + off * exact[1],
                exact[1] * 10.0 + off.transpose() * exact[0],
            ];
            cholesky.solve(&mut x);
            assert!(x[0].abs_diff_eq(exact[0], 1e-13) && x[1].abs_diff_eq(exact[1], 1e-13));
        }
    }

    #[test]
    fn a_matrix_that_is_not_positive_is_refused() {
        let rows = 400;
        let pairs = pairs(rows);
        let mut cholesky = Cholesky::new(rows as usize, &pairs).unwrap();
        let off = off(&pairs, 1.0);
        for spoil in [-1.0, 0.0, f64::NAN] {
            let mut diagonal = diagonal(rows, &pairs, 1.0);
            diagonal[123].y_axis.y *= spoil;
            assert_eq!(cholesky.factor(&diagonal, &off), Err(NotPositiveDefinite));
        }
        // A mechanism: the difference of two rows has no stiffness of its own.
        let mut two = Cholesky::new(2, &[[0, 1]]).unwrap();
        let refused = two.factor(&[DMat3::IDENTITY; 2], &[-2.0 * DMat3::IDENTITY]);
        assert_eq!(refused, Err(NotPositiveDefinite));
        two.factor(&[DMat3::IDENTITY; 2], &[DMat3::ZERO]).unwrap();
    }

    #[test]
    #[should_panic(expected = "a solve needs a factorisation")]
    fn a_refused_matrix_solves_nothing() {
        let mut cholesky = Cholesky::new(1, &[]).unwrap();
        cholesky.factor(&[DMat3::IDENTITY], &[]).unwrap();
        cholesky.factor(&[-DMat3::IDENTITY], &[]).unwrap_err();
        cholesky.solve(&mut [DVec3::ONE]);
    }
}
