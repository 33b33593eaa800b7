//! The matrix of a set of particles that act on each other in pairs.

use super::CHUNK;
use super::pairs::{Block, Pairs};
use glam::{DMat3, DVec3};

/// A symmetric matrix of 3 × 3 blocks, one row a particle: a mass on the diagonal, and for every pair
/// of particles (i, j) a block B, added to (i, i), taken from (i, j), and likewise its transpose for
/// (j, j) and (j, i).
///
/// Every law without an outer hold is of this form: moving all particles alike changes no force, so
/// that a diagonal block is minus the sum of the others in its row. Springs and dampers act along a
/// line and need [`LineBlock`]s, 25 operations and 44 bytes a pair in a product; hinges need whole
/// matrices, 39 operations and 76 bytes. A pair that needs both has the whole one.
///
/// The pattern is fixed; [`PairMatrix::clear`] and [`Assembly`] fill it anew each step.
#[derive(Clone, Debug)]
pub struct PairMatrix {
    /// Multiple of the identity at (i, i).
    pub masses: Vec<f64>,
    lines: Pairs<LineBlock>,
    whole: Pairs<DMat3>,
}

/// The particles between which a law has blocks, in the order in which it fills them.
#[derive(Clone, Debug, PartialEq)]
pub enum Pattern {
    /// Blocks a·1 + e·d dᵀ.
    Lines(Vec<[u32; 2]>),
    /// Any blocks.
    Whole(Vec<[u32; 2]>),
}

impl Pattern {
    fn pairs(&self) -> &[[u32; 2]] {
        match self {
            Self::Lines(pairs) | Self::Whole(pairs) => pairs,
        }
    }
}

/// Where the block of a pair is stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Slot {
    index: u32,
    /// Whether it is a whole matrix.
    whole: bool,
    /// Whether it is stored for (j, i).
    flipped: bool,
}

/// B = a·1 + e·d dᵀ.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LineBlock {
    /// Factor of the identity.
    pub a: f64,
    /// Factor of d dᵀ.
    pub e: f64,
    /// The line along which the pair acts.
    pub d: DVec3,
}

/// u vᵀ.
#[inline]
pub fn outer(u: DVec3, v: DVec3) -> DMat3 {
    DMat3::from_cols(u * v.x, u * v.y, u * v.z)
}

impl LineBlock {
    /// B as a matrix.
    pub fn to_matrix(self) -> DMat3 {
        outer(self.d * self.e, self.d) + DMat3::from_diagonal(DVec3::splat(self.a))
    }
}

impl Block for LineBlock {
    const ZERO: Self = Self {
        a: 0.0,
        e: 0.0,
        d: DVec3::ZERO,
    };

    #[inline]
    fn times(&self, v: DVec3) -> DVec3 {
        v * self.a + self.d * (self.e * self.d.dot(v))
    }

    #[inline]
    fn times_both(&self, v: DVec3) -> [DVec3; 2] {
        let product = self.times(v);
        [product, product]
    }

    fn matrix(&self) -> DMat3 {
        self.to_matrix()
    }
}

impl Block for DMat3 {
    const ZERO: Self = Self::ZERO;

    #[inline]
    fn times(&self, v: DVec3) -> DVec3 {
        *self * v
    }

    #[inline]
    fn times_both(&self, v: DVec3) -> [DVec3; 2] {
        let transposed = DVec3::new(self.x_axis.dot(v), self.y_axis.dot(v), self.z_axis.dot(v));
        [*self * v, transposed]
    }

    fn matrix(&self) -> DMat3 {
        *self
    }
}

impl PairMatrix {
    /// An empty matrix of `rows` rows with room for the blocks of `patterns`, pairs in any order,
    /// repeated or not.
    pub fn with_patterns(rows: usize, patterns: &[Pattern]) -> Self {
        let sorted = |wanted: fn(&Pattern) -> bool| {
            let pairs = patterns.iter().filter(|p| wanted(p));
            let mut pairs: Vec<[u32; 2]> = pairs
                .flat_map(Pattern::pairs)
                .map(|&[i, j]| [i.min(j), i.max(j)])
                .collect();
            pairs.sort_unstable();
            pairs.dedup();
            pairs
        };
        let whole = sorted(|pattern| matches!(pattern, Pattern::Whole(_)));
        let mut lines = sorted(|pattern| matches!(pattern, Pattern::Lines(_)));
        lines.retain(|pair| whole.binary_search(pair).is_err());
        Self {
            masses: vec![0.0; rows],
            lines: Pairs::with_pattern(rows, &lines),
            whole: Pairs::with_pattern(rows, &whole),
        }
    }

