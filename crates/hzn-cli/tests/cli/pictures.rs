//! Kinds of pictures: the same scene gives the same direction in every coding.

use crate::common::{NO_TONE, Place, angle_deg, axes, cell, limb, without_time};
use image::codecs::jpeg::JpegEncoder;
use image::{DynamicImage, GrayImage, ImageEncoder, ImageFormat};

/// Returns the axis for the limb of `shift` in a plain 8-bit PNG, in the camera frame.
fn plain(shift: f64) -> [f64; 3] {
    let place = Place::new();
    limb(320, 240, shift).save(place.path("in/plain.png")).unwrap();
    axes(&place, &["run", "in"])[0]
}

#[test]
fn every_lossless_kind_gives_the_same_answer() {
    let place = Place::new();
    let grey = DynamicImage::ImageLuma8(limb(320, 240, 0.0));
    // The values of an alpha channel are not brightness.
    let mut clear = grey.to_rgba8();
    clear.pixels_mut().enumerate().for_each(|(i, p)| p.0[3] = (i % 251) as u8);
    for (name, picture) in [
        ("grey.png", grey.clone()),
        ("grey-alpha.png", DynamicImage::ImageLumaA8(grey.to_luma_alpha8())),
        ("colour.png", DynamicImage::ImageRgb8(grey.to_rgb8())),
        ("clear.png", DynamicImage::ImageRgba8(clear)),
        ("grey16.png", DynamicImage::ImageLuma16(grey.to_luma16())),
        ("colour16.png", DynamicImage::ImageRgb16(grey.to_rgb16())),
        ("grey.tif", grey.clone()),
        ("grey16.tif", DynamicImage::ImageLuma16(grey.to_luma16())),
        ("grey.bmp", grey.clone()),
        ("grey.pgm", grey.clone()),
        ("colour.webp", DynamicImage::ImageRgb8(grey.to_rgb8())),
    ] {
        picture.save(place.path(&format!("in/{name}"))).unwrap();
    }
    let found = axes(&place, &["run", "in"]);
    assert_eq!(found.len(), 11);
    let expected = plain(0.0);
    for axis in found {
        assert!(angle_deg(axis, expected) < 1e-3, "{axis:?} is not {expected:?}");
    }
}

#[test]
fn sixteen_bits_are_not_cut_to_eight() {
    let place = Place::new();
    // All brightness lies within one step of 8 bits, and so does the threshold.
    place.write(
        "in/sensor.toml",
        format!("{}[threshold]\nmethod = \"fixed\"\nlevel = 622.0\n", crate::common::SENSOR).as_bytes(),
    );
    let faint: Vec<u16> = limb(320, 240, 0.0).into_raw().into_iter().map(|v| 0x0200 + u16::from(v)).collect();
    let faint = image::ImageBuffer::<image::Luma<u16>, _>::from_raw(320, 240, faint).unwrap();
    faint.save(place.path("in/faint.png")).unwrap();
    let off = angle_deg(axes(&place, &["run", "in"])[0], plain(0.0));
    // With 8 bits there would be no edge here. With 16 bits the edge is faint: its points are at the global threshold
    // instead of the local one. It is also taken for a wide edge, because everything around it is bright. The edge is
    // rougher, so the expected limb height has more weight in the answer.
    assert!(off < 0.1, "{off}");
}

/// Returns a limb in 16-bit words, as a camera of few bits writes them; `of` maps each 8-bit sample to a word.
fn words(shift: f64, of: impl Fn(u16) -> u16) -> image::ImageBuffer<image::Luma<u16>, Vec<u16>> {
    let words = limb(320, 240, shift).into_raw().into_iter().map(|v| of(u16::from(v))).collect();
    image::ImageBuffer::from_raw(320, 240, words).unwrap()
}

