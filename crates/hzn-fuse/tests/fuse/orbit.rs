//! The orbit from limbs and attitudes alone: simulated orbits with drawn errors, against truth and bound.

use hzn_core::ellipsoid::{LimbCone, WGS84_A_M, WGS84_B_M};
use hzn_fuse::finding::{Cause, Level};
use hzn_fuse::flight::Wanted;
use hzn_fuse::input::{Attitude, Body, Inputs, Recording, Seen};
use hzn_fuse::settings::ErrorSetting;
use hzn_fuse::{Fused, Settings, fuse};
use hzn_nav::frames::{Cam, Covariance, Rotation, Vector, Vehicle};
use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};

use crate::common::Draws;

/// Rate of the Earth's rotation, rad/s.
const SPIN: f64 = 7.292_115e-5;
/// White noise of a limb's axis, its slow error, the noise of the star tracker, and the mount, rad.
const WHITE: f64 = 3e-4;
const SLOW: f64 = 3e-4;
const TRACKER: f64 = 5e-5;
pub(crate) const MOUNT: f64 = 3.5e-4;
/// Sigma of the limb height, km.
const HEIGHT_KM: f64 = 3.0;
/// Sigma of the told altitudes, km: more than their noise, because they are relative to a sphere.
const ALTITUDE_KM: f64 = 8.0;
/// Steps of the integration of the truth, s.
const DYNAMICS_S: f64 = 10.0;

/// Kepler's elements at the start: semi-major axis (m), eccentricity, inclination, node, argument of the perigee and
/// true anomaly (degrees).
#[derive(Clone, Copy)]
pub(crate) struct Elements([f64; 6]);

pub(crate) const ORBITS: [(&str, Elements); 3] = [
    ("500 km, near-polar", Elements([6.871e6, 0.001, 97.4, 20.0, 30.0, 0.0])),
    ("700 km, inclined", Elements([7.071e6, 0.001, 51.6, 130.0, 80.0, 200.0])),
    ("400 x 900 km", Elements([7.021e6, 0.0356, 63.4, 250.0, 110.0, 40.0])),
];

/// What a flight has.
#[derive(Clone, Copy)]
pub(crate) struct Plan {
    elements: Elements,
    seed: u64,
    span_s: f64,
    /// Seconds between two pictures.
    step_s: f64,
    /// Correlation time of the slow error, s.
    slow_s: f64,
    /// Drag area over mass, m²/kg.
    ballistic_m2_kg: f64,
    /// How far the vehicle rolls and pitches about its attitude to the horizon, rad.
    pub(crate) rocking_rad: [f64; 2],
}

impl Plan {
    pub(crate) fn new(elements: Elements, seed: u64, span_s: f64) -> Self {
        Self { elements, seed, span_s, step_s: 60.0, slow_s: 1400.0, ballistic_m2_kg: 0.022, rocking_rad: [0.0; 2] }
    }
}

/// Position and velocity in inertial axes, which are those of ECEF at time 0.
type Truth = (Vector3<f64>, Vector3<f64>);

impl Elements {
    fn start(self) -> Truth {
        let [a, e, i, node, perigee, anomaly] = self.0;
        let turn = Rotation3::from_axis_angle(&Vector3::z_axis(), node.to_radians())
            * Rotation3::from_axis_angle(&Vector3::x_axis(), i.to_radians())
            * Rotation3::from_axis_angle(&Vector3::z_axis(), perigee.to_radians());
        let (sin, cos) = anomaly.to_radians().sin_cos();
        let p = a * (1.0 - e * e);
        let speed = (3.986_004_418e14 / p).sqrt();
        (
            turn * (Vector3::new(cos, sin, 0.0) * (p / (1.0 + e * cos))),
            turn * (Vector3::new(-sin, e + cos, 0.0) * speed),
        )
    }
}

