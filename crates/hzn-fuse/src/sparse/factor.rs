//! The factor A = L Lᵀ.

use nalgebra::DVector;

use super::Places;
use super::cholesky::Lower;
use super::normal::Normal;
use super::pattern::Pattern;
use crate::error::Error;

/// The factor of a pattern, whose numbers are computed for each matrix again.
#[derive(Debug)]
pub struct Factor<'a> {
    pattern: &'a Pattern,
    lower: Lower,
    pub(super) values: Vec<f64>,
}

impl<'a> Factor<'a> {
    /// Finds the places of the numbers of L.
    ///
    /// # Errors
    /// The machine has too little memory, or hzn was built without the feature `solve`.
    pub fn new(pattern: &'a Pattern) -> Result<Self, Error> {
        let lower = Lower::new(pattern.places())?;
        let values = vec![0.0; lower.places().row_indices.len()];
        Ok(Self { pattern, lower, values })
    }

    /// Returns the places of the numbers of L.
    pub(super) fn places(&self) -> Places<'_> {
        self.lower.places()
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
        let upper = self.pattern.places();
        let mut numbers = normal.values.clone();
        for end in upper.column_starts.iter().skip(1) {
            numbers[end - 1] *= 1.0 + damping;
        }
        self.lower.compute(upper, &numbers, &mut self.values)?;
        self.values.iter().all(|x| x.is_finite()).then_some(())
    }

    /// Returns δ of A δ = −b, in the order of elimination.
    #[must_use]
    pub fn step(&self, normal: &Normal<'_>) -> DVector<f64> {
        let mut step: Vec<f64> = normal.gradient.iter().map(|g| -g).collect();
        self.lower.solve(&self.values, &mut step);
        DVector::from_vec(step)
    }
}
