//! Lens models: from a pixel to a unit ray with its derivative, and back.
//!
//! The module uses unit rays and never the plane z = f. The plane cannot represent 90° and more off axis, and is badly
//! conditioned in single precision. Radial lenses share one code path; Brown-Conrady has a separate one.

mod at_temperature;
mod brown;
mod config;
mod curve;
mod double_sphere;
mod equation;
mod eucm;
mod intrinsic;
mod lens;
mod packed;
mod radial;
pub(in crate::geometry) mod ray;
mod shutter;
mod temperature;
mod uncertain;

pub use config::{Config, Model, Projection};
pub use equation::{Equation, Projected};
pub use intrinsic::{Covariance, INTRINSICS, Intrinsic};
use lens::Lens;
pub use ray::Ray;
use ray::radial_ray;
pub use temperature::Temperature;

use crate::base::error::{ConfigError, Limit, require};
use crate::base::linalg::V3;
use crate::base::real::Real;
use crate::geometry::block::{Block, LANES};
use crate::geometry::crop::Crop;
use crate::geometry::frames::{Cam, UnitVec3};
use crate::geometry::pixel::ImagePoint;
use crate::geometry::scaling::Scaling;

/// A lens that is checked and ready. All of its functions are total.
///
/// # Frames and units
///
/// Pixels have their centres at integers ([`crate::pixel`]). Rays are unit vectors in the camera frame: x right, y
/// down, z along the optical axis.
///
/// # Example
///
/// ```
/// use hzn_core::camera::{Camera, Config, Model};
/// use hzn_core::pixel::ImagePoint;
///
/// let camera = Camera::<f64>::try_new(&Config::ideal(Model::Equidistant, 640, 480, 200.0))?;
/// let corner = ImagePoint { u: 0.0, v: 0.0 };
/// let ray = camera.unproject(corner).expect("the corner is within the image circle");
/// // With r = f θ, 399 px from the middle are 399/200 rad off axis.
/// let [x, y, z] = ray.xyz();
/// assert!((x.hypot(y).atan2(z) - 319.5f64.hypot(239.5) / 200.0).abs() < 1e-12);
/// let back = camera.project(&ray).expect("the ray is within the image circle");
/// assert!((back.u - corner.u).abs() < 1e-9 && (back.v - corner.v).abs() < 1e-9);
/// # Ok::<(), hzn_core::error::ConfigError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Camera<T> {
    width: u16,
    height: u16,
    fx: T,
    fy: T,
    // The reciprocals are kept, because every point of a picture would otherwise need two divisions.
    inv_fx: T,
    inv_fy: T,
    cx: T,
    cy: T,
    /// Largest distance from the principal point, in units of the focal length, that has a ray.
    rho_max: T,
    /// Largest angle off axis at which the lens is used, radians.
    theta_max: T,
    circle: bool,
    /// Distance from the principal point up to which the centre is blind, in units of the focal length; 0 for a lens
    /// without a blind centre.
    rho_min: T,
    lens: Lens<T>,
    /// Uncertainty of the calibration, as 1-sigma modes.
    modes: uncertain::Modes<T>,
    /// Change with the temperature; `None` for a lens without `[camera.temperature]`, or at a picture's temperature.
    temperature: Option<Temperature>,
    /// Time from one row to the next in seconds, and the row that is exposed at the picture's time.
    row_s: T,
    middle_row: T,
    /// Rotation of the camera while this picture is read out; `None` without a rate or without a rolling shutter.
    turning: Option<shutter::Turning<T>>,
    /// The scaled space in which all rays are given; `None` for rays in the camera frame.
    // The field exists in every build, because `cfg!` at the places that read it leaves the code out as well as
    // attributes at every place would: 40 uses replaced 168 attributes, for 0.5 % of flash.
    scaling: Option<Scaling<T>>,
}

