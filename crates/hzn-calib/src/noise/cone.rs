//! The cone through the edge points of one picture, with a free half-angle.
//!
//! The state is the unit axis e and c = cos α. With the slope g = |∂(s·e)/∂(u, v)| of a ray s, the distance from the
//! limb is r = (c + o − s·e)/g in pixels. Here o is the offset of cos α by azimuth if the attitude is known, else 0.
//! With the tangent basis B at e and the weighted mean m of Bᵀs, the rows are h = [Bᵀs − m, −1]/g, and
//! (Σ w h hᵀ) δ = Σ w r h. The change of c is a·δ with a = (m, 1).

use hzn_core::Prior;
use hzn_core::camera::{Camera, INTRINSICS};
use hzn_core::ellipsoid::LimbCone;
use hzn_core::frames::UnitVec3;
use hzn_core::pixel::ImagePoint;
use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};

/// Largest number of iterations of the fit, which starts at the pipeline's answer.
const ITERATIONS: usize = 8;
/// Smallest number of points. Fewer points agree with almost any cone.
const MIN_POINTS: usize = 24;

/// An edge point with a weight.
#[derive(Debug, Clone, Copy)]
struct EdgePoint {
    ray: Vector3<f64>,
    /// Derivatives of the ray by u and by v.
    derivatives: [Vector3<f64>; 2],
    /// Offset from the principal point, in pixels.
    off_px: [f64; 2],
    /// Motion of the image point by each 1-sigma mode of the lens, in pixels.
    by_lens_px: [[f64; 2]; INTRINSICS],
    weight: f64,
    /// Distance to the next of these points along the edge, in pixels; 0 for the last.
    step_px: f64,
}

/// Row of the normal equations for one point.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Row {
    /// h, per pixel.
    pub(crate) h: Vector3<f64>,
    /// Distance r from the limb, in pixels.
    pub(crate) r_px: f64,
    /// Slope g, per pixel.
    pub(crate) slope: f64,
    /// Weight of the fit, 0 to 1.
    pub(crate) weight: f64,
    /// Distance to the next point along the edge, in pixels.
    pub(crate) step_px: f64,
    /// Position along the edge, from −1 at its beginning to 1 at its end.
    pub(crate) along: f64,
    /// Azimuth about the axis in the tangent basis, in radians.
    pub(crate) azimuth_rad: f64,
    /// Change of r per relative change of the focal length, in pixels.
    pub(crate) by_focal_px: f64,
    /// Change of r by each 1-sigma mode of the lens, in pixels; those beyond the number of modes are 0.
    pub(crate) by_lens_px: [f64; INTRINSICS],
}

/// A fitted cone.
#[derive(Debug, Clone)]
pub(crate) struct Cone {
    /// Cosine of the (mean) half-angle.
    pub(crate) cos: f64,
    pub(crate) rows: Vec<Row>,
    /// Rays of the rows.
    pub(crate) rays: Vec<Vector3<f64>>,
    /// Inverse of Σ w h hᵀ, px².
    pub(crate) inverse: Matrix3<f64>,
    /// a: the change of c is a·δ.
    pub(crate) to_cos: Vector3<f64>,
    /// Σ w.
    pub(crate) weight: f64,
}

impl Cone {
    /// Fits the cone to weighted points (pixels). The fit starts at the pipeline's axis (camera frame) and cos α.
    /// `azimuth` is the offset of cos α for a limb that is not a circle. The result is `None` if the points do not
    /// determine the cone.
    pub(crate) fn fit(
        camera: &Camera<f64>,
        points: &[([f64; 2], f64)],
        axis: [f64; 3],
        cos: f64,
        azimuth: Option<&Azimuth>,
    ) -> Option<Self> {
        let edge_points = locate_edge_points(camera, points);
        if edge_points.len() < MIN_POINTS {
            return None;
        }
        let (mut e, mut c) = (Vector3::from(axis), cos);
        for _ in 0..ITERATIONS {
            let cone = Self::evaluate(&edge_points, e, c, azimuth)?;
            let sum: Vector3<f64> = cone.rows.iter().map(|r| r.h * (r.weight * r.r_px)).sum();
            let step = cone.inverse * sum;
            let (b1, b2) = basis(&e);
            e = (e + b1 * step.x + b2 * step.y).try_normalize(1e-12)?;
            c += cone.to_cos.dot(&step);
            if step.norm() < 1e-13 {
                break;
            }
        }
        Self::evaluate(&edge_points, e, c, azimuth)
    }

