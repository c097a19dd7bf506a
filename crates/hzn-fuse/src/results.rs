//! What comes out of a flight.

use std::collections::BTreeMap;

use hzn_nav::filter::{Corrections, Filter};
use hzn_nav::frames::{Cam, Covariance, Fixed, Rotation, Vector, Vehicle};
use hzn_nav::gravity::earth_rate;
use hzn_nav::layout::{Layout, Place};
use hzn_nav::strapdown::Nominal;
use nalgebra::{Matrix3, Vector3};

use crate::finding::Verdict;
use crate::input::Body;

/// The estimated errors of a camera.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CameraState {
    /// Rotation vector from the told mount to the estimated one, rad.
    pub misalignment_rad: Vector<Cam>,
    /// Its 1-sigma about each axis of the camera, rad.
    pub misalignment_sigma_rad: Vector3<f64>,
    /// Time that the camera's clock is late, s.
    pub clock_s: f64,
    /// Its 1-sigma, s; 0 if it does not exist.
    pub clock_sigma_s: f64,
    /// The estimated mount.
    pub mount: Rotation<Cam, Vehicle>,
    /// Largest 1-sigma of the attitude of the camera against ECEF about any axis, rad.
    pub camera_sigma_rad: f64,
}

/// The solution at a time.
#[derive(Debug, Clone, PartialEq)]
pub struct Epoch {
    /// Time, attitude, velocity and position.
    pub state: Nominal,
    /// Covariance of the attitude: of a rotation vector, rad².
    pub attitude_covariance_rad2: Covariance<Vehicle>,
    /// Covariance of the velocity, m²/s².
    pub velocity_covariance_m2_s2: Covariance<Fixed>,
    /// Covariance of the position, m².
    pub position_covariance_m2: Covariance<Fixed>,
    /// Covariance of position and velocity, by rows and columns, m²/s.
    pub position_velocity_covariance_m2_s: Matrix3<f64>,
    /// Estimated errors of the instruments.
    pub corrections: Corrections,
    /// 1-sigma of the gyros' biases, rad/s; 0 if they do not exist.
    pub gyro_bias_sigma_rad_s: Vector3<f64>,
    /// 1-sigma of the accelerometers' biases, m/s²; 0 if they do not exist.
    pub accel_bias_sigma_m_s2: Vector3<f64>,
    /// 1-sigma of the limb height, km; 0 if it does not exist.
    pub limb_height_sigma_km: f64,
    /// 1-sigma of the coefficients of its change with the latitude, km; 0 if they do not exist.
    pub limb_latitude_sigma_km: [f64; 2],
    /// The cameras, in the order of the recordings.
    pub cameras: Vec<CameraState>,
    /// Rate of the vehicle against the Earth, rad/s.
    pub rate_rad_s: Vector<Vehicle>,
    /// The strapdown solution from the start on without any aid.
    pub unaided: Option<Unaided>,
}

/// The attitude of the strapdown solution without any aid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Unaided {
    /// Attitude.
    pub attitude: Rotation<Vehicle, Fixed>,
    /// Covariance of the attitude: of a rotation vector, rad². It has the first attitude's, and what the errors and the
    /// noise of the gyros add.
    pub covariance_rad2: Covariance<Vehicle>,
}

impl Unaided {
    /// Returns the attitude of a filter that takes no measurement.
    pub(crate) fn of<const N: usize>(filter: &Filter<N>) -> Self {
        let attitude = filter.nominal().attitude;
        let covariance = filter.covariance().fixed_view::<3, 3>(Layout::ATTITUDE, Layout::ATTITUDE).into_owned();
        Self { attitude, covariance_rad2: Covariance::<Fixed>::from(covariance).rotated(&attitude.inverse()) }
    }
}

