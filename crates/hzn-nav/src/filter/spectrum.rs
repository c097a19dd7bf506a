//! Covariances of measurements by their eigenvalues.
//!
//! A sensor computes its covariances in single precision. The rounding, about 10⁻⁷ of the largest variance, makes the
//! covariance of a direction slightly indefinite, because its rank is 2: one eigenvalue is 0 or a little below. The
//! roots of a slow error need positive eigenvalues. A covariance is therefore projected on the plane across its
//! direction, and every eigenvalue is lifted to at least (10⁻⁴ σ_max)².
//!
//! The floor is that of the roots: the root of a new covariance is multiplied by the inverse root of an old one, and
//! with a floor of 10⁻⁷ σ_max this product is numerically indefinite again.

use nalgebra::{Matrix3, Vector3};

use super::unusable::Unusable;

/// Smallest 1-sigma over the largest one.
const SMALLEST_SHARE: f64 = 1e-4;
/// Share of the trace by which rounding can make an eigenvalue negative. A number in single precision is rounded by up
/// to 6·10⁻⁸; a hundred such errors may add up in a sensor.
const ROUNDING_SHARE: f64 = 1e-5;
/// Smallest variance that counts as the largest one, so that a covariance of zero has a root: (10⁻⁷ rad)².
const SMALLEST_VARIANCE: f64 = 1e-14;

/// A symmetric matrix by its eigenvalues and eigenvectors (columns).
pub(super) struct Spectrum {
    values: Vector3<f64>,
    vectors: Matrix3<f64>,
}

impl Spectrum {
    /// Returns the spectrum of a symmetric matrix.
    pub(super) fn of(matrix: &Matrix3<f64>) -> Self {
        let (mut a, mut v) = (*matrix, Matrix3::identity());
        // Five sweeps are enough for doubles; the convergence is quadratic.
        for _ in 0..6 {
            rotate::<0, 1>(&mut a, &mut v);
            rotate::<0, 2>(&mut a, &mut v);
            rotate::<1, 2>(&mut a, &mut v);
        }
        Self { values: a.diagonal(), vectors: v }
    }

    /// Returns the repaired covariance of a direction with this unit vector.
    ///
    /// # Errors
    /// A variance is more negative than rounding explains.
    pub(super) fn of_direction(covariance: &Matrix3<f64>, direction: &Vector3<f64>) -> Result<Self, Unusable> {
        let across = Matrix3::identity() - direction * direction.transpose();
        Ok(Self::of(&(across * checked(covariance)? * across)).lifted())
    }

    /// Returns the repaired covariance of a position.
    ///
    /// # Errors
    /// A variance is more negative than rounding explains.
    pub(super) fn of_position(covariance: &Matrix3<f64>) -> Result<Self, Unusable> {
        Ok(Self::of(&checked(covariance)?).lifted())
    }

    /// Returns a symmetric matrix without its negative eigenvalues. The difference of two covariances has them if the
    /// second one is larger in some direction, by rounding or because a sensor tells it so.
    pub(super) fn positive_part(matrix: &Matrix3<f64>) -> Matrix3<f64> {
        let spectrum = Self::of(matrix);
        spectrum.with(&spectrum.values.map(|value| value.max(0.0)))
    }

    fn lifted(self) -> Self {
        let least = self.values.max().max(SMALLEST_VARIANCE) * (SMALLEST_SHARE * SMALLEST_SHARE);
        Self { values: self.values.map(|value| value.max(least)), ..self }
    }

    /// Returns the matrix.
    pub(super) fn matrix(&self) -> Matrix3<f64> {
        self.with(&self.values)
    }

    /// Returns the symmetric root. Every eigenvalue must be positive.
    pub(super) fn root(&self) -> Matrix3<f64> {
        self.with(&self.values.map(libm::sqrt))
    }

    /// Returns the inverse of the symmetric root. Every eigenvalue must be positive.
    pub(super) fn inverse_root(&self) -> Matrix3<f64> {
        self.with(&self.values.map(|value| 1.0 / libm::sqrt(value)))
    }

    fn with(&self, values: &Vector3<f64>) -> Matrix3<f64> {
        let matrix = self.vectors * Matrix3::from_diagonal(values) * self.vectors.transpose();
        // Rounding leaves the product symmetric to the last bit but one.
        (matrix + matrix.transpose()) * 0.5
    }
}

/// Returns the symmetric part of a covariance, if rounding explains everything that is negative in it.
fn checked(covariance: &Matrix3<f64>) -> Result<Matrix3<f64>, Unusable> {
    let symmetric = (covariance + covariance.transpose()) * 0.5;
    let rounding = ROUNDING_SHARE * symmetric.trace() + SMALLEST_VARIANCE;
    let is_covariance = (symmetric + Matrix3::identity() * rounding).cholesky().is_some();
    if is_covariance { Ok(symmetric) } else { Err(Unusable::NegativeVariance) }
}

