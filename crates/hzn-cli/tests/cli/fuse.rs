//! `hzn fuse`, from beginning to end through the binary, on a flight without pictures.

use std::path::Path;

use hzn_fuse::simulated::{Errors, Moment, inputs, write};
use hzn_nav::frames::{Cam, Covariance, Vector};
use hzn_sim::Scenario;

use crate::ccsds;
use crate::common::assert_provenance;
use crate::dark::assert_drawings_are_readable;

/// Directions without errors that claim 0.05°.
struct Exact;

impl Errors for Exact {
    fn draw(&mut self, _: &Moment, axis: &Vector<Cam>) -> (Vector<Cam>, Covariance<Cam>) {
        (Vector::zeros(), Covariance::across(axis, 0.05f64.to_radians().powi(2)))
    }
    fn by_limb_height(&mut self, _: &Moment, _: &Vector<Cam>) -> Vector<Cam> {
        Vector::zeros()
    }
}

pub(crate) fn flight(folder: &Path) {
    let mut scene = Scenario::builtin("atek").unwrap();
    scene.capture.frames = 75;
    write(&scene, &inputs(&scene, &mut Exact, 0.0).unwrap(), folder).unwrap();
}

/// Runs `hzn fuse` in a folder with these arguments after the two cameras.
pub(crate) fn fuse(folder: &Path, args: &[&str]) -> (i32, String, String) {
    let cameras = ["--nadir", "left.csv", "--nadir", "right.csv", "--imu", "imu.csv", "--gnss", "gnss.csv"];
    bare(folder, &[&cameras[..], args].concat())
}

/// Runs `hzn fuse` in a folder with these arguments.
pub(crate) fn bare(folder: &Path, args: &[&str]) -> (i32, String, String) {
    let out = assert_cmd::Command::cargo_bin("hzn")
        .expect("the binary is built")
        .current_dir(folder)
        .arg("fuse")
        .args(args)
        .output()
        .expect("hzn starts");
    let text = |b: &[u8]| String::from_utf8_lossy(b).into_owned();
    (out.status.code().unwrap_or(-1), text(&out.stdout), text(&out.stderr))
}

pub(crate) const MOUNTS: [&str; 4] = ["--mount", "left=left.toml", "--mount", "right=right.toml"];

#[test]
fn a_flight_becomes_attitudes_a_report_and_files_for_others() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    flight(at);
    let more = ["--truth", "vehicle.csv", "--smooth", "--report", "nav.html", "--utc", "2019-06-13T04:00:00Z"];
    let files = [
        "-o",
        "nav.csv",
        "--aem",
        "nav.aem",
        "--oem",
        "nav.oem",
        "--ck",
        "nav.bc",
        "--write-frames",
        "left=left-frames.csv",
    ];
    let args = [&MOUNTS[..], &more, &files].concat();
    let (code, stdout, stderr) = fuse(at, &args);
    assert_eq!(code, 0, "{stderr}");
    for text in ["mount of left", "clock of right", "error of the filter", "error of the smoother", "nav.tsc"] {
        assert!(stdout.contains(text), "{text} in {stdout}");
    }
    let read = |name: &str| std::fs::read_to_string(at.join(name)).unwrap();
    assert!(read("nav.csv").starts_with("time_s,phase,qw,qx,qy,qz,sigma_x_deg"));
    assert!(read("nav.innovations.csv").lines().count() > 500);
    let page = read("nav.html");
    let charts =
        ["Mount of left", "Height above WGS-84", "Rate of the vehicle", "[BB] figure 37)", "unaided to the aided"];
    charts.iter().for_each(|chart| assert!(page.contains(chart), "{chart}"));
    assert!(
        !page.contains("NaN") && read("nav.aem").contains("ATTITUDE_DIR = A2B") && read("nav.tf").contains("HZN_BODY")
    );
    // The OEM has the positions of the smoothed solution, in kilometres.
    let (oem, states) = (read("nav.oem"), read("nav.csv"));
    let (ephemeris, covariances) = oem.split_once("\nCOVARIANCE_START\n").unwrap();
    let last: Vec<f64> = ephemeris.lines().last().unwrap().split(' ').filter_map(|word| word.parse().ok()).collect();
    let place = states.lines().next().unwrap().split(',').position(|name| name == "x_m").unwrap();
    let is_last = |row: &str| {
        let cells = row.split(',').skip(place).take(3).map(|cell| cell.parse::<f64>().unwrap_or(f64::NAN));
        row.contains("smoothed") && cells.zip(&last).all(|(m, km)| (1e-3 * m - km).abs() < 2e-6)
    };
    ccsds::has_the_covariance_of(covariances, &states, states.lines().rfind(|row| is_last(row)).unwrap());
    assert!(oem.contains("REF_FRAME = ITRF-97") && last.len() == 6, "{last:?}");
    ccsds::second_version_of_the_aem(at, &[&MOUNTS[..], &more[2..3], &more[5..]].concat());
    let frames = read("left-frames.csv");
    let with_attitude = frames.lines().filter(|line| !line.ends_with(",,,")).count();
    assert!((50..75).contains(&with_attitude), "{with_attitude} of {}", frames.lines().count());
    // Nothing is replaced without --force.
    let (code, _, stderr) = fuse(at, &args);
    assert!(code == 2 && stderr.contains("nav.csv: exists already; --force"), "{stderr}");
    let (code, _, stderr) = fuse(at, &[&MOUNTS[..], &["-o", "nav.mcap"]].concat());
    assert!(code == 0 && at.join("nav.mcap").is_file() && !at.join("nav.mcap.part").exists(), "{stderr}");
    for name in ["nav.mcap", "nav.csv"] {
        let info =
            assert_cmd::Command::cargo_bin("hzn").unwrap().current_dir(at).args(["info", name]).output().unwrap();
        let out = String::from_utf8_lossy(&info.stdout);
        assert!(info.status.success() && out.contains("results of hzn fuse") && out.contains("were taken"), "{out}");
    }
}

