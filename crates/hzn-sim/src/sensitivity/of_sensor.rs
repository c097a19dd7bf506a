//! The accuracy of a sensor that has a sensor.toml: its own covariance of a limb whose points have no errors.
//!
//! The points of the limb go through the stages of hzn-core that follow the search for edges. The covariance therefore
//! has every term of the error budget of `hzn run`: edge noise, common shift and tilt, unknown azimuth, lens, limb
//! height, altitude, radius. Only the size of the residuals must be told, because points without errors have none.

use hzn_core::body::Kind;
use hzn_core::camera::Camera;
use hzn_core::ellipsoid::{WGS84_A_M, WGS84_B_M, from_geodetic};
use hzn_core::fit::HalfAngle;
use hzn_core::frames::UnitVec3;
use hzn_core::pipeline::edges::{ConsensusCone, Edges};
use hzn_core::pixel::ImagePoint;
use hzn_core::{Config, Prior, Sensor, covariance};
use nalgebra::{Matrix3, Vector3};

use super::design::{DesignError, rotation_to_camera};
use super::limb_samples::{LimbSample, sample};
use super::sigmas::{DirectionSigmas, Sigmas, tangent};

/// Largest number of points that core keeps of an edge if the configuration asks for all.
const ALL_POINTS: usize = 608;

/// A sensor at a place. It knows altitude and latitude, but no attitude.
#[derive(Debug, Clone, PartialEq)]
pub struct SensorPlace {
    /// The sensor; it looks for `body`.
    pub sensor: Config,
    /// Altitude above the body in kilometres.
    pub altitude_km: f64,
    /// Latitude in degrees.
    pub latitude_deg: f64,
    /// Angle of the optical axis below the local horizontal in degrees; 90 looks straight down.
    pub depression_deg: f64,
    /// Turn about the optical axis in degrees.
    pub roll_deg: f64,
    /// RMS of the residuals, pixels.
    pub rms_px: f64,
    /// Correlation length of the errors along the edge in pixels; `None` for that of the sensor.
    pub correlation_px: Option<f64>,
}

impl SensorPlace {
    /// Returns the sigmas; `None` if the limb in view is too short for a direction, or if there is none.
    ///
    /// # Errors
    /// Fails if the sensor is invalid or not above the limb.
    pub fn sigmas(&self) -> Result<Option<Sigmas>, DesignError> {
        let camera = Camera::try_new(&self.sensor.camera)?;
        let sensor = Sensor::<f64>::new(&self.sensor)?;
        let half_angle_rad = sensor.expect(&self.prior()).map_err(DesignError::Prior)?.half_angle_rad();
        let edge = self.longest_edge(&camera, half_angle_rad);
        let limb_px = edge.len() as f64 * edge.get(1).and_then(|s| s.step_px).unwrap_or(1.0);
        let own = self.sensor.body.covariance.unwrap_or(self.sensor.covariance);
        let mut noise = own.measured(self.rms_px, limb_px);
        noise.correlation_px = self.correlation_px.unwrap_or(noise.correlation_px);
        let points = self.thinned(&edge);
        let sigmas = |half_angle| self.covariance(&camera, &points, half_angle_rad, half_angle, &noise);
        let fused = sigmas(self.sensor.fit.half_angle)?;
        let (Some(free), Some(known), Some(fused)) = (sigmas(HalfAngle::Free)?, sigmas(HalfAngle::Known)?, fused)
        else {
            return Ok(None);
        };
        let (tilt, across) = tangent(&self.axis());
        let along = |p: &Matrix3<f64>, v: &Vector3<f64>| v.dot(&(p * v)).max(0.0).sqrt().to_degrees();
        let direction = |p| DirectionSigmas { pitch_deg: along(&p, &tilt), roll_deg: along(&p, &across) };
        Ok(Some(Sigmas {
            half_angle_deg: half_angle_rad.to_degrees(),
            limb_px,
            free: direction(free),
            fused: direction(fused),
            known: direction(known),
            largest_deg: fused.symmetric_eigenvalues().max().max(0.0).sqrt().to_degrees(),
            braun_barf: None,
            braun_barf_bound_deg: None,
        }))
    }

