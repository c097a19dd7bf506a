//! `hzn fuse` on tables that others wrote.

use std::path::Path;

use crate::fuse::{MOUNTS, bare, flight, told_errors};

/// Writes the tables of a flight as others would: other names and units, latitudes, and NMEA.
fn foreign_tables(at: &Path) {
    let read = |name: &str| std::fs::read_to_string(at.join(name)).unwrap();
    let cells = |line: &str| line.split(',').map(|cell| cell.parse::<f64>().unwrap_or(f64::NAN)).collect::<Vec<_>>();
    let mut log = String::from("t_us,wx,wy,wz,ax,ay,az\n");
    for row in read("imu.csv").lines().skip(1).map(cells) {
        let [rates, forces] =
            [[row[1], row[2], row[3]].map(f64::to_degrees), [row[4], row[5], row[6]].map(|a| a / 9.80665)];
        let all: Vec<String> = rates.iter().chain(&forces).map(|x| format!("{x:.15e}")).collect();
        log += &format!("{:.3},{}\n", row[0] * 1e6, all.join(","));
    }
    std::fs::write(at.join("log.csv"), log).unwrap();
    let (a, b) = (hzn_core::ellipsoid::WGS84_A_M, hzn_core::ellipsoid::WGS84_B_M);
    let (mut table, mut nmea) = (String::from("time_s,lat_deg,lon_deg,height_m\n"), String::new());
    for row in read("gnss.csv").lines().skip(1).map(cells) {
        let (height, lat) = hzn_core::ellipsoid::geodetic([row[1], row[2], row[3]], a, b);
        let (lat, lon) = (lat.to_degrees(), row[2].atan2(row[1]).to_degrees());
        table += &format!("{},{lat:.12},{lon:.12},{height:.6}\n", row[0]);
        // 04:00:00 is time 0.
        let second = 4.0 * 3600.0 + row[0];
        let (hour, minute) = ((second / 3600.0).floor(), (second / 60.0).floor() % 60.0);
        let angle = |deg: f64| deg.trunc() * 100.0 + deg.fract() * 60.0;
        let sentence = format!(
            "GNGGA,{hour:02}{minute:02}{:05.2},{:.7},{},{:.7},{},1,12,0.8,{:.3},M,47.0,M,,",
            second % 60.0,
            angle(lat.abs()),
            if lat < 0.0 { "S" } else { "N" },
            angle(lon.abs()),
            if lon < 0.0 { "W" } else { "E" },
            height - 47.0
        );
        nmea += &format!("${sentence}*{:02X}\n", sentence.bytes().fold(0, |sum, byte| sum ^ byte));
    }
    std::fs::write(at.join("wgs84.csv"), table).unwrap();
    std::fs::write(at.join("log.nmea"), nmea).unwrap();
}

