//! The equation of a lens, without its limits, for programs that fit a calibration.

use super::brown::Brown;
use super::config::{Config, Model};
use super::curve::Curve;
use super::intrinsic::INTRINSICS;
use crate::geometry::pixel::ImagePoint;

/// The equation of a lens: from a direction to an image point, with all derivatives.
///
/// A [`Camera`](super::Camera) is checked and has limits: its lens must be monotone, and it has no rays beyond the
/// image circle. The steps of a fit may leave these limits and return, so a fit needs the equation alone. Build a
/// `Camera` from the result to check it.
///
/// # Example
///
/// ```
/// use hzn_core::camera::{Config, Equation, Model};
///
/// let lens = Equation::new(&Config::ideal(Model::Pinhole, 641, 481, 500.0));
/// let projected = lens.project([0.2, 0.0, 2.0]).expect("the direction lies before the camera");
/// assert_eq!([projected.point.u, projected.point.v], [320.0 + 50.0, 240.0]);
/// // A longer focal length moves the point outwards: u = fx x/z + cx.
/// assert_eq!(projected.by_intrinsics[0][0], 0.1);
/// assert_eq!(projected.by_direction[0], [250.0, 0.0, -25.0]);
/// ```
#[derive(Debug, Clone)]
pub struct Equation {
    focal_px: [f64; 2],
    centre_px: [f64; 2],
    shape: Shape,
}

/// An image point with its derivatives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Projected {
    /// The image point, px. It may lie outside the picture.
    pub point: ImagePoint<f64>,
    /// Derivatives of u and v by the three components of the direction, px per unit of the direction's length.
    pub by_direction: [[f64; 3]; 2],
    /// Derivatives of u and v by the intrinsic parameters in the order of
    /// [`Model::intrinsics`](super::Model::intrinsics); px per unit of the parameter, and 0 behind the last one.
    // The array has the length of the largest model, because the core has no heap.
    pub by_intrinsics: [[f64; INTRINSICS]; 2],
}

#[derive(Debug, Clone)]
enum Shape {
    Radial(Curve<f64>),
    Plane(Brown<f64>),
}

/// A point in focal lengths from the principal point, with its derivatives by the direction and the coefficients.
type Distorted = ([f64; 2], [[f64; 3]; 2], [[f64; 2]; 5]);

impl Equation {
    /// Makes the equation of a calibration, which is not checked. A lens that is not built in counts as `equidistant`.
    pub fn new(config: &Config) -> Self {
        let shape = match config.model {
            Model::Pinhole | Model::BrownConrady => Shape::Plane(Brown::of_config(config)),
            Model::KannalaBrandt | Model::Equidistant | Model::DoubleSphere | Model::Eucm => {
                Shape::Radial(Curve::new(config))
            }
        };
        Self { focal_px: [config.fx_px, config.fy_px], centre_px: [config.cx_px, config.cy_px], shape }
    }

    /// Projects a direction of any length (camera frame: x right, y down, z along the optical axis). `None` if the lens
    /// has no image point for it: behind the plane of a lens of the plane, beyond the pole of r(θ), or for the zero
    /// vector.
    pub fn project(&self, direction: [f64; 3]) -> Option<Projected> {
        let (distorted, by_direction, by_k) = match &self.shape {
            Shape::Radial(curve) => radial(curve, direction)?,
            Shape::Plane(lens) => planar(lens, direction)?,
        };
        let mut by_intrinsics = [[0.0; INTRINSICS]; 2];
        for (axis, row) in by_intrinsics.iter_mut().enumerate() {
            row[axis] = distorted[axis];
            row[2 + axis] = 1.0;
            for (by, k) in row.iter_mut().skip(4).zip(by_k) {
                *by = k[axis] * self.focal_px[axis];
            }
        }
        let pixel = |axis: usize| distorted[axis] * self.focal_px[axis] + self.centre_px[axis];
        let projected = Projected {
            point: ImagePoint { u: pixel(0), v: pixel(1) },
            by_direction: [0, 1].map(|axis| by_direction[axis].map(|by| by * self.focal_px[axis])),
            by_intrinsics,
        };
        (projected.point.u.is_finite() && projected.point.v.is_finite()).then_some(projected)
    }
}

/// With h = √(x² + y²), n² = h² + z² and θ = atan2(h, z), the point is r(θ) (x, y)/h. Its derivatives follow from
/// ∂θ/∂h = z/n² and ∂θ/∂z = −h/n².
fn radial(curve: &Curve<f64>, [x, y, z]: [f64; 3]) -> Option<Distorted> {
    let h = libm::sqrt(x * x + y * y);
    let n2 = h * h + z * z;
    // Straight behind the camera every azimuth has the same direction, so the image point would be a circle.
    if !(n2 > 0.0) || (h == 0.0 && z < 0.0) {
        return None;
    }
    let theta = libm::atan2(h, z);
    let (r, slope) = curve.radius_and_slope(theta);
    // A negative radius is behind the pole of r(θ): the point would appear on the wrong side of the axis.
    if !(r >= 0.0) {
        return None;
    }
    // On the axis, r/h is r'(0)/z, and the direction of (x, y) does not matter.
    let (per, unit) = if h > 1e-12 * z.abs() { (r / h, [x / h, y / h]) } else { (slope / z, [0.0; 2]) };
    let stretch = slope * z / n2 - per;
    let mixed = stretch * unit[0] * unit[1];
    let by_direction = [
        [per + stretch * unit[0] * unit[0], mixed, -slope * x / n2],
        [mixed, per + stretch * unit[1] * unit[1], -slope * y / n2],
    ];
    let by_k = curve.by_coefficients(theta, 1.0).map(|by| unit.map(|unit| by * unit));
    Some(([x * per, y * per], by_direction, by_k))
}

fn planar(lens: &Brown<f64>, [x, y, z]: [f64; 3]) -> Option<Distorted> {
    let n = libm::sqrt(x * x + y * y + z * z);
    // Nearer to the plane z = 0, x/z grows without limit, and so would the steps of a fit.
    if !(z > 1e-6 * n) {
        return None;
    }
    let (px, py) = (x / z, y / z);
    let (u, v) = lens.distort(px, py);
    let [a, b, c, d] = lens.slope(px, py);
    let by_direction = [[a / z, b / z, -(a * px + b * py) / z], [c / z, d / z, -(c * px + d * py) / z]];
    Some(([u, v], by_direction, Brown::by_coefficients(px, py)))
}