impl Epoch {
    /// Returns the solution of a filter.
    pub(crate) fn of<const N: usize>(filter: &Filter<N>, unaided: Option<Unaided>) -> Self {
        let layout = filter.layout();
        let sigmas = |place: Option<Place>| place.map_or_else(Vector3::zeros, |p| filter.sigmas(p.first));
        let one = |place: Option<Place>| place.map_or(0.0, |p| filter.sigmas(p.first).x);
        let to_vehicle = filter.nominal().attitude.inverse();
        let covariance =
            |first: usize| Covariance::<Fixed>::from(filter.covariance().fixed_view::<3, 3>(first, first).into_owned());
        let inertial = filter.last_imu().map(|imu| filter.corrections().correct(&imu).gyro_rad_s);
        let rate = inertial.unwrap_or_default() - to_vehicle * earth_rate();
        let camera = |which: usize| {
            let (camera, places) = (filter.camera(which)?, layout.cameras.get(which)?);
            Some(CameraState {
                misalignment_rad: (camera.options.mount.inverse() * camera.mount).scaled_axis(),
                misalignment_sigma_rad: sigmas(places.misalignment),
                clock_s: camera.clock_s,
                clock_sigma_s: one(places.clock),
                mount: camera.mount,
                camera_sigma_rad: camera_sigma_rad(filter, &camera.mount, places.misalignment),
            })
        };
        Self {
            state: *filter.nominal(),
            attitude_covariance_rad2: covariance(Layout::ATTITUDE).rotated(&to_vehicle),
            velocity_covariance_m2_s2: covariance(Layout::VELOCITY),
            position_covariance_m2: covariance(Layout::POSITION),
            position_velocity_covariance_m2_s: filter
                .covariance()
                .fixed_view::<3, 3>(Layout::POSITION, Layout::VELOCITY)
                .into_owned(),
            corrections: *filter.corrections(),
            gyro_bias_sigma_rad_s: sigmas(layout.gyro_bias),
            accel_bias_sigma_m_s2: sigmas(layout.accel_bias),
            limb_height_sigma_km: one(layout.limb_height),
            limb_latitude_sigma_km: {
                let sigma = sigmas(layout.limb_latitude);
                [sigma.x, sigma.y]
            },
            cameras: (0..).map_while(camera).collect(),
            rate_rad_s: rate,
            unaided,
        }
    }

    /// Returns the 1-sigma of the position along the velocity, m.
    pub fn along_sigma_m(&self) -> f64 {
        let along = self.state.velocity_m_s.into_inner().try_normalize(0.0).unwrap_or_else(Vector3::x);
        (along.dot(&(self.position_covariance_m2.as_inner() * along))).max(0.0).sqrt()
    }

    /// Returns the 1-sigma of the attitude about the axes of the vehicle, rad.
    pub fn attitude_sigma_rad(&self) -> Vector3<f64> {
        self.attitude_covariance_rad2.as_inner().diagonal().map(|v| v.max(0.0).sqrt())
    }
}

/// Returns the largest 1-sigma of the attitude of a camera: attitude and misalignment have common errors.
fn camera_sigma_rad<const N: usize>(
    filter: &Filter<N>,
    mount: &Rotation<Cam, Vehicle>,
    misalignment: Option<Place>,
) -> f64 {
    let p = filter.covariance();
    let part = |i: usize, j: usize| p.fixed_view::<3, 3>(i, j).into_owned();
    let attitude = part(Layout::ATTITUDE, Layout::ATTITUDE);
    let to_camera = (filter.nominal().attitude * *mount).inverse().to_matrix();
    let mut total = to_camera * attitude * to_camera.transpose();
    if let Some(place) = misalignment {
        let cross = to_camera * part(Layout::ATTITUDE, place.first);
        total += cross + cross.transpose() + part(place.first, place.first);
    }
    total.symmetric_eigenvalues().max().max(0.0).sqrt()
}

/// The kind of a measurement.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Kind {
    /// A direction of a camera, rad.
    Direction(Body),
    /// A position from the limb, m.
    Centre,
    /// A position of the receiver, m.
    Position,
    /// A velocity of the receiver, m/s.
    Velocity,
    /// An attitude of a star tracker, rad.
    Attitude,
}

impl Kind {
    /// Returns the word for messages and files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Direction(body) => body.name(),
            Self::Centre => "limb-position",
            Self::Position => "position",
            Self::Velocity => "velocity",
            Self::Attitude => "attitude",
        }
    }
}

