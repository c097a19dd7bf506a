//! What looks like a mistake is told, and what cannot be used says what would help.

use image::codecs::jpeg::JpegEncoder;
use image::{ImageEncoder, ImageFormat};

use crate::common::{Place, SENSOR, cell, limb, without_time};

/// Returns EXIF with `DateTimeOriginal`, as piexif of picamera2 writes it: the block ends after the last entry, without
/// the pointer to a next directory.
fn exif_without_pointer(stamp: &str) -> Vec<u8> {
    let entry = |tag: u16, kind: u16, count: u32, value: u32| {
        [&tag.to_be_bytes()[..], &kind.to_be_bytes(), &count.to_be_bytes(), &value.to_be_bytes()].concat()
    };
    let directory = |entry: Vec<u8>| [&1u16.to_be_bytes()[..], &entry].concat();
    let head = [b"MM\0*".as_slice(), &8u32.to_be_bytes()].concat();
    let text = [stamp.as_bytes(), b"\0"].concat();
    // The text lies between the two directories, so that the second one is the end of the block.
    let first = [directory(entry(0x8769, 4, 1, 46)), 0u32.to_be_bytes().to_vec()].concat();
    let second = directory(entry(0x9003, 2, text.len() as u32, 26));
    [head, first, text, second].concat()
}

fn write_jpeg(place: &Place, name: &str, exif: Vec<u8>) {
    let mut bytes = Vec::new();
    let mut encoder = JpegEncoder::new(&mut bytes);
    encoder.set_exif_metadata(exif).unwrap();
    limb(320, 240, 0.0).write_with_encoder(encoder).unwrap();
    place.write(name, &bytes);
}

#[test]
fn exif_that_ends_without_a_pointer_has_its_times() {
    let place = Place::new();
    write_jpeg(&place, "in/a.jpg", exif_without_pointer("1970:01:02 00:00:01"));
    write_jpeg(&place, "in/b.jpg", exif_without_pointer("1970:01:02 00:00:03"));
    let rows = without_time(&place.run(&["run", "in"]).expect(0).out);
    assert_eq!(rows.iter().map(|r| cell(r, "time_s")).collect::<Vec<_>>(), ["86401.0", "86403.0"]);
}

#[test]
fn exif_that_cannot_be_read_is_told() {
    let place = Place::new();
    write_jpeg(&place, "in/a.jpg", exif_without_pointer("yesterday at noon.."));
    let said = "gives no time of exposure (in/a.jpg: DateTimeOriginal \"yesterday at noon..\" is not a time)";
    place.run(&["run", "in"]).expect(0).says(said);
    // The list of entries is damaged, so that there is no time.
    write_jpeg(&place, "in/a.jpg", exif_without_pointer("1970:01:02 00:00:01")[..50].to_vec());
    place.run(&["run", "in"]).expect(0).says("the EXIF of the pictures gives no time of exposure (in/a.jpg: ");
}

#[test]
fn times_that_do_not_rise_are_told() {
    let place = Place::with_pictures(3);
    let with = |times: [&str; 3]| {
        let row = |(i, t): (usize, &str)| format!("000{i}.png,400,{t}\n");
        let rows: String = times.into_iter().enumerate().map(row).collect();
        place.write("in/frames.csv", format!("file,altitude_km,time_s\n{rows}").as_bytes());
        place.run(&["run", "in"]).expect(0).err
    };
    let back = with(["0", "2", "1"]);
    assert!(back.contains("the time goes back 1 time in the order of the pictures, first from 2 s of 0001.png to 1 s"));
    let equal = with(["7", "7", "7"]);
    assert!(equal.contains("warning: all 3 pictures have the same time, 7 s"), "{equal}");
    let right = with(["0", "1", "1"]);
    assert!(!right.contains("warning"), "{right}");
    assert!(with(["1605861000000", "1605861000500", "1605861001000"]).contains("is it in milliseconds?"));
}

