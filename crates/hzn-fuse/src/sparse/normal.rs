//! The normal equations of linearised errors.

use nalgebra::{DMatrix, DVector};

use super::pattern::Pattern;

/// An error near an estimate: `error` + Σ `derivative` δ, with the covariance 1.
#[derive(Debug, Clone)]
pub struct Linear {
    /// The error at the estimate over its sigma.
    pub error: DVector<f64>,
    /// The derivatives by the blocks of unknowns that it depends on.
    pub derivatives: Vec<(usize, DMatrix<f64>)>,
}

impl Linear {
    /// Returns the error with the weight of a robust loss.
    #[must_use]
    pub fn weighted(mut self, weight: f64) -> Self {
        let root = weight.sqrt();
        self.error *= root;
        self.derivatives.iter_mut().for_each(|(_, matrix)| *matrix *= root);
        self
    }
}

/// The normal equations A δ = −b.
#[derive(Debug, Clone)]
pub struct Normal<'a> {
    pub(super) pattern: &'a Pattern,
    /// The numbers of A at the places of the pattern.
    pub(super) values: Vec<f64>,
    /// b in the order of elimination.
    pub(super) gradient: Vec<f64>,
}

impl<'a> Normal<'a> {
    /// Makes the equations of no error.
    pub fn new(pattern: &'a Pattern) -> Self {
        Self { pattern, values: vec![0.0; pattern.places().row_indices.len()], gradient: vec![0.0; pattern.len()] }
    }

    /// Adds an error. The pattern must join its blocks.
    pub fn add(&mut self, linear: &Linear) {
        let start = |block: usize| self.pattern.start(block);
        for (a, by_a) in &linear.derivatives {
            let gradient = by_a.tr_mul(&linear.error);
            for (i, g) in gradient.iter().enumerate() {
                self.gradient[start(*a) + i] += g;
            }
            for (b, by_b) in linear.derivatives.iter().filter(|(b, _)| start(*a) <= start(*b)) {
                let product = by_a.tr_mul(by_b);
                for j in 0..product.ncols() {
                    let Some(first) = self.pattern.place((*a, 0), (*b, j)) else { continue };
                    let rows = if a == b { j + 1 } else { product.nrows() };
                    for i in 0..rows {
                        self.values[first + i] += product[(i, j)];
                    }
                }
            }
        }
    }

    /// Returns the diagonal of A in the order of elimination.
    pub fn diagonal(&self) -> Vec<f64> {
        self.pattern.places().column_starts.iter().skip(1).map(|end| self.values[end - 1]).collect()
    }
}