/// Gravity in inertial axes: the zonal harmonics J2 to J4 as the gradient of their potential by differences, the
/// tesseral harmonic of degree and order 2, which is not in the dynamics of the solve, and drag.
fn acceleration(x: &Vector3<f64>, v: &Vector3<f64>, time_s: f64, ballistic_m2_kg: f64) -> Vector3<f64> {
    let potential = |x: &Vector3<f64>| {
        let (r, s) = (x.norm(), x.z / x.norm());
        let ratio = 6_378_137.0 / r;
        let zonal = 1.082_626_68e-3 * ratio.powi(2) * (1.5 * s * s - 0.5)
            - 2.532_66e-6 * ratio.powi(3) * (2.5 * s.powi(3) - 1.5 * s)
            - 1.619_62e-6 * ratio.powi(4) * (35.0 * s.powi(4) - 30.0 * s * s + 3.0) / 8.0;
        let longitude = x.y.atan2(x.x) - SPIN * time_s;
        let tesseral = ratio.powi(2)
            * 3.0
            * (1.0 - s * s)
            * (1.5745e-6 * (2.0 * longitude).cos() - 9.039e-7 * (2.0 * longitude).sin());
        3.986_004_418e14 / r * (tesseral - zonal)
    };
    let gradient = Vector3::from_fn(|i, _| {
        let mut step = Vector3::zeros();
        step[i] = 100.0;
        (potential(&(x + step)) - potential(&(x - step))) / 200.0
    });
    let height_km = (x.norm() - 6_378_137.0 * (1.0 - (x.z / x.norm()).powi(2) / 298.257)) * 1e-3;
    let density = if height_km < 350.0 {
        2.418e-11 * (-(height_km - 300.0) / 53.6).exp()
    } else {
        5e-13 * (-(x.norm() - 6_871e3) / 60e3).exp()
    };
    let wind = v - Vector3::new(0.0, 0.0, SPIN).cross(x);
    gradient - x * (3.986_004_418e14 / x.norm().powi(3)) - wind * (0.5 * density * ballistic_m2_kg * wind.norm())
}

fn step((x, v): Truth, time_s: f64, h: f64, ballistic_m2_kg: f64) -> Truth {
    let slope = |x: Vector3<f64>, v: Vector3<f64>, t: f64| (v, acceleration(&x, &v, t, ballistic_m2_kg));
    let (x1, v1) = slope(x, v, time_s);
    let (x2, v2) = slope(x + x1 * (h / 2.0), v + v1 * (h / 2.0), time_s + h / 2.0);
    let (x3, v3) = slope(x + x2 * (h / 2.0), v + v2 * (h / 2.0), time_s + h / 2.0);
    let (x4, v4) = slope(x + x3 * h, v + v3 * h, time_s + h);
    (x + (x1 + (x2 + x3) * 2.0 + x4) * (h / 6.0), v + (v1 + (v2 + v3) * 2.0 + v4) * (h / 6.0))
}

/// The true position and velocity in ECEF at a time.
pub(crate) struct Place {
    time_s: f64,
    position_m: Vector3<f64>,
    /// Radial, along and across the orbit, as columns.
    axes: Matrix3<f64>,
}

/// Returns the attitude of a vehicle that looks down along z, and forward along x.
fn looking_down(axes: &Matrix3<f64>) -> UnitQuaternion<f64> {
    let [up, along, across] = [0, 1, 2].map(|i| Vector3::from(axes.column(i)));
    let down = Matrix3::from_columns(&[along, -across, -up]);
    UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(down))
}

/// Returns the turn of a vehicle that rolls and pitches by these angles.
fn rocked([roll, pitch]: [f64; 2], time_s: f64) -> UnitQuaternion<f64> {
    UnitQuaternion::from_euler_angles(roll * (time_s / 97.0).sin(), pitch * (time_s / 61.0).sin(), 0.0)
}

/// Returns the direction of the axis of a limb 40 km high.
fn axis_of_limb(position_m: &Vector3<f64>) -> Vector3<f64> {
    let cone = LimbCone::try_new((*position_m).into(), WGS84_A_M + 40e3, WGS84_B_M + 40e3).unwrap();
    cone.axis.xyz().into()
}