    /// Returns the cone of a limb whose `cos` α is known, for the derivatives of the fitted cos α by the lens.
    ///
    /// The axis is fitted with this half-angle, and the points are replaced by their feet, the nearest points of that
    /// limb. At the free half-angle and at the points themselves, a derivative has the noise of the picture: a noisy
    /// half-angle comes with a derivative in proportion to it, and a regression of the one over the other finds a slope
    /// where there is none.
    pub(crate) fn of_known_limb(
        camera: &Camera<f64>,
        points: &[([f64; 2], f64)],
        axis: [f64; 3],
        cos: f64,
        azimuth: Option<&Azimuth>,
    ) -> Option<Self> {
        let mut e = Vector3::from(axis);
        let located = locate_edge_points(camera, points);
        for _ in 0..ITERATIONS {
            let cone = Self::evaluate(&located, e, cos, azimuth)?;
            let (mut normal, mut right) = (Matrix2::zeros(), Vector2::zeros());
            for row in &cone.rows {
                // The row of the axis alone, without the mean that belongs to the free cos α.
                let h = Vector2::new(row.h.x + cone.to_cos.x / row.slope, row.h.y + cone.to_cos.y / row.slope);
                normal += h * h.transpose() * row.weight;
                right += h * (row.weight * row.r_px);
            }
            let step = normal.try_inverse()? * right;
            let (b1, b2) = basis(&e);
            e = (e + b1 * step.x + b2 * step.y).try_normalize(1e-12)?;
            if step.norm() < 1e-13 {
                break;
            }
        }
        let found = Self::evaluate(&located, e, cos, azimuth)?;
        let foot = |(row, p): (&Row, &EdgePoint)| {
            let along = p.derivatives.map(|derivative| e.dot(&derivative) / row.slope * row.r_px);
            let centre = camera.principal_point();
            ([centre.u + p.off_px[0] + along[0], centre.v + p.off_px[1] + along[1]], p.weight)
        };
        let feet: Vec<_> = found.rows.iter().zip(&located).map(foot).collect();
        Self::evaluate(&locate_edge_points(camera, &feet), e, cos, azimuth)
    }

    /// Computes the rows and the normal equations at an axis and cos α.
    fn evaluate(points: &[EdgePoint], axis: Vector3<f64>, cos: f64, azimuth: Option<&Azimuth>) -> Option<Self> {
        let (b1, b2) = basis(&axis);
        let slope = |p: &EdgePoint| axis.dot(&p.derivatives[0]).hypot(axis.dot(&p.derivatives[1])).max(1e-12);
        let (mut m, mut total) = ([0.0; 2], 0.0);
        for p in points {
            let w = p.weight / slope(p).powi(2);
            m = [m[0] + w * p.ray.dot(&b1), m[1] + w * p.ray.dot(&b2)];
            total += w;
        }
        let m = m.map(|m| m / total);
        let row = |p: &EdgePoint| {
            let (g, d) = (slope(p), p.ray.dot(&axis));
            let (x, y) = (p.ray.dot(&b1), p.ray.dot(&b2));
            let offset = azimuth.map_or(0.0, |a| a.offset(&p.ray, &axis));
            let slopes = [axis.dot(&p.derivatives[0]), axis.dot(&p.derivatives[1])];
            let across = |[u, v]: &[f64; 2]| (slopes[0] * u + slopes[1] * v) / g;
            Row {
                h: Vector3::new(x - m[0], y - m[1], -1.0) / g,
                r_px: (cos + offset - d) / g,
                slope: g,
                weight: p.weight,
                step_px: p.step_px,
                along: 0.0,
                azimuth_rad: y.atan2(x),
                by_focal_px: across(&p.off_px),
                by_lens_px: core::array::from_fn(|k| across(&p.by_lens_px[k])),
            }
        };
        let mut rows: Vec<Row> = points.iter().map(row).collect();
        let total_px: f64 = points.iter().map(|p| p.step_px).sum();
        let mut passed_px = 0.0;
        for row in &mut rows {
            row.along = 2.0 * passed_px / total_px.max(1e-12) - 1.0;
            passed_px += row.step_px;
        }
        let normal: Matrix3<f64> = rows.iter().map(|r| r.h * r.h.transpose() * r.weight).sum();
        Some(Self {
            cos,
            inverse: normal.try_inverse()?,
            to_cos: Vector3::new(m[0], m[1], 1.0),
            weight: rows.iter().map(|r| r.weight).sum(),
            rays: points.iter().map(|p| p.ray).collect(),
            rows,
        })
    }

    /// Returns the weighted RMS distance of the points from the limb, in pixels.
    pub(crate) fn rms_px(&self) -> f64 {
        (self.rows.iter().map(|r| r.weight * r.r_px * r.r_px).sum::<f64>() / self.weight).sqrt()
    }

    /// Returns the length of the edge that the points cover, in pixels.
    pub(crate) fn arc_px(&self) -> f64 {
        self.rows.iter().map(|r| r.step_px).sum()
    }

    /// Returns the change of cos α per pixel: the root of the weighted harmonic mean of the squared slopes.
    pub(crate) fn cos_per_px(&self) -> f64 {
        let inverse_squares: f64 = self.rows.iter().map(|r| r.weight / (r.slope * r.slope)).sum();
        (self.weight / inverse_squares.max(1e-300)).sqrt()
    }

