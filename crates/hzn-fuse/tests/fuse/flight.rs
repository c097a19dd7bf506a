//! Simulated flights through `fuse`: right ones, and ones whose data misbehave.

use crate::common::{flight, scene};
use crate::solve::drawn;
use hzn_fuse::finding::Source;
use hzn_fuse::flight::Wanted;
use hzn_fuse::input::{Attitude, Body, Centre, Inputs};
use hzn_fuse::results::Kind;
use hzn_fuse::settings::Limb;
use hzn_fuse::{Fused, Settings, fuse, sink, truth};
use hzn_nav::frames::{Cam, Covariance, Fixed, Rotation, Vector, Vehicle};
use hzn_sim::Scenario;

/// A seed whose flight shows the Sun from T+111 s on.
const SEED: u64 = 1;

/// Settings whose noise is that of the simulation.
fn settings() -> Settings {
    let mut settings = Settings::default();
    settings.imu.gyro_noise_deg_rth[1] = 0.3;
    settings.imu.accel_noise_mg_rthz[1] = 0.3;
    settings.camera.white_rad = 4e-4;
    settings.limb_height.sigma_km = Some(0.5);
    settings
}

fn true_mount(scene: &Scenario) -> Rotation<Cam, Vehicle> {
    Rotation::assume_from_quaternion(scene.true_q_vehicle_from_camera_wxyz()).unwrap()
}

/// Returns the true position and attitude at a time.
fn true_state(path: &hzn_sim::trajectory::Path, time_s: f64) -> (Vector<Fixed>, Rotation<Vehicle, Fixed>) {
    let state = path.state(time_s);
    (state.position_m.into(), state.fixed_from_vehicle.into())
}

fn misses(fused: &Fused, scene: &Scenario) -> Vec<truth::Miss> {
    let path = scene.path().unwrap();
    let rows: Vec<_> = path.vehicle_rows([0.0, 430.0], 10.0).collect();
    truth::compare(&fused.epochs, &rows)
}

/// Returns the largest error of the attitude after a time, degrees.
fn worst_deg(fused: &Fused, scene: &Scenario, from_s: f64) -> f64 {
    let all = misses(fused, scene);
    assert!(all.len() > 100);
    all.iter().filter(|m| m.time_s > from_s).map(|m| m.attitude_rad.norm().to_degrees()).fold(0.0, f64::max)
}

#[test]
fn a_flight_gives_attitude_mounts_clocks_and_the_way_back() {
    let scene = scene(SEED);
    let fused =
        fuse(&flight(&scene), &settings(), Wanted { smoothed: true, rate_hz: Some(5.0), ..Wanted::default() }).unwrap();
    let begin = fused.begin.unwrap();
    assert!((100.0..130.0).contains(&begin.time_s) && begin.directions >= 2, "{begin:?}");
    assert!(worst_deg(&fused, &scene, 200.0) < 1.0);
    let nees = |epochs: &[hzn_fuse::results::Epoch]| {
        let rows: Vec<_> = scene.path().unwrap().vehicle_rows([0.0, 430.0], 10.0).collect();
        let all = truth::compare(epochs, &rows);
        all.iter().map(|m| m.nees).sum::<f64>() / all.len() as f64
    };
    // The errors of one flight are hardly independent.
    assert!((0.1..9.0).contains(&nees(&fused.epochs)), "{}", nees(&fused.epochs));
    assert!((0.1..9.0).contains(&nees(&fused.smoothed)), "{}", nees(&fused.smoothed));
    // A smoother knows more than a filter at the start, and the same at the end.
    let sigma = |e: &hzn_fuse::results::Epoch| e.attitude_sigma_rad().norm();
    assert!(sigma(&fused.smoothed[2]) < 0.7 * sigma(&fused.epochs[2]));
    let last = fused.epochs.last().unwrap();
    for (one, state) in scene.by_camera().iter().zip(&last.cameras) {
        let error = (state.mount.inverse() * true_mount(one)).scaled_axis();
        let sigmas = error.as_inner().component_div(&state.misalignment_sigma_rad).amax();
        assert!(sigmas < 3.5, "{}: {error:?} {}", one.name, state.misalignment_sigma_rad);
        let late_s = -(one.clock.offset_s + one.clock.latency_s);
        assert!((state.clock_s - late_s).abs() < 3.5 * state.clock_sigma_s, "{} {late_s}", state.clock_s);
        assert!(state.clock_sigma_s < 0.15);
    }
    let at_end = &fused.back.last().unwrap().state;
    assert_eq!((at_end.time_s, at_end.attitude), (begin.time_s, fused.epochs[0].state.attitude));
    way_back_ends_at_the_spin(&fused, &scene);
    assert!(fused.triads.len() > 30 && fused.notes.len() <= 2, "{:?}", fused.notes);
}

