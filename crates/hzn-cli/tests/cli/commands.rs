//! The smaller commands.

use crate::common::{Place, cell};
use hzn_mcap::palette;
use image::{GrayImage, Luma, RgbImage};

/// Returns the row in which a column crosses the limb of [`crate::common::limb`].
fn true_row(x: f64) -> f64 {
    let (s, c) = 68f64.to_radians().sin_cos();
    let (u, cos) = ((x - 159.5) / 300.0, 70.38f64.to_radians().cos());
    // The equation is v s + c = cos √(1 + u² + v²); the root depends only slightly on v.
    let v = (0..30).fold(0.0f64, |v, _| (cos * (1.0 + u * u + v * v).sqrt() - c) / s);
    119.5 + 300.0 * v
}

/// The place in the picture where the axis of [`disc`] is, in pixels.
const AXIS_PX: [f64; 2] = [159.5 + 300.0 * 0.05, 119.5 + 300.0 * 0.08];

/// Returns the distance of a place of the picture beyond the rim of [`disc`], in pixels at the picture's centre.
fn beyond_px([x, y]: [f64; 2]) -> f64 {
    let ray = |[x, y]: [f64; 2]| [(x - 159.5) / 300.0, (y - 119.5) / 300.0, 1.0];
    let (a, b) = (ray([x, y]), ray(AXIS_PX));
    let dot = |a: [f64; 3], b: [f64; 3]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let cos = dot(a, b) / (dot(a, a) * dot(b, b)).sqrt();
    300.0 * (cos.clamp(-1.0, 1.0).acos() - 15f64.to_radians())
}

/// Returns a folder with the picture of a bright disc of 15° half-angle.
fn disc() -> Place {
    let place = Place::new();
    let body = "kind = \"sphere\"\nradius_km = 1000.0\nlimb_height_km = 0.0\naltitude_km = 2863.7033";
    let sensor = crate::common::SENSOR.replace("kind = \"earth-sphere\"\naltitude_km = 400.0", body);
    place.write("in/sensor.toml", sensor.as_bytes());
    let picture = GrayImage::from_fn(320, 240, |x, y| {
        let inside_px = -beyond_px([f64::from(x), f64::from(y)]);
        Luma([(20.0 + 180.0 * (0.5 + inside_px / 2.0).clamp(0.0, 1.0)) as u8])
    });
    picture.save(place.path("in/disc.png")).unwrap();
    place
}

/// Returns the pixels of the picture, without its caption, that have about this colour: lines have smooth edges.
fn places(drawn: &RgbImage, colour: [u8; 3]) -> Vec<[f64; 2]> {
    let is_like = |p: &image::Rgb<u8>| p.0.iter().zip(colour).all(|(a, b)| a.abs_diff(b) < 70);
    let alike = drawn.enumerate_pixels().filter(|(_, y, p)| *y < 240 && is_like(p));
    alike.map(|(x, y, _)| [f64::from(x), f64::from(y)]).collect()
}

#[test]
fn init_writes_what_run_takes() {
    let place = Place::new();
    place.run(&["init", "-o", "new.toml"]).expect(0);
    place.run(&["init", "-o", "new.toml"]).expect(2).says("exists already");
    place.run(&["init", "other.toml"]).expect(2).says("hzn init -o other.toml");
    let shown = place.run(&["camera", "show", "new.toml"]).expect(0).out;
    assert!(shown.contains("1920 x 1080 px") && shown.contains("field of view"), "{shown}");
    assert!(shown.contains("half-angle 70.637"), "{shown}");
}

