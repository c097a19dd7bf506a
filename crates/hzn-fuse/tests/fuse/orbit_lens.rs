//! The lens in the orbit from limbs and attitudes: focal length and principal point with errors that are drawn from the
//! sigmas of the calibration.
//!
//! `HZN_FLIGHTS=20 cargo test --test fuse orbit_lens:: -- --nocapture` flies 20 flights of each kind; without the
//! variable a few of them.

use crate::common::{Draws, flights};
use crate::lens::settings as of_lens;
use crate::orbit::{ORBITS, Place, Plan, nees, settings, simulate};
use crate::solve::rms;
use hzn_core::camera::{Config, Model};
use hzn_fuse::finding::{Cause, Level};
use hzn_fuse::flight::Wanted;
use hzn_fuse::input::Inputs;
use hzn_fuse::settings::{LensSetting, Settings, Treatment};
use hzn_fuse::solve::Lens;
use hzn_fuse::{Fused, fuse};
use nalgebra::Vector3;

/// 1-sigma of the lens: focal length in percent, principal point in px. Half a pixel is 0.04°.
const SIGMAS: [f64; 2] = [0.1, 0.5];
/// How far a vehicle rolls and pitches that moves the limb through the picture, rad.
const ROCKING: [f64; 2] = [0.45, 0.25];

/// Returns the camera: 1920 x 1080 pixels over 157°.
fn camera() -> Config {
    let mut config = Config::ideal(Model::KannalaBrandt, 1920, 1080, 700.0);
    config.k = [-0.02, 0.003].into_iter().collect();
    (config.focal_sigma_percent, config.centre_sigma_px) = (SIGMAS[0], SIGMAS[1]);
    config
}

/// A flight whose lens has an error that is larger than told by a factor. `is_told` says that the covariances of the
/// rows have the lens in them, as those of the sensor have.
fn drawn(seed: u64, rocking_rad: [f64; 2], larger: f64, is_told: bool) -> (Inputs, Vec<Place>, Vector3<f64>) {
    let mut plan = Plan::new(ORBITS[seed as usize % ORBITS.len()].1, seed, 2.0 * 5800.0);
    plan.rocking_rad = rocking_rad;
    let (mut inputs, places) = simulate(plan);
    let mut draws = Draws(seed ^ 0x1e25);
    let sigma = Vector3::new(0.01 * SIGMAS[0], SIGMAS[1], SIGMAS[1]);
    let error = sigma.map(|s| larger * s * draws.normal());
    let recording = &mut inputs.recordings[0];
    let lens = Lens::new(&camera(), &of_lens(SIGMAS)).unwrap();
    // Where the limb is outside of the picture there is no answer.
    recording.seen.retain(|seen| lens.by_lens_of(seen).is_some());
    for seen in &mut recording.seen {
        let by = lens.by_lens_of(seen).unwrap();
        seen.axis = (seen.axis.into_inner() + by * error).normalize().into();
        if is_told {
            let part = by * nalgebra::Matrix3::from_diagonal(&sigma.map(|s| s * s)) * by.transpose();
            seen.covariance_rad2 = (seen.covariance_rad2.into_inner() + part).into();
            seen.common_rad2 = seen.common_rad2.map(|common| (common.into_inner() + part).into());
        }
    }
    recording.camera = Some(camera());
    (inputs, places, error)
}

/// Returns settings that treat the lens in a way.
fn with(mode: Treatment) -> Settings {
    let mut out = settings();
    (out.camera.focal_percent.mode, out.camera.centre_px.mode) = (mode, mode);
    out
}

fn solved(inputs: &Inputs, settings: &Settings) -> Fused {
    fuse(inputs, settings, Wanted { solved: true, ..Wanted::default() }).unwrap()
}

/// Returns estimate, sigma and the sigma before of a parameter of the lens.
fn found(fused: &Fused, what: &str) -> [Vec<f64>; 3] {
    let all = &fused.solved.as_ref().unwrap().determined;
    let one = all.iter().find(|d| d.name == format!("{what} of cam")).unwrap();
    [one.estimate.clone(), one.sigma.clone(), one.before.clone()]
}

/// Returns the mean squared error of the position over its covariance (3 is ideal), and the mean sigma, km.
fn judged(fused: &Fused, places: &[Place]) -> [f64; 2] {
    let variance: f64 = fused.smoothed.iter().map(|epoch| epoch.position_covariance_m2.as_inner().trace()).sum();
    [nees(fused, places), (variance / fused.smoothed.len() as f64).sqrt() * 1e-3]
}

