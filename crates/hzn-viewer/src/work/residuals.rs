//! Residuals of edge points from a fitted limb, and the 3-sigma ellipse of an axis.

use hzn_core::Solution;
use hzn_core::camera::Camera;
use hzn_core::frames::UnitVec3;
use hzn_core::pixel::ImagePoint;
use hzn_run::engine::trace::Edge;
use hzn_run::explain;

use crate::model::view::Point;

/// Residual of one edge point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Residual {
    /// Angle about the limb axis in degrees, -180 to 180, from image x towards image y.
    pub azimuth_deg: f64,
    /// Distance from the fitted limb in pixels, positive outside.
    pub distance_px: f64,
    /// Weight in the fit, 0 to 1.
    pub weight: f64,
    /// The edge point, in pixels.
    pub point: Point,
}

impl Residual {
    /// Returns the rejected point that is nearest to a point of the picture, within `reach_px`.
    pub fn rejected_at(all: &[Self], p: Point, reach_px: f64) -> Option<&Self> {
        let distance = |r: &&Self| (r.point[0] - p[0]).hypot(r.point[1] - p[1]);
        let rejected = all.iter().filter(|r| r.weight <= 0.0 && distance(r) <= reach_px);
        rejected.min_by(|a, b| distance(a).total_cmp(&distance(b)))
    }
}

/// Returns two unit vectors perpendicular to the axis (camera frame): image x and y, turned with the optical axis onto
/// the limb axis by the shortest rotation.
pub(super) fn tangent_basis([x, y, z]: [f64; 3]) -> [[f64; 3]; 2] {
    let q = 1.0 / (1.0 + z).max(1e-9);
    [[1.0 - x * x * q, -x * y * q, -x], [-x * y * q, 1.0 - y * y * q, -y]]
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Returns the direction at `angle_rad` from the axis (camera frame). The azimuth counts from image x towards image y.
fn direction_at(axis: [f64; 3], angle_rad: f64, azimuth_rad: f64) -> Option<UnitVec3<hzn_core::frames::Cam, f64>> {
    let [b1, b2] = tangent_basis(axis);
    let ((s, c), (sa, ca)) = (angle_rad.sin_cos(), azimuth_rad.sin_cos());
    UnitVec3::try_new(std::array::from_fn(|i| c * axis[i] + s * (ca * b1[i] + sa * b2[i])))
}

/// Returns the outline of the 3-sigma ellipse of an axis, in pixels.
pub(super) fn ellipse(s: &Solution<f64>, camera: &Camera<f64>) -> Vec<Point> {
    const STEPS: usize = 72;
    let ([major, minor], angle) = explain::principal_sigmas(s);
    let point = |i: usize| {
        let (sin, cos) = (i as f64 * std::f64::consts::TAU / STEPS as f64).sin_cos();
        let (a, b) = (3.0 * major * cos, 3.0 * minor * sin);
        let p = camera.project(&direction_at(s.axis.xyz(), a.hypot(b), b.atan2(a) + angle)?)?;
        Some([p.u, p.v])
    };
    (0..=STEPS).map(point).collect::<Option<_>>().unwrap_or_default()
}

/// Returns the residuals of an edge's points from a fitted limb.
pub fn residuals(s: &Solution<f64>, edge: &Edge, camera: &Camera<f64>) -> Vec<Residual> {
    let axis = s.axis.xyz();
    let [b1, b2] = tangent_basis(axis);
    let residual = |(at, weight): (&Point, &f64)| {
        let ray = camera.unproject(ImagePoint { u: at[0], v: at[1] })?.xyz();
        let (x, y) = (dot(ray, b1), dot(ray, b2));
        let azimuth = y.atan2(x);
        let limb = camera.project(&direction_at(axis, s.fused_half_angle_rad, azimuth)?)?;
        let outside = x.hypot(y).atan2(dot(ray, axis)) - s.fused_half_angle_rad;
        let distance = (at[0] - limb.u).hypot(at[1] - limb.v);
        Some(Residual {
            azimuth_deg: azimuth.to_degrees(),
            distance_px: distance.copysign(outside),
            weight: *weight,
            point: *at,
        })
    };
    edge.points.iter().zip(&edge.weights).filter_map(residual).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_rejected_point_is_found() {
        let at = |x: f64, weight: f64| Residual { azimuth_deg: 0.0, distance_px: x, weight, point: [x, 0.0] };
        let all = [at(1.0, 0.0), at(2.0, 1.0), at(3.0, 0.0)];
        let found = |x: f64| Residual::rejected_at(&all, [x, 0.0], 1.5).map(|r| r.distance_px);
        assert_eq!((found(2.2), found(0.0), found(9.0)), (Some(3.0), Some(1.0), None));
    }
}
