//! The intrinsic parameters that an adjustment may change.

use hzn_core::camera::{Config, Intrinsic, Model};

/// Maximum number of free parameters: two focal lengths, two coordinates of the principal point, five coefficients.
pub(super) const MAX_FREE: usize = 9;

/// Free parameters. Each entry lists indices into [`Model::intrinsics`]; the parameters of one entry change by the same
/// amount.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Free(Vec<Vec<usize>>);

impl Free {
    /// No parameter is free: only poses are adjusted.
    pub(crate) fn none() -> Self {
        Self(Vec::new())
    }
    /// The focal lengths alone, with a fixed difference.
    pub(crate) fn focal() -> Self {
        Self(vec![vec![0, 1]])
    }
    /// Focal lengths with a fixed difference, and the coefficients.
    pub(crate) fn focal_and_coefficients(model: Model) -> Self {
        Self([vec![0, 1]].into_iter().chain((4..model.intrinsics().len()).map(|i| vec![i])).collect())
    }
    /// All parameters of the model.
    pub(crate) fn all(model: Model) -> Self {
        Self((0..model.intrinsics().len()).map(|i| vec![i]).collect())
    }

    /// Returns the number of unknowns.
    pub(crate) fn len(&self) -> usize {
        self.0.len()
    }

    /// Returns the sum of the derivatives of each unknown.
    pub(super) fn gather(&self, by_intrinsics: &[f64]) -> [f64; MAX_FREE] {
        let mut gathered = [0.0; MAX_FREE];
        for (sum, group) in gathered.iter_mut().zip(&self.0) {
            *sum = group.iter().filter_map(|i| by_intrinsics.get(*i)).sum();
        }
        gathered
    }

    /// Returns the lens after a step.
    pub(super) fn moved(&self, lens: &Config, step: &[f64]) -> Config {
        let mut moved = lens.clone();
        let intrinsics: &[Intrinsic] = lens.model.intrinsics();
        for (group, step) in self.0.iter().zip(step) {
            for which in group.iter().filter_map(|i| intrinsics.get(*i)) {
                moved.set_intrinsic(*which, lens.intrinsic(*which).unwrap_or(0.0) + step);
            }
        }
        moved
    }
}
