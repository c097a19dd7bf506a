//! Orbit ephemeris messages instead of a receiver.

use std::path::{Path, PathBuf};

use crate::common::{flight, scene};
use hzn_fuse::flight::Wanted;
use hzn_fuse::input::{Map, gnss};
use hzn_fuse::sink::{AemOptions, AemVersion, Utc, write_oem};
use hzn_fuse::{Settings, fuse};
use nalgebra::Vector3;

/// `date -u -d 2020-06-01 +%s`
const DAY_UNIX_S: f64 = 1_590_969_600.0;

fn write(folder: &Path, text: &str) -> PathBuf {
    let path = folder.join("orbit.oem");
    std::fs::write(&path, text).unwrap();
    path
}

fn refused(text: &str) -> String {
    let folder = tempfile::tempdir().unwrap();
    gnss(&write(folder.path(), text), &Map::default(), None).unwrap_err().to_string()
}

/// A message with all that a reader may meet: comments, accelerations, a day of the year, two segments in two time
/// systems, and a covariance in the axes of the orbit.
const MESSAGE: &str = "\
CCSDS_OEM_VERS = 2.0
CREATION_DATE = 2020-06-02T00:00:00
ORIGINATOR = SOMEBODY
META_START
COMMENT the first segment
OBJECT_NAME = A SATELLITE
OBJECT_ID = 2020-001A
CENTER_NAME = EARTH
REF_FRAME = ITRF2000
TIME_SYSTEM = UTC
START_TIME = 2020-06-01T00:00:00
STOP_TIME = 2020-153T00:10:00.5
META_STOP

2020-06-01T00:00:00 7000.0 1.0 2.0 0.1 7.5 0.3
2020-153T00:10:00.5 6000.0 3000.0 2.0 -1.0 7.0 0.3 0.0 0.0 -0.009
COVARIANCE_START
EPOCH = 2020-06-01T00:00:00
COV_REF_FRAME = RSW
1e-4
0 4e-4
0 0 1e-4
0 0 0 1e-8
0 0 0 0 1e-8
0 0 0 0 0 9e-8
COVARIANCE_STOP
META_START
OBJECT_NAME = A SATELLITE
OBJECT_ID = 2020-001A
CENTER_NAME = EARTH
REF_FRAME = ITRF-97
TIME_SYSTEM = GPS
START_TIME = 2020-06-01T00:20:18
STOP_TIME = 2020-06-01T00:20:18
META_STOP
2020-06-01T00:20:18.000 1.0 7000.0 2.0 0.1 7.5 0.3
";

#[test]
fn a_message_gives_positions_velocities_and_sigmas() {
    let folder = tempfile::tempdir().unwrap();
    let read = gnss(&write(folder.path(), MESSAGE), &Map::default(), Some(DAY_UNIX_S)).unwrap();
    let times: Vec<f64> = read.fixes.iter().map(|fix| fix.time_s).collect();
    // GPS time was 18 s ahead of UTC.
    assert_eq!(times, [0.0, 600.5, 1200.0]);
    assert_eq!(read.fixes[1].position_m.xyz(), [6e6, 3e6, 2e3]);
    assert_eq!(read.fixes[1].velocity_m_s.xyz(), [-1e3, 7e3, 300.0]);
    assert!((read.fixes[0].position_sigma_m - 20.0).abs() < 1e-9, "{}", read.fixes[0].position_sigma_m);
    assert!((read.fixes[2].velocity_sigma_m_s - 0.3).abs() < 1e-9);
    assert!(read.notes[0].contains("3 states; times count from --utc"), "{:?}", read.notes);
    // Without --utc the times are those of the message.
    let read = gnss(&write(folder.path(), MESSAGE), &Map::default(), None).unwrap();
    assert_eq!(read.fixes[0].time_s, DAY_UNIX_S);
}

#[test]
fn what_is_not_read_is_said() {
    for (from, to, words) in [
        ("ITRF2000", "EME2000", "orbit.oem:9: REF_FRAME is \"EME2000\", but a frame that turns with the Earth"),
        ("ITRF-97", "TEME", "REF_FRAME is \"TEME\""),
        ("CENTER_NAME = EARTH", "CENTER_NAME = MOON", "CENTER_NAME is \"MOON\""),
        ("TIME_SYSTEM = GPS", "TIME_SYSTEM = MET", "TIME_SYSTEM is \"MET\", but UTC, GPS, TAI or TT"),
        ("TIME_SYSTEM = UTC\n", "", "REF_FRAME and TIME_SYSTEM are expected before it"),
        ("7000.0 1.0", "7000.0 x", "orbit.oem:15: \"x\" is not a number"),
        ("7000.0 1.0", "7000.0", "there are 5 numbers"),
        ("2020-153T00:10:00.5 6", "2020-153 6", "is no epoch such as"),
        ("CCSDS_OEM_VERS", "CCSDS_OPM_VERS", "begins with \"CCSDS_OPM_VERS\"; of the messages of CCSDS, OEM is read"),
        ("CCSDS_OEM_VERS = 2.0", "<?xml version=\"1.0\"?><oem>", "is XML; an OEM in keyword = value notation"),
    ] {
        let told = refused(&MESSAGE.replacen(from, to, 1));
        assert!(told.contains(words), "{from} {to}: {told}");
    }
    let head = MESSAGE.split_once("2020-06-01T00:00:00 7000").unwrap().0;
    assert!(refused(head).contains("the message has no state"));
    let folder = tempfile::tempdir().unwrap();
    let map = Map::parse(["gnss:time=t"]).unwrap();
    let told = gnss(&write(folder.path(), MESSAGE), &map, None).unwrap_err().to_string();
    assert!(told.contains("is a message of CCSDS, which has no columns"), "{told}");
}