/// Simulates a flight: the inputs as a user has them, with the errors that the covariances tell.
pub(crate) fn simulate(plan: Plan) -> (Inputs, Vec<Place>) {
    let Plan { elements, seed, span_s, step_s, slow_s, ballistic_m2_kg, rocking_rad } = plan;
    let mut draws = Draws(seed);
    let mut three = |sigma: f64| Vector3::from_fn(|_, _| sigma * draws.normal());
    let mount_error = three(MOUNT);
    let height_km = three(HEIGHT_KM).x;
    let mut slow = three(SLOW);
    let mut truth = elements.start();
    let mount = UnitQuaternion::from_euler_angles(0.4, -0.3, 0.2);
    let (mut seen, mut attitudes, mut places) = (Vec::new(), Vec::new(), Vec::new());
    let keep = (-step_s / slow_s).exp();
    for number in 0..(span_s / step_s) as usize {
        let time_s = number as f64 * step_s;
        let (x, v) = truth;
        let to_fixed = Rotation3::from_axis_angle(&Vector3::z_axis(), -SPIN * time_s);
        let position_m = to_fixed * x;
        let radial = x.normalize();
        let across = radial.cross(&v).normalize();
        let axes = to_fixed.into_inner() * Matrix3::from_columns(&[radial, across.cross(&radial), across]);
        let (attitude, limb_axis) = (looking_down(&axes) * rocked(rocking_rad, time_s), axis_of_limb(&position_m));
        let true_mount = mount * UnitQuaternion::from_scaled_axis(mount_error);
        let to_camera = (attitude * true_mount).inverse();
        let axis = to_camera * limb_axis;
        // A camera that sees the limb on one side: a higher limb moves the axis there.
        let side = axis.cross(&Vector3::x()).normalize();
        let by_height = side * 1.2e-4;
        let measured = (axis + by_height * height_km + slow + three(WHITE)).normalize();
        let unit = Vector::<Cam>::from(measured);
        seen.push(Seen {
            time_s,
            body: Body::Limb,
            axis: unit,
            covariance_rad2: Covariance::across(&unit, WHITE * WHITE + SLOW * SLOW),
            common_rad2: Some(Covariance::across(&unit, SLOW * SLOW)),
            reference: None,
            altitude_km: Some((position_m.norm() - 6_371e3) / 1e3 + three(5.0).x),
            by_limb_height: by_height.into(),
            centre: None,
            cone: None,
            row: number,
        });
        let told = UnitQuaternion::from_scaled_axis(three(TRACKER)) * attitude;
        attitudes.push(Attitude { time_s, fixed_from_vehicle: Some(told.into()), sigma_rad: TRACKER });
        places.push(Place { time_s, position_m, axes });
        slow = slow * keep + three(SLOW) * (1.0 - keep * keep).sqrt();
        for i in 0..(step_s / DYNAMICS_S) as u32 {
            truth = step(truth, time_s + DYNAMICS_S * f64::from(i), DYNAMICS_S, ballistic_m2_kg);
        }
    }
    let told_mount: Rotation<Cam, Vehicle> = mount.into();
    let recording = Recording {
        name: "cam".into(),
        mount: Some(told_mount),
        seen,
        limb_sigma_km: Some(HEIGHT_KM),
        altitude_sigma_km: Some(ALTITUDE_KM),
        ..Recording::default()
    };
    (Inputs { attitudes, recordings: vec![recording], ..Inputs::default() }, places)
}

pub(crate) fn settings() -> Settings {
    let mut settings = Settings::default();
    settings.camera.misalignment_deg = ErrorSetting { sigma: MOUNT.to_degrees(), ..settings.camera.misalignment_deg };
    // Camera and star tracker have one clock.
    settings.camera.clock_s = ErrorSetting { sigma: 0.0, ..settings.camera.clock_s };
    settings
}

