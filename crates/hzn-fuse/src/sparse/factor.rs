//! The factor A = L Lᵀ, by faer.

use faer::dyn_stack::{MemBuffer, MemStack, StackReq};
use faer::linalg::cholesky::llt::factor::LltRegularization;
use faer::sparse::linalg::cholesky::simplicial;
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Conj, MatMut, Par};
use nalgebra::DVector;

use super::normal::Normal;
use super::pattern::Pattern;
use crate::error::Error;

/// The factor of a pattern, whose numbers are computed for each matrix again.
#[derive(Debug)]
pub struct Factor<'a> {
    pattern: &'a Pattern,
    pub(super) symbolic: simplicial::SymbolicSimplicialCholesky<usize>,
    pub(super) values: Vec<f64>,
    memory: usize,
}

impl<'a> Factor<'a> {
    /// Finds the places of the numbers of L.
    ///
    /// # Errors
    /// The machine has too little memory.
    pub fn new(pattern: &'a Pattern) -> Result<Self, Error> {
        let (n, count) = (pattern.len(), pattern.row_indices.len());
        let upper = SymbolicSparseColMatRef::new_checked(n, n, &pattern.column_starts, None, &pattern.row_indices);
        let mut memory = MemBuffer::new(StackReq::any_of(&[
            simplicial::prefactorize_symbolic_cholesky_scratch::<usize>(n, count),
            simplicial::factorize_simplicial_symbolic_cholesky_scratch::<usize>(n),
        ]));
        let (mut tree, mut counts) = (vec![0isize; n], vec![0usize; n]);
        let stack = MemStack::new(&mut memory);
        let tree = simplicial::prefactorize_symbolic_cholesky(&mut tree, &mut counts, upper, stack);
        let symbolic = simplicial::factorize_simplicial_symbolic_cholesky(upper, tree, &counts, stack)
            .map_err(|e| Error::failed(format!("the factor of the normal equations: {e:?}")))?;
        let values = vec![0.0; symbolic.len_val()];
        Ok(Self { pattern, symbolic, values, memory: n })
    }

    /// Returns the number of numbers in L.
    pub fn len(&self) -> usize {
        self.values.len()
    }

    /// Returns whether L has no number.
    pub fn is_empty(&self) -> bool {
        self.values.is_empty()
    }

    /// Computes L of A + `damping` diag(A); `None` if the matrix is not positive definite.
    #[must_use]
    pub fn compute(&mut self, normal: &Normal<'_>, damping: f64) -> Option<()> {
        let n = self.memory;
        let mut values = normal.values.clone();
        for end in self.pattern.column_starts.iter().skip(1) {
            values[end - 1] *= 1.0 + damping;
        }
        let symbolic =
            SymbolicSparseColMatRef::new_checked(n, n, &self.pattern.column_starts, None, &self.pattern.row_indices);
        let matrix = SparseColMatRef::new(symbolic, &values);
        let mut memory = MemBuffer::new(simplicial::factorize_simplicial_numeric_llt_scratch::<usize, f64>(n));
        let no_change = LltRegularization::default();
        let stack = MemStack::new(&mut memory);
        simplicial::factorize_simplicial_numeric_llt(&mut self.values, matrix, no_change, &self.symbolic, stack)
            .ok()?;
        self.values.iter().all(|x| x.is_finite()).then_some(())
    }

    /// Returns δ of A δ = −b, in the order of elimination.
    #[must_use]
    pub fn step(&self, normal: &Normal<'_>) -> DVector<f64> {
        let mut step: Vec<f64> = normal.gradient.iter().map(|g| -g).collect();
        let llt = simplicial::SimplicialLltRef::<'_, usize, f64>::new(&self.symbolic, &self.values);
        let n = step.len();
        let columns = MatMut::from_column_major_slice_mut(&mut step, n, 1);
        let mut memory = MemBuffer::new(self.symbolic.solve_in_place_scratch::<f64>(1));
        llt.solve_in_place_with_conj(Conj::No, columns, Par::Seq, MemStack::new(&mut memory));
        DVector::from_vec(step)
    }
}
