//! The error-state Schmidt-Kalman filter.
//!
//! The nominal state (attitude, velocity, position, and the corrections of the instruments) is integrated with the
//! inertial samples. The filter holds the covariance of its errors: truth minus estimate, the attitude as a rotation
//! vector in ECEF. It is that of the errors, because a quaternion has four numbers for three degrees of freedom, so
//! that a covariance of it would be singular. Errors that are *considered* keep their estimate, and their rows of the
//! gain are 0 (Schmidt 1966). The covariance is updated in Joseph's form.

mod blocks;
mod centre;
mod chi2;
mod direction;
mod limb_latitude;
mod predict;
mod spectrum;
mod states;
mod unusable;
mod update;

use nalgebra::{SMatrix, SVector, Vector3};

use crate::frames::{Cam, Rotation, Vector, Vehicle};
use crate::layout::{Layout, MAX_BODIES, MAX_CAMERAS, Place};
use crate::options::{CameraOptions, Options};
use crate::strapdown::{Imu, Nominal};

use blocks::{set, three};

pub use chi2::chi2_limit;
pub use direction::{DirectionMeasurement, UsableDirection, basis, predict_direction};
pub use limb_latitude::{LatitudeTerm, RADIUS_KM};
pub use predict::Step;
pub use unusable::Unusable;
pub use update::Innovation;

/// Corrections of the instruments: the estimates of their errors.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Corrections {
    /// Bias of the accelerometers, m/s².
    pub accel_bias: Vector<Vehicle>,
    /// Scale factor errors of the accelerometers.
    pub accel_scale: Vector<Vehicle>,
    /// Rotation of the accelerometers' axes, rad.
    pub accel_misalignment: Vector<Vehicle>,
    /// Bias of the gyros, rad/s.
    pub gyro_bias: Vector<Vehicle>,
    /// Scale factor errors of the gyros.
    pub gyro_scale: Vector<Vehicle>,
    /// Rotation of the gyros' axes, rad.
    pub gyro_misalignment: Vector<Vehicle>,
    /// Error of the limb height, km.
    pub limb_height_km: f64,
    /// Coefficients of its change with the latitude, km: see [`Options::limb_latitude`].
    pub limb_latitude_km: [f64; 2],
}

impl Corrections {
    /// Returns the error of the limb height at a latitude (rad), km.
    pub fn limb_height_at_km(&self, latitude_rad: f64) -> f64 {
        let sine = libm::sin(latitude_rad);
        let [first, second] = self.limb_latitude_km;
        self.limb_height_km + first * sine + second * (3.0 * sine * sine - 1.0) / 2.0
    }
}

/// A camera in the filter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Camera {
    /// Its options.
    pub options: CameraOptions,
    /// The mount with the estimated misalignment: rotation from the camera to the vehicle's frame.
    pub mount: Rotation<Cam, Vehicle>,
    /// Estimate of the slow error of the direction to each body.
    pub slow_errors: [Vector<Cam>; MAX_BODIES],
    /// Estimate of the clock offset, s.
    pub clock_s: f64,
    /// Covariance of each slow error, that of the last direction, rad²; `None` before the first one.
    slow_covariances: [Option<nalgebra::Matrix3<f64>>; MAX_BODIES],
}

/// Why a filter cannot be made.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FilterError {
    /// The vector has more components than the filter has memory for.
    TooManyStates {
        /// Number of components that the options need.
        needed: usize,
        /// Number that the filter has.
        memory: usize,
    },
    /// There are more than [`MAX_CAMERAS`] cameras.
    TooManyCameras,
    /// A number of the start or of the options is not finite, or a sigma is negative.
    NotFinite,
}

impl core::fmt::Display for FilterError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::TooManyStates { needed, memory } => {
                write!(f, "the options need {needed} states, but the filter has memory for {memory}")
            }
            Self::TooManyCameras => write!(f, "the filter has memory for {MAX_CAMERAS} cameras"),
            Self::NotFinite => {
                f.write_str("a number of the start or of the options is not finite, or a sigma is below 0")
            }
        }
    }
}

impl core::error::Error for FilterError {}

