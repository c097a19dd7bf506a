//! What is known about a body whose position is fitted: its shape, its orientation, its distance (math.md, 13).

use crate::base::linalg::{M3, V3, basis, symmetric_eigen, unit};
use crate::base::real::Real;
use crate::geometry::ellipsoid::{WGS84_A_M, WGS84_B_M, geodetic};
use crate::geometry::frames::{Cam, Fixed, Rotation, UnitVec3};
use crate::geometry::scaling::Scaling;

use super::{AltitudeReference, Config, Kind, Prior, PriorError};

/// A position and a distance in one prior must agree within this many sigmas of the distance.
// A true pair differs by more about once in two million cases; therefore a larger difference is an error of units or
// time.
const AGREE_SIGMAS: f64 = 5.0;
/// Distances that differ by less than this agree in any case, metres.
// A distance that is told as exact has a sigma near 0, and a rounded position would contradict it without this floor.
const AGREE_M: f64 = 100.0;

/// Rounds a length to the nearest metre, for messages.
// The messages need i64, because the distance of an outer planet in metres does not fit 32 bits.
fn rounded_m<T: Real>(m: T) -> i64 {
    libm::round(m.to_f64()) as i64
}

/// The distance of the camera from the body's centre, as it is known before the picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Range<T> {
    /// Distance from the centre, or, for `is_height`, height above WGS-84; metres.
    length_m: T,
    /// 1-sigma, metres.
    pub(crate) sigma_m: T,
    /// Whether the length is a height above WGS-84.
    is_height: bool,
}

/// A body whose position is fitted, as one picture sees it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Target<T> {
    /// The scaled space of the body, in units of `unit_m`.
    pub(crate) scaling: Scaling<T>,
    /// Mean of the three semi-axes with the limb height, metres.
    pub(crate) unit_m: T,
    /// Semi-axes with the limb height, in units of `unit_m`.
    pub(crate) semi_axes: [T; 3],
    /// The axes of the body in the camera frame, as columns.
    pub(crate) camera_from_fixed: M3<T>,
    /// Whether the prior has an attitude, so that the camera has a place in the axes of the body.
    pub(crate) has_attitude: bool,
    /// 1-sigma of the orientation about each axis, radians; 0 for a sphere.
    pub(crate) attitude_sigma_rad: T,
    /// 1-sigma of the limb height, metres; clipping adds to it.
    pub(crate) limb_sigma_m: T,
    /// 1-sigma of each component of the second harmonic of the limb height, metres.
    pub(crate) second_harmonic_sigma_m: T,
    /// Height that clipping adds to the limb, metres.
    pub(crate) raised_m: T,
    /// 1-sigma of each semi-axis, metres.
    pub(crate) radii_sigma_m: T,
    /// The distance, if it is known.
    pub(crate) range: Option<Range<T>>,
    /// Whether the body is the Earth, whose altitudes are geodetic.
    pub(crate) is_earth: bool,
    /// The centre of the body in the camera frame, metres, if attitude and position are known.
    pub(crate) predicted_m: Option<V3<T>>,
}

