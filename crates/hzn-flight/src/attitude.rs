//! The attitude of the camera and the direction to the Sun, moved from their time to the exposure of a picture.

use hzn_core::Prior;
use hzn_core::body::Kind;
use hzn_core::frames::{Rotation, UnitVec3};
use hzn_core::real::Real;

/// Rate of rotation of the Earth, rad/s (WGS-84).
pub(crate) const OMEGA: f32 = 7.292_115e-5;
/// Largest difference of the length of a quaternion from 1, as for the columns `qw` to `qz` of frames.csv.
const LENGTH_TOLERANCE: f32 = 0.01;

/// The attitude and the direction to the Sun at one time; each may be unknown.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct AttitudeAndSun {
    q_fixed_from_camera_wxyz: Option<[f32; 4]>,
    sigma_rad: Option<f32>,
    sun: Option<[f32; 3]>,
}

/// Why values are refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Refused {
    /// Only a part of the numbers of the quaternion, or of the direction, is known; or there is a sigma without a
    /// quaternion. The place is that of the first number that is missing.
    Missing(u16),
    /// A number is impossible.
    Impossible(u16),
}

// Places of the numbers among the arguments of `AttitudeAndSun::try_new`, from 0.
const SIGMA: u16 = 4;
const SUN: u16 = 5;

/// Returns the numbers; `None` if all of them are NaN. `first` is the place of the first one.
fn known<const N: usize>(v: [f32; N], first: u16) -> Result<Option<[f32; N]>, Refused> {
    let find = |is_wrong: fn(&f32) -> bool| (first..).zip(v).find(|(_, x)| is_wrong(x)).map(|(place, _)| place);
    if v.iter().all(|x| x.is_nan()) {
        return Ok(None);
    }
    match (find(|x| x.is_nan()), find(|x| x.is_infinite())) {
        (Some(place), _) => Err(Refused::Missing(place)),
        (None, Some(place)) => Err(Refused::Impossible(place)),
        (None, None) => Ok(Some(v)),
    }
}

impl AttitudeAndSun {
    /// Makes the values: a unit quaternion from the camera to the fixed frame of the body (scalar first), its 1-sigma
    /// in radians (NaN: 5 degrees), and the direction to the Sun in the camera frame, of any length. All numbers of the
    /// quaternion or of the direction may be NaN: it is not known then.
    ///
    /// # Errors
    /// A number is missing or impossible. Its place counts from 0: the quaternion, the sigma, the direction.
    ///
    /// ```
    /// use hzn_flight::attitude::{AttitudeAndSun, Refused};
    ///
    /// let q = [0.6, 0.0, 0.8, 0.0];
    /// assert!(AttitudeAndSun::try_new(q, 0.05, [f32::NAN; 3]).is_ok());
    /// assert_eq!(AttitudeAndSun::try_new(q, -0.05, [f32::NAN; 3]), Err(Refused::Impossible(4)));
    /// assert_eq!(AttitudeAndSun::try_new(q, 0.05, [1.0, f32::NAN, 0.0]), Err(Refused::Missing(6)));
    /// ```
    pub fn try_new(q_fixed_from_camera_wxyz: [f32; 4], sigma_rad: f32, sun: [f32; 3]) -> Result<Self, Refused> {
        let q = known(q_fixed_from_camera_wxyz, 0)?;
        let is_unit = |[w, x, y, z]: [f32; 4]| {
            let length = Real::sqrt(w * w + x * x + y * y + z * z);
            (length - 1.0).abs() <= LENGTH_TOLERANCE
        };
        let sun = known(sun, SUN)?;
        let sigma = (!sigma_rad.is_nan()).then_some(sigma_rad);
        let checks = [
            (q.is_some_and(|q| !is_unit(q)), Refused::Impossible(0)),
            (sigma.is_some() && q.is_none(), Refused::Missing(0)),
            (sigma.is_some_and(|sigma| !sigma.is_finite() || sigma < 0.0), Refused::Impossible(SIGMA)),
            (
                sun.is_some_and(|sun| UnitVec3::<hzn_core::frames::Cam, f32>::try_new(sun).is_none()),
                Refused::Impossible(SUN),
            ),
        ];
        match checks.iter().find(|(is_wrong, _)| *is_wrong) {
            Some((_, refused)) => Err(*refused),
            None => Ok(Self { q_fixed_from_camera_wxyz: q, sigma_rad: sigma, sun }),
        }
    }

