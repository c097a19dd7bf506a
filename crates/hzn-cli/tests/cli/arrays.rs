//! Pictures in the files of scientific programs.

use image::GrayImage;

use crate::common::{NO_TONE, Place, SENSOR, angle_deg, axes, cell, limb};

/// Returns a file as numpy.save writes it: temperatures from -40 to 20 degrees.
fn npy(picture: &GrayImage) -> Vec<u8> {
    let text = "{'descr': '<f4', 'fortran_order': False, 'shape': (240, 320), }";
    let text = format!("{text:<117}\n");
    let celsius = picture.pixels().map(|p| -40.0 + (f32::from(p.0[0]) - 20.0) / 3.0);
    let data: Vec<u8> = celsius.flat_map(f32::to_le_bytes).collect();
    [b"\x93NUMPY\x01\0".as_slice(), &(text.len() as u16).to_le_bytes(), text.as_bytes(), &data].concat()
}

/// Returns a FITS file of words, with the lowest row first.
fn fits(picture: &GrayImage) -> Vec<u8> {
    let value = |key: &str, value: &str| format!("{:<80}", format!("{key:<8}= {value:>20}"));
    let head =
        [("SIMPLE", "T"), ("BITPIX", "16"), ("NAXIS", "2"), ("NAXIS1", "320"), ("NAXIS2", "240"), ("BZERO", "32768")];
    let mut bytes: Vec<u8> = head.iter().flat_map(|(key, text)| value(key, text).into_bytes()).collect();
    bytes.extend(format!("{:<80}", "END").into_bytes());
    bytes.resize(2880, b' ');
    for row in picture.rows().rev() {
        bytes.extend(row.flat_map(|p| ((u16::from(p.0[0]) * 257) ^ 0x8000).to_be_bytes()));
    }
    bytes
}

#[test]
fn arrays_have_the_answer_of_the_picture() {
    let place = Place::with_pictures(1);
    place.write("in/sensor.toml", format!("{SENSOR}{NO_TONE}").as_bytes());
    let picture = limb(320, 240, 0.0);
    let expected = axes(&place, &["run", "in", "-q"])[0];
    let files = [("a.npy", npy(&picture)), ("b.fits", fits(&picture))];
    for (name, bytes) in &files {
        place.write(name, bytes);
        let found = axes(&place, &["run", name, "-q", "-s", "in/sensor.toml"])[0];
        let away = angle_deg(found, expected);
        assert!(away < 0.002, "{name}: {away} degrees");
    }
    // A folder of them is a sequence, and one that is cut off is a row with the reason.
    std::fs::create_dir(place.path("arrays")).unwrap();
    for (name, bytes) in &files {
        place.write(&format!("arrays/{name}"), bytes);
    }
    place.write("arrays/c.npy", &files[0].1[..1000]);
    let ran = place.run(&["run", "arrays", "-s", "in/sensor.toml"]).expect(3);
    assert_eq!(ran.out.lines().count(), 4);
    ran.says("c.npy: the data end before the picture is complete");
}

/// Who has pictures of the Sun needs no altitude, and can write the place of its centre into their headers.
#[test]
fn pictures_of_the_sun() {
    let place = Place::new();
    std::fs::create_dir(place.path("sun")).unwrap();
    let (radius_px, centres) = (80.0, [[170.0, 100.0], [171.25, 100.5], [172.5, 101.0]]);
    for (i, [cx, cy]) in centres.iter().enumerate() {
        let picture = GrayImage::from_fn(320, 240, |x, y| {
            let d = (f64::from(x) - cx).hypot(f64::from(y) - cy);
            // The limb of the Sun is darker than its centre.
            let darkening = 0.4 + 0.6 * (1.0 - (d / radius_px).powi(2)).max(0.0).sqrt();
            image::Luma([(5.0 + 230.0 * darkening * (radius_px - d + 0.5).clamp(0.0, 1.0)) as u8])
        });
        place.write(&format!("sun/{i}.fits"), &fits(&picture));
    }
    // The radius of 0.2666 degrees is 80 px.
    let focal_px = radius_px / 0.2666f64.to_radians().tan();
    let fov = (2.0 * (160.0 / focal_px).atan()).to_degrees().to_string();
    let init = ["init", "sun", "--body", "sun", "--fov", &fov, "-o", "sun/sensor.toml"];
    let ran = place.run(&init).expect(0);
    assert!(!ran.err.contains("altitude"), "{}", ran.err);
    place.run(&[&init[..], &["--altitude", "400", "--force"]].concat()).expect(2).says("leave it out");
    place.run(&["run", "sun", "-o", "sun.csv"]).expect(0);
    let text = place.read("sun/sensor.toml");
    let fx: f64 = text.split_once("fx_px = ").unwrap().1.lines().next().unwrap().parse().unwrap();
    for (row, [cx, cy]) in place.rows("sun.csv").iter().zip(centres) {
        assert_eq!(cell(row, "status"), "ok", "{row:?}");
        let [x, y, z] = ["axis_x", "axis_y", "axis_z"].map(|name| cell(row, name).parse::<f64>().unwrap());
        // The equations of reference/files.md. The lowest row of the file is number 1.
        let crpix = [159.5 + 1.0 + fx * x / z, 240.0 - (119.5 + fx * y / z)];
        assert!((crpix[0] - (cx + 1.0)).abs() < 0.05 && (crpix[1] - (240.0 - cy)).abs() < 0.05, "{crpix:?}");
    }
}