#[test]
fn explain_shows_every_stage() {
    let place = Place::with_pictures(2);
    let out = place.run(&["explain", "in/0001.png", "--overlay", "o.png"]).expect(0).out;
    for word in
        ["picture", "expected", "threshold", "contour", "candidates", "chosen", "status      ok", "sigma", "time"]
    {
        assert!(out.contains(word), "{word} in {out}");
    }
    let overlay = image::open(place.path("o.png")).unwrap();
    let caption = hzn_run::overlay::caption::height_px(320, 240);
    assert_eq!((overlay.width(), overlay.height()), (320, 240 + caption), "a caption is below the picture");
    image::GrayImage::from_pixel(320, 240, image::Luma([9])).save(place.path("in/black.png")).unwrap();
    let out = place.run(&["explain", "in/black.png"]).expect(0).out;
    assert!(out.contains("try         "), "{out}");
    place.run(&["explain", "in", "--index", "9"]).expect(2).says("numbered from 0");
}

/// Without the distortion of the lens, the limb is a conic section, and the direction down is in view although the
/// picture does not show it.
#[test]
fn an_undistorted_overlay_shows_section_and_axis() {
    let place = Place::with_pictures(1);
    let [plain, undistorted] = [&[][..], &["--undistorted"]].map(|more| {
        let args = [&["explain", "in/0000.png", "--overlay", "o.png", "--force"], more].concat();
        let told = place.run(&args).expect(0).err;
        (told, image::open(place.path("o.png")).unwrap().to_rgb8())
    });
    let count = |picture: &image::RgbImage, colour: [u8; 3]| picture.pixels().filter(|p| p.0 == colour).count();
    use hzn_mcap::palette::{AXIS, LIMB};
    assert!(!plain.0.contains("undistorted"), "{}", plain.0);
    assert_eq!(count(&plain.1, AXIS), 0, "the axis is outside of the picture");
    assert!(undistorted.0.contains("the limb is a hyperbola with the semi-axes"), "{}", undistorted.0);
    assert!(undistorted.0.contains("is the cross"), "{}", undistorted.0);
    assert!(count(&undistorted.1, AXIS) > 20 && count(&undistorted.1, LIMB) > 100);
    assert_eq!(undistorted.1.dimensions(), plain.1.dimensions());
    place.run(&["explain", "in/0000.png", "--undistorted"]).expect(2).says("--overlay");
}

#[test]
fn info_claims_no_more_than_it_knows() {
    let place = Place::with_pictures(4);
    place.run(&["run", "in", "-o", "a.csv"]).expect(0);
    let out = place.run(&["info", "a.csv"]).expect(0).out;
    let digits = |word: &str| word.chars().filter(char::is_ascii_digit).collect::<String>();
    for line in out.lines().filter(|l| l.contains(", 90 % from ")) {
        for number in line.split_whitespace().filter(|w| w.contains('.')) {
            assert!(digits(number).trim_start_matches('0').len() <= 3, "{line}");
        }
    }
    assert!(out.contains(", 90 % from "), "{out}");
}

#[test]
fn info_knows_results_of_other_versions() {
    let place = Place::with_pictures(2);
    place.run(&["run", "in", "-o", "a.csv"]).expect(0);
    let table = std::fs::read_to_string(place.path("a.csv")).unwrap();
    let without = |column: &str| -> String {
        let place = table.lines().next().unwrap().split(',').position(|c| c == column).unwrap();
        let mut rows: Vec<Vec<&str>> = table.lines().map(|line| line.split(',').collect()).collect();
        for row in &mut rows {
            row.remove(place);
        }
        rows.iter().map(|row| row.join(",") + "\n").collect()
    };
    assert!(!place.run(&["info", "a.csv"]).expect(0).out.contains("columns"));
    std::fs::write(place.path("old.csv"), without("pitch_deg")).unwrap();
    let out = place.run(&["info", "old.csv"]).expect(0).out;
    assert!(out.contains("results of hzn run") && out.contains("ok               2 (100.0 %)"), "{out}");
    assert!(out.contains("columns missing  pitch_deg ("), "{out}");
    std::fs::write(place.path("new.csv"), table.replace("pitch_deg", "pitch_of_tomorrow")).unwrap();
    let out = place.run(&["info", "new.csv"]).expect(0).out;
    assert!(out.contains("columns missing  pitch_deg (") && out.contains("unknown  pitch_of_tomorrow ("), "{out}");
    // Without a column that every row needs, the rows cannot be read; the message lists the columns.
    std::fs::write(place.path("short.csv"), without("detail")).unwrap();
    place.run(&["info", "short.csv"]).expect(1).says("columns missing  detail (");
}