#[test]
fn bits_are_found_once_for_a_sequence() {
    let bits_of = |of: &dyn Fn(u16) -> u16, first: &dyn Fn(u16) -> u16| {
        let place = Place::without_tone();
        words(0.0, first).save(place.path("in/0.png")).unwrap();
        words(0.0, of).save(place.path("in/1.png")).unwrap();
        let ran = place.run(&["run", "in"]).expect(0);
        let rows = without_time(&ran.out);
        let axis = ["axis_x", "axis_y", "axis_z"].map(|name| cell(&rows[1], name).parse().unwrap());
        let off = angle_deg(axis, plain(0.0));
        // If everything around is bright, the edge is taken for a wider and rougher one, so the expected limb height
        // has more weight.
        assert!(off < 0.1, "{off}");
        // A single picture is treated as one of its folder.
        let told = place.run(&["explain", "in/1.png"]).expect(0);
        let found = ran.err.split("assumed to have ").nth(1).map_or("16", |t| t.split(' ').next().unwrap());
        assert!(told.out.contains(&format!("1 channel of {found} bits")), "{}", told.out);
        found.to_owned()
    };
    let dark = |v: u16| v / 60;
    for (bits, most) in [(10, 1023u16), (12, 4095), (14, 16383), (16, 65535)] {
        let of = |v: u16| (u32::from(v) * u32::from(most) / 255) as u16;
        assert_eq!(bits_of(&of, &of), bits.to_string());
        // The first picture is dark, so the last one decides.
        assert_eq!(bits_of(&of, &dark), bits.to_string());
    }
    // A thermal camera has a range of 1200 counts far above 0.
    assert_eq!(bits_of(&|v| 7000 + v * 5, &|v| 7000 + v * 5), "14");
}

#[test]
fn a_picture_with_more_bits_than_the_others_is_unreadable() {
    let place = Place::new();
    for i in 0..33 {
        // Of 33 pictures 16 are examined; this one is not.
        let shift = if i == 9 { 4 } else { 2 };
        words(f64::from(i), |v| v << shift).save(place.path(&format!("in/{i:02}.png"))).unwrap();
    }
    let alone = place.run(&["run", "in", "-j", "1", "-o", "a.mcap"]).expect(3);
    let alone = alone.says("the largest 16-bit sample in 16 pictures is 800: the camera is assumed to have 10 bits");
    assert!(
        alone.err.contains("unreadable: 09.png: a sample of 3200 has more bits than input.bits = 10"),
        "{}",
        alone.err
    );
    let three = place.run(&["run", "in", "-j", "3"]).expect(3);
    place.run(&["export", "a.mcap", "-o", "a.csv"]).expect(0);
    assert_eq!(without_time(&place.read("a.csv")), without_time(&three.out));
    // The recorded sensor states the bits. The recording does not contain the lost picture.
    let again = place.run(&["run", "a.mcap"]).expect(3);
    assert!(!again.err.contains("assumed to have"), "{}", again.err);
    let axis = |rows: &[Vec<(String, String)>]| rows.iter().map(|r| cell(r, "axis_y").to_owned()).collect::<Vec<_>>();
    assert_eq!(axis(&without_time(&again.out)), axis(&without_time(&three.out)));
    place.write("in/sensor.toml", format!("{}[input]\nbits = 12\n", crate::common::SENSOR).as_bytes());
    let told = place.run(&["run", "in"]).expect(0);
    assert!(!told.err.contains("assumed to have"), "{}", told.err);
}

#[test]
fn bits_of_headerless_words_and_of_transparent_ones() {
    let place = Place::new();
    let bytes: Vec<u8> = words(0.0, |v| v << 4).into_raw().iter().flat_map(|w| w.to_le_bytes()).collect();
    place.write("in/a.raw", &bytes);
    let ran = place.run(&["run", "in", "--raw", "320x240:mono16"]).expect(0).says("assumed to have 12 bits");
    assert_eq!(without_time(&ran.out).len(), 1);
    std::fs::remove_file(place.path("in/a.raw")).unwrap();
    // The values of an alpha channel are not brightness. The full scale in a header is used as it is.
    let grey = words(0.0, |v| v << 4);
    let clear = image::ImageBuffer::from_fn(320, 240, |x, y| image::LumaA([grey.get_pixel(x, y).0[0], u16::MAX]));
    DynamicImage::ImageLumaA16(clear).save(place.path("in/a.png")).unwrap();
    place.run(&["run", "in"]).expect(0).says("assumed to have 12 bits; ").says("multiples of 16");
    std::fs::remove_file(place.path("in/a.png")).unwrap();
    let big_endian = grey.into_raw().iter().flat_map(|w| w.to_be_bytes()).collect::<Vec<u8>>();
    place.write("in/a.pgm", &[b"P5 320 240 4095\n".to_vec(), big_endian].concat());
    let ran = place.run(&["run", "in"]).expect(0).says("1 picture: 1 ok");
    assert!(!ran.err.contains("assumed to have"), "{}", ran.err);
}

