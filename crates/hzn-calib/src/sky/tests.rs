//! Tests with flights of edge points whose lens, limb height and noise are known.

use hzn_core::Prior;
use hzn_core::body;
use hzn_core::camera::{Camera, Config, Intrinsic, Model};
use hzn_core::frames::Rotation;
use nalgebra::{Rotation3, UnitQuaternion, Vector3};

use super::{
    Determined, Found, LimbPrior, Picture, Refusal, Unknowns, Verdict, View, check, estimate, estimate_in_passes,
};
use super::{into_sensor_toml, mount};
use crate::draws::Draws;
use crate::noise::tests::{Noise, earth, limb, solution};

/// A flight with a known lens.
#[derive(Clone)]
pub(super) struct Flight {
    /// The real lens.
    lens: Config,
    pictures: usize,
    /// Lowest and highest altitude, in kilometres.
    altitude_km: [f64; 2],
    limb_km: f64,
    scatter_km: f64,
    noise: Noise,
    shift_px: f64,
    /// Smallest and largest angle from the optical axis to the limb axis, as parts of the half-angle of the limb.
    off_axis: [f64; 2],
    seed: u64,
}

impl Flight {
    pub(super) fn new(lens: Config, seed: u64) -> Self {
        Self {
            lens,
            pictures: 40,
            altitude_km: [80.0, 240.0],
            limb_km: 17.0,
            scatter_km: 0.3,
            noise: Noise(0.15, 60.0, 0.3),
            shift_px: 0.05,
            off_axis: [0.8, 1.2],
            seed,
        }
    }

    pub(super) fn body(&self) -> body::Config {
        body::Config { limb_height_km: 17.0, limb_height_sigma_km: 7.0, altitude_sigma_km: 0.0, ..earth() }
    }

    /// Returns the pictures, whose fits start about a degree off.
    pub(super) fn views(&self) -> Vec<View> {
        let camera = Camera::try_new(&self.lens).unwrap();
        let mut draws = Draws(self.seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1);
        for _ in 0..10 {
            draws.uniform();
        }
        let radius = self.body().mean_radius_km();
        let part = |low: f64, high: f64, x: f64| low + (high - low) * x;
        let each = (0..self.pictures).map(|k| {
            let x = k as f64 / (self.pictures.max(2) - 1) as f64;
            let altitude_km = part(self.altitude_km[0], self.altitude_km[1], x);
            let km = self.limb_km + self.scatter_km * draws.normal();
            let alpha = ((radius + km) / (radius + altitude_km)).asin();
            let below = alpha * part(self.off_axis[0], self.off_axis[1], draws.uniform());
            let roll = core::f64::consts::TAU * draws.uniform();
            let axis = Vector3::new(below.sin() * roll.cos(), below.sin() * roll.sin(), below.cos());
            let mut points = limb(&camera, axis, &|_| alpha.cos(), self.noise, &mut draws);
            points.retain_mut(|(p, _)| {
                let Some(ray) = camera.ray(hzn_core::pixel::ImagePoint { u: p[0], v: p[1] }) else { return false };
                let j = ray.jacobian();
                let g = [0, 1].map(|i| (0..3).map(|r| j[r][i] * axis[r]).sum::<f64>());
                let norm = g[0].hypot(g[1]);
                *p = [p[0] + self.shift_px * g[0] / norm, p[1] + self.shift_px * g[1] / norm];
                true
            });
            let prior = Prior { altitude_m: Some(altitude_km * 1e3), ..Prior::default() };
            let start = (axis + Vector3::new(0.01, -0.01, 0.005)).normalize();
            View::new(&format!("{k}"), points, prior, &solution(start, alpha + 1e-3))
        });
        each.filter(|v| v.points.len() > 60).collect()
    }
}

pub(super) fn lens(fov_deg: f64) -> Config {
    let mut lens = Config::ideal(Model::KannalaBrandt, 960, 720, 960.0 / fov_deg.to_radians());
    lens.k.extend_from_slice(&[-0.05, 0.01]).unwrap();
    lens
}

