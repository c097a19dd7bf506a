//! Videos, through ffmpeg: times, Ctrl-C, and truncated files.

use std::process::{Command, Stdio};

use crate::common::{NO_TONE, Place, Ran, SENSOR, angle_deg, axes, cell, without_time};

/// Returns whether ffmpeg and ffprobe are on PATH. Without them the test `what` is skipped, but never in CI.
fn decoder(what: &str) -> bool {
    let there = ["ffmpeg", "ffprobe"].iter().all(|tool| {
        let started = Command::new(tool).arg("-version").stdout(Stdio::null()).status();
        started.is_ok_and(|s| s.success())
    });
    if !there {
        assert!(std::env::var("CI").as_deref() != Ok("true"), "{what} needs ffmpeg and ffprobe on PATH");
        eprintln!("{what} left out: no ffmpeg and ffprobe on PATH");
    }
    there
}

/// Returns whether this ffmpeg has an encoder that is not in every build.
fn encoder(name: &str) -> bool {
    let listed = Command::new("ffmpeg").args(["-v", "error", "-encoders"]).output().unwrap();
    String::from_utf8_lossy(&listed.stdout).split_whitespace().any(|word| word == name)
}

/// Makes a video. `before` and `coding` are the arguments of ffmpeg before and after the name of the pictures.
#[track_caller]
fn make(place: &Place, before: &[&str], input: &str, coding: &[&str], name: &str) {
    let made = Command::new("ffmpeg")
        .args(["-nostdin", "-v", "error"])
        .args(before)
        .arg("-i")
        .arg(place.path(input))
        .args(coding)
        .arg(place.path(name))
        .stderr(Stdio::null())
        .status();
    assert!(made.unwrap().success(), "{name}");
}

fn run(place: &Place, name: &str) -> Ran {
    place.run(&["run", name, "-s", "in/sensor.toml"])
}

fn column(ran: &Ran, name: &str) -> Vec<String> {
    without_time(&ran.out).iter().map(|r| cell(r, name).to_owned()).collect()
}

#[test]
fn videos_made_and_read_by_the_real_ffmpeg() {
    if !decoder("videos_made_and_read_by_the_real_ffmpeg") {
        return;
    }
    let place = Place::with_pictures(6);
    place.write("in/sensor.toml", format!("{SENSOR}{NO_TONE}").as_bytes());
    let pictures = axes(&place, &["run", "in"]);
    // The videos are lossless with 10 bits of luma; lossy with 8 bits of limited range; lossless without a luma plane.
    for (name, coding, within_deg) in [
        ("deep.mkv", &["-c:v", "ffv1", "-pix_fmt", "yuv420p10le"][..], 0.01),
        ("lossy.mp4", &["-c:v", "mpeg4", "-q:v", "2", "-pix_fmt", "yuv420p"], 0.05),
        ("colour.avi", &["-c:v", "rawvideo", "-pix_fmt", "bgr24"], 0.01),
    ] {
        make(&place, &["-framerate", "4"], "in/%04d.png", coding, name);
        let ran = run(&place, name).expect(0);
        assert_eq!(column(&ran, "time_s"), ["0.0", "0.25", "0.5", "0.75", "1.0", "1.25"], "{name}");
        assert_eq!(column(&ran, "file"), (0..6).map(|i| format!("{name}#{i:06}")).collect::<Vec<_>>());
        for (found, of_picture) in axes(&place, &["run", name, "-s", "in/sensor.toml"]).iter().zip(&pictures) {
            let off = angle_deg(*found, *of_picture);
            assert!(off < within_deg, "{name}: {off}");
        }
    }
    // The file has only the ending of a video.
    place.write("text.mp4", b"this is no video");
    run(&place, "text.mp4").expect(2).says("ffprobe cannot read it");
}

/// A container says that a pixel is wider than high, as cameras with 1440 columns for 16:9 write it.
#[test]
fn pixels_that_are_not_square_are_told() {
    if !decoder("pixels_that_are_not_square_are_told") {
        return;
    }
    let place = Place::with_pictures(3);
    let coding = ["-vf", "scale=240:240,setsar=4/3", "-c:v", "ffv1"];
    make(&place, &["-framerate", "4"], "in/%04d.png", &coding, "wide.mkv");
    place
        .run(&["init", "wide.mkv", "--fov", "60", "--altitude", "400", "-o", "s.toml"])
        .expect(0)
        .says("1.333 times as wide as high");
    let text = place.read("s.toml");
    assert!(text.contains("fx_px = 207.8\nfy_px = 277.1\n"), "{text}");
    let ran = place.run(&["run", "wide.mkv", "-s", "s.toml"]);
    assert!(!ran.err.contains("wide as high") && !ran.err.contains("not square"), "{}", ran.err);
    place.write("square.toml", text.replace("fy_px = 277.1", "fy_px = 207.8").as_bytes());
    let ran = place.run(&["run", "wide.mkv", "-s", "square.toml"]);
    assert!(ran.err.contains("set fy_px to 277.1"), "{}", ran.err);
}

