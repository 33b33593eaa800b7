//! Linear algebra: the matrix of pairwise forces, conjugate gradients with one or two levels, constraints
//! on single particles, sparse Cholesky factorisations of scalars and of 3 × 3 blocks, the largest
//! eigenvalues, memory asked for ahead of its use, and threads that work in step.
//!
//! Loops run over fixed chunks of rows, and sums are taken over the chunks in order, so that the
//! result has the same bits for any number of threads.

mod ahead;
mod cholesky;
mod chunks;
mod coarse;
mod conjugate_gradient;
mod constraint;
mod lanczos;
mod pair_matrix;
mod pairs;
mod scalar_cholesky;
pub(crate) mod team;

pub use ahead::{Ahead, BATCH};
pub use cholesky::{Cholesky, NotPositiveDefinite};
pub use chunks::{Chunks, Shared};
pub use coarse::Coarse;
pub use conjugate_gradient::{ConjugateGradient, Limits, Solve, System};
pub use constraint::Constraint;
pub use lanczos::largest_eigenvalues;
pub use pair_matrix::{Assembly, LineBlock, PairMatrix, Pattern, Slot, outer};
pub use scalar_cholesky::ScalarCholesky;
pub use team::awake;

/// Rows in a chunk: large enough that the blocks between chunks, which are read twice, are few (one
/// in 25 for a 61 × 61 sheet with second neighbours), small enough for two threads to share.
pub(crate) const CHUNK: usize = 1024;