#[test]
fn overlays_of_a_run() {
    let place = Place::with_pictures(2);
    place.run(&["run", "in", "--overlay", "drawn", "-q"]).expect(0);
    let drawn = image::open(place.path("drawn/0000.png")).unwrap().into_rgb8();
    let (limb, inliers) = (places(&drawn, palette::LIMB), places(&drawn, palette::INLIER));
    // The line of the limb is five pixels wide.
    for [x, y] in limb.iter().chain(&inliers) {
        assert!((y - true_row(*x)).abs() <= 3.0, "{x}, {y}: the limb is in row {}", true_row(*x));
    }
    // The limb reaches from one side to the other, and points lie on it.
    for x in (0..320).step_by(16).map(f64::from) {
        // Points lie densely on the line, and cover its middle.
        assert!(limb.iter().any(|p| (p[0] - x).abs() <= 8.0), "no limb about column {x}");
        assert!(inliers.iter().any(|p| (p[0] - x).abs() <= 2.0), "no inliers about column {x}");
    }
    assert!(places(&drawn, palette::AXIS).is_empty());
}

#[test]
fn the_axis_is_marked_where_it_is() {
    let place = disc();
    place.run(&["run", "in", "--overlay", "drawn", "-q"]).expect(0);
    let drawn = image::open(place.path("drawn/disc.png")).unwrap().into_rgb8();
    let mark = places(&drawn, palette::AXIS);
    for k in 0..2 {
        let (low, high) = mark.iter().fold((f64::MAX, f64::MIN), |(low, high), p| (low.min(p[k]), high.max(p[k])));
        assert!(((low + high) / 2.0 - AXIS_PX[k]).abs() <= 1.0, "{k}: {low} to {high}");
        assert!((20.0..40.0).contains(&(high - low)), "{k}: {low} to {high}");
    }
    let limb = places(&drawn, palette::LIMB);
    assert!(limb.len() > 300 && limb.iter().all(|p| beyond_px(*p).abs() <= 2.5), "{}", limb.len());
}

/// Foxglove counts pixels from the corner of the first pixel, so annotations are the true places plus half a pixel.
#[test]
fn annotations_count_from_the_corner() {
    use prost::Message;
    let place = disc();
    place.run(&["run", "in", "-o", "out.mcap", "-q"]).expect(0);
    let bytes = std::fs::read(place.path("out.mcap")).unwrap();
    let messages = mcap::MessageStream::new(&bytes).unwrap().map(Result::unwrap);
    let of_ours =
        |m: &mcap::Message<'_>| m.channel.schema.as_ref().is_some_and(|s| s.name.ends_with("ImageAnnotations"));
    let drawn: Vec<_> = messages
        .filter(of_ours)
        .flat_map(|m| foxglove::messages::ImageAnnotations::decode(&*m.data).unwrap().points)
        .collect();
    let of = |kind: &str| -> Vec<[f64; 2]> {
        let own = drawn.iter().filter(|p| p.metadata.iter().any(|m| m.key == "kind" && m.value == kind));
        own.flat_map(|p| p.points.iter().map(|p| [p.x - 0.5, p.y - 0.5])).collect()
    };
    // Points on all four sides show a shift along either axis.
    for kind in ["inlier", "limb"] {
        let points = of(kind);
        assert!(points.len() > 200, "{} of {kind}", points.len());
        let worst = points.iter().map(|p| beyond_px(*p).abs()).fold(0.0, f64::max);
        assert!(worst < 0.15, "{kind}: {worst} px");
    }
    let cross = of("axis");
    for k in 0..2 {
        let mean = cross.iter().map(|p| p[k]).sum::<f64>() / cross.len() as f64;
        assert!((mean - AXIS_PX[k]).abs() < 0.3, "axis: {mean}, not {}", AXIS_PX[k]);
    }
}