/// States of a circular orbit, a minute apart: those in between are right to a metre, and say no more than the states.
#[test]
fn states_in_between_are_filled_in() {
    let (radius_km, rate) = (6871.0, 1.108e-3f64);
    let at = |t: f64| {
        let (s, c) = (rate * t).sin_cos();
        (Vector3::new(radius_km * c, radius_km * s, 0.0), Vector3::new(-s, c, 0.0) * (radius_km * rate))
    };
    let head = MESSAGE.split_once("2020-06-01T00:00:00 7000").unwrap().0;
    let line = |i: i32| {
        let (p, v) = at(60.0 * f64::from(i));
        format!("2020-06-01T00:{i:02}:00 {} {} {} {} {} {}\n", p.x, p.y, p.z, v.x, v.y, v.z)
    };
    let cells = |n: usize| (0..n).map(|i| if i + 1 == n { "1e-4" } else { "0" }).collect::<Vec<_>>().join(" ") + "\n";
    let covariance: String = (1..=6).map(cells).collect();
    let text = format!(
        "{head}{}COVARIANCE_START\nEPOCH = 2020-06-01T00:00:00\n{covariance}COVARIANCE_STOP\n",
        (0..10).map(line).collect::<String>()
    );
    let folder = tempfile::tempdir().unwrap();
    let read = gnss(&write(folder.path(), &text), &Map::default(), Some(DAY_UNIX_S)).unwrap();
    assert_eq!(read.fixes.len(), 9 * 15 + 1);
    let worst = read.fixes.iter().map(|fix| {
        let (p, v) = at(fix.time_s);
        [(fix.position_m.into_inner() - p * 1e3).norm(), (fix.velocity_m_s.into_inner() - v * 1e3).norm()]
    });
    let worst = worst.fold([0.0f64; 2], |[a, b], [c, d]| [a.max(c), b.max(d)]);
    assert!(worst[0] < 1.0 && worst[1] < 0.1, "{worst:?}");
    // 15 of them are as much as one of 10 m.
    assert!((read.fixes[0].position_sigma_m - 10.0 * 15f64.sqrt()).abs() < 1e-6);
}

/// The message that a flight wrote is read again, and takes the place of the receiver.
#[test]
fn a_message_is_written_and_read() {
    let scene = scene(1);
    let mut inputs = flight(&scene);
    let wanted = Wanted { rate_hz: Some(1.0), ..Wanted::default() };
    let fused = fuse(&inputs, &Settings::default(), wanted).unwrap();
    let utc = Utc { unix_s: DAY_UNIX_S };
    let options = AemOptions {
        version: AemVersion::One,
        utc,
        object_id: "A".into(),
        object_name: "A".into(),
        created: utc.iso(0.0),
    };
    let mut text = Vec::new();
    write_oem(&fused, &options, &mut text).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let read = gnss(&write(folder.path(), &String::from_utf8(text).unwrap()), &Map::default(), Some(DAY_UNIX_S));
    let fixes = read.unwrap().fixes;
    assert_eq!(fixes.len(), fused.epochs.len());
    for (fix, epoch) in fixes.iter().zip(&fused.epochs) {
        let off = |a: [f64; 3], b: [f64; 3]| (0..3).map(|i| (a[i] - b[i]).abs()).fold(0.0, f64::max);
        assert!((fix.time_s - epoch.state.time_s).abs() < 1e-6);
        assert!(off(fix.position_m.xyz(), epoch.state.position_m.xyz()) < 1e-3);
        assert!(off(fix.velocity_m_s.xyz(), epoch.state.velocity_m_s.xyz()) < 1e-6);
        let largest = epoch.position_covariance_m2.as_inner().symmetric_eigenvalues().max().sqrt();
        assert!((fix.position_sigma_m / largest - 1.0).abs() < 1e-3, "{} {largest}", fix.position_sigma_m);
    }
    inputs.gnss = fixes;
    let again = fuse(&inputs, &Settings::default(), wanted).unwrap();
    let (a, b) = (fused.epochs.last().unwrap(), again.epochs.last().unwrap());
    assert!((a.state.position_m - b.state.position_m).norm() < 50.0);
    let apart = (a.state.attitude * b.state.attitude.inverse()).scaled_axis().norm();
    assert!(apart < a.attitude_sigma_rad().max(), "{apart}");
}
