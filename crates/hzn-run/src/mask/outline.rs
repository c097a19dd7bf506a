//! The outline of a body in the sky, with its margin.

use std::f64::consts::TAU;

use hzn_core::Solution;
use hzn_core::body::Expected;
use hzn_core::camera::Ray;
use hzn_core::frames::{Cam, UnitVec3};
use hzn_core::report::Position;

use crate::tangent::basis;

/// Number of steps around an outline. Between two steps the limit is interpolated; for the limb of the most elongated
/// body, Phobos from near by, the error is below 0.02°.
const STEPS: usize = 720;
/// Number of standard deviations that the margin has.
const SIGMAS: f64 = 3.0;

/// The part of the sky that a body covers: all directions within an angle from its axis, which depends on the azimuth
/// about the axis.
#[derive(Debug, Clone)]
pub struct Outline {
    axis: [f64; 3],
    across: [[f64; 3]; 2],
    /// The angle at even steps of azimuth, the first one again at the end; radians.
    limits_rad: Vec<f64>,
    least_rad: f64,
    largest_rad: f64,
}

/// Returns the scalar product.
fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Returns the unit vector across the axis at an azimuth.
fn outward([b1, b2]: &[[f64; 3]; 2], azimuth_rad: f64) -> [f64; 3] {
    let (sin, cos) = azimuth_rad.sin_cos();
    [0, 1, 2].map(|i| b1[i] * cos + b2[i] * sin)
}

impl Outline {
    /// Makes an outline; `limit_rad` returns the angle for an azimuth and the unit vector across the axis there.
    fn new(axis: [f64; 3], limit_rad: impl Fn(f64, [f64; 3]) -> f64) -> Self {
        let (b1, b2) = basis(axis);
        let across = [b1, b2];
        let at = |step: usize| {
            let azimuth_rad = TAU * (step % STEPS) as f64 / STEPS as f64;
            limit_rad(azimuth_rad, outward(&across, azimuth_rad))
        };
        let limits_rad: Vec<f64> = (0..=STEPS).map(at).collect();
        Self {
            axis,
            across,
            least_rad: limits_rad.iter().copied().fold(f64::INFINITY, f64::min),
            largest_rad: limits_rad.iter().copied().fold(f64::NEG_INFINITY, f64::max),
            limits_rad,
        }
    }

    /// Makes the outline of a disc that was not searched. `margin_rad` is added to its half-angle.
    pub(super) fn disc(axis: &UnitVec3<Cam, f64>, half_angle_rad: f64, margin_rad: f64) -> Self {
        Self::new(axis.xyz(), |_, _| half_angle_rad + margin_rad)
    }

    /// Makes the outline of an answer: its limb, moved outwards by three standard deviations of the limb itself and by
    /// `margin_rad`.
    pub(super) fn of_answer(solution: &Solution<f64>, expected: &Expected<f64>, margin_rad: f64) -> Self {
        if let Some(position) = &solution.position {
            return Self::of_position(solution.axis.xyz(), position, margin_rad);
        }
        let limb = Limb::new(solution, expected);
        Self::new(solution.axis.xyz(), |_, outward| {
            limb.half_angle_rad(outward) + SIGMAS * limb.sigma_rad(outward) + margin_rad
        })
    }

    /// Makes the outline of a body whose position was fitted, about its axis.
    fn of_position(axis: [f64; 3], position: &Position<f64>, margin_rad: f64) -> Self {
        let (b1, b2) = basis(axis);
        // The parameter of the limb is an angle of scaled space, so the azimuth is computed from the direction.
        let point = |step: usize| {
            let s = position.limb_direction(TAU * step as f64 / STEPS as f64).xyz();
            let (x, y) = (dot(s, b1), dot(s, b2));
            (y.atan2(x).rem_euclid(TAU), x.hypot(y).atan2(dot(s, axis)))
        };
        let mut points: Vec<(f64, f64)> = (0..STEPS).map(point).collect();
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        let around = |shift: f64| move |&(azimuth, angle): &(f64, f64)| (azimuth + shift, angle);
        let before = points.last().map(around(-TAU));
        let after = points.first().map(around(TAU));
        let closed: Vec<(f64, f64)> = before.into_iter().chain(points.iter().copied()).chain(after).collect();
        Self::new(axis, |azimuth_rad, outward| {
            let half_angle_rad = interpolated(&closed, azimuth_rad);
            half_angle_rad + SIGMAS * sigma_of_position(position, half_angle_rad, outward) + margin_rad
        })
    }

    /// Returns whether the body covers a part of the pixel with this ray.
    pub(super) fn covers(&self, ray: &Ray<f64>) -> bool {
        let (angle_rad, size_rad) = self.angle(ray, [0.5, 0.5]);
        let nearest_rad = angle_rad - size_rad;
        if nearest_rad <= self.least_rad || nearest_rad > self.largest_rad {
            return nearest_rad <= self.least_rad;
        }
        let s = ray.direction().xyz();
        let [b1, b2] = self.across;
        let place = dot(s, b2).atan2(dot(s, b1)).rem_euclid(TAU) / TAU * STEPS as f64;
        let step = (place as usize).min(STEPS - 1);
        let limit = |step: usize| self.limits_rad.get(step).copied().unwrap_or(self.largest_rad);
        nearest_rad <= limit(step) + (place - step as f64) * (limit(step + 1) - limit(step))
    }

