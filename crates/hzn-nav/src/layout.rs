//! The places of the errors in the filter's vector.
//!
//! The places are found once, from the options. An error that is off takes no place, so that a smaller filter has
//! memory for the others: the time of a step grows with the square of this memory. An error that is only considered has
//! a place, because it widens the others.

use crate::options::{Block, CameraOptions, Mode, Options};

/// Largest number of cameras.
pub const MAX_CAMERAS: usize = 4;
/// Largest number of bodies that a camera sees: limb, Sun, Moon.
pub const MAX_BODIES: usize = 3;

/// Place of an error in the vector.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Place {
    /// Index of the first component.
    pub first: usize,
    /// Number of components.
    pub len: usize,
    /// Whether the error is considered only.
    pub considered: bool,
}

/// Places of the errors of one camera; `None` for an error that is off.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct CameraPlaces {
    /// Error of the mount (camera frame), rad.
    pub misalignment: Option<Place>,
    /// Slow error of the direction to each body (camera frame).
    pub slow_errors: [Option<Place>; MAX_BODIES],
    /// Clock offset, s.
    pub clock: Option<Place>,
}

/// Places of all errors. Attitude (ECEF), velocity and position are always the first nine.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Layout {
    /// Bias of the accelerometers.
    pub accel_bias: Option<Place>,
    /// Scale of the accelerometers.
    pub accel_scale: Option<Place>,
    /// Rotation of the accelerometers' axes.
    pub accel_misalignment: Option<Place>,
    /// Bias of the gyros.
    pub gyro_bias: Option<Place>,
    /// Scale of the gyros.
    pub gyro_scale: Option<Place>,
    /// Rotation of the gyros' axes.
    pub gyro_misalignment: Option<Place>,
    /// Limb height, km.
    pub limb_height: Option<Place>,
    /// Change of the limb height with the latitude, km.
    pub limb_latitude: Option<Place>,
    /// Errors of the cameras.
    pub cameras: [CameraPlaces; MAX_CAMERAS],
    /// Number of components.
    pub len: usize,
}

impl Layout {
    /// First component of the attitude error. These places are constants, so that the matrices of the prediction have a
    /// size that the compiler knows.
    pub const ATTITUDE: usize = 0;
    /// First component of the velocity error.
    pub const VELOCITY: usize = 3;
    /// First component of the position error.
    pub const POSITION: usize = 6;
    /// Number of components that exist always.
    pub const VEHICLE: usize = 9;

    /// Places the errors that are not off. Cameras beyond [`MAX_CAMERAS`] are not placed.
    pub fn new(options: &Options, cameras: &[CameraOptions]) -> Self {
        let mut layout = Self { len: Self::VEHICLE, ..Self::default() };
        let imu = &options.imu;
        layout.accel_bias = layout.place(imu.accel_bias, 3);
        layout.accel_scale = layout.place(imu.accel_scale, 3);
        layout.accel_misalignment = layout.place(imu.accel_misalignment, 3);
        layout.gyro_bias = layout.place(imu.gyro_bias, 3);
        layout.gyro_scale = layout.place(imu.gyro_scale, 3);
        layout.gyro_misalignment = layout.place(imu.gyro_misalignment, 3);
        layout.limb_height = layout.place(options.limb_height, 1);
        layout.limb_latitude = layout.place(options.limb_latitude, 2);
        for (i, camera) in cameras.iter().take(MAX_CAMERAS).enumerate() {
            let misalignment = layout.place(camera.misalignment, 3);
            let mut slow_errors = [None; MAX_BODIES];
            for place in slow_errors.iter_mut().take(camera.bodies) {
                // The sigma comes with each direction, so the block has none of its own. There are three components,
                // although a direction has two, because the plane across it moves through the picture.
                *place = layout.place(Block { mode: camera.slow_error, sigma: 1.0 }, 3);
            }
            let clock = layout.place(camera.clock, 1);
            if let Some(places) = layout.cameras.get_mut(i) {
                *places = CameraPlaces { misalignment, slow_errors, clock };
            }
        }
        layout
    }

    fn place(&mut self, block: Block, len: usize) -> Option<Place> {
        let place = Place { first: self.len, len, considered: block.mode == Mode::Considered };
        (block.mode != Mode::Off).then(|| {
            self.len += len;
            place
        })
    }

    /// Returns whether a component is considered only.
    pub fn is_considered(&self, index: usize) -> bool {
        self.all().any(|p| p.considered && (p.first..p.first + p.len).contains(&index))
    }

    /// Returns the places of all errors that exist besides the first nine components.
    pub fn all(&self) -> impl Iterator<Item = Place> + '_ {
        let imu = [
            self.accel_bias,
            self.accel_scale,
            self.accel_misalignment,
            self.gyro_bias,
            self.gyro_scale,
            self.gyro_misalignment,
            self.limb_height,
            self.limb_latitude,
        ];
        let cameras = self.cameras.iter().flat_map(|c| [c.misalignment, c.clock].into_iter().chain(c.slow_errors));
        imu.into_iter().chain(cameras).flatten()
    }
}
