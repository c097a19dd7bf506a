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

/// The radius of the Sun in its pictures, and where its centre is.
const SUN_PX: f64 = 80.0;
const SUNS_PX: [[f64; 2]; 3] = [[170.0, 100.0], [171.25, 100.5], [172.5, 101.0]];

/// Returns a picture of the Sun.
fn sun([cx, cy]: [f64; 2]) -> GrayImage {
    GrayImage::from_fn(320, 240, |x, y| {
        let d = (f64::from(x) - cx).hypot(f64::from(y) - cy);
        // The limb of the Sun is darker than its centre.
        let darkening = 0.4 + 0.6 * (1.0 - (d / SUN_PX).powi(2)).max(0.0).sqrt();
        image::Luma([(5.0 + 230.0 * darkening * (SUN_PX - d + 0.5).clamp(0.0, 1.0)) as u8])
    })
}

/// Returns a folder with pictures of the Sun, and the field of view of their camera.
fn suns() -> (Place, String) {
    let place = Place::new();
    std::fs::create_dir(place.path("sun")).unwrap();
    for (i, centre) in SUNS_PX.into_iter().enumerate() {
        place.write(&format!("sun/{i}.fits"), &fits(&sun(centre)));
    }
    // The radius of 0.2666 degrees is 80 px.
    let focal_px = SUN_PX / 0.2666f64.to_radians().tan();
    (place, (2.0 * (160.0 / focal_px).atan()).to_degrees().to_string())
}

/// Who has pictures of the Sun needs no altitude, and can write the place of its centre into their headers.
#[test]
fn pictures_of_the_sun() {
    let (place, fov) = suns();
    let init = ["init", "sun", "--body", "sun", "--fov", &fov, "-o", "sun/sensor.toml"];
    let ran = place.run(&init).expect(0);
    assert!(!ran.err.contains("altitude"), "{}", ran.err);
    place.run(&[&init[..], &["--altitude", "400", "--force"]].concat()).expect(2).says("leave it out");
    place.run(&["run", "sun", "-o", "sun.csv"]).expect(0);
    let text = place.read("sun/sensor.toml");
    let fx: f64 = text.split_once("fx_px = ").unwrap().1.lines().next().unwrap().parse().unwrap();
    for (row, [cx, cy]) in place.rows("sun.csv").iter().zip(SUNS_PX) {
        assert_eq!(cell(row, "status"), "ok", "{row:?}");
        let [x, y, z] = ["axis_x", "axis_y", "axis_z"].map(|name| cell(row, name).parse::<f64>().unwrap());
        // The equations of reference/files.md. The lowest row of the file is number 1.
        let crpix = [159.5 + 1.0 + fx * x / z, 240.0 - (119.5 + fx * y / z)];
        assert!((crpix[0] - (cx + 1.0)).abs() < 0.05 && (crpix[1] - (240.0 - cy)).abs() < 0.05, "{crpix:?}");
    }
}

/// Returns the value of a card, which is there once.
#[track_caller]
fn card(fits: &[u8], key: &str) -> String {
    let all: Vec<&str> = cards(fits).filter(|card| card.starts_with(&format!("{key:<8}="))).collect();
    let [one] = all.as_slice() else { panic!("{key}: {all:?}") };
    one[10..].split('/').next().unwrap().trim().trim_matches('\'').trim_end().to_owned()
}

fn cards(fits: &[u8]) -> impl Iterator<Item = &str> {
    let cards = fits.chunks_exact(80).map(|card| std::str::from_utf8(card).unwrap());
    cards.take_while(|card| !card.starts_with("END "))
}

fn value(fits: &[u8], key: &str) -> f64 {
    card(fits, key).parse().unwrap_or_else(|_| panic!("{key}"))
}

