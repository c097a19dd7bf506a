//! Limbs that count with their freely fitted cones.
//!
//! `HZN_FLIGHTS=40 cargo test --test fuse points:: -- --nocapture` flies 40 flights; without the variable a few of
//! them.

use crate::common::{Draws, flights};
use crate::solve::{Table, at_time, differences, drawn_with, own, rms};
use hzn_core::HostHorizon;
use hzn_core::ellipsoid::{WGS84_A_M, WGS84_B_M, geodetic};
use hzn_fuse::flight::{Wanted, with_problem};
use hzn_fuse::fuse;
use hzn_fuse::input::{Body, FreeCone, Inputs, Recording};
use hzn_fuse::simulated::{Errors, Moment};
use hzn_host::Compiled;
use hzn_mcap::{Row, RowMeta};
use hzn_nav::frames::{Cam, Covariance, Rotation, Vector};
use hzn_sim::Scenario;
use nalgebra::{Matrix3, Vector3};

/// First seed of the flights: no setting of the solve was looked at with them.
const FIRST_SEED: u64 = 86_000;
/// Mean radius of the Earth, km.
const RADIUS_KM: f64 = 6371.0;
/// 1-sigma of the limb height, km: that of the drawn flights.
const HEIGHT_KM: f64 = 7.0;
/// Errors of a cone: 1-sigma along the line to the limb's middle, across it, and of the half-angle, rad; with the
/// correlation of the first with the last, as a short arc has it.
const CONE_RAD: [f64; 3] = [0.02, 0.0015, 0.02];
const CORRELATION: f64 = 0.99;
/// Correlation time of the errors, s, and the 1-sigma of a white part, rad.
const SLOW_S: f64 = 20.0;
const WHITE_RAD: f64 = 2e-4;

/// Cones with slow errors, and the axes that a sensor makes of them.
pub(crate) struct Cones {
    draws: Draws,
    /// The errors of a camera over their sigmas, in its axes.
    last: Vec<(Moment, Vector3<f64>)>,
    drawn: Option<(FreeCone, Vector3<f64>)>,
}

/// The cosine of the half-angle of a limb.
fn cos_of(altitude_km: f64, height_km: f64) -> f64 {
    let sin = (RADIUS_KM + height_km) / (RADIUS_KM + altitude_km);
    (1.0 - sin * sin).sqrt()
}

/// The covariance of a cone, with the cosine along the axis.
fn covariance(axis: &Vector<Cam>, sin: f64) -> Matrix3<f64> {
    let e = axis.into_inner();
    let along = (Vector3::z() - e * e.z).normalize();
    let [a, b, c] = CONE_RAD;
    let own = [(along, a), (e.cross(&along), b), (e, c * sin)];
    let mut out = Matrix3::zeros();
    for (axis, sigma) in own {
        out += axis * axis.transpose() * (sigma * sigma);
    }
    let with = along * e.transpose() * (CORRELATION * a * c * sin);
    out + with + with.transpose()
}

impl Cones {
    pub(crate) fn new(seed: u64) -> Self {
        Self { draws: Draws(seed), last: Vec::new(), drawn: None }
    }

    fn three(&mut self) -> Vector3<f64> {
        Vector3::from_fn(|_, _| self.draws.normal())
    }

    /// The change of the axis by the expected cosine: the gain of a sensor that knows the limb height to 7 km.
    fn gain(cone: &FreeCone, altitude_km: f64) -> Vector3<f64> {
        let tan = (1.0 - cone.told_cos.powi(2)).sqrt() / cone.told_cos;
        let told = tan / (RADIUS_KM + altitude_km) * HEIGHT_KM;
        cone.axis_with_cos_rad.into_inner() / (cone.var_cos + told * told)
    }
}