fn solve(inputs: &Inputs) -> Fused {
    fuse(inputs, &settings(), Wanted { solved: true, ..Wanted::default() }).unwrap()
}

/// Adds the squares of the errors of a flight, of their sigmas and of both together, radial, along and across.
pub(crate) fn add(sums: &mut [Vector3<f64>; 3], fused: &Fused, places: &[Place]) {
    for epoch in &fused.smoothed {
        let place = places.iter().find(|p| p.time_s == epoch.state.time_s).unwrap();
        let error = place.axes.transpose() * (epoch.state.position_m.into_inner() - place.position_m);
        let variance = (place.axes.transpose() * epoch.position_covariance_m2.as_inner() * place.axes).diagonal();
        sums[0] += error.component_mul(&error);
        sums[1] += variance;
        sums[2] += error.component_mul(&error).component_div(&variance);
    }
    let n = fused.smoothed.len() as f64;
    assert!(n > 100.0, "{n}");
}

#[test]
fn the_error_is_that_of_the_bound() {
    let seeds: u64 = std::env::var("HZN_FLIGHTS").ok().and_then(|n| n.parse().ok()).unwrap_or(2);
    for (name, elements) in ORBITS {
        let mut sums = [Vector3::zeros(); 3];
        let (mut count, mut bound) = (0.0, Vector3::zeros());
        let mut verdicts = Vec::new();
        for seed in 0..seeds {
            let (inputs, places) = simulate(Plan::new(elements, 1000 + seed, 3.0 * 5800.0));
            let fused = solve(&inputs);
            add(&mut sums, &fused, &places);
            count += fused.smoothed.len() as f64;
            let orbit = fused.solved.as_ref().and_then(|s| s.orbit).unwrap();
            bound += Vector3::from(orbit.bound_m).map(|b| b * b) / seeds as f64;
            verdicts.push(fused.verdict.level());
            assert!(fused.verdict.level() != Level::Contradicts, "{name}: {:?}", fused.verdict);
        }
        let (rms, nees) = ((sums[0] / count).map(f64::sqrt), sums[2] / count);
        let bound = bound.map(f64::sqrt);
        let km = |v: &Vector3<f64>| format!("{:.2} {:.2} {:.2} km", v.x / 1e3, v.y / 1e3, v.z / 1e3);
        let ratio = rms.norm() / bound.norm();
        println!(
            "{name}: error {}, bound {} (radial along across), ratio {ratio:.2}, NEES {:.2} {:.2} {:.2}, {verdicts:?}",
            km(&rms),
            km(&bound),
            nees.x,
            nees.y,
            nees.z
        );
        // Two flights scatter: each has a handful of independent errors.
        let [most, least] = if seeds < 10 { [2.0, 0.1] } else { [1.3, 0.5] };
        assert!(ratio < most, "{name}: {ratio}");
        let nees_most = if seeds < 10 { 5.0 } else { 2.0 };
        assert!(nees.iter().all(|n| (least..nees_most).contains(n)), "{name}: {nees}");
    }
}