#[test]
fn bits_of_sensor_toml_are_used() {
    let place = Place::new();
    words(0.0, |v| v << 2).save(place.path("in/low.png")).unwrap();
    let told = |bits: u8| format!("{}{NO_TONE}bits = {bits}\n", crate::common::SENSOR);
    place.write("in/sensor.toml", told(10).as_bytes());
    let off = angle_deg(axes(&place, &["run", "in"])[0], plain(0.0));
    assert!(off < 1e-3, "{off}");
    // There are too few bits.
    place.write("in/sensor.toml", told(9).as_bytes());
    let rows = without_time(&place.run(&["run", "in"]).expect(3).out);
    assert!(cell(&rows[0], "detail").contains("has more bits than input.bits = 9"), "{rows:?}");
    place.write("in/sensor.toml", told(17).as_bytes());
    place.run(&["run", "in"]).expect(2).says("[input] bits: 17 is refused");
}

#[test]
fn inks_become_brightness() {
    let place = Place::without_tone();
    place.write("in/cmyk.jpg", include_bytes!("../data/cmyk.jpg"));
    // JPEG is lossy. If the inks were inverted, the picture would be bright in the sky, and the axis would point to the
    // other side.
    let off = angle_deg(axes(&place, &["run", "in"])[0], plain(0.0));
    assert!(off < 8e-3, "{off}");
}

#[test]
fn the_sun_has_a_direction_in_ecef() {
    let place = Place::new();
    let sensor = crate::common::SENSOR
        .replace("fx_px = 300.0", "fx_px = 4000.0")
        .replace("fy_px = 300.0", "fy_px = 4000.0")
        .replace("earth-sphere", "sun");
    place.write("in/sensor.toml", sensor.as_bytes());
    let disc = GrayImage::from_fn(320, 240, |x, y| {
        let r = (f64::from(x) - 200.0).hypot(f64::from(y) - 100.0);
        image::Luma([(5.0 + 200.0 * (0.5 + 18.6 - r).clamp(0.0, 1.0)) as u8])
    });
    disc.save(place.path("in/0.png")).unwrap();
    disc.save(place.path("in/1.png")).unwrap();
    // The date is the equinox of March 2020; the equation of time is -7.5 minutes.
    place.write(
        "in/frames.csv",
        b"file,utc,x_km,y_km,z_km\n0.png,2020-03-20T03:50:00Z,7000,0,0\n1.png,2020-03-20T03:50:00Z,,,\n",
    );
    let rows = without_time(&place.run(&["run", "in"]).expect(0).out);
    let number = |name: &str| cell(&rows[0], name).parse::<f64>().unwrap();
    let (x, y, z) = (number("axis_e_x"), number("axis_e_y"), number("axis_e_z"));
    assert!(z.abs() < 2e-4, "{z}");
    let longitude_deg = y.atan2(x).to_degrees();
    assert!((longitude_deg - 15.0 * (12.0 - 3.0 - 50.0 / 60.0 + 7.5 / 60.0)).abs() < 0.1, "{longitude_deg}");
    assert!((number("axis_x") - 40.5 / 4000.0).abs() < 1e-4);
    assert_eq!(cell(&rows[1], "axis_e_x"), "");
}

/// Returns the chunks of a PNG: kind and data.
fn chunks(png: &[u8]) -> Vec<(Vec<u8>, Vec<u8>)> {
    let mut rest = &png[8..];
    let mut out = Vec::new();
    while let [a, b, c, d, after @ ..] = rest {
        let n = u32::from_be_bytes([*a, *b, *c, *d]) as usize;
        out.push((after[..4].to_vec(), after[4..4 + n].to_vec()));
        rest = &after[8 + n..];
    }
    out
}

