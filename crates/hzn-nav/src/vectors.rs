//! Attitude from directions: TRIAD, and Wahba's problem by Davenport's q method.

use nalgebra::{Matrix3, Matrix4, Rotation3, SymmetricEigen, UnitQuaternion, Vector3};

use crate::frames::{Covariance, Fixed, Rotation, Vector, Vehicle};

/// Smallest angle between two directions, in radians (2°). A smaller one leaves the rotation about them undetermined:
/// the error about them is that of the second direction over the sine of the angle, so it is 29 times as large at 2°.
pub const MIN_SEPARATION_RAD: f64 = 2.0 * core::f64::consts::PI / 180.0;

/// A direction that is known in two frames: that of the vehicle, and a reference frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Direction<V = Vehicle, R = Fixed> {
    /// Unit vector in the frame of the vehicle.
    pub vehicle: Vector<V>,
    /// Unit vector in the reference frame.
    pub reference: Vector<R>,
    /// 1-sigma of the angle between the two in each axis across, in radians; above 0.
    pub sigma_rad: f64,
}

/// Returns the attitude (vehicle to reference) from two directions. The first direction is met exactly, so it should be
/// the more accurate one; the second gives the rotation about the first. `None` if the directions are closer than
/// [`MIN_SEPARATION_RAD`] to each other or to opposite directions, in either frame.
///
/// Source: Black 1964.
///
/// ```
/// use hzn_nav::frames::{Fixed, Vector, Vehicle};
/// use hzn_nav::vectors::{Direction, triad};
///
/// // The vehicle's z axis points to nadir, which is −x of the Earth here, and its x axis to the Sun in the north.
/// let nadir = Direction::<Vehicle, Fixed> {
///     vehicle: Vector::new(0.0, 0.0, 1.0),
///     reference: Vector::new(-1.0, 0.0, 0.0),
///     sigma_rad: 1e-3,
/// };
/// let sun = Direction { vehicle: Vector::new(1.0, 0.0, 0.0), reference: Vector::new(0.0, 0.0, 1.0), sigma_rad: 2e-3 };
/// let attitude = triad(&nadir, &sun).ok_or("the directions are too close")?;
/// let east = attitude * Vector::new(0.0, 1.0, 0.0);
/// assert!((east - Vector::new(0.0, 1.0, 0.0)).norm() < 1e-15);
/// # Ok::<(), &str>(())
/// ```
pub fn triad<V, R>(first: &Direction<V, R>, second: &Direction<V, R>) -> Option<Rotation<V, R>> {
    // Both frames get their base in the same way, so that the product of the bases is a rotation.
    let base = |a: &Vector3<f64>, b: &Vector3<f64>| {
        let t1 = a.try_normalize(0.0)?;
        let across = t1.cross(&b.try_normalize(0.0)?);
        // The sine of the angle is the length of the product, so that its length is the test of the separation.
        let t2 = across.try_normalize(libm::sin(MIN_SEPARATION_RAD))?;
        Some(Matrix3::from_columns(&[t1, t2, t1.cross(&t2)]))
    };
    let reference = base(first.reference.as_inner(), second.reference.as_inner())?;
    let vehicle = base(first.vehicle.as_inner(), second.vehicle.as_inner())?;
    let rotation = Rotation3::from_matrix_unchecked(reference * vehicle.transpose());
    let attitude = Rotation::from(UnitQuaternion::from_rotation_matrix(&rotation));
    attitude.is_finite().then_some(attitude)
}

/// An attitude with its covariance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wahba<V = Vehicle, R = Fixed> {
    /// Attitude (vehicle to reference).
    pub attitude: Rotation<V, R>,
    /// Covariance of the rotation vector from the estimate to the truth, in rad².
    pub covariance_rad2: Covariance<R>,
    /// Sum of the squared misfits over their variances.
    pub chi2: f64,
}