    /// Returns the change of the fitted cos α if every r grows by `signal` (pixels).
    pub(crate) fn change_of_cos(&self, signal: impl Fn(&Row) -> f64) -> f64 {
        let sum: Vector3<f64> = self.rows.iter().map(|r| r.h * (r.weight * signal(r))).sum();
        self.to_cos.dot(&(self.inverse * sum))
    }

    /// Returns the share of each point in the fitted cos α: the change of the fitted value if cos α of the limb grows
    /// by 1 at this point alone. The shares of all points sum to 1.
    pub(crate) fn shares(&self) -> Vec<f64> {
        let a = self.inverse * self.to_cos;
        self.rows.iter().map(|r| -r.weight * a.dot(&r.h) / r.slope).collect()
    }

    /// Returns the variance of the fitted cos α if the errors along the limb are a Gauss-Markov process with `sigma_px`
    /// and the length `correlation_px`. The fraction `white` of its variance is independent from point to point.
    pub(crate) fn variance_of_cos(&self, sigma_px: f64, correlation_px: f64, white: f64) -> f64 {
        let a = self.inverse * self.to_cos;
        let (mut own, mut pairs, mut carried) = (0.0, 0.0, 0.0);
        for row in &self.rows {
            let q = row.weight * a.dot(&row.h);
            own += q * q;
            pairs += 2.0 * q * carried;
            carried = (carried + q) * decay(row.step_px, correlation_px);
        }
        sigma_px * sigma_px * (own + (1.0 - white) * pairs)
    }
}

/// Returns exp(−step/length); 0 for white errors, which have length 0.
pub(crate) fn decay(step_px: f64, length_px: f64) -> f64 {
    if length_px > 0.0 { (-step_px / length_px).exp() } else { 0.0 }
}

/// Returns the points that have a weight and a ray, each with the distance to the next.
fn locate_edge_points(camera: &Camera<f64>, points: &[([f64; 2], f64)]) -> Vec<EdgePoint> {
    let centre = camera.principal_point();
    let kept = points.iter().filter(|(_, weight)| *weight > 0.0);
    let mut located: Vec<([f64; 2], EdgePoint)> = kept
        .filter_map(|&([u, v], weight)| {
            let ray = camera.ray(ImagePoint { u, v })?;
            let j = ray.jacobian();
            let derivatives = [0, 1].map(|k| Vector3::new(j[0][k], j[1][k], j[2][k]));
            let off_px = [u - centre.u, v - centre.v];
            let mut by_lens_px = [[0.0; 2]; INTRINSICS];
            by_lens_px.iter_mut().zip(camera.shifts_by_lens(&ray.direction())).for_each(|(to, by)| *to = by);
            let ray = Vector3::from(ray.direction().xyz());
            Some(([u, v], EdgePoint { ray, derivatives, off_px, by_lens_px, weight, step_px: 0.0 }))
        })
        .collect();
    let ahead: Vec<[f64; 2]> = located.iter().skip(1).map(|p| p.0).collect();
    for ((here, point), next) in located.iter_mut().zip(ahead) {
        point.step_px = (next[0] - here[0]).hypot(next[1] - here[1]);
    }
    located.into_iter().map(|p| p.1).collect()
}

/// Returns two unit vectors that are perpendicular to `e` and to each other.
pub(crate) fn basis(e: &Vector3<f64>) -> (Vector3<f64>, Vector3<f64>) {
    let b1 = e.cross(&Vector3::ith(e.iamin(), 1.0)).normalize();
    (b1, e.cross(&b1))
}

/// The cosine of the half-angle by azimuth about the axis, for an ellipsoid whose north is known in the camera frame.
/// The pipeline has the same model.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Azimuth {
    east: Vector3<f64>,
    cot2_east: f64,
    cot2_meridian: f64,
    mean_cos: f64,
}

impl Azimuth {
    /// Creates the offsets for a limb cone from the camera's attitude; `None` without an attitude.
    pub(crate) fn new(cone: &LimbCone<f64>, prior: &Prior<f64>) -> Option<Self> {
        let east: UnitVec3<_, f64> = prior.fixed_from_camera?.inverse().apply(&cone.east);
        Some(Self {
            east: Vector3::from(east.xyz()),
            cot2_east: cone.cot2_east,
            cot2_meridian: cone.cot2_meridian,
            mean_cos: cone.mean_half_angle_rad().cos(),
        })
    }

    /// Returns the offset of cos α for a ray.
    pub(crate) fn offset(&self, ray: &Vector3<f64>, axis: &Vector3<f64>) -> f64 {
        let d = ray.dot(axis);
        let along = ray.dot(&self.east) - d * axis.dot(&self.east);
        let cos2 = (along * along / (1.0 - d * d).max(1e-12)).min(1.0);
        let cot2 = self.cot2_meridian + (self.cot2_east - self.cot2_meridian) * cos2;
        (cot2 / (1.0 + cot2)).sqrt() - self.mean_cos
    }
}