impl<T: Real> Camera<T> {
    /// Checks the calibration and prepares the lens.
    ///
    /// # Errors
    /// Returns the first field that is out of its limits. A lens that is not monotone up to
    /// `min(theta_max_deg, the farthest corner)` is refused as well.
    pub fn try_new(config: &Config) -> Result<Self, ConfigError> {
        config.check()?;
        let c = config;
        let corner = |x: f64, y: f64| ((x - c.cx_px) / c.fx_px).hypot_((y - c.cy_px) / c.fy_px);
        // The corners are those of the outer pixels and not their centres, because edge points lie up to half a pixel
        // outside.
        let (right, bottom) = (f64::from(c.width) - 0.5, f64::from(c.height) - 0.5);
        let rho_corner =
            corner(-0.5, -0.5).max(corner(right, -0.5)).max(corner(-0.5, bottom)).max(corner(right, bottom));
        let rho_corner = temperature::farthest_corner(c.temperature, rho_corner);
        let (lens, rho_max, theta_max) = match c.model {
            Model::Pinhole => {
                let theta = pinhole_limit_rad(c, rho_corner)?;
                (Lens::Pinhole, libm::tan(theta), theta)
            }
            Model::BrownConrady => {
                let (lens, rho, theta) = brown::Brown::try_new(c, rho_corner)?;
                (Lens::Brown(lens), rho, theta)
            }
            // `Config::check` has refused a model that is not built in.
            Model::KannalaBrandt | Model::Equidistant | Model::DoubleSphere | Model::Eucm => {
                let (lens, rho, theta) = radial::Radial::try_new(c, rho_corner)?;
                (Lens::Radial(lens), rho, theta)
            }
        };
        let rho_min = c.theta_min_deg.map_or(Ok(0.0), |deg| {
            let rule = Limit::Rule("must be smaller than theta_max_deg and than the angle of the farthest corner");
            require(deg.to_radians() < theta_max, "camera.theta_min_deg", deg, rule)?;
            let (sin, cos) = libm::sincos(deg.to_radians());
            // The radius comes from the equation, because the checked camera does not exist yet.
            let edge = Equation::new(c).project([sin, 0.0, cos]);
            Ok(edge.map_or(0.0, |edge| ((edge.point.u - c.cx_px) / c.fx_px).abs()))
        })?;
        Ok(Self {
            width: c.width,
            height: c.height,
            fx: T::from_f64(c.fx_px),
            fy: T::from_f64(c.fy_px),
            inv_fx: T::from_f64(1.0 / c.fx_px),
            inv_fy: T::from_f64(1.0 / c.fy_px),
            cx: T::from_f64(c.cx_px),
            cy: T::from_f64(c.cy_px),
            rho_max: T::from_f64(rho_max),
            theta_max: T::from_f64(theta_max),
            // The margin is for rounding: a circle through the corner itself would otherwise mask single corner pixels.
            circle: rho_max < rho_corner * (1.0 - 1e-6),
            rho_min: T::from_f64(rho_min),
            lens,
            modes: uncertain::modes(c)?,
            temperature: c.temperature,
            row_s: T::from_f64(c.readout_s / (f64::from(c.height) - 1.0)),
            middle_row: T::from_f64((f64::from(c.height) - 1.0) * 0.5),
            turning: None,
            scaling: None,
        })
    }

    /// Returns the camera for a rectangle of this camera's pictures, or for smaller copies.
    pub(crate) fn for_crop(&self, crop: &Crop) -> Self {
        let ([sx, sy], centre) = (crop.scale::<T>(), crop.crop_point(self.principal_point()));
        Self {
            width: crop.width,
            height: crop.height,
            // The crop is made from the checked camera and not from a configuration, because a part cannot be refused
            // any more.
            fx: self.fx / sx,
            fy: self.fy / sy,
            inv_fx: self.inv_fx * sx,
            inv_fy: self.inv_fy * sy,
            cx: centre.u,
            cy: centre.v,
            // Pixels of the crop are larger by its scale.
            temperature: self.temperature.map(|lens| Temperature {
                cx_px_per_k: lens.cx_px_per_k / sx.to_f64(),
                cy_px_per_k: lens.cy_px_per_k / sy.to_f64(),
                ..lens
            }),
            row_s: self.row_s * sy,
            middle_row: crop.crop_point(ImagePoint { u: T::ZERO, v: self.middle_row }).v,
            ..self.clone()
        }
    }