/// The spin saturates the gyros: nobody knows the attitude before it, and the way back ends there. Its sigmas hold.
fn way_back_ends_at_the_spin(fused: &Fused, scene: &Scenario) {
    let path = scene.path().unwrap();
    let samples = flight(scene).imu;
    let spun = samples.iter().rev().find(|s| s.saturated && s.imu.time_s < fused.begin.unwrap().time_s).unwrap();
    let first = fused.back.first().unwrap();
    assert!((0.0..0.3).contains(&(first.state.time_s - spun.imu.time_s)), "{} s", first.state.time_s);
    assert!(fused.notes.iter().any(|n| n.contains("saturated before it")), "{:?}", fused.notes);
    for epoch in &fused.back {
        let (position_m, attitude) = true_state(&path, epoch.state.time_s);
        let error = (epoch.state.attitude.inverse() * attitude).scaled_axis();
        let sigmas = error.as_inner().component_div(&epoch.attitude_sigma_rad()).amax();
        assert!(sigmas < 4.0, "{} s: {error:?} is {sigmas} sigmas", epoch.state.time_s);
        let sigma_m = epoch.position_covariance_m2.as_inner().trace().sqrt();
        assert!((epoch.state.position_m - position_m).norm() < 4.0 * sigma_m, "{} s", epoch.state.time_s);
    }
    let sigma = |epoch: &hzn_fuse::results::Epoch| epoch.attitude_sigma_rad().norm();
    assert!(fused.back.len() > 20 && sigma(first) > sigma(fused.back.last().unwrap()));
}

/// The solution without any aid begins with that of the filter, and its covariance covers its errors, which are those
/// of the first attitude and of the gyros.
#[test]
fn the_attitude_without_aid_has_its_own_covariance() {
    let (mut nees, mut last) = (Vec::new(), 0.0);
    for seed in 1.. {
        let (scene, inputs) = drawn(seed);
        let wanted = Wanted { rate_hz: Some(1.0), ..Wanted::default() };
        let Ok(fused) = fuse(&inputs, &Settings::default(), wanted) else { continue };
        let unaided = |i: usize| fused.epochs[i].unaided.unwrap();
        let sigma = |i: usize| unaided(i).covariance_rad2.as_inner().trace().sqrt();
        assert!(unaided(0).attitude.angle_to(&fused.epochs[0].state.attitude) < 1e-9);
        assert!((sigma(0) / fused.epochs[0].attitude_covariance_rad2.as_inner().trace().sqrt() - 1.0).abs() < 1e-6);
        let path = scene.path().unwrap();
        for i in [fused.epochs.len() / 2, fused.epochs.len() - 1] {
            let (_, attitude) = true_state(&path, fused.epochs[i].state.time_s);
            let error = (unaided(i).attitude.inverse() * attitude).scaled_axis();
            let information = unaided(i).covariance_rad2.as_inner().try_inverse().unwrap();
            nees.push(error.as_inner().dot(&(information * error.as_inner())));
            assert!(sigma(i) > sigma(0));
        }
        last = sigma(fused.epochs.len() - 1).to_degrees();
        let mut table = Vec::new();
        sink::write_states(&fused, &mut table).unwrap();
        let mut table = csv::Reader::from_reader(table.as_slice());
        let header = table.headers().unwrap().clone();
        let place = |name: &str| header.iter().position(|column| column == name).unwrap();
        let row = table.records().map(Result::unwrap).filter(|row| &row[1] == "filter").last().unwrap();
        let cell = |name: &str| row[place(name)].parse::<f64>().unwrap();
        let [w, .., z] = unaided(fused.epochs.len() - 1).attitude.wxyz();
        assert_eq!([cell("unaided_qw"), cell("unaided_qz")], [w, z]);
        let variance = ["xx", "yy", "zz"].map(|axes| cell(&format!("unaided_cov_{axes}_deg2"))).iter().sum::<f64>();
        assert!((variance.sqrt() / last - 1.0).abs() < 1e-6);
        if nees.len() >= 6 {
            break;
        }
    }
    println!("NEES {nees:.2?}, sigma at the end {last:.2} deg");
    assert!(nees.iter().all(|nees| *nees < 16.0), "{nees:?}");
}