    /// Returns whether neither is known.
    pub fn is_empty(&self) -> bool {
        self.q_fixed_from_camera_wxyz.is_none() && self.sun.is_none()
    }
    /// Returns the quaternion, its 1-sigma in radians, and the direction to the Sun; NaN for what is not known.
    pub fn numbers(&self) -> ([f32; 4], f32, [f32; 3]) {
        let sigma_rad = self.sigma_rad.unwrap_or(f32::NAN);
        (self.q_fixed_from_camera_wxyz.unwrap_or([f32::NAN; 4]), sigma_rad, self.sun.unwrap_or([f32::NAN; 3]))
    }

    /// Returns the values `after_s` seconds later, if the camera turns at this rate (rad/s, its own axes, against the
    /// stars). The axes of the Earth turn meanwhile, those of other bodies do not. Without a rate the values stay.
    #[must_use]
    pub fn moved(&self, rate_rad_s: Option<[f32; 3]>, after_s: f32, body: Kind) -> Self {
        let Some(rate) = rate_rad_s.filter(|_| after_s != 0.0) else { return *self };
        let turn = quaternion(rate.map(|x| x * after_s));
        let is_earth = matches!(body, Kind::Earth | Kind::EarthSphere);
        // The axes of the Earth turn by this about their z, so that a camera at rest turns back in them.
        let earth = quaternion([0.0, 0.0, if is_earth { -OMEGA * after_s } else { 0.0 }]);
        Self {
            q_fixed_from_camera_wxyz: self.q_fixed_from_camera_wxyz.map(|q| product(product(earth, q), turn)),
            // A direction at rest turns back in the axes of the camera.
            sun: self.sun.map(|sun| turned_back(turn, sun)),
            ..*self
        }
    }

    /// Returns the values in the axes of a camera on a vehicle, for values in the axes of the vehicle.
    pub(crate) fn seen_by(&self, q_vehicle_from_camera_wxyz: [f32; 4]) -> Self {
        let q = q_vehicle_from_camera_wxyz;
        Self {
            q_fixed_from_camera_wxyz: self.q_fixed_from_camera_wxyz.map(|vehicle| product(vehicle, q)),
            sun: self.sun.map(|sun| turned_back(q, sun)),
            ..*self
        }
    }

    /// Adds the values to a prior.
    #[must_use]
    pub fn added_to(&self, prior: Prior<f32>) -> Prior<f32> {
        Prior {
            fixed_from_camera: self.q_fixed_from_camera_wxyz.and_then(Rotation::assume_from_quaternion),
            attitude_sigma_rad: self.sigma_rad,
            sun: self.sun.and_then(UnitVec3::try_new),
            ..prior
        }
    }
}

/// Returns the quaternion of a rotation by a vector, radians.
fn quaternion([x, y, z]: [f32; 3]) -> [f32; 4] {
    let angle = Real::sqrt(x * x + y * y + z * z);
    if !(angle > 0.0 && angle.is_finite()) {
        return [1.0, 0.0, 0.0, 0.0];
    }
    let (sin, cos) = Real::sin_cos(angle * 0.5);
    let [x, y, z] = [x, y, z].map(|v| v / angle * sin);
    [cos, x, y, z]
}

fn product([aw, ax, ay, az]: [f32; 4], [bw, bx, by, bz]: [f32; 4]) -> [f32; 4] {
    [
        aw * bw - ax * bx - ay * by - az * bz,
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
    ]
}

/// Returns a vector in axes that have turned by a quaternion.
pub(crate) fn turned_back([w, x, y, z]: [f32; 4], [a, b, c]: [f32; 3]) -> [f32; 3] {
    let [_, a, b, c] = product(product([w, -x, -y, -z], [0.0, a, b, c]), [w, x, y, z]);
    [a, b, c]
}

