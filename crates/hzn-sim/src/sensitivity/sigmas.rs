//! The covariance of a direction from limb points whose errors are correlated along the edge.
//!
//! Errors of the points along u and v are independent Gauss-Markov processes with variance R and correlation
//! ρ = exp(−Δs/L). A point enters the normal equations N with a row q, and its error moves the residual by gᵀ(δu, δv).
//! With b = q gᵀ the covariance is N⁻¹ (R X) N⁻¹, X = Σ (b bᵀ + b aᵀ + a bᵀ). The sum a runs along the edge:
//! a ← ρ (a + b). This implementation is independent of hzn-core, and a test compares both.

use hzn_core::camera::{Camera, Model};
use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};
use serde::Serialize;

use super::correlated::{Row, correlated};
use super::design::{Design, DesignError};
use super::limb_samples::LimbSample;

/// Standard deviations of a direction in degrees (1 sigma).
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct DirectionSigmas {
    /// Sigma in the plane of optical axis and body: the pitch of a camera that looks along the horizon.
    pub pitch_deg: f64,
    /// Sigma across that plane: the roll about the optical axis of a camera that looks along the horizon.
    pub roll_deg: f64,
}

/// The accuracy of a design.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Sigmas {
    /// Half-angle of the limb's cone in degrees.
    pub half_angle_deg: f64,
    /// Length of limb in the picture, in pixels.
    pub limb_px: f64,
    /// Sigmas with a fitted half-angle.
    pub free: DirectionSigmas,
    /// Sigmas with the fitted half-angle fused with the half-angle from altitude and limb height, by their sigmas. `hzn
    /// run` reports these.
    pub fused: DirectionSigmas,
    /// Sigmas with an exactly known half-angle.
    pub known: DirectionSigmas,
    /// Largest sigma in any direction of the fused solution: the `sigma_max_deg` of `hzn run`.
    pub largest_deg: f64,
    /// Sigmas by equation 33 of Braun & Barf 2022 (unweighted least squares in the plane of a pinhole picture); `None`
    /// for other lenses.
    pub braun_barf: Option<DirectionSigmas>,
    /// The overbound of their equation 37: one sigma for every direction.
    pub braun_barf_bound_deg: Option<f64>,
}

impl Design {
    /// Returns the sigmas of this design; `None` if the limb in view is too short for a direction, or if there is none.
    ///
    /// # Errors
    /// Fails if the camera is invalid or not above the limb.
    pub fn sigmas(&self) -> Result<Option<Sigmas>, DesignError> {
        let half_angle_rad = self.half_angle_rad()?;
        let camera = Camera::try_new(&self.camera)?;
        let samples = self.sample_limb(&camera, half_angle_rad);
        Ok(Sigmas::new(self, &camera, half_angle_rad, &samples))
    }

    /// Returns the variance of the expected cos α: sin²α [(∂α/∂d)² σ_d² + (∂α/∂H)² σ_H²].
    pub(super) fn variance_cos(&self, half_angle_rad: f64) -> f64 {
        let (sin, cos) = half_angle_rad.sin_cos();
        let distance_km = self.radius_km + self.altitude_km;
        let by_limb = self.limb_height_sigma_km / (distance_km * cos);
        let by_altitude = self.altitude_sigma_km * sin / (distance_km * cos);
        sin * sin * (by_limb * by_limb + by_altitude * by_altitude)
    }
}

impl Sigmas {
    /// Returns `None` if the points do not determine a direction with a free half-angle.
    fn new(design: &Design, camera: &Camera<f64>, half_angle_rad: f64, samples: &[LimbSample]) -> Option<Self> {
        let Sums { normal, noise: x, plane } = Sums::new(design, camera, half_angle_rad, samples)?;
        let n = normal.try_inverse()?;
        let free = n * x * n;
        // With a known half-angle only the upper two rows count.
        let n2 = normal.fixed_view::<2, 2>(0, 0).into_owned().try_inverse()?;
        let known = n2 * x.fixed_view::<2, 2>(0, 0) * n2;
        let k = free.column(2) / (free[(2, 2)] + design.variance_cos(half_angle_rad));
        let fused = free - k * free.row(2);
        let (tilt, across) = tangent(&Vector3::from(design.axis()));
        let direction_sigmas =
            |p: Matrix2<f64>| DirectionSigmas { pitch_deg: root_deg(p.m11), roll_deg: root_deg(p.m22) };
        let upper = |p: Matrix3<f64>| p.fixed_view::<2, 2>(0, 0).into_owned();
        let is_pinhole = design.camera.model == Model::Pinhole;
        let paper = is_pinhole.then(|| plane.covariance(design.sigma_px * design.sigma_px)).flatten();
        let sigmas = Self {
            half_angle_deg: half_angle_rad.to_degrees(),
            limb_px: samples.len() as f64 * samples.iter().find_map(|s| s.step_px).unwrap_or(1.0),
            free: direction_sigmas(upper(free)),
            fused: direction_sigmas(upper(fused)),
            known: direction_sigmas(known),
            largest_deg: root_deg(upper(fused).symmetric_eigenvalues().max()),
            braun_barf: paper.map(|p| DirectionSigmas {
                pitch_deg: root_deg(tilt.dot(&(p * tilt))),
                roll_deg: root_deg(across.dot(&(p * across))),
            }),
            braun_barf_bound_deg: paper.map(|p| root_deg(p.symmetric_eigenvalues().max())),
        };
        sigmas.free.pitch_deg.is_finite().then_some(sigmas)
    }
}