/// Returns the three errors of an attitude that the summary tells, and the position's.
pub(crate) fn told_errors(stdout: &str, who: &str) -> ([f64; 3], f64) {
    let name = format!("error of the {who}");
    let line = stdout.lines().find(|line| line.starts_with(&name)).unwrap_or_else(|| panic!("{name} in {stdout}"));
    let numbers: Vec<f64> = line.split_whitespace().filter_map(|word| word.parse().ok()).collect();
    let position = line.rsplit_once("position ").unwrap().1.trim_end_matches(" m").parse().unwrap();
    (numbers[..3].try_into().unwrap(), position)
}

/// `--solve` writes what `--smooth` writes, is nearer to the truth than the filter, and says what it found.
#[test]
fn the_whole_flight_is_solved_at_once() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    flight(at);
    let args = [&MOUNTS[..], &["--truth", "vehicle.csv", "--solve", "-o", "nav.csv", "--report", "nav.html"]].concat();
    let (code, stdout, stderr) = fuse(at, &args);
    assert_eq!(code, 0, "{stdout}{stderr}");
    for text in ["unknowns", "deg before (filter)", "mount of left", "determined", "limb height", "consistent"] {
        assert!(stdout.contains(text), "{text} in {stdout}");
    }
    assert!(!stderr.contains("did not converge"), "{stderr}");
    // The tables of the heads do not say which sensor made them.
    let page = std::fs::read_to_string(at.join("nav.html")).unwrap();
    assert_provenance(&page, false, "hzn fuse");
    assert_drawings_are_readable(&page);
    let ((filter, filter_m), (solve, solve_m)) = (told_errors(&stdout, "filter"), told_errors(&stdout, "solve"));
    let norm = |e: [f64; 3]| e.iter().map(|x| x * x).sum::<f64>().sqrt();
    assert!(norm(solve) < 0.8 * norm(filter) && solve_m < filter_m, "{solve:?} {filter:?} {solve_m} {filter_m}");
    let states = hzn_fuse::read_back::read_solution(&at.join("nav.csv")).unwrap().states;
    let smoothed: Vec<_> = states.iter().filter(|s| s.phase == hzn_fuse::sink::Phase::Smoothed).collect();
    assert!(smoothed.len() > 300 && smoothed.windows(2).all(|pair| pair[0].time_s < pair[1].time_s));
    let (code, _, stderr) = fuse(at, &[&MOUNTS[..], &["--solve", "--smooth", "-o", "other.csv"]].concat());
    assert!(code == 2 && stderr.contains("--smooth"), "{stderr}");
}

