//! What faer does: the order of elimination, and the factor L of A = L Lᵀ.

use faer::dyn_stack::{MemBuffer, MemStack, StackReq};
use faer::linalg::cholesky::llt::factor::LltRegularization;
use faer::sparse::linalg::amd;
use faer::sparse::linalg::cholesky::simplicial;
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Conj, MatMut, Par};

use super::Places;
use crate::error::Error;

/// Returns the order of elimination: approximate minimum degree.
pub(super) fn order(upper: Places<'_>) -> Result<Vec<usize>, Error> {
    let (n, count) = (columns(upper), upper.row_indices.len());
    let (mut forward, mut backward) = (vec![0; n], vec![0; n]);
    let mut memory = MemBuffer::new(amd::order_scratch::<usize>(n, count));
    amd::order(&mut forward, &mut backward, symbolic(upper), amd::Control::default(), MemStack::new(&mut memory))
        .map_err(|e| Error::failed(format!("the order of the unknowns: {e:?}")))?;
    Ok(forward)
}

/// The places of the numbers of L.
#[derive(Debug)]
pub(super) struct Lower(simplicial::SymbolicSimplicialCholesky<usize>);

impl Lower {
    /// Finds the places for a matrix whose upper triangle has these.
    pub(super) fn new(upper: Places<'_>) -> Result<Self, Error> {
        let (n, count) = (columns(upper), upper.row_indices.len());
        let upper = symbolic(upper);
        let mut memory = MemBuffer::new(StackReq::any_of(&[
            simplicial::prefactorize_symbolic_cholesky_scratch::<usize>(n, count),
            simplicial::factorize_simplicial_symbolic_cholesky_scratch::<usize>(n),
        ]));
        let (mut tree, mut counts) = (vec![0isize; n], vec![0usize; n]);
        let stack = MemStack::new(&mut memory);
        let tree = simplicial::prefactorize_symbolic_cholesky(&mut tree, &mut counts, upper, stack);
        simplicial::factorize_simplicial_symbolic_cholesky(upper, tree, &counts, stack)
            .map(Self)
            .map_err(|e| Error::failed(format!("the factor of the normal equations: {e:?}")))
    }

    /// Returns the places of the numbers.
    pub(super) fn places(&self) -> Places<'_> {
        Places { column_starts: self.0.col_ptr(), row_indices: self.0.row_idx() }
    }

    /// Computes L from the numbers of the upper triangle; `None` if the matrix is not positive definite.
    pub(super) fn compute(&self, upper: Places<'_>, numbers: &[f64], lower: &mut [f64]) -> Option<()> {
        let matrix = SparseColMatRef::new(symbolic(upper), numbers);
        let needed = simplicial::factorize_simplicial_numeric_llt_scratch::<usize, f64>(columns(upper));
        let mut memory = MemBuffer::new(needed);
        let (no_change, stack) = (LltRegularization::default(), MemStack::new(&mut memory));
        simplicial::factorize_simplicial_numeric_llt(lower, matrix, no_change, &self.0, stack).ok()?;
        Some(())
    }

    /// Replaces b by A⁻¹ b.
    pub(super) fn solve(&self, lower: &[f64], b: &mut [f64]) {
        let llt = simplicial::SimplicialLltRef::<'_, usize, f64>::new(&self.0, lower);
        let n = b.len();
        let columns = MatMut::from_column_major_slice_mut(b, n, 1);
        let mut memory = MemBuffer::new(self.0.solve_in_place_scratch::<f64>(1));
        llt.solve_in_place_with_conj(Conj::No, columns, Par::Seq, MemStack::new(&mut memory));
    }
}

fn columns(places: Places<'_>) -> usize {
    places.column_starts.len() - 1
}

fn symbolic(places: Places<'_>) -> SymbolicSparseColMatRef<'_, usize> {
    let n = columns(places);
    SymbolicSparseColMatRef::new_checked(n, n, places.column_starts, None, places.row_indices)
}