    /// Returns the number of columns of the picture.
    pub fn width(&self) -> u16 {
        self.width
    }
    /// Returns the number of rows of the picture.
    pub fn height(&self) -> u16 {
        self.height
    }
    /// Returns the largest angle off axis in use, radians: the image circle or the farthest corner. For `brown-conrady`
    /// the limit lies 1 % of the radius beyond the corner, because the tangential terms move the corner.
    pub fn theta_max_rad(&self) -> T {
        self.theta_max
    }
    /// Returns the image circle when it cuts the picture: centre (u, v) and semi-axes along x and y, in pixels.
    pub fn image_circle_px(&self) -> Option<(ImagePoint<T>, T, T)> {
        self.circle.then(|| (ImagePoint { u: self.cx, v: self.cy }, self.rho_max * self.fx, self.rho_max * self.fy))
    }
    /// Returns the blind centre of the lens (`theta_min_deg`), if it has one: centre (u, v) and semi-axes along x and
    /// y, in pixels. A panoramic annular lens shows nothing there, or a picture that does not follow its equation.
    pub fn blind_centre_px(&self) -> Option<(ImagePoint<T>, T, T)> {
        (self.rho_min > T::ZERO).then(|| (self.principal_point(), self.rho_min * self.fx, self.rho_min * self.fy))
    }
    /// Returns the focal lengths (fx, fy) in pixels.
    pub fn focal_px(&self) -> (T, T) {
        (self.fx, self.fy)
    }
    /// Returns the principal point, where the optical axis meets the picture.
    pub fn principal_point(&self) -> ImagePoint<T> {
        ImagePoint { u: self.cx, v: self.cy }
    }

    /// Returns the ray of an image point with its derivative; `None` beyond the image circle.
    #[inline]
    pub fn ray(&self, p: ImagePoint<T>) -> Option<Ray<T>> {
        let ray = self.ray_in_row_frame(p)?;
        let ray = match &self.turning {
            None => ray,
            Some(turning) => turning.to_frame_time(&ray, p.v),
        };
        if let Some(scaling) = self.scaling() {
            return Some(scaling.scale_ray(&ray));
        }
        Some(ray)
    }

    /// Does the same as [`Self::ray`], in the camera frame at the time when the point's row is exposed.
    #[inline(always)]
    fn ray_in_row_frame(&self, p: ImagePoint<T>) -> Option<Ray<T>> {
        let x = (p.u - self.cx) * self.inv_fx;
        let y = (p.v - self.cy) * self.inv_fy;
        let rho2 = x * x + y * y;
        // Squares are compared, so that no point costs a root here; the negation also refuses NaN.
        if !(rho2 <= self.rho_max * self.rho_max) {
            return None;
        }
        let (s, [a, b, c, d]) = match &self.lens {
            Lens::Radial(lens) => lens.ray(x, y, rho2),
            Lens::Pinhole => {
                let sz = T::one() / (T::one() + rho2).sqrt();
                radial_ray(x, y, sz, sz, sz * sz)
            }
            Lens::Brown(lens) => lens.ray(x, y)?,
        };
        Some(Ray { s, m: [a * self.inv_fx, b * self.inv_fy, c * self.inv_fx, d * self.inv_fy] })
    }

    /// Replaces the image points of a block by their rays, as [`Self::ray`]. A point beyond the image circle is
    /// cleared.
    #[inline(always)]
    pub(crate) fn rays(&self, block: &mut Block<T>) {
        // A turn differs from row to row, therefore only a lens at rest is computed by eight.
        if let (Lens::Radial(lens), None) = (&self.lens, &self.turning) {
            let (mut x, mut y) = ([T::ZERO; LANES], [T::ZERO; LANES]);
            for l in 0..LANES {
                x[l] = (block.s[0][l] - self.cx) * self.inv_fx;
                y[l] = (block.s[1][l] - self.cy) * self.inv_fy;
            }
            if let Some((s, [a, b, c, d])) = lens.rays(&x, &y) {
                for l in 0..LANES {
                    let within = x[l] * x[l] + y[l] * y[l] <= self.rho_max * self.rho_max;
                    let counts = within && block.weight[l] > T::ZERO;
                    // This has the same effect as `Block::clear`.
                    // The value is selected and not multiplied by 0, because NaN times 0 is NaN.
                    let or_zero = |value: T| if counts { value } else { T::ZERO };
                    block.s[0][l] = or_zero(s[0][l]);
                    block.s[1][l] = or_zero(s[1][l]);
                    block.s[2][l] = if counts { s[2][l] } else { T::one() };
                    block.m[0][l] = or_zero(a[l] * self.inv_fx);
                    block.m[1][l] = or_zero(b[l] * self.inv_fy);
                    block.m[2][l] = or_zero(c[l] * self.inv_fx);
                    block.m[3][l] = or_zero(d[l] * self.inv_fy);
                    block.weight[l] = if counts { block.weight[l] } else { T::ZERO };
                }
                if let Some(scaling) = self.scaling() {
                    scaling.scale_block(block);
                }
                return;
            }
        }
        self.rays_one_by_one(block);
    }

