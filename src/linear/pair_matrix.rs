//! The matrix of a set of particles that act on each other in pairs along lines.

use super::CHUNK;
use glam::{DMat3, DVec3};

/// A symmetric matrix of 3 × 3 blocks, one row a particle: a mass on the diagonal, and for every pair
/// of particles (i, j) the block B = a·1 + e·d dᵀ, added to (i, i) and (j, j), taken from (i, j) and
/// (j, i).
///
/// Springs and dampers are of this form. A product needs 25 operations a pair instead of the 60 of
/// two full blocks, and 44 bytes instead of 76.
///
/// The pattern is fixed; [`PairMatrix::clear`] and [`Assembly`] fill it anew each step.
#[derive(Clone, Debug, Default)]
pub struct PairMatrix {
    /// Multiple of the identity at (i, i).
    pub masses: Vec<f64>,
    /// Where each row's pairs begin; one more entry than rows.
    row_start: Vec<u32>,
    /// The other particle j > i of each pair.
    columns: Vec<u32>,
    /// The block of each pair.
    blocks: Vec<PairBlock>,
    /// How many of a row's pairs, its first, end in the row's own chunk.
    inside: Vec<u32>,
    /// Per chunk: row in it, row outside it and slot of the pairs that cross its border. Each such
    /// pair stands in two lists.
    crossing: Vec<Vec<[u32; 3]>>,
}

/// B = a·1 + e·d dᵀ.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PairBlock {
    /// Factor of the identity.
    pub a: f64,
    /// Factor of d dᵀ.
    pub e: f64,
    /// The line along which the pair acts.
    pub d: DVec3,
}

impl PairBlock {
    /// B v.
    #[inline]
    fn times(&self, v: DVec3) -> DVec3 {
        v * self.a + self.d * (self.e * self.d.dot(v))
    }

    /// B as a matrix.
    pub fn to_matrix(self) -> DMat3 {
        let e = self.d * self.e;
        let outer = DMat3::from_cols(e * self.d.x, e * self.d.y, e * self.d.z);
        outer + DMat3::from_diagonal(DVec3::splat(self.a))
    }
}

impl PairMatrix {
    /// An empty matrix of `rows` rows with room for blocks at `pairs`, in any order, repeated or not.
    pub fn with_pattern(rows: usize, pairs: impl Iterator<Item = [u32; 2]>) -> Self {
        let mut pairs: Vec<[u32; 2]> = pairs.map(|[i, j]| [i.min(j), i.max(j)]).collect();
        pairs.sort_unstable();
        pairs.dedup();
        let mut row_start = vec![0_u32; rows + 1];
        for &[i, _] in &pairs {
            row_start[i as usize + 1] += 1;
        }
        for i in 0..rows {
            row_start[i + 1] += row_start[i];
        }
        let mut crossing = vec![Vec::new(); rows.div_ceil(CHUNK)];
        let mut inside = vec![0; rows];
        for (slot, &[i, j]) in (0_u32..).zip(&pairs) {
            let [chunk_i, chunk_j] = [i, j].map(|row| row as usize / CHUNK);
            if chunk_i == chunk_j {
                inside[i as usize] += 1;
            } else {
                crossing[chunk_i].push([i, j, slot]);
                crossing[chunk_j].push([j, i, slot]);
            }
        }
        Self {
            masses: vec![0.0; rows],
            row_start,
            columns: pairs.iter().map(|pair| pair[1]).collect(),
            blocks: vec![PairBlock::default(); pairs.len()],
            inside,
            crossing,
        }
    }

    /// Sets every block to zero, and the masses on the diagonal.
    pub fn clear(&mut self, masses: &[f64]) {
        self.masses.copy_from_slice(masses);
        self.blocks.fill(PairBlock::default());
    }

    /// Where the block of a pair is stored; `None` when the pattern doesn't have it.
    pub fn slot(&self, pair: [u32; 2]) -> Option<u32> {
        let (i, j) = (pair[0].min(pair[1]), pair[0].max(pair[1]));
        let (start, end) = (self.row_start[i as usize], self.row_start[i as usize + 1]);
        let row = &self.columns[start as usize..end as usize];
        let place = row.binary_search(&j).ok()?;
        Some(start + u32::try_from(place).ok()?)
    }

    /// The diagonal blocks.
    pub fn diagonal(&self, blocks: &mut [DMat3]) {
        for (block, &m) in blocks.iter_mut().zip(&self.masses) {
            *block = DMat3::from_diagonal(DVec3::splat(m));
        }
        for i in 0..self.masses.len() {
            for slot in self.row(i) {
                let pair = self.blocks[slot].to_matrix();
                blocks[i] += pair;
                blocks[self.columns[slot] as usize] += pair;
            }
        }
    }

