//! The body as an ellipsoid, and its intersection with a ray.

use hzn_core::body::{self, Kind};
use hzn_core::ellipsoid::{WGS84_A_M, WGS84_B_M, geodetic};
use hzn_core::frames::{Cam, UnitVec3};
use nalgebra::{Matrix3, Vector3};

use crate::pose::Pose;

/// An ellipsoid of revolution.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Globe {
    /// Equatorial radius in metres.
    pub a_m: f64,
    /// Polar radius in metres.
    pub b_m: f64,
}

impl Globe {
    /// Returns the body of a sensor's configuration: WGS-84 for `earth`, otherwise its sphere.
    pub fn new(body: &body::Config) -> Self {
        match body.kind {
            Kind::Earth => Self { a_m: WGS84_A_M, b_m: WGS84_B_M },
            _ => {
                let r = body.mean_radius_km() * 1e3;
                Self { a_m: r, b_m: r }
            }
        }
    }
    /// Returns the globe with both semi-axes longer by `height_m`.
    pub fn raised(&self, height_m: f64) -> Self {
        Self { a_m: self.a_m + height_m, b_m: self.b_m + height_m }
    }
    /// Returns the height of a position above the surface in metres, along the surface normal.
    pub fn altitude_m(&self, position_m: [f64; 3]) -> f64 {
        geodetic(position_m, self.a_m, self.b_m).0
    }
}

/// An ellipsoid as seen by one camera. All lengths are divided by the semi-axes, so the ellipsoid is the unit sphere.
/// Below, ECEF stands for the body-fixed frame of any body.
#[derive(Debug, Clone)]
pub(crate) struct View {
    /// Matrix from the camera frame to scaled ECEF: diag(1/a, 1/b, 1/c) times the rotation.
    cam_to_scaled: Matrix3<f64>,
    /// Position in scaled ECEF.
    y: Vector3<f64>,
    /// |y|² − 1, in a form that loses little precision close to the surface.
    outside: f64,
    /// 1/a, 1/b, 1/c in 1/m.
    inverse_axes: Vector3<f64>,
}

/// A ray and its closest approach to the globe.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RayHit {
    /// The ray's direction in scaled ECEF; not of unit length.
    sigma: Vector3<f64>,
    /// −y·σ; it is positive if the ray goes towards the body.
    m: f64,
    /// |σ|².
    s2: f64,
    /// Square of the closest approach to the centre minus 1, in scaled ECEF. It is zero at the limb and negative for a
    /// hit.
    pub(crate) miss: f64,
}

impl View {
    /// Returns `None` if the position is not outside the globe.
    pub(crate) fn try_new(globe: Globe, pose: &Pose) -> Option<Self> {
        let Globe { a_m: a, b_m: b } = globe;
        let [x, y, z] = pose.position_m;
        let p = libm::hypot(x, y);
        let outside = (p - a) * (p + a) / (a * a) + z * z / (b * b);
        let inverse_axes = Vector3::new(1.0 / a, 1.0 / a, 1.0 / b);
        let cam_to_scaled = Matrix3::from_diagonal(&inverse_axes) * pose.matrix();
        let ok = outside > 1e-9 && outside.is_finite() && cam_to_scaled.iter().all(|v| v.is_finite());
        ok.then(|| Self { cam_to_scaled, y: Vector3::new(x / a, y / a, z / b), outside, inverse_axes })
    }

    /// Returns the view of an ellipsoid with three semi-axes in metres; `None` if the position is not outside it.
    pub(crate) fn from_semi_axes(semi_axes_m: [f64; 3], pose: &Pose) -> Option<Self> {
        let axes = Vector3::from(semi_axes_m);
        let y = Vector3::from(pose.position_m).component_div(&axes);
        let outside = y.norm_squared() - 1.0;
        let inverse_axes = axes.map(|a| 1.0 / a);
        let cam_to_scaled = Matrix3::from_diagonal(&inverse_axes) * pose.matrix();
        let ok = outside > 1e-9 && outside.is_finite() && cam_to_scaled.iter().all(|v| v.is_finite());
        ok.then_some(Self { cam_to_scaled, y, outside, inverse_axes })
    }

    /// Returns the unit direction away from the body's centre (scaled ECEF), roughly up.
    pub(crate) fn up(&self) -> Vector3<f64> {
        self.y.normalize()
    }

