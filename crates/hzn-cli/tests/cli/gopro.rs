//! What an action camera writes into its video: positions, rates of rotation, readout time.

use std::process::{Command, Stdio};

use crate::common::{Place, SENSOR, angle_deg, axes, cell, rows};

/// Latitude and longitude of the first fix, degrees, and its height in metres.
const FIX: [f64; 3] = [35.4, 20.25, 400_000.0];
/// Rate of rotation about x, y and z of the camera in hzn's axes, rad/s.
const RATE: [f64; 3] = [0.01, -0.02, 0.03];

/// The rate at which the pictures of [`Place::with_pictures`] turn, four of them a second, to the digits of the camera.
const TURN: [f64; 3] = [0.004, 0.0, 0.0];

/// Returns an entry of GPMF: key, type, size of a sample, samples.
fn entry(key: &str, kind: u8, size: u8, data: &[u8]) -> Vec<u8> {
    let count = data.len() as u16 / u16::from(size);
    let mut bytes = [key.as_bytes(), &[kind, size], &count.to_be_bytes(), data].concat();
    bytes.resize(bytes.len().next_multiple_of(4), 0);
    bytes
}

fn nested(key: &str, parts: &[Vec<u8>]) -> Vec<u8> {
    entry(key, 0, 1, &parts.concat())
}

fn words<const N: usize>(rows: &[[f64; N]], scale: f64) -> Vec<u8> {
    rows.iter().flatten().flat_map(|x| ((x * scale).round() as i16).to_be_bytes()).collect()
}

/// Returns a second of the receiver.
fn receiver(second: u32, has_fix: bool) -> Vec<u8> {
    let fixes: Vec<u8> = (0..10)
        .flat_map(|i| {
            let [lat, lon, height] = FIX;
            let height = height + 5.0 * (f64::from(second) + 0.1 * f64::from(i));
            [(lat * 1e7).round() as i32, (lon * 1e7).round() as i32, (height * 1e3).round() as i32, 0, 0]
        })
        .flat_map(i32::to_be_bytes)
        .collect();
    let scales: Vec<u8> = [10_000_000i32, 10_000_000, 1000, 1000, 100].into_iter().flat_map(i32::to_be_bytes).collect();
    let utc = format!("26061312000{second}.000");
    nested(
        "STRM",
        &[
            entry("GPSF", b'L', 4, &(if has_fix { 3u32 } else { 0 }).to_be_bytes()),
            entry("GPSU", b'U', 16, utc.as_bytes()),
            entry("SCAL", b'l', 4, &scales),
            entry("GPS5", b'l', 20, &fixes),
        ],
    )
}

/// Returns a second of measurements. Its camera stores the axes as `order` says, in which a small letter has the other
/// sign. GoPro's axes point to the left, back and up.
fn payload(second: u32, order: &str, has_fix: bool, rate: [f64; 3]) -> Vec<u8> {
    let stored = |[x, y, z]: [f64; 3]| {
        let [left, back, up] = [-x, -z, -y];
        let one = |c: char| match c {
            'X' => left,
            'x' => -left,
            'Y' => back,
            'y' => -back,
            'Z' => up,
            _ => -up,
        };
        let mut letters = order.chars().map(one);
        std::array::from_fn::<f64, 3, _>(|_| letters.next().unwrap())
    };
    let rates = [stored(rate); 200];
    // The camera is upright and at rest: its accelerometer shows 1 g upwards, against y of hzn.
    let accelerations = [stored([0.0, -9.81, 0.0]); 100];
    let text = |key: &str, text: &str| entry(key, b'c', 1, text.as_bytes());
    nested(
        "DEVC",
        &[
            entry("DVID", b'L', 4, &[0, 0, 0, 1]),
            text("DVNM", "Camera"),
            nested(
                "STRM",
                &[
                    text("ORIN", order),
                    entry("SCAL", b's', 2, &1000i16.to_be_bytes()),
                    entry("GYRO", b's', 6, &words(&rates, 1000.0)),
                ],
            ),
            nested(
                "STRM",
                &[
                    text("ORIN", order),
                    entry("SCAL", b's', 2, &400i16.to_be_bytes()),
                    entry("ACCL", b's', 6, &words(&accelerations, 400.0)),
                ],
            ),
            receiver(second, has_fix),
        ],
    )
}

fn boxed(kind: &str, parts: &[&[u8]]) -> Vec<u8> {
    let body = parts.concat();
    [&(body.len() as u32 + 8).to_be_bytes(), kind.as_bytes(), &body].concat()
}

fn numbers(all: &[u32]) -> Vec<u8> {
    all.iter().flat_map(|n| n.to_be_bytes()).collect()
}

