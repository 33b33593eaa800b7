//! Blocks of one kind for pairs of particles, row by row.

use super::CHUNK;
use glam::{DMat3, DVec3};

/// A 3 × 3 block B of a pair.
pub(super) trait Block: Copy {
    /// No block.
    const ZERO: Self;

    /// B v.
    fn times(&self, v: DVec3) -> DVec3;

    /// B v and Bᵀ v.
    fn times_both(&self, v: DVec3) -> [DVec3; 2];

    /// B as a matrix.
    fn matrix(&self) -> DMat3;
}

/// Blocks of pairs i < j: B at (i, i), Bᵀ at (j, j), −B at (i, j), −Bᵀ at (j, i).
#[derive(Clone, Debug, Default)]
pub(super) struct Pairs<B> {
    /// Where each row's pairs begin; one more entry than rows.
    row_start: Vec<u32>,
    /// The other particle j > i of each pair.
    columns: Vec<u32>,
    /// The block of each pair.
    pub(super) blocks: Vec<B>,
    /// How many of a row's pairs, its first, end in the row's own chunk.
    inside: Vec<u32>,
    /// Per chunk: the pairs that cross its border. Each such pair stands in two lists.
    crossing: Vec<Vec<Crossing>>,
}

/// A pair that crosses the border of a chunk, seen from the row inside.
#[derive(Clone, Copy, Debug)]
struct Crossing {
    row: u32,
    other: u32,
    slot: u32,
}

impl<B: Block> Pairs<B> {
    /// Room for the blocks of sorted pairs i < j without repetition.
    pub(super) fn with_pattern(rows: usize, pairs: &[[u32; 2]]) -> Self {
        let mut row_start = vec![0_u32; rows + 1];
        for &[i, _] in pairs {
            row_start[i as usize + 1] += 1;
        }
        for i in 0..rows {
            row_start[i + 1] += row_start[i];
        }
        let mut crossing = vec![Vec::new(); rows.div_ceil(CHUNK)];
        let mut inside = vec![0; rows];
        for (slot, &[i, j]) in (0_u32..).zip(pairs) {
            let [chunk_i, chunk_j] = [i, j].map(|row| row as usize / CHUNK);
            if chunk_i == chunk_j {
                inside[i as usize] += 1;
            } else {
                for (chunk, row, other) in [(chunk_i, i, j), (chunk_j, j, i)] {
                    crossing[chunk].push(Crossing { row, other, slot });
                }
            }
        }
        Self {
            row_start,
            columns: pairs.iter().map(|pair| pair[1]).collect(),
            blocks: vec![B::ZERO; pairs.len()],
            inside,
            crossing,
        }
    }

    /// Where the block of a pair i < j is stored.
    pub(super) fn find(&self, i: u32, j: u32) -> Option<u32> {
        let (start, end) = (self.row_start[i as usize], self.row_start[i as usize + 1]);
        let row = &self.columns[start as usize..end as usize];
        let place = row.binary_search(&j).ok()?;
        Some(start + u32::try_from(place).ok()?)
    }

    /// The pairs, in the order of their blocks.
    pub(super) fn each_pair(&self) -> impl Iterator<Item = [u32; 2]> + '_ {
        let rows = (0_u32..).zip(self.row_start.windows(2));
        rows.flat_map(|(i, bounds)| {
            let columns = &self.columns[bounds[0] as usize..bounds[1] as usize];
            columns.iter().map(move |&j| [i, j])
        })
    }

    /// Adds what the pairs put on the diagonal.
    pub(super) fn add_diagonal(&self, blocks: &mut [DMat3]) {
        for ([i, j], block) in self.each_pair().zip(&self.blocks) {
            let block = block.matrix();
            blocks[i as usize] += block;
            blocks[j as usize] += block.transpose();
        }
    }

    /// Adds the rows of one chunk of the product with x. `own` holds the chunk's part of x, `other`
    /// gives the rest.
    #[inline]
    pub(super) fn add_product(
        &self,
        chunk: usize,
        own: &[DVec3],
        other: &impl Fn(usize) -> DVec3,
        y: &mut [DVec3],
    ) {
        if self.blocks.is_empty() {
            return;
        }
        let first = chunk * CHUNK;
        for k in 0..y.len() {
            let start = self.row_start[first + k] as usize;
            let row = start..start + self.inside[first + k] as usize;
            let mut sum = DVec3::ZERO;
            for (block, &j) in self.blocks[row.clone()].iter().zip(&self.columns[row]) {
                let j = j as usize - first;
                let [here, there] = block.times_both(own[k] - own[j]);
                sum += here;
                y[j] -= there;
            }
            y[k] += sum;
        }
        for &Crossing {
            row,
            other: j,
            slot,
        } in &self.crossing[chunk]
        {
            let k = row as usize - first;
            let apart = own[k] - other(j as usize);
            let block = &self.blocks[slot as usize];
            y[k] += if row < j {
                block.times(apart)
            } else {
                block.times_both(apart)[1]
            };
        }
    }
}