/// The drag of a light satellite at 300 km is drawn from its prior. It is in the sigmas, and without it they are too
/// small.
#[test]
fn drag_from_its_prior_is_covered() {
    const LIGHT_M2_KG: f64 = 0.04;
    const SIGMA: f64 = 0.5;
    let seeds: u64 = std::env::var("HZN_FLIGHTS").ok().and_then(|n| n.parse().ok()).unwrap_or(2);
    let mut told = settings();
    (told.orbit.ballistic_m2_kg, told.orbit.drag_sigma_percent) = (LIGHT_M2_KG, 100.0 * SIGMA);
    let mut exact = told.clone();
    exact.orbit.drag_sigma_percent = 0.0;
    let mut none = told.clone();
    none.orbit.ballistic_m2_kg = 0.0;
    let mut sums = [[Vector3::zeros(); 3]; 3];
    let mut count = 0.0;
    for seed in 0..seeds {
        // Near-circular orbits of several inclinations and nodes.
        let part = seed as f64 / seeds as f64;
        let elements = Elements([6.678e6, 0.001, 97.0 - 60.0 * part, 360.0 * part, 30.0, 200.0 * part]);
        // At both sides of the prior in turn, or few flights scatter on one side.
        let draw = Draws(5000 + seed).normal().abs() * if seed % 2 == 0 { 1.0 } else { -1.0 };
        let ballistic_m2_kg = LIGHT_M2_KG * (1.0 + SIGMA * draw);
        let (inputs, places) = simulate(Plan { ballistic_m2_kg, ..Plan::new(elements, 5000 + seed, 3.0 * 5430.0) });
        for (settings, sums) in [&told, &exact, &none].into_iter().zip(&mut sums) {
            let fused = fuse(&inputs, settings, Wanted { solved: true, ..Wanted::default() }).unwrap();
            add(sums, &fused, &places);
            count += fused.smoothed.len() as f64 / 3.0;
        }
    }
    let [told, exact, none] = sums.map(|[error, variance, nees]| {
        let km = |v: Vector3<f64>| (v / count).map(|x| x.sqrt() / 1e3);
        println!(
            "error {:.2?} km, sigma {:.2?} km, NEES {:.2?}",
            km(error).data,
            km(variance).data,
            (nees / count).data
        );
        nees / count
    });
    let [most, least] = if seeds < 10 { [5.0, 0.1] } else { [2.0, 0.5] };
    assert!(told.iter().all(|n| (least..most).contains(n)), "{told}");
    // Along the orbit.
    assert!(exact.y > told.y && none.y > exact.y, "{told} {exact} {none}");
}

#[test]
fn what_is_missing_is_named() {
    let (inputs, _) = simulate(Plan::new(ORBITS[0].1, 7, 3000.0));
    let error = |inputs: &Inputs, solved: bool| {
        fuse(inputs, &settings(), Wanted { solved, ..Wanted::default() }).unwrap_err().to_string()
    };
    assert!(error(&inputs, false).contains("--imu FILE, or --solve"), "{}", error(&inputs, false));
    let none = Inputs { attitudes: Vec::new(), ..inputs.clone() };
    assert!(error(&none, true).contains("--attitude FILE"), "{}", error(&none, true));
    let mut short = inputs.clone();
    short.recordings[0].seen.truncate(3);
    assert!(error(&short, true).contains("at least 6"), "{}", error(&short, true));
    let (arc, _) = simulate(Plan::new(ORBITS[0].1, 7, 500.0));
    assert!(error(&arc, true).contains("the flight covers 0.07 of an orbit"), "{}", error(&arc, true));
    let (rare, _) = simulate(Plan { step_s: 1500.0, ..Plan::new(ORBITS[0].1, 7, 15_000.0) });
    assert!(error(&rare, true).contains("take pictures more often"), "{}", error(&rare, true));
}

/// Returns the sum of the squared errors of the position over their covariances, 3 is ideal, as a mean over a flight.
pub(crate) fn nees(fused: &Fused, places: &[Place]) -> f64 {
    let of = |epoch: &hzn_fuse::results::Epoch| {
        let place = places.iter().find(|p| p.time_s == epoch.state.time_s).unwrap();
        let error = epoch.state.position_m.into_inner() - place.position_m;
        error.dot(&epoch.position_covariance_m2.as_inner().cholesky().unwrap().solve(&error))
    };
    fused.smoothed.iter().map(of).sum::<f64>() / fused.smoothed.len() as f64
}

