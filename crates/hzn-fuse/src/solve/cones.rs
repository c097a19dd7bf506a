//! The errors of the freely fitted cones of limbs, which are what all edge points say together.
//!
//! The half-angle of a cone measures the altitude and the limb height. The altitude is that of the estimated position,
//! so that the limb height of all pictures is estimated together with the attitude.

use hzn_core::ellipsoid::{EARTH_MEAN_RADIUS_M, WGS84_A_M, WGS84_B_M, geodetic};
use hzn_nav::filter::{LatitudeTerm, basis};
use hzn_nav::frames::{Fixed, Vector};
use hzn_nav::layout::{Layout, Place};
use hzn_nav::strapdown::Nominal;
use nalgebra::{DMatrix, DVector, Matrix3, RowVector3, SMatrix, Vector3};

use super::directions::{At, LEAST_WHITE, by_knot, seen};
use super::estimates::{Estimates, put, put_lens};
use super::lens::{ByLens, Lens};
use super::places::Places;
use super::turning::Turning;
use crate::input::FreeCone;
use crate::sparse::Linear;

/// Smallest cosine of a half-angle: from nearer to the limb's height, the half-angle says nothing of the altitude.
const LEAST_COS: f64 = 1e-3;

/// What a cone is compared with.
#[derive(Debug, Clone, Copy)]
pub(super) struct Told {
    /// The axis of the limb in the fixed frame.
    pub(super) reference: Vector<Fixed>,
    /// The altitude of the expected cosine, km.
    pub(super) altitude_km: f64,
    /// The share of the covariance whose error is slow.
    pub(super) slow_share: f64,
}

/// A cone that a camera measured.
#[derive(Debug, Clone)]
pub(super) struct Cone {
    at: At,
    cone: FreeCone,
    told: Told,
    latitude: Option<[LatitudeTerm; 2]>,
    /// Symmetric root of the covariance of the slow error, in the axes of the camera, with the cosine along the axis.
    root: Matrix3<f64>,
    slow: Option<usize>,
    /// Two axes across the direction, and the direction itself.
    axes: Matrix3<f64>,
    /// The inverse factor of the noise on these axes.
    whiten: Matrix3<f64>,
    /// Derivative of the cone by the error of the lens, if that is unknown.
    by_lens: Option<ByLens>,
}

/// The expected cosine with its derivatives by the limb height (1/km) and by the altitude (1/m).
struct Cosine {
    value: f64,
    by_limb_height: f64,
    by_altitude: f64,
}

impl Cone {
    /// Prepares a cone; `None` if its covariance cannot be factored. `slow` is the number of its slow error.
    pub(super) fn new(
        at: At,
        cone: &FreeCone,
        told: Told,
        state: &Nominal,
        white_rad: f64,
        slow: Option<usize>,
        lens: Option<&Lens>,
    ) -> Option<Self> {
        let reference = told.reference.try_normalize(1e-6)?;
        let whole = cone.with_cos_along_axis();
        let across = basis(cone.axis.as_inner());
        let mut axes = Matrix3::zeros();
        axes.fixed_view_mut::<2, 3>(0, 0).copy_from(&across);
        axes.set_row(2, &cone.axis.as_inner().transpose());
        let white = white_rad.max(LEAST_WHITE * cone.covariance_rad2.as_inner().trace().max(0.0).sqrt());
        // A shift of the edge by an angle moves the half-angle by the same angle.
        let white_cos = (white * (1.0 - cone.told_cos * cone.told_cos).sqrt()).max(LEAST_WHITE * cone.var_cos.sqrt());
        let noise = Matrix3::from_diagonal(&Vector3::new(white, white, white_cos).map(|x| x * x));
        let share = if slow.is_some() { 1.0 - told.slow_share } else { 1.0 };
        let factor = (noise + axes * whole * axes.transpose() * share).cholesky()?.l();
        let by_lens = lens.and_then(|lens| Some((lens, lens.by_lens(cone.axis.as_inner(), cone.cos, true)?)));
        let mut slow_part = whole * told.slow_share;
        if let Some((lens, by)) = &by_lens {
            // The cosine takes the place along the axis here, too.
            let by = by.fixed_rows::<3>(0) + cone.axis.as_inner() * by.row(3);
            slow_part = lens.without(&slow_part, &by);
        }
        let mut root = slow_part.symmetric_eigen();
        root.eigenvalues.apply(|v| *v = v.max(0.0).sqrt());
        Some(Self {
            at,
            cone: *cone,
            told: Told { reference, ..told },
            latitude: LatitudeTerm::both(&state.position_m),
            root: root.recompose(),
            slow,
            axes,
            whiten: factor.solve_lower_triangular(&Matrix3::identity())?,
            by_lens: by_lens.map(|(_, by)| by),
        })
    }

