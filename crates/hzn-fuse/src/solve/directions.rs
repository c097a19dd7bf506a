//! The errors of directions and of positions of the Earth's centre that cameras measure.
//!
//! The derivatives are those of the filter (`hzn_nav::filter`). The axes across a direction are those of the measured
//! one, which does not move with the estimates.

use hzn_nav::filter::{
    DirectionMeasurement, LatitudeTerm, RADIUS_KM, Unusable, UsableDirection, basis, predict_direction,
};
use hzn_nav::frames::{Cam, Fixed, Rotation, Vector, Vehicle};
use hzn_nav::layout::Layout;
use hzn_nav::strapdown::Nominal;
use nalgebra::{DMatrix, DVector, Matrix2, Matrix3, SMatrix, Vector3};

use super::estimates::{Estimates, put, put_lens};
use super::places::Places;
use super::turning::Turning;
use crate::input::Centre;
use crate::sparse::Linear;

/// Smallest white noise of a direction as a share of its sigma: without any, a direction would be a condition.
pub(super) const LEAST_WHITE: f64 = 0.01;

/// Where and when something was seen.
#[derive(Debug, Clone, Copy)]
pub(super) struct At {
    pub(super) knot: usize,
    pub(super) time_s: f64,
    pub(super) camera: usize,
}

/// A direction that a camera measured.
#[derive(Debug, Clone)]
pub(super) struct Direction {
    pub(super) at: At,
    measured: Vector<Cam>,
    reference: Vector<Fixed>,
    by_limb_height: Vector<Cam>,
    /// Derivative of the measured axis by the error of the lens, if that is unknown.
    pub(super) by_lens: Option<Matrix3<f64>>,
    /// The effect of a limb height that changes with the latitude.
    latitude: Option<[LatitudeTerm; 2]>,
    root: Matrix3<f64>,
    /// The slow error; `None` if the covariance is noise of each direction.
    pub(super) slow: Option<usize>,
    /// Two axes across the direction over the noise.
    across: SMatrix<f64, 2, 3>,
}

impl Direction {
    pub(super) fn new(
        at: At,
        m: &DirectionMeasurement,
        position_m: &Vector<Fixed>,
        white_rad: f64,
        slow: Option<usize>,
    ) -> Result<Self, Unusable> {
        let UsableDirection { measured, slow_root_rad: root, white_rad2: rest } = m.usable()?;
        let reference = m.reference.try_normalize(1e-6).ok_or(Unusable::NoDirection)?;
        let covariance = root * root;
        let white = white_rad.max(LEAST_WHITE * covariance.trace().sqrt());
        let axes = basis(measured.as_inner());
        let mut noise = Matrix2::identity() * (white * white) + axes * rest * axes.transpose();
        if slow.is_none() {
            noise += axes * covariance * axes.transpose();
        }
        let factor = noise.cholesky().ok_or(Unusable::NegativeVariance)?.l();
        let across = factor.solve_lower_triangular(&axes).ok_or(Unusable::NegativeVariance)?;
        let latitude = LatitudeTerm::both(position_m).filter(|_| m.is_limb);
        let by_limb_height = m.by_limb_height;
        Ok(Self { at, measured, reference, by_limb_height, by_lens: None, latitude, root, slow, across })
    }

    /// Returns the error at the estimates.
    pub(super) fn error(&self, estimates: &Estimates, all: &Places, turning: &Turning) -> Option<Linear> {
        let layout = &all.filter;
        let seen = seen(&self.at, estimates, turning, &self.reference)?;
        let places = layout.cameras.get(self.at.camera)?;
        let mut by_shared = DMatrix::zeros(2, all.shared());
        let dense = |matrix: SMatrix<f64, 2, 3>| DMatrix::from_column_slice(2, 3, matrix.as_slice());
        let column = |v: &Vector3<f64>| DMatrix::from_column_slice(2, 1, (self.across * v).as_slice());
        put(&mut by_shared, places.misalignment, &dense(self.across * seen.by_mount));
        put(&mut by_shared, places.clock, &column(&seen.by_clock));
        let mut expected = seen.predicted.into_inner();
        let c = &estimates.shared.corrections;
        if layout.limb_height.is_some() {
            put(&mut by_shared, layout.limb_height, &column(self.by_limb_height.as_inner()));
            expected += self.by_limb_height.as_inner() * c.limb_height_km;
        }
        if let (Some(place), Some(terms)) = (layout.limb_latitude, self.latitude) {
            for (i, (term, coefficient)) in terms.iter().zip(c.limb_latitude_km).enumerate() {
                let by = (self.by_limb_height * term.height + seen.to_camera * term.tilt).into_inner();
                let one = hzn_nav::layout::Place { first: place.first + i, ..place };
                put(&mut by_shared, Some(one), &column(&by));
                expected += by * coefficient;
            }
        }
        if let Some(by) = self.by_lens {
            put_lens(&mut by_shared, all.lenses.get(self.at.camera), &dense(self.across * by));
            expected += by * estimates.shared.lenses.get(self.at.camera)?;
        }
        let mut derivatives = vec![
            (self.at.knot, by_knot(&dense(self.across * seen.by_attitude))),
            (estimates.shared_block(), by_shared),
        ];
        if let Some(slow) = self.slow {
            expected += self.root * estimates.slow.get(slow)?;
            derivatives.push((estimates.slow_block(slow), dense(self.across * self.root)));
        }
        let error = self.across * (expected - self.measured.as_inner());
        Some(Linear { error: DVector::from_column_slice(error.as_slice()), derivatives })
    }
}