/// Returns a PNG that shows `first` and then `second`.
fn animated_png(first: &GrayImage, second: &GrayImage) -> Vec<u8> {
    let encoded = |image: &GrayImage| {
        let mut bytes = Vec::new();
        image.write_to(&mut std::io::Cursor::new(&mut bytes), ImageFormat::Png).unwrap();
        bytes
    };
    let mut out = b"\x89PNG\r\n\x1a\n".to_vec();
    let mut push = |kind: &[u8], data: &[u8]| {
        let body = [kind, data].concat();
        out.extend((data.len() as u32).to_be_bytes());
        out.extend(&body);
        out.extend(crate::common::crc32(&body).to_be_bytes());
    };
    let control = |sequence: u32| {
        let numbers = [sequence, first.width(), first.height(), 0, 0].map(u32::to_be_bytes).concat();
        // The frame lasts a tenth of a second, with no disposal and no blending.
        [numbers, vec![0, 1, 0, 10, 0, 0]].concat()
    };
    let data = |png: &[u8]| chunks(png).into_iter().filter(|(k, _)| k == b"IDAT").flat_map(|(_, d)| d).collect();
    let (a, b) = (encoded(first), encoded(second));
    let (first_data, second_data): (Vec<u8>, Vec<u8>) = (data(&a), data(&b));
    push(b"IHDR", &chunks(&a)[0].1);
    push(b"acTL", &[2u32, 0].map(u32::to_be_bytes).concat());
    push(b"fcTL", &control(0));
    push(b"IDAT", &first_data);
    push(b"fcTL", &control(1));
    push(b"fdAT", &[2u32.to_be_bytes().to_vec(), second_data].concat());
    push(b"IEND", b"");
    out
}

#[test]
fn the_first_picture_of_an_animation_is_processed_and_the_others_are_reported() {
    let place = Place::new();
    place.write("in/film.png", &animated_png(&limb(320, 240, 0.0), &limb(320, 240, 40.0)));
    let ran = place.run(&["run", "in"]).expect(3);
    let ran = ran.says(
        "warning: only the first picture of 1 file with several pages or frames was processed (the first file is \
         film.png",
    );
    let rows = without_time(&ran.out);
    let axis = ["axis_x", "axis_y", "axis_z"].map(|name| cell(&rows[0], name).parse().unwrap());
    assert_eq!(axis, plain(0.0));
    assert!(angle_deg(axis, plain(40.0)) > 1.0);
    let told = place.run(&["info", "in/film.png"]).expect(0).out;
    assert!(told.contains("pictures         2; hzn processes only the first"), "{told}");
    // The file is a stack of pages, one after another.
    std::fs::remove_file(place.path("in/film.png")).unwrap();
    place.write("in/stack.tif", &two_pages(&limb(320, 240, 0.0)));
    place.run(&["run", "in"]).expect(3).says("stack.tif with 2 pictures").says("1 picture: 1 ok");
}

/// Returns a TIFF with two pages of the same picture.
fn two_pages(picture: &GrayImage) -> Vec<u8> {
    let mut out = b"II*\0\x08\0\0\0".to_vec();
    let (w, h) = picture.dimensions();
    let directory = 2 + 8 * 12 + 4;
    let data = 8 + 2 * directory;
    for page in 0..2 {
        let tags = [(256, w), (257, h), (258, 8), (259, 1), (262, 1), (273, data), (278, h), (279, w * h)];
        out.extend((tags.len() as u16).to_le_bytes());
        for (tag, value) in tags {
            out.extend((tag as u16).to_le_bytes());
            out.extend(4u16.to_le_bytes());
            out.extend(1u32.to_le_bytes());
            out.extend(value.to_le_bytes());
        }
        out.extend(if page == 0 { 8 + directory } else { 0 }.to_le_bytes());
    }
    out.extend(picture.as_raw());
    out
}

/// Search lines find the disc only after many lit objects along the border; the report has no room for all of them.
#[test]
fn an_edge_that_comes_late_is_listed_as_chosen() {
    let place = Place::new();
    let sphere = "kind = \"sphere\"\nradius_km = 1000.0\nlimb_height_km = 0.0\naltitude_km = 1923.8\n";
    let sensor = crate::common::SENSOR.replace("kind = \"earth-sphere\"\naltitude_km = 400.0\n", sphere);
    place.write(
        "in/sensor.toml",
        sensor.replace("fx_px = 300.0\nfy_px = 300.0", "fx_px = 200.0\nfy_px = 200.0").as_bytes(),
    );
    let picture = image::GrayImage::from_fn(320, 240, |x, y| {
        let off = (f64::from(x) - 159.5).hypot(f64::from(y) - 119.5) - 200.0 * 20f64.to_radians().tan();
        let thing = x % 30 < 14 && !(18..222).contains(&y);
        image::Luma([if thing { 220 } else { (10.0 + 210.0 * (0.5 - off).clamp(0.0, 1.0)) as u8 }])
    });
    picture.save(place.path("in/0.png")).unwrap();
    let told = place.run(&["explain", "in/0.png", "--overlay", "o.png"]).expect(0).out;
    let chosen: Vec<&str> = told.lines().filter(|l| l.contains("chosen: ")).collect();
    assert!(chosen.len() == 1 && told.contains("further edges are not listed"), "{told}");
    let number: u32 = chosen[0].split_whitespace().next().unwrap().parse().unwrap();
    assert!(number >= 16, "{told}");
    place.run(&["run", "in", "-o", "a.mcap"]).expect(0).says("1 picture: 1 ok");
    let mut recorded = hzn_mcap::Reader::open(place.path("a.mcap"), hzn_mcap::Contents::All).unwrap();
    let frame = recorded.next().unwrap().unwrap();
    assert_eq!(frame.candidates.iter().filter(|c| c.verdict == "chosen").count(), 1);
    assert!(frame.annotations.inliers.len() > 50);
}

