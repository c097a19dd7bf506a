//! What the joint answers of a rig say: the covariance, and the altitude.

use hzn_core::frames::Cov3;
use nalgebra::Matrix3;

use crate::common::{Place, cell};
use crate::rig_scene::{ring, ring_of, run};

fn number(row: &[(String, String)], name: &str) -> f64 {
    cell(row, name).parse().unwrap_or_else(|_| panic!("{name}: {:?}", cell(row, name)))
}

/// Returns the covariance in the columns with this name.
fn covariance(row: &[(String, String)], name: &str) -> Matrix3<f64> {
    let upper = ["xx", "xy", "xz", "yy", "yz", "zz"].map(|end| number(row, &format!("{name}_{end}")));
    let rows = Cov3::<hzn_core::frames::Vehicle, f64>::from_upper(upper).rows();
    Matrix3::from_fn(|i, j| rows[i][j])
}

#[test]
fn joint_answers_tell_a_filter_what_the_next_epoch_shares() {
    let (joint, heads) = run(&ring(), &[], 0);
    for row in &joint {
        let (whole, common) = (covariance(row, "cov"), covariance(row, "cov_common"));
        // The tilt and the weather of the limb are most of the error, and the noise is a part of it.
        assert!(common.trace() > 0.5 * whole.trace(), "{whole} {common}");
        let rest = (whole - common).symmetric_eigenvalues();
        assert!(rest.max() > 0.0 && rest.min() > -1e-9 * whole.trace(), "{rest}");
    }
    // A head alone shares its limb height with the next picture, which is far more.
    for row in &heads {
        assert!(covariance(row, "cov_common").trace() > covariance(&joint[0], "cov_common").trace());
    }
}

/// Takes columns from the table of the vehicle.
fn forget(place: &Place, columns: &[&str]) {
    let table = place.read("ring/frames.csv");
    let mut lines = table.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let names = lines.next().unwrap();
    let keep: Vec<bool> = names.iter().map(|name| !columns.contains(name)).collect();
    let kept = |line: Vec<&str>| {
        let cells: Vec<&str> = line.iter().zip(&keep).filter_map(|(cell, keep)| keep.then_some(*cell)).collect();
        cells.join(",") + "\n"
    };
    let forgotten: String = std::iter::once(names.clone()).chain(lines).map(kept).collect();
    place.write("ring/frames.csv", forgotten.as_bytes());
}

/// Takes the altitude from the vehicle, and tells its heads limits instead, if there are any.
fn forget_altitude(place: &Place, limits_km: Option<[f64; 2]>) {
    forget(place, &["altitude_km", "x_km", "y_km", "z_km"]);
    for head in ["front", "right", "back", "left"] {
        let file = format!("ring/{head}/sensor.toml");
        let mut sensor = place.read(&file);
        assert!(!sensor.contains("altitude_km ="), "{sensor}");
        if let Some(km) = limits_km {
            assert!(!sensor.contains("[gates]"), "{sensor}");
            sensor += &format!("[gates]\naltitude_limits_km = {km:?}\n");
        }
        place.write(&file, sensor.as_bytes());
    }
}

/// Returns the RMS error of the joint answers, degrees.
fn rms_deg(place: &Place) -> f64 {
    place.run(&["run", "ring/rig.toml", "-o", "out.csv", "-q", "--force"]).expect(0);
    place.run(&["evaluate", "out.csv", "--truth", "ring", "-o", "r.json", "--force"]).expect(0);
    let json: serde_json::Value = serde_json::from_str(&place.read("r.json")).unwrap();
    assert_eq!(json["evaluations"][0]["answered"], 4);
    json["evaluations"][0]["errors"]["rms_deg"].as_f64().unwrap()
}

