//! Directions of other sensors: a magnetometer instead of the Sun.

use crate::common::Draws;
use crate::solve::{at_time, drawn, own, solved};
use hzn_fuse::finding::{Level, Source};
use hzn_fuse::fuse;
use hzn_fuse::input::{Body, Inputs, Map, directions};
use hzn_fuse::results::Kind;
use hzn_nav::frames::{Fixed, Rotation, Vector, Vehicle};
use hzn_sim::Scenario;

/// Writes the table of a magnetometer in nanotesla, with the field of a dipole as reference. Its mount is 1° off about
/// each axis (1-sigma), and its noise is 0.5°. `sign` is that of its first axis.
fn table(scene: &Scenario, seed: u64, sign: f64) -> String {
    let (path, mut draws) = (scene.path().unwrap(), Draws(seed ^ 0x3a6));
    let mut turn = |sigma_deg: f64| -> Rotation<Vehicle, Vehicle> {
        Rotation::from_scaled_axis(Vector::from([0, 1, 2].map(|_| sigma_deg.to_radians() * draws.normal())))
    };
    let mount = turn(1.0);
    let mut out = String::from("t_ms,bx,by,bz,ref_x,ref_y,ref_z,sigma_deg\n");
    for second in 0..420 {
        let state = path.state(f64::from(second));
        let up: Vector<Fixed> = Vector::from(state.position_m).normalize();
        let pole = Vector::new(0.049, -0.142, 0.988).normalize();
        let field = (up * (-3.0 * up.dot(&pole)) + pole) * -2.6e4;
        let to_vehicle: Rotation<Fixed, Vehicle> = Rotation::from(state.fixed_from_vehicle).inverse();
        let [x, y, z] = (turn(0.5) * mount * (to_vehicle * field)).xyz();
        let [a, b, c] = field.xyz();
        out += &format!("{},{},{y},{z},{a},{b},{c},0.5\n", 1000 * second, sign * x);
    }
    out
}

/// A flight that sees the limb alone, with a magnetometer.
fn flight(seed: u64, sign: f64) -> (Scenario, Inputs) {
    let (scene, mut inputs) = drawn(seed);
    inputs.recordings.iter_mut().for_each(|one| one.seen.retain(|seen| seen.body == Body::Limb));
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("magnetometer.csv");
    std::fs::write(&file, table(&scene, seed, sign)).unwrap();
    let map = Map::parse(["direction:time=t_ms,ms", "direction:measured=bx:by:bz"]).unwrap();
    inputs.recordings.push(directions(&file, &map).unwrap());
    (scene, inputs)
}

#[test]
fn a_magnetometer_replaces_the_sun() {
    let mut nees = [Vec::new(), Vec::new()];
    for seed in 92_000..92_003 {
        let (scene, inputs) = flight(seed, 1.0);
        let fused = fuse(&inputs, &own(), solved()).unwrap();
        assert!(fused.begin.unwrap().directions >= 2);
        let all = fused.innovations.iter().filter(|i| i.kind == Kind::Direction(Body::Other));
        let (taken, all) = (all.clone().filter(|i| i.taken).count(), all.count());
        assert!(all > 300 && taken * 100 > all * 98, "{taken} of {all}");
        assert!(fused.verdict.level() < Level::Contradicts, "{:?}", fused.verdict.findings);
        for (nees, epochs) in nees.iter_mut().zip([&fused.epochs, &fused.smoothed]) {
            let (error, sigma, one) = at_time(epochs, &scene, 300.0).unwrap();
            println!("{seed}: {error:.3?} deg, sigma {sigma:.3?}, NEES {one:.2}");
            nees.push(one);
            assert!(sigma.iter().all(|sigma| *sigma < 2.0), "{sigma:?}");
        }
        let determined = &fused.solved.unwrap().determined;
        assert!(determined.iter().any(|one| one.name == "mount of magnetometer"));
    }
    assert!(nees.iter().flatten().all(|nees| *nees < 14.0), "{nees:?}");
}

#[test]
fn a_mirrored_axis_contradicts() {
    let (_, inputs) = flight(92_010, -1.0);
    match fuse(&inputs, &own(), solved()) {
        Ok(fused) => {
            println!("{:?}", fused.verdict.findings);
            assert_eq!(fused.verdict.level(), Level::Contradicts);
            let is_named = |f: &hzn_fuse::finding::Finding| f.source == Source::Camera("magnetometer".into());
            assert!(fused.verdict.findings.iter().any(is_named), "{:?}", fused.verdict.findings);
        }
        Err(refused) => assert!(refused.to_string().contains("contradict"), "{refused}"),
    }
}

#[test]
fn a_table_of_directions_is_checked() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("sun.csv");
    let read = |text: &str| {
        std::fs::write(&file, text).unwrap();
        directions(&file, &Map::default())
    };
    let head = "time_s,x,y,z,ref_x,ref_y,ref_z,sigma_deg\n";
    let one =
        read(&format!("{head}0,1,0,0,0,3,0,1\n1,0,0,0,0,3,0,1\n2,1,0,0,0,,0,1\n3,1,0,0,0,3,0,\n0,1,0,0,0,3,0,1\n"))
            .unwrap();
    assert_eq!((one.seen.len(), one.incomplete, one.duplicate), (1, 3, 1));
    assert_eq!(one.seen[0].reference.unwrap().xyz(), [0.0, 1.0, 0.0]);
    let told = |text: &str| read(text).unwrap_err().to_string();
    let noisy = told("time_s,x,y,z,ref_x,ref_y,ref_z,sigma_deg,noise_deg\n0,1,0,0,0,3,0,1,2\n");
    assert!(noisy.contains("sun.csv:2: noise_deg is 2: it is a part of sigma_deg, 1"), "{noisy}");
    assert!(told(&format!("{head}0,1,0,0,0,3,0,0\n")).contains("sun.csv:2: sigma_deg is 0: must be above 0"));
    let missing = told("time_s,x,y,z,sigma_deg\n0,1,0,0,1\n");
    assert!(
        missing.contains("the column ref_x is missing") && missing.contains("--map direction:ref_x=COLUMN"),
        "{missing}"
    );
}