#[test]
fn overlays_replace_nothing_without_force() {
    let place = Place::with_pictures(2);
    let before = std::fs::read(place.path("in/0001.png")).unwrap();
    place.run(&["run", "in", "--overlay", "in"]).expect(2).says("is the folder of the pictures");
    place.run(&["run", "in", "--overlay", "in", "--force"]).expect(2).says("is the folder of the pictures");
    std::fs::create_dir(place.path("notes")).unwrap();
    place.write("notes/mine.txt.png", b"mine");
    place.run(&["run", "in", "--overlay", "notes"]).expect(2).says("contains files already");
    place.run(&["run", "in", "--overlay", "notes", "--force"]).expect(0);
    place.run(&["explain", "in/0001.png", "--overlay", "in/0001.png"]).expect(2).says("is the input itself");
    place.run(&["explain", "in/0001.png", "--overlay", "in/0001.png", "--force"]).expect(2).says("is the input itself");
    place.run(&["explain", "in/0001.png", "--overlay", "in/sensor.toml"]).expect(2).says("must be .png");
    place.run(&["explain", "in/0001.png", "--overlay", "notes/0001.png"]).expect(2).says("--force replaces it");
    place.run(&["explain", "in/0001.png", "--overlay", "notes/0001.png", "--force"]).expect(0);
    assert_eq!(std::fs::read(place.path("in/0001.png")).unwrap(), before);
    assert_eq!(place.read("notes/mine.txt.png"), "mine");
}

#[test]
fn completions_for_every_shell() {
    let place = Place::new();
    for shell in ["bash", "zsh", "fish"] {
        assert!(place.run(&["completions", shell]).expect(0).out.contains("explain"));
    }
}

#[test]
fn wrong_usage_is_2() {
    let place = Place::new();
    place.run(&["frobnicate"]).expect(2);
    place.run(&["run"]).expect(2);
    place.run(&["export", "in/sensor.toml"]).expect(2).says("nothing to export");
    place.run(&["run", "in"]).expect(2).says("no pictures");
    let place = Place::with_pictures(1);
    for (args, what) in [
        (&["--fps", "-1"][..], "--fps: must be above 0"),
        (&["--fps", "0"], "--fps: must be above 0"),
        (&["--altitude-km", "-5"], "the altitude of all pictures: body.altitude_km"),
        (&["-j", "0"], "0 is not in 1.."),
        (&["--no-images", "-o", "a.csv"], "--no-images: only an MCAP"),
        (&["--topic", "/x"], "only an MCAP has topics; leave out --topic"),
        (&["--resume"], "--output <FILE>"),
        (&["-o", "a.csv", "--resume", "--force"], "cannot be used with"),
        (&["-s", "nowhere.toml"], "hzn init"),
        (&["--frames", "nowhere.csv"], "no such file"),
        (&["--raw", "10x10"], "for example 1920x1080:mono12"),
    ] {
        place.run(&[&["run", "in"], args].concat()).expect(2).says(what);
    }
    place.run(&["info", "nowhere"]).expect(2).says("nowhere: no such file");
    place.run(&["recover", "in/0000.png"]).expect(2).says("is not a file of results");
    place.write("other.csv", b"a,b\n1,2\n");
    place.run(&["recover", "other.csv"]).expect(1).says("other.csv: does not have the columns");
    place.run(&["export", "other.csv", "-o", "x.csv"]).expect(1).says("other.csv:1: not a table of hzn results");
    assert!(!place.path("other.recovered.csv.part").exists());
}