#[test]
fn half_of_what_a_rolling_shutter_needs_is_told() {
    let place = Place::with_pictures(2);
    let with = |readout: &str, rate: &str| {
        place.write("in/sensor.toml", SENSOR.replace("[body]", &format!("{readout}\n[body]")).as_bytes());
        let rows =
            format!("file,time_s,altitude_km,rate_x,rate_y,rate_z\n0000.png,0,400,{rate}\n0001.png,1,400,{rate}\n");
        place.write("in/frames.csv", rows.as_bytes());
        place.run(&["run", "in"]).err
    };
    let missing = "2 of 2 rows have no rate_x, rate_y, rate_z, which camera.readout_s = 0.03 needs";
    assert!(with("readout_s = 0.03", ",,").contains(missing));
    let unsaid = "the rates reach 28.6 deg/s, and the sensor does not say how its rows are exposed";
    assert!(with("", "0,0.5,0").contains(unsaid));
    for (readout, rate) in [("readout_s = 0.03", "0,0.5,0"), ("readout_s = 0", "0,0.5,0"), ("", "0,0.01,0"), ("", ",,")]
    {
        let err = with(readout, rate);
        assert!(!err.contains("needs") && !err.contains("exposed"), "{readout}, {rate}: {err}");
    }
    // Without a table there are no rates at all.
    place.write("in/sensor.toml", SENSOR.replace("[body]", "readout_s = 0.03\n[body]").as_bytes());
    std::fs::remove_file(place.path("in/frames.csv")).unwrap();
    place.run(&["run", "in"]).expect(0).says("no rates are known, which camera.readout_s = 0.03 needs");
}

#[test]
fn rates_that_contradict_the_answers_are_told() {
    let place = Place::new();
    for i in 0..7 {
        let path = place.path(&format!("in/{i:04}.png"));
        // The camera turns up by half a degree from picture to picture.
        limb(320, 240, 10.0 * f64::from(i)).save_with_format(path, ImageFormat::Png).unwrap();
    }
    let with = |rate_x: f64| {
        let row = |i| format!("{i:04}.png,{i},400,{rate_x},0,0\n");
        let rows: String = (0..7).map(row).collect();
        let table = format!("file,time_s,altitude_km,rate_x,rate_y,rate_z\n{rows}");
        place.write("in/frames.csv", table.as_bytes());
        place.run(&["run", "in"]).expect(0).err
    };
    let right = with(0.5f64.to_radians());
    assert!(!right.contains("the rates miss"), "{right}");
    let degrees = with(0.5);
    assert!(degrees.contains("the axis turns by 0.50 deg from answer to answer, and the rates miss"), "{degrees}");
    assert!(degrees.contains("are they in degrees per second?"), "{degrees}");
    let negated = with(-0.5f64.to_radians());
    assert!(negated.contains("do they have the opposite sign?"), "{negated}");
}

#[test]
fn names_with_a_leading_dot_are_names_of_the_folder() {
    let place = Place::with_pictures(2);
    place.write("in/frames.csv", b"file,altitude_km,time_s\n./0000.png,400,5\n././0001.png,400,6\n");
    let rows = without_time(&place.run(&["run", "in"]).expect(0).out);
    assert_eq!(rows.iter().map(|r| cell(r, "time_s")).collect::<Vec<_>>(), ["5.0", "6.0"]);
    place.write("in/frames.csv", b"file,altitude_km\n./0000.png,400\n0000.png,400\n");
    place.run(&["run", "in"]).expect(2).says("is also in line 2");
}

#[cfg(unix)]
#[test]
fn a_link_to_a_folder_above_gives_no_further_pictures() {
    let place = Place::with_pictures(2);
    std::os::unix::fs::symlink("../in", place.path("in/loop")).unwrap();
    place.write("s.toml", SENSOR.as_bytes());
    let ran = place.run(&["run", "in/**/*.png", "-s", "s.toml"]).expect(0);
    assert_eq!(without_time(&ran.out).len(), 2);
}

#[test]
fn a_mask_of_everything_or_nothing_is_told() {
    let place = Place::with_pictures(1);
    let with = |polygon: &str| {
        place.write("in/sensor.toml", format!("{SENSOR}[mask]\npolygons_px = [{polygon}]\n").as_bytes());
        place.run(&["run", "in"]).err
    };
    assert!(with("[[-1, -1], [321, -1], [321, 241], [-1, 241]]").contains("[mask] polygons_px: covers the whole"));
    assert!(with("[[400, 0], [500, 0], [500, 90]]").contains("polygon 1 lies outside of the picture of 320 x 240 px"));
    assert!(!with("[[0, 0], [90, 0], [90, 90]]").contains("warning"));
}

