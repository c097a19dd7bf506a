//! The covariance of a lens between pictures.
//!
//! The errors of the corners of one picture are not independent: blur, a bent board, or a lens that focuses again shift
//! them together. The covariance of least squares counts them as independent, and is too small then. The pictures
//! themselves are independent, so that their disagreement shows how well they determine the lens.
//!
//! The covariance is V = A⁻¹ (Σ gᵢ gᵢᵀ) A⁻¹ (Liang & Zeger 1986, with pictures as clusters). A is the information
//! matrix of all pictures, Aᵢ that of picture i, and gᵢ the gradient of picture i, all with the poses eliminated. A
//! picture pulls the lens towards itself and so reduces its own gradient. With independent errors of 1 px, the
//! covariance of gᵢ is therefore not Aᵢ but Aᵢ − Aᵢ A⁻¹ Aᵢ. In units in which A is the identity, gᵢ is divided by
//! (1 − Aᵢ)^½, which restores Aᵢ (Bell & McCaffrey 2002). The factor n/(n − 1) would do the same if all of the n
//! pictures saw the same and the lens had one unknown; with 10 to 30 pictures and 8 unknowns it is too small.
//!
//! The number of pictures n is often not much larger than the number of unknowns. V is then nearly singular: some
//! combination of the unknowns has by accident a variance of nearly 0, and another one a variance that is too large.
//! V is therefore shrunk towards a multiple of the covariance of least squares by the amount that Ledoit & Wolf 2004
//! derive from the scatter of its summands. In no direction is the variance smaller than by least squares.

use nalgebra::{DMatrix, DVector, SymmetricEigen};

use crate::adjust::Adjusted;

/// Smallest number of pictures whose disagreement says something: two have one degree of freedom for all unknowns.
const MIN_PICTURES: usize = 3;

/// Largest share of a picture in the information about some combination of the unknowns. Beyond it, the other pictures
/// do not determine the combination, and nothing can disagree about it.
const MAX_SHARE: f64 = 1.0 - 1e-9;

/// The covariance between pictures.
pub(crate) struct Between {
    /// As the pictures give it.
    pub(crate) scatter: DMatrix<f64>,
    /// The same, and in no direction smaller than the covariance of least squares.
    pub(crate) covariance: DMatrix<f64>,
}

/// Returns the covariance between pictures. `alone` is that of least squares for coordinates with this variance. `None`
/// with fewer than three pictures.
pub(crate) fn between_pictures(adjusted: &Adjusted, alone: &DMatrix<f64>, variance_px2: f64) -> Option<Between> {
    if adjusted.reduced.len() < MIN_PICTURES {
        return None;
    }
    // In units in which the covariance of least squares is the identity: C = L Lᵀ = σ² A⁻¹.
    let root = alone.clone().cholesky()?.unpack();
    let step = |(of_picture, gradient): &(DMatrix<f64>, DVector<f64>)| {
        let share = SymmetricEigen::new(root.transpose() * of_picture * &root / variance_px2);
        let factor = share.eigenvalues.map(|share| if share < MAX_SHARE { (1.0 - share).sqrt().recip() } else { 0.0 });
        let gradient = share.eigenvectors.transpose() * (root.transpose() * gradient / variance_px2);
        &share.eigenvectors * gradient.component_mul(&factor)
    };
    let steps: Vec<DVector<f64>> = adjusted.reduced.iter().map(step).collect();
    let shrunk = shrink(&steps);
    let eigen = SymmetricEigen::new(shrunk.clone());
    let lifted = DMatrix::from_diagonal(&eigen.eigenvalues.map(|value| value.max(1.0)));
    let lifted = &eigen.eigenvectors * lifted * eigen.eigenvectors.transpose();
    let back = |matrix: &DMatrix<f64>| &root * matrix * root.transpose();
    Some(Between { scatter: back(&shrunk), covariance: back(&lifted) })
}

/// Returns Σ s sᵀ, shrunk towards a multiple of the identity (Ledoit & Wolf 2004, section 3.3).
fn shrink(steps: &[DVector<f64>]) -> DMatrix<f64> {
    let (size, n) = (steps.first().map_or(0, DVector::len), steps.len() as f64);
    let raw = steps.iter().fold(DMatrix::zeros(size, size), |sum, s| sum + s * s.transpose());
    let target = DMatrix::identity(size, size) * (raw.trace() / size as f64);
    let distance = (&raw - &target).norm_squared();
    let of_one = |s: &DVector<f64>| (s * s.transpose() * n - &raw).norm_squared();
    let error = steps.iter().map(of_one).sum::<f64>() / (n * n);
    let part = if distance > error { error / distance } else { 1.0 };
    target * part + raw * (1.0 - part)
}