/// Returns EXIF that contains only the orientation of the picture.
fn exif_orientation(number: u16) -> Vec<u8> {
    let value = [number.to_le_bytes(), [0; 2]].concat();
    let entry = [&0x0112u16.to_le_bytes()[..], &3u16.to_le_bytes(), &1u32.to_le_bytes(), &value].concat();
    [b"II*\0".as_slice(), &8u32.to_le_bytes(), &1u16.to_le_bytes(), &entry, &0u32.to_le_bytes()].concat()
}

#[test]
fn pictures_are_turned_only_on_request() {
    let place = Place::new();
    let turned = image::imageops::rotate270(&limb(320, 240, 0.0));
    let save = |orientation: u16| {
        let mut bytes = Vec::new();
        let mut encoder = image::codecs::png::PngEncoder::new(&mut bytes);
        encoder.set_exif_metadata(exif_orientation(orientation)).unwrap();
        turned.write_with_encoder(encoder).unwrap();
        place.write("in/a.png", &bytes);
    };
    let orient = |word: &str| {
        place.write("in/sensor.toml", format!("{}[input]\norient = \"{word}\"\n", crate::common::SENSOR).as_bytes());
    };
    // Orientation 6 asks for a turn by 90 degrees clockwise.
    save(6);
    let err = place.run(&["run", "in"]).expect(2).err;
    assert!(err.contains("a.png is 240 x 320; turn the pictures with orient in [input]"), "{err}");
    for word in ["exif", "rotate-90"] {
        orient(word);
        assert_eq!(axes(&place, &["run", "in"])[0], plain(0.0));
        // The recording stores the turned picture, which is not turned again.
        place.run(&["run", "in", "-o", "a.mcap", "--force"]).expect(0);
        assert_eq!(axes(&place, &["run", "a.mcap"])[0], plain(0.0));
        place.run(&["export", "a.mcap", "--images", "pictures", "--force"]).expect(0);
        assert_eq!(image::image_dimensions(place.path("pictures/a.png")).unwrap(), (320, 240));
    }
    let told = place.run(&["explain", "in/a.png", "--overlay", "o.png"]).expect(0).out;
    assert!(told.contains("a.png: 320 x 240 px"), "{told}");
    // If the picture is used as stored, a note says so once.
    orient("as-stored");
    let sensor = place.read("in/sensor.toml").replace("width = 320\nheight = 240", "width = 240\nheight = 320");
    place.write("in/sensor.toml", sensor.as_bytes());
    let ran = place.run(&["run", "in"]).expect(0);
    ran.says("note: a.png is to be shown turned by 90 degrees clockwise; its pixels are used as stored");
    save(1);
    let ran = place.run(&["run", "in"]).expect(0);
    assert!(!ran.err.contains("to be shown"), "{}", ran.err);
    let told = place.run(&["run", "in"]).expect(0).err;
    assert!(!told.contains("turned"), "{told}");
    orient("sideways");
    place.run(&["run", "in"]).expect(2).says("[input] orient: ");
}