fn with_focal(lens: &Config, percent: f64) -> Config {
    let part = 1.0 + 0.01 * percent;
    Config { fx_px: lens.fx_px * part, fy_px: lens.fy_px * part, ..lens.clone() }
}

/// The calibration that is told: 2 % too long, with its centre beside the real one.
fn told(real: &Config) -> Config {
    let lens = with_focal(real, 2.0);
    Config { cx_px: lens.cx_px + 4.0, cy_px: lens.cy_px - 3.0, ..lens }
}

const KNOWN: LimbPrior = LimbPrior { km: 17.0, sigma_km: 1.0 };
pub(super) const DEFAULT: LimbPrior = LimbPrior { km: 17.0, sigma_km: 7.0 };

#[test]
fn a_wrong_lens_is_corrected_with_a_wrong_limb_height() {
    let mut flight = Flight::new(lens(90.0), 1001);
    flight.limb_km = 23.0;
    let found = estimate(&Unknowns::new(&told(&flight.lens), &[]), &flight.body(), &flight.views(), DEFAULT).unwrap();
    assert!(found.alarm().is_none() && found.undetermined().is_none());
    let percent = 100.0 * (found.camera.fx_px / flight.lens.fx_px - 1.0);
    let [_, sigma] = found.focal_percent;
    assert!(sigma < 0.1 && percent.abs() < 3.0 * sigma, "{percent} ± {sigma}");
    let [km, sigma_km] = found.height_km;
    assert!(sigma_km < 0.6 && (km - 23.0).abs() < 3.0 * sigma_km, "{km} ± {sigma_km}");
    for p in found.parameters.iter().filter(|p| matches!(p.which, Intrinsic::CxPx | Intrinsic::CyPx)) {
        let real = flight.lens.intrinsic(p.which).unwrap();
        assert!(p.determined && (p.value - real).abs() < 3.0 * p.sigma, "{p:?}");
    }
    // The covariance is that of the written parameters, and the sensor accepts it.
    assert!(Camera::<f64>::try_new(&found.camera).is_ok() && found.camera.covariance.is_some());
}

#[test]
fn the_altitude_span_separates_focal_length_and_limb_height() {
    let observe = |altitude_km| {
        // The limb passes through the middle of every picture, so its place in the picture does not tell them apart.
        let flight = Flight { altitude_km, off_axis: [1.0, 1.0], ..Flight::new(lens(30.0), 1002) };
        let found = estimate(&Unknowns::new(&told(&flight.lens), &[]), &flight.body(), &flight.views(), DEFAULT);
        found.unwrap().observability
    };
    let (wide, narrow) = (observe([80.0, 240.0]), observe([118.0, 122.0]));
    assert!(narrow.free_limb_km > 2.0 * wide.free_limb_km, "{wide:?} {narrow:?}");
    assert!(narrow.correlation.abs() > wide.correlation.abs(), "{wide:?} {narrow:?}");
}

#[test]
fn a_check_holds_or_not_or_cannot_tell() {
    let flight = Flight::new(lens(90.0), 1003);
    let views = flight.views();
    let verdict = |config: &Config| check(config, &flight.body(), &views, KNOWN, 0.3).unwrap();
    let right = Config { centre_sigma_px: 0.3, ..flight.lens.clone() };
    assert_eq!(verdict(&right).verdict, Verdict::Holds);
    for percent in [0.35, -0.35] {
        let off = verdict(&with_focal(&right, percent));
        assert_eq!(off.verdict, Verdict::DoesNotHold, "{percent}");
        assert!((off.focal.value + percent).abs() < 0.2, "{percent}: {:?}", off.focal);
    }
    // A calibration that is itself known to 0.3 % cannot be tested for 0.3 %.
    let vague = Config { focal_sigma_percent: 0.3, ..right.clone() };
    assert_eq!(verdict(&vague).verdict, Verdict::CannotTell);
    // A moved principal point is found too.
    let moved = Config { cx_px: right.cx_px + 5.0, ..right.clone() };
    let moved = verdict(&moved);
    assert!(moved.verdict == Verdict::DoesNotHold && moved.centre_px[0].is_significant(), "{moved:?}");
    // Few pictures tell little.
    let few = check(&right, &flight.body(), &views[..5], DEFAULT, 0.3).unwrap();
    assert_eq!(few.verdict, Verdict::CannotTell);
}

