//! Tests of the first sensor.toml.

use std::path::Path;

use hzn_core::tone::Tone;

use super::*;

fn known(fov_deg: Option<f64>, lens: Option<Model>, exif: Exif) -> CameraFacts {
    CameraFacts { fov_deg, lens, exif, altitude_km: Some(418.0), ..CameraFacts::of_size([4928, 2768]) }
}

/// The Nikon D4 on the ISS, 20 November 2020.
fn d4() -> Exif {
    Exif {
        camera: Some("NIKON D4".into()),
        focal_mm: Some(56.0),
        focal_35mm_mm: Some(56.0),
        plane_px_per_mm: Some(44_855_751.0 / 32_768.0 / 10.0),
        columns: Some(4928.0),
        ..Exif::default()
    }
}

#[test]
fn what_is_written_loads_and_is_the_camera_of_the_facts() {
    for (fov, lens) in [(92.0, Model::Pinhole), (92.0, Model::Equidistant), (180.0, Model::Equidistant)] {
        let start = write_sensor_toml(&known(Some(fov), Some(lens), Exif::default())).unwrap();
        let config = crate::sensor::parse(&start.text, Path::new("s.toml")).unwrap().config;
        let camera = hzn_core::camera::Camera::<f64>::try_new(&config.camera).unwrap();
        // The middle of the right edge, half a pixel beyond the centre of the last column.
        let edge = camera.unproject(hzn_core::pixel::ImagePoint { u: 4927.5, v: 1383.5 }).unwrap();
        let off_axis = edge.xyz()[0].atan2(edge.xyz()[2]).to_degrees();
        assert!((off_axis - 0.5 * fov).abs() < 0.01, "{} {off_axis}", start.text);
        assert_eq!(config.body.altitude_km, Some(418.0));
        // The gates know what an uncertain lens bends, so that they are those of any other sensor.
        assert!(config.gates == hzn_core::gates::Config::default() && !start.text.contains("[gates]"));
        let covariance = config.camera.covariance.unwrap();
        let sigma = |i: usize| covariance.rows[i][i].sqrt();
        assert!((100.0 * sigma(0) / start.focal_px / start.focal_sigma_percent - 1.0).abs() < 1e-3);
        assert!((sigma(2) - 74.0).abs() < 0.01 && (sigma(5) / start.k2_sigma - 1.0).abs() < 1e-3);
        // The first mode of the shape is that with the value of k2.
        let k1_variance = covariance.rows[4][4] - covariance.rows[4][5].powi(2) / covariance.rows[5][5];
        assert!((k1_variance.sqrt() / start.k1_sigma - 1.0).abs() < 1e-3);
        // Only a pinhole has p1 and p2.
        assert_eq!(start.p_sigma.map(|p| [p, p]), (lens == Model::Pinhole).then(|| [sigma(6), sigma(7)]));
    }
}

#[test]
fn the_moon_has_no_air() {
    let moon = CameraFacts { body: Body::Moon, ..known(Some(40.0), None, Exif::default()) };
    let start = write_sensor_toml(&moon).unwrap();
    let sensor = crate::sensor::parse(&start.text, Path::new("s.toml")).unwrap();
    let body = &sensor.config.body;
    assert_eq!((body.mean_radius_km(), body.limb_height_km, body.clipped_height_km), (1737.4, 0.0, 0.0));
    assert!(sensor.warnings.is_empty(), "{:?}", sensor.warnings);
}

#[test]
fn planets_and_moons_have_their_radii_and_limbs() {
    for body in Body::all() {
        let altitude_km = Some(500.0);
        let facts = CameraFacts { body, altitude_km, ..known(Some(60.0), None, Exif::default()) };
        let sensor = crate::sensor::parse(&write_sensor_toml(&facts).unwrap().text, Path::new("s.toml")).unwrap();
        let written = &sensor.config.body;
        if let Body::Other(kind) = body {
            let own = hzn_core::body::Config::of_kind(kind, None);
            assert_eq!((written.kind, written.limb_height_km), (kind, own.limb_height_km));
            assert_eq!(written.mean_radius_km(), own.mean_radius_km());
        }
        // The Sun is equally large from everywhere near the Earth.
        assert_eq!(written.altitude_km, altitude_km.filter(|_| body != Body::Sun), "{body:?}");
        assert!(sensor.warnings.is_empty(), "{body:?}: {:?}", sensor.warnings);
    }
}