/// The difference of a measurement from the solution before it.
#[derive(Debug, Clone, PartialEq)]
pub struct Innovation {
    /// Time, s.
    pub time_s: f64,
    /// Number of the camera; `None` for receiver and star tracker.
    pub camera: Option<usize>,
    /// The kind of the measurement.
    pub kind: Kind,
    /// The innovation: two numbers for a direction, three for others, in the unit of the kind.
    pub value: Vec<f64>,
    /// Its 1-sigma.
    pub sigma: Vec<f64>,
    /// The square of the innovation over its covariance.
    pub nis: f64,
    /// Whether it passed the gate.
    pub taken: bool,
    /// Angle of a direction from the solution, rad.
    pub angle_rad: Option<f64>,
    /// Angle of a direction from the unaided solution, rad.
    pub unaided_rad: Option<f64>,
    /// Largest 1-sigma of a direction by the sensor itself, rad.
    pub sensor_sigma_rad: Option<f64>,
}

/// An attitude from two directions at one time, without the filter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Triad {
    /// Time, s.
    pub time_s: f64,
    /// Attitude.
    pub attitude: Rotation<Vehicle, Fixed>,
    /// Its angle from the filter's attitude, rad.
    pub angle_rad: f64,
    /// Its angle from the unaided attitude, rad.
    pub unaided_rad: f64,
}

/// How the filter began.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Begin {
    /// Time, s.
    pub time_s: f64,
    /// Number of directions in the first attitude; 0 for a star tracker.
    pub directions: usize,
    /// Angle of the misfit over its sigma, squared and summed.
    pub chi2: f64,
}

/// Counts of what happened to the data.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Counts {
    /// Samples of the inertial unit.
    pub samples: usize,
    /// Samples with a number that is not finite.
    pub samples_not_finite: usize,
    /// Samples with the time of the sample before.
    pub samples_duplicate: usize,
    /// Samples that are older than the sample before.
    pub samples_out_of_order: usize,
    /// Gaps between samples.
    pub gaps: usize,
    /// Samples with a channel at its limit: as the file says, or as their equal numbers show.
    pub saturated: usize,
    /// Samples that repeat an earlier one to the last digit, because the unit stood still.
    pub frozen: usize,
    /// Measurements before the start.
    pub before_start: usize,
    /// Measurements outside the time of the inertial unit.
    pub outside: usize,
    /// Measurements that the filter cannot use, by their source and the reason.
    pub unusable: BTreeMap<(String, &'static str), usize>,
    /// Directions whose reference is not known.
    pub without_reference: usize,
    /// Directions while the attitude was not known well enough for the filter.
    pub waiting: usize,
    /// How often the filter began again.
    pub restarts: usize,
    /// How often of these because the measurements refused its attitude, and not because it was unknown.
    pub restarts_when_wrong: usize,
}

impl Counts {
    /// Counts measurements of a source that the filter cannot use.
    pub(crate) fn add_unusable(&mut self, source: impl Into<String>, why: &'static str, count: usize) {
        if count > 0 {
            *self.unusable.entry((source.into(), why)).or_default() += count;
        }
    }
}

/// What a solve of the whole flight found out about an error that lasts the whole flight.
#[derive(Debug, Clone, PartialEq)]
pub struct Determined {
    /// The error in words.
    pub name: String,
    /// The unit of the numbers.
    pub unit: &'static str,
    /// The estimate of each component.
    pub estimate: Vec<f64>,
    /// Its 1-sigma.
    pub sigma: Vec<f64>,
    /// 1-sigma of what was known before.
    pub before: Vec<f64>,
}

/// A measurement that a solve of the whole flight counts less, because it differs by more than its sigma explains.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lowered {
    /// Time, s.
    pub time_s: f64,
    /// Number of the camera; `None` for receiver and star tracker.
    pub camera: Option<usize>,
    /// The kind of the measurement.
    pub kind: Kind,
    /// Its difference over its sigma.
    pub sigmas: f64,
    /// Its weight; that of others is 1.
    pub weight: f64,
}