/// Pictures through two lenses: the mean agrees with the calibration, and no single lens explains them.
#[test]
fn pictures_that_contradict_each_other_do_not_hold() {
    let flight = Flight { scatter_km: 0.0, ..Flight::new(lens(90.0), 1004) };
    let zoomed = Flight { lens: with_focal(&flight.lens, 2.0), ..flight.clone() };
    let shorter = Flight { lens: with_focal(&flight.lens, -2.0), ..flight.clone() };
    let [longer, shorter] = [zoomed.views(), shorter.views()];
    let each = longer.into_iter().zip(shorter).enumerate();
    let mixed: Vec<View> = each.map(|(k, (a, b))| if k % 2 == 0 { a } else { b }).collect();
    let right = Config { centre_sigma_px: 3.0, focal_sigma_percent: 2.0, ..flight.lens.clone() };
    let of = |views: &[View]| check(&right, &flight.body(), views, KNOWN, 0.3).unwrap();
    let found = of(&mixed);
    assert_eq!(found.verdict, Verdict::DoesNotHold, "{found:?}");
    assert!(found.contradiction().is_some(), "{:?}", found.chi2);
    let lines = super::check_lines(&found, "40 pictures");
    assert!(lines[0].1.starts_with("does not hold: the pictures contradict each other: chi-square is"), "{lines:?}");
    assert!(lines.iter().any(|(name, _)| name == "chi-square"), "{lines:?}");
    assert!(of(&flight.views()).contradiction().is_none());
}

#[test]
fn noise_of_the_points_does_not_make_the_focal_length_longer() {
    // In small pictures a common bend of the edges looks almost like another focal length. The difference is then found
    // from little, so that a small bias of the equations counts.
    let small = Config::ideal(Model::Pinhole, 320, 240, 160.0 / 35.0f64.to_radians().tan());
    let mean = |seeds: core::ops::Range<u64>| {
        let n = (seeds.end - seeds.start) as f64;
        let sigmas = |seed| {
            let noise = Noise(0.2, 1.0, 1.0);
            let flight = Flight { pictures: 24, scatter_km: 0.0, noise, ..Flight::new(small.clone(), seed) };
            let found = check(&small, &flight.body(), &flight.views(), KNOWN, 0.3).unwrap();
            found.focal.value / found.focal.sigma
        };
        seeds.map(sigmas).sum::<f64>() / n
    };
    let sigmas = mean(1100..1112);
    assert!(sigmas.abs() < 0.4, "{sigmas}");
}

#[test]
fn what_the_flight_does_not_determine_is_refused() {
    let flight = Flight::new(lens(90.0), 1004);
    let views = flight.views();
    let unknowns = Unknowns::new(&flight.lens, &[]);
    let free = LimbPrior { km: 17.0, sigma_km: f64::INFINITY };
    let few = estimate(&unknowns, &flight.body(), &views[..5], free).unwrap_err().to_string();
    assert!(few.contains("5 pictures have an answer, but a free limb height needs at least 12"), "{few}");
    let none = estimate(&unknowns, &flight.body(), &[], DEFAULT).unwrap_err().to_string();
    assert!(none.contains("no picture has an answer with a limb and an altitude"), "{none}");
    // A calibration that is better than the flight keeps its values.
    let good = Config { focal_sigma_percent: 0.01, centre_sigma_px: 0.01, ..flight.lens.clone() };
    let kept = estimate(&Unknowns::new(&good, &[]), &flight.body(), &views, DEFAULT).unwrap();
    assert!(kept.undetermined().unwrap().to_string().contains("at most half of that before"));
    assert_eq!((kept.camera.fx_px, kept.camera.cx_px), (good.fx_px, good.cx_px));
}