#[test]
fn exif_gives_the_nominal_focal_length_by_either_way() {
    let start = write_sensor_toml(&known(None, None, d4())).unwrap();
    assert!((start.focal_px - 7666.0).abs() < 1.0, "{}", start.focal_px);
    // The limb gives 7100 px, which is within two sigmas.
    assert!((start.focal_px / 7100.0 - 1.0) < 0.02 * start.focal_sigma_percent, "{start:?}");
    let film = write_sensor_toml(&known(None, None, Exif { plane_px_per_mm: None, ..d4() })).unwrap();
    assert!((film.focal_px - 7666.0).abs() < 1.0, "{}", film.focal_px);
    assert!(film.focal_sigma_percent >= start.focal_sigma_percent);
    // A third of the size: the number of columns in EXIF shows the scale.
    let small = CameraFacts { size_px: [1600, 899], ..known(None, None, d4()) };
    assert!((write_sensor_toml(&small).unwrap().focal_px - 7666.0 * 1600.0 / 4928.0).abs() < 1.0);
    // A wrong EXIF value: pixels of 10 nm.
    let odd = Exif { plane_px_per_mm: Some(1e5), ..d4() };
    assert!((write_sensor_toml(&known(None, None, odd)).unwrap().focal_px - 7666.0).abs() < 1.0);
    // A telephone: its 4:3 picture is compared by the diagonal.
    let phone = Exif { focal_35mm_mm: Some(26.0), ..Exif::default() };
    let phone = write_sensor_toml(&CameraFacts { size_px: [4000, 3000], ..known(None, None, phone) }).unwrap();
    assert!((phone.focal_px - 26.0 * 5000.0 / 43.267).abs() < 1.0, "{}", phone.focal_px);
}

#[test]
fn the_pitch_of_a_picture_that_was_made_smaller_is_refused() {
    // 5.8 mm and pixels of 1.55 um, over 960 px instead of 4608.
    let small = Exif { focal_mm: Some(5.8), plane_px_per_mm: Some(645.0), columns: Some(960.0), ..Exif::default() };
    let start = |exif| write_sensor_toml(&CameraFacts { size_px: [960, 720], ..known(None, None, exif) });
    let refused = start(small.clone()).unwrap_err();
    assert!(refused.contains("would be a sensor of 1.5 mm") && refused.contains("--fov 60"), "{refused}");
    // The equivalent on film contradicts the pitch, and does not depend on the size of the picture.
    let film = start(Exif { focal_35mm_mm: Some(28.0), ..small.clone() }).unwrap();
    assert!((film.focal_px - 28.0 * 1200.0 / 43.267).abs() < 1.0, "{}", film.focal_px);
    // A small sensor that is confirmed.
    let confirmed = start(Exif { focal_35mm_mm: Some(135.0), ..small }).unwrap();
    assert!((confirmed.focal_px - 5.8 * 645.0).abs() < 1.0, "{}", confirmed.focal_px);
}

#[test]
fn a_contradiction_is_reported_and_agreement_is_not() {
    let both = |fov| write_sensor_toml(&known(Some(fov), None, d4())).unwrap();
    // EXIF: 35.6 degrees over the width.
    let agreed = both(37.0);
    assert!(agreed.warnings.is_empty() && agreed.text.contains("for comparison, EXIF"), "{}", agreed.text);
    assert!((agreed.fov_deg - 37.0).abs() < 1e-9);
    assert!(both(60.0).warnings[0].contains("contradicts"));
    // The stated value overrides EXIF.
    assert!(agreed.focal_sigma_percent < write_sensor_toml(&known(None, None, d4())).unwrap().focal_sigma_percent);
}

#[test]
fn impossible_facts_are_refused_with_a_remedy() {
    let refused = |fov, lens, exif| write_sensor_toml(&known(fov, lens, exif)).unwrap_err();
    assert!(refused(None, None, Exif::default()).contains("--fov"));
    assert!(refused(Some(92.0), None, Exif::default()).contains("--lens"));
    assert!(refused(Some(179.9), Some(Model::Pinhole), Exif::default()).contains("at most 150 degrees"));
    assert!(refused(Some(190.0), None, Exif::default()).ends_with("is a fisheye; add --lens fisheye"));
    assert!(refused(Some(f64::NAN), None, Exif::default()).contains("between"));
    assert!(refused(Some(0.0), None, Exif::default()).contains("between"));
}