/// A mount that is 40° off is told with `--solve`, too.
#[test]
fn a_solve_of_wrong_inputs_is_told() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    flight(at);
    turn_right_mount(at);
    let mounts = ["--mount", "left=left.toml", "--mount", "right=turned.toml", "--solve", "-o", "nav.csv"];
    let (code, stdout, stderr) = fuse(at, &mounts);
    assert!(code == 1 && stdout.contains("verdict                contradicts"), "{stdout}{stderr}");
    let likeliest = stderr.lines().find(|line| line.contains("likeliest cause, contradicts")).unwrap();
    assert!(likeliest.contains("the mount of right") && likeliest.contains("[turned.toml]"), "{stderr}");
    assert!(stdout.contains("count less, they are too far off"), "{stdout}");
}

#[test]
fn wrong_inputs_are_refused_in_words() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    flight(at);
    let refused = |args: &[&str]| {
        let (code, _, stderr) = fuse(at, &[args, &["-o", "nav.csv"]].concat());
        assert!(code == 2 && !at.join("nav.csv").exists(), "{stderr}");
        stderr
    };
    assert!(refused(&[]).contains("left: nobody says how the camera is mounted; give --mount left=FILE"));
    let mirror = "[mount]\nvehicle_from_camera = [[1, 0, 0], [0, 1, 0], [0, 0, -1]]\n";
    std::fs::write(at.join("mirror.toml"), mirror).unwrap();
    let text = refused(&["--mount", "left=mirror.toml", "--mount", "right=right.toml"]);
    assert!(
        text.contains("mirror.toml: [mount] vehicle_from_camera: the determinant is -1, so the matrix mirrors"),
        "{text}"
    );
    let text = refused(&["--mount", "left=left.toml", "--mount", "right=left.toml"]);
    assert!(text.contains("left and right have the same mount"), "{text}");
    let text = refused(&["--mount", "middle=left.toml"]);
    assert!(text.contains("--mount middle: no such camera; the cameras are left, right"), "{text}");
    let text = refused(&[&MOUNTS[..], &["--clock", "left=1000000"]].concat());
    assert!(text.contains("left: its times 10000") && text.contains("--clock left=SECONDS"), "{text}");
    std::fs::write(at.join("f.toml"), "[imu]\ngyro_bias_deg_h = { mode = \"estimated\", sigma = -1 }\n").unwrap();
    let text = refused(&[&MOUNTS[..], &["--config", "f.toml"]].concat());
    assert!(text.contains("f.toml:2") && text.contains("gyro_bias_deg_h") && text.contains("0 or more"), "{text}");
    std::fs::write(at.join("f.toml"), "[cameras.lefft]\nwhite_rad = 0.001\n").unwrap();
    let text = refused(&[&MOUNTS[..], &["--config", "f.toml"]].concat());
    assert!(text.contains("[cameras.lefft]: there is no recording of this name"), "{text}");
    std::fs::write(at.join("imu.csv"), "time_s,gyro_x_radps\n0,1\n").unwrap();
    let text = refused(&MOUNTS);
    assert!(text.contains("imu.csv: the column gyro_y_radps is missing; the file has time_s, gyro_x_radps"), "{text}");
    std::fs::write(at.join("gnss.csv"), "time_s,x_m,y_m,z_m\n0,1,2,three\n").unwrap();
    let (_, _, text) = fuse(at, &[&MOUNTS[..], &["-o", "nav.csv"]].concat());
    assert!(text.contains("imu.csv"), "{text}");
}

/// Writes turned.toml: the mount of the right camera, 40° off.
fn turn_right_mount(at: &Path) {
    let mount = std::fs::read_to_string(at.join("right.toml")).unwrap();
    let numbers = mount.split_once('[').unwrap().1.split_once('[').unwrap().1.trim_end().trim_end_matches(']');
    let q: Vec<f64> = numbers.split(", ").map(|n| n.parse().unwrap()).collect();
    // The product with a turn of 40° about the camera's x axis.
    let (s, c) = 20f64.to_radians().sin_cos();
    let q = [c * q[0] - s * q[1], c * q[1] + s * q[0], c * q[2] + s * q[3], c * q[3] - s * q[2]];
    std::fs::write(at.join("turned.toml"), format!("[mount]\nq_vehicle_from_camera_wxyz = {q:?}\n")).unwrap();
}

