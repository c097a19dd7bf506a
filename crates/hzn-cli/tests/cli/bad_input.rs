//! Every wrong input gets a message that says what to do, and no picture is lost.

use crate::common::{Place, cell, crc32, limb, without_time};
use image::{DynamicImage, ImageFormat};

#[test]
fn wrong_keys_and_values_of_the_sensor() {
    let place = Place::with_pictures(1);
    let with = |rest: &str| {
        place.write("in/sensor.toml", format!("{}{rest}", crate::common::SENSOR).as_bytes());
        place.run(&["run", "in"]).expect(2).err
    };
    insta::assert_snapshot!(with("[consensus]\nthreshold_pxx = 3.0\n"), @"error: in/sensor.toml:16: [consensus] \
        threshold_pxx: unknown key; did you mean threshold_px?");
    insta::assert_snapshot!(with("[consensus]\nthreshold_px = -1\n"), @"error: in/sensor.toml:16: [consensus] threshold_px: \
        -1 is refused: must be above 0");
    insta::assert_snapshot!(with("[threshold]\nmethod = \"otzu\"\n"), @r#"error: in/sensor.toml:16: [threshold] method: "otzu" is not a valid value; did you mean otsu?"#);
    let camera = |from: &str, to: &str| {
        place.write("in/sensor.toml", crate::common::SENSOR.replace(from, to).as_bytes());
        place.run(&["run", "in"]).expect(2).err
    };
    insta::assert_snapshot!(camera("fx_px = 300.0", "fx_px = nan"), @"error: in/sensor.toml:7: [camera] fx_px: nan is \
        refused: must be a finite number");
    insta::assert_snapshot!(camera("width = 320", "width = 70000"), @"error: in/sensor.toml:4: [camera] width: 70000 \
        is refused: must be between 2 and 65535");
    insta::assert_snapshot!(camera("cx_px", "k = [0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]\ncx_px"), @"error: \
        in/sensor.toml:9: [camera] k: has 12 numbers; at most 5 are allowed");
    place.write(
        "in/sensor.toml",
        crate::common::SENSOR.replace("\"pinhole\"", "\"kannala-brandt\"\nk = [-0.9]").as_bytes(),
    );
    place.run(&["run", "in"]).expect(2).says("monotone");
    place.write("in/sensor.toml", crate::common::SENSOR.replace("altitude_km = 400.0", "").as_bytes());
    place.run(&["run", "in"]).expect(2).says("give --altitude-km");
    place.run(&["run", "in", "--altitude-km", "400"]).expect(0);
    place.run(&["run", "in", "--altitude-km", "NaN"]).expect(2).says("must be a finite number");
    std::fs::remove_file(place.path("in/sensor.toml")).unwrap();
    place.run(&["run", "in"]).expect(2).says("hzn init");
}

#[test]
fn wrong_rows_of_frames_csv() {
    let place = Place::with_pictures(2);
    let with = |text: &str| {
        place.write("in/frames.csv", text.as_bytes());
        place.run(&["run", "in"])
    };
    let err = with("file,altitude_km\n0000.png,NaN\n").expect(2).err;
    insta::assert_snapshot!(err, @r#"error: in/frames.csv:2: 0000.png altitude_km: "NaN" is not a finite number; leave the cell empty if it is not known"#);
    let err = with("file,altitude_km\n0000.png,400\n0001.png,-3\n").expect(2).err;
    insta::assert_snapshot!(err, @"error: in/frames.csv:3: 0001.png: altitude_km must be a finite number above -1 \
                                   (kilometres), not -3");
    let err = with("file,x_km,y_km,z_km\n0000.png,6000,0,-0.5\n").expect(2).err;
    insta::assert_snapshot!(err, @"error: in/frames.csv:2: 0000.png: x_km, y_km, z_km must be finite and outside the \
                                   body (fixed frame, kilometres), not 6000, 0, -0.5");
    let err = with("file,altitude_km,attitude_sigma_deg\n0000.png,400,-1\n").expect(2).err;
    insta::assert_snapshot!(err, @"error: in/frames.csv:2: 0000.png: attitude_sigma_deg must be a finite number, 0 or \
                                   more, not -1");
    with("name,altitude_km\n0000.png,400\n").expect(2).says("the column `file` is missing");
    let ran = with("file,altitude_km\n0000.png,400\n0001.png,400\n0009.png,400\n").expect(0);
    assert_eq!(without_time(&ran.out).len(), 2);
    ran.says("warning: in/frames.csv:4: 0009.png: no such picture in the folder");
    // Line ends of Windows do not change the number of the line.
    let wide = "file,x_km,y_km,z_km\r\n0000.png,6771000,0,0\r\n";
    with(wide).expect(0).says("warning: in/frames.csv:2: 0000.png: the position is at");
    let sigma = with("file,altitude_km,altitude_sigma_km\n0000.png,400,1\n").expect(0).err;
    assert!(sigma.contains("altitude_sigma_km: unknown column") && sigma.contains("body.altitude_sigma_km"), "{sigma}");
    with("file,altitude_km\nC:\\in\\0000.PNG,400\n")
        .expect(0)
        .says("the names match those of the pictures if upper and lower case do not count");
    with("file,altitude_km\nin/0000.png,400\n").expect(0).says("pictures without their folders; the column file has");
}

#[test]
fn one_wrong_entry_of_a_list_is_told_alone() {
    let place = Place::with_pictures(3);
    let ran = place.run(&["run", "in/0000.png", "in", "in/0001.png"]).expect(3);
    let statuses: Vec<String> = without_time(&ran.out).iter().map(|row| cell(row, "status").to_owned()).collect();
    assert_eq!(statuses, ["ok", "unreadable", "ok"]);
    ran.says("unreadable: ");
    place.run(&["run", "in", "in"]).expect(2).says("a folder cannot be combined with other inputs");
    // A calibration says which of its pictures do not count.
    let list = ["in/0000.png", "in/0001.png", "in/0009.png", "-s", "in/sensor.toml", "-q"];
    for command in ["noise", "sky", "check"] {
        let ran = place.run(&[&["calibrate", command], &list[..]].concat());
        assert!(ran.code != 0, "{command}");
        ran.says("warning: 1 picture could not be read and does not count: 0009.png (");
    }
}

#[test]
fn the_sensor_of_another_camera_is_reported_once() {
    let place = Place::with_pictures(5);
    let other = crate::common::SENSOR.replace("width = 320", "width = 640").replace("height = 240", "height = 480");
    let other = other.replace("159.5", "319.5").replace("119.5", "239.5");
    place.write("other.toml", other.as_bytes());
    place.write("p.raw", &[0; 100]);
    place.run(&["run", "in", "-o", "a.mcap"]).expect(0);
    let err = place.run(&["run", "in", "-s", "other.toml", "-o", "b.csv"]).expect(2).err;
    insta::assert_snapshot!(err, @"error: the sensor is for pictures of 640 x 480 px, but none of the pictures has this size: 0000.png \
                                   is 320 x 240; use the sensor of this camera, or set camera.width and \
                                   height and scale focal lengths and centre with them");
    assert!(!place.path("b.csv.part").exists());
    place.run(&["run", "a.mcap", "-s", "other.toml"]).expect(2).says("0000.png is 320 x 240");
    place.run(&["run", "p.raw", "-s", "other.toml", "--raw", "320x240:mono8"]).expect(2).says("p.raw is 320 x 240");
    // One picture of the sensor's size is enough; the others become unreadable rows.
    limb(640, 480, 0.0).save(place.path("in/0003.png")).unwrap();
    place.run(&["run", "in", "-s", "other.toml"]).expect(3).says("4 unreadable");
}

/// Returns a PNG whose header claims a size, as an attacker or a flipped bit would write it.
fn png_of_size(width: u32, height: u32) -> Vec<u8> {
    let mut bytes = Vec::new();
    limb(2, 2, 0.0).write_to(&mut std::io::Cursor::new(&mut bytes), ImageFormat::Png).unwrap();
    bytes[16..20].copy_from_slice(&width.to_be_bytes());
    bytes[20..24].copy_from_slice(&height.to_be_bytes());
    let crc = crc32(&bytes[12..29]).to_be_bytes();
    bytes[29..33].copy_from_slice(&crc);
    bytes
}

#[test]
fn broken_pictures_are_records_and_the_run_goes_on() {
    let place = Place::with_pictures(1);
    let whole = std::fs::read(place.path("in/0000.png")).unwrap();
    let mut jpeg = Vec::new();
    limb(320, 240, 1.0).write_to(&mut std::io::Cursor::new(&mut jpeg), ImageFormat::Jpeg).unwrap();
    place.write("in/b-empty.png", b"");
    place.write("in/c-cut.png", &whole[..whole.len() / 2]);
    place.write("in/d-cut.jpg", &jpeg[..jpeg.len() / 2]);
    place.write("in/e-text.png", b"this is no picture");
    place.write("in/f-huge.png", &png_of_size(60_000, 60_000));
    place.write("in/g-none.png", &png_of_size(0, 7));
    limb(100, 50, 0.0).save(place.path("in/h-small.png")).unwrap();
    DynamicImage::ImageLuma8(limb(320, 240, 0.0)).into_rgba16().save(place.path("in/i-sixteen.png")).unwrap();
    place.write("in/j-good.jpg", &jpeg);
    let ran = place.run(&["run", "in", "-o", "out.csv"]).expect(3).says("7 unreadable");
    assert!(ran.err.contains("unreadable: h-small.png: picture is 100x50 but the camera is 320x240"), "{}", ran.err);
    let rows = place.rows("out.csv");
    let shown: Vec<String> =
        rows.iter().map(|r| format!("{} {}: {}", cell(r, "file"), cell(r, "status"), cell(r, "detail"))).collect();
    let has = |i: usize, text: &str| assert!(shown[i].contains(text), "{} lacks {text:?}", shown[i]);
    has(0, "0000.png ok");
    has(1, "unreadable: file is empty");
    has(2, "unreadable: PNG");
    has(3, "the file is truncated");
    has(4, "is not a picture of a supported format");
    has(5, "picture of 60000x60000 is larger than the limit of 20000 px a side");
    has(6, "unreadable: ");
    has(7, "but the camera is 320x240");
    has(8, "i-sixteen.png ok");
    has(9, "j-good.jpg ok");
}

/// Returns a PNG with a palette, written by hand with stored blocks of deflate.
fn palette_png(image: &image::GrayImage) -> Vec<u8> {
    let chunk = |kind: &[u8], data: &[u8]| {
        let body = [kind, data].concat();
        [&(data.len() as u32).to_be_bytes()[..], &body, &crc32(&body).to_be_bytes()].concat()
    };
    let rows: Vec<u8> = image.as_raw().chunks(image.width() as usize).flat_map(|r| [&[0u8][..], r].concat()).collect();
    let mut zlib = vec![0x78, 0x01];
    let mut blocks = rows.chunks(60_000).peekable();
    while let Some(block) = blocks.next() {
        zlib.push(u8::from(blocks.peek().is_none()));
        zlib.extend((block.len() as u16).to_le_bytes());
        zlib.extend((!(block.len() as u16)).to_le_bytes());
        zlib.extend(block);
    }
    let (a, b) = rows.iter().fold((1u32, 0u32), |(a, b), &v| {
        let a = (a + u32::from(v)) % 65521;
        (a, (b + a) % 65521)
    });
    zlib.extend((b << 16 | a).to_be_bytes());
    let mut header = Vec::new();
    header.extend(image.width().to_be_bytes());
    header.extend(image.height().to_be_bytes());
    header.extend([8, 3, 0, 0, 0]);
    let palette: Vec<u8> = (0..=255u8).flat_map(|v| [v, v, v]).collect();
    let parts = [chunk(b"IHDR", &header), chunk(b"PLTE", &palette), chunk(b"IDAT", &zlib), chunk(b"IEND", b"")];
    [b"\x89PNG\r\n\x1a\n".to_vec(), parts.concat()].concat()
}

#[test]
fn palettes_are_read_and_animations_refused_by_name() {
    let place = Place::with_pictures(1);
    place.write("in/palette.png", &palette_png(&limb(320, 240, 0.0)));
    place.write("in/film.gif", b"GIF89a\x01\x00\x01\x00");
    place.write("in/zgif.png", b"GIF89a\x01\x00\x01\x00\x00\x00\x00;");
    let ran = place.run(&["run", "in"]).expect(3).says("1 file ending in .gif was left out");
    let rows = without_time(&ran.out);
    assert_eq!(cell(&rows[0], "axis_y"), cell(&rows[1], "axis_y"));
    assert_eq!(cell(&rows[2], "status"), "unreadable");
}

#[cfg(unix)]
#[test]
fn unwritable_folders_are_reported() {
    let place = Place::with_pictures(1);
    // A file is in the place of the folder. Missing permissions would not stop a test that runs as root.
    place.write("file", b"");
    let told = |option: &str, path: &str| place.run(&["run", "in", option, path]).expect(1).err;
    insta::assert_snapshot!(told("-o", "file/out.csv"), @"error: file/out.csv.part: a part of this path is a file, not \
                                                          a folder; choose another folder for the output");
    insta::assert_snapshot!(told("-o", "file/out.mcap"), @"error: cannot write into the folder file: Not a directory \
                                                           (os error 20); make it writable or choose another");
    insta::assert_snapshot!(told("-o", "nowhere/out.csv"), @"error: nowhere/out.csv.part: the folder does not exist; \
        create it first");
    insta::assert_snapshot!(told("--overlay", "file"), @"error: file: is a file, not a folder; choose another name");
    insta::assert_snapshot!(told("--overlay", "file/drawn"), @"error: file/drawn: a part of this path is a file, not a \
        folder; choose another folder for the output");
    assert_eq!(place.read("file"), "");
}

#[test]
fn pictures_of_nothing_come_with_advice() {
    let place = Place::new();
    image::GrayImage::new(320, 240).save(place.path("in/black.png")).unwrap();
    let mut stars = image::GrayImage::from_pixel(320, 240, image::Luma([2]));
    (0..60u32).for_each(|i| stars.put_pixel(i * 97 % 320, i * 53 % 240, image::Luma([200])));
    stars.save(place.path("in/stars.png")).unwrap();
    let told = |name: &str| place.run(&["explain", name]).expect(0).out;
    assert!(told("in/black.png").contains("no bright pixel in the sample of 4352 places: nothing is in view"));
    assert!(told("in/stars.png").contains("for example of stars, noise or hot pixels"), "{}", told("in/stars.png"));
    place.run(&["run", "in"]).expect(0).says("nothing was found in any picture").says("hzn explain in/black.png\n");
    limb(320, 240, 0.0).save(place.path("in/z.png")).unwrap();
    assert!(!place.run(&["run", "in"]).expect(0).err.contains("nothing was found"));
}

#[test]
fn a_wrong_length_of_headerless_pictures_is_reported() {
    let place = Place::new();
    std::fs::create_dir(place.path("raw")).unwrap();
    for (name, bytes) in [("short", 76_000), ("three", 230_400), ("more", 76_812)] {
        place.write(&format!("raw/{name}.raw"), &vec![0; bytes]);
    }
    let ran = place.run(&["run", "raw", "--raw", "320x240:mono8", "-s", "in/sensor.toml"]).expect(3);
    for text in [
        "short.raw: 76000 bytes, but a picture of 320x240:mono8 has 76800: 800 less",
        "three.raw: 230400 bytes, but a picture of 320x240:mono8 has 76800: these are 3 pictures",
        "more.raw: 76812 bytes, but a picture of 320x240:mono8 has 76800: 12 bytes more",
    ] {
        assert!(ran.err.contains(text), "{text} in {}", ran.err);
    }
}

#[test]
fn what_looks_wrong_is_a_warning_and_the_run_goes_on() {
    let place = Place::with_pictures(1);
    let told = |from: &str, to: &str| {
        place.write("in/sensor.toml", crate::common::SENSOR.replace(from, to).as_bytes());
        place.run(&["run", "in"]).expect(0).err
    };
    let swapped = told("cx_px = 159.5\ncy_px = 119.5", "cx_px = 20\ncy_px = 119.5");
    assert!(
        swapped.contains("warning: in/sensor.toml:9: [camera] cx_px: the centre (20, 119.5) is far from"),
        "{swapped}"
    );
    let metres = told("altitude_km = 400.0", "altitude_km = 400000.0");
    assert!(metres.contains("[body] altitude_km: 400000 km is implausibly large: is it in metres?"), "{metres}");
    let moon = told("earth-sphere", "moon");
    insta::assert_snapshot!(moon.lines().next().unwrap(), @r#"warning: in/sensor.toml:14: [body] altitude_km: is not used: kind = "moon" is the Moon as a disc of half a degree, as seen from near the Earth; for a camera in orbit around the Moon write kind = "sphere", radius_km = 1737.4, limb_height_km = 0.0, limb_height_sigma_km = 5.2, clipped_height_km = 0.0, clipped_sigma_km = 0.0 (`hzn init --body moon` does)"#);
    // With the Moon as a second body, the altitude is still the altitude above the Earth.
    let two = crate::common::SENSOR.replace("[body]", "[[bodies]]") + "[[bodies]]\nkind = \"moon\"\n";
    place.write("in/sensor.toml", two.as_bytes());
    place.write("in/frames.csv", b"file,altitude_km\n0000.png,400\n");
    for more in [&[][..], &["--altitude-km", "400"]] {
        let ran = place.run(&[&["run", "in"], more].concat()).expect(0);
        assert!(!ran.err.contains("warning"), "{}", ran.err);
    }
    place.write("in/sensor.toml", crate::common::SENSOR.as_bytes());
    place.write("in/frames.csv", b"file,altitude_km\n0000.png,517500\n");
    place.run(&["run", "in"]).expect(0).says("frames.csv:2: 0000.png: altitude_km is 517500, which is implausibly");
    place
        .run(&["run", "in", "--altitude-km", "517500"])
        .expect(0)
        .says("warning: the altitude of all pictures: 517500 km is implausibly");
}