/// A field of view fixes the angle at the edge of the picture whatever k1 is; a focal length does not.
#[test]
fn a_field_of_view_fixes_the_edge_and_a_focal_length_the_middle() {
    let edge_percent = |start: &StartConfig| {
        let config = crate::sensor::parse(&start.text, Path::new("s.toml")).unwrap().config;
        let (f, rows) = (start.focal_px, config.camera.covariance.unwrap().rows);
        let edge2 = (2464.0 / f).powi(2);
        // The change of the edge with f, k1 and k2, which are the parameters 0, 4 and 5.
        let by = [(0, 1.0 / f), (4, edge2), (5, edge2 * edge2)];
        let variance: f64 = by.iter().flat_map(|(i, a)| by.map(|(j, b)| a * b * rows[*i][j])).sum();
        100.0 * variance.sqrt()
    };
    for (fov, lens) in [(92.0, Model::Equidistant), (92.0, Model::Pinhole), (180.0, Model::Equidistant)] {
        let start = write_sensor_toml(&known(Some(fov), Some(lens), Exif::default())).unwrap();
        assert!((edge_percent(&start) - 5.0 / 3f64.sqrt()).abs() < 0.01, "{}", edge_percent(&start));
        assert!(start.focal_sigma_percent > 4.0, "{start:?}");
    }
    let exif = write_sensor_toml(&known(None, None, d4())).unwrap();
    assert!((exif.focal_sigma_percent - 10.0 / 3f64.sqrt()).abs() < 0.01 && edge_percent(&exif) > 5.9, "{exif:?}");
}

#[test]
fn without_an_altitude_the_file_says_what_to_do() {
    let start = write_sensor_toml(&CameraFacts { altitude_km: None, ..known(None, None, d4()) }).unwrap();
    assert!(start.text.contains("frames.csv") && !start.text.contains("\naltitude_km"), "{}", start.text);
    let config = crate::sensor::parse(&start.text, Path::new("s.toml")).unwrap().config;
    assert_eq!(config.body.altitude_km, None);
}

#[test]
fn the_tone_of_the_files_is_written_or_asked_for() {
    let body = |tone| {
        let start = write_sensor_toml(&CameraFacts { tone, ..known(None, None, d4()) }).unwrap();
        let sensor = crate::sensor::parse(&start.text, Path::new("sensor.toml")).unwrap();
        (sensor.config.input.tone, sensor.config.body.limb_height_km, start.text.contains("# tone = "))
    };
    assert_eq!(body(None), (None, 17.0, true));
    let (tone, height_km, is_asked) = body(Some(Tone::Srgb));
    assert!(tone == Some(Tone::Srgb) && height_km == 17.0 && !is_asked);
    assert_eq!(body(Some(Tone::Gamma(2.0))).0, Some(Tone::Gamma(2.0)));
    // The relief of the Moon has no tone.
    let moon = CameraFacts { body: Body::Moon, tone: Some(Tone::Srgb), ..known(Some(40.0), None, Exif::default()) };
    assert!(!write_sensor_toml(&moon).unwrap().text.contains("[input]"));
}

#[test]
fn an_image_circle_limits_a_fisheye_only() {
    let start = |fov_deg, lens, image_circle_px| {
        let facts =
            CameraFacts { size_px: [600, 600], image_circle_px, ..known(Some(fov_deg), Some(lens), Exif::default()) };
        let start = write_sensor_toml(&facts).unwrap();
        let config = crate::sensor::parse(&start.text, Path::new("sensor.toml")).unwrap().config;
        (start.image_circle, config.camera.theta_max_deg)
    };
    // 250 px of 300 px, which are 90 degrees.
    let (circle, deg) = start(180.0, Model::Equidistant, Some(250.0));
    assert!(matches!(circle, Some(ImageCircle::Seen { .. })) && (deg.unwrap() - 75.0).abs() < 0.051, "{deg:?}");
    assert_eq!(start(180.0, Model::Equidistant, None), (None, None));
    assert_eq!(start(80.0, Model::Pinhole, Some(250.0)), (None, None));
    // A whole Earth in the middle of the picture.
    assert_eq!(start(100.0, Model::Equidistant, Some(250.0)), (None, None));
    // The corners would be 205 degrees off axis, which no lens can have.
    let (circle, deg) = start(290.0, Model::Equidistant, None);
    assert!(matches!(circle, Some(ImageCircle::Assumed { .. })) && deg == Some(145.0), "{deg:?}");
}

#[test]
fn pixels_that_are_not_square_have_two_focal_lengths() {
    for pixel_aspect in [4.0 / 3.0, 16.0 / 11.0, 12.0 / 11.0, 40.0 / 33.0, 0.9] {
        for (fov_deg, lens) in [(20.0, Model::Pinhole), (60.0, Model::Pinhole), (140.0, Model::Equidistant)] {
            let facts =
                CameraFacts { size_px: [240, 240], pixel_aspect, ..known(Some(fov_deg), Some(lens), Exif::default()) };
            let text = write_sensor_toml(&facts).unwrap().text;
            let camera = crate::sensor::parse(&text, Path::new("s.toml")).unwrap().config.camera;
            let told = camera.fy_px / camera.fx_px;
            assert!((told / pixel_aspect - 1.0).abs() < 2e-3, "{told} {pixel_aspect}");
        }
    }
}