/// Nobody knows for how long an error stays: in a few pictures, a part of the orbit, or all flight.
#[test]
fn an_error_of_any_time_is_covered() {
    let seeds: u64 = std::env::var("HZN_FLIGHTS").ok().and_then(|n| n.parse().ok()).unwrap_or(2);
    for (name, slow_s) in [("a few pictures", 140.0), ("a part of the orbit", 1400.0), ("all flight", 1e12)] {
        let mut sum = 0.0;
        for (_, elements) in ORBITS {
            for seed in 0..seeds {
                let (inputs, places) = simulate(Plan { slow_s, ..Plan::new(elements, 7000 + seed, 2.0 * 5800.0) });
                let fused = solve(&inputs);
                assert!(fused.verdict.level() != Level::Contradicts, "{name} {seed}: {:?}", fused.verdict);
                sum += nees(&fused, &places) / (seeds as f64 * ORBITS.len() as f64);
            }
        }
        println!("{name}: NEES {sum:.2} (ideal 3)");
        assert!((0.5..6.0).contains(&sum), "{name}: {sum}");
    }
}

/// Far from the Earth, pictures are rare, and the satellite hardly moves against the ground.
#[test]
fn high_orbits_need_few_pictures() {
    let high = [
        (7, "1400 km", [7.771e6, 0.001, 66.0, 20.0, 30.0, 0.0], 4.0 * 6900.0, 300.0),
        (8, "geostationary", [4.2164e7, 0.0005, 0.5, 20.0, 30.0, 0.0], 86_400.0, 600.0),
    ];
    for (seed, name, elements, span_s, step_s) in high {
        let (inputs, places) = simulate(Plan { step_s, ..Plan::new(Elements(elements), seed, span_s) });
        let fused = solve(&inputs);
        let nees = nees(&fused, &places);
        println!("{name}: NEES {nees:.2} (ideal 3)");
        assert!(fused.verdict.level() == Level::Consistent && nees < 12.0, "{name}: {nees} {:?}", fused.verdict);
    }
}

/// A star tracker gives attitudes relative to the stars; the solve needs them relative to the Earth.
#[test]
fn inertial_attitudes_are_named() {
    let (mut inputs, _) = simulate(Plan::new(ORBITS[0].1, 11, 5800.0));
    for attitude in &mut inputs.attitudes {
        let spin = Rotation3::from_axis_angle(&Vector3::z_axis(), SPIN * attitude.time_s);
        let told = attitude.fixed_from_vehicle.unwrap().into_inner();
        attitude.fixed_from_vehicle = Some((UnitQuaternion::from_rotation_matrix(&spin) * told).into());
    }
    let fused = solve(&inputs);
    assert_eq!(fused.verdict.level(), Level::Contradicts);
    let first = fused.verdict.likeliest().unwrap();
    assert!(first.what.contains("relative to inertial axes"), "{first:?}");
}

/// A table of attitudes that was appended to itself tells nothing new.
#[test]
fn attitudes_that_are_there_twice_count_once() {
    let (mut inputs, _) = simulate(Plan::new(ORBITS[0].1, 12, 5800.0));
    let once = solve(&inputs);
    let n = inputs.attitudes.len();
    inputs.attitudes.extend_from_within(..);
    let twice = solve(&inputs);
    assert_eq!(twice.smoothed, once.smoothed);
    let words = format!("attitude: {n} of {} rows are copies of others", 2 * n);
    assert!(twice.notes.iter().any(|note| note.contains(&words)), "{:?}", twice.notes);
}

/// The period of the orbit gives its height, so told altitudes that are elsewhere contradict it.
#[test]
fn told_altitudes_elsewhere_are_found() {
    for (off_km, word) in [(40.0, "above"), (-40.0, "below")] {
        let (mut inputs, _) = simulate(Plan::new(ORBITS[2].1, 21, 2.0 * 5800.0));
        for seen in &mut inputs.recordings[0].seen {
            seen.altitude_km = seen.altitude_km.map(|km| km + off_km);
        }
        let fused = solve(&inputs);
        let first = fused.verdict.likeliest().expect("a finding");
        assert_eq!((first.level, first.cause), (Level::Contradicts, Cause::Altitude), "{first:?}");
        assert!(first.what.contains(word), "{first:?}");
        let number = first.what.split(" are ").nth(1).and_then(|s| s.split(' ').next()).unwrap();
        let found_km: f64 = number.parse().unwrap();
        assert!((found_km - 40.0).abs() < 12.0, "{first:?}");
    }
}
