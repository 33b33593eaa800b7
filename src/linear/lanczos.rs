//! Largest eigenvalues of symmetric matrices, block by block.
//!
//! Source: Lanczos 1950; the bound of the error is that of Paige 1971.

use super::PairMatrix;
use glam::DVec3;
use std::ops::Range;

/// Residual |A x − θ x| at which a value is taken, relative to it. The value is then within half a
/// percent of an eigenvalue at worst, and where the spectrum is dense within the residual's square:
/// sheets of any size need 30 to 60 products.
const TOLERANCE: f64 = 5e-3;

/// Products after which the value is taken with its residual on top, which can only be too large.
const MAX_PRODUCTS: usize = 400;

/// Products between two looks at the residual.
const STRIDE: usize = 5;

/// The largest eigenvalue of each diagonal block of S A S, with S = diag(`scale`) and A positive
/// semi-definite.
///
/// `blocks` are rows between which A has nothing; they share the products. `x` is the start, with a
/// part of each block's fastest mode; what it holds outside the blocks must be zero.
pub fn largest_eigenvalues(
    matrix: &PairMatrix,
    scale: &[f64],
    blocks: &[Range<usize>],
    mut x: Vec<DVec3>,
) -> Vec<f64> {
    let mut before = vec![DVec3::ZERO; x.len()];
    let mut scaled = before.clone();
    let mut y = before.clone();
    let mut ladders: Vec<Ladder> = blocks
        .iter()
        .map(|rows| Ladder::new(&mut x[rows.clone()]))
        .collect();
    for product in 1..=MAX_PRODUCTS {
        for (scaled, (x, s)) in scaled.iter_mut().zip(x.iter().zip(scale)) {
            *scaled = *x * *s;
        }
        matrix.multiply(&scaled, &mut y);
        for (y, s) in y.iter_mut().zip(scale) {
            *y *= *s;
        }
        for (ladder, rows) in ladders.iter_mut().zip(blocks) {
            let rows = rows.clone();
            ladder.climb(&mut before[rows.clone()], &mut x[rows.clone()], &y[rows]);
        }
        if product % STRIDE == 0 || product == MAX_PRODUCTS {
            ladders.iter_mut().for_each(Ladder::look);
        }
        if ladders.iter().all(|ladder| ladder.done) {
            break;
        }
    }
    let value = |ladder: &Ladder| {
        if ladder.done {
            ladder.value
        } else {
            ladder.value + ladder.residual
        }
    };
    ladders.iter().map(value).collect()
}

/// The tridiagonal matrix of one block.
#[derive(Debug, Default)]
struct Ladder {
    /// Its diagonal.
    alphas: Vec<f64>,
    /// Beside its diagonal; one entry more than is inside.
    betas: Vec<f64>,
    /// Its largest eigenvalue at the last look.
    value: f64,
    /// Norm of that one's residual in the whole block.
    residual: f64,
    done: bool,
}

impl Ladder {
    /// Starts with a vector, which becomes a unit one.
    fn new(x: &mut [DVec3]) -> Self {
        let length = norm(x);
        if length > 0.0 {
            x.iter_mut().for_each(|x| *x /= length);
        }
        Self {
            done: length == 0.0,
            ..Self::default()
        }
    }

    /// β₊ x₊ = A x − α x − β x₋, from x and y = A x.
    fn climb(&mut self, before: &mut [DVec3], x: &mut [DVec3], y: &[DVec3]) {
        if self.done {
            return;
        }
        let alpha: f64 = x.iter().zip(y).map(|(x, y)| x.dot(*y)).sum();
        let beta = self.betas.last().copied().unwrap_or(0.0);
        for ((before, x), y) in before.iter_mut().zip(x.iter_mut()).zip(y) {
            let next = *y - *x * alpha - *before * beta;
            *before = *x;
            *x = next;
        }
        let next = norm(x);
        self.alphas.push(alpha);
        self.betas.push(next);
        // Nothing new is left: the values found are exact.
        if next <= 1e-12 * alpha.abs() {
            self.look();
            self.done = true;
        } else {
            x.iter_mut().for_each(|x| *x /= next);
        }
    }

    /// Finds the largest eigenvalue and its residual β₊ |last entry of its unit eigenvector|.
    fn look(&mut self) {
        if self.done {
            return;
        }
        self.value = self.largest();
        let [mut next, mut entry, mut square] = [0.0, 1.0, 1.0];
        for row in (1..self.alphas.len()).rev() {
            let beyond = self.betas[row] * next;
            let above = ((self.value - self.alphas[row]) * entry - beyond) / self.betas[row - 1];
            (next, entry) = (entry, above);
            square += above * above;
        }
        self.residual = self.betas.last().copied().unwrap_or(0.0) / f64::sqrt(square);
        self.done = self.residual <= TOLERANCE * self.value;
    }

    /// Its largest eigenvalue, by bisection on the signs of the pivots of T − θ.
    fn largest(&self) -> f64 {
        let beta = |row: usize| if row == 0 { 0.0 } else { self.betas[row - 1] };
        let rows = self.alphas.len();
        let reach = |row: usize| {
            let below = if row + 1 < rows { self.betas[row] } else { 0.0 };
            self.alphas[row] + beta(row) + below
        };
        let mut high = (0..rows).map(reach).fold(0.0, f64::max);
        let mut low = 0.0;
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            let mut pivot = f64::INFINITY;
            let above = (0..rows).all(|row| {
                pivot = middle - self.alphas[row] - beta(row) * beta(row) / pivot;
                pivot > 0.0
            });
            if above {
                high = middle;
            } else {
                low = middle;
            }
        }
        high
    }
}

fn norm(x: &[DVec3]) -> f64 {
    x.iter().map(|x| x.length_squared()).sum::<f64>().sqrt()
}