/// A copy that was cut off says which command keeps its rows, and does not pass for an empty table.
#[test]
fn cut_tables_name_the_command_that_keeps_their_rows() {
    let place = Place::with_pictures(3);
    for kind in ["csv", "jsonl"] {
        let (whole, cut) = (format!("all.{kind}"), format!("cut.{kind}"));
        place.run(&["run", "in", "-o", &whole]).expect(0);
        let text = std::fs::read(place.path(&whole)).unwrap();
        place.write(&cut, &text[..text.len() - 40]);
        for command in [&["export", &cut, "-o", &format!("{kind}-out.csv")][..], &["info", &cut]] {
            place.run(command).expect(1).says("not a row of hzn results").says("`hzn recover FILE` keeps");
        }
        place.run(&["recover", &cut]).expect(0).says("2 rows kept");
    }
    for (name, text) in [("empty.csv", &b""[..]), ("head.csv", b"index,file,ti")] {
        place.write(name, text);
        let out = place.run(&["export", name, "-o", &format!("{name}-out.csv")]).expect(1);
        out.says("not a table of hzn results: it has no column");
    }
}

#[test]
fn demo_compares_with_the_truth() {
    let place = Place::new();
    let out = place.run(&["demo", "d", "--count", "3"]).expect(0).out;
    assert!(out.contains("3 of 3 pictures with a limb in view (100.0 %)"), "{out}");
    assert!(out.contains("Photograph from the ISS") && out.contains("altitude from the limb"), "{out}");
    for file in ["flight/sensor.toml", "flight/frames.csv", "flight/truth.csv", "flight.mcap", "flight.csv", "iss.mcap"]
    {
        assert!(place.path("d").join(file).exists(), "{file}");
    }
    place.run(&["demo", "d"]).expect(2).says("exists already");
    // The documents show what the demo prints of the photograph, which does not depend on the number of pictures.
    for document in ["README.md", "book/guide/first-steps.md"] {
        let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").join(document);
        let text = std::fs::read_to_string(path).unwrap();
        let is_printed =
            |line: &&str| line.starts_with("axis in the camera ") || line.starts_with("altitude from the ");
        let shown: Vec<&str> = text.lines().map(str::trim).filter(is_printed).collect();
        assert!(shown.len() == 2 && shown.iter().all(|line| out.contains(line)), "{document}: {shown:#?}\n{out}");
    }
}