impl<T: Real> Target<T> {
    /// Returns the target; `None` if the body has no position, or if its orientation is not known.
    ///
    /// # Errors
    /// The distance or the pole is impossible, or the camera is inside the body.
    pub(super) fn new(
        body: &Config,
        prior: &Prior<T>,
        attitude: Option<Rotation<Cam, Fixed, T>>,
        attitude_sigma_rad: T,
    ) -> Result<Option<Self>, PriorError> {
        let Some(radii_km) = body.figure_km() else { return Ok(None) };
        let km = T::from_f64(1000.0);
        let limb = T::from_f64(body.mean_limb_height_km()) * km;
        let axes_m = radii_km.map(|r| T::from_f64(r) * km + limb);
        let is_sphere = axes_m[0] == axes_m[1] && axes_m[1] == axes_m[2];
        let rotation = attitude.map(|fixed_from_camera| fixed_from_camera.inverse().to_matrix());
        // An attitude comes first because it fixes all three axes; a pole fixes two, which is enough for a body of
        // revolution.
        let rotation = rotation.or(oriented_by_pole(prior, &axes_m)?).or(is_sphere.then(M3::identity));
        let Some(camera_from_fixed) = rotation else { return Ok(None) };
        let unit_m = (axes_m[0] + axes_m[1] + axes_m[2]) / T::from_f64(3.0);
        let semi_axes = axes_m.map(|a| a / unit_m);
        let target = Self {
            scaling: Scaling::new(semi_axes, &camera_from_fixed),
            unit_m,
            semi_axes,
            camera_from_fixed,
            has_attitude: attitude.is_some(),
            // A turned sphere has the same limb.
            attitude_sigma_rad: if is_sphere { T::ZERO } else { attitude_sigma_rad },
            limb_sigma_m: T::from_f64(body.limb_height_sigma_km) * km,
            second_harmonic_sigma_m: T::from_f64(
                body.limb_height_harmonic_sigma_km.unwrap_or(body.limb_height_sigma_km),
            ) * km,
            raised_m: T::ZERO,
            radii_sigma_m: T::from_f64(body.radii_sigma_km) * km,
            range: range(body, prior, limb)?,
            is_earth: body.kind == Kind::Earth,
            predicted_m: attitude.and(prior.position_m).map(|x| -(camera_from_fixed * V3::from(x))),
        };
        target.check_outside()?;
        Ok(Some(target))
    }

    /// Refuses a camera inside the body.
    // Inside the body no cone exists: sin α would be above 1, and every later root NaN.
    fn check_outside(&self) -> Result<(), PriorError> {
        let inside = |distance_m: T, axis: T| PriorError::Inside {
            distance_m: rounded_m(distance_m),
            limit_m: rounded_m(axis * self.unit_m),
        };
        if let Some(r) = &self.predicted_m {
            let scaled = self.scaling.to * r / self.unit_m;
            if !(scaled.dot(&scaled) > T::one()) {
                return Err(inside(r.dot(r).sqrt(), r.dot(r).sqrt() / self.unit_m / scaled.dot(&scaled).sqrt()));
            }
        }
        // The smallest semi-axis is the limit, because without a direction the camera may stand above it.
        let smallest = self.semi_axes.iter().fold(T::one(), |least, a| least.min(*a));
        match self.range {
            Some(range) if !range.is_height && !(range.length_m > smallest * self.unit_m) => {
                Err(inside(range.length_m, smallest))
            }
            Some(range) if range.is_height && !(range.length_m > T::ZERO) => Err(PriorError::Altitude),
            _ => Ok(()),
        }
    }

    /// Sets the known distance, metres.
    #[cfg(all(test, feature = "position"))]
    pub(crate) fn set_range(&mut self, length_m: T, sigma_m: T) {
        self.range = Some(Range { length_m, sigma_m, is_height: false });
    }

    /// Returns the distance that is known, for a body in the direction `u` (camera frame), metres.
    pub(crate) fn range_m(&self, u: &V3<T>) -> Option<T> {
        let range = self.range?;
        if !range.is_height {
            return Some(range.length_m);
        }
        let [a, b] = [WGS84_A_M, WGS84_B_M].map(T::from_f64);
        let d = self.camera_from_fixed.transpose() * -u;
        let surface = T::one() / ((d.x * d.x + d.y * d.y) / (a * a) + d.z * d.z / (b * b)).sqrt();
        // The height is measured along the normal of the ellipsoid, which is not the direction to the centre.
        // One correction is enough: at the first guess the height is wrong by the square of the angle between normal
        // and centre.
        let distance = surface + range.length_m;
        let (height, _) = geodetic([d.x * distance, d.y * distance, d.z * distance], a, b);
        Some(distance + range.length_m - height)
    }