#[test]
fn written_results_are_read_back() {
    use hzn_fuse::read_back::{find_solution, is_solution, read_solution};
    use hzn_fuse::sink::{Phase, innovations, states, write_innovations, write_mcap, write_states};
    let fused = fuse(&flight(&scene(SEED)), &settings(), Wanted { smoothed: true, ..Wanted::default() }).unwrap();
    let dir = tempfile::tempdir().unwrap();
    let file = |name: &str| dir.path().join(name);
    assert_eq!(find_solution(dir.path()), None);
    let create = |name: &str| std::fs::File::create(file(name)).unwrap();
    write_states(&fused, create("nav.csv")).unwrap();
    write_innovations(&fused, create("nav.innovations.csv")).unwrap();
    assert_eq!(find_solution(dir.path()), Some(file("nav.csv")));
    write_mcap(&fused, "", &file("nav.mcap")).unwrap();
    assert_eq!(find_solution(dir.path()), Some(file("nav.mcap")));

    let [table, recording] = ["nav.csv", "nav.mcap"].map(|name| read_solution(&file(name)).unwrap());
    let count = |phase| table.states.iter().filter(|s| s.phase == phase).count();
    assert!([Phase::Back, Phase::Filter, Phase::Smoothed].into_iter().all(|phase| count(phase) > 100));
    for (read, written) in table.states.iter().zip(states(&fused)) {
        assert_eq!(
            (read.time_s, read.yaw_deg, read.sigma_z_deg),
            (written.time_s, written.yaw_deg, Some(written.sigma_z_deg))
        );
        assert_eq!(read.limb_height_sigma_km, Some(written.limb_height_sigma_km));
    }
    for (read, written) in table.innovations.iter().zip(innovations(&fused)) {
        assert_eq!((read.time_s, &*read.source, read.taken), (written.time_s, &*written.source, written.taken));
        let components = read.sigmas().collect::<Vec<_>>();
        assert_eq!(components.len(), if written.third.is_some() { 3 } else { 2 });
        assert!((components[0] - written.first / written.first_sigma).abs() < 1e-9);
    }
    // The recording has the same numbers in the order of time.
    let sorted = |mut all: Vec<hzn_fuse::read_back::State>| {
        all.sort_by(|a, b| (a.time_s, a.phase as u8).partial_cmp(&(b.time_s, b.phase as u8)).unwrap());
        all
    };
    assert_eq!(sorted(recording.states), sorted(table.states));
    assert_eq!(recording.innovations.len(), table.innovations.len());

    std::fs::write(file("other.csv"), "time_s,u,v\n").unwrap();
    assert!(!is_solution(&file("other.csv")) && !is_solution(&file("none.mcap")));
    assert!(read_solution(&file("other.csv")).unwrap_err().to_string().contains("no result of hzn fuse"));
    std::fs::write(file("nav.innovations.csv"), "time_s,source,kind,taken\n1.0,left,limb,perhaps\n").unwrap();
    let why = read_solution(&file("nav.csv")).unwrap_err().to_string();
    assert!(why.contains("nav.innovations.csv") && why.contains("line: 2"), "{why}");
}