    /// Does the same as [`Self::rays`], for lenses without series and for cameras that turn during the readout.
    // One copy in flash: inlined, the code would stand there for every lane.
    #[inline(never)]
    fn rays_one_by_one(&self, block: &mut Block<T>) {
        for l in 0..LANES {
            match self.ray(block.point(l)).filter(|_| block.weight[l] > T::ZERO) {
                Some(ray) => block.set_ray(l, &ray),
                None => block.clear(l),
            }
        }
    }

    /// Converts an image point to its offset from the principal point, in focal lengths.
    pub(crate) fn to_focal_lengths(&self, p: ImagePoint<T>) -> [T; 2] {
        [(p.u - self.cx) * self.inv_fx, (p.v - self.cy) * self.inv_fy]
    }

    /// Returns the direction of a point that lies (x, y) focal lengths from the principal point. The point may lie
    /// beyond the picture and the image circle. Beyond its largest radius, a radial lens is continued along the tangent
    /// of its curve, up to 180° off axis. All other lenses count as a pinhole. `None` when the direction is not finite.
    pub(crate) fn unproject_extrapolated(&self, [x, y]: [T; 2]) -> Option<UnitVec3<Cam, T>> {
        let rho2 = x * x + y * y;
        let Lens::Radial(lens) = &self.lens else { return UnitVec3::try_new([x, y, T::one()]) };
        if rho2 <= self.rho_max * self.rho_max {
            return Some(UnitVec3::assume_unit(lens.ray(x, y, rho2).0));
        }
        let rho = rho2.sqrt();
        let (s, c) = lens.extrapolate_theta(rho).sin_cos();
        UnitVec3::try_new([x / rho * s, y / rho * s, c])
    }

    /// Returns the direction of an image point; `None` beyond the image circle.
    pub fn unproject(&self, p: ImagePoint<T>) -> Option<UnitVec3<Cam, T>> {
        self.ray(p).map(|r| r.direction())
    }

    /// Returns the image point of a direction; `None` beyond the image circle. The point may lie outside the picture.
    pub fn project(&self, d: &UnitVec3<Cam, T>) -> Option<ImagePoint<T>> {
        if let Some(scaling) = self.scaling() {
            return self.project_from_camera(&(scaling.from * d.v()));
        }
        self.project_from_camera(d.v())
    }

    /// Does the same as [`Self::project`], for a direction in the camera frame of any length.
    #[inline(always)]
    fn project_from_camera(&self, d: &V3<T>) -> Option<ImagePoint<T>> {
        match &self.turning {
            None => self.project_in_row_frame(d),
            Some(turning) => turning.project(d, |s| self.project_in_row_frame(s)),
        }
    }

    /// Does the same as [`Self::project`], for a direction of any length in the camera frame at the time when the
    /// point's row is exposed.
    fn project_in_row_frame(&self, s: &V3<T>) -> Option<ImagePoint<T>> {
        let h = (s.x * s.x + s.y * s.y).sqrt();
        // The angle comes from `atan2` and not from `acos` of z, which in single precision loses half of its digits
        // near the axis.
        let theta = h.atan2(s.z);
        if !(theta <= self.theta_max) {
            return None;
        }
        let (x, y) = match &self.lens {
            Lens::Radial(lens) => {
                let scale = if h > T::zero() { lens.radius(theta) / h } else { T::one() };
                (s.x * scale, s.y * scale)
            }
            Lens::Pinhole => (s.x / s.z, s.y / s.z),
            Lens::Brown(lens) => lens.distort(s.x / s.z, s.y / s.z),
        };
        Some(ImagePoint { u: x * self.fx + self.cx, v: y * self.fy + self.cy })
    }

    /// Returns this camera with a rate of rotation. With a rolling shutter, rays and projected directions then refer to
    /// the camera frame at the time of the middle row. `rate_rad_s` is the camera's rate of rotation against the stars
    /// or the ground, in its own axes, rad/s. Without a rolling shutter the rate has no effect.
    pub fn with_rate(&self, rate_rad_s: Option<[T; 3]>) -> Self {
        let turning = rate_rad_s
            .filter(|_| self.has_rolling_shutter())
            .map(|rate| shutter::Turning::new(rate, self.row_s, self.middle_row));
        Self { turning, ..self.clone() }
    }

