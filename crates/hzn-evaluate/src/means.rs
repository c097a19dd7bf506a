//! Errors of means over consecutive answers.
//!
//! A filter averages many answers. What their errors have in common stays in the mean, so that the covariance of a
//! mean of n answers is common + (covariance − common)/n. With errors that are taken as independent, it is
//! covariance/n.
//!
//! The mean is that of the error vectors in the camera frame, on the plane across the mean axis. While the limb moves
//! through the picture, the common errors turn with it and are partly averaged away, so that the NEES is then smaller.

use nalgebra::{Matrix2, Matrix3, Matrix3x2, Vector3};
use serde::Serialize;

use crate::case::Case;

/// Numbers of consecutive answers whose means are compared with their covariances.
pub const LENGTHS: [usize; 3] = [3, 10, 100];

/// NEES of the means over groups of consecutive answers. The groups do not overlap.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Means {
    /// Number of answers in a group.
    pub answers: usize,
    /// Number of groups. Groups of one flight are not independent of each other.
    pub groups: usize,
    /// Mean NEES with the common part; 2 is ideal.
    pub nees: f64,
    /// Share of the groups whose mean is beyond 3 sigma with the common part; 1.1 % is ideal.
    pub beyond_3_sigma: f64,
    /// Mean NEES if all errors are taken as independent.
    pub nees_if_independent: f64,
}

impl Means {
    /// Evaluates the cases of one body, in order of time. A picture without an answer, without a limb in view or
    /// without a common part ends a run of consecutive answers. A length without any group is left out.
    pub(crate) fn of(cases: &[&Case]) -> Vec<Self> {
        let answers: Vec<Option<Answer>> = cases.iter().map(|case| Answer::new(case)).collect();
        LENGTHS.iter().filter_map(|&length| Self::over(&answers, length)).collect()
    }

    fn over(answers: &[Option<Answer>], length: usize) -> Option<Self> {
        let runs = answers.split(Option::is_none);
        let both: Vec<[f64; 2]> = runs
            .flat_map(|run| run.chunks_exact(length))
            .filter_map(|group| nees(&group.iter().flatten().collect::<Vec<_>>()))
            .collect();
        let groups = both.len();
        let mean = |i: usize| both.iter().map(|x| x[i]).sum::<f64>() / groups as f64;
        let beyond = both.iter().filter(|[with_common, _]| *with_common > 9.0).count();
        (groups > 0).then(|| Self {
            answers: length,
            groups,
            nees: mean(0),
            beyond_3_sigma: beyond as f64 / groups as f64,
            nees_if_independent: mean(1),
        })
    }
}

/// An answer with the numbers that a mean needs.
struct Answer {
    axis: Vector3<f64>,
    /// Error of the axis, rad.
    error: Vector3<f64>,
    covariance: Matrix3<f64>,
    common: Matrix3<f64>,
}

impl Answer {
    fn new(case: &Case) -> Option<Self> {
        let miss = case.miss.filter(|_| case.limb)?;
        let symmetric = |[xx, xy, xz, yy, yz, zz]: [f64; 6]| Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
        let axis = Vector3::from(miss.found.axis).try_normalize(1e-12)?;
        Some(Self {
            axis,
            // The rotation goes from the answer to the truth; the error goes the other way.
            error: axis.cross(&Vector3::from(miss.about_deg.map(f64::to_radians))),
            covariance: symmetric(miss.found.covariance_rad2),
            common: symmetric(miss.found.common_rad2?),
        })
    }
}

/// Returns the mean square of the share of the variance that is common to all answers: that of the eigenvalues of P⁻¹C
/// on the plane across the axis. An answer without a common part counts as independent of the others.
pub(crate) fn common_square(cases: &[&Case]) -> f64 {
    let shares = cases.iter().filter(|c| c.miss.is_some_and(|m| m.nees.is_some())).map(|case| {
        let answer = Answer::new(case)?;
        let across = across(&answer.axis);
        let [whole, common] = [answer.covariance, answer.common].map(|p| across.transpose() * p * across);
        let share = whole.cholesky()?.solve(&common);
        Some((share * share).trace() / 2.0).filter(|x| x.is_finite())
    });
    let shares: Vec<f64> = shares.map(Option::unwrap_or_default).collect();
    shares.iter().sum::<f64>() / shares.len().max(1) as f64
}

/// Returns two unit vectors across an axis, as columns.
fn across(axis: &Vector3<f64>) -> Matrix3x2<f64> {
    let first = axis.cross(&Vector3::ith(axis.iamin(), 1.0)).normalize();
    Matrix3x2::from_columns(&[first, axis.cross(&first)])
}

/// Returns the NEES of the mean error, with the common part and with independent errors; `None` if a covariance is
/// singular.
fn nees(group: &[&Answer]) -> Option<[f64; 2]> {
    let n = group.len() as f64;
    let axis = group.iter().map(|a| a.axis).sum::<Vector3<f64>>().try_normalize(1e-12)?;
    let across = across(&axis);
    let tangent = |pick: fn(&Answer) -> Matrix3<f64>| -> Matrix2<f64> {
        across.transpose() * (group.iter().map(|a| pick(a)).sum::<Matrix3<f64>>() / n) * across
    };
    let error = across.transpose() * (group.iter().map(|a| a.error).sum::<Vector3<f64>>() / n);
    let (whole, common) = (tangent(|a| a.covariance), tangent(|a| a.common));
    let squared = |p: Matrix2<f64>| p.cholesky().map(|c| error.dot(&c.solve(&error))).filter(|x| x.is_finite());
    Some([squared(common + (whole - common) / n)?, squared(whole / n)?])
}
