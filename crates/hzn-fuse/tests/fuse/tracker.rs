//! Flights with a star tracker: it replaces receiver and cameras, and one fix of it can begin a flight.

use crate::common::{Draws, Slow, scene};
use hzn_fuse::finding::{Cause, Level};
use hzn_fuse::flight::Wanted;
use hzn_fuse::input::{Attitude, Inputs};
use hzn_fuse::results::Kind;
use hzn_fuse::settings::{ErrorSetting, Treatment};
use hzn_fuse::simulated::inputs;
use hzn_fuse::{Error, Fused, Settings, fuse, truth};
use hzn_nav::frames::{Fixed, Rotation, Vector, Vehicle};
use hzn_nav::gravity::EARTH_RATE_RAD_S;
use hzn_sim::Scenario;

const SIGMA_DEG: f64 = 0.05;

/// Attitudes of a star tracker at these times.
fn tracked(scene: &Scenario, times_s: impl Iterator<Item = f64>) -> Vec<Attitude> {
    let (path, mut draws, sigma_rad) = (scene.path().unwrap(), Draws(77), SIGMA_DEG.to_radians());
    let attitude = |time_s: f64| {
        let truth: Rotation<_, Fixed> = path.state(time_s).fixed_from_vehicle.into();
        let error = Rotation::from_scaled_axis(Vector::from([0, 1, 2].map(|_| sigma_rad * draws.normal())));
        Attitude { time_s, fixed_from_vehicle: Some(truth * error), sigma_rad }
    };
    times_s.map(attitude).collect()
}

fn fly(inputs: &Inputs, settings: &Settings) -> Fused {
    fuse(inputs, settings, Wanted { rate_hz: Some(2.0), ..Wanted::default() }).unwrap()
}

/// Returns the mean NEES of the attitude, and its largest error in degrees.
fn scored(fused: &Fused, scene: &Scenario) -> (f64, f64) {
    let rows: Vec<_> = scene.path().unwrap().vehicle_rows([0.0, 430.0], 10.0).collect();
    let misses = truth::compare(&fused.epochs, &rows);
    assert!(misses.len() > 20);
    let nees = misses.iter().map(|m| m.nees).sum::<f64>() / misses.len() as f64;
    (nees, misses.iter().map(|m| m.attitude_rad.norm().to_degrees()).fold(0.0, f64::max))
}

#[test]
fn a_star_tracker_replaces_receiver_and_cameras() {
    let scene = scene(3);
    let mut all = inputs(&scene, &mut Slow::new(3, 0.1), 0.0).unwrap();
    all.attitudes = tracked(&scene, (0..30).map(|k| 110.0 + 10.0 * f64::from(k)));
    all.gnss.clear();
    let with_cameras = fly(&all, &Settings::default());
    all.recordings.clear();
    for fused in [with_cameras, fly(&all, &Settings::default())] {
        let (nees, worst_deg) = scored(&fused, &scene);
        println!("NEES {nees:.2}, worst {worst_deg:.3} deg");
        assert!((0.02..6.0).contains(&nees) && worst_deg < 2.0, "{nees} {worst_deg}");
        assert_eq!(fused.verdict.level(), Level::Consistent, "{:?}", fused.verdict);
        assert!(fused.notes.iter().any(|n| n.contains("without a receiver")), "{:?}", fused.notes);
        let sigma_m = fused.epochs.last().unwrap().position_covariance_m2.as_inner().trace().sqrt();
        assert!(sigma_m > 6e6, "the position is not known: {sigma_m} m");
    }
}

/// The spin saturates the gyros for a quarter of a minute. How the vehicle turned meanwhile is not known, so the next
/// attitude of the star tracker begins the filter again, with cameras and without, however often attitudes come.
#[test]
fn a_star_tracker_finds_the_attitude_again_after_saturated_gyros() {
    for (seed, step_s) in [(3, 1.0), (4, 2.5), (5, 10.0)] {
        let scene = scene(seed);
        let mut all = inputs(&scene, &mut Slow::new(seed, 0.1), 0.0).unwrap();
        all.attitudes = tracked(&scene, (1..(429.0 / step_s) as u32).map(|k| step_s * f64::from(k)));
        let with_cameras = fly(&all, &Settings::default());
        all.recordings.clear();
        for fused in [with_cameras, fly(&all, &Settings::default())] {
            let refused = fused.innovations.iter().filter(|i| i.kind == Kind::Attitude && !i.taken).count();
            let (nees, _) = scored(&fused, &scene);
            println!("every {step_s} s: {refused} refused, NEES {nees:.2}, {:?}", fused.notes);
            assert!(fused.counts.saturated > 100, "the spin saturates the gyros");
            assert!(refused as f64 * step_s < 10.0, "{refused} right attitudes are refused");
            assert!(nees < 6.0 && fused.counts.restarts >= 1, "{nees}");
            assert_eq!(fused.verdict.level(), Level::Consistent, "{:?}", fused.verdict);
        }
    }
}