    /// Sets every block to zero, and the masses on the diagonal.
    pub fn clear(&mut self, masses: &[f64]) {
        self.masses.copy_from_slice(masses);
        self.lines.blocks.fill(LineBlock::ZERO);
        self.whole.blocks.fill(DMat3::ZERO);
    }

    /// Where the block of a pair is stored; `None` when the pattern doesn't have it.
    pub fn slot(&self, [i, j]: [u32; 2]) -> Option<Slot> {
        let (low, high) = (i.min(j), i.max(j));
        let found = |index, whole| Slot {
            index,
            whole,
            flipped: i > j,
        };
        let whole = self.whole.find(low, high).map(|index| found(index, true));
        whole.or_else(|| self.lines.find(low, high).map(|index| found(index, false)))
    }

    /// The slots of a law's pairs, in its order.
    pub fn slots(&self, pattern: &Pattern) -> Vec<Slot> {
        let pairs = pattern.pairs().iter();
        pairs.filter_map(|&pair| self.slot(pair)).collect()
    }

    /// Every pair i < j of the pattern: those of lines, then those of whole blocks.
    pub fn pairs(&self) -> Vec<[u32; 2]> {
        self.lines
            .each_pair()
            .chain(self.whole.each_pair())
            .collect()
    }

    /// The block −B at (i, j) of every pair, in the order of [`PairMatrix::pairs`].
    pub fn off_diagonal(&self) -> impl Iterator<Item = DMat3> + '_ {
        let lines = self.lines.blocks.iter().map(|block| -block.matrix());
        lines.chain(self.whole.blocks.iter().map(|block| -*block))
    }

    /// Multiplications of an iteration of conjugate gradients: the product, and 60 a row besides.
    pub fn operations(&self) -> f64 {
        let [lines, whole] = [self.lines.blocks.len(), self.whole.blocks.len()];
        #[expect(clippy::cast_precision_loss, reason = "a rough figure")]
        let [lines, whole, rows] = [lines, whole, self.masses.len()].map(|n| n as f64);
        25.0 * lines + 39.0 * whole + 60.0 * rows
    }

    /// The diagonal blocks.
    pub fn diagonal(&self, blocks: &mut [DMat3]) {
        for (block, &m) in blocks.iter_mut().zip(&self.masses) {
            *block = DMat3::from_diagonal(DVec3::splat(m));
        }
        self.lines.add_diagonal(blocks);
        self.whole.add_diagonal(blocks);
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
        let masses = &self.masses[chunk * CHUNK..][..y.len()];
        for (y, (&x, &m)) in y.iter_mut().zip(own.iter().zip(masses)) {
            *y = x * m;
        }
        self.lines.add_product(chunk, own, &other, y);
        self.whole.add_product(chunk, own, &other, y);
    }
}

/// A matrix that is being filled with the blocks of one batch of elements.
#[derive(Debug)]
pub struct Assembly<'a> {
    /// The matrix.
    pub matrix: &'a mut PairMatrix,
    /// Slot of each of the batch's pairs, in the batch's order.
    pub slots: &'a [Slot],
}