#[test]
fn a_rig_finds_limb_and_altitude_between_two_altitudes() {
    let place = ring();
    // Without a position, the change of the limb height with the latitude is not known, which is a tilt.
    forget(&place, &["x_km", "y_km", "z_km"]);
    let told_deg = rms_deg(&place);
    // The scene flies at 490 to 510 km.
    forget_altitude(&place, Some([400.0, 700.0]));
    let deg = rms_deg(&place);
    assert!(deg < 1.01 * told_deg && told_deg < 0.03, "{deg} {told_deg}");
    let (joint, heads) = run(&place, &[], 0);
    for row in joint.iter().chain(&heads) {
        assert_eq!((cell(row, "status"), cell(row, "altitude_km")), ("ok", ""), "{row:?}");
    }
    for row in &joint {
        let (km, sigma_km) = (number(row, "altitude_est_km"), number(row, "altitude_est_sigma_km"));
        assert!((km - 500.0).abs() < 10.0 + 3.0 * sigma_km && sigma_km < 10.0, "{km} {sigma_km}");
        // Without an altitude, the half-angle says nothing of the limb height.
        assert_eq!((cell(row, "limb_height_est_km"), cell(row, "heads_used")), ("", "front right back left"));
    }
    let explained = place.run(&["explain", "ring/rig.toml", "--index", "2"]).expect(0).out;
    assert!(explained.contains("(no altitude is known: searched from 400 to 700 km, [gates]"), "{explained}");
    // Limits without the true altitude have no limb.
    forget_altitude(&place, None);
    for head in ["front", "right", "back", "left"] {
        let file = format!("ring/{head}/sensor.toml");
        place.write(&file, place.read(&file).replace("[400.0, 700.0]", "[3000.0, 4000.0]").as_bytes());
    }
    let (joint, heads) = run(&place, &[], 0);
    assert!(joint.iter().chain(&heads).all(|row| cell(row, "status") != "ok"));
    assert!(joint.iter().all(|row| cell(row, "status") != "no-altitude"));
}

#[test]
fn without_altitude_and_limits_the_keys_are_named() {
    let place = ring();
    forget_altitude(&place, None);
    place
        .run(&["run", "ring/rig.toml", "-o", "r.csv"])
        .expect(2)
        .says("head front: no altitude: set altitude_km in [body] of sensor.toml")
        .says("set altitude_limits_km = [LOWEST, HIGHEST] in [gates]: the limb is searched between them");
    // Below all limbs there is none.
    forget_altitude(&place, Some([5.0, 9.0]));
    place.run(&["run", "ring/rig.toml", "-o", "r.csv"]).expect(2).says("gates.altitude_limits_km: altitude");
    // If a part of the rows has an altitude, the others are not refused, and the rig has no such status.
    forget_altitude(&place, None);
    for head in ["front", "right", "back", "left"] {
        let file = format!("ring/{head}/sensor.toml");
        let sensor = place.read(&file);
        place.write(&file, &sensor.as_bytes()[..sensor.find("[gates]").unwrap()]);
    }
    let table = place.read("ring/frames.csv");
    let with = |(i, line): (usize, &str)| format!("{line},{}\n", ["altitude_km", "500", "", "", ""][i]);
    place.write("ring/frames.csv", table.lines().enumerate().map(with).collect::<String>().as_bytes());
    let (joint, heads) = run(&place, &[], 3);
    let statuses: Vec<&str> = joint.iter().map(|row| cell(row, "status")).collect();
    assert_eq!(statuses, ["ok", "no-limb", "no-limb", "no-limb"]);
    assert!(cell(&joint[1], "detail").contains("set gates.altitude_limits_km in their sensor.toml"), "{joint:?}");
    assert_eq!(heads.iter().filter(|row| cell(row, "status") == "no-altitude").count(), 12);
}

/// Names the limb of every second head.
fn name_limbs(place: &Place) {
    let mut rig = place.read("ring/rig.toml");
    for head in ["right", "left"] {
        let pictures = format!("pictures = \"{head}\"\n");
        assert!(rig.contains(&pictures), "{rig}");
        rig = rig.replace(&pictures, &format!("{pictures}limb_group = \"carbon-dioxide\"\n"));
    }
    place.write("ring/rig.toml", rig.as_bytes());
}