/// Attitudes in other words than ours: the verdict says which.
#[test]
fn a_star_tracker_with_other_quaternions_is_named() {
    let scene = scene(1);
    let right = inputs(&scene, &mut Slow::new(1, 0.1), 0.0).unwrap();
    let told = tracked(&scene, (0..30).map(|k| 110.0 + 10.0 * f64::from(k)));
    let changed = |change: &dyn Fn(f64, [f64; 4]) -> [f64; 4]| {
        let mut all = right.clone();
        let each = |a: &Attitude| {
            let wxyz = change(a.time_s, a.fixed_from_vehicle.unwrap().wxyz());
            Attitude { fixed_from_vehicle: Rotation::assume_from_quaternion(wxyz), ..*a }
        };
        all.attitudes = told.iter().map(each).collect();
        let findings = match fuse(&all, &Settings::default(), Wanted { rate_hz: Some(1.0), ..Wanted::default() }) {
            Ok(fused) => fused.verdict.findings,
            Err(Error::Contradicts { finding, .. }) => vec![*finding],
            Err(other) => panic!("{other}"),
        };
        findings.iter().map(|f| f.what.clone()).collect::<Vec<_>>().join("; ")
    };
    let same = changed(&|_, wxyz| wxyz);
    assert_eq!(same, "");
    let inverted = changed(&|_, [w, x, y, z]| [w, -x, -y, -z]);
    assert!(inverted.contains("quaternions are probably inverted"), "{inverted}");
    let last = changed(&|_, [w, x, y, z]| [x, y, z, w]);
    assert!(last.contains("have probably the scalar last"), "{last}");
    let inertial = changed(&|time_s, wxyz| {
        let angle_rad = 1.3 + EARTH_RATE_RAD_S * time_s;
        let turn = Rotation::<Fixed, Fixed>::from_scaled_axis(Vector::new(0.0, 0.0, angle_rad));
        (turn * Rotation::<Vehicle, Fixed>::assume_from_quaternion(wxyz).unwrap()).wxyz()
    });
    assert!(inertial.contains("relative to inertial axes"), "{inertial}");
}

/// A hole of a minute in the samples: the directions afterwards find the attitude again, and none of them is to blame.
#[test]
fn a_hole_in_the_samples_is_no_contradiction() {
    let scene = scene(1);
    let mut all = inputs(&scene, &mut Slow::new(1, 0.1), 0.0).unwrap();
    all.imu.retain(|s| !(200.0..260.0).contains(&s.imu.time_s));
    let fused = fly(&all, &Settings::default());
    let (nees, _) = scored(&fused, &scene);
    println!("NEES {nees:.2}, {:?}, {:?}", fused.notes, fused.verdict);
    assert!(nees < 6.0 && fused.counts.gaps == 1, "{nees}");
    assert_eq!(fused.verdict.level(), Level::Consistent, "{:?}", fused.verdict);
}

/// The inertial unit of the scene `rocket` is 30 times worse than that of the paper, whose table the defaults are: its
/// gyros have a bias of 0.05°/s. The default settings consider 6°/h and know no better than the gyros, so they refuse
/// the limbs. The verdict says so; with the settings of this unit all limbs are taken.
#[test]
fn one_fix_at_the_start_of_the_default_rocket_flight() {
    for frames in [75, 12] {
        one_fix_at_the_start(frames);
    }
}

fn one_fix_at_the_start(frames: u32) {
    let mut scene = Scenario::builtin("rocket").unwrap();
    scene.capture.frames = frames;
    let mut all = inputs(&scene, &mut Slow::new(scene.seed, 0.1), 0.0).unwrap();
    all.attitudes = tracked(&scene, [60.0].into_iter());
    let refused = |fused: &Fused| {
        let limbs = || fused.innovations.iter().filter(|i| i.camera.is_some());
        (limbs().filter(|i| !i.taken).count(), limbs().count())
    };
    let defaults = fly(&all, &Settings::default());
    println!(
        "{frames} pictures, defaults: refused {:?}, {:?}, {:#?}",
        refused(&defaults),
        scored(&defaults, &scene),
        defaults.verdict
    );
    let mut settings = Settings::default();
    settings.imu.gyro_bias_deg_h = ErrorSetting { mode: Treatment::Estimated, sigma: 180.0 };
    let own = fly(&all, &settings);
    println!("own: refused {:?}, {:?}, {:#?}", refused(&own), scored(&own, &scene), own.verdict);
    let found = defaults.verdict.likeliest().unwrap();
    assert_eq!((found.level, found.cause), (Level::Contradicts, Cause::GyroBias), "{:?}", defaults.verdict);
    let ((out, of), (nees, _)) = (refused(&own), scored(&own, &scene));
    assert!(out * 20 < of && (0.05..6.0).contains(&nees) && own.verdict.level() == Level::Consistent, "{out} {nees}");
}