/// The filter, with memory for N components of the error. The memory is a parameter of the type, because there is no
/// heap; a smaller filter is faster.
///
/// ```
/// use hzn_nav::filter::{DirectionMeasurement, Filter};
/// use hzn_nav::frames::{Covariance, Rotation, Vector};
/// use hzn_nav::layout::Layout;
/// use hzn_nav::options::{CameraOptions, Options};
/// use hzn_nav::strapdown::Nominal;
///
/// let start = Nominal {
///     time_s: 0.0,
///     attitude: Rotation::identity(),
///     velocity_m_s: Vector::zeros(),
///     position_m: Vector::new(6.9e6, 0.0, 0.0),
/// };
/// let mut filter = Filter::<40>::new(start, &Options::default(), &[CameraOptions::default()])?;
/// // Camera, vehicle and Earth have the same axes here, and nadir is where the filter expects it.
/// let nadir = DirectionMeasurement {
///     camera: 0,
///     body: 0,
///     measured: Vector::new(-1.0, 0.0, 0.0),
///     reference: Vector::new(-1.0, 0.0, 0.0),
///     covariance_rad2: Covariance::across(&Vector::new(-1.0, 0.0, 0.0), 1e-6),
///     common_rad2: None,
///     by_limb_height: Vector::zeros(),
///     is_limb: true,
/// };
/// assert!(filter.update_direction(&nadir)?.taken);
/// // The attitude was known to 2°. A mount that is known to 1° improves it across nadir, but not about it.
/// let sigmas_deg = filter.sigmas(Layout::ATTITUDE).map(f64::to_degrees);
/// assert!((sigmas_deg.x - 2.0).abs() < 1e-9 && (sigmas_deg.y - 0.924).abs() < 1e-3);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct Filter<const N: usize> {
    nominal: Nominal,
    corrections: Corrections,
    cameras: [Option<Camera>; MAX_CAMERAS],
    options: Options,
    layout: Layout,
    covariance: SMatrix<f64, N, N>,
    /// Without corrections, because an update changes them after the sample came: the next step begins with the new
    /// ones.
    last_imu: Option<Imu>,
    /// How long the samples have been saturated or missing without a break, at most the time of [`predict`], s.
    gap_s: f64,
}

impl<const N: usize> Filter<N> {
    /// Makes a filter that begins at a nominal state.
    ///
    /// # Errors
    /// See [`FilterError`].
    pub fn new(start: Nominal, options: &Options, cameras: &[CameraOptions]) -> Result<Self, FilterError> {
        if cameras.len() > MAX_CAMERAS {
            return Err(FilterError::TooManyCameras);
        }
        let layout = Layout::new(options, cameras);
        if layout.len > N {
            return Err(FilterError::TooManyStates { needed: layout.len, memory: N });
        }
        let mut filter = Self {
            nominal: start,
            corrections: Corrections::default(),
            cameras: [None; MAX_CAMERAS],
            options: *options,
            layout,
            covariance: SMatrix::zeros(),
            last_imu: None,
            gap_s: 0.0,
        };
        for (slot, options) in filter.cameras.iter_mut().zip(cameras) {
            *slot = Some(Camera {
                options: *options,
                mount: options.mount,
                slow_errors: [Vector::zeros(); MAX_BODIES],
                clock_s: 0.0,
                slow_covariances: [None; MAX_BODIES],
            });
        }
        filter.fill_covariance(cameras);
        let finite = filter.covariance.iter().all(|x| x.is_finite() && *x >= 0.0)
            && start.attitude.is_finite()
            && start.velocity_m_s.is_finite()
            && start.position_m.is_finite()
            && start.time_s.is_finite();
        if finite { Ok(filter) } else { Err(FilterError::NotFinite) }
    }

    /// Returns the place of the change of the limb height with the latitude, and its effect from here.
    fn limb_latitude(&self) -> Option<(Place, [LatitudeTerm; 2])> {
        Some((self.layout.limb_latitude?, LatitudeTerm::both(&self.nominal.position_m)?))
    }

    /// Fills the diagonal with the variances of the start.
    fn fill_covariance(&mut self, cameras: &[CameraOptions]) {
        let (layout, start, imu) = (self.layout, self.options.start, self.options.imu);
        // A negative sigma becomes a negative variance, so that `new` finds and refuses it.
        let mut fill = |place: Place, sigma: f64| {
            for i in place.first..place.first + place.len {
                set(&mut self.covariance, (i, i), sigma * libm::fabs(sigma));
            }
        };
        let vehicle = |first| Place { first, len: 3, considered: false };
        fill(vehicle(Layout::ATTITUDE), start.attitude_rad);
        fill(vehicle(Layout::VELOCITY), start.velocity_m_s);
        fill(vehicle(Layout::POSITION), start.position_m);
        // The slow errors are not among these, because their variance comes with the first direction.
        let blocks = [
            (layout.accel_bias, imu.accel_bias),
            (layout.accel_scale, imu.accel_scale),
            (layout.accel_misalignment, imu.accel_misalignment),
            (layout.gyro_bias, imu.gyro_bias),
            (layout.gyro_scale, imu.gyro_scale),
            (layout.gyro_misalignment, imu.gyro_misalignment),
            (layout.limb_height, self.options.limb_height),
            (layout.limb_latitude, self.options.limb_latitude),
        ];
        for (place, block) in blocks {
            place.into_iter().for_each(|place| fill(place, block.sigma));
        }
        for (places, camera) in layout.cameras.iter().zip(cameras) {
            places.misalignment.into_iter().for_each(|place| fill(place, camera.misalignment.sigma));
            places.clock.into_iter().for_each(|place| fill(place, camera.clock.sigma));
        }
    }

