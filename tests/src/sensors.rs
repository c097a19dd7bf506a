//! Runs both precisions of the sensor with one call.

use hzn_core::body::Kind;
use hzn_core::image::{ImageView, Pixels};
use hzn_core::observer::Observer;
use hzn_core::real::Real;
use hzn_core::status::Status;
use hzn_core::{Config, FlightHorizon, Horizon, HostHorizon, Prior, Report};
use hzn_host::Compiled;
use hzn_sim::{Globe, Light, Scene};
use nalgebra::{Matrix3, Vector3};

/// Sensor of a workstation (f64) and sensor of a flight computer (f32), from one configuration.
#[derive(Debug)]
pub struct Sensors {
    /// Sensor in f64 with 16384 border pixels.
    pub host: Box<HostHorizon>,
    /// Sensor in f32 with 2048 border pixels.
    pub flight: Box<FlightHorizon>,
}

/// Answer of either sensor, in double precision.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Answer {
    /// Limb axis in the camera frame, unit vector.
    pub axis: [f64; 3],
    /// Covariance of the axis in rad², camera frame.
    pub covariance_rad2: [[f64; 3]; 3],
    /// Half-angle in radians, fused with the expected one.
    pub half_angle_rad: f64,
    /// Half-angle of the free fit in radians, before the expected one is fused.
    pub free_half_angle_rad: f64,
    /// RMS residual of the inliers in pixels.
    pub rms_px: f64,
    /// Number of inliers.
    pub inliers: u32,
    /// Number of edge points of the chosen edge.
    pub points: u32,
    /// Number of border pixels that were left out because lists were full.
    pub dropped: u32,
}

impl Sensors {
    /// Makes both sensors.
    ///
    /// # Panics
    /// Panics if the configuration is refused.
    pub fn new(config: &Config) -> Self {
        // A host sensor has some megabytes. It is made on the stack before it is moved, and a test's thread has not
        // enough stack for that.
        let config = config.clone();
        let make = move || Self {
            host: HostHorizon::boxed(&config).expect("the configuration is valid"),
            flight: FlightHorizon::boxed(&config).expect("the configuration is valid"),
        };
        let thread = std::thread::Builder::new().stack_size(64 << 20).spawn(make).expect("a thread can be made");
        thread.join().expect("the configuration is valid")
    }

    /// Returns the answers of both sensors (f64, f32), or the status if there is no answer.
    pub fn both<'a>(
        &mut self,
        picture: impl Into<ImageView<'a>>,
        scene: &Scene,
    ) -> (Result<Answer, Status>, Result<Answer, Status>) {
        let picture = picture.into();
        (
            process(&mut self.host, picture, &prior_of_scene(scene)),
            process(&mut self.flight, picture, &prior_of_scene(scene)),
        )
    }
}

/// Returns the prior that a navigation system would give for a scene: the altitude, for `earth` also the position, and
/// no attitude. A scene that is evenly lit has a high Sun.
pub fn prior_of_scene<T: Real>(scene: &Scene) -> Prior<T> {
    let position_m = scene.pose.position_m;
    let altitude_m = Globe::new(&scene.body).altitude_m(position_m);
    Prior {
        altitude_m: Some(T::from_f64(altitude_m)),
        position_m: (scene.body.kind == Kind::Earth).then(|| position_m.map(T::from_f64)),
        sun_elevation_rad: matches!(scene.light, Light::Full).then(|| T::from_f64(core::f64::consts::FRAC_PI_2)),
        ..Prior::default()
    }
}

/// Runs one picture through one sensor.
///
/// # Errors
/// Returns the status if it is not `ok`.
///
/// # Panics
/// Panics if the prior is impossible or the report contradicts itself.
pub fn process<'a, T: Real, const P: usize, const B: usize, const W: usize>(
    horizon: &mut Horizon<T, P, B, W>,
    picture: impl Into<ImageView<'a>>,
    prior: &Prior<T>,
) -> Result<Answer, Status>
where
    Horizon<T, P, B, W>: Compiled<Scalar = T>,
{
    let expected = horizon.expect(prior).expect("the prior is possible");
    answer(&horizon.find(picture, &expected))
}

/// Does the same as [`process`] with an observer.
///
/// # Errors
/// Returns the status if it is not `ok`.
///
/// # Panics
/// Panics if the prior is impossible or the report contradicts itself.
pub fn process_observed<T: Real, const P: usize, const B: usize, const W: usize>(
    horizon: &mut Horizon<T, P, B, W>,
    picture: &impl Pixels,
    prior: &Prior<T>,
    observer: &dyn Observer<T>,
) -> Result<Answer, Status>
where
    Horizon<T, P, B, W>: Compiled<Scalar = T>,
{
    let expected = horizon.expect(prior).expect("the prior is possible");
    answer(&horizon.find_observed(picture, &expected, observer))
}

/// Returns the answer of a report, or its status.
fn answer<T: Real>(report: &Report<T>) -> Result<Answer, Status> {
    assert_eq!(
        report.status == Status::Ok,
        report.solution.is_some(),
        "the status is `ok` exactly if there is a solution"
    );
    if report.solution.is_none() {
        // Test output is shown only if the test fails.
        let verdicts = report.candidates.iter().map(|c| format!("{} points {:?}", c.points, c.verdict));
        println!("{:?}: {}", report.status, verdicts.collect::<Vec<_>>().join(", "));
    }
    Answer::from_report(report).ok_or(report.status)
}

impl Answer {
    /// Returns the answer in a report, if there is one.
    pub fn from_report<T: Real>(report: &Report<T>) -> Option<Self> {
        let s = report.solution.as_ref()?;
        Some(Self {
            axis: s.axis.xyz().map(Real::to_f64),
            covariance_rad2: s.covariance.rows().map(|row| row.map(Real::to_f64)),
            half_angle_rad: s.fused_half_angle_rad.to_f64(),
            free_half_angle_rad: s.half_angle_rad.to_f64(),
            rms_px: s.rms_px.to_f64(),
            inliers: s.inliers,
            points: report.counters.edge_points,
            dropped: report.counters.dropped,
        })
    }

    /// Returns the angle to another direction (unit vector, camera frame) in degrees.
    pub fn error_deg(&self, axis: [f64; 3]) -> f64 {
        let (a, b) = (Vector3::from(self.axis), Vector3::from(axis));
        a.cross(&b).norm().atan2(a.dot(&b)).to_degrees()
    }

    /// Returns the largest standard deviation in degrees.
    pub fn sigma_deg(&self) -> f64 {
        self.covariance().symmetric_eigenvalues().max().max(0.0).sqrt().to_degrees()
    }

    /// Returns the NEES for a true axis (unit vector, camera frame); it has two degrees of freedom.
    pub fn nees(&self, axis: [f64; 3]) -> f64 {
        // The covariance is singular along the axis. A variance along the axis makes it invertible. This does not
        // change the result, because the error has no part along the axis.
        let e = Vector3::from(self.axis);
        let p = self.covariance();
        let d = Vector3::from(axis) - e;
        let d = d - e * d.dot(&e);
        (p + e * e.transpose() * p.trace()).try_inverse().map_or(f64::NAN, |inverse| d.dot(&(inverse * d)))
    }

    fn covariance(&self) -> Matrix3<f64> {
        Matrix3::from_fn(|i, j| self.covariance_rad2[i][j])
    }
}