#[test]
fn samples_that_misbehave_are_counted_and_do_no_harm() {
    let scene = scene(SEED);
    let mut inputs = flight(&scene);
    inputs.imu[3000].imu.gyro_rad_s = Vector::new(f64::NAN, 0.0, 0.0);
    inputs.imu[3100] = inputs.imu[3099];
    inputs.imu[3200].imu.time_s = 100.0;
    inputs.imu.drain(5000..5040);
    inputs.gnss[150].position_m = Vector::new(f64::INFINITY, 0.0, 0.0);
    inputs.recordings[0].seen[40].axis = Vector::new(f64::NAN, 0.0, 0.0);
    let fused = fuse(&inputs, &settings(), Wanted::default()).unwrap();
    let c = &fused.counts;
    assert_eq!((c.samples_not_finite, c.samples_duplicate, c.samples_out_of_order, c.gaps), (1, 1, 1, 1));
    let unusable: Vec<_> = c.unusable.iter().map(|((source, why), n)| (source.as_str(), *why, *n)).collect();
    let camera = format!("{}, {}", inputs.recordings[0].name, inputs.recordings[0].seen[40].body.name());
    assert_eq!(unusable, [("gnss", "a number is not finite", 1), (&camera, "a number is not finite", 1)]);
    assert!(c.saturated > 100, "the spin saturates the gyros");
    // A gap of two seconds is a rotation that nobody measured: the sigma says so.
    let sigma = |t: f64| fused.epochs.iter().find(|e| e.state.time_s > t).unwrap().attitude_sigma_rad().norm();
    assert!(sigma(252.06) > 3.0 * sigma(249.9), "{} {}", sigma(252.06), sigma(249.9));
    // Without the Sun nobody knows the third axis. It comes back, and the filter begins again.
    assert_eq!(fused.counts.restarts, 1, "{:?}", fused.notes);
    assert!(misses(&fused, &scene).iter().all(|m| m.nees < 25.0));
    assert!(worst_deg(&fused, &scene, 370.0) < 2.5);
}

#[test]
fn outages_and_jumps_of_the_receiver_are_bridged_and_refused() {
    let mut scene = scene(SEED);
    let gnss = scene.gnss.as_mut().unwrap();
    gnss.outages_s = vec![[200.0, 230.0]];
    gnss.jumps_s = vec![[300.0, 305.0]];
    let fused = fuse(&flight(&scene), &settings(), Wanted::default()).unwrap();
    let refused: Vec<f64> =
        fused.innovations.iter().filter(|i| i.kind == Kind::Position && !i.taken).map(|i| i.time_s).collect();
    assert_eq!(refused, [300.0, 301.0, 302.0, 303.0, 304.0, 305.0]);
    let worst = misses(&fused, &scene).iter().map(|m| m.position_m.norm()).fold(0.0, f64::max);
    assert!(worst < 400.0, "{worst} m");
}

/// One limb in 25 is 52 degrees wrong and claims 0.2 degrees.
fn with_false_limbs(inputs: &mut Inputs) -> usize {
    let mut count = 0;
    for recording in &mut inputs.recordings {
        for seen in recording.seen.iter_mut().filter(|s| s.body == Body::Limb).step_by(25) {
            let across = seen.axis.cross(&Vector::new(0.0, 0.0, 1.0)).normalize();
            seen.axis = Rotation::from_scaled_axis(across * 52f64.to_radians()) * seen.axis;
            count += 1;
        }
    }
    count
}

#[test]
fn confident_false_answers_are_refused() {
    let scene = scene(SEED);
    let mut inputs = flight(&scene);
    let count = with_false_limbs(&mut inputs);
    let fused = fuse(&inputs, &settings(), Wanted::default()).unwrap();
    let refused = fused.innovations.iter().filter(|i| !i.taken && i.kind == Kind::Direction(Body::Limb)).count();
    assert!(count > 10 && refused + 6 >= count, "{refused} of {count}");
    assert!(worst_deg(&fused, &scene, 150.0) < 1.5);
}