/// Returns the attitude (vehicle to reference) that fits all directions best, with weights 1/σ² (Wahba's problem, by
/// Davenport's q method). `None` with fewer than two directions, or if they do not determine the rotation about them.
///
/// ```
/// use hzn_nav::frames::{Fixed, Vector, Vehicle};
/// use hzn_nav::vectors::{Direction, davenport};
///
/// let same = |x, y, z| Direction::<Vehicle, Fixed> {
///     vehicle: Vector::new(x, y, z),
///     reference: Vector::new(x, y, z),
///     sigma_rad: 1e-3,
/// };
/// let found = davenport(&[same(1.0, 0.0, 0.0), same(0.0, 1.0, 0.0)]).ok_or("undetermined")?;
/// // Each direction measures the two axes across it, so z is measured twice.
/// let variances = found.covariance_rad2.as_inner().diagonal();
/// assert!((variances.x - 1e-6).abs() < 1e-12 && (variances.z - 0.5e-6).abs() < 1e-12);
/// assert!(found.chi2 < 1e-12);
/// # Ok::<(), &str>(())
/// ```
pub fn davenport<V, R>(directions: &[Direction<V, R>]) -> Option<Wahba<V, R>> {
    if directions.len() < 2 {
        return None;
    }
    let (mut b, mut information, mut total) = (Matrix3::zeros(), Matrix3::zeros(), 0.0);
    for d in directions {
        let weight = 1.0 / (d.sigma_rad * d.sigma_rad);
        let vehicle = d.vehicle.try_normalize(0.0)?.into_inner();
        let reference = d.reference.try_normalize(0.0)?.into_inner();
        b += reference * vehicle.transpose() * weight;
        // A direction says nothing about the rotation about itself, so its axis has no information.
        information += (Matrix3::identity() - reference * reference.transpose()) * weight;
        total += weight;
    }
    if !(total > 0.0 && total.is_finite()) {
        return None;
    }
    // The weights get the sum 1, so that the numbers of Davenport's matrix are near 1, whatever the sigmas are.
    let b = b / total;
    let attitude = Rotation::from(best_rotation(&b)?);
    // The weakest axis must be known to better than the separation of two directions would allow. Two directions of
    // equal weights at the angle θ leave it with the share sin²(θ/2) of the weight, therefore half of the angle below.
    let covariance_rad2 = information.try_inverse()?.into();
    let weakest = information.symmetric_eigenvalues().min() / total;
    let sine = libm::sin(0.5 * MIN_SEPARATION_RAD);
    if !(weakest > sine * sine) {
        return None;
    }
    let misfit =
        |d: &Direction<V, R>| (attitude * d.vehicle - d.reference).norm_squared() / (d.sigma_rad * d.sigma_rad);
    let chi2 = directions.iter().map(misfit).sum();
    Some(Wahba { attitude, covariance_rad2, chi2 })
}

/// Returns the rotation R that maximises tr(R Bᵀ), from the largest eigenvalue of Davenport's matrix.
fn best_rotation(b: &Matrix3<f64>) -> Option<UnitQuaternion<f64>> {
    let s = b + b.transpose();
    let z = Vector3::new(b[(2, 1)] - b[(1, 2)], b[(0, 2)] - b[(2, 0)], b[(1, 0)] - b[(0, 1)]);
    let trace = b.trace();
    let mut k = Matrix4::zeros();
    k[(0, 0)] = trace;
    for i in 0..3 {
        k[(0, i + 1)] = z[i];
        k[(i + 1, 0)] = z[i];
        for j in 0..3 {
            k[(i + 1, j + 1)] = s[(i, j)] - if i == j { trace } else { 0.0 };
        }
    }
    // With a limit of iterations, because the loop without one could run on for numbers that do not converge.
    let eigen = SymmetricEigen::try_new(k, 1e-15, 200)?;
    let q = eigen.eigenvectors.column(eigen.eigenvalues.imax()).into_owned();
    let quaternion = nalgebra::Quaternion::new(q[0], q[1], q[2], q[3]);
    UnitQuaternion::try_new(quaternion, 1e-9)
}