#[test]
fn a_telecommand_has_values_that_can_be() {
    let place = Place::new();
    let set = |pair: &str| place.command(&["telecommand", &format!("set {pair}")]).output().unwrap();
    let refused = |pair: &str| {
        let ran = crate::common::Ran::from_output(&set(pair), &place.path("")).expect(2);
        assert!(ran.out.is_empty());
        ran.err.trim_end().split_once("\": ").unwrap().1.to_owned()
    };
    assert_eq!(refused("camera.fx_px nan"), "camera.fx_px cannot be nan: it must be a finite number above 0");
    assert_eq!(
        refused("brightness.max_mean 1.5"),
        "brightness.max_mean cannot be 1.5: it must be a finite number from 0 to 1"
    );
    assert_eq!(
        refused("threshold.method 7"),
        "threshold.method cannot be 7: it must be one of 0 otsu, 1 fixed, 2 dynamic"
    );
    assert!(refused("camera.width 640.5").contains("cannot be 640.5: it must be a whole number from"));
    assert!(refused("consensus.threshold_px -1").contains("above 0, to 1000"));
    assert!(refused("camera.theta_max_deg 200").contains("or NaN to leave it out"));
    assert!(refused("telemetry.housekeeping_every 0").contains("from 1 to 65535"));
    assert!(refused("gates.max_rms_px much").contains("cannot be much: it must be"));
    assert!(refused("200 inf").contains("mask corners cannot be inf"));
    place.run(&["telecommand", "known -5"]).expect(2).says("the altitude -5 km is refused: must be above 0");
    place.run(&["telecommand", "known 230 1e40 0 0"]).expect(2).says("not a finite number of kilometres");
    assert!(refused("limits.max_work 2e6").contains("to 983040"));
    assert!(refused("line.apid_base 5000").contains("from 16 to 1792"));
    place.run(&["telecommand", "ping", "--apid-base", "0x101"]).expect(2).says("multiple of 16");
    place.run(&["telecommand", "navigate 1 2 3"]).expect(2).says("9 or 12 numbers");
    let half = "navigate 5 60 NaN 6608 nan 0 0 7300 0";
    place
        .run(&["telecommand", half])
        .expect(2)
        .says("all three numbers of the position must be known, or none: y is NaN");
    place.run(&["telecommand", "navigate 5 60 NaN 6608 0 0 0 7300 0", "-o", "n.bin"]).expect(0);
    assert_eq!(std::fs::metadata(place.path("n.bin")).unwrap().len(), 21 + 52);
    place.run(&["telecommand", "navigate 2026-11-24T12:00:00Z 60 NaN 6608 0 0 0 7300 0", "-o", "u.bin"]).expect(0);
    // P-field of TAI, then 2174212837 seconds: `date -u -d 2026-11-24T12:00:00 +%s`, 37 s and 4383 days.
    let sent = std::fs::read(place.path("u.bin")).unwrap();
    assert_eq!(sent[19..27], [0x1F, 0x81, 0x97, 0xDA, 0xE5, 0, 0, 0], "{:x?}", &sent[19..27]);
    place.run(&["telecommand", "attitude 5 60 1 0 0 0"]).expect(2).says("7 or 10 numbers");
    place.run(&["telecommand", "attitude 5 NaN 1 0 0 0 3"]).expect(2).says("the expiry NaN s is refused");
    place.run(&["telecommand", "attitude 5 60 1 1 0 0 3"]).expect(2).says("quaternion must be 1 within 0.01");
    place.run(&["telecommand", "attitude 5 60 1 0 0 0 3 1 NaN 0"]).expect(2).says("SUN_Y is NaN");
    place.run(&["telecommand", "attitude 5 60 1 0 0 0 3", "-o", "a.bin"]).expect(0);
    let sent = std::fs::read(place.path("a.bin")).unwrap();
    // The function, and after time and expiry the scalar part of the quaternion.
    assert_eq!((sent.len(), sent[18], &sent[31..35]), (21 + 44, 16, &1f32.to_be_bytes()[..]));
    assert_eq!(set("gates.fixed_edge warn").stdout, set("133 1").stdout);
    place.run(&["telecommand", "time 12:00"]).expect(2).says("is not a time in UTC");
    place.run(&["telecommand", "time 2026-01-01T00:00:00.5Z pulse"]).expect(2).says("a whole second");
    place.run(&["telecommand", "stage"]).expect(2).says("there is no such command");
    // A choice by name gives the same command as by number. An optional value may be NaN.
    let (named, numbered) = (set("threshold.method fixed"), set("50 1"));
    assert!(named.status.success() && named.stdout == numbered.stdout);
    for pair in ["camera.theta_max_deg NaN", "1000 -3.5", "camera.k -0.1", "200 4 201 3 body.kind moon"] {
        assert!(set(pair).status.success(), "{pair}");
    }
}

#[test]
fn init_from_a_field_of_view_works_at_once() {
    let place = Place::with_pictures(2);
    // The pictures were drawn with a pinhole of 300 px.
    let says = "320 x 240 px, pinhole, 56.1 degrees wide, f = 300 px";
    place.run(&["init", "in", "--fov", "56.145", "--altitude", "400", "-o", "s.toml"]).expect(0).says(says);
    assert!(place.read("s.toml").contains("[camera.covariance]"), "{}", place.read("s.toml"));
    place.run(&["run", "in", "--sensor", "s.toml", "-o", "r.csv"]).expect(0);
    for row in place.rows("r.csv") {
        let number = |name: &str| cell(&row, name).parse::<f64>().unwrap();
        assert_eq!(cell(&row, "status"), "ok", "{row:?}");
        assert!((number("axis_y").atan2(number("axis_z")).to_degrees() - 68.0).abs() < 3.0 * number("sigma_max_deg"));
    }
    // The field of view is 5 % wrong; sigma covers the resulting error.
    place.run(&["init", "in", "--fov", "58.8", "--altitude", "400", "-o", "off.toml"]).expect(0);
    place.run(&["run", "in", "--sensor", "off.toml", "-o", "off.csv"]).expect(0);
    for row in place.rows("off.csv") {
        let number = |name: &str| cell(&row, name).parse::<f64>().unwrap();
        assert_eq!(cell(&row, "status"), "ok", "{row:?}");
        let off_deg = number("axis_y").atan2(number("axis_z")).to_degrees() - 68.0;
        assert!(off_deg.abs() > 0.1 && off_deg.abs() < 3.0 * number("sigma_max_deg"), "{off_deg} {row:?}");
    }
    place.run(&["init", "in", "-o", "s.toml"]).expect(2).says("exists already");
    place.run(&["init", "in", "-o", "t.toml"]).expect(2).says("--fov");
    place.run(&["init", "in", "--fov", "92", "-o", "t.toml"]).expect(2).says("--lens");
    place.run(&["init", "in", "--fov", "92", "--lens", "fisheye", "-o", "t.toml"]).expect(0).says("needs an altitude");
    assert!(place.read("t.toml").contains("model = \"kannala-brandt\"") && place.read("t.toml").contains("k = [0.0]"));
    place.run(&["init", "--fov", "92"]).expect(2);
}