impl Assembly<'_> {
    /// Adds a·1 + e·d dᵀ to the block of a pair. All elements of a pair act along one line: `d` is
    /// the same for each, up to its sign.
    #[inline]
    pub fn add(&mut self, pair: usize, block: LineBlock) {
        let slot = self.slots[pair];
        if slot.whole {
            self.matrix.whole.blocks[slot.index as usize] += block.to_matrix();
        } else {
            let sum = &mut self.matrix.lines.blocks[slot.index as usize];
            sum.a += block.a;
            sum.e += block.e;
            sum.d = block.d;
        }
    }

    /// Adds B to the whole block of a pair (i, j) as the law listed it: (i, j) itself becomes −B.
    #[inline]
    pub fn add_whole(&mut self, pair: usize, block: DMat3) {
        let slot = self.slots[pair];
        let block = if slot.flipped {
            block.transpose()
        } else {
            block
        };
        self.matrix.whole.blocks[slot.index as usize] += block;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeMap;

    const ROWS: usize = 2 * CHUNK + 300;

    type Dense = Vec<BTreeMap<usize, DMat3>>;

    /// Pairs at some distances, in either order, some of which cross chunks.
    fn band(steps: [u32; 3]) -> Vec<[u32; 2]> {
        let count = u32::try_from(ROWS).unwrap();
        (0..count)
            .flat_map(|i| steps.into_iter().map(move |step| [i + step, i]))
            .filter(|pair| (pair[0] as usize) < ROWS)
            .map(|[j, i]| if (i / 3) % 2 == 0 { [j, i] } else { [i, j] })
            .collect()
    }

    fn add_dense(dense: &mut Dense, [i, j]: [u32; 2], block: DMat3) {
        let flipped = block.transpose();
        for (row, column, block) in [
            (i, i, block),
            (j, j, flipped),
            (i, j, -block),
            (j, i, -flipped),
        ] {
            *dense[row as usize]
                .entry(column as usize)
                .or_insert(DMat3::ZERO) += block;
        }
    }

    /// A matrix of lines and whole blocks, which share some pairs, and the same as a dense one.
    fn filled() -> (PairMatrix, Dense) {
        let (line_pairs, whole_pairs) = (band([1, 2, 700]), band([1, 3, 900]));
        let patterns = [
            Pattern::Lines(line_pairs.clone()),
            Pattern::Whole(whole_pairs.clone()),
        ];
        let mut matrix = PairMatrix::with_patterns(ROWS, &patterns);
        let masses: Vec<f64> = (0..ROWS).map(|i| 1.0 + (i as f64).sin().abs()).collect();
        matrix.clear(&masses);
        let diagonal =
            |(i, &m): (usize, &f64)| BTreeMap::from([(i, DMat3::from_diagonal(DVec3::splat(m)))]);
        let mut dense: Dense = masses.iter().enumerate().map(diagonal).collect();
        let [lines, wholes] = patterns.map(|pattern| matrix.slots(&pattern));
        for (element, &[i, j]) in line_pairs.iter().enumerate() {
            let t = f64::from(i.min(j)) * 0.7 + f64::from(i.max(j));
            let block = LineBlock {
                a: t.sin() + 2.0,
                e: t.cos(),
                d: DVec3::new(1.0, t.sin(), -0.3),
            };
            let (matrix, slots) = (&mut matrix, &lines[..]);
            Assembly { matrix, slots }.add(element, block);
            add_dense(&mut dense, [i, j], block.to_matrix());
        }
        for (element, &[i, j]) in whole_pairs.iter().enumerate() {
            let t = f64::from(i) * 0.3 + f64::from(j);
            let block = DMat3::from_cols(
                DVec3::new(t.sin(), 0.5, -0.2),
                DVec3::new(0.1, t.cos(), 0.7),
                DVec3::new(0.4, -0.6, 1.0),
            );
            let (matrix, slots) = (&mut matrix, &wholes[..]);
            Assembly { matrix, slots }.add_whole(element, block);
            add_dense(&mut dense, [i, j], block);
        }
        (matrix, dense)
    }

    #[test]
    fn products_agree_with_the_dense_matrix() {
        let (matrix, dense) = filled();
        let x: Vec<DVec3> = (0..ROWS)
            .map(|i| DVec3::new((i as f64).sin(), 0.5, (i as f64).cos()))
            .collect();
        let mut y = vec![DVec3::ZERO; ROWS];
        matrix.multiply(&x, &mut y);
        for (i, row) in dense.iter().enumerate() {
            let exact: DVec3 = row.iter().map(|(&j, block)| *block * x[j]).sum();
            let error = (exact - y[i]).length();
            assert!(error < 1e-10, "row {i}: {exact} against {}", y[i]);
        }
    }

    #[test]
    fn blocks_agree_with_the_dense_matrix() {
        let (matrix, dense) = filled();
        let mut diagonal = vec![DMat3::ZERO; ROWS];
        matrix.diagonal(&mut diagonal);
        for (i, row) in dense.iter().enumerate() {
            assert!(
                row[&i].abs_diff_eq(diagonal[i], 1e-12),
                "diagonal block {i}"
            );
        }
        for ([i, j], block) in matrix.pairs().into_iter().zip(matrix.off_diagonal()) {
            assert!(dense[i as usize][&(j as usize)].abs_diff_eq(block, 1e-12));
        }
        assert_eq!(matrix.slot([0, 5]), None);
    }
}