/// A mount that is 40° off: the command names it with its file, and keeps the attitude from other programs.
#[test]
fn a_contradiction_is_named_and_its_attitudes_are_held_back() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    flight(at);
    turn_right_mount(at);
    let mounts = ["--mount", "left=left.toml", "--mount", "right=turned.toml", "--utc", "2019-06-13T04:00:00Z"];
    let files = ["-o", "nav.csv", "--aem", "nav.aem", "--ck", "nav.bc"];
    let (code, stdout, stderr) = fuse(at, &[&mounts[..], &files].concat());
    assert_eq!(code, 1, "{stdout}{stderr}");
    assert!(stdout.contains("verdict                contradicts") && stdout.contains("nav.csv"), "{stdout}");
    assert!(!stdout.contains("nav.aem") && !stdout.contains("nav.bc"), "{stdout}");
    let likeliest = stderr.lines().find(|line| line.contains("likeliest cause, contradicts")).unwrap();
    assert!(likeliest.contains("the mount of right") && likeliest.contains("[turned.toml]"), "{stderr}");
    assert!(stderr.contains("not written: nav.aem, nav.bc, nav.tsc, nav.tf"), "{stderr}");
    assert!(at.join("nav.csv").is_file() && !at.join("nav.aem").exists() && !at.join("nav.bc").exists());
    let (code, _, stderr) = fuse(at, &[&mounts[..], &files, &["--force"]].concat());
    assert!(code == 1 && at.join("nav.aem").is_file() && at.join("nav.bc").is_file(), "{stderr}");
}

/// A star tracker replaces cameras and receiver.
#[test]
fn a_star_tracker_needs_neither_cameras_nor_a_receiver() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    flight(at);
    let vehicle = std::fs::read_to_string(at.join("vehicle.csv")).unwrap();
    let names: Vec<&str> = vehicle.lines().next().unwrap().split(',').collect();
    let column = |name: &str| names.iter().position(|n| *n == name).unwrap();
    let columns = ["time_s", "qw", "qx", "qy", "qz"].map(column);
    let row = |line: &str| {
        let cells: Vec<&str> = line.split(',').collect();
        columns.map(|i| cells[i]).join(",") + ",0.05\n"
    };
    let rows: String = vehicle.lines().skip(1 + 20 * 100).step_by(200).map(row).collect();
    std::fs::write(at.join("attitude.csv"), "time_s,qw,qx,qy,qz,sigma_deg\n".to_owned() + &rows).unwrap();
    let only = ["--imu", "imu.csv", "--attitude", "attitude.csv", "--truth", "vehicle.csv", "-o", "nav.csv"];
    let (code, stdout, stderr) = bare(at, &only);
    assert_eq!(code, 0, "{stdout}{stderr}");
    assert!(
        stdout.contains("an attitude of the star tracker") && stderr.contains("the position is not known"),
        "{stderr}"
    );
    let solution = hzn_fuse::read_back::read_solution(&at.join("nav.csv")).unwrap();
    let last = solution.states.last().unwrap();
    assert!(last.sigma_x_deg.unwrap() < 2.0 && last.position_sigma_m.unwrap() > 1e6, "{last:?}");
    let (code, _, stderr) = bare(at, &["--imu", "imu.csv", "-o", "nav2.csv"]);
    assert!(code == 2 && stderr.contains("--nadir"), "{stderr}");
}

#[test]
fn settings_are_printed_with_their_defaults_and_read_again() {
    let dir = tempfile::tempdir().unwrap();
    let out = assert_cmd::Command::cargo_bin("hzn").unwrap().args(["fuse", "--show-config"]).output().unwrap();
    let text = String::from_utf8(out.stdout).unwrap();
    assert!(text.contains("gyro_scale_ppm") && text.contains("slow_error_time_s = 20.0"), "{text}");
    flight(dir.path());
    std::fs::write(dir.path().join("fuse.toml"), text).unwrap();
    let (code, _, stderr) = fuse(dir.path(), &[&MOUNTS[..], &["--config", "fuse.toml", "-o", "a.csv"]].concat());
    assert_eq!(code, 0, "{stderr}");
    assert_eq!(fuse(dir.path(), &[&MOUNTS[..], &["-o", "b.csv"]].concat()).0, 0);
    let read = |name: &str| std::fs::read(dir.path().join(name)).unwrap();
    assert!(read("a.csv") == read("b.csv"), "the printed defaults are the defaults");
}

/// A short flight with pictures, from beginning to end through the binary.
const SCENE: &str = r#"
name = "short"
utc = 2019-06-13T10:30:00Z
[capture]
from_s = 100.0
to_s = 140.0
frames = 41
[camera]
width = 320
height = 240
model = "pinhole"
fx_px = 200.0
fy_px = 200.0
cx_px = 159.5
cy_px = 119.5
[trajectory.rocket]
[attitude.pointing]
off_nadir_deg = [70.0, 75.0]
azimuth_deg = [0.0, 120.0]
[world.visible]
[detector]
read_noise = 0.02
[imu]
rate_hz = 20
[gnss]
"#;