impl Errors for Cones {
    fn draw(&mut self, at: &Moment, axis: &Vector<Cam>) -> (Vector<Cam>, Covariance<Cam>) {
        let drawn = self.three();
        let place = self.last.iter().position(|(m, _)| (m.camera, m.body) == (at.camera, at.body));
        let unit = match place.map(|i| self.last.swap_remove(i)) {
            Some((before, error)) => {
                let keep = (-(at.time_s - before.time_s) / SLOW_S).exp();
                error * keep + drawn * (1.0 - keep * keep).sqrt()
            }
            None => drawn,
        };
        self.last.push((*at, unit));
        let white = self.three() * WHITE_RAD;
        if at.body != Body::Limb {
            let sigma = 0.1f64.to_radians();
            return ((unit * sigma + white).into(), Covariance::across(axis, sigma * sigma));
        }
        let told_cos = cos_of(at.altitude_km, 0.0);
        let whole = covariance(axis, (1.0 - told_cos * told_cos).sqrt());
        let mut root = whole.symmetric_eigen();
        root.eigenvalues.apply(|v| *v = v.max(0.0).sqrt());
        let (e, error) = (axis.into_inner(), root.recompose() * unit + white);
        let across = Matrix3::identity() - e * e.transpose();
        let cone = FreeCone {
            axis: *axis,
            covariance_rad2: (across * whole * across).into(),
            cos: 0.0,
            var_cos: e.dot(&(whole * e)),
            axis_with_cos_rad: (across * whole * e).into(),
            told_cos,
        };
        self.drawn = Some((cone, error));
        let k = Self::gain(&cone, at.altitude_km);
        let fused = across - k * e.transpose();
        ((fused * error).into(), (fused * whole * fused.transpose()).into())
    }

    fn by_limb_height(&mut self, at: &Moment, _: &Vector<Cam>) -> Vector<Cam> {
        let (cone, _) = self.drawn.unwrap();
        let tan = (1.0 - cone.told_cos.powi(2)).sqrt() / cone.told_cos;
        (Self::gain(&cone, at.altitude_km) * (tan / (RADIUS_KM + at.altitude_km))).into()
    }

    fn cone(&mut self, at: &Moment, axis: &Vector<Cam>, higher_km: f64) -> Option<FreeCone> {
        let (cone, error) = self.drawn.take()?;
        let e = axis.into_inner();
        let moved: Vector<Cam> = (e + error - e * e.dot(&error)).normalize().into();
        let cos = cos_of(at.altitude_km, higher_km) + e.dot(&error);
        Some(FreeCone { axis: moved, cos, ..cone })
    }
}

/// Returns a flight whose errors are drawn from the settings, with free cones.
fn drawn(seed: u64) -> (Scenario, Inputs) {
    drawn_with(seed, &mut Cones::new(seed))
}

fn wanted(points: bool) -> Wanted {
    Wanted { solved: true, points, rate_hz: Some(2.0), ..Wanted::default() }
}

#[test]
fn derivatives_are_those_of_differences() {
    let (_, mut inputs) = drawn(1);
    inputs.imu.retain(|s| s.imu.time_s < 150.0);
    let mut settings = own();
    settings.limb_height.latitude_sigma_km = 2.0;
    let worst = with_problem(&inputs, &settings, true, differences).unwrap();
    assert!(worst < 6e-3, "{worst}");
}

