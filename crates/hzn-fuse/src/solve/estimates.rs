//! The unknowns, their estimates, and the blocks that they form.

use hzn_nav::filter::Corrections;
use hzn_nav::frames::{Cam, Rotation, Vector, Vehicle};
use hzn_nav::layout::{Layout, Place};
use hzn_nav::strapdown::Nominal;
use nalgebra::{DMatrix, DVector, Matrix3, Vector3};

use super::places::{LensPlaces, Places};

/// The errors that last the whole flight.
#[derive(Debug, Clone, PartialEq)]
pub struct Shared {
    /// Errors of the inertial unit, and the limb height.
    pub corrections: Corrections,
    /// The mounts: rotation from the camera to the vehicle's frame.
    pub mounts: Vec<Rotation<Cam, Vehicle>>,
    /// The times that are added to the clocks of the cameras, s.
    pub clocks_s: Vec<f64>,
    /// Errors of the lenses, true minus told: the focal length as a fraction, the principal point (x, y) in px.
    pub lenses: Vec<Vector3<f64>>,
}

/// Estimates of all unknowns. Their blocks are the knots, then the slow errors, then the shared errors.
#[derive(Debug, Clone, PartialEq)]
pub struct Estimates {
    /// The states at the knots.
    pub knots: Vec<Nominal>,
    /// The slow errors over their covariance's symmetric root.
    pub slow: Vec<Vector3<f64>>,
    /// The errors that last the whole flight.
    pub shared: Shared,
}

impl Estimates {
    /// Returns the block of the shared errors.
    pub fn shared_block(&self) -> usize {
        self.knots.len() + self.slow.len()
    }

    /// Returns the block of a slow error.
    pub fn slow_block(&self, index: usize) -> usize {
        self.knots.len() + index
    }

    /// Returns the number of unknowns of each block.
    pub fn sizes(&self, places: &Places) -> Vec<usize> {
        let knots = self.knots.iter().map(|_| Layout::VEHICLE);
        knots.chain(self.slow.iter().map(|_| 3)).chain([places.shared()]).collect()
    }

    /// Returns the estimates moved by a step, which `part` gives for each block. Attitudes turn from the left, as in
    /// the filter, and mounts from the right.
    #[must_use]
    pub fn moved(&self, places: &Places, part: impl Fn(usize) -> DVector<f64>) -> Self {
        let mut out = self.clone();
        for (block, knot) in out.knots.iter_mut().enumerate() {
            let step = part(block);
            let turn = Rotation::from_scaled_axis(three(&step, Layout::ATTITUDE).into());
            knot.attitude = (turn * knot.attitude).renormalized();
            knot.velocity_m_s += three(&step, Layout::VELOCITY).into();
            knot.position_m += three(&step, Layout::POSITION).into();
        }
        for (index, slow) in out.slow.iter_mut().enumerate() {
            *slow += three(&part(self.slow_block(index)), 0);
        }
        out.shared.apply(places, &part(self.shared_block()));
        out
    }
}

impl Shared {
    fn apply(&mut self, places: &Places, step: &DVector<f64>) {
        let (layout, c) = (&places.filter, &mut self.corrections);
        let blocks = [
            (layout.accel_bias, &mut c.accel_bias),
            (layout.accel_scale, &mut c.accel_scale),
            (layout.accel_misalignment, &mut c.accel_misalignment),
            (layout.gyro_bias, &mut c.gyro_bias),
            (layout.gyro_scale, &mut c.gyro_scale),
            (layout.gyro_misalignment, &mut c.gyro_misalignment),
        ];
        for (place, value) in blocks {
            if let Some(place) = place {
                *value += three(step, column(place)).into();
            }
        }
        if let Some(place) = layout.limb_height {
            c.limb_height_km += step[column(place)];
        }
        if let Some(place) = layout.limb_latitude {
            for (i, coefficient) in c.limb_latitude_km.iter_mut().enumerate() {
                *coefficient += step[column(place) + i];
            }
        }
        for ((mount, clock_s), places) in self.mounts.iter_mut().zip(&mut self.clocks_s).zip(&layout.cameras) {
            if let Some(place) = places.misalignment {
                *mount = (*mount * Rotation::from_scaled_axis(three(step, column(place)).into())).renormalized();
            }
            if let Some(place) = places.clock {
                *clock_s += step[column(place)];
            }
        }
        for (lens, places) in self.lenses.iter_mut().zip(&places.lenses) {
            for (first, place) in places.each() {
                let mut part = lens.rows_mut(first, place.len);
                part += step.rows(column(place), place.len);
            }
        }
    }

