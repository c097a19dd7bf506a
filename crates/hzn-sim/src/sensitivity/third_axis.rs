//! The rotation about the line to a flattened body, from the shape of its limb (math.md, 13.8).
//!
//! The rows are those of (13.5): with the normal ν of the limb at the point q and its distance t, the limb moves by
//! (ν·δr + (q × ν)·u ψ + δd cos 2φ)/t, for an error δr of the position, a rotation ψ of the body about the direction u
//! to it, and a second harmonic δd of the limb height. This implementation is independent of hzn-core, and a test
//! compares both.

use hzn_core::camera::{self, Camera};
use hzn_core::pixel::ImagePoint;
use nalgebra::{Matrix3, Matrix4, Vector2, Vector3, Vector4};
use serde::Serialize;

use super::correlated::{Row, correlated};
use super::design::{DesignError, rotation_to_camera};
use super::limb_samples::{LimbSample, sample};
use crate::edge_errors::{EdgeErrors, EdgeNoise};

/// A camera above a flattened body.
#[derive(Debug, Clone, PartialEq)]
pub struct ThirdAxis {
    /// The lens and the size of the picture.
    pub camera: camera::Config,
    /// Semi-axes of the body, z to the north pole, kilometres, above 0.
    pub radii_km: [f64; 3],
    /// Height of the visible limb above the surface, kilometres.
    pub limb_height_km: f64,
    /// 1-sigma of each component, cos 2φ and sin 2φ of the azimuth φ, of the limb height along the limb, kilometres.
    pub second_harmonic_km: f64,
    /// Altitude above the mean of the semi-axes, kilometres.
    pub altitude_km: f64,
    /// Latitude of the camera as seen from the centre, degrees. The camera is above the meridian of the x axis.
    pub latitude_deg: f64,
    /// Direction of view from north over east, degrees.
    pub azimuth_deg: f64,
    /// Angle of the optical axis below the local horizontal, degrees; 90 looks at the centre of the body.
    pub depression_deg: f64,
    /// Turn about the optical axis, degrees.
    pub roll_deg: f64,
    /// 1-sigma of an edge point along u and along v, pixels.
    pub sigma_px: f64,
    /// Correlation length of the errors along the edge, pixels; 0 means white errors.
    pub correlation_px: f64,
}

/// 1-sigma of the rotation about the line to the body, degrees. Nothing is known of the position.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ThirdAxisSigmas {
    /// Length of limb in the picture, pixels.
    pub limb_px: f64,
    /// By the errors of the edge points.
    pub by_edges_deg: f64,
    /// By the second harmonic of the limb height.
    pub by_height_deg: f64,
}

impl ThirdAxisSigmas {
    /// Returns the 1-sigma by all errors, degrees.
    pub fn total_deg(&self) -> f64 {
        self.by_edges_deg.hypot(self.by_height_deg)
    }
}

/// The body as the camera sees it.
struct Sight {
    /// From the camera to the centre of the body, camera frame, kilometres.
    r: Vector3<f64>,
    /// Symmetric root of the matrix of the limb's ellipsoid: U, and its inverse.
    to: Matrix3<f64>,
    from: Matrix3<f64>,
}

impl ThirdAxis {
    /// Returns the sigmas; `None` if the limb in view does not determine the rotation: for a body without flattening,
    /// over its pole, or with too short a limb.
    ///
    /// # Errors
    /// Fails if the camera is invalid or not above the limb.
    pub fn sigmas(&self) -> Result<Option<ThirdAxisSigmas>, DesignError> {
        let camera = Camera::try_new(&self.camera)?;
        let sight = self.sight()?;
        let samples = sample(&camera, &|azimuth| sight.limb(azimuth));
        Ok(self.of_samples(&camera, &sight, &samples))
    }

    /// Returns the limb in view as points one pixel apart, with errors. `height_km` has the two components of the
    /// second harmonic of the limb height.
    ///
    /// # Errors
    /// Fails as [`Self::sigmas`].
    pub fn limb_points(&self, height_km: [f64; 2], seed: u64) -> Result<Vec<ImagePoint<f64>>, DesignError> {
        let camera = Camera::try_new(&self.camera)?;
        let sight = self.sight()?;
        let direction = |azimuth: f64| {
            let s = sight.limb(azimuth).normalize();
            let point = sight.point(&s);
            let (sin, cos) = (2.0 * azimuth).sin_cos();
            s + point.normal * ((height_km[0] * cos + height_km[1] * sin) / point.t)
        };
        let noise = EdgeNoise::GaussMarkov {
            variance_px2: self.sigma_px * self.sigma_px,
            correlation_px: self.correlation_px.max(1e-9),
        };
        let mut errors = EdgeErrors::new(seed, noise);
        let (mut segment, mut arc_px) = (0, 0.0);
        let disturbed = |s: &LimbSample| {
            match s.step_px {
                Some(step) => arc_px += step,
                None => (segment, arc_px) = (segment + 1, 0.0),
            }
            errors.disturbed(s.point, segment, arc_px)
        };
        Ok(sample(&camera, &direction).iter().map(disturbed).collect())
    }

