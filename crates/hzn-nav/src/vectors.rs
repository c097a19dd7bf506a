//! Attitude from directions: TRIAD, and Wahba's problem by Davenport's q method.

use nalgebra::{Matrix3, Matrix4, Rotation3, SymmetricEigen, UnitQuaternion, Vector3};

/// Smallest angle between two directions, in radians (2°). A smaller one leaves the rotation about them undetermined.
pub const MIN_SEPARATION_RAD: f64 = 2.0 * core::f64::consts::PI / 180.0;

/// A direction that is known in two frames.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Direction {
    /// Unit vector in the body frame.
    pub body: Vector3<f64>,
    /// Unit vector in the reference frame, for example ECEF.
    pub reference: Vector3<f64>,
    /// 1-sigma of the angle between the two in each axis across, in radians; above 0.
    pub sigma_rad: f64,
}

/// Returns the attitude (body to reference) from two directions. The first direction is met exactly, so it should be
/// the more accurate one; the second gives the rotation about the first. `None` if the directions are closer than
/// [`MIN_SEPARATION_RAD`] to each other or to opposite directions, in either frame.
///
/// Source: Black 1964.
pub fn triad(first: &Direction, second: &Direction) -> Option<UnitQuaternion<f64>> {
    let base = |a: &Vector3<f64>, b: &Vector3<f64>| {
        let t1 = a.try_normalize(0.0)?;
        let across = t1.cross(&b.try_normalize(0.0)?);
        let t2 = across.try_normalize(libm::sin(MIN_SEPARATION_RAD))?;
        Some(Matrix3::from_columns(&[t1, t2, t1.cross(&t2)]))
    };
    let reference = base(&first.reference, &second.reference)?;
    let body = base(&first.body, &second.body)?;
    let rotation = Rotation3::from_matrix_unchecked(reference * body.transpose());
    let attitude = UnitQuaternion::from_rotation_matrix(&rotation);
    attitude.coords.iter().all(|x| x.is_finite()).then_some(attitude)
}

/// An attitude with its covariance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wahba {
    /// Attitude (body to reference).
    pub attitude: UnitQuaternion<f64>,
    /// Covariance of the rotation vector (reference frame) from the estimate to the truth, in rad².
    pub covariance_rad2: Matrix3<f64>,
    /// Sum of the squared misfits over their variances.
    pub chi2: f64,
}

/// Returns the attitude (body to reference) that fits all directions best, with weights 1/σ² (Wahba's problem, by
/// Davenport's q method). `None` with fewer than two directions, or if they do not determine the rotation about them.
pub fn davenport(directions: &[Direction]) -> Option<Wahba> {
    if directions.len() < 2 {
        return None;
    }
    let (mut b, mut information, mut total) = (Matrix3::zeros(), Matrix3::zeros(), 0.0);
    for d in directions {
        let weight = 1.0 / (d.sigma_rad * d.sigma_rad);
        let (body, reference) = (d.body.try_normalize(0.0)?, d.reference.try_normalize(0.0)?);
        b += reference * body.transpose() * weight;
        information += (Matrix3::identity() - reference * reference.transpose()) * weight;
        total += weight;
    }
    if !(total > 0.0 && total.is_finite()) {
        return None;
    }
    let b = b / total;
    let attitude = best_rotation(&b)?;
    // The weakest axis must be known to better than the separation of two directions would allow.
    let covariance_rad2 = information.try_inverse()?;
    let weakest = information.symmetric_eigenvalues().min() / total;
    let sine = libm::sin(0.5 * MIN_SEPARATION_RAD);
    if !(weakest > sine * sine) {
        return None;
    }
    let misfit = |d: &Direction| (attitude * d.body - d.reference).norm_squared() / (d.sigma_rad * d.sigma_rad);
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
    let eigen = SymmetricEigen::try_new(k, 1e-15, 200)?;
    let q = eigen.eigenvectors.column(eigen.eigenvalues.imax()).into_owned();
    let quaternion = nalgebra::Quaternion::new(q[0], q[1], q[2], q[3]);
    UnitQuaternion::try_new(quaternion, 1e-9)
}