    /// Returns what differs from what was known before, in the places of the block.
    pub(super) fn since(&self, told: &[Rotation<Cam, Vehicle>], places: &Places) -> DVector<f64> {
        let layout = &places.filter;
        let mut out = DVector::zeros(places.shared());
        let mut put = |place: Option<Place>, value: &[f64]| {
            if let Some(place) = place {
                value.iter().enumerate().for_each(|(i, x)| out[column(place) + i] = *x);
            }
        };
        let c = &self.corrections;
        put(layout.accel_bias, &c.accel_bias.xyz());
        put(layout.accel_scale, &c.accel_scale.xyz());
        put(layout.accel_misalignment, &c.accel_misalignment.xyz());
        put(layout.gyro_bias, &c.gyro_bias.xyz());
        put(layout.gyro_scale, &c.gyro_scale.xyz());
        put(layout.gyro_misalignment, &c.gyro_misalignment.xyz());
        put(layout.limb_height, &[c.limb_height_km]);
        put(layout.limb_latitude, &c.limb_latitude_km);
        for (((mount, told), clock_s), places) in self.mounts.iter().zip(told).zip(&self.clocks_s).zip(&layout.cameras)
        {
            let error: Vector<Cam> = (told.inverse() * *mount).scaled_axis();
            put(places.misalignment, &error.xyz());
            put(places.clock, &[*clock_s]);
        }
        for (lens, places) in self.lenses.iter().zip(&places.lenses) {
            put(places.focal, &[lens.x]);
            put(places.centre, &[lens.y, lens.z]);
        }
        out
    }
}

/// Returns the column of an error in the block of the shared errors: the filter has the state before them.
pub(super) fn column(place: Place) -> usize {
    place.first - Layout::VEHICLE
}

/// Puts the derivative by the unknowns of a lens into their columns.
pub(super) fn put_lens(derivative: &mut DMatrix<f64>, places: Option<&LensPlaces>, value: &DMatrix<f64>) {
    for (first, place) in places.into_iter().flat_map(|places| places.each()) {
        put(derivative, Some(place), &value.columns(first, place.len).into_owned());
    }
}

/// Returns three components of a step.
fn three(step: &DVector<f64>, first: usize) -> Vector3<f64> {
    Vector3::from_fn(|i, _| step.get(first + i).copied().unwrap_or(0.0))
}

/// Puts a matrix into the columns of an error, if it exists.
pub(super) fn put(derivative: &mut DMatrix<f64>, place: Option<Place>, value: &DMatrix<f64>) {
    if let Some(place) = place {
        derivative.view_mut((0, column(place)), value.shape()).copy_from(value);
    }
}

/// Returns the inverse of the derivative of a rotation vector by a rotation from the left: the errors of a gap are
/// large.
pub(super) fn left_inverse(vector: &Vector3<f64>) -> Matrix3<f64> {
    let (angle, cross) = (vector.norm(), vector.cross_matrix());
    let second = if angle < 1e-4 {
        1.0 / 12.0
    } else {
        1.0 / (angle * angle) - (1.0 + angle.cos()) / (2.0 * angle * angle.sin())
    };
    Matrix3::identity() - cross * 0.5 + cross * cross * second
}