    /// Returns the sine of the half-angle in scaled space for a body in the direction `u` (camera frame), and the
    /// 1-sigma of the distance, metres. `None` without a known distance.
    pub(crate) fn size_along(&self, u: &V3<T>) -> Option<(T, T)> {
        let distance = self.range_m(u)? / self.unit_m;
        let scaled = self.scaling.to * u;
        let sin = (T::one() + self.raised_m / self.unit_m) / (distance * scaled.dot(&scaled).sqrt());
        (sin > T::ZERO && sin < T::one()).then(|| (sin, self.range.map_or(T::ZERO, |range| range.sigma_m)))
    }

    /// Returns the sine of the half-angle for the mean semi-axis, with the 1-sigma of the semi-axis that the camera
    /// sees, metres: its direction is not known. `None` without a known distance.
    pub(super) fn size_anywhere(&self) -> Option<(T, T)> {
        let range = self.range?;
        let distance = range.length_m / self.unit_m + if range.is_height { T::one() } else { T::ZERO };
        let extreme = |pick: fn(T, T) -> T| self.semi_axes.iter().fold(T::one(), |found, a| pick(found, *a));
        // The 1-sigma of a uniform distribution is its width over √12.
        let spread = (extreme(T::max) - extreme(T::min)) * T::from_f64(0.288_675_134_594_812_9);
        // A height rises with the surface, so that most of the spread cancels, as for the Earth from an altitude.
        let counts = if range.is_height { (distance - T::one()) / distance } else { T::one() };
        // Near the body the mean semi-axis may be too large for any cone.
        let sin = (T::one() / distance).min(T::from_f64(0.999));
        Some((sin, spread * counts * self.unit_m))
    }

    /// Returns the direction of the body, camera frame, for a scaled axis.
    pub(crate) fn direction(&self, e: &V3<T>) -> V3<T> {
        self.scaling.unscale(e)
    }

    /// Returns the position of the camera in the axes of the body, metres, for the centre `r` (camera frame).
    pub(crate) fn body_fixed(&self, r: &V3<T>) -> V3<T> {
        -(self.camera_from_fixed.transpose() * r)
    }
}

impl<T: Real> Target<T> {
    /// Returns axis and half-angle (radians) of the limb in the camera frame for the centre `r` (camera frame, metres).
    /// The limb is an elliptic cone, sᵀ M s = 0 with M = A r rᵀ A − (rᵀ A r − 1) A. Its axis is the eigenvector of the
    /// positive eigenvalue λ₁; cot² of the half-angle is the mean of −λ/λ₁ over the two negative eigenvalues λ. `None`
    /// if there is no cone.
    pub(crate) fn limb_cone(&self, r: &V3<T>) -> Option<(V3<T>, T)> {
        // Double precision: for a small disc the eigenvalues differ by many orders of magnitude.
        let grown = 1.0 + (self.raised_m / self.unit_m).to_f64();
        let u = self.scaling.to.map(|x| x.to_f64() / grown);
        let r = (r / self.unit_m).map(Real::to_f64);
        let (y, a) = (u * r, u * u);
        if self.scaling.is_uniform() {
            // (U r)·(U r) is 1/sin².
            let half_angle = libm::atan2(1.0, libm::sqrt(y.dot(&y) - 1.0));
            return half_angle.is_finite().then_some((unit(&r.map(T::from_f64))?, T::from_f64(half_angle)));
        }
        let ar = u * y;
        let m: M3<f64> = ar * ar.transpose() - a * (y.dot(&y) - 1.0);
        let rows = [[m.m11, m.m12, m.m13], [m.m12, m.m22, m.m23], [m.m13, m.m23, m.m33]];
        let ([one, two, positive], [.., axis]) = symmetric_eigen(rows);
        let cot2 = -(one + two) / (positive + positive);
        let axis = V3::from(axis);
        // An eigenvector has no sign; the body lies on the side of its centre.
        let axis = if axis.dot(&r) < 0.0 { -axis } else { axis };
        let half_angle = libm::atan2(1.0, libm::sqrt(cot2));
        half_angle.is_finite().then(|| (axis.map(T::from_f64), T::from_f64(half_angle)))
    }

