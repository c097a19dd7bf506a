//! Whether the told mounts still hold.

use nalgebra::{DMatrix, DVector, Matrix3, Rotation3, Vector3};

use super::adjust::Adjusted;
use crate::quantile::chi2;

/// Sigmas of the limit: told mounts that are right are refused in 0.3 % of the cases.
const SIGMAS: f64 = 2.75;

/// What a flight says about the told mounts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Check {
    /// No turn is significant; false if the flight determines none. [`noticed`] says which would have been.
    Holds(bool),
    /// This head has turned, by this angle and with this 1-sigma, radians, against the others: without it they agree.
    Turned(usize, f64, f64),
    /// The mounts contradict each other, and no single head explains it.
    Contradict,
}

/// Compares adjusted mounts with the told ones. `told_rad2` is the covariance of each told mount about the axes of the
/// rig.
///
/// A head is named only if exactly one exclusion leaves heads that agree: with two heads, nothing says which of them
/// has turned.
pub fn check(adjusted: &Adjusted, told_rad2: &[Matrix3<f64>]) -> Check {
    let all: Vec<usize> = (0..told_rad2.len()).collect();
    let compared = Compared::new(adjusted, told_rad2, &all);
    if compared.agrees() {
        return Check::Holds(!compared.turn.is_empty());
    }
    let without = |k: usize| all.iter().copied().filter(|j| *j != k).collect::<Vec<_>>();
    let mut explaining =
        all.iter().copied().filter(|k| all.len() > 2 && Compared::new(adjusted, told_rad2, &without(*k)).agrees());
    match (explaining.next(), explaining.next()) {
        (Some(k), None) => {
            let others = without(k);
            let part = 1.0 / others.len() as f64;
            let size = 3 * all.len();
            let gain = DMatrix::from_fn(3, size, |axis, i| match (i % 3 == axis, i / 3 == k) {
                (false, _) => 0.0,
                (true, true) => 1.0,
                (true, false) => -part,
            });
            let turn = &gain * turns(adjusted);
            let spread = &gain * with_told(adjusted, told_rad2) * gain.transpose();
            let angle = turn.norm();
            let along = &turn / angle;
            Check::Turned(k, angle, along.dot(&(spread * &along)).max(0.0).sqrt())
        }
        _ => Check::Contradict,
    }
}

fn turns(adjusted: &Adjusted) -> DVector<f64> {
    DVector::from_iterator(3 * adjusted.turns.len(), adjusted.turns.iter().flat_map(|turn| turn.iter().copied()))
}

/// Returns the covariance of the turns, with that of the told mounts.
fn with_told(adjusted: &Adjusted, told_rad2: &[Matrix3<f64>]) -> DMatrix<f64> {
    let mut covariance = adjusted.covariance.clone();
    for (k, told) in told_rad2.iter().enumerate() {
        let mut block = covariance.fixed_view_mut::<3, 3>(3 * k, 3 * k);
        block += told;
    }
    covariance
}

/// The turns of some heads against the first of them, in the directions that the flight determines.
///
/// A turn in any other direction stays at its prior. It would only be one more degree of freedom, in which a turn that
/// is seen could hide.
struct Compared {
    /// From the turns of all heads to the determined ones.
    seen: DMatrix<f64>,
    turn: DVector<f64>,
    spread: DMatrix<f64>,
}

impl Compared {
    fn new(adjusted: &Adjusted, told_rad2: &[Matrix3<f64>], heads: &[usize]) -> Self {
        let (first, others) = heads.split_first().unwrap_or((&0, &[]));
        let relative = DMatrix::from_fn(3 * others.len(), 3 * told_rad2.len(), |i, j| {
            let (own, is_axis) = (others[i / 3], i % 3 == j % 3);
            match (is_axis, j / 3) {
                (true, k) if k == own => 1.0,
                (true, k) if k == *first => -1.0,
                _ => 0.0,
            }
        });
        let eigen = (&relative * &adjusted.covariance * relative.transpose()).symmetric_eigen();
        let is_determined = |i: &usize| adjusted.is_determined(eigen.eigenvalues[*i].max(0.0).sqrt());
        let kept: Vec<usize> = (0..eigen.eigenvalues.len()).filter(is_determined).collect();
        let seen = eigen.eigenvectors.select_columns(&kept).transpose() * relative;
        let (turn, spread) = (&seen * turns(adjusted), &seen * with_told(adjusted, told_rad2) * seen.transpose());
        Self { seen, turn, spread }
    }

    /// Returns the limit of χ².
    fn limit(&self) -> f64 {
        chi2(self.turn.len(), SIGMAS)
    }

    fn agrees(&self) -> bool {
        // Without a covariance there is no contradiction that could be measured.
        let Some(root) = self.spread.clone().cholesky().filter(|_| !self.turn.is_empty()) else { return true };
        self.turn.dot(&root.solve(&self.turn)) <= self.limit()
    }

    /// Returns the turn of one head about one axis of the rig that reaches the limit alone, radians; infinite for an
    /// axis about which the flight says nothing.
    fn noticed_rad(&self, head: usize, axis: &Vector3<f64>) -> f64 {
        let Some(root) = self.spread.clone().cholesky().filter(|_| !self.turn.is_empty()) else { return f64::INFINITY };
        let moved = self.seen.columns(3 * head, 3) * axis;
        (self.limit() / moved.dot(&root.solve(&moved))).sqrt()
    }
}

/// Returns the turn of each head about x, y and z of its camera, radians, with which the check would reach its limit,
/// if nothing else were wrong: half of such turns are noticed, and nearly all that are 1.5 times as large. An axis
/// about which the pictures say nothing has an infinite one.
pub fn noticed(adjusted: &Adjusted, told_rad2: &[Matrix3<f64>]) -> Vec<[f64; 3]> {
    let all: Vec<usize> = (0..told_rad2.len()).collect();
    let compared = Compared::new(adjusted, told_rad2, &all);
    let of_head = |(k, mount): (usize, &Rotation3<f64>)| {
        [Vector3::x(), Vector3::y(), Vector3::z()].map(|axis| compared.noticed_rad(k, &(mount * axis)))
    };
    adjusted.mounts.iter().enumerate().map(of_head).collect()
}