/// Makes a variance of row 20 negative, and takes one of row 21 away.
fn spoil_two_rows(table: &Path) {
    let recording = std::fs::read_to_string(table).unwrap();
    let column = |name: &str| recording.lines().next().unwrap().split(',').position(|n| n == name).unwrap();
    let (xx, yy) = (column("cov_xx"), column("cov_yy"));
    // Results of earlier versions have no checksum in the last column.
    let spoil = |(number, line): (usize, &str)| {
        let mut cells: Vec<String> = line.split(',').map(str::to_owned).collect();
        let sum = cells.pop().unwrap();
        assert!(number > 0 || sum == "crc32");
        match number {
            20 => cells[xx] = "-1e-4".into(),
            21 => cells[yy].clear(),
            _ => {}
        }
        cells.join(",") + "\n"
    };
    let spoiled: String = recording.lines().enumerate().map(spoil).collect();
    std::fs::write(table, spoiled).unwrap();
}

/// Rows that repeat or contradict themselves, and a file without rows, are told and do not make the answer better.
#[test]
fn what_is_no_measurement_is_left_out_and_told() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    flight(at);
    let table = std::fs::read_to_string(at.join("left.csv")).unwrap();
    let (header, rows) = table.split_once('\n').unwrap();
    let columns: Vec<&str> = header.split(',').filter(|name| *name != "crc32").collect();
    let column = |name: &str| columns.iter().position(|n| *n == name).unwrap();
    // A program that rewrites a table drops the checksum.
    let rewrite = |change: &dyn Fn(&mut Vec<String>)| {
        let row = |line: &str| {
            let mut cells: Vec<String> = line.split(',').take(columns.len()).map(str::to_owned).collect();
            change(&mut cells);
            cells.join(",") + "\n"
        };
        std::fs::write(at.join("left.csv"), columns.join(",") + "\n" + &rows.lines().map(row).collect::<String>())
            .unwrap();
        fuse(at, &[&MOUNTS[..], &["-o", "nav.csv", "--force"]].concat())
    };
    let line = |text: &str, name: &str| text.lines().find(|l| l.starts_with(name)).unwrap_or_default().to_owned();
    let (_, plain, _) = rewrite(&|_| {});
    let taken = line(&plain, "left, limb");
    assert!(taken.contains(" taken, 0 refused"), "{plain}");
    let doubled: String = rows.lines().flat_map(|row| [row, "\n", row, "\n"]).collect();
    std::fs::write(at.join("left.csv"), format!("{header}\n{doubled}")).unwrap();
    let (_, said, _) = fuse(at, &[&MOUNTS[..], &["-o", "nav.csv", "--force"]].concat());
    assert_eq!(line(&said, "left, limb"), taken, "{said}");
    assert!(said.contains(": an earlier row has the same body and time\n"), "{said}");
    assert_eq!(line(&said, "verdict"), line(&plain, "verdict"));
    let six = |cov: &str| ["xx", "xy", "xz", "yy", "yz", "zz"].map(|end| column(&format!("{cov}_{end}")));
    let scale = |cells: &mut Vec<String>, place: usize, factor: f64| {
        cells[place] = cells[place].parse::<f64>().map_or(String::new(), |x| (x * factor).to_string());
    };
    let (of_cov, of_common) = (six("cov"), six("cov_common"));
    let larger = |cells: &mut Vec<String>| {
        for (cov, common) in of_cov.into_iter().zip(of_common) {
            cells[common] = cells[cov].parse::<f64>().map_or(String::new(), |x| (2.0 * x).to_string());
        }
    };
    let tiny = |cells: &mut Vec<String>| of_cov.into_iter().for_each(|place| scale(cells, place, 1e-280));
    let long = |cells: &mut Vec<String>| {
        if cells[column("status")] == "ok" {
            cells[column("axis_x")] = "1e308".into();
        }
    };
    type Change<'a> = &'a dyn Fn(&mut Vec<String>);
    let cases: [(Change<'_>, &str); 3] =
        [(&larger, "are larger than the whole"), (&tiny, "are smaller than the rounding"), (&long, "has the length 1")];
    for (change, why) in cases {
        let (_, said, errors) = rewrite(change);
        let all = said + &errors;
        assert!(all.contains("no answer has such numbers") && all.contains(why), "{why} in {all}");
        assert!(all.contains("left has no usable measurement") && !all.contains("left, limb"), "{all}");
    }
    std::fs::write(at.join("left.csv"), format!("{header}\n")).unwrap();
    let (_, said, errors) = fuse(at, &[&MOUNTS[..], &["-o", "nav.csv", "--force"]].concat());
    let all = said + &errors;
    assert!(all.contains("left has no usable measurement among its 0 rows") && all.contains("left.csv"), "{all}");
    assert!(!all.contains("consistent"), "{all}");
}

/// The single-precision covariances of `hzn run --flight` are slightly indefinite; the filter takes them all the same.
#[test]
fn every_answer_of_the_flight_program_is_used() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    let hzn = |args: &[&str]| {
        let out = assert_cmd::Command::cargo_bin("hzn").unwrap().current_dir(at).args(args).output().unwrap();
        assert!(out.status.success(), "{args:?}: {}", String::from_utf8_lossy(&out.stderr));
        String::from_utf8(out.stdout).unwrap()
    };
    std::fs::write(at.join("short.toml"), SCENE).unwrap();
    std::fs::write(at.join("mount.toml"), "[mount]\nq_vehicle_from_camera_wxyz = [1.0, 0.0, 0.0, 0.0]\n").unwrap();
    hzn(&["simulate", "short.toml", "-o", "out"]);
    // The first attitude is that of a star tracker: the scene has no second direction.
    let vehicle = std::fs::read_to_string(at.join("out/vehicle.csv")).unwrap();
    let fields: Vec<&str> = vehicle.lines().nth(2).unwrap().split(',').collect();
    let attitude = format!("time_s,qw,qx,qy,qz,sigma_deg\n{},{},0.5\n", fields[0], fields[7..].join(","));
    std::fs::write(at.join("attitude.csv"), attitude).unwrap();
    let fuse = || {
        let files = ["--imu", "out/imu.csv", "--gnss", "out/gnss.csv", "--attitude", "attitude.csv"];
        let camera = ["fuse", "--nadir", "cam.csv", "--mount", "cam=mount.toml", "-o", "nav.csv", "--force"];
        hzn(&[&camera[..], &files].concat())
    };
    let fused = |flight: &[&str]| {
        hzn(&[&["run", "out", "-o", "cam.csv", "--force"], flight].concat());
        let said = fuse();
        assert!(said.contains("cam, limb              40 taken, 0 refused"), "{said}");
        assert!(!said.contains("not usable"), "{said}");
        hzn_fuse::read_back::read_solution(&at.join("nav.csv")).unwrap().states
    };
    let (host, flight) = (fused(&[]), fused(&["--flight"]));
    // The whole chain from pictures to a solve, against the truth. The gyros of this scene are worse than the defaults.
    let worse = "[imu]\ngyro_bias_deg_h = { mode = \"estimated\", sigma = 180.0 }\n";
    std::fs::write(at.join("fuse.toml"), worse).unwrap();
    let files = ["--imu", "out/imu.csv", "--gnss", "out/gnss.csv", "--attitude", "attitude.csv"];
    let camera = ["fuse", "--nadir", "cam.csv", "--mount", "cam=mount.toml", "-o", "solve.csv", "--solve"];
    let said = hzn(&[&camera[..], &files, &["--config", "fuse.toml", "--truth", "out/vehicle.csv"]].concat());
    let ((_, filter_m), (errors, solve_m)) = (told_errors(&said, "filter"), told_errors(&said, "solve"));
    assert!(errors.iter().all(|deg| *deg < 1.0) && solve_m < filter_m, "{said}");
    assert_eq!(host.len(), flight.len());
    for (a, b) in host.iter().zip(&flight) {
        let apart = [a.yaw_deg - b.yaw_deg, a.pitch_deg - b.pitch_deg, a.roll_deg - b.roll_deg];
        let sigmas = [a.sigma_x_deg, a.sigma_y_deg, a.sigma_z_deg];
        let smallest = sigmas.into_iter().flatten().fold(f64::INFINITY, f64::min);
        assert!(apart.iter().all(|d| d.abs() < 0.01 * smallest), "{} s: {apart:?} of {smallest}", a.time_s);
    }

    // What cannot be used is counted with its reason.
    spoil_two_rows(&at.join("cam.csv"));
    let said = fuse();
    for line in [
        "not usable             2\n",
        "  cam                  1: a number of the axis, the position or a covariance is missing\n",
        "  cam                  1: no answer has such numbers\n",
    ] {
        assert!(said.contains(line), "{line} in {said}");
    }
}