/// Returns EXIF that contains only `DateTimeOriginal`, 19 characters.
fn exif(stamp: &str) -> Vec<u8> {
    // The entry of the first directory leads to the second directory, whose entry leads to the text.
    let entry = |tag: u16, kind: u16, count: u32, value: u32| {
        [&tag.to_le_bytes()[..], &kind.to_le_bytes(), &count.to_le_bytes(), &value.to_le_bytes()].concat()
    };
    let directory = |entry: Vec<u8>| [&1u16.to_le_bytes()[..], &entry, &0u32.to_le_bytes()].concat();
    let head = [b"II*\0".as_slice(), &8u32.to_le_bytes()].concat();
    let text = [stamp.as_bytes(), b"\0"].concat();
    [head, directory(entry(0x8769, 4, 1, 26)), directory(entry(0x9003, 2, text.len() as u32, 44)), text].concat()
}

#[test]
fn pictures_go_by_one_clock() {
    let place = Place::new();
    let jpeg = |name: &str, stamp: Option<&str>| {
        let mut bytes = Vec::new();
        let mut encoder = JpegEncoder::new(&mut bytes);
        if let Some(stamp) = stamp {
            encoder.set_exif_metadata(exif(stamp)).unwrap();
        }
        limb(320, 240, 0.0).write_with_encoder(encoder).unwrap();
        place.write(&format!("in/{name}"), &bytes);
    };
    let times = || {
        let rows = without_time(&place.run(&["run", "in", "--fps", "4"]).expect(0).out);
        rows.iter().map(|r| cell(r, "time_s").to_owned()).collect::<Vec<_>>()
    };
    jpeg("b.jpg", Some("1970:01:02 00:00:01"));
    jpeg("c.jpg", None);
    // The time comes from the camera's clock. The second picture has no time on it, so its time is empty, not 0.25 s.
    assert_eq!(times(), ["86401.0", ""]);
    // If the first picture has no EXIF time, EXIF is not used for the others either.
    jpeg("a.jpg", None);
    assert_eq!(times(), ["0.0", "0.25", "0.5"]);
    // An unreadable picture does not decide about the clock.
    place.write("in/a.jpg", b"no picture");
    let rows = without_time(&place.run(&["run", "in", "--fps", "4"]).expect(3).out);
    assert_eq!(rows.iter().map(|r| cell(r, "time_s")).collect::<Vec<_>>(), ["", "86401.0", ""]);
}

/// Runs a command and returns the largest resident memory that was seen, in kB.
#[cfg(target_os = "linux")]
fn peak_memory_kb(command: &mut std::process::Command) -> u64 {
    let mut child = command.stdout(std::process::Stdio::null()).spawn().unwrap();
    let status = format!("/proc/{}/status", child.id());
    let mut peak = 0;
    loop {
        // The kernel keeps the largest value, so a look now and then sees it.
        let text = std::fs::read_to_string(&status).unwrap_or_default();
        let kb = |line: &str| line.strip_prefix("VmHWM:")?.trim().strip_suffix(" kB")?.parse().ok();
        peak = peak.max(text.lines().find_map(kb).unwrap_or(0));
        if let Some(status) = child.try_wait().unwrap() {
            assert!(status.success(), "{status}");
            return peak;
        }
        std::thread::sleep(std::time::Duration::from_millis(2));
    }
}

#[test]
#[cfg(target_os = "linux")]
fn a_compressed_colour_profile_takes_no_memory() {
    let place = Place::with_pictures(1);
    let mut bomb = Vec::new();
    let mut encoder = image::codecs::png::PngEncoder::new(&mut bomb);
    encoder.set_icc_profile(vec![0; 256 << 20]).unwrap();
    encoder.write_image(&limb(320, 240, 0.0), 320, 240, image::ExtendedColorType::L8).unwrap();
    assert!(bomb.len() < 1 << 20, "{}", bomb.len());
    for i in 1..16 {
        place.write(&format!("in/{i:04}.png"), &bomb);
    }
    let peak = peak_memory_kb(&mut place.command(&["run", "in", "--jobs", "8", "-o", "out.csv"]));
    assert!(peak > 0 && peak < 200_000, "{peak} kB");
    let rows = without_time(&place.read("out.csv"));
    assert_eq!(rows.len(), 16);
    // The profile has no influence on the answer, and takes no memory in a command that asks for another picture.
    assert_eq!(
        ["axis_x", "axis_y", "axis_z"].map(|c| cell(&rows[1], c)),
        ["axis_x", "axis_y", "axis_z"].map(|c| cell(&rows[0], c))
    );
    let peak = peak_memory_kb(&mut place.command(&["explain", "in/0000.png"]));
    assert!(peak > 0 && peak < 200_000, "{peak} kB");
}