#[test]
fn a_lost_filter_begins_again() {
    let scene = scene(SEED);
    let mut inputs = flight(&scene);
    // A star tracker that is 40 degrees wrong, and says 0.1 degrees.
    let (_, truth) = true_state(&scene.path().unwrap(), 130.0);
    let wrong = truth * Rotation::from_scaled_axis(Vector::new(40f64.to_radians(), 0.0, 0.0));
    inputs.attitudes = vec![Attitude { time_s: 70.0, fixed_from_vehicle: Some(wrong), sigma_rad: 0.1f64.to_radians() }];
    let fused = fuse(&inputs, &settings(), Wanted::default()).unwrap();
    assert_eq!((fused.begin.unwrap().directions, fused.counts.restarts), (0, 1), "{:?}", fused.notes);
    assert!(fused.notes.iter().any(|n| n.contains("began again")), "{:?}", fused.notes);
    assert!(worst_deg(&fused, &scene, 250.0) < 1.5);
}

/// The first Suns are false, at the right angle from the limb: the filter begins with a wrong third axis, and all limbs
/// agree with it. The right Suns show that it is wrong.
#[test]
fn a_false_first_sun_is_found_out() {
    let scene = scene(SEED);
    let mut inputs = flight(&scene);
    let path = scene.path().unwrap();
    for (one, recording) in scene.by_camera().iter().zip(&mut inputs.recordings) {
        let mount = true_mount(one);
        for seen in recording.seen.iter_mut().filter(|s| s.body == Body::Sun && s.time_s < 118.0) {
            let (position_m, attitude) = true_state(&path, seen.time_s);
            let nadir = (attitude * mount).inverse() * -position_m.normalize();
            seen.axis = Rotation::from_scaled_axis(nadir * 0.7) * seen.axis;
        }
    }
    let fused = fuse(&inputs, &settings(), Wanted::default()).unwrap();
    assert!(fused.begin.unwrap().time_s < 118.0 && fused.counts.restarts >= 1, "{:?}", fused.notes);
    assert!(worst_deg(&fused, &scene, 150.0) < 3.0);
}

#[test]
fn inputs_that_contradict_each_other_are_refused_in_words() {
    let scene = scene(SEED);
    let good = flight(&scene);
    let error = |change: &dyn Fn(&mut Inputs)| {
        let mut inputs = good.clone();
        change(&mut inputs);
        fuse(&inputs, &settings(), Wanted::default()).unwrap_err().to_string()
    };
    let same = error(&|i| i.recordings[1].mount = i.recordings[0].mount);
    assert!(same.contains("left and right have the same mount") && same.contains("--mount right=FILE"), "{same}");
    let none = error(&|i| i.recordings[1].mount = None);
    assert!(none.contains("right: nobody says how the camera is mounted"), "{none}");
    let epoch = error(&|i| i.recordings[0].seen.iter_mut().for_each(|s| s.time_s += 1.56e9));
    assert!(epoch.contains("left: its times 1560000") && epoch.contains("--clock left=SECONDS"), "{epoch}");
    let dark = error(&|i| i.recordings.iter_mut().for_each(|r| r.seen.retain(|s| s.body == Body::Limb)));
    assert!(dark.contains("only limb") && dark.contains("--attitude FILE"), "{dark}");
    let twice = error(&|i| i.recordings[1].seen = i.recordings[0].seen.clone());
    assert!(twice.contains("left and right have the same rows"), "{twice}");
    let unknown = error(&|i| {
        let sights = i.recordings.iter_mut().flat_map(|r| &mut r.seen);
        sights.filter(|s| s.body == Body::Sun).for_each(|s| s.reference = None);
    });
    assert!(unknown.contains("only limb. Not used are") && unknown.contains("the first to the sun"), "{unknown}");
    let name = error(&|i| i.recordings[1].name = "left".into());
    assert!(name.contains("two recordings have this name"), "{name}");
    // The told offset of a clock puts them together again.
    let mut moved = good.clone();
    moved.recordings[0].seen.iter_mut().for_each(|s| s.time_s += 1.56e9);
    moved.recordings[0].clock_offset_s = -1.56e9;
    assert!(fuse(&moved, &settings(), Wanted::default()).is_ok());
}

