//! The exact limb of an ellipsoid, and edge points on it without rendering.

use hzn_core::camera::Camera;
use hzn_core::frames::UnitVec3;
use nalgebra::{Matrix3, Vector3};

use crate::edge_errors::{EdgeErrors, EdgeNoise, LimbPoint};
use crate::pose::Pose;

/// The exact limb of an ellipsoid, as rays in the camera frame.
///
/// A ray s touches the ellipsoid x'Ax = 1 with its centre at r if s'Ms = 0, with M = A r r'A − (r'Ar − 1) A
/// (book/theory/ math.md, 13.2). All rays form an elliptic cone.
///
/// # Example
///
/// Noisy edge points on a quarter of Enceladus's limb, for a Monte Carlo:
///
/// ```
/// use hzn_core::camera::{Camera, Config, Model};
/// use hzn_sim::{EdgeNoise, EllipsoidLimb, LimbArc, Pose};
///
/// let camera = Camera::<f64>::try_new(&Config::ideal(Model::Pinhole, 1024, 1024, 4000.0))?;
/// let pose = Pose { position_m: [0.0, 0.0, -3e6], q_fixed_from_camera_wxyz: [1.0, 0.0, 0.0, 0.0] };
/// let limb = EllipsoidLimb::try_new([256.6e3, 251.4e3, 248.3e3], &pose).ok_or("inside")?;
/// let arc = LimbArc { middle_rad: 0.0, length_rad: std::f64::consts::FRAC_PI_2, count: 200 };
/// let points = limb.points(&camera, arc, EdgeNoise::White { sigma_px: 0.3 }, 7);
/// assert_eq!(points.len(), 200);
/// assert_eq!(limb.position_km(), [0.0, 0.0, 3000.0]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EllipsoidLimb {
    /// M in the camera frame. It is positive for rays that meet the ellipsoid.
    m: Matrix3<f64>,
    /// From the camera to the centre, camera frame, metres.
    to_centre_m: Vector3<f64>,
    /// From the camera frame to the body-fixed frame.
    camera_to_body: Matrix3<f64>,
    /// 1/a², 1/b², 1/c².
    inverse_squares: Vector3<f64>,
}

/// An arc of a limb. Azimuths count about the direction to the centre, in the picture: 0 is the side of the camera's x
/// axis (right), π/2 that of its y axis (down).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LimbArc {
    /// Azimuth of its middle, radians.
    pub middle_rad: f64,
    /// Its length in azimuth, radians; 2π is the whole limb.
    pub length_rad: f64,
    /// Number of points, in the middles of equal parts of the arc.
    pub count: usize,
}

impl LimbArc {
    /// Returns the azimuths of its points, radians.
    pub fn azimuths_rad(&self) -> impl Iterator<Item = f64> {
        let Self { middle_rad, length_rad, count } = *self;
        (0..count).map(move |i| middle_rad + length_rad * ((i as f64 + 0.5) / count as f64 - 0.5))
    }
}

impl EllipsoidLimb {
    /// Makes the limb of an ellipsoid with these semi-axes in metres, the limb height included. The pose is body-fixed.
    /// Returns `None` if the camera is not outside the ellipsoid, or if a number is not finite.
    pub fn try_new(semi_axes_m: [f64; 3], pose: &Pose) -> Option<Self> {
        let inverse_squares = Vector3::from(semi_axes_m).map(|a| 1.0 / (a * a));
        let camera_to_body = pose.matrix();
        let to_centre_m = camera_to_body.transpose() * -Vector3::from(pose.position_m);
        let a = camera_to_body.transpose() * Matrix3::from_diagonal(&inverse_squares) * camera_to_body;
        let ar = a * to_centre_m;
        let outside = to_centre_m.dot(&ar) - 1.0;
        let m = ar * ar.transpose() - a * outside;
        let usable = outside > 1e-9 && m.iter().all(|x| x.is_finite());
        usable.then_some(Self { m, to_centre_m, camera_to_body, inverse_squares })
    }

    /// Returns the vector from the camera to the centre in the camera frame, kilometres.
    pub fn position_km(&self) -> [f64; 3] {
        (self.to_centre_m * 1e-3).into()
    }

