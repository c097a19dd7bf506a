//! Which blocks of unknowns errors join, and the order in which they are eliminated.

use std::collections::BTreeSet;

use super::{Places, cholesky};
use crate::error::Error;

/// The places of the numbers of a symmetric matrix of blocks: the upper triangle, in the order of elimination.
#[derive(Debug, Clone)]
pub struct Pattern {
    sizes: Vec<usize>,
    /// The first unknown of each block in the order of elimination.
    starts: Vec<usize>,
    /// For each block its partners that come before it and itself, by their starts, with the place of their first row
    /// in a column of this block.
    rows: Vec<Vec<(usize, usize)>>,
    column_starts: Vec<usize>,
    row_indices: Vec<usize>,
}

/// Returns the order of elimination of the blocks.
fn order(partners: &[BTreeSet<usize>]) -> Result<Vec<usize>, Error> {
    let (mut column_starts, mut row_indices) = (vec![0], Vec::new());
    for (block, others) in partners.iter().enumerate() {
        row_indices.extend(others.range(..=block));
        column_starts.push(row_indices.len());
    }
    cholesky::order(Places { column_starts: &column_starts, row_indices: &row_indices })
}

impl Pattern {
    /// Makes the pattern of blocks with these sizes. `joined` has the blocks of each error.
    ///
    /// # Errors
    /// The machine has too little memory, or hzn was built without the feature `solve`.
    pub fn new<'a>(sizes: &[usize], joined: impl Iterator<Item = &'a [usize]>) -> Result<Self, Error> {
        let mut partners: Vec<BTreeSet<usize>> = (0..sizes.len()).map(|i| BTreeSet::from([i])).collect();
        for blocks in joined {
            for a in blocks {
                if let Some(set) = partners.get_mut(*a) {
                    set.extend(blocks);
                }
            }
        }
        let order = order(&partners)?;
        let mut starts = vec![0; sizes.len()];
        let mut next = 0;
        for &block in &order {
            starts[block] = next;
            next += sizes[block];
        }
        let mut rows = vec![Vec::new(); sizes.len()];
        let (mut column_starts, mut row_indices) = (vec![0], Vec::new());
        for &block in &order {
            let mut before: Vec<usize> =
                partners[block].iter().copied().filter(|other| starts[*other] <= starts[block]).collect();
            before.sort_unstable_by_key(|other| starts[*other]);
            let mut place = 0;
            for other in &before {
                rows[block].push((starts[*other], place));
                place += sizes[*other];
            }
            for column in 0..sizes[block] {
                for other in &before {
                    let end = if *other == block { column + 1 } else { sizes[*other] };
                    row_indices.extend((0..end).map(|i| starts[*other] + i));
                }
                column_starts.push(row_indices.len());
            }
        }
        Ok(Self { sizes: sizes.to_vec(), starts, rows, column_starts, row_indices })
    }

    /// Returns the places of the numbers of the upper triangle.
    pub(super) fn places(&self) -> Places<'_> {
        Places { column_starts: &self.column_starts, row_indices: &self.row_indices }
    }

    /// Returns the number of unknowns.
    pub fn len(&self) -> usize {
        self.column_starts.len() - 1
    }

    /// Returns whether there is no unknown.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Returns the number of blocks.
    pub fn blocks(&self) -> usize {
        self.sizes.len()
    }

    /// Returns the number of unknowns of a block.
    pub fn size(&self, block: usize) -> usize {
        self.sizes.get(block).copied().unwrap_or(0)
    }

    /// Returns the place of the first unknown of a block in the order of elimination.
    pub fn start(&self, block: usize) -> usize {
        self.starts.get(block).copied().unwrap_or(0)
    }

    /// Returns the place of a number of the upper triangle: of row `i` of one block, which is not after the other one,
    /// and of column `j` of the other one.
    pub(super) fn place(&self, (row_block, i): (usize, usize), (block, j): (usize, usize)) -> Option<usize> {
        let rows = self.rows.get(block)?;
        let found = rows.binary_search_by_key(&self.start(row_block), |(start, _)| *start).ok()?;
        Some(self.column_starts.get(self.start(block) + j)? + rows.get(found)?.1 + i)
    }
}