/// A camera that keeps its attitude to the horizon has the limb in one place of the picture: the lens looks like the
/// mount, and is in the sigma.
#[test]
fn a_wrong_lens_is_considered() {
    let count = flights(3, 20);
    let mut sums = [[0.0; 2]; 4];
    for seed in 300..300 + count {
        let (inputs, places, _) = drawn(seed, [0.0; 2], 1.0, true);
        let considered = solved(&inputs, &with(Treatment::Considered));
        for what in ["focal length", "principal point"] {
            let [estimate, sigma, before] = found(&considered, what);
            assert!(estimate.iter().all(|x| *x == 0.0 || x.abs() < 1e-3 * before[0]), "{estimate:?}");
            assert!(sigma.iter().zip(&before).all(|(a, b)| (a / b - 1.0).abs() < 1e-6), "{sigma:?} {before:?}");
        }
        assert!(considered.notes.iter().any(|note| note.contains("of its told lens")), "{:?}", considered.notes);
        let (untold, ..) = drawn(seed, [0.0; 2], 1.0, false);
        let all = [
            considered,
            solved(&inputs, &with(Treatment::Estimated)),
            solved(&inputs, &with(Treatment::Off)),
            solved(&untold, &with(Treatment::Off)),
        ];
        for (sum, fused) in sums.iter_mut().zip(&all) {
            for (sum, one) in sum.iter_mut().zip(judged(fused, &places)) {
                *sum += one / count as f64;
            }
        }
    }
    let names = ["considered", "estimated", "in each covariance", "nowhere"];
    for (name, [nees, km]) in names.iter().zip(sums) {
        println!("lens {name}: NEES of the position {nees:.2} (3 is ideal), sigma {km:.1} km, {count} flights");
    }
    let [considered, estimated, _, nowhere] = sums.map(|[nees, _]| nees);
    // Three flights scatter too much for the errors themselves.
    assert!(sums[0][1] > 1.3 * sums[3][1], "{sums:?}");
    let most = if count < 10 { 10.0 } else { 6.0 };
    assert!((0.3..most).contains(&considered) && (0.3..most).contains(&estimated), "{considered} {estimated}");
    assert!(count < 10 || nowhere > 1.3 * considered, "{nowhere} {considered}");
}

/// A vehicle that rocks moves the limb through the picture, so the flight measures the lens.
#[test]
fn a_wrong_lens_is_found_where_the_limb_moves() {
    let count = flights(3, 20);
    let (mut errors, mut shares) = (Vec::new(), [Vec::new(), Vec::new()]);
    let mut sums = [[0.0; 2]; 3];
    for seed in 400..400 + count {
        let (inputs, places, truth) = drawn(seed, ROCKING, 1.0, true);
        let all =
            [Treatment::Estimated, Treatment::Considered, Treatment::Off].map(|mode| solved(&inputs, &with(mode)));
        assert!(all[0].verdict.level() < Level::Contradicts, "{seed}: {:?}", all[0].verdict);
        let [focal, focal_sigma, focal_before] = found(&all[0], "focal length");
        let [centre, centre_sigma, centre_before] = found(&all[0], "principal point");
        errors.push((focal[0] - 100.0 * truth.x) / focal_sigma[0]);
        errors.extend([0, 1].map(|i| (centre[i] - truth[1 + i]) / centre_sigma[i]));
        shares[0].push(focal_sigma[0] / focal_before[0]);
        shares[1].extend([0, 1].map(|i| centre_sigma[i] / centre_before[i]));
        for (sum, fused) in sums.iter_mut().zip(&all) {
            for (sum, one) in sum.iter_mut().zip(judged(fused, &places)) {
                *sum += one / count as f64;
            }
        }
    }
    let mean = |all: &[f64]| all.iter().sum::<f64>() / all.len() as f64;
    let shares = shares.map(|all| mean(&all));
    println!(
        "errors of the lens over their sigma, RMS {:.2} of {}; sigma over that before: focal length {:.2}, principal \
         point {:.2}",
        rms(&errors),
        errors.len(),
        shares[0],
        shares[1]
    );
    for (name, [nees, km]) in ["estimated", "considered", "in each covariance"].iter().zip(sums) {
        println!("lens {name}: NEES of the position {nees:.2} (3 is ideal), sigma {km:.1} km, {count} flights");
    }
    assert!(rms(&errors) < if count < 10 { 2.0 } else { 1.4 }, "{errors:?}");
    assert!(shares[0] < 0.7, "{shares:?}");
    let most = if count < 10 { 10.0 } else { 6.0 };
    assert!((0.3..most).contains(&sums[0][0]), "{sums:?}");
    // What is measured is known better than what is only considered.
    assert!(sums[0][1] < sums[1][1], "{sums:?}");
}

/// A lens that is far from its calibration is named; one that nobody knows cannot be an unknown.
#[test]
fn a_lens_far_from_its_calibration_is_named() {
    let (mut inputs, _, truth) = drawn(401, ROCKING, 12.0, true);
    let fused = solved(&inputs, &with(Treatment::Estimated));
    println!("{truth:?} {:?}", found(&fused, "focal length"));
    let lens = fused.verdict.findings.iter().find(|f| f.cause == Cause::Lens);
    assert!(lens.is_some_and(|f| f.level == Level::Contradicts), "{:?}", fused.verdict.findings);
    inputs.recordings[0].camera = None;
    let mut told = with(Treatment::Estimated);
    told.camera.focal_percent = LensSetting { mode: Treatment::Estimated, sigma: Some(0.5) };
    let wanted = Wanted { solved: true, ..Wanted::default() };
    let text = fuse(&inputs, &told, wanted).unwrap_err().to_string();
    assert!(text.starts_with("cam: focal_percent has a sigma") && text.contains("--mount"), "{text}");
}