#[test]
fn init_reads_the_focal_length_that_the_camera_wrote() {
    let place = Place::new();
    // The focal length is 40 mm on film of 36 x 24 mm, with a diagonal of 43.27 mm.
    place.write("in/a.jpg", &jpeg_with_exif(10, 40));
    let says = "pinhole, 46.8 degrees wide, f = 370 px";
    place.run(&["init", "in/a.jpg", "-o", "s.toml"]).expect(0).says(says);
    let text = place.read("s.toml");
    assert!(text.contains("# X-1\n") && text.contains("equivalent to 40 mm on 35 mm film"), "{text}");
    // This field of view contradicts the EXIF.
    place.run(&["init", "in/a.jpg", "--fov", "80", "-o", "t.toml"]).expect(0).says("warning").says("contradicts");
}

#[test]
fn init_wants_pictures_of_one_size() {
    let place = Place::with_pictures(1);
    crate::common::limb(160, 120, 0.0).save(place.path("in/small.png")).unwrap();
    let ran = place.run(&["init", "in", "--fov", "56", "-o", "s.toml"]).expect(2);
    ran.says("320x240").says("small.png").says("160x120");
    assert!(!place.path("s.toml").exists());
}

/// Returns a JPEG of the limb with a focal length in its EXIF, in millimetres and as on 35 mm film.
fn jpeg_with_exif(focal_mm: u32, on_film_mm: u16) -> Vec<u8> {
    let mut jpeg = std::io::Cursor::new(Vec::new());
    crate::common::limb(320, 240, 0.0).write_to(&mut jpeg, image::ImageFormat::Jpeg).unwrap();
    let jpeg = jpeg.into_inner();
    // One directory has the model and the offset of another: FocalLength (a fraction at its end),
    // FocalLengthIn35mmFilm.
    let entry = |tag: u16, kind: u16, count: u32, value: u32| {
        [&tag.to_le_bytes()[..], &kind.to_le_bytes(), &count.to_le_bytes(), &value.to_le_bytes()].concat()
    };
    let directory =
        |entries: &[Vec<u8>]| [&(entries.len() as u16).to_le_bytes()[..], &entries.concat(), &[0; 4]].concat();
    let model = u32::from_le_bytes(*b"X-1\0");
    let tiff = [
        &b"II*\0\x08\0\0\0"[..],
        &directory(&[entry(0x110, 2, 4, model), entry(0x8769, 4, 1, 38)]),
        &directory(&[entry(0x920a, 5, 1, 68), entry(0xa405, 3, 1, on_film_mm.into())]),
        &(10 * focal_mm).to_le_bytes(),
        &10u32.to_le_bytes(),
    ]
    .concat();
    let length = u16::try_from(tiff.len() + 8).unwrap().to_be_bytes();
    [&jpeg[..2], &[0xff, 0xe1], &length, b"Exif\0\0", &tiff, &jpeg[2..]].concat()
}