    /// Returns whether the body covers every pixel, or none of them, within `half_px` columns and rows of the pixel
    /// with this ray; `None` if some of them may be covered.
    pub(super) fn covers_all(&self, ray: &Ray<f64>, half_px: f64) -> Option<bool> {
        let s = ray.direction().xyz();
        let angle_rad = angle_between(s, self.axis);
        // The angle changes by no more than the ray does. The factor allows for a lens that is not the same everywhere.
        let size = ray.jacobian().iter().flatten().map(|d| d * d).sum::<f64>().sqrt() * half_px * 2.0;
        if angle_rad + size <= self.least_rad {
            return Some(true);
        }
        (angle_rad - size > self.largest_rad).then_some(false)
    }

    /// Returns the angle of a ray from the axis, and how much it changes over a number of columns and rows; radians.
    fn angle(&self, ray: &Ray<f64>, [columns, rows]: [f64; 2]) -> (f64, f64) {
        let s = ray.direction().xyz();
        let angle_rad = angle_between(s, self.axis);
        let sin = angle_rad.sin();
        if sin < 1e-12 {
            return (angle_rad, 0.0);
        }
        let jacobian = ray.jacobian();
        let along = |column: usize| dot([0, 1, 2].map(|i| jacobian[i][column]), self.axis).abs() / sin;
        (angle_rad, along(0) * columns + along(1) * rows)
    }
}

/// Returns the angle between two unit vectors, also of nearly equal ones.
fn angle_between(a: [f64; 3], b: [f64; 3]) -> f64 {
    let cross = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
    dot(cross, cross).sqrt().atan2(dot(a, b))
}

/// Returns the value at `x` of a line through points that are sorted by x.
fn interpolated(points: &[(f64, f64)], x: f64) -> f64 {
    let after = points.partition_point(|p| p.0 <= x).clamp(1, points.len() - 1);
    let ((x0, y0), (x1, y1)) = (points[after - 1], points[after]);
    if x1 > x0 { y0 + (x - x0) / (x1 - x0) * (y1 - y0) } else { y0.max(y1) }
}

/// Returns the 1-sigma of the limb of a fitted position at one azimuth, radians. With the centre c at the distance r,
/// the axis moves by δc/r across, and the half-angle α by −tan α δr/r.
fn sigma_of_position(position: &Position<f64>, half_angle_rad: f64, outward: [f64; 3]) -> f64 {
    let centre = position.centre_m;
    let range = dot(centre, centre).sqrt();
    let tan = half_angle_rad.tan();
    let w = [0, 1, 2].map(|i| (outward[i] - tan * centre[i] / range) / range);
    let [xx, xy, xz, yy, yz, zz] = position.covariance_m2;
    let rows = [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]];
    dot(w, rows.map(|row| dot(row, w))).max(0.0).sqrt()
}

/// The limb of an answer without a position.
struct Limb<'a> {
    solution: &'a Solution<f64>,
    expected: &'a Expected<f64>,
    /// Covariance of the axis with the cosine of the half-angle, and the variance of this cosine.
    axis_with_cos: [f64; 3],
    var_cos: f64,
    sin: f64,
}

impl<'a> Limb<'a> {
    fn new(solution: &'a Solution<f64>, expected: &'a Expected<f64>) -> Self {
        let (_, sigma_cos) = expected.cos_and_sigma();
        let expected_var = sigma_cos * sigma_cos;
        let (axis_with_cos, var_cos) = match &solution.free {
            // What was fitted freely is known better by the factor that the expected half-angle leaves of its variance.
            Some(free) => {
                let is_fused = solution.fused_half_angle_rad != solution.half_angle_rad;
                let left = if is_fused { expected_var / (expected_var + free.var_cos) } else { 1.0 };
                (free.axis_with_cos.unwrap_or_default().map(|c| c * left), free.var_cos * left)
            }
            // A half-angle that was not fitted has the expected error, and so has the axis in proportion.
            None => (solution.axis_by_cos.unwrap_or_default().map(|k| k * expected_var), expected_var),
        };
        Self { solution, expected, axis_with_cos, var_cos, sin: solution.fused_half_angle_rad.sin() }
    }

    /// Returns the half-angle at the azimuth of the unit vector `outward`, radians.
    fn half_angle_rad(&self, outward: [f64; 3]) -> f64 {
        let (sin, cos) = self.solution.fused_half_angle_rad.sin_cos();
        let axis = &self.solution.axis;
        let ray = UnitVec3::try_new([0, 1, 2].map(|i| cos * axis.xyz()[i] + sin * outward[i]));
        self.solution.fused_half_angle_rad + ray.map_or(0.0, |ray| self.expected.limb_offset_rad(axis, &ray))
    }

    /// Returns the 1-sigma of the limb there, radians. The limb moves by u·δe − δcos α/sin α, whose parts are known
    /// only together: a short arc in view is much better known than its axis.
    fn sigma_rad(&self, outward: [f64; 3]) -> f64 {
        let rows = self.solution.covariance.rows();
        let of_axis = dot(outward, rows.map(|row| dot(row, outward)));
        let together = 2.0 * dot(outward, self.axis_with_cos) / self.sin;
        let variance = of_axis + self.var_cos / (self.sin * self.sin) - together;
        (variance.max(0.0) + self.expected.uneven_rad().powi(2)).sqrt()
    }
}