    /// Intersects the globe with the ray of direction `s` (camera frame, unit length).
    #[inline(always)]
    pub(crate) fn intersect(&self, s: [f64; 3]) -> RayHit {
        let sigma = self.cam_to_scaled * Vector3::from(s);
        let m = -self.y.dot(&sigma);
        let s2 = sigma.norm_squared();
        // A ray that leads away from the body is nearest to it at the camera.
        let approach = if m > 0.0 { m * m / s2 } else { 0.0 };
        RayHit { sigma, m, s2, miss: self.outside - approach }
    }

    /// Returns the derivative of [`RayHit::miss`] by the angle from the limb, in 1/rad.
    pub(crate) fn miss_per_rad(&self) -> f64 {
        // The closest approach is |y| sin γ for the angle γ to the centre; at the limb it is one.
        2.0 * self.outside.sqrt()
    }

    /// Returns the point of the ray on the unit sphere: its entry, or the foot of its closest approach.
    #[inline(always)]
    pub(crate) fn point(&self, hit: &RayHit) -> Vector3<f64> {
        let depth2 = -hit.miss * hit.s2;
        if depth2 > 0.0 {
            self.y + hit.sigma * ((hit.m - depth2.sqrt()) / hit.s2)
        } else {
            self.closest(hit).normalize()
        }
    }

    fn closest(&self, hit: &RayHit) -> Vector3<f64> {
        self.y + hit.sigma * (hit.m.max(0.0) / hit.s2)
    }

    /// Returns the height in metres of the ray's closest approach above the globe, negative for a hit. Its error is of
    /// first order in the flattening times the height, and zero at the limb.
    #[inline(always)]
    pub(crate) fn tangent_height_m(&self, hit: &RayHit) -> f64 {
        let k = (1.0 + hit.miss).max(0.0).sqrt();
        hit.miss / (1.0 + k) * self.metres_per_unit(hit)
    }

    /// Returns the metres along the normal per unit of the closest approach, close to the limb.
    fn metres_per_unit(&self, hit: &RayHit) -> f64 {
        let q = self.closest(hit);
        let n2 = q.norm_squared();
        if n2 < 1e-12 {
            return 1.0 / self.inverse_axes.x;
        }
        (n2 / q.component_mul(&self.inverse_axes).norm_squared()).sqrt()
    }

    /// Returns the distance along the ray from the camera to the closest approach, metres.
    pub(crate) fn approach_distance_m(&self, hit: &RayHit) -> f64 {
        hit.m.max(0.0) / hit.s2
    }

    /// Returns the derivative of the tangent height by (u, v) in metres per pixel. `jacobian` is the derivative of the
    /// ray, with rows x, y, z.
    pub(crate) fn tangent_height_gradient(&self, hit: &RayHit, jacobian: &[[f64; 2]; 3]) -> [f64; 2] {
        // The terms follow from miss = outside − m²/s2 with dm = −y·dσ and ds2 = 2 σ·dσ.
        let r = hit.m / hit.s2;
        let by_sigma = self.y * (2.0 * r) + hit.sigma * (2.0 * r * r);
        let by_ray = self.cam_to_scaled.transpose() * by_sigma;
        let k = (1.0 + hit.miss).max(1e-12).sqrt();
        let scale = self.metres_per_unit(hit) / (2.0 * k);
        [0, 1].map(|c| scale * (by_ray.x * jacobian[0][c] + by_ray.y * jacobian[1][c] + by_ray.z * jacobian[2][c]))
    }

    /// Returns the direction of the ray in ECEF, a unit vector.
    pub(crate) fn direction(&self, hit: &RayHit) -> Vector3<f64> {
        hit.sigma.component_div(&self.inverse_axes)
    }

    /// Converts a direction from ECEF (unit) to the camera frame.
    pub(crate) fn to_camera(&self, ecef: Vector3<f64>) -> Option<UnitVec3<Cam, f64>> {
        // The rotation is orthogonal, so its inverse is its transpose.
        UnitVec3::try_new((self.cam_to_scaled.transpose() * ecef.component_div(&self.inverse_axes)).into())
    }

