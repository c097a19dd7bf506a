//! The unknowns that all pictures of an adjustment share: intrinsic parameters, and the bow of the board.

use hzn_core::camera::{Config, Intrinsic, Model};

use super::block::BOW;

/// Maximum number of free parameters: two focal lengths, two coordinates of the principal point, five coefficients, and
/// the bow.
pub(super) const MAX_FREE: usize = 9 + BOW;

/// Free parameters.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Free {
    /// Each entry lists indices into [`Model::intrinsics`]; the parameters of one entry change by the same amount.
    lens: Vec<Vec<usize>>,
    /// Whether the board may be bent.
    bow: bool,
}

impl Free {
    /// No parameter is free: only poses are adjusted.
    pub(crate) fn none() -> Self {
        Self { lens: Vec::new(), bow: false }
    }
    /// The focal lengths alone, with a fixed difference.
    pub(crate) fn focal() -> Self {
        Self { lens: vec![vec![0, 1]], bow: false }
    }
    /// Focal lengths with a fixed difference, and the coefficients.
    pub(crate) fn focal_and_coefficients(model: Model) -> Self {
        let coefficients = (4..model.intrinsics().len()).map(|i| vec![i]);
        Self { lens: [vec![0, 1]].into_iter().chain(coefficients).collect(), bow: false }
    }
    /// All parameters of the model.
    pub(crate) fn all(model: Model) -> Self {
        Self { lens: (0..model.intrinsics().len()).map(|i| vec![i]).collect(), bow: false }
    }
    /// Also the bow of the board.
    pub(crate) fn with_bow(self) -> Self {
        Self { bow: true, ..self }
    }

    /// Returns the number of unknowns.
    pub(crate) fn len(&self) -> usize {
        self.lens.len() + if self.bow { BOW } else { 0 }
    }

    /// Returns the sum of the derivatives of each unknown. The bow comes last.
    pub(super) fn gather(&self, by_intrinsics: &[f64], by_bow: [f64; BOW]) -> [f64; MAX_FREE] {
        let mut gathered = [0.0; MAX_FREE];
        let lens = self.lens.iter().map(|group| group.iter().filter_map(|i| by_intrinsics.get(*i)).sum());
        let bow = by_bow.into_iter().filter(|_| self.bow);
        gathered.iter_mut().zip(lens.chain(bow)).for_each(|(sum, by)| *sum = by);
        gathered
    }

    /// Returns the part of a step that belongs to the bow, mm.
    pub(super) fn bow_step(&self, step: &[f64]) -> [f64; BOW] {
        let at = |k| if self.bow { step.get(self.lens.len() + k).copied().unwrap_or(0.0) } else { 0.0 };
        core::array::from_fn(at)
    }

    /// Returns the lens after a step.
    pub(super) fn moved(&self, lens: &Config, step: &[f64]) -> Config {
        let mut moved = lens.clone();
        let intrinsics: &[Intrinsic] = lens.model.intrinsics();
        for (group, step) in self.lens.iter().zip(step) {
            for which in group.iter().filter_map(|i| intrinsics.get(*i)) {
                moved.set_intrinsic(*which, lens.intrinsic(*which).unwrap_or(0.0) + step);
            }
        }
        moved
    }
}