/// Returns the derivative by a knot from that by its attitude.
pub(super) fn by_knot(by_attitude: &DMatrix<f64>) -> DMatrix<f64> {
    let mut out = DMatrix::zeros(by_attitude.nrows(), Layout::VEHICLE);
    out.view_mut((0, Layout::ATTITUDE), by_attitude.shape()).copy_from(by_attitude);
    out
}

/// A vector as a camera sees it.
pub(super) struct Seen {
    pub(super) predicted: Vector<Cam>,
    pub(super) by_attitude: Matrix3<f64>,
    pub(super) by_mount: Matrix3<f64>,
    pub(super) by_clock: Vector3<f64>,
    pub(super) to_camera: Rotation<Fixed, Cam>,
}

/// Returns a vector as a camera sees it at the time of its clock.
pub(super) fn seen(at: &At, estimates: &Estimates, turning: &Turning, vector: &Vector<Fixed>) -> Option<Seen> {
    let shared = &estimates.shared;
    let (knot, mount) = (estimates.knots.get(at.knot)?, shared.mounts.get(at.camera)?);
    let time_s = at.time_s + shared.clocks_s.get(at.camera)?;
    let (attitude, rate): (Rotation<Vehicle, Fixed>, _) = turning.at(knot, &shared.corrections, time_s);
    let (predicted, by_attitude, by_mount) = predict_direction(&attitude, mount, vector);
    let by_clock = (mount.inverse() * -rate.cross(&(attitude.inverse() * *vector))).into_inner();
    Some(Seen { predicted, by_attitude, by_mount, by_clock, to_camera: (attitude * *mount).inverse() })
}

/// A position of the Earth's centre that a camera measured.
#[derive(Debug, Clone)]
pub(super) struct CentreSeen {
    at: At,
    measured_m: Vector<Cam>,
    latitude: Option<[LatitudeTerm; 2]>,
    /// The axes of the camera over the noise.
    axes: Matrix3<f64>,
}

impl CentreSeen {
    pub(super) fn new(at: At, centre: &Centre, state: &Nominal, white_rad: f64) -> Result<Self, Unusable> {
        if !(centre.position_m.is_finite() && centre.covariance_m2.is_finite()) {
            return Err(Unusable::NotFinite);
        }
        let white_m = white_rad * centre.position_m.norm();
        let noise = centre.covariance_m2.as_inner() + Matrix3::identity() * (white_m * white_m);
        let factor = noise.cholesky().ok_or(Unusable::NegativeVariance)?.l();
        let axes = factor.solve_lower_triangular(&Matrix3::identity()).ok_or(Unusable::NegativeVariance)?;
        let latitude = LatitudeTerm::both(&state.position_m);
        Ok(Self { at, measured_m: centre.position_m, latitude, axes })
    }

    /// Returns the error at the estimates.
    pub(super) fn error(&self, estimates: &Estimates, all: &Places, turning: &Turning) -> Option<Linear> {
        let layout = &all.filter;
        let knot = estimates.knots.get(self.at.knot)?;
        let dt = self.at.time_s - knot.time_s;
        let to_centre = -(knot.position_m + knot.velocity_m_s * dt);
        let seen = seen(&self.at, estimates, turning, &to_centre)?;
        let places = layout.cameras.get(self.at.camera)?;
        let dense = |matrix: Matrix3<f64>| DMatrix::from_column_slice(3, 3, (self.axes * matrix).as_slice());
        let column = |v: &Vector3<f64>| DMatrix::from_column_slice(3, 1, (self.axes * v).as_slice());
        let mut by_shared = DMatrix::zeros(3, all.shared());
        put(&mut by_shared, places.misalignment, &dense(seen.by_mount));
        let mut expected = seen.predicted.into_inner();
        let c = &estimates.shared.corrections;
        if layout.limb_height.is_some() {
            let by = seen.predicted.into_inner() * (-1.0 / RADIUS_KM);
            put(&mut by_shared, layout.limb_height, &column(&by));
            expected += by * c.limb_height_km;
        }
        if let (Some(place), Some(terms)) = (layout.limb_latitude, self.latitude) {
            let range_m = seen.predicted.norm();
            for (i, (term, coefficient)) in terms.iter().zip(c.limb_latitude_km).enumerate() {
                let by = seen.predicted * (-term.height / RADIUS_KM) + seen.to_camera * term.tilt * range_m;
                let one = hzn_nav::layout::Place { first: place.first + i, ..place };
                put(&mut by_shared, Some(one), &column(by.as_inner()));
                expected += by.into_inner() * coefficient;
            }
        }
        let to_camera = seen.to_camera.to_matrix();
        let mut by_state = by_knot(&dense(seen.by_attitude));
        by_state.view_mut((0, Layout::VELOCITY), (3, 3)).copy_from(&dense(-to_camera * dt));
        by_state.view_mut((0, Layout::POSITION), (3, 3)).copy_from(&dense(-to_camera));
        let error = self.axes * (expected - self.measured_m.as_inner());
        let derivatives = vec![(self.at.knot, by_state), (estimates.shared_block(), by_shared)];
        Some(Linear { error: DVector::from_column_slice(error.as_slice()), derivatives })
    }
}