/// These videos have data next to their frames, which ffprobe also lists.
#[test]
fn every_frame_has_its_own_time() {
    if !decoder("every_frame_has_its_own_time") {
        return;
    }
    let place = Place::with_pictures(8);
    let mut seen = 0;
    for (codec, name) in [("mpeg2video", "mpeg2.mkv"), ("libx264", "h264.mp4"), ("libx265", "h265.mp4")] {
        if encoder(codec) {
            // MPEG-2 allows only a few frame rates.
            let coding = ["-vf", "setpts=PTS+gt(N\\,4)/TB", "-fps_mode", "vfr", "-c:v", codec, "-pix_fmt", "yuv420p"];
            make(&place, &["-framerate", "25"], "in/%04d.png", &coding, name);
            let ran = run(&place, name).expect(0);
            assert_eq!(
                column(&ran, "time_s"),
                ["0.0", "0.04", "0.08", "0.12", "0.16", "1.2", "1.24", "1.28"],
                "{name}"
            );
            seen += 1;
        }
    }
    assert!(seen > 0);
}

/// Shell scripts in place of `ffmpeg` and `ffprobe` that give frames of 320x240. The tests check how the programs are
/// called and read, not the decoding.
#[cfg(unix)]
struct Scripts {
    place: Place,
}

#[cfg(unix)]
impl Scripts {
    fn new() -> Self {
        let place = Place::new();
        let frames: Vec<u8> =
            [0.0, 5.0, 6.0].iter().flat_map(|&s| crate::common::limb(320, 240, s).into_raw()).collect();
        place.write("frames.gray", &frames);
        place.write("in/film.mp4", b"not looked at");
        std::fs::create_dir(place.path("bin")).unwrap();
        Self { place }
    }
    /// Writes the scripts: `stamps` makes ffprobe list the frames, and `end` is what ffmpeg does after three frames.
    fn write(&self, stamps: &str, end: &str) {
        use std::os::unix::fs::PermissionsExt;
        let probe = format!(
            "#!/bin/sh\ncase \"$*\" in *best_effort*) {stamps};; \
             *) printf 'width=320\\nheight=240\\npix_fmt=yuv420p\\nnb_frames=N/A\\n';; esac\n"
        );
        let ffmpeg = format!(
            "#!/bin/sh\ncase \"$*\" in *extractplanes=y*passthrough*|*passthrough*extractplanes=y*) \
             /bin/cat frames.gray;; *) exit 1;; esac\n{end}\n"
        );
        for (name, script) in [("bin/ffprobe", probe), ("bin/ffmpeg", ffmpeg)] {
            self.place.write(name, script.as_bytes());
            std::fs::set_permissions(self.place.path(name), std::fs::Permissions::from_mode(0o755)).unwrap();
        }
    }
    fn run(&self, stamps: &str, end: &str) -> Ran {
        self.write(stamps, end);
        self.with_path("bin")
    }
    fn with_path(&self, path: &str) -> Ran {
        let output = self.place.command(&["run", "in/film.mp4"]).env("PATH", self.place.path(path)).output().unwrap();
        Ran::from_output(&output, &self.place.path(""))
    }
}

#[cfg(unix)]
#[test]
fn frames_of_a_video_go_by_one_clock() {
    let scripts = Scripts::new();
    let time = |s: &&str| format!("echo best_effort_timestamp_time={s}; ");
    let times = |stamps: &[&str]| {
        let ran = scripts.run(&(stamps.iter().map(time).collect::<String>() + "true"), "").expect(0);
        assert_eq!(column(&ran, "file"), ["film.mp4#000000", "film.mp4#000001", "film.mp4#000002"]);
        assert_eq!(column(&ran, "status"), ["ok"; 3]);
        assert_eq!(ran.err.contains("without a time"), column(&ran, "time_s").contains(&String::new()), "{}", ran.err);
        column(&ran, "time_s")
    };
    assert_eq!(times(&["0.04", "0.12", "0.13"]), ["0.04", "0.12", "0.13"]);
    // A frame without a time, or that is missing in the list, has no time; its number is not used instead.
    assert_eq!(times(&["0.04", "N/A", "0.13"]), ["0.04", "", "0.13"]);
    assert_eq!(times(&["N/A", "0.12", "0.13"]), ["", "0.12", "0.13"]);
    assert_eq!(times(&["0.04", "0.12"]), ["0.04", "0.12", ""]);
    // There are no times at all.
    assert_eq!(times(&["N/A", "N/A", "N/A"]), ["0.0", "1.0", "2.0"]);
    assert_eq!(times(&[]), ["0.0", "1.0", "2.0"]);
    scripts.with_path("in").expect(2).says("install ffmpeg");
}

