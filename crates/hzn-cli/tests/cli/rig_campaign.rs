//! What a rig says of itself, counted over many simulated flights of the scene `ring`: the coarse direction from any
//! attitude, and the mounts that `hzn calibrate rig` finds. `cargo xtask campaign rig` sets the numbers.

use hzn_files::rig::{load, turn_after};
use nalgebra::{Matrix3, Vector3};

use crate::campaign::number;
use crate::common::{Place, angle_deg, cell, rows};

const HEADS: [&str; 4] = ["front", "right", "back", "left"];
/// Attitudes of a flight.
const ATTITUDES: u64 = 50;
/// Epochs of a flight that is calibrated on.
const EPOCHS: &str = "24";
/// 1-sigma of the error of the told mounts about each axis, radians.
const TOLD_RAD: f64 = 0.004;
/// The first seeds. Neither the coarse direction nor the calibration was made on them.
const SEED: u64 = 530_000;

/// Writes the scene `ring` with pictures of 160×120 pixels, changed by `change`.
fn scene(place: &Place, change: impl Fn(String) -> String) {
    let scene = place.run(&["simulate", "ring", "--show"]).expect(0).out;
    let scene = scene.replace("width = 640\nheight = 480", "width = 160\nheight = 120").replace("554.0", "138.5");
    place.write("ring.toml", change(scene.replace("319.5", "79.5").replace("239.5", "59.5")).as_bytes());
}

fn simulate(place: &Place, flight: u64, frames: &str) {
    let seed = (SEED + flight).to_string();
    let args =
        ["simulate", "ring.toml", "-o", "ring", "--frames", frames, "--seed", &seed, "--no-noise", "-q", "--force"];
    place.run(&args).expect(0);
}

/// Runs the rig and returns the error of each coarse direction and its sigma, degrees, and the number of epochs without
/// a coarse direction and with an answer.
fn coarse(place: &Place) -> (Vec<[f64; 2]>, usize, usize) {
    let truth = rows(&place.read("ring/truth.csv"));
    let out = place.run(&["run", "ring/rig.toml", "-q"]).expect(0).out;
    let (mut found, mut none, mut answered) = (Vec::new(), 0, 0);
    for row in rows(&out).iter().filter(|row| cell(row, "head") == "rig") {
        let number = |row: &[(String, String)], name: &str| cell(row, name).parse::<f64>().unwrap();
        let file = cell(row, "file");
        let truth = truth.iter().find(|truth| cell(truth, "file") == file).unwrap();
        if cell(row, "status") == "ok" {
            answered += 1;
        } else if cell(row, "coarse_x").is_empty() {
            none += 1;
        } else {
            let axis = ["coarse_x", "coarse_y", "coarse_z"].map(|name| number(row, name));
            let true_axis = ["axis_x", "axis_y", "axis_z"].map(|name| number(truth, name));
            found.push([angle_deg(axis, true_axis), number(row, "coarse_sigma_deg")]);
        }
    }
    (found, none, answered)
}

fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut sorted: Vec<f64> = values.collect();
    sorted.sort_by(f64::total_cmp);
    sorted.get(sorted.len() / 2).copied().unwrap_or(f64::NAN)
}

/// The vehicle tumbles so that one attitude says nothing about the next one, and each flight begins with a random one.
#[test]
fn the_coarse_direction_from_any_attitude() {
    let attitudes = number("HZN_ATTITUDES", ATTITUDES);
    let place = Place::new();
    scene(&place, |scene| {
        let (start, rest) = scene.split_once("[attitude.pointing]").unwrap();
        let (_, end) = rest.split_once("[world.infrared]").unwrap();
        let turns = "[attitude.tumble]\nrates_deg_s = [0.31, -0.47, 0.23]\n\n[world.infrared]";
        // Without the attitude, as a vehicle that has lost it.
        format!("{start}{turns}{end}").replace("attitude_sigma_deg = 5.0\n", "")
    });
    // As the sensors are; and with sensors that refuse each limb, so that every attitude has only a coarse direction.
    let (mut as_they_are, mut refused) = ((Vec::new(), 0, 0), (Vec::new(), 0, 0));
    let add = |sum: &mut (Vec<[f64; 2]>, usize, usize), one: (Vec<[f64; 2]>, usize, usize)| {
        sum.0.extend(one.0);
        (sum.1, sum.2) = (sum.1 + one.1, sum.2 + one.2);
    };
    for flight in 0..attitudes.div_ceil(ATTITUDES) {
        simulate(&place, flight, &ATTITUDES.to_string());
        add(&mut as_they_are, coarse(&place));
        for head in HEADS {
            let name = format!("ring/{head}/sensor.toml");
            place.write(&name, format!("{}\n[gates]\nmin_inliers = 65535\n", place.read(&name)).as_bytes());
        }
        add(&mut refused, coarse(&place));
    }
    for (which, (found, none, answered)) in [("as they are", as_they_are), ("limbs refused", refused)] {
        let within = found.iter().filter(|[error, sigma]| *error <= 3.0 * sigma).count();
        let [error, sigma] = [0, 1].map(|i| median(found.iter().map(|one| one[i])));
        let worst = found.iter().map(|[error, _]| *error).fold(0.0, f64::max);
        println!(
            "{which}: {answered} epochs with an answer, {none} without a coarse direction, {} with one: {within} \
             within 3 sigma, median error {error:.1}, largest {worst:.1}, median sigma {sigma:.1} degrees",
            found.len()
        );
        assert!(within * 100 >= found.len() * 99, "{which}: {within} of {} within 3 sigma", found.len());
        assert!(found.is_empty() || error <= 20.0, "{which}: median error {error} degrees");
        assert!(which == "as they are" || (answered == 0 && !found.is_empty()), "{answered} answers");
    }
}