#[test]
fn heads_of_two_bands_share_only_the_direction() {
    let place = ring();
    // The limb of the right and the left head is 20 km higher, as in another band. Each sensor knows its own limb.
    let other = ring_of(|scene| scene.replace("[world.infrared]\n", "[world.infrared]\nhalf_level_km = 45.0\n"));
    for head in ["right", "left"] {
        for entry in std::fs::read_dir(other.path(&format!("ring/{head}"))).unwrap() {
            let name = entry.unwrap().file_name().into_string().unwrap();
            let file = format!("ring/{head}/{name}");
            std::fs::copy(other.path(&file), place.path(&file)).unwrap();
        }
    }
    let (joint, _) = run(&place, &[], 0);
    let agree =
        joint.iter().filter(|row| cell(row, "status") == "ok" && cell(row, "heads_excluded").is_empty()).count();
    assert_eq!((joint.len(), agree), (4, 0));
    name_limbs(&place);
    let deg = rms_deg(&place);
    assert!(deg < 0.03, "{deg}");
    let (joint, _) = run(&place, &[], 0);
    for row in &joint {
        assert_eq!((cell(row, "status"), cell(row, "heads_used")), ("ok", "front right back left"), "{row:?}");
        assert!(number(row, "separation_deg") < number(row, "separation_limit_deg"));
        // The height is that of the first head's band.
        assert!((number(row, "limb_height_est_km") - 25.0).abs() < 8.0, "{row:?}");
    }
}

#[test]
fn heads_that_should_see_the_limb_and_do_not_are_evidence_against_it() {
    let place = ring();
    let (joint, heads) = run(&place, &[], 0);
    for row in &joint {
        let own = heads.iter().filter(|head| cell(head, "index") == cell(row, "index"));
        let most = own.map(|head| number(head, "p_limb")).fold(0.0, f64::max);
        assert_eq!(number(row, "p_limb"), most, "all heads have an answer");
    }
    // Two heads see a bright ground without a limb.
    for head in ["right", "left"] {
        for i in 0..4_u32 {
            let brightness = |x: u32, y: u32| image::Luma([(120 + (x * 7 + y * 13 + i) % 11) as u8]);
            let name = std::fs::read_dir(place.path(&format!("ring/{head}"))).unwrap();
            let mut names: Vec<_> = name.map(|entry| entry.unwrap().path()).collect();
            names.retain(|path| path.extension().is_some_and(|ending| ending == "png"));
            names.sort();
            image::GrayImage::from_fn(320, 240, brightness).save(&names[i as usize]).unwrap();
        }
    }
    for left in doubts(&place) {
        assert!((left - 0.01).abs() < 1e-4, "{left}");
    }
    // A visible head may look at the night, as long as nobody knows the Sun.
    forget(&place, &["utc"]);
    let sensor = place.read("ring/right/sensor.toml");
    place.write("ring/right/sensor.toml", sensor.replace("sunlit = false", "sunlit = true").as_bytes());
    for left in doubts(&place) {
        assert!((left - 0.1).abs() < 1e-3, "{left}");
    }
}

/// Returns what the heads without an answer leave of the odds of the front and the back head.
fn doubts(place: &Place) -> Vec<f64> {
    let (joint, heads) = run(place, &[], 0);
    let odds = |p: f64| p / (1.0 - p);
    let left = |row: &Vec<(String, String)>| {
        assert_eq!((cell(row, "status"), cell(row, "heads_used")), ("ok", "front back"), "{row:?}");
        let own = heads.iter().filter(|head| cell(head, "index") == cell(row, "index") && cell(head, "status") == "ok");
        let most = own.map(|head| number(head, "p_limb")).fold(0.0, f64::max);
        odds(number(row, "p_limb")) / odds(most)
    };
    joint.iter().map(left).collect()
}