    /// Returns the vectors that azimuths count between, perpendicular to the direction to the centre.
    fn across(&self) -> [Vector3<f64>; 2] {
        let centre = self.to_centre_m.normalize();
        // A centre on the camera's x axis leaves no x direction; azimuth 0 is then towards −z.
        let helper = if centre.x.abs() < 0.999 { Vector3::x() } else { -Vector3::z() };
        let right = (helper - centre * centre.dot(&helper)).normalize();
        [right, centre.cross(&right)]
    }

    /// Returns the direction of the limb at an azimuth, unit length, camera frame.
    pub fn ray(&self, azimuth_rad: f64) -> [f64; 3] {
        let centre = self.to_centre_m.normalize();
        let ([right, down], (sin, cos)) = (self.across(), libm::sincos(azimuth_rad));
        let outward = right * cos + down * sin;
        // With s = c·centre + outward, s'Ms = 0 is quadratic in c, the cotangent of the angle from the centre. The
        // larger root is the limb; the smaller one is its mirror on the other side.
        let [mcc, mco, moo] =
            [(centre, centre), (centre, outward), (outward, outward)].map(|(x, y)| x.dot(&(self.m * y)));
        let root = (mco * mco - mcc * moo).max(0.0).sqrt();
        let cot = if mco > 0.0 { -moo / (mco + root) } else { (root - mco) / mcc };
        (centre * cot + outward).normalize().into()
    }

    /// Returns the azimuth of a direction in the camera frame, radians from −π to π.
    pub fn azimuth_rad(&self, direction: [f64; 3]) -> f64 {
        let ([right, down], d) = (self.across(), Vector3::from(direction));
        libm::atan2(d.dot(&down), d.dot(&right))
    }

    /// Returns the rays of an arc, unit length, camera frame.
    pub fn rays(&self, arc: LimbArc) -> Vec<[f64; 3]> {
        arc.azimuths_rad().map(|azimuth| self.ray(azimuth)).collect()
    }

    /// Returns the edge points of an arc with their errors; points that the lens does not see or that are outside the
    /// picture are left out. The seed determines the errors.
    pub fn points(&self, camera: &Camera<f64>, arc: LimbArc, noise: EdgeNoise, seed: u64) -> Vec<LimbPoint> {
        let (w, h) = (f64::from(camera.width()), f64::from(camera.height()));
        let mut errors = EdgeErrors::new(seed, noise);
        let (mut points, mut arc_px): (Vec<LimbPoint>, f64) = (Vec::with_capacity(arc.count), 0.0);
        for azimuth_rad in arc.azimuths_rad() {
            let projected = UnitVec3::try_new(self.ray(azimuth_rad)).and_then(|ray| camera.project(&ray));
            let Some(exact) = projected else { continue };
            if !(exact.u >= -0.5 && exact.v >= -0.5 && exact.u <= w - 0.5 && exact.v <= h - 0.5) {
                continue;
            }
            arc_px += points.last().map_or(0.0, |p| libm::hypot(exact.u - p.exact.u, exact.v - p.exact.v));
            let point = errors.disturbed(exact, 0, arc_px);
            points.push(LimbPoint { point, exact, azimuth_rad, segment: 0, arc_px });
        }
        points
    }

    /// Returns the outward normal (body-fixed, unit) where a limb ray touches the ellipsoid, and that point
    /// (body-fixed, metres).
    pub(super) fn touch(&self, ray: &Vector3<f64>) -> (Vector3<f64>, Vector3<f64>) {
        let (s, r) = (self.camera_to_body * ray, self.camera_to_body * self.to_centre_m);
        let weighted = self.inverse_squares.component_mul(&s);
        let range_m = weighted.dot(&r) / weighted.dot(&s);
        let point = s * range_m - r;
        (self.inverse_squares.component_mul(&point).normalize(), point)
    }

    /// Returns the axis of the elliptic cone (camera frame, unit) and the mean of cot² over its two principal
    /// half-angles.
    pub(crate) fn axis_and_cot2(&self) -> ([f64; 3], f64) {
        let eigen = self.m.symmetric_eigen();
        let axis = eigen.eigenvalues.imax();
        let direction: Vector3<f64> = eigen.eigenvectors.column(axis).into();
        let towards = if direction.dot(&self.to_centre_m) < 0.0 { -direction } else { direction };
        let others: f64 = (0..3).filter(|i| *i != axis).map(|i| -eigen.eigenvalues[i]).sum();
        (towards.into(), 0.5 * others / eigen.eigenvalues[axis])
    }
}