    /// Returns the estimated state.
    pub fn nominal(&self) -> &Nominal {
        &self.nominal
    }

    /// Returns the last inertial sample, without corrections.
    pub fn last_imu(&self) -> Option<Imu> {
        self.last_imu
    }

    /// Returns the state and the covariance to be changed.
    pub(crate) fn parts_mut(&mut self) -> (&mut Nominal, &mut SMatrix<f64, N, N>) {
        (&mut self.nominal, &mut self.covariance)
    }

    /// Returns the estimated errors of the instruments to be changed.
    pub(crate) fn corrections_mut(&mut self) -> &mut Corrections {
        &mut self.corrections
    }

    /// Returns the estimated errors of the instruments.
    pub fn corrections(&self) -> &Corrections {
        &self.corrections
    }

    /// Returns a camera with its estimated errors.
    pub fn camera(&self, which: usize) -> Option<&Camera> {
        self.cameras.get(which)?.as_ref()
    }

    /// Returns the places of the errors in the covariance.
    pub fn layout(&self) -> &Layout {
        &self.layout
    }

    /// Returns the covariance of the errors: rad² (ECEF), m²/s², m², then the units of the blocks.
    pub fn covariance(&self) -> &SMatrix<f64, N, N> {
        &self.covariance
    }

    /// Returns the 1-sigma of three components, for example of the attitude with [`Layout::ATTITUDE`]. Their axes are
    /// those of the error: see [`Layout`].
    pub fn sigmas(&self, first: usize) -> Vector3<f64> {
        Vector3::from_fn(|i, _| self.covariance.get((first + i, first + i)).map_or(0.0, |v| libm::sqrt(v.max(0.0))))
    }

    /// Moves the estimates by the errors, which become 0.
    fn apply(&mut self, error: &SVector<f64, N>) {
        let one = |place: Option<Place>| place.and_then(|p| error.get(p.first).copied()).unwrap_or(0.0);
        // The attitude error is in ECEF, so it multiplies from the left.
        let turn = Rotation::from_scaled_axis(three(error, Layout::ATTITUDE).into());
        self.nominal.attitude = (turn * self.nominal.attitude).renormalized();
        self.nominal.velocity_m_s += three(error, Layout::VELOCITY).into();
        self.nominal.position_m += three(error, Layout::POSITION).into();
        let (layout, c) = (self.layout, &mut self.corrections);
        c.accel_bias += at(error, layout.accel_bias);
        c.accel_scale += at(error, layout.accel_scale);
        c.accel_misalignment += at(error, layout.accel_misalignment);
        c.gyro_bias += at(error, layout.gyro_bias);
        c.gyro_scale += at(error, layout.gyro_scale);
        c.gyro_misalignment += at(error, layout.gyro_misalignment);
        c.limb_height_km += one(layout.limb_height);
        if let Some(place) = layout.limb_latitude {
            for (i, coefficient) in c.limb_latitude_km.iter_mut().enumerate() {
                *coefficient += error.get(place.first + i).copied().unwrap_or(0.0);
            }
        }
        for (camera, places) in self.cameras.iter_mut().flatten().zip(&layout.cameras) {
            // The error is in the camera frame, as its derivative has it, so it multiplies from the right. Braun & Barf
            // 2022 print it on the left (50): that diverges, see `tests/nav/printed.rs`.
            let turn = Rotation::from_scaled_axis(at(error, places.misalignment));
            camera.mount = (camera.mount * turn).renormalized();
            for (slow, place) in camera.slow_errors.iter_mut().zip(places.slow_errors) {
                *slow += at(error, place);
            }
            camera.clock_s += one(places.clock);
        }
    }
}

/// Returns the three components of an error; 0 if it is off.
fn at<F, const N: usize>(error: &SVector<f64, N>, place: Option<Place>) -> Vector<F> {
    place.map_or_else(Vector::zeros, |p| three(error, p.first).into())
}