#[test]
fn altitudes_of_other_pictures_raise_an_alarm() {
    let mut views = Flight::new(lens(90.0), 1005).views();
    let altitudes: Vec<_> = views.iter().map(|v| v.prior.altitude_m).collect();
    for (view, other) in views.iter_mut().zip(altitudes.iter().rev()) {
        view.prior.altitude_m = *other;
    }
    let flight = Flight::new(lens(90.0), 1005);
    match estimate(&Unknowns::new(&flight.lens, &[]), &flight.body(), &views, DEFAULT) {
        Ok(found) => assert!(found.alarm().is_some(), "{:?}", found.chi2),
        Err(why) => assert!(matches!(why, Refusal::Inconsistent { .. } | Refusal::NotConverged { .. }), "{why}"),
    }
}

#[test]
fn the_written_file_is_read_back() {
    let flight = Flight::new(lens(90.0), 1006);
    let found = estimate(&Unknowns::new(&told(&flight.lens), &[]), &flight.body(), &flight.views(), DEFAULT).unwrap();
    let before = hzn_files::camera_file::write(&told(&flight.lens), hzn_files::camera_file::Format::Sensor).unwrap();
    let written = into_sensor_toml(
        &format!("# mine\n{before}"),
        Found { camera: &found.camera, parameters: &found.parameters, source: "40 limb pictures of flight" },
    )
    .unwrap();
    assert!(written.text.starts_with("# mine") && written.text.contains("by `hzn calibrate sky`"), "{}", written.text);
    let read = hzn_files::sensor::parse(&written.text, std::path::Path::new("s.toml")).unwrap().config.camera;
    for p in &found.parameters {
        let value = read.intrinsic(p.which).unwrap();
        assert!((value - p.value).abs() <= 0.02 * p.sigma, "{p:?} {value}");
    }
    let covariance = read.covariance.unwrap();
    assert_eq!(covariance.order.len(), 4);
    assert!((covariance.rows[0][0].sqrt() / found.parameters[0].sigma - 1.0).abs() < 1e-5);
}

/// A flight whose pictures have a position and an attitude that was computed with a nominal mount; the real camera is
/// turned by `turn` against it.
fn mounted(turn: Rotation3<f64>, spread: f64) -> (Flight, Vec<View>) {
    let mut flight = Flight::new(lens(90.0), 1007);
    flight.scatter_km = 0.0;
    let mut views = flight.views();
    let mut draws = Draws(99);
    for view in &mut views {
        let distance = flight.body().mean_radius_km() * 1e3 + view.prior.altitude_m.unwrap();
        // The true limb axis in the real camera frame points to the centre of the Earth.
        let below = 0.6 * spread * draws.uniform();
        let roll = core::f64::consts::TAU * draws.uniform() * spread;
        let down = Vector3::new(below.sin() * roll.cos(), below.sin() * roll.sin(), below.cos());
        let fixed_from_camera = Rotation3::from_euler_angles(draws.uniform(), draws.uniform(), draws.uniform());
        let position = fixed_from_camera * down * -distance;
        view.axis = (turn.inverse() * down).into();
        view.prior.position_m = Some(position.into());
        let q = UnitQuaternion::from_rotation_matrix(&fixed_from_camera);
        view.prior.fixed_from_camera = Rotation::assume_from_quaternion([q.w, q.i, q.j, q.k]);
    }
    (flight, views)
}