/// Returns the track and the settings of the file, which belong into its index. The payloads begin at `at`.
fn index(payloads: &[Vec<u8>], at: u32) -> Vec<u8> {
    let n = payloads.len() as u32;
    let before = |i: usize| payloads.iter().take(i).map(|p| p.len() as u32).sum::<u32>();
    let offsets: Vec<u32> = (0..payloads.len()).map(|i| at + before(i)).collect();
    let sizes: Vec<u32> = payloads.iter().map(|p| p.len() as u32).collect();
    let table = boxed(
        "stbl",
        &[
            &boxed("stsd", &[&numbers(&[0, 1, 16]), b"gpmd", &numbers(&[0, 1])]),
            &boxed("stts", &[&numbers(&[0, 1, n, 1000])]),
            &boxed("stsc", &[&numbers(&[0, 1, 1, 1, 1])]),
            &boxed("stsz", &[&numbers(&[0, 0, n]), &numbers(&sizes)]),
            &boxed("stco", &[&numbers(&[0, n]), &numbers(&offsets)]),
        ],
    );
    let media = boxed(
        "mdia",
        &[
            &boxed("mdhd", &[&numbers(&[0, 0, 0, 1000, 1000 * n, 0])]),
            &boxed("hdlr", &[&numbers(&[0]), b"mhlrmeta", &numbers(&[0, 0, 0]), b"GoPro MET\0"]),
            &boxed("minf", &[&boxed("gmhd", &[]), &table]),
        ],
    );
    let header = boxed("tkhd", &[&numbers(&[3, 0, 0, 9, 0, 1000 * n]), &[0; 60]]);
    let settings =
        nested("DEVC", &[entry("MINF", b'c', 1, b"HERO8 Black"), entry("SROT", b'f', 4, &15.5f32.to_be_bytes())]);
    [boxed("trak", &[&header, &media]), boxed("udta", &[&boxed("GPMF", &[&settings])])].concat()
}

/// Returns a file without pictures.
fn without_pictures(payloads: &[Vec<u8>]) -> Vec<u8> {
    let start = boxed("ftyp", &[b"mp41", &numbers(&[0])]);
    let data = payloads.concat();
    let moov = boxed("moov", &[&index(payloads, start.len() as u32 + 8)]);
    [start, boxed("mdat", &[&data]), moov].concat()
}

/// Returns the video with the measurements. Its index must be the last box.
fn add_measurements(video: &[u8], payloads: &[Vec<u8>]) -> Vec<u8> {
    let at = video.windows(4).rposition(|w| w == b"moov").unwrap() - 4;
    let (before, moov) = video.split_at(at);
    assert_eq!(u32::from_be_bytes(moov[..4].try_into().unwrap()) as usize, moov.len());
    let data = boxed("mdat", &[&payloads.concat()]);
    let moov = boxed("moov", &[&moov[8..], &index(payloads, at as u32 + 8)]);
    [before, &data, &moov].concat()
}

fn number(row: &[(String, String)], name: &str) -> f64 {
    cell(row, name).parse().unwrap_or_else(|_| panic!("{name} is {:?}", cell(row, name)))
}

#[test]
fn tables_for_the_filter_have_the_axes_of_the_camera() {
    let place = Place::new();
    for order in ["ZXY", "YxZ", "zxY"] {
        let payloads: Vec<Vec<u8>> = (0..3).map(|second| payload(second, order, second > 0, RATE)).collect();
        place.write("a.mp4", &without_pictures(&payloads));
        let out = ["--imu", "imu.csv", "--gnss", "gnss.csv", "--force"];
        let ran = place.run(&[&["export", "a.mp4"], &out[..]].concat()).expect(0);
        let said = format!("{}{}", ran.out, ran.err);
        assert!(said.contains("600 rows of HERO8 Black") && said.contains("10 positions without a fix"), "{said}");
        let imu = rows(&place.read("imu.csv"));
        assert_eq!(imu.len(), 600);
        for row in &imu {
            for (name, value) in [("gyro_x_radps", 0.01), ("gyro_y_radps", -0.02), ("gyro_z_radps", 0.03)] {
                assert!((number(row, name) - value).abs() < 1e-9, "{order}: {row:?}");
            }
            assert!((number(row, "accel_y_mps2") + 9.81).abs() < 2e-3 && number(row, "accel_x_mps2") == 0.0, "{row:?}");
        }
        assert_eq!((number(&imu[0], "time_s"), number(&imu[201], "time_s")), (0.0, 1.005));
        let gnss = rows(&place.read("gnss.csv"));
        assert_eq!((gnss.len(), number(&gnss[0], "time_s"), number(&gnss[0], "height_m")), (20, 1.0, 400_005.0));
        assert_eq!((number(&gnss[0], "lat_deg"), number(&gnss[0], "lon_deg")), (35.4, 20.25));
    }
}

#[test]
fn what_a_video_lacks_is_told() {
    let place = Place::new();
    let payloads: Vec<Vec<u8>> = (0..2).map(|second| payload(second, "ZXY", false, RATE)).collect();
    place.write("a.mp4", &without_pictures(&payloads));
    let gnss = ["export", "a.mp4", "--imu", "imu.csv", "--gnss", "gnss.csv"];
    place.run(&gnss).expect(1).says("no position, no UTC, no attitude (its receiver had no fix)");
    place.write("b.mp4", b"this is no video");
    place.run(&["export", "b.mp4", "--imu", "imu.csv"]).expect(1).says("GPMF, the format of GoPro");
    place.run(&["export", "a.mp4", "--imu", "imu.csv", "--topic", "/imu"]).expect(2).says("a video has no topics");
    assert!(!place.path("gnss.csv").exists() && !place.path("imu.csv").exists());
}

