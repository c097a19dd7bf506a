//! The prior of one picture: what is known about it before it is processed.

use crate::geometry::frames::{Cam, Fixed, Rotation, UnitVec3};

/// The data known about one picture before it is processed. Every field may be missing.
///
/// # Example
///
/// A position in the fixed frame (ECEF for the Earth) determines the cone of the ellipsoid. An attitude, good to a few
/// degrees, corrects its shape:
///
/// ```
/// use hzn_core::Prior;
/// use hzn_core::frames::Rotation;
///
/// let prior = Prior::<f64> {
///     position_m: Some([6_771e3, 0.0, 0.0]),
///     // The quaternion is scalar first, and converts coordinates from the camera to the fixed frame.
///     fixed_from_camera: Rotation::assume_from_quaternion([0.5, 0.5, 0.5, 0.5]),
///     attitude_sigma_rad: Some(3f64.to_radians()),
///     ..Prior::default()
/// };
/// assert!(prior.altitude_m.is_none() && prior.fixed_from_camera.is_some());
/// ```
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Prior<T> {
    /// Altitude in metres: geodetic above WGS-84 for `earth`, else above the radius. It must be above the limb height.
    pub altitude_m: Option<T>,
    /// Position of the camera in the fixed frame, metres. A known position replaces the altitude.
    pub position_m: Option<[T; 3]>,
    /// A prior attitude, from the camera to the fixed frame; an accuracy of a few degrees is enough. It gives the
    /// azimuth for the ellipsoid's correction. With a position it is also a gate, see `gates.max_attitude_sigma`.
    pub fixed_from_camera: Option<Rotation<Cam, Fixed, T>>,
    /// Direction of the body's north pole in the camera frame, for a body of revolution whose position is fitted. An
    /// attitude takes its place.
    pub pole: Option<UnitVec3<Cam, T>>,
    /// Distance of the camera from the body's centre in metres, for a body whose position is fitted. It takes the place
    /// of the altitude.
    pub range_m: Option<T>,
    /// 1-sigma of that distance in metres.
    pub range_sigma_m: Option<T>,
    /// Threshold that the previous picture proposes, in counts: the `next_level` of its report, for
    /// `threshold.method = "track"`. A [`Horizon`](crate::Horizon) stores this value between pictures.
    pub level: Option<u16>,
    /// Direction to the Sun in the camera frame. It is used by a gate, see `gates.max_unlit`.
    pub sun: Option<UnitVec3<Cam, T>>,
    /// Elevation of the Sun above the horizon at the point below the camera, radians; it follows from the time and the
    /// position. At night no limb is seen in sunlight, see `gates.max_unlit`.
    pub sun_elevation_rad: Option<T>,
    /// Part of the year that has passed, 0 to 1, see [`year_part`](super::year_part). With a position it selects the
    /// height of a limb whose band has a table.
    pub year_part: Option<T>,
    /// 1-sigma of the prior attitude about the axis in radians, 0 or more; 5 degrees if it is left out. It widens the
    /// covariance by the part of the ellipsoid's shape that then remains uncertain. From 30 degrees on, the attitude
    /// does not correct the shape at all.
    pub attitude_sigma_rad: Option<T>,
    /// The last answer, for `gates.max_rate_deg_s`.
    pub last: Option<Last<T>>,
    /// The camera's rate of rotation in its own axes, rad/s, up to 1000. It is for a camera with a rolling shutter
    /// (`camera.readout_s`), whose rows are exposed at different times. The picture's time is that of its middle row.
    pub rate_rad_s: Option<[T; 3]>,
    /// Temperature of the camera, °C, for a lens that changes with it (`camera.temperature`).
    pub camera_temperature_c: Option<T>,
}

impl<T> Prior<T> {
    /// Returns whether place and season are known.
    pub(super) fn is_placed(&self) -> bool {
        self.position_m.is_some() && self.year_part.is_some()
    }
}

/// The answer to an earlier picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Last<T> {
    /// The axis in the camera frame.
    pub axis: UnitVec3<Cam, T>,
    /// The 1-sigma of the axis in radians, 0 or more.
    pub sigma_rad: T,
    /// Time since the earlier picture was exposed, seconds.
    pub age_s: T,
}

