//! Conjugate gradients with a block-diagonal preconditioner that also keeps constraints.
//!
//! Source: Baraff and Witkin 1998, section 5.3 (the modified method), in the form in which a
//! constrained direction has no entry in the preconditioner: search directions never leave the
//! space that the constraints allow, so that no separate filter is needed.

use super::{PairMatrix, CHUNK};
use glam::{DMat3, DVec3};
use rayon::prelude::*;

/// Work arrays of the solver; one entry a particle unless it says otherwise.
#[derive(Clone, Debug, Default)]
pub struct ConjugateGradient {
    /// Residual b − A x; after a solve, what the constraints have to supply.
    pub residual: Vec<DVec3>,
    /// Preconditioned residual.
    z: Vec<DVec3>,
    /// Search direction.
    p: Vec<DVec3>,
    /// A p.
    q: Vec<DVec3>,
    /// Partial sum of each chunk.
    sums: Vec<f64>,
}

/// How a solve went.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Solve {
    /// Iterations done.
    pub iterations: u32,
    /// Preconditioned residual norm at the end, relative to the reference that was given.
    pub residual: f64,
    /// Whether the tolerance was reached.
    pub converged: bool,
}

impl ConjugateGradient {
    /// Work arrays for `rows` block rows.
    pub fn new(rows: usize) -> Self {
        let zero = vec![DVec3::ZERO; rows];
        Self {
            residual: zero.clone(),
            z: zero.clone(),
            p: zero.clone(),
            q: zero,
            sums: vec![0.0; rows.div_ceil(CHUNK)],
        }
    }

    /// Solves A x = b from the guess in `x`, until √(rᵀ P r) ≤ `tolerance` · max(√(r₀ᵀ P r₀), `floor`).
    ///
    /// `inverse` holds the preconditioner's 3 × 3 blocks P: the inverse of A's diagonal block on
    /// free directions, nothing on constrained ones, along which `x` keeps its guess.
    pub fn solve(
        &mut self,
        matrix: &PairMatrix,
        inverse: &[DMat3],
        b: &[DVec3],
        x: &mut [DVec3],
        limits: Limits,
    ) -> Solve {
        matrix.multiply(x, &mut self.q);
        let mut rz = self.start(inverse, b);
        let reference = rz.max(limits.floor * limits.floor);
        let goal = limits.tolerance * limits.tolerance * reference;
        let mut iterations = 0;
        while rz > goal && iterations < limits.max_iterations {
            let pq = self.multiply_and_dot(matrix);
            if pq <= 0.0 {
                break; // rounding, or a matrix that is not positive definite: report what there is
            }
            let previous = rz;
            rz = self.descend(inverse, x, rz / pq);
            self.turn(rz / previous);
            iterations += 1;
        }
        let residual = if reference > 0.0 { (rz / reference).sqrt() } else { 0.0 };
        Solve { iterations, residual, converged: rz <= goal }
    }

    /// r = b − A x, z = P r, p = z; returns r · z.
    fn start(&mut self, inverse: &[DMat3], b: &[DVec3]) -> f64 {
        let Self { residual, z, p, q, .. } = self;
        let mut sum = 0.0;
        for i in 0..b.len() {
            residual[i] = b[i] - q[i];
            z[i] = inverse[i] * residual[i];
            p[i] = z[i];
            sum += residual[i].dot(z[i]);
        }
        sum
    }

    /// q = A p; returns p · q.
    fn multiply_and_dot(&mut self, matrix: &PairMatrix) -> f64 {
        let Self { p, q, sums, .. } = self;
        let p = &*p;
        let chunk = |(chunk, (q, sum)): (usize, (&mut [DVec3], &mut f64))| {
            matrix.multiply_chunk(chunk, p, q);
            *sum = dot(&p[chunk * CHUNK..chunk * CHUNK + q.len()], q);
        };
        if q.len() <= CHUNK {
            q.chunks_mut(CHUNK).zip(sums.iter_mut()).enumerate().for_each(chunk);
        } else {
            q.par_chunks_mut(CHUNK).zip(sums.par_iter_mut()).enumerate().for_each(chunk);
        }
        sums.iter().sum()
    }

    /// x += α p, r −= α q, z = P r; returns r · z.
    fn descend(&mut self, inverse: &[DMat3], x: &mut [DVec3], alpha: f64) -> f64 {
        let Self { residual, z, p, q, .. } = self;
        let mut total = 0.0;
        for first in (0..x.len()).step_by(CHUNK) {
            let mut sum = 0.0;
            for i in first..(first + CHUNK).min(x.len()) {
                x[i] += p[i] * alpha;
                residual[i] -= q[i] * alpha;
                z[i] = inverse[i] * residual[i];
                sum += residual[i].dot(z[i]);
            }
            total += sum;
        }
        total
    }

    /// p = z + β p.
    fn turn(&mut self, beta: f64) {
        for (p, &z) in self.p.iter_mut().zip(&self.z) {
            *p = z + *p * beta;
        }
    }
}

/// When a solve ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// Relative residual that is good enough.
    pub tolerance: f64,
    /// Residual norm that counts as 1 when the first residual is smaller.
    pub floor: f64,
    /// Iterations after which the solve gives up.
    pub max_iterations: u32,
}

fn dot(a: &[DVec3], b: &[DVec3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.dot(*b)).sum()
}