#[cfg(unix)]
#[test]
fn the_end_of_ffmpeg_is_reported() {
    let scripts = Scripts::new();
    let ends = |end: &str| {
        let ran = scripts.run("echo best_effort_timestamp_time=0.1", end);
        assert_eq!(without_time(&ran.out).len(), 3, "{end}: {}", ran.err);
        ran
    };
    ends("").expect(0);
    let ran = ends("echo '[x @ 0x1] File ended prematurely' >&2").expect(3);
    let told =
        "warning: in/film.mp4: was cut off or is damaged (ffmpeg: File ended prematurely); 3 frames could be decoded";
    ran.says(told);
    ends("exit 69").expect(3).says("ffmpeg ended with code 69");
    ends("echo x").expect(3).says("(it ends in the middle of a frame)");
    // Someone else ends ffmpeg; the results so far can be continued.
    ends("kill -9 $$").expect(1).says("ffmpeg was ended from outside after 3 frames");
    ends("exit 255").expect(1).says("ffmpeg was ended from outside after 3 frames");
    scripts.place.write("frames.gray", b"");
    scripts
        .run("", "echo 'no good' >&2; exit 1")
        .expect(1)
        .says("no frame of this video can be decoded: ffmpeg: no good");
}

#[test]
fn a_truncated_video_is_reported() {
    if !decoder("a_truncated_video_is_reported") {
        return;
    }
    let place = Place::with_pictures(40);
    for (name, coding) in [
        // ffmpeg reports nothing for this file.
        ("ffv1.avi", &["-c:v", "ffv1"][..]),
        ("colour.avi", &["-c:v", "rawvideo", "-pix_fmt", "bgr24"]),
        ("mpeg2.mkv", &["-c:v", "mpeg2video"]),
        ("mpeg4.mp4", &["-c:v", "mpeg4", "-movflags", "faststart"]),
    ] {
        make(&place, &["-framerate", "25"], "in/%04d.png", coding, name);
        let whole = run(&place, name).expect(0);
        assert!(without_time(&whole.out).len() == 40 && !whole.err.contains("warning"), "{name}: {}", whole.err);
        let bytes = std::fs::read(place.path(name)).unwrap();
        let cut = format!("cut-{name}");
        place.write(&cut, &bytes[..bytes.len() / 2]);
        let ran = run(&place, &cut).expect(3);
        let frames = without_time(&ran.out).len();
        assert!(0 < frames && frames < 40, "{name}: {frames}");
        ran.says(&format!("warning: {cut}: was cut off or is damaged (")).says(&format!("; {frames} frames could be"));
    }
}

/// The container counts more frames than are shown.
#[test]
fn frames_left_out_on_purpose_are_no_loss() {
    if !decoder("frames_left_out_on_purpose_are_no_loss") {
        return;
    }
    let place = Place::with_pictures(40);
    // The first video has an edit list; the second has empty frames, which repeat the frame before.
    let from = ["-framerate", "25"];
    make(&place, &from, "in/%04d.png", &["-c:v", "mpeg4", "-g", "20"], "whole.mp4");
    make(&place, &["-ss", "1.0"], "whole.mp4", &["-c", "copy"], "late.mp4");
    let gaps = ["-vf", "select=not(mod(n\\,3))", "-fps_mode", "vfr", "-c:v", "mpeg4"];
    make(&place, &from, "in/%04d.png", &gaps, "gaps.avi");
    for (name, frames) in [("late.mp4", 15), ("gaps.avi", 14)] {
        let ran = run(&place, name).expect(0);
        assert_eq!(without_time(&ran.out).len(), frames, "{name}");
        assert!(!ran.err.contains("warning"), "{name}: {}", ran.err);
    }
}