/// Reason why the prior of a picture is refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PriorError {
    /// The altitude is not a finite number, or is too low for any camera.
    Altitude,
    /// The position is not finite, or inside the body.
    Position,
    /// The camera is not above the limb height, so that the limb surrounds it and there is no cone. A rocket flight
    /// begins below the limb height.
    BelowLimb {
        /// Altitude of the camera in metres.
        altitude_m: i32,
        /// Limb height in metres.
        limb_m: i32,
    },
    /// Neither the prior nor the configuration has an altitude.
    NoAltitude,
    /// The attitude is not a rotation.
    Attitude,
    /// The sigma of the attitude is not a finite number, or is negative.
    AttitudeSigma,
    /// The rate of rotation is not finite, or is too large.
    Rate,
    /// The temperature of the camera is not finite, or is too far from the reference of the lens.
    Temperature,
    /// The part of the year is not a number from 0 to 1.
    YearPart,
    /// The distance is not a finite number above 0.
    Range,
    /// The 1-sigma of the distance is missing, not a finite number, or negative.
    RangeSigma,
    /// The distance and the position contradict each other.
    Contradiction {
        /// The distance in metres.
        range_m: i64,
        /// The distance of the position from the centre in metres.
        position_m: i64,
    },
    /// The camera is inside the body.
    Inside {
        /// Distance of the camera from the centre in metres.
        distance_m: i64,
        /// Distance of the limb's surface from the centre in the same direction, or the smallest semi-axis; metres.
        limit_m: i64,
    },
    /// The pole does not orient the body, because its two other semi-axes differ.
    Pole,
    /// The disc of the body is too small in the picture.
    TooSmall {
        /// Diameter of the disc in hundredths of a pixel.
        diameter_px_100: i32,
    },
    /// The limb lies outside of the picture on all sides, by more than five sigmas of the attitude.
    Fills {
        /// Half-angle of the limb in hundredths of a degree.
        half_angle_deg_100: i32,
        /// Smallest angle from the border of the picture to the limb, in hundredths of a degree.
        beyond_deg_100: i32,
    },
    /// The sensor has no body with that number.
    NoBody,
    /// No configuration was accepted yet.
    NotConfigured,
}

impl core::fmt::Display for PriorError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Altitude => "altitude_km must be a finite number above -1 (kilometres)",
            Self::Position => "x_km, y_km, z_km must be finite and outside the body (fixed frame, kilometres)",
            Self::BelowLimb { altitude_m, limb_m } => {
                let [altitude, limb] = [altitude_m, limb_m].map(|m| f64::from(*m) / 1e3);
                let place = if altitude < limb { "below" } else { "not above" };
                return write!(f, "altitude {altitude} km is {place} the limb height {limb} km");
            }
            Self::YearPart => "the part of the year must be a number from 0 to 1",
            Self::Attitude => "qw, qx, qy, qz must be a rotation: the quaternion's length must be 1 within 0.01",
            Self::AttitudeSigma => "attitude_sigma_deg must be a finite number, 0 or more",
            Self::Rate => "rate_x, rate_y, rate_z must be finite and at most 1000 (rad/s)",
            Self::Temperature => {
                "camera_temperature_c must be a finite number (degrees Celsius), near enough to \
                 camera.temperature.reference_c that focal length and centre change by at most 1 %"
            }
            Self::NoAltitude => {
                "no altitude: set body.altitude_km, or give altitude_km or x_km, y_km, z_km with the frame"
            }
            Self::Range => "range_km must be a finite number above 0 (kilometres)",
            Self::RangeSigma => "range_km needs range_sigma_km, a finite number, 0 or more (kilometres)",
            Self::Contradiction { range_m, position_m } => {
                let [range, position] = [range_m, position_m].map(|m| *m as f64 / 1e3);
                return write!(
                    f,
                    "range_km is {range} but x_km, y_km, z_km lie {position} km from the centre; they may differ by 5 \
                     range_sigma_km"
                );
            }
            Self::Inside { distance_m, limit_m } => {
                let [distance, limit] = [distance_m, limit_m].map(|m| *m as f64 / 1e3);
                return write!(f, "the camera is {distance} km from the centre, inside the body ({limit} km)");
            }
            Self::Pole => "pole_x, pole_y, pole_z do not orient a body with three different radii; give qw, qx, qy, qz",
            Self::TooSmall { diameter_px_100 } => {
                let diameter = f64::from(*diameter_px_100) / 100.0;
                return write!(f, "the body is {diameter} px wide at this distance; the smallest is 8 px");
            }
            Self::Fills { half_angle_deg_100, beyond_deg_100 } => {
                let [half_angle, beyond] = [half_angle_deg_100, beyond_deg_100].map(|x| f64::from(*x) / 100.0);
                return write!(
                    f,
                    "the body fills the picture: its limb, {half_angle} deg from its centre, is {beyond} deg or more \
                     beyond the border of the picture, which is over 5 attitude_sigma_deg"
                );
            }
            Self::NoBody => "the sensor has no body with this number",
            Self::NotConfigured => "the sensor has no configuration yet: call `configure` first",
        })
    }
}
impl core::error::Error for PriorError {}
