//! The priors of the errors that last the whole flight.

use hzn_nav::layout::Place;
use hzn_nav::options::{Block, CameraOptions, Options};
use nalgebra::{DMatrix, DVector};

use super::carried::errors_of_unit;
use super::estimates::column;
use super::lens::Lens;
use super::places::{LensPlaces, Places};

/// Leaves out the errors that are known exactly, and returns the priors of the others.
pub(super) fn without_fixed(options: &mut Options, cameras: &mut [CameraOptions]) -> (Options, Vec<CameraOptions>) {
    let fixed = |block: &mut Block| {
        if !(block.sigma > 0.0) {
            *block = Block::OFF;
        }
    };
    errors_of_unit(options).into_iter().for_each(fixed);
    [&mut options.limb_height, &mut options.limb_latitude].into_iter().for_each(fixed);
    for camera in cameras.iter_mut() {
        fixed(&mut camera.misalignment);
        fixed(&mut camera.clock);
        // The slow errors are unknowns of their own.
        camera.bodies = 0;
    }
    (*options, cameras.to_vec())
}

/// The priors of the errors that last the whole flight.
#[derive(Debug, Clone)]
pub(super) struct Known {
    /// 1-sigma of each.
    pub(super) sigmas: DVector<f64>,
    /// A root of their information: times the errors it has the covariance 1. A calibration ties the parameters of a
    /// lens together, all others are independent.
    pub(super) root: DMatrix<f64>,
}

impl Known {
    pub(super) fn new(
        (options, cameras): &(Options, Vec<CameraOptions>),
        lenses: &[Option<Lens>],
        places: &Places,
    ) -> Self {
        let layout = &places.filter;
        let mut sigmas = DVector::zeros(places.shared());
        let mut fill = |place: Option<Place>, block: &Block| {
            if let Some(place) = place {
                sigmas.rows_mut(column(place), place.len).fill(block.sigma);
            }
        };
        let imu = &options.imu;
        fill(layout.accel_bias, &imu.accel_bias);
        fill(layout.accel_scale, &imu.accel_scale);
        fill(layout.accel_misalignment, &imu.accel_misalignment);
        fill(layout.gyro_bias, &imu.gyro_bias);
        fill(layout.gyro_scale, &imu.gyro_scale);
        fill(layout.gyro_misalignment, &imu.gyro_misalignment);
        fill(layout.limb_height, &options.limb_height);
        fill(layout.limb_latitude, &options.limb_latitude);
        for (places, camera) in layout.cameras.iter().zip(cameras) {
            fill(places.misalignment, &camera.misalignment);
            fill(places.clock, &camera.clock);
        }
        let mut root = DMatrix::from_diagonal(&sigmas.map(|s| if s > 0.0 { 1.0 / s } else { 0.0 }));
        for (lens, places) in lenses.iter().zip(&places.lenses) {
            let Some(lens) = lens else { continue };
            for (first, place) in places.each() {
                for i in 0..place.len {
                    sigmas[column(place) + i] = lens.prior()[(first + i, first + i)].sqrt();
                }
            }
            let information = lens.information(*places);
            for ((row, at), (with, beside)) in pairs(*places) {
                root[(at, beside)] = information[(row, with)];
            }
        }
        Self { sigmas, root }
    }
}

/// Returns all pairs of the unknowns of a lens: the number of each parameter, and its column in the block.
fn pairs(places: LensPlaces) -> impl Iterator<Item = ((usize, usize), (usize, usize))> {
    let columns =
        move || places.each().flat_map(|(first, place)| (0..place.len).map(move |i| (first + i, column(place) + i)));
    columns().flat_map(move |a| columns().map(move |b| (a, b)))
}