    /// Returns the outward normal (ECEF, unit) at a point of the unit sphere.
    #[inline(always)]
    pub(crate) fn normal(&self, point: &Vector3<f64>) -> Vector3<f64> {
        point.component_mul(&self.inverse_axes).normalize()
    }

    /// Returns the distance to a point of the unit sphere in metres, and the cosine of the angle at which the ray meets
    /// the surface there.
    #[inline(always)]
    pub(crate) fn range_m_and_incidence(&self, hit: &RayHit, point: &Vector3<f64>) -> (f64, f64) {
        let scaled = (point - self.y).norm();
        (scaled / hit.s2.sqrt(), -hit.sigma.dot(point) / hit.s2.sqrt())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pose::{Look, position_m};

    #[test]
    fn gradient_is_the_difference_quotient() {
        let pose = Pose::looking(position_m(40.0, 3.0, 240.0), Look { depression_rad: 0.27, ..Look::default() });
        let globe = Globe { a_m: WGS84_A_M, b_m: WGS84_B_M }.raised(1e4);
        let view = View::try_new(globe, &pose).unwrap();
        let ray = |u: f64, v: f64| Vector3::new(u, v, 1.0).normalize().into();
        let (u, v, e) = (0.1, 0.02, 1e-5);
        let h = |u, v| view.tangent_height_m(&view.intersect(ray(u, v)));
        let jac = {
            let d = |f: [f64; 3], g: [f64; 3]| core::array::from_fn::<f64, 3, _>(|i| (f[i] - g[i]) / (2.0 * e));
            let (a, b) = (d(ray(u + e, v), ray(u - e, v)), d(ray(u, v + e), ray(u, v - e)));
            core::array::from_fn(|i| [a[i], b[i]])
        };
        let got = view.tangent_height_gradient(&view.intersect(ray(u, v)), &jac);
        let want = [(h(u + e, v) - h(u - e, v)) / (2.0 * e), (h(u, v + e) - h(u, v - e)) / (2.0 * e)];
        for i in 0..2 {
            assert!((got[i] - want[i]).abs() < 0.01 * want[1].abs(), "{got:?} {want:?}");
        }
    }

    #[test]
    fn height_over_a_sphere_is_plain_geometry() {
        let pose = Pose { position_m: [0.0, 0.0, -2000.0], q_fixed_from_camera_wxyz: [1.0, 0.0, 0.0, 0.0] };
        let view = View::try_new(Globe { a_m: 1000.0, b_m: 1000.0 }, &pose).unwrap();
        for angle in [0.1f64, 0.5, 0.6, 1.2] {
            let hit = view.intersect([angle.sin(), 0.0, angle.cos()]);
            assert!((view.tangent_height_m(&hit) - (2000.0 * angle.sin() - 1000.0)).abs() < 1e-9);
        }
        // A ray that leads away from the body is nearest to it at the camera.
        assert!((view.tangent_height_m(&view.intersect([0.0, 0.0, -1.0])) - 1000.0).abs() < 1e-9);
        assert!((view.point(&view.intersect([0.0, 0.0, 1.0])) + Vector3::z()).norm() < 1e-12);
    }

    #[test]
    fn rays_of_an_independent_library_touch_the_globe() {
        let golden: serde_json::Value =
            serde_json::from_str(include_str!("../tests/data/limb_ellipsoid.json")).unwrap();
        let three = |v: &serde_json::Value| core::array::from_fn::<f64, 3, _>(|i| v[i].as_f64().unwrap());
        for case in golden["cases"].as_array().unwrap() {
            // The semi-axes in the file include the atmosphere.
            let globe = Globe { a_m: case["a_m"].as_f64().unwrap(), b_m: case["b_m"].as_f64().unwrap() };
            let rows: [[f64; 3]; 3] = core::array::from_fn(|i| three(&case["R_ec"][i]));
            let axes = core::array::from_fn(|c| rows.map(|row| row[c]));
            let view = View::try_new(globe, &Pose::from_axes(three(&case["r_ecef_m"]), axes)).unwrap();
            for ray in case["rays_c"].as_array().unwrap() {
                let hit = view.intersect(three(ray));
                // The miss is checked as an angle from the limb.
                assert!((hit.miss / view.miss_per_rad()).abs() < 1e-9, "{} {:e}", case["id"], hit.miss);
                assert!(view.tangent_height_m(&hit).abs() < 0.01);
            }
        }
    }
}
