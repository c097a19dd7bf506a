//! Both precisions of the sensor behind one call.

use hzn_core::body::Kind;
use hzn_core::image::Pixels;
use hzn_core::observer::{Observer, Unobserved};
use hzn_core::real::Real;
use hzn_core::status::Status;
use hzn_core::{Config, FlightHorizon, Horizon, HostHorizon, Prior, Report};
use hzn_sim::{Globe, Scene};
use nalgebra::{Matrix3, Vector3};

/// The sensor of a workstation (f64) and that of a flight computer (f32), from one configuration.
#[derive(Debug)]
pub struct Sensors {
    /// f64, 16384 border pixels.
    pub host: Box<HostHorizon>,
    /// f32, 2048 border pixels.
    pub flight: Box<FlightHorizon>,
}

/// An answer in double precision, of either sensor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Answer {
    /// Direction to the body in the camera frame.
    pub axis: [f64; 3],
    /// Its covariance in rad².
    pub covariance_rad2: [[f64; 3]; 3],
    /// Half-angle of the answer in radians.
    pub half_angle_rad: f64,
    /// Half-angle fitted freely, before the expected one is fused.
    pub free_half_angle_rad: f64,
    /// RMS distance of the inliers from the limb.
    pub rms_px: f64,
    /// Edge points that carry the answer.
    pub inliers: u32,
    /// Edge points of the chosen edge.
    pub points: u32,
    /// Border pixels left out because lists were full.
    pub dropped: u32,
}

impl Sensors {
    /// Both sensors.
    ///
    /// # Panics
    /// The configuration is refused.
    pub fn new(config: &Config) -> Self {
        // A host sensor is some megabytes, and made on the stack before it is moved: more than a test's thread has.
        let config = config.clone();
        let make = move || Self {
            host: Box::new(HostHorizon::new(&config).expect("the configuration is valid")),
            flight: Box::new(FlightHorizon::new(&config).expect("the configuration is valid")),
        };
        let thread = std::thread::Builder::new().stack_size(64 << 20).spawn(make).expect("a thread can be made");
        thread.join().expect("the configuration is valid")
    }

    /// The answers of both, with the status where there is none.
    pub fn both(&mut self, picture: &impl Pixels, scene: &Scene) -> (Result<Answer, Status>, Result<Answer, Status>) {
        (look(&mut self.host, picture, &known(scene)), look(&mut self.flight, picture, &known(scene)))
    }
}

/// What a navigation system would tell about a scene: the position for `earth`, else the altitude; no attitude.
pub fn known<T: Real>(scene: &Scene) -> Prior<T> {
    let position_m = scene.pose.position_m;
    let altitude_m = Globe::new(&scene.body).altitude_m(position_m);
    Prior {
        altitude_m: Some(T::from_f64(altitude_m)),
        position_m: (scene.body.kind == Kind::Earth).then(|| position_m.map(T::from_f64)),
        ..Prior::default()
    }
}

/// One picture through one sensor.
///
/// # Errors
/// The status, where it is not `ok`.
pub fn look<T: Real, const P: usize, const B: usize, const W: usize>(
    horizon: &mut Horizon<T, P, B, W>,
    picture: &impl Pixels,
    known: &Prior<T>,
) -> Result<Answer, Status> {
    look_observed(horizon, picture, known, &Unobserved)
}

/// As [`look`], watched.
///
/// # Errors
/// The status, where it is not `ok`.
///
/// # Panics
/// What is known cannot be, or the report contradicts itself.
pub fn look_observed<T: Real, const P: usize, const B: usize, const W: usize>(
    horizon: &mut Horizon<T, P, B, W>,
    picture: &impl Pixels,
    known: &Prior<T>,
    observer: &impl Observer<T>,
) -> Result<Answer, Status> {
    let expected = horizon.expect(known).expect("what is known of the picture is possible");
    let report = horizon.process_observed(picture, &expected, observer);
    assert_eq!(report.status == Status::Ok, report.solution.is_some(), "a solution with `ok`, and only there");
    if report.solution.is_none() {
        // Seen only where the test fails.
        let verdicts = report.candidates.iter().map(|c| format!("{} points {:?}", c.points, c.verdict));
        println!("{:?}: {}", report.status, verdicts.collect::<Vec<_>>().join(", "));
    }
    Answer::from_report(&report).ok_or(report.status)
}

impl Answer {
    /// The answer in a report, if there is one.
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

    /// Angle to another direction (unit vector, camera frame) in degrees.
    pub fn error_deg(&self, axis: [f64; 3]) -> f64 {
        let (a, b) = (Vector3::from(self.axis), Vector3::from(axis));
        a.cross(&b).norm().atan2(a.dot(&b)).to_degrees()
    }

    /// Largest standard deviation in degrees.
    pub fn sigma_deg(&self) -> f64 {
        self.covariance().symmetric_eigenvalues().max().max(0.0).sqrt().to_degrees()
    }

    /// Squared error over the covariance: two degrees of freedom.
    pub fn nees(&self, axis: [f64; 3]) -> f64 {
        // The covariance has no extent along the axis; given one there, it can be inverted, and the error has none.
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