/// A mount that looks the other way: the gates refuse the camera, and a note says which one.
#[test]
fn a_wrong_mount_is_named() {
    let scene = scene(SEED);
    let mut inputs = flight(&scene);
    let turned = Rotation::from_scaled_axis(Vector::new(0.0, 3.0, 0.0));
    inputs.recordings[0].mount = inputs.recordings[0].mount.map(|m| m * turned);
    let fused = fuse(&inputs, &settings(), Wanted::default()).unwrap();
    assert!(
        fused.verdict.likeliest().is_some_and(|f| f.source == Source::Camera("left".into())),
        "{:?}",
        fused.verdict
    );
    assert!(worst_deg(&fused, &scene, 250.0) < 3.0);
}

/// GPS time instead of UTC: the positions belong to another time.
#[test]
fn wrong_leap_seconds_are_seen() {
    let scene = scene(SEED);
    let mut inputs = flight(&scene);
    inputs.gnss.iter_mut().for_each(|fix| fix.time_s += 18.0);
    let fused = fuse(&inputs, &settings(), Wanted::default()).unwrap();
    let off = misses(&fused, &scene).iter().map(|m| m.position_m.norm()).fold(0.0, f64::max);
    // The positions agree with each other, so that nothing but the directions could contradict them.
    assert!(off > 1000.0 || !fused.notes.is_empty(), "{off}");
}

/// The position of the Earth's centre from the limb replaces the axis, and aids the attitude as before. The receiver
/// fails for 280 s.
#[test]
fn positions_from_the_limb_are_taken_where_they_are_asked_for() {
    let mut scene = scene(SEED);
    scene.gnss.as_mut().unwrap().outages_s = vec![[150.0, 430.0]];
    let mut inputs = flight(&scene);
    let path = scene.path().unwrap();
    let mut draws = crate::common::Draws(11);
    for (one, recording) in scene.by_camera().iter().zip(&mut inputs.recordings) {
        let mount = true_mount(one);
        let late_s = one.clock.offset_s + one.clock.latency_s;
        for seen in recording.seen.iter_mut().filter(|s| s.body == Body::Limb) {
            let (position_m, attitude) = true_state(&path, seen.time_s - late_s);
            let centre = (attitude * mount).inverse() * -position_m;
            let noise = core::array::from_fn(|_| 300.0 * draws.normal()).into();
            let covariance_m2 = Covariance::isotropic(300f64.powi(2));
            seen.centre = Some(Centre { position_m: centre + noise, covariance_m2 });
        }
    }
    let mut settings = settings();
    settings.camera.limb = Limb::Position;
    let fused = fuse(&inputs, &settings, Wanted::default()).unwrap();
    let taken = fused.innovations.iter().filter(|i| i.kind == Kind::Centre && i.taken).count();
    assert!(taken > 200, "{taken}");
    // A picture gives its axis or its position, not both.
    assert!(fused.innovations.iter().all(|i| i.kind != Kind::Direction(Body::Limb)));
    let nis = fused.innovations.iter().filter(|i| i.kind == Kind::Centre).map(|i| i.nis).sum::<f64>();
    assert!(nis / (taken as f64) < 4.0, "{}", nis / taken as f64);
    settings.camera.limb = Limb::Axis;
    let axes = fuse(&inputs, &settings, Wanted::default()).unwrap();
    assert!(axes.innovations.iter().all(|i| i.kind != Kind::Centre));
    let last = misses(&fused, &scene).last().unwrap().position_m.norm();
    assert!(last < 300.0, "{last} m");
    assert!(worst_deg(&fused, &scene, 300.0) < 2.0);
}