/// The sums over the points of a limb.
pub(super) struct Sums {
    /// Normal equations of the axis (towards the optical axis, across) and of the cosine of the half-angle.
    normal: Matrix3<f64>,
    /// The same sum for correlated errors.
    noise: Matrix3<f64>,
    plane: Plane,
}

impl Sums {
    /// Returns `None` if the lens has no ray for a point.
    pub(super) fn new(
        design: &Design,
        camera: &Camera<f64>,
        half_angle_rad: f64,
        samples: &[LimbSample],
    ) -> Option<Self> {
        let e = Vector3::from(design.axis());
        let (tilt, across) = tangent(&e);
        let variance = design.sigma_px * design.sigma_px;
        let rho = |s: &LimbSample| match s.step_px {
            Some(step) if design.correlation_px > 0.0 => (-step / design.correlation_px).exp(),
            _ => 0.0,
        };
        let mut rows = Vec::with_capacity(samples.len());
        let mut normal = Matrix3::zeros();
        let mut plane = Plane::default();
        let is_pinhole = design.camera.model == Model::Pinhole;
        for sample in samples {
            let ray = camera.ray(sample.point)?;
            let s = Vector3::from(ray.direction().xyz());
            let j = ray.jacobian();
            let derivative = |column: usize| (0..3).map(|i| j[i][column] * e[i]).sum::<f64>();
            let g = Vector2::new(derivative(0), derivative(1));
            let w = 1.0 / g.norm_squared().max(1e-300);
            let h = Vector3::new(tilt.dot(&s), across.dot(&s), -1.0);
            normal += h * h.transpose() * w;
            rows.push(Row { q: h * w, g, rho: rho(sample) });
            if is_pinhole {
                plane.add(&s, &e, half_angle_rad.cos(), design.camera.fx_px, rho(sample));
            }
        }
        Some(Self { normal, noise: correlated(&rows) * variance, plane })
    }

    /// Returns the covariance of the axis and of the cosine, both fitted; `None` if the points do not determine them.
    pub(super) fn free_covariance(&self) -> Option<Matrix3<f64>> {
        let n = self.normal.try_inverse()?;
        Some(n * self.noise * n)
    }
}

/// Braun & Barf 2022, equation 33. The rows are p = (x, y, f) in pixels about the principal point. The corrected second
/// line of equation 29 tells how an error of a point moves its residual: g = (cos α p/|p| − e) in x and y.
#[derive(Default)]
struct Plane {
    rows: Vec<Row<3>>,
    normal: Matrix3<f64>,
}

impl Plane {
    fn add(&mut self, s: &Vector3<f64>, e: &Vector3<f64>, cos: f64, f_px: f64, rho: f64) {
        let p = s * (f_px / s.z);
        let g = s * cos - e;
        self.normal += p * p.transpose();
        self.rows.push(Row { q: p, g: g.xy(), rho });
    }

    fn covariance(&self, variance: f64) -> Option<Matrix3<f64>> {
        let n = self.normal.try_inverse()?;
        Some(n * correlated(&self.rows) * n * variance)
    }
}

/// Returns two unit vectors across the direction to the body. The first points towards the optical axis. If the camera
/// looks straight down, any plane is suitable.
pub(super) fn tangent(e: &Vector3<f64>) -> (Vector3<f64>, Vector3<f64>) {
    let z = Vector3::z();
    let tilt = (z - e * e.z).try_normalize(1e-9).unwrap_or_else(|| (Vector3::y() - e * e.y).normalize());
    (tilt, e.cross(&tilt))
}

fn root_deg(variance: f64) -> f64 {
    variance.sqrt().to_degrees()
}