/// A file that was cut off, or whose numbers are not right, is read as far as possible and ends nothing.
#[test]
fn damaged_measurements_end_nothing() {
    let place = Place::new();
    let whole = without_pictures(&(0..2).map(|second| payload(second, "ZXY", true, RATE)).collect::<Vec<_>>());
    let mut state = 1u32;
    for trial in 0..60 {
        let mut bytes = whole.clone();
        if trial % 2 == 0 {
            bytes.truncate(whole.len() * trial / 60);
        }
        for _ in 0..4 {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            // The index and the heads of the entries, in which a number matters most.
            let at = if trial % 3 == 0 { state as usize % 200 } else { whole.len() - 1 - state as usize % 700 };
            if let Some(byte) = bytes.get_mut(at) {
                *byte = (state >> 24) as u8;
            }
        }
        place.write("a.mp4", &bytes);
        let ran = place.run(&["export", "a.mp4", "--imu", "imu.csv", "--gnss", "gnss.csv", "--force"]);
        assert!(!ran.err.contains("panicked") && !ran.err.contains("overflow"), "{trial}: {}", ran.err);
    }
}

#[test]
fn a_video_gives_its_pictures_their_prior() {
    let has = |tool: &str| {
        Command::new(tool).arg("-version").stdout(Stdio::null()).status().is_ok_and(|status| status.success())
    };
    if !(has("ffmpeg") && has("ffprobe")) {
        assert!(std::env::var("CI").as_deref() != Ok("true"), "this test needs ffmpeg and ffprobe on PATH");
        return;
    }
    let place = Place::with_pictures(6);
    let coding = ["-c:v", "mpeg4", "-q:v", "2", "-pix_fmt", "yuv420p"];
    let made = Command::new("ffmpeg")
        .args(["-nostdin", "-v", "error", "-framerate", "4", "-i"])
        .arg(place.path("in/%04d.png"))
        .args(coding)
        .arg(place.path("plain.mp4"))
        .status();
    assert!(made.unwrap().success());
    let plain = std::fs::read(place.path("plain.mp4")).unwrap();
    let payloads: Vec<Vec<u8>> = (0..2).map(|second| payload(second, "YxZ", true, TURN)).collect();
    place.write("a.mp4", &add_measurements(&plain, &payloads));
    place.write("s.toml", SENSOR.replace("altitude_km = 400.0\n", "").as_bytes());
    let ran = place.run(&["run", "plain.mp4", "-s", "s.toml"]);
    assert!(ran.err.contains("no altitude"), "{}", ran.err);

    let ran = place.run(&["run", "a.mp4", "-s", "s.toml", "-o", "a.mcap", "-o", "a.csv"]).expect(0);
    let told = "HERO8 Black recorded positions, UTC, rates of rotation; the video has no attitude";
    assert!(ran.err.contains(told), "{}", ran.err);
    assert!(ran.err.contains("set camera.readout_s = 0.0155"), "{}", ran.err);
    let found = rows(&place.read("a.csv"));
    let times: Vec<&str> = found.iter().map(|row| cell(row, "time_s")).collect();
    assert_eq!(times, ["0.0", "0.25", "0.5", "0.75", "1.0", "1.25"]);
    let info = place.run(&["info", "a.mcap"]).expect(0);
    // The recording has the prior, and is processed again with it.
    place.run(&["run", "a.mcap", "-o", "b.csv"]).expect(0);
    let again = rows(&place.read("b.csv"));
    for (row, again) in found.iter().zip(&again) {
        assert_eq!(cell(row, "axis_x"), cell(again, "axis_x"), "{}", info.out);
    }
    // The altitude of the fixes is that of the sensor of the others; a table replaces them.
    let of_video = axes(&place, &["run", "a.mp4", "-s", "s.toml"]);
    let plain = axes(&place, &["run", "plain.mp4", "-s", "in/sensor.toml"]);
    let table: String = (0..6).map(|i| format!("a.mp4#{i:06},400\n")).collect();
    place.write("t.csv", format!("file,altitude_km\n{table}").as_bytes());
    let of_table = axes(&place, &["run", "a.mp4", "-s", "s.toml", "--frames", "t.csv"]);
    for ((of_video, of_table), plain) in of_video.iter().zip(&of_table).zip(&plain) {
        assert!(angle_deg(*of_video, *plain) < 0.1 && angle_deg(*of_table, *plain) < 1e-9);
    }
    let init = ["init", "a.mp4", "--fov", "60", "-o", "start.toml", "--altitude", "400"];
    place.run(&init).expect(0);
    assert!(place.read("start.toml").contains("readout_s = 0.01550"), "{}", place.read("start.toml"));
}