#[test]
fn the_mount_is_found_or_refused() {
    let turn = Rotation3::new(Vector3::new(0.02, -0.01, 0.03));
    let (flight, views) = mounted(turn, 1.0);
    let measured = |views: &[View]| {
        let axes = views.iter().map(|v| Picture {
            name: v.name.clone(),
            km: 0.0,
            sigma_km: 1.0,
            rms_px: 0.1,
            axis: v.axis,
            counts: true,
        });
        axes.collect::<Vec<_>>()
    };
    let found = mount::from_pictures(&measured(&views), 17.0, &flight.body(), &views).unwrap();
    for (have, want) in found.correction_deg.iter().zip(turn.scaled_axis().iter()) {
        assert!((have - want.to_degrees()).abs() < 1e-6, "{found:?}");
    }
    // The body always on the axis of the camera: the rotation about it is unknown.
    let (flight, views) = mounted(turn, 0.0);
    let refused = mount::from_pictures(&measured(&views), 17.0, &flight.body(), &views).unwrap_err();
    let words = refused.to_string();
    assert!(words.contains("do not determine the rotation about (") && words.contains("1.00)"), "{words}");
    let few = mount::from_pictures(&measured(&views)[..2], 17.0, &flight.body(), &views).unwrap_err();
    assert!(few.to_string().contains("2 pictures have a limb, a position"), "{few}");
}

/// Prints the statistics of many flights for the page of results:
/// `cargo test --release -p hzn-calib --lib -- sky::tests::campaign --ignored --nocapture`.
#[test]
#[ignore = "it takes minutes; its figures are in the book"]
fn campaign() {
    println!(
        "| field of view, altitudes, limb height known to | focal length: RMS of errors, mean 1σ | within 3σ | mean \
         square of errors over σ² | right lens: holds, does not hold, cannot tell | lens 0.3 % off: holds, does not \
         hold, cannot tell |"
    );
    println!("|---|---|---|---|---|---|");
    let cases = [(60.0, [80.0, 240.0]), (90.0, [80.0, 240.0]), (120.0, [80.0, 240.0]), (90.0, [600.0, 610.0])];
    for (fov, altitude_km) in cases {
        for limb in [DEFAULT, KNOWN] {
            campaign_row(fov, altitude_km, limb);
        }
    }
}

fn campaign_row(fov: f64, altitude_km: [f64; 2], limb: LimbPrior) {
    let (mut errors, mut sigmas) = (vec![], vec![]);
    let (mut right, mut off) = ([0; 3], [0; 3]);
    let mut draws = Draws(4321);
    for seed in 20_000..20_100 {
        let shift_px = 0.1 * draws.normal();
        let limb_km = 17.0 + limb.sigma_km.min(5.0) * draws.normal();
        let flight = Flight { altitude_km, limb_km, shift_px, ..Flight::new(lens(fov), seed) };
        let views = flight.views();
        let found = estimate(&Unknowns::new(&told(&flight.lens), &[]), &flight.body(), &views, limb).unwrap();
        errors.push(100.0 * (found.camera.fx_px / flight.lens.fx_px - 1.0));
        sigmas.push(found.focal_percent[1]);
        let real = Config { centre_sigma_px: 0.3, ..flight.lens.clone() };
        let sign = if seed % 2 == 0 { 0.3 } else { -0.3 };
        right[check(&real, &flight.body(), &views, limb, 0.3).unwrap().verdict as usize] += 1;
        off[check(&with_focal(&real, sign), &flight.body(), &views, limb, 0.3).unwrap().verdict as usize] += 1;
    }
    let n = errors.len() as f64;
    let rms = (errors.iter().map(|e| e * e).sum::<f64>() / n).sqrt();
    let z2: Vec<f64> = errors.iter().zip(&sigmas).map(|(e, s)| (e / s).powi(2)).collect();
    println!(
        "| {fov}°, {} to {} km, ± {} km | {rms:.3} %, {:.3} % | {:.1} % | {:.2} | {}, {}, {} | {}, {}, {} |",
        altitude_km[0],
        altitude_km[1],
        limb.sigma_km,
        sigmas.iter().sum::<f64>() / n,
        100.0 * z2.iter().filter(|z| **z <= 9.0).count() as f64 / n,
        z2.iter().sum::<f64>() / n,
        right[0],
        right[1],
        right[2],
        off[0],
        off[1],
        off[2]
    );
}

/// A flight at one altitude: focal length and limb height look alike in its pictures.
fn level_flight(seed: u64) -> Flight {
    Flight { altitude_km: [478.0, 482.0], pictures: 16, off_axis: [0.9, 1.1], ..Flight::new(lens(60.0), seed) }
}