#[cfg(test)]
mod tests {
    use super::*;
    use hzn_core::frames::{Cam, Fixed};

    const NAN: f32 = f32::NAN;

    fn direction(v: [f32; 3]) -> UnitVec3<Cam, f32> {
        UnitVec3::try_new(v).unwrap()
    }

    /// Returns where the camera's axes are in the fixed frame.
    fn axes(values: &AttitudeAndSun) -> [UnitVec3<Fixed, f32>; 3] {
        let prior = values.added_to(Prior::default());
        [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
            .map(|v| prior.fixed_from_camera.unwrap().apply(&direction(v)))
    }

    #[test]
    fn an_attitude_turns_with_the_camera_in_small_steps_as_in_one() {
        let start = AttitudeAndSun::try_new([0.5, 0.5, -0.5, 0.5], 0.1, [0.3, -0.5, 0.7]).unwrap();
        let rate = Some([0.02, -0.05, 0.3]);
        for body in [Kind::Earth, Kind::Moon] {
            let mut steps = start;
            (0..1000).for_each(|_| steps = steps.moved(rate, 0.01, body));
            let whole = start.moved(rate, 10.0, body);
            for (a, b) in axes(&steps).iter().zip(axes(&whole)) {
                assert!(a.angle_rad(&b) < 2e-4, "{body:?}: {}", a.angle_rad(&b));
            }
            // The Sun is at rest, so that it keeps its direction in the fixed frame, which turns with the Earth alone.
            let sun = |values: &AttitudeAndSun| {
                let prior = values.added_to(Prior::default());
                prior.fixed_from_camera.unwrap().apply(&prior.sun.unwrap())
            };
            let ([x, y, _], [u, v, _]) = (sun(&start).xyz(), sun(&whole).xyz());
            let turned = v.atan2(u) - y.atan2(x);
            let expected = if body == Kind::Earth { -OMEGA * 10.0 } else { 0.0 };
            assert!((turned - expected).abs() < 1e-5, "{body:?}: {turned}");
        }
        // About its own z axis the camera turns from x to y.
        let still = AttitudeAndSun::try_new([1.0, 0.0, 0.0, 0.0], NAN, [NAN; 3]).unwrap();
        let [x, ..] = axes(&still.moved(Some([0.0, 0.0, 0.1]), 1.0, Kind::Moon));
        assert!((x.xyz()[1] - 0.1f32.sin()).abs() < 1e-6);
        // Without a rate nothing is known about the turn.
        assert_eq!(still.moved(None, 1.0, Kind::Earth), still);
    }

    #[test]
    fn what_is_missing_or_impossible_is_named() {
        let (q, sun) = ([1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0]);
        let cases = [
            ([1.0, NAN, 0.0, 0.0], 0.1, sun, Refused::Missing(1)),
            ([NAN, 0.0, 0.0, 0.0], 0.1, sun, Refused::Missing(0)),
            ([f32::INFINITY, 0.0, 0.0, 0.0], 0.1, sun, Refused::Impossible(0)),
            ([0.98, 0.0, 0.0, 0.0], 0.1, sun, Refused::Impossible(0)),
            ([NAN; 4], 0.1, sun, Refused::Missing(0)),
            (q, -0.1, sun, Refused::Impossible(4)),
            (q, f32::INFINITY, sun, Refused::Impossible(4)),
            (q, 0.1, [0.0, NAN, 1.0], Refused::Missing(6)),
            (q, 0.1, [0.0; 3], Refused::Impossible(5)),
        ];
        for (q, sigma_rad, sun, refused) in cases {
            assert_eq!(AttitudeAndSun::try_new(q, sigma_rad, sun), Err(refused), "{q:?} {sigma_rad} {sun:?}");
        }
        assert!(AttitudeAndSun::try_new([NAN; 4], NAN, [NAN; 3]).unwrap().is_empty());
        assert!(!AttitudeAndSun::try_new([NAN; 4], NAN, sun).unwrap().is_empty());
    }
}