/// Adds cards to the header of a FITS file of one block.
fn with_cards(fits: &[u8], more: &[&str]) -> Vec<u8> {
    let (head, data) = fits.split_at(2880);
    let kept: Vec<&str> = cards(head).chain(more.iter().copied()).chain(["END"]).collect();
    let mut bytes: Vec<u8> = kept.iter().flat_map(|card| format!("{card:<80}").into_bytes()).collect();
    bytes.resize(bytes.len().next_multiple_of(2880), b' ');
    [&bytes, data].concat()
}

/// The centre of the Sun and the plate scale become world coordinates, in both orders of rows.
#[test]
fn world_coordinates_of_the_sun() {
    let (place, fov) = suns();
    place.run(&["init", "sun", "--body", "sun", "--fov", &fov, "-o", "sun/sensor.toml"]).expect(0);
    // Rows from above, a program's old coordinates, and a second part behind the picture.
    let old = [
        "ROWORDER= 'TOP-DOWN'",
        "CRPIX1  =                -77.5 / old",
        "CD1_1   =                  2.0",
        "CROTA2  =                 12.0",
        "A_ORDER =                    2",
        "WCSNAME = 'a long name of the old &'",
        "CONTINUE  'coordinates'",
        "OBJECT  = 'Sun     '           / kept",
        "CRPIX1A =                  5.0 / other coordinates are kept",
    ];
    let (cx, cy) = (SUNS_PX[0][0], SUNS_PX[0][1]);
    let upside_down = image::imageops::flip_vertical(&sun(SUNS_PX[0]));
    let down = [with_cards(&fits(&upside_down), &old), vec![b'x'; 2880]].concat();
    place.write("sun/down.fits", &down);
    place.run(&["run", "sun", "-o", "sun.csv", "--wcs", "out"]).expect(0).says("4 copies of 4 pictures with world");
    let [up, copy] = ["out/0.fits", "out/down.fits"].map(|name| std::fs::read(place.path(name)).unwrap());
    for (fits, y, side) in [(&up, 240.0 - cy, 1.0), (&copy, cy + 1.0, -1.0)] {
        assert!((value(fits, "CRPIX1") - cx - 1.0).abs() < 0.05 && (value(fits, "CRPIX2") - y).abs() < 0.05);
        let scale = 0.2666 / SUN_PX;
        assert!((value(fits, "CDELT1") / scale - 1.0).abs() < 1e-3, "{}", value(fits, "CDELT1"));
        assert!((value(fits, "CDELT2") / scale - side).abs() < 1e-3, "{}", value(fits, "CDELT2"));
        let turn = ["PC1_1", "PC1_2", "PC2_1", "PC2_2"].map(|key| value(fits, key));
        assert!(turn.iter().zip([1.0, 0.0, 0.0, 1.0]).all(|(pc, one)| (pc - one).abs() < 1e-3), "{turn:?}");
        assert_eq!(["CTYPE1", "CTYPE2", "CUNIT1"].map(|key| card(fits, key)), ["HPLN-TAN", "HPLT-TAN", "deg"]);
        assert!((value(fits, "RSUN_OBS") / 959.8 - 1.0).abs() < 0.01 && value(fits, "CRVAL1") == 0.0);
        assert!((0.0..0.5).contains(&value(fits, "HZNSIG1")) && value(fits, "HZNSIG2") > 0.0);
        assert!(value(fits, "HZNLIMB") < 0.5 && value(fits, "HZNCORR").abs() < 1.0);
        assert!(cards(fits).any(|card| card.contains("the rotation about the centre is not known")));
    }
    for gone in ["CD1_1", "CROTA2", "A_ORDER", "WCSNAME", "CONTINUE"] {
        assert!(cards(&copy).all(|card| !card.starts_with(gone)), "{gone}");
    }
    assert_eq!((card(&copy, "OBJECT").as_str(), value(&copy, "CRPIX1A")), ("Sun", 5.0));
    // The data, the second part and the inputs are unchanged, and a copy has the answer of its picture.
    assert!(copy.ends_with(&down[2880..]) && copy.len() % 2880 == 320 * 240 * 2 % 2880);
    assert_eq!(std::fs::read(place.path("sun/down.fits")).unwrap(), down);
    place.run(&["run", "out", "-s", "sun/sensor.toml", "-o", "again.csv", "--wcs", "twice", "-q"]).expect(0);
    let axes = |file: &str| place.rows(file).iter().map(|row| cell(row, "axis_x").to_owned()).collect::<Vec<_>>();
    assert_eq!(axes("again.csv"), axes("sun.csv"));
    assert_eq!(std::fs::read(place.path("twice/down.fits")).unwrap(), copy);
}