    /// Returns this camera with its rays in the scaled space of an ellipsoid. [`Self::project`] then takes scaled
    /// directions. For a sphere these are the directions themselves.
    pub(crate) fn with_scaling(self, scaling: Scaling<T>) -> Self {
        Self { scaling: Some(scaling).filter(|scaling| !scaling.is_uniform()), ..self }
    }

    /// Returns the scaled space of the rays; `None` for rays in the camera frame.
    pub(crate) fn scaling(&self) -> Option<&Scaling<T>> {
        if cfg!(feature = "position") { self.scaling.as_ref() } else { None }
    }

    /// Returns whether rows are exposed one after the other, so that a rate of rotation has an effect.
    pub fn has_rolling_shutter(&self) -> bool {
        self.row_s != T::ZERO
    }

    /// Returns the 1-sigma modes of the intrinsic parameters; `None` for a lens that is known exactly.
    pub(crate) fn intrinsic_modes(&self) -> Option<&[[T; INTRINSICS]]> {
        (!self.modes.is_empty()).then_some(&self.modes)
    }

    /// Returns how the image point of a ray (camera frame) moves by each 1-sigma mode of the calibration, in pixels
    /// (u, v). The modes are independent of each other; there are none for a lens that is known exactly.
    ///
    /// ```
    /// use hzn_core::camera::{Camera, Config, Model};
    /// use hzn_core::frames::UnitVec3;
    ///
    /// // The focal length is known to a percent.
    /// let lens = Config { focal_sigma_percent: 1.0, ..Config::ideal(Model::Pinhole, 640, 480, 500.0) };
    /// let camera = Camera::<f64>::try_new(&lens)?;
    /// let ray = UnitVec3::try_new([0.2, 0.0, 1.0]).unwrap();
    /// // The point is 100 px off the principal point, and a percent of it is 1 px.
    /// assert!((camera.shifts_by_lens(&ray)[0][0] - 1.0).abs() < 1e-9);
    /// # Ok::<(), hzn_core::error::ConfigError>(())
    /// ```
    pub fn shifts_by_lens(&self, ray: &UnitVec3<Cam, T>) -> heapless::Vec<[T; 2], INTRINSICS> {
        let [x, y, z] = ray.xyz();
        let by = self.shift_by_intrinsics(&V3::new(x, y, z));
        let moved = |mode: &[T; INTRINSICS]| {
            let sum = |axis: usize| mode.iter().zip(&by).map(|(m, by)| *m * by[axis]).fold(T::ZERO, |a, b| a + b);
            [sum(0), sum(1)]
        };
        self.modes.iter().map(moved).collect()
    }

    /// Returns the motion of the image point of the ray `s` (camera frame), in pixels (u, v), when each parameter grows
    /// by 1 in the relative units.
    pub(crate) fn shift_by_intrinsics(&self, s: &V3<T>) -> [[T; 2]; INTRINSICS] {
        let (one, zero) = (T::one(), T::ZERO);
        let s = &self.scaling().map_or(*s, |scaling| scaling.unscale(s));
        let (x, y, [k1, k2, k3, k4, k5]) = self.lens.by_coefficients(s);
        [[x, zero], [zero, y], [one, zero], [zero, one], k1, k2, k3, k4, k5].map(|[u, v]| [u * self.fx, v * self.fy])
    }
}

/// Returns the largest angle off axis of a pinhole, radians: the image circle or the farthest corner.
fn pinhole_limit_rad(c: &Config, rho_corner: f64) -> Result<f64, ConfigError> {
    let corner = libm::atan(rho_corner);
    let Some(deg) = c.theta_max_deg else { return Ok(corner) };
    let rule = Limit::Rule("must be below 89 degrees for a pinhole");
    // At 89° the image radius is already 57 focal lengths; the plane has no points at 90°.
    require(deg < 89.0, "camera.theta_max_deg", deg, rule)?;
    Ok(deg.to_radians().min(corner))
}

/// `hypot` for the checks at load time, from the same library on every target.
trait Hypot {
    fn hypot_(self, other: f64) -> f64;
}
impl Hypot for f64 {
    fn hypot_(self, other: f64) -> f64 {
        // The lengths are a few units, so that the squares cannot overflow and the care of `hypot` is not needed.
        libm::sqrt(self * self + other * other)
    }
}

#[cfg(test)]
mod tests;