    /// y = A x.
    pub fn multiply(&self, x: &[DVec3], y: &mut [DVec3]) {
        for (chunk, y) in y.chunks_mut(CHUNK).enumerate() {
            let own = &x[chunk * CHUNK..chunk * CHUNK + y.len()];
            self.multiply_chunk(chunk, own, |row| x[row], y);
        }
    }

    /// The rows of one chunk of y = A x. `own` holds the chunk's part of x, `other` gives the rest.
    pub(super) fn multiply_chunk(
        &self,
        chunk: usize,
        own: &[DVec3],
        other: impl Fn(usize) -> DVec3,
        y: &mut [DVec3],
    ) {
        let first = chunk * CHUNK;
        for k in 0..y.len() {
            y[k] = own[k] * self.masses[first + k];
        }
        for k in 0..y.len() {
            let start = self.row_start[first + k] as usize;
            let row = start..start + self.inside[first + k] as usize;
            let mut sum = DVec3::ZERO;
            for (block, &j) in self.blocks[row.clone()].iter().zip(&self.columns[row]) {
                let j = j as usize - first;
                let product = block.times(own[k] - own[j]);
                sum += product;
                y[j] -= product;
            }
            y[k] += sum;
        }
        for &[i, j, slot] in &self.crossing[chunk] {
            let k = i as usize - first;
            y[k] += self.blocks[slot as usize].times(own[k] - other(j as usize));
        }
    }

    /// Slots of the pairs that begin at a particle.
    #[inline]
    fn row(&self, i: usize) -> std::ops::Range<usize> {
        self.row_start[i] as usize..self.row_start[i + 1] as usize
    }
}

/// A matrix that is being filled with the blocks of one batch of elements.
#[derive(Debug)]
pub struct Assembly<'a> {
    /// The matrix.
    pub matrix: &'a mut PairMatrix,
    /// Slot of each of the batch's pairs, in the batch's order.
    pub slots: &'a [u32],
}

impl Assembly<'_> {
    /// Adds a·1 + e·d dᵀ to the block of a pair. All elements of a pair act along one line: `d` is
    /// the same for each, up to its sign.
    #[inline]
    pub fn add(&mut self, element: usize, block: PairBlock) {
        let sum = &mut self.matrix.blocks[self.slots[element] as usize];
        sum.a += block.a;
        sum.e += block.e;
        sum.d = block.d;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The product and the diagonal against dense ones, on a band that crosses several chunks.
    #[test]
    fn products_agree_with_the_dense_matrix() {
        let rows = 2 * CHUNK + 300;
        let count = u32::try_from(rows).unwrap();
        let pairs: Vec<[u32; 2]> = (0..count)
            .flat_map(|i| [1, 2, 700].into_iter().map(move |step| [i + step, i]))
            .filter(|pair| (pair[0] as usize) < rows)
            .collect();
        let mut matrix = PairMatrix::with_pattern(rows, pairs.iter().copied());
        let slots: Vec<u32> = pairs
            .iter()
            .map(|&pair| matrix.slot(pair).unwrap())
            .collect();
        let masses: Vec<f64> = (0..count).map(|i| 1.0 + f64::from(i).sin().abs()).collect();
        matrix.clear(&masses);
        let mut dense = vec![std::collections::BTreeMap::new(); rows];
        for (i, &m) in masses.iter().enumerate() {
            dense[i].insert(i, DMat3::from_diagonal(DVec3::splat(m)));
        }
        let mut assembly = Assembly {
            matrix: &mut matrix,
            slots: &slots,
        };
        for (element, &[i, j]) in pairs.iter().enumerate() {
            let t = f64::from(i) * 0.7 + f64::from(j);
            let block = PairBlock {
                a: t.sin() + 2.0,
                e: t.cos(),
                d: DVec3::new(1.0, t.sin(), -0.3),
            };
            assembly.add(element, block);
            for (row, column, sign) in [(i, i, 1.0), (j, j, 1.0), (i, j, -1.0), (j, i, -1.0)] {
                *dense[row as usize]
                    .entry(column as usize)
                    .or_insert(DMat3::ZERO) += block.to_matrix() * sign;
            }
        }
        let x: Vec<DVec3> = (0..count)
            .map(|i| DVec3::new(f64::from(i).sin(), 0.5, f64::from(i).cos()))
            .collect();
        let (mut y, mut diagonal) = (vec![DVec3::ZERO; rows], vec![DMat3::ZERO; rows]);
        matrix.multiply(&x, &mut y);
        matrix.diagonal(&mut diagonal);
        for (i, row) in dense.iter().enumerate() {
            let exact: DVec3 = row.iter().map(|(&j, block)| *block * x[j]).sum();
            assert!(
                (exact - y[i]).length() < 1e-10,
                "row {i}: {exact} against {}",
                y[i]
            );
            assert!(
                row[&i].abs_diff_eq(diagonal[i], 1e-12),
                "diagonal block {i}"
            );
        }
        assert_eq!(matrix.slot([0, 5]), None);
    }
}