/// Sends the signal as a terminal does: to all processes that were started.
#[cfg(unix)]
#[test]
fn a_video_interrupted_with_all_its_helpers_can_be_continued() {
    use std::os::unix::process::CommandExt;
    use std::time::{Duration, Instant};
    // There are sixty frames, and ffprobe is slow for each. Most likely the run waits for ffprobe when the signal
    // comes.
    let scripts = Scripts::new();
    let stamps =
        "i=10; while [ $i -lt 70 ]; do echo best_effort_timestamp_time=0.$i; i=$((i+1)); /bin/sleep 0.02; done";
    let more = "i=1; while [ $i -lt 20 ]; do /bin/cat frames.gray; i=$((i+1)); done";
    scripts.write(stamps, more);
    let hzn = |args: &[&str]| {
        let mut command = scripts.place.command(&["run", "in/film.mp4", "-o"]);
        command.args(args).env("PATH", scripts.place.path("bin"));
        command
    };
    let ran = |args: &[&str]| Ran::from_output(&hzn(args).output().unwrap(), &scripts.place.path("")).expect(0);
    // The helper repeats its pictures, so most have no answer.
    ran(&["whole.csv"]).says("60 pictures:");
    let mut cut = hzn(&["a.csv", "-j", "1"]).process_group(0).stderr(Stdio::null()).spawn().unwrap();
    let begin = Instant::now();
    // Rows are counted, not bytes: the signal must not come when only the header is written.
    let lines = || std::fs::read_to_string(scripts.place.path("a.csv.part")).map_or(0, |text| text.lines().count());
    let begun = || lines() > 3;
    while !begun() && begin.elapsed() < Duration::from_secs(30) && cut.try_wait().unwrap().is_none() {
        std::thread::sleep(Duration::from_millis(2));
    }
    Command::new("kill").args(["-INT", "--", &format!("-{}", cut.id())]).status().unwrap();
    assert_eq!(cut.wait().unwrap().code(), Some(130));
    let begun = scripts.place.rows("a.csv").len();
    assert!(0 < begun && begun < 60, "{begun}");
    ran(&["a.csv", "--resume"]).says(&format!("(after {begun} that were finished before)"));
    assert_eq!(without_time(&scripts.place.read("a.csv")), without_time(&scripts.place.read("whole.csv")));
}

#[test]
fn one_colour_of_a_video_and_its_rotation() {
    if !decoder("one_colour_of_a_video_and_its_rotation") {
        return;
    }
    // The limb is in blue. Red and green are bright everywhere and have more weight in the luma.
    let place = Place::new();
    for i in 0..3 {
        let grey = crate::common::limb(320, 240, f64::from(i));
        let colours = image::RgbImage::from_fn(320, 240, |x, y| image::Rgb([230, 230, grey.get_pixel(x, y).0[0]]));
        colours.save(place.path(&format!("in/{i}.png"))).unwrap();
    }
    let sensor = |more: &str| place.write("in/sensor.toml", format!("{SENSOR}{NO_TONE}{more}").as_bytes());
    sensor("channel = \"blue\"\n");
    let pictures = axes(&place, &["run", "in"]);
    for (name, coding) in [
        ("rgb.avi", &["-c:v", "rawvideo", "-pix_fmt", "bgr24"][..]),
        ("yuv.mkv", &["-c:v", "ffv1", "-pix_fmt", "yuv444p"]),
        ("deep.mkv", &["-c:v", "ffv1", "-pix_fmt", "yuv444p12le"]),
    ] {
        make(&place, &["-framerate", "10"], "in/%d.png", coding, name);
        let found = axes(&place, &["run", name, "-s", "in/sensor.toml"]);
        assert_eq!(found.len(), 3, "{name}");
        for (a, b) in found.iter().zip(&pictures) {
            assert!(angle_deg(*a, *b) < 0.01, "{name}: {a:?} {b:?}");
        }
        place.run(&["explain", name, "-s", "in/sensor.toml", "--index", "1"]).expect(0);
    }
    // The luma gives another direction, or none.
    sensor("");
    let luma = run(&place, "yuv.mkv").expect(0);
    assert!(
        column(&luma, "status").iter().all(|s| s != "ok")
            || column(&luma, "axis_y")[0] != format!("{}", pictures[0][1])
    );
    // The container asks for a turn, which is not made without being asked for.
    make(&place, &[], "rgb.avi", &["-c:v", "mpeg4", "-q:v", "1"], "plain.mp4");
    let turned = |before: &[&str], coding: &[&str]| {
        let mut tool = Command::new("ffmpeg");
        tool.args(["-nostdin", "-v", "error", "-y"]).args(before).arg("-i").arg(place.path("plain.mp4"));
        let made = tool.args(["-c", "copy"]).args(coding).arg(place.path("turned.mp4")).stderr(Stdio::null()).status();
        made.unwrap().success()
    };
    // The option of ffmpeg 6 counts counter-clockwise. In older versions the written tag also counts counter-clockwise.
    assert!(turned(&["-display_rotation", "-90"], &[]) || turned(&[], &["-metadata:s:v:0", "rotate=270"]));
    run(&place, "turned.mp4").expect(0).says("turned.mp4 is to be shown turned by 90 degrees clockwise");
}