    /// Returns the axes of the body in the camera frame (as columns), and the position of the camera in the axes of the
    /// body in kilometres.
    pub fn pose(&self) -> (Matrix3<f64>, Vector3<f64>) {
        let (sin, cos) = self.latitude_deg.to_radians().sin_cos();
        let (up, north) = (Vector3::new(cos, 0.0, sin), Vector3::new(-sin, 0.0, cos));
        let distance = self.radii_km.iter().sum::<f64>() / 3.0 + self.altitude_km;
        let turn = rotation_to_camera(&up, &north, [self.azimuth_deg, self.depression_deg, self.roll_deg]);
        (turn, up * distance)
    }

    fn sight(&self) -> Result<Sight, DesignError> {
        let (camera_from_fixed, place) = self.pose();
        let axes = self.radii_km.map(|a| a + self.limb_height_km);
        let scaled: f64 = place.iter().zip(axes).map(|(x, a)| (x / a).powi(2)).sum();
        if !(axes.iter().all(|a| *a > 0.0) && scaled > 1.0) {
            return Err(DesignError::Inside { altitude_km: self.altitude_km, limb_height_km: self.limb_height_km });
        }
        let diagonal = Matrix3::from_diagonal(&Vector3::from(axes));
        let root = |d: Matrix3<f64>| camera_from_fixed * d * camera_from_fixed.transpose();
        let inverse = Matrix3::from_diagonal(&Vector3::from(axes.map(|a| 1.0 / a)));
        Ok(Sight { r: camera_from_fixed * -place, to: root(inverse), from: root(diagonal) })
    }

    fn of_samples(&self, camera: &Camera<f64>, sight: &Sight, samples: &[LimbSample]) -> Option<ThirdAxisSigmas> {
        let distance = sight.r.norm();
        let rho = |s: &LimbSample| match s.step_px {
            Some(step) if self.correlation_px > 0.0 => (-step / self.correlation_px).exp(),
            _ => 0.0,
        };
        let mut rows = Vec::with_capacity(samples.len());
        let mut normal = Matrix4::zeros();
        let mut by_height = [Vector4::zeros(); 2];
        for s in samples {
            let ray = camera.ray(s.point)?;
            let j = ray.jacobian();
            let point = sight.point(&ray.direction().xyz().into());
            let g = Vector2::from([0, 1].map(|k| (0..3).map(|i| j[i][k] * point.normal[i]).sum::<f64>()));
            let w = 1.0 / g.norm_squared().max(1e-300);
            // Errors of the position in units of the distance keep the matrix well-conditioned.
            let [nx, ny, nz] = (point.normal * (distance / point.t)).into();
            let h = Vector4::new(nx, ny, nz, point.by_turn);
            normal += h * h.transpose() * w;
            let (sin, cos) = (2.0 * point.azimuth).sin_cos();
            for (sum, harmonic) in by_height.iter_mut().zip([cos, sin]) {
                *sum += h * (w * harmonic * self.second_harmonic_km / point.t);
            }
            rows.push(Row { q: h * w, g, rho: rho(s) });
        }
        let x = correlated(&rows) * self.sigma_px * self.sigma_px;
        let inverse = normal.try_inverse()?;
        let free = inverse * x * inverse;
        let [a, b] = by_height.map(|sum| (inverse * sum).w);
        let sigmas = ThirdAxisSigmas {
            limb_px: samples.len() as f64 * samples.iter().find_map(|s| s.step_px).unwrap_or(1.0),
            by_edges_deg: free[(3, 3)].sqrt().to_degrees(),
            by_height_deg: a.hypot(b).to_degrees(),
        };
        // A rotation that is unknown by more than a half turn is unknown.
        (sigmas.by_edges_deg < 180.0).then_some(sigmas)
    }
}

/// A point of the limb.
struct LimbPoint {
    t: f64,
    normal: Vector3<f64>,
    /// Movement of the limb for a unit rotation of the body about the direction to it, radians.
    by_turn: f64,
    /// Azimuth about the axis in scaled space, radians.
    azimuth: f64,
}

impl Sight {
    /// Returns the axis of the cone in scaled space, and two directions perpendicular to it.
    fn axes(&self) -> [Vector3<f64>; 3] {
        let e = (self.to * self.r).normalize();
        let b1 = e.cross(&Vector3::ith(e.iamin(), 1.0)).normalize();
        [e, b1, e.cross(&b1)]
    }

    /// Returns the direction of the limb at an azimuth.
    fn limb(&self, azimuth: f64) -> Vector3<f64> {
        let [e, b1, b2] = self.axes();
        let sin = 1.0 / (self.to * self.r).norm();
        let (s, c) = azimuth.sin_cos();
        self.from * (e * (1.0 - sin * sin).sqrt() + (b1 * c + b2 * s) * sin)
    }

    /// Returns the point of the limb in the direction of a unit ray, by (13.4).
    fn point(&self, s: &Vector3<f64>) -> LimbPoint {
        let a = self.to * self.to;
        let t = s.dot(&(a * self.r)) / s.dot(&(a * s));
        let q = s * t - self.r;
        let normal = (a * q).normalize();
        let [_, b1, b2] = self.axes();
        let scaled = self.to * q;
        LimbPoint {
            t,
            normal,
            by_turn: q.cross(&normal).dot(&self.r.normalize()) / t,
            azimuth: scaled.dot(&b2).atan2(scaled.dot(&b1)),
        }
    }
}