/// The orbit of a satellite.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Orbit {
    /// Semi-major axis at the end, m.
    pub semi_axis_m: f64,
    /// Eccentricity at the end.
    pub eccentricity: f64,
    /// Inclination at the end, rad.
    pub inclination_rad: f64,
    /// 1-sigma of the position radial, along and across the orbit, m: root of the mean over the pictures.
    pub sigma_m: [f64; 3],
    /// The same of the posterior Cramér-Rao bound: no estimator has a smaller error. It is below the sigma where
    /// measurements count less.
    pub bound_m: [f64; 3],
}

/// How the whole flight was solved at once.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Solved {
    /// Number of unknowns.
    pub unknowns: usize,
    /// Number of states.
    pub knots: usize,
    /// Number of numbers in the factor of the normal equations: time and memory grow with it.
    pub factor_numbers: usize,
    /// Number of steps.
    pub steps: usize,
    /// Whether the last step changed less than a thousandth of what a sigma does.
    pub is_converged: bool,
    /// The sum of the squares of all errors over their sigmas, at the filter's solution and at the end.
    pub cost: [f64; 2],
    /// What was found out about the errors that last the whole flight.
    pub determined: Vec<Determined>,
    /// Measurements that count less.
    pub lowered: Vec<Lowered>,
    /// The shares of the unknown limb height in the variance of the limbs' directions, as they were known before, and
    /// in that of the attitude, over the whole flight: with a known height, the variance would be smaller by this
    /// share.
    /// `None` if the limb height is known, or if the recordings do not have the derivative of the axis.
    pub limb_share: Option<[f64; 2]>,
    /// Number of measurements of each source.
    pub sources: BTreeMap<(Option<usize>, Kind), usize>,
    /// The orbit, if it joined the states instead of an inertial unit.
    pub orbit: Option<Orbit>,
}

/// The receiver's times against the positions that a recording was made with.
///
/// The solution's position is that of the receiver at the receiver's time, so that a receiver that is late puts it as
/// many metres behind as the vehicle flies in this time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ReceiverLag {
    /// Number of the recording.
    pub camera: usize,
    /// Time by which the receiver is late, s.
    pub lag_s: f64,
    /// Its 1-sigma, s.
    pub sigma_s: f64,
    /// Speed of the vehicle against the Earth, m/s.
    pub speed_m_s: f64,
}

impl ReceiverLag {
    /// Returns whether the lag is more than three sigma from zero, and moves the position by more than three of
    /// `position_sigma_m`.
    pub(crate) fn matters(&self, position_sigma_m: f64) -> bool {
        self.lag_s.abs() > 3.0 * self.sigma_s.hypot(position_sigma_m / self.speed_m_s)
    }
}

/// The results of a flight.
#[derive(Debug, Clone, Default)]
pub struct Fused {
    /// Names of the cameras.
    pub cameras: Vec<String>,
    /// The mounts that were told, in the same order.
    pub told_mounts: Vec<Rotation<Cam, Vehicle>>,
    /// How the filter began.
    pub begin: Option<Begin>,
    /// The solution from the start on.
    pub epochs: Vec<Epoch>,
    /// The solution before the start, integrated back from there as far as the inertial unit measured everything: to
    /// the first sample, or to a gap or a saturated channel.
    pub back: Vec<Epoch>,
    /// The smoothed solution at the measurements; empty without a smoother.
    pub smoothed: Vec<Epoch>,
    /// Every innovation, in the order of time.
    pub innovations: Vec<Innovation>,
    /// Attitudes from pairs of directions.
    pub triads: Vec<Triad>,
    /// How the whole flight was solved at once, if it was; its solutions are those of `smoothed`.
    pub solved: Option<Solved>,
    /// The receiver's times against the positions of each recording that has them.
    pub receiver_lags: Vec<ReceiverLag>,
    /// What happened to the data.
    pub counts: Counts,
    /// Whether the inputs agree with each other.
    pub verdict: Verdict,
    /// What the reader of the results should know.
    pub notes: Vec<String>,
}