/// One camera with a calibrated mount: the size of the limb shows its height, so that the attitude is better than from
/// the axes, and the sigmas are right. Two cameras that look at opposite limbs do not need the size.
#[test]
fn flights_are_better_with_the_size_of_the_limb() {
    let mut settings = own();
    settings.camera.misalignment_deg.sigma = 0.02;
    let (mut tables, mut shares) = ([Table::default(), Table::default()], [Vec::new(), Vec::new()]);
    for seed in FIRST_SEED.. {
        if tables[0].len() >= flights(1, 40) as usize {
            break;
        }
        let (scene, mut inputs) = drawn(seed);
        inputs.recordings.truncate(1);
        let mut draws = Draws(seed);
        for (one, recording) in scene.by_camera().iter().zip(&mut inputs.recordings) {
            let error = Vector::from([0, 1, 2].map(|_| 0.02f64.to_radians() * draws.normal()));
            let mount = Rotation::assume_from_quaternion(one.true_q_vehicle_from_camera_wxyz()).unwrap();
            recording.mount = Some(mount * Rotation::from_scaled_axis(error));
        }
        let fused = [false, true].map(|points| fuse(&inputs, &settings, wanted(points)));
        let [Ok(axes), Ok(cones)] = fused else { continue };
        if axes.begin.is_none_or(|begin| begin.time_s > 200.0) || at_time(&axes.epochs, &scene, 300.0).is_none() {
            continue;
        }
        for (i, fused) in [axes, cones].iter().enumerate() {
            tables[i].add(&scene, fused);
            let [before, after] = fused.solved.as_ref().unwrap().limb_share.unwrap();
            assert!(after < 0.5 * before, "{before} {after}");
            shares[i].push(after);
        }
    }
    let [axes, cones] = &tables;
    axes.print("axes");
    cones.print("cones");
    let mean = |all: &Vec<f64>| all.iter().sum::<f64>() / all.len() as f64;
    println!("share of the limb height: {:.3} with axes, {:.3} with cones", mean(&shares[0]), mean(&shares[1]));
    assert!(rms(&cones.bound) < rms(&axes.bound) && mean(&shares[1]) < mean(&shares[0]));
    assert!(rms(&cones.solve) < 2.0 * rms(&cones.bound), "{}", rms(&cones.solve));
}

#[test]
fn what_is_missing_is_named() {
    let (_, mut inputs) = drawn(3);
    let refusal = |inputs: &Inputs| fuse(inputs, &own(), wanted(true)).unwrap_err().to_string();
    let gnss = std::mem::take(&mut inputs.gnss);
    assert!(refusal(&inputs).contains("a receiver"), "{}", refusal(&inputs));
    inputs.gnss = gnss;
    inputs.recordings[1].seen.iter_mut().for_each(|seen| seen.cone = None);
    let (text, name) = (refusal(&inputs), &inputs.recordings[1].name);
    assert!(text.starts_with(&format!("{name}: --points needs")) && text.contains("var_free_cos"), "{text}");
}

/// The sensor's answer is its free cone, moved to the expected half-angle. What a row says of one agrees with the
/// other.
#[test]
fn a_row_has_the_cone_of_the_sensor() {
    let flight = hzn_sim::flight::leo_infrared(3, 61);
    let mut horizon = HostHorizon::boxed(&flight.sensor).unwrap();
    for frame in &flight.frames {
        let prior = frame.prior();
        let expected = horizon.expect(&prior).unwrap();
        let report = horizon.find(frame.render().unwrap().view(), &expected);
        let solution = report.solution.as_ref().unwrap();
        let (altitude_m, _) = geodetic(prior.position_m.unwrap(), WGS84_A_M, WGS84_B_M);
        let meta = RowMeta {
            index: 0,
            file: frame.file.clone(),
            time_s: Some(0.0),
            body: "earth".into(),
            altitude_km: Some(altitude_m / 1e3),
        };
        let row = Row::from_report(&meta, &report, None);
        let recording = Recording::new("cam".into(), vec![row.clone()], Some(&flight.sensor)).unwrap();
        let cone = recording.seen[0].cone.unwrap();
        let free = solution.free.as_ref().unwrap();
        assert!((cone.told_cos - expected.half_angle_rad().cos()).abs() < 1e-6);
        let moved = cone.axis.into_inner() + Vector3::from(solution.axis_by_cos.unwrap()) * (cone.told_cos - cone.cos);
        let (off, sigma) = (moved.angle(&Vector3::from(solution.axis.xyz())), solution.covariance.sigma_max_rad());
        assert!(off < 0.02 * sigma, "{off} {sigma}");
        let variance = |c: &Matrix3<f64>| c.trace();
        let own = variance(cone.covariance_rad2.as_inner());
        let [xx, _, _, yy, _, zz] = free.covariance.upper_rad2;
        assert!(own >= (xx + yy + zz) * (1.0 - 1e-9) && own < 3.0 * (xx + yy + zz), "{own} {}", xx + yy + zz);
        // Without the sensor nobody knows which half-angle was expected.
        assert_eq!(Recording::new("cam".into(), vec![row], None).unwrap().seen[0].cone, None);
    }
}