    /// Returns the expected cosine at a position, for a limb that is higher than the told one.
    ///
    /// The sine of the half-angle is the radius of the limb over the distance to the centre. The told cosine has the
    /// shape of the ellipsoid, and only the change since then is that of a sphere.
    fn cosine(&self, position_m: &Vector<Fixed>, higher_km: f64) -> Cosine {
        let told_m = EARTH_MEAN_RADIUS_M + self.told.altitude_km * 1e3;
        let radius_m = told_m * (1.0 - self.cone.told_cos * self.cone.told_cos).sqrt() + higher_km * 1e3;
        let (altitude_m, _) = geodetic(position_m.xyz(), WGS84_A_M, WGS84_B_M);
        let distance_m = EARTH_MEAN_RADIUS_M + altitude_m;
        let sin = radius_m / distance_m;
        let value = (1.0 - sin * sin).max(LEAST_COS * LEAST_COS).sqrt();
        let by_radius = -sin / (value * distance_m);
        Cosine { value, by_limb_height: by_radius * 1e3, by_altitude: -by_radius * sin }
    }

    /// Returns the error at the estimates.
    pub(super) fn error(&self, estimates: &Estimates, all: &Places, turning: &Turning) -> Option<Linear> {
        let layout = &all.filter;
        let seen = seen(&self.at, estimates, turning, &self.told.reference)?;
        let (knot, places) = (estimates.knots.get(self.at.knot)?, layout.cameras.get(self.at.camera)?);
        let dt = self.at.time_s - knot.time_s;
        let position_m = knot.position_m + knot.velocity_m_s * dt;
        let c = &estimates.shared.corrections;
        let terms = self.latitude.filter(|_| layout.limb_latitude.is_some());
        let coefficients = terms.iter().flatten().zip(c.limb_latitude_km);
        let mut higher_km = if layout.limb_height.is_some() { c.limb_height_km } else { 0.0 };
        let mut expected = seen.predicted.into_inner();
        for (term, km) in coefficients {
            higher_km += term.height * km;
            expected += (seen.to_camera * term.tilt).into_inner() * km;
        }
        let cosine = self.cosine(&position_m, higher_km);
        // Derivatives of the components across the axis, and of the cosine.
        let rows = |across: Matrix3<f64>, cos: RowVector3<f64>| {
            let mut out = self.axes * across;
            out.set_row(2, &cos);
            dense(&(self.whiten * out))
        };
        let one = |across: &Vector3<f64>, cos: f64| {
            let mut out = self.axes * across;
            out.z = cos;
            dense(&(self.whiten * out))
        };
        let mut by_shared = DMatrix::zeros(3, all.shared());
        put(&mut by_shared, places.misalignment, &rows(seen.by_mount, RowVector3::zeros()));
        put(&mut by_shared, places.clock, &one(&seen.by_clock, 0.0));
        put(&mut by_shared, layout.limb_height, &one(&Vector3::zeros(), cosine.by_limb_height));
        for (i, term) in terms.iter().flatten().enumerate() {
            let place = layout.limb_latitude.map(|place| Place { first: place.first + i, ..place });
            let tilt = (seen.to_camera * term.tilt).into_inner();
            put(&mut by_shared, place, &one(&tilt, cosine.by_limb_height * term.height));
        }
        let mut lens_cos = 0.0;
        if let Some(by) = &self.by_lens {
            let (axis, cos) = (by.fixed_rows::<3>(0).into_owned(), by.row(3).into_owned());
            let error = estimates.shared.lenses.get(self.at.camera)?;
            put_lens(&mut by_shared, all.lenses.get(self.at.camera), &rows(axis, cos));
            expected += axis * error;
            lens_cos = (cos * error).x;
        }
        let mut by_state = by_knot(&rows(seen.by_attitude, RowVector3::zeros()));
        let up = -self.told.reference.as_inner().transpose() * cosine.by_altitude;
        let by_position = rows(Matrix3::zeros(), up);
        by_state.view_mut((0, Layout::VELOCITY), (3, 3)).copy_from(&(&by_position * dt));
        by_state.view_mut((0, Layout::POSITION), (3, 3)).copy_from(&by_position);
        let mut derivatives = vec![(self.at.knot, by_state), (estimates.shared_block(), by_shared)];
        let mut error = self.axes * (expected - self.cone.axis.as_inner());
        error.z = cosine.value + lens_cos - self.cone.cos;
        if let Some(slow) = self.slow {
            let by_slow = self.axes * self.root;
            error += by_slow * estimates.slow.get(slow)?;
            derivatives.push((estimates.slow_block(slow), dense(&(self.whiten * by_slow))));
        }
        let error = self.whiten * error;
        Some(Linear { error: DVector::from_column_slice(error.as_slice()), derivatives })
    }
}

fn dense<const C: usize>(matrix: &SMatrix<f64, 3, C>) -> DMatrix<f64> {
    DMatrix::from_column_slice(3, C, matrix.as_slice())
}