/// The told mounts have errors, and the ones that are found are compared with those of the simulation.
#[test]
fn calibrated_mounts_and_their_covariances() {
    let flights = number("HZN_RIG_FLIGHTS", 1);
    let place = Place::new();
    scene(&place, |scene| scene.replace("[66.0, 70.0]", "[48.0, 88.0]").replace("[-3.0, 3.0]", "[-20.0, 20.0]"));
    let (mut within, mut all, mut nees, mut errors, mut sigmas) = (0, 0, 0.0, Vec::new(), Vec::new());
    let mut told_deg = Vec::new();
    for flight in 0..flights {
        simulate(&place, flight, EPOCHS);
        let rig = place.path("ring/rig.toml");
        let good = load(&rig).unwrap();
        let mut draws = Normal(SEED + flight);
        let mut text = place.read("ring/rig.toml");
        for head in &good.heads {
            let q = head.mount.as_ref().unwrap().q_rig_from_camera_wxyz;
            let turn = Vector3::from_fn(|_, _| 0.5 * TOLD_RAD * draws.next());
            let w = (1.0 - turn.norm_squared()).sqrt();
            let wrong = turn_after([w, turn.x, turn.y, turn.z], q);
            let list = |q: [f64; 4]| q.map(|x| format!("{x:?}")).join(", ");
            assert!(text.contains(&list(q)), "{text}");
            text = text.replace(&list(q), &list(wrong));
        }
        place.write("ring/told.toml", text.as_bytes());
        place.run(&["calibrate", "rig", "ring/told.toml", "-o", "ring/found.toml", "-q", "--force"]).expect(0);
        let [told, found] = ["told", "found"].map(|name| load(&place.path(&format!("ring/{name}.toml"))).unwrap());
        for k in 1..HEADS.len() {
            let (error, covariance) = relative_error(&good, &found, k);
            told_deg.push(relative_error(&good, &told, k).0.norm().to_degrees());
            errors.push(error.norm().to_degrees());
            nees += error.dot(&(covariance.try_inverse().unwrap() * error));
            for i in 0..3 {
                let sigma_rad = covariance[(i, i)].sqrt();
                sigmas.push(sigma_rad.to_degrees());
                all += 1;
                within += u32::from(error[i].abs() <= 3.0 * sigma_rad);
            }
        }
    }
    let pairs = errors.len() as f64;
    println!(
        "calibrate rig: {flights} flights of {EPOCHS} epochs, {pairs} relative mounts: {within} of {all} components \
         within 3 sigma, NEES {:.2} (3 is ideal), median error {:.3}, before {:.3}, median sigma {:.3} degrees \
         a component",
        nees / pairs,
        median(errors.into_iter()),
        median(told_deg.into_iter()),
        median(sigmas.into_iter())
    );
    assert!(within * 100 >= all * 99, "{within} of {all} within 3 sigma");
}

/// Returns the error of the mount of head `k` relative to the first, as a turn about the axes of the rig, and its
/// covariance from the blocks of the file, rad².
fn relative_error(good: &hzn_files::rig::Rig, found: &hzn_files::rig::Rig, k: usize) -> (Vector3<f64>, Matrix3<f64>) {
    let turn = |k: usize| {
        let q = |rig: &hzn_files::rig::Rig| rig.heads[k].mount.as_ref().unwrap().q_rig_from_camera_wxyz;
        let [w, x, y, z] = q(good);
        let [s, x, y, z] = turn_after(q(found), [w, -x, -y, -z]);
        Vector3::new(x, y, z) * 2.0 * s.signum()
    };
    let block = |k: usize| {
        let [xx, xy, xz, yy, yz, zz] = found.heads[k].mount.as_ref().unwrap().covariance_rad2();
        Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz)
    };
    (turn(k) - turn(0), block(k) + block(0))
}

/// Normally distributed numbers, by Box and Muller.
struct Normal(u64);

impl Normal {
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 11) as f64 + 0.5) / (1u64 << 53) as f64
    }

    fn next(&mut self) -> f64 {
        let (a, b) = (self.uniform(), self.uniform());
        (-2.0 * a.ln()).sqrt() * (core::f64::consts::TAU * b).cos()
    }
}