/// With an attitude, the second axis goes to the north of the body.
#[test]
fn world_coordinates_are_turned_by_an_attitude() {
    let (place, _) = suns();
    let sensor = "[camera]\nwidth = 320\nheight = 240\nmodel = \"pinhole\"\nfx_px = 17193.0\nfy_px = 17193.0\n\
                  cx_px = 159.5\ncy_px = 119.5\n[body]\nkind = \"sphere\"\nradius_km = 1000.0\n\
                  altitude_km = 213916.0\nlimb_height_km = 0.0\nlimb_height_sigma_km = 0.0\n";
    place.write("sun/sensor.toml", sensor.as_bytes());
    // The pole of the body is at the right of the picture.
    place.write("sun/frames.csv", b"file,qw,qx,qy,qz\n0.fits,0.5,-0.5,-0.5,-0.5\n");
    place.run(&["run", "sun", "--wcs", "out", "-o", "a.csv"]).expect(0);
    let turned = std::fs::read(place.path("out/0.fits")).unwrap();
    let cd = |i: u8, j: u8| value(&turned, &format!("CDELT{i}")) * value(&turned, &format!("PC{i}_{j}"));
    let scale = 0.2666 / SUN_PX;
    let wanted = [[0.0, -scale], [scale, 0.0]];
    for (i, row) in wanted.iter().enumerate() {
        for (j, want) in row.iter().enumerate() {
            let found = cd(i as u8 + 1, j as u8 + 1);
            assert!((found - want).abs() < 2e-3 * scale, "CD{}_{}: {found}, not {want}", i + 1, j + 1);
        }
    }
    assert_eq!(card(&turned, "CTYPE2"), "NDLT-TAN");
    assert!(cards(&turned).any(|card| card.contains("is that of the given attitude")));
    let free = std::fs::read(place.path("out/1.fits")).unwrap();
    assert!(value(&free, "PC1_1") == 1.0 && cards(&free).all(|card| !card.starts_with("RSUN_OBS")));
}

#[test]
fn world_coordinates_are_for_fits_alone() {
    let place = Place::with_pictures(1);
    place.run(&["run", "in", "--wcs", "out"]).expect(2).says("0000.png is no FITS file, and only FITS has world");
    place.run(&["run", "in", "-o", "a.mcap", "-q"]).expect(0);
    place.run(&["run", "a.mcap", "--wcs", "out"]).expect(2).says("the pictures are no files");
    // The centre of the Earth is outside of the picture.
    std::fs::create_dir(place.path("f")).unwrap();
    place.write("f/0.fits", &fits(&limb(320, 240, 0.0)));
    place.write("f/sensor.toml", format!("{SENSOR}{NO_TONE}").as_bytes());
    place.run(&["run", "f", "--wcs", "f"]).expect(2).says("is the folder of the pictures");
    let ran = place.run(&["run", "f", "--wcs", "out", "-o", "a.csv"]).expect(0);
    ran.says("no world coordinates: 0.fits: the centre of the body is outside of the picture").says("0 copies of 1");
    place.write("f/sensor.toml", format!("{SENSOR}{NO_TONE}orient = \"rotate-180\"\n").as_bytes());
    place.run(&["run", "f", "--wcs", "new"]).expect(2).says("the pictures are turned (input.orient)");
}