/// Makes the component (P, Q) of a symmetric matrix zero (Jacobi). The places are constants, so that no access can fail
/// and no panic is linked.
fn rotate<const P: usize, const Q: usize>(a: &mut Matrix3<f64>, v: &mut Matrix3<f64>) {
    let off = a[(P, Q)];
    if off == 0.0 {
        return;
    }
    let theta = (a[(Q, Q)] - a[(P, P)]) / (2.0 * off);
    let t = libm::copysign(1.0, theta) / (libm::fabs(theta) + libm::sqrt(theta * theta + 1.0));
    let c = 1.0 / libm::sqrt(t * t + 1.0);
    let s = t * c;
    let mut j = Matrix3::identity();
    (j[(P, P)], j[(Q, Q)], j[(P, Q)], j[(Q, P)]) = (c, c, s, -s);
    *a = j.transpose() * *a * j;
    // The rotation leaves this number at the size of rounding errors.
    (a[(P, Q)], a[(Q, P)]) = (0.0, 0.0);
    *v *= j;
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A source of random numbers.
    struct Draws(u64);

    impl Draws {
        /// Returns a number between 0 and 1.
        fn uniform(&mut self) -> f64 {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (self.0 >> 11) as f64 / (1u64 << 53) as f64
        }
        fn direction(&mut self) -> Vector3<f64> {
            let (z, turn) = (2.0 * self.uniform() - 1.0, core::f64::consts::TAU * self.uniform());
            let across = (1.0 - z * z).sqrt();
            Vector3::new(across * turn.cos(), across * turn.sin(), z)
        }
        /// Returns a direction and a covariance of rank 2 across it, with its largest and smallest 1-sigma.
        fn covariance(&mut self) -> (Vector3<f64>, Matrix3<f64>, [f64; 2]) {
            let direction = self.direction();
            let first = direction.cross(&self.direction()).normalize();
            let second = direction.cross(&first);
            let largest = 10f64.powf(-1.0 - 4.5 * self.uniform());
            let smallest = largest * 10f64.powf(-4.0 * self.uniform());
            let exact = first * first.transpose() * largest.powi(2) + second * second.transpose() * smallest.powi(2);
            (direction, exact, [largest, smallest])
        }
    }

    fn rounded<const C: usize>(matrix: &nalgebra::SMatrix<f64, 3, C>) -> nalgebra::SMatrix<f64, 3, C> {
        matrix.map(|x| f64::from(x as f32))
    }

    #[test]
    fn roots_of_covariances_of_any_size() {
        let turn = nalgebra::UnitQuaternion::from_euler_angles(0.3, -1.2, 2.0).to_rotation_matrix().into_inner();
        for sizes in [[1.0, 1.0, 1.0], [1e-6, 3e-7, 1e-14], [4.0, 1e-3, 2.0], [1e-14, 1e-14, 1.0]] {
            let matrix = turn * Matrix3::from_diagonal(&Vector3::from(sizes)) * turn.transpose();
            let spectrum = Spectrum::of(&matrix);
            let whole = spectrum.root();
            assert!((whole * whole - matrix).norm() < 1e-14 * matrix.norm(), "{sizes:?}");
            assert!((whole * spectrum.inverse_root() - Matrix3::identity()).norm() < 1e-5, "{sizes:?}");
        }
    }

    /// Rounded entry by entry, more than a third of such covariances are indefinite.
    #[test]
    fn no_covariance_in_single_precision_is_refused() {
        let mut draws = Draws(3);
        let mut indefinite = 0;
        let mut old: Option<Matrix3<f64>> = None;
        for i in 0..100_000 {
            let (direction, exact, [largest, smallest]) = draws.covariance();
            let (direction, given) = (rounded(&direction).normalize(), rounded(&exact));
            indefinite += u32::from(given.symmetric_eigenvalues().min() < 0.0);
            let new = Spectrum::of_direction(&given, &direction).unwrap();
            let repaired = new.matrix();
            // The repair changes a variance by rounding and by the floor only.
            assert!((repaired - exact).norm() < 4e-7 * largest.powi(2), "{i}: {largest} {smallest}");
            let along = direction.dot(&(repaired * direction)).sqrt();
            assert!((along / largest / SMALLEST_SHARE - 1.0).abs() < 1e-3, "{i}: {along} {largest}");
            // The change from the covariance before has a root of the right size.
            if let Some(old) = old {
                let change = new.root() * Spectrum::of(&old).inverse_root();
                let carried = change * old * change.transpose();
                assert!((carried - repaired).norm() < 1e-6 * repaired.norm(), "{i}: {carried} {repaired}");
            }
            old = Some(repaired);
        }
        assert!(indefinite > 30_000, "{indefinite}");
    }

    #[test]
    fn what_rounding_does_not_explain_is_refused() {
        let mut draws = Draws(5);
        for i in 0..10_000 {
            let (direction, exact, [largest, _]) = draws.covariance();
            // A negative variance in any direction, of a thousandth of the largest one and more.
            let wrong = draws.direction();
            let negative = largest.powi(2) * (wrong.dot(&(exact * wrong)) / largest.powi(2) + 1e-3);
            let given = rounded(&(exact - wrong * wrong.transpose() * negative));
            assert_eq!(Spectrum::of_direction(&given, &direction).err(), Some(Unusable::NegativeVariance), "{i}");
            assert_eq!(Spectrum::of_position(&given).err(), Some(Unusable::NegativeVariance), "{i}");
            assert!(Spectrum::of_direction(&-exact, &direction).is_err(), "{i}");
        }
        let nan = Matrix3::from_diagonal(&Vector3::new(1e-6, f64::NAN, 1e-6));
        assert!(Spectrum::of_direction(&nan, &Vector3::z()).is_err());
    }

    #[test]
    fn a_covariance_of_zero_has_roots() {
        let none = Spectrum::of_direction(&Matrix3::zeros(), &Vector3::z()).unwrap();
        assert!(none.root().norm() < 1e-10 && none.inverse_root().norm().is_finite());
    }
}