    /// Returns the altitude of the camera for the centre `r` (camera frame, metres): geodetic for the Earth, else above
    /// the mean radius; metres.
    pub(crate) fn altitude_m(&self, r: &V3<T>, mean_radius_m: T) -> T {
        if !self.is_earth {
            return r.dot(r).sqrt() - mean_radius_m;
        }
        let x = self.body_fixed(r);
        geodetic([x.x, x.y, x.z], T::from_f64(WGS84_A_M), T::from_f64(WGS84_B_M)).0
    }
}

/// Returns the axes of a body of revolution whose pole is known in the camera frame.
fn oriented_by_pole<T: Real>(prior: &Prior<T>, [a, b, _]: &[T; 3]) -> Result<Option<M3<T>>, PriorError> {
    let Some(pole) = prior.pole.as_ref().map(UnitVec3::v) else { return Ok(None) };
    if a != b {
        return Err(PriorError::Pole);
    }
    // Any two axes across the pole will do, because the body is one of revolution.
    let (x, y) = basis(pole);
    Ok(Some(M3::from_columns(&[x, y, *pole])))
}

/// Returns the known distance: of the picture, else of the configuration; a distance, else a position, else a height.
fn range<T: Real>(body: &Config, prior: &Prior<T>, limb_m: T) -> Result<Option<Range<T>>, PriorError> {
    let km = T::from_f64(1000.0);
    let in_m = |km_: Option<f64>| km_.map(|x| T::from_f64(x) * km);
    let distance = |length_m: T, sigma_m: T| Range { length_m, sigma_m, is_height: false };
    let by_position = prior.position_m.map(|x| {
        let x = V3::from(x);
        distance(x.dot(&x).sqrt(), T::from_f64(body.altitude_sigma_km) * km)
    });
    let length = prior.range_m.or(in_m(body.range_km));
    if length.is_some_and(|r| !(r > T::ZERO && r.is_finite())) {
        return Err(PriorError::Range);
    }
    let sigma = prior.range_sigma_m.or(in_m(body.range_sigma_km));
    if sigma.is_some_and(|s| !(s >= T::ZERO && s.is_finite())) || (prior.range_m.is_some() && sigma.is_none()) {
        return Err(PriorError::RangeSigma);
    }
    // A sigma of 0 would claim that nothing can be learned; a millionth of the distance is as good as exact.
    let by_range = length.zip(sigma).map(|(r, sigma)| distance(r, sigma.max(r * T::from_f64(1e-6))));
    if let (Some(r), Some(x)) = (by_range.filter(|_| prior.range_m.is_some()), by_position) {
        let apart = (r.length_m - x.length_m).abs();
        if !(apart <= (r.sigma_m * T::from_f64(AGREE_SIGMAS)).max(T::from_f64(AGREE_M))) {
            return Err(PriorError::Contradiction {
                range_m: rounded_m(r.length_m),
                position_m: rounded_m(x.length_m),
            });
        }
    }
    let by_height = prior.altitude_m.or(in_m(body.altitude_km)).filter(|_| !body.half_angle_is_free());
    let by_height = by_height.map(|height| {
        let above_ellipsoid = body.kind == Kind::Earth && body.altitude_reference == AltitudeReference::Ellipsoid;
        let sigma_m = T::from_f64(body.altitude_sigma_km) * km;
        match above_ellipsoid {
            true => Range { length_m: height, sigma_m, is_height: true },
            false => distance(height + T::from_f64(body.mean_radius_km()) * km, sigma_m),
        }
    });
    if let (Some(height), None, None) = (by_height.filter(|h| h.is_height), by_range, by_position)
        && !(height.length_m > limb_m)
    {
        return Err(super::apparent::below_limb_error(height.length_m, limb_m));
    }
    // One metre keeps the variance above 0, by which the fusion divides.
    let tiny = T::from_f64(1.0);
    Ok(by_range.or(by_position).or(by_height).map(|range| Range { sigma_m: range.sigma_m.max(tiny), ..range }))
}