    fn axis(&self) -> Vector3<f64> {
        let up = Vector3::x();
        rotation_to_camera(&up, &Vector3::z(), [0.0, self.depression_deg, self.roll_deg]) * -up
    }

    /// Returns what the sensor knows before the picture: the position, or for a body without WGS-84 the altitude.
    fn prior(&self) -> Prior<f64> {
        let altitude_m = self.altitude_km * 1e3;
        let is_earth = self.sensor.body.kind == Kind::Earth;
        let latitude_rad = self.latitude_deg.to_radians();
        let position_m = is_earth.then(|| from_geodetic(latitude_rad, 0.0, altitude_m, WGS84_A_M, WGS84_B_M));
        // The pole is for a body whose position is fitted.
        let (sin, cos) = latitude_rad.sin_cos();
        let (up, north) = (Vector3::new(cos, 0.0, sin), Vector3::new(-sin, 0.0, cos));
        let to_camera = rotation_to_camera(&up, &north, [0.0, self.depression_deg, self.roll_deg]);
        let pole = UnitVec3::try_new((to_camera * Vector3::z()).into());
        Prior { altitude_m: Some(altitude_m), position_m, pole, ..Prior::default() }
    }

    /// Returns the longest part of the limb in view; the sensor takes one edge at a time.
    fn longest_edge(&self, camera: &Camera<f64>, half_angle_rad: f64) -> Vec<LimbSample> {
        let e = self.axis();
        let b1 = e.cross(&Vector3::ith(e.iamin(), 1.0)).normalize();
        let b2 = e.cross(&b1);
        let (sin, cos) = half_angle_rad.sin_cos();
        let limb = sample(camera, &|azimuth| {
            let (s, c) = azimuth.sin_cos();
            e * cos + (b1 * c + b2 * s) * sin
        });
        let edges = limb.chunk_by(|_, next| next.step_px.is_some());
        edges.max_by_key(|edge| edge.len()).unwrap_or_default().to_vec()
    }

    /// Returns as many points as the sensor keeps of an edge, evenly along it.
    fn thinned(&self, edge: &[LimbSample]) -> Vec<ImagePoint<f64>> {
        let keep = match usize::from(self.sensor.edge_points.keep_points) {
            0 => ALL_POINTS,
            keep => keep,
        };
        edge.iter().step_by(edge.len().div_ceil(keep).max(1)).map(|s| s.point).collect()
    }

    /// Returns the covariance of the axis; `None` if the points do not determine it.
    fn covariance(
        &self,
        camera: &Camera<f64>,
        points: &[ImagePoint<f64>],
        half_angle_rad: f64,
        half_angle: HalfAngle,
        noise: &covariance::Config,
    ) -> Result<Option<Matrix3<f64>>, DesignError> {
        let mut config = self.sensor.clone();
        config.fit.half_angle = half_angle;
        config.body.covariance = Some(*noise);
        if half_angle == HalfAngle::Known {
            config.fit.position = Some(false);
        }
        let sensor = Sensor::<f64>::new(&config)?;
        let expected = sensor.expect(&self.prior()).map_err(DesignError::Prior)?;
        let Some(axis) = UnitVec3::try_new(self.axis().into()) else { return Ok(None) };
        let mut edges = Edges::new(camera, points, &axis);
        let start = ConsensusCone { axis, cos_half_angle: half_angle_rad.cos(), draws: 0, all: true };
        let fused = edges.fit(&sensor, &start, &expected).and_then(|fit| edges.fuse(&sensor, &fit, &expected));
        let rows = fused.map(|fused| fused.covariance.rows());
        Ok(rows.map(|rows| Matrix3::from_fn(|i, j| rows[i][j])))
    }
}