#[test]
fn a_start_that_contradicts_the_pictures_is_refused() {
    let (mut written, mut inside, mut far_refused) = (0, 0, 0);
    for seed in 0..12 {
        let flight = level_flight(7100 + seed);
        let views = flight.views();
        for percent in [-15.0, -10.0, -5.0, 5.0, 10.0, 15.0] {
            let told = Config { focal_sigma_percent: 4.0, ..with_focal(&flight.lens, percent) };
            let found = match estimate(&Unknowns::new(&told, &[]), &flight.body(), &views, DEFAULT) {
                Ok(found) if found.alarm().is_none() && found.undetermined().is_none() => found,
                Ok(found) if f64::abs(percent) > 6.0 && found.alarm().is_some() => {
                    assert!(matches!(found.alarm(), Some(Refusal::Conflict { .. })));
                    far_refused += usize::from(percent.abs() > 12.0);
                    continue;
                }
                _ => continue,
            };
            let is_focal = |p: &&Determined| p.which == Intrinsic::FxPx && p.determined;
            if !found.parameters.iter().any(|p| is_focal(&p)) {
                continue;
            }
            written += 1;
            let miss = found.camera.fx_px / flight.lens.fx_px - 1.0;
            inside += usize::from(100.0 * miss.abs() <= 3.0 * found.focal_percent[1]);
        }
    }
    // Nearly four sigmas off: all but a few are refused. What is written is right within three sigmas.
    assert!(far_refused >= 20 && written >= 20, "{far_refused} of 24 refused, {written} written");
    assert!(inside as f64 >= 0.97 * f64::from(written), "{inside} of {written}");
}

#[test]
fn a_start_within_its_sigma_is_no_contradiction() {
    let alarms = (0..40).filter(|seed| {
        let mut draws = Draws(0x51_7cc1 + 2 * seed + 1);
        (0..10).for_each(|_| _ = draws.uniform());
        let limb_km = 17.0 + 7.0 * draws.normal();
        let flight = Flight { limb_km, ..level_flight(7300 + seed) };
        let told = Config { focal_sigma_percent: 4.0, ..with_focal(&flight.lens, 4.0 * draws.normal()) };
        let found = estimate(&Unknowns::new(&told, &[]), &flight.body(), &flight.views(), DEFAULT);
        found.is_ok_and(|found| found.alarm().is_some())
    });
    // One in a hundred is expected.
    assert!(alarms.count() <= 2);
}

#[test]
fn a_lens_with_which_the_answers_are_lost_is_no_lens() {
    let flight = level_flight(7500);
    let told = Config { focal_sigma_percent: 10.0, ..with_focal(&flight.lens, 8.0) };
    let sensor = hzn_core::Config { body: flight.body(), ..hzn_core::Config::new(told.clone()) };
    let unknowns = Unknowns::new(&told, &[]);
    let mut passes = 0;
    let process = |used: &Config| {
        passes += 1;
        // The sigma of the lens is as large as its step, so that a limb of the old size is still accepted.
        assert!(passes == 1 || used.focal_sigma_percent > 5.0, "{}", used.focal_sigma_percent);
        Ok::<_, ()>(Some(if passes == 1 { flight.views() } else { Vec::new() }))
    };
    let found = estimate_in_passes(&sensor, &flight.body(), &unknowns, DEFAULT, process, |_| ()).unwrap().unwrap();
    let why = found.unwrap_err();
    assert!(matches!(why, Refusal::Lost { answered: [_, 0], why: None, .. }), "{why:?}");
    assert!(why.to_string().contains("`hzn init` without --fov"), "{why}");
    // Numbers that the user never wrote are told as such.
    let impossible = Refusal::Impossible { why: "camera.k = -0.2: the lens is monotone".into() }.to_string();
    assert!(impossible.contains("camera.k = -0.2") && impossible.contains("not of sensor.toml"), "{impossible}");
}