#[test]
fn init_tells_what_its_file_will_tell() {
    let place = Place::with_pictures(1);
    let init = |args: &[&str]| place.run(&[&["init", "in", "-o", "s.toml", "--force"], args].concat());
    init(&["--fov", "56", "--altitude", "400000"]).expect(0).says("warning: s.toml:").says("is it in metres?");
    init(&["--fov", "179.9", "--lens", "pinhole"]).expect(2).says("at most 150 degrees").says("--lens fisheye");
    init(&["--fov", "190"]).expect(2).says("a lens of this width is a fisheye; add --lens fisheye");
    let moon = init(&["--fov", "56", "--body", "moon", "--altitude", "100"]).expect(0).err;
    assert!(!moon.contains("warning") && moon.contains("answers have no p_limb and no protection_deg"), "{moon}");
    let text = place.read("s.toml");
    assert!(text.contains("radius_km = 1737.4") && text.contains("limb_height_km = 0.0"), "{text}");
}

#[test]
fn inputs_of_another_kind_are_named() {
    let place = Place::with_pictures(1);
    place.write("bytes.bin", b"\xff\xfe");
    place.run(&["run", "in", "--sensor", "bytes.bin"]).expect(2).says("bytes.bin: is not text; a sensor.toml");
    place.run(&["run", "in", "--sensor", "in"]).expect(2).says("in: is a folder; name the sensor.toml in it");
    if cfg!(unix) {
        place.run(&["info", "/dev/null"]).expect(2).says("/dev/null: is a device, a pipe or a socket");
    }
    place.write("empty.csv", b"");
    place.run(&["run", "in", "--frames", "empty.csv"]).expect(2).says("empty.csv: is empty; its first line names");
    place.run(&["info", "empty.csv"]).expect(1).says("empty.csv: the table is empty");
    let comma = SENSOR.replace("fx_px = 300.0", "fx_px = 300,0");
    place.write("comma.toml", comma.as_bytes());
    place.run(&["run", "in", "-s", "comma.toml"]).expect(2).says("a number has a decimal comma; write a point");
    place.run(&["run", "in", "-j", "-1"]).expect(2).says("invalid value '-1' for '--jobs <N>'");
    place.run(&["ron", "in"]).expect(2).says("'run'");
    place.run(&["xyzzy", "in"]).expect(2).says("the commands are demo, run, explain");
    place.run(&["simulate"]).expect(2).says("hzn simulate rocket -o flight");
    place.run(&["simulate", "geo"]).expect(2).says("hzn simulate geo -o flight");
}

#[test]
fn pictures_of_other_formats_are_named() {
    let place = Place::with_pictures(1);
    place.write("a.gif", b"GIF89a");
    place.write("a.jp2", b"\0\0\0\x0cjP  \r\n\x87\n");
    place.write("s.toml", SENSOR.as_bytes());
    for (file, name) in [("a.gif", "GIF"), ("a.jp2", "JPEG 2000")] {
        let formats = "PNG, JPEG, TIFF, PNM, BMP, WebP, FITS, NumPy";
        let what = format!("is not a picture of a supported format ({formats}); it is {name}: convert");
        place.run(&["run", file, "-s", "s.toml"]).expect(3).says(&what);
    }
    let mut tiff = std::io::Cursor::new(Vec::new());
    let picture = image::DynamicImage::ImageLuma8(limb(320, 240, 0.0)).into_rgb32f();
    picture.write_to(&mut tiff, ImageFormat::Tiff).unwrap();
    place.write("in/float.tif", tiff.get_ref());
    place.run(&["run", "in/float.tif", "-s", "s.toml"]).expect(3).says("scale its samples to whole numbers of 8 or 16");
}

#[test]
fn a_scene_without_measured_noise_takes_no_further_pictures() {
    let place = Place::new();
    let ran = place.run(&["simulate", "horace", "--frames", "2", "--no-noise", "-o", "f"]).expect(0);
    assert!(!ran.err.contains("measuring"), "{}", ran.err);
    assert!(place.read("f/sensor.toml").contains("Limb height and noise are the defaults"));
    assert!(!place.read("f/sensor.toml").contains("sigma_px"), "{}", place.read("f/sensor.toml"));
}