/// The tables of others give the same flight; a wrong map is refused before anything is written.
#[test]
fn tables_of_others_give_the_same_flight() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    flight(at);
    foreign_tables(at);
    let cameras = ["--nadir", "left.csv", "--nadir", "right.csv", "--truth", "vehicle.csv"];
    let run = |more: &[&str]| bare(at, &[&cameras[..], &MOUNTS, more].concat());
    let (code, own, stderr) = run(&["--imu", "imu.csv", "--gnss", "gnss.csv", "-o", "own.csv"]);
    assert_eq!(code, 0, "{stderr}");
    let axes = ["--imu", "log.csv", "--map", "imu:time=t_us,us", "--map", "imu:gyro=wx:wy:wz,deg/s"];
    let axes = [&axes[..], &["--map", "imu:accel=ax:ay:az,g"]].concat();
    let utc = ["--utc", "2019-06-13T04:00:00Z"];
    for (receiver, note) in [("wgs84.csv", "there are no velocities"), ("log.nmea", "no sentence has a date")] {
        let files = ["--gnss", receiver, "-o", "nav.csv", "--force"];
        let (code, stdout, stderr) = run(&[&axes[..], &utc, &files].concat());
        assert_eq!(code, 0, "{receiver}: {stdout}{stderr}");
        assert!(stderr.contains(note), "{stderr}");
        let ((a, _), (b, metres)) = (told_errors(&own, "filter"), told_errors(&stdout, "filter"));
        // The velocities are not measured now, so that the filter is less sure; it finds the same flight.
        assert!((0..3).all(|i| (a[i] - b[i]).abs() < 0.5) && metres < 50.0, "{a:?} {b:?} {metres}");
    }
    for (more, words) in [
        (&["--map", "imu:time=t_ms,ms"][..], "log.csv: there is no column t_ms for time; did you mean t_us?"),
        (&["--map", "imu:time=t_us,hours"], "the unit \"hours\" is unknown; time can be in s, ms, us, ns"),
        (&["--map", "attitude:time=t"], "--map attitude:... needs --attitude FILE"),
        (&["--map", "direction:time=t"], "--map direction:... needs --direction FILE"),
        (
            &[
                "--map",
                "imu:time=t_us,us",
                "--map",
                "imu:gyro=wx:wy:wz,deg/s",
                "--map",
                "imu:accel=ax:ay:az,g",
                "--clock",
                "gps=1",
            ],
            "--clock gps: no such camera, and neither gnss nor attitude",
        ),
    ] {
        let files = ["--imu", "log.csv", "--gnss", "gnss.csv", "-o", "none.csv"];
        let (code, _, stderr) = run(&[&files[..], more].concat());
        assert!(code == 2 && stderr.contains(words) && !at.join("none.csv").exists(), "{stderr}");
    }
}

/// A beacon at a known place is one more sensor, and an orbit that `hzn fuse` wrote replaces the receiver.
#[test]
fn other_sensors_and_orbits_are_read() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    flight(at);
    let mut beacon = String::from("time_s,x,y,z,ref_x,ref_y,ref_z,sigma_deg\n");
    for row in std::fs::read_to_string(at.join("vehicle.csv")).unwrap().lines().skip(1).step_by(20) {
        let cell: Vec<f64> = row.split(',').map(|cell| cell.parse().unwrap_or(f64::NAN)).collect();
        let q = nalgebra::Quaternion::new(cell[7], cell[8], cell[9], cell[10]);
        let seen = nalgebra::UnitQuaternion::from_quaternion(q).inverse() * nalgebra::Vector3::new(0.0, 3.0, 4.0);
        beacon += &format!("{},{},{},{},0,3,4,0.2\n", cell[0], seen.x, seen.y, seen.z);
    }
    std::fs::write(at.join("beacon.csv"), beacon).unwrap();
    let cameras = ["--nadir", "left.csv", "--nadir", "right.csv", "--truth", "vehicle.csv", "--imu", "imu.csv"];
    let run = |more: &[&str]| bare(at, &[&cameras[..], &MOUNTS, more].concat());
    let utc = ["--utc", "2019-06-13T04:00:00Z"];
    let files = ["--direction", "beacon.csv", "--gnss", "gnss.csv", "-o", "nav.csv", "--oem", "nav.oem", "--solve"];
    let (code, stdout, stderr) = run(&[&utc[..], &files].concat());
    assert_eq!(code, 0, "{stdout}{stderr}");
    for words in ["beacon, direction", "mount of beacon", "clock of beacon"] {
        assert!(stdout.contains(words), "{words} in {stdout}");
    }
    let table = std::fs::read_to_string(at.join("nav.csv")).unwrap();
    assert!(
        table.lines().next().unwrap().contains("verdict,unaided_qw,unaided_qx,unaided_qy,unaided_qz,unaided_cov_xx")
    );
    // The orbit begins with the solve's first state, and the flight has its position from there.
    let (code, again, stderr) = run(&[&utc[..], &["--gnss", "nav.oem", "-o", "again.csv"]].concat());
    assert_eq!(code, 0, "{again}{stderr}");
    assert!(stderr.contains("states; times count from --utc"), "{stderr}");
    let (_, metres) = told_errors(&again, "filter");
    assert!(metres < 100.0, "{again}");
    let (code, _, stderr) =
        bare(at, &["--direction", "beacon.csv", "--attitude", "none.csv", "--solve", "-o", "x.csv"]);
    assert!(code == 2 && stderr.contains("--direction needs --imu FILE"), "{stderr}");
}
