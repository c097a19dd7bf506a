//! Pictures in the files of scientific programs.

use image::GrayImage;

use crate::common::{NO_TONE, Place, SENSOR, angle_deg, axes, limb};

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
