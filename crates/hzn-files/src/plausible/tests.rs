use super::*;

fn camera(model: Model, size: [u16; 2], focal: [f64; 2], centre: [f64; 2], k: &[f64]) -> camera::Config {
    let mut c = camera::Config::ideal(model, size[0], size[1], focal[0]);
    (c.fy_px, c.cx_px, c.cy_px) = (focal[1], centre[0], centre[1]);
    c.k = k.iter().copied().collect();
    c
}

fn warnings(c: &camera::Config) -> String {
    let found = check_camera(c);
    found.iter().map(|d| format!("{}: {}", d.key, d.what)).collect::<Vec<_>>().join("\n")
}

#[test]
fn swapped_and_absurd_cameras_are_reported() {
    let hd = |focal, centre| warnings(&camera(Model::Pinhole, [1920, 1080], focal, centre, &[]));
    assert_eq!(hd([1200.0; 2], [963.2, 536.7]), "");
    assert_eq!(hd([1200.0; 2], [1100.0, 500.0]), "");
    assert!(hd([1200.0; 2], [536.7, 963.2]).contains("are cx_px and cy_px, or width and height, swapped?"));
    assert!(hd([1200.0; 2], [480.0, 270.0]).contains("is the calibration for pictures of about 961 x 541 px?"));
    assert!(hd([1200.0; 2], [0.5, 0.5]).contains("counted in pixels from the picture's upper left corner"));
    assert!(hd([1200.0; 2], [1800.0, 540.0]).contains("was the picture cut from a larger one?"));
    assert!(hd([1200.0, 675.0], [960.0, 540.0]).contains("fy_px = 675 make pixels that are not square"));
    assert!(hd([8.0; 2], [960.0, 540.0]).contains("field of view of 179 degrees: is it in millimetres?"));
    assert!(hd([500_000.0; 2], [960.0, 540.0]).contains("field of view of 0.22 degrees"));
    // HORACE's camera, a telescope for the Moon, and a fisheye lens with its image circle.
    assert_eq!(warnings(&camera(Model::Pinhole, [1024, 768], [2133.0; 2], [511.5, 383.5], &[])), "");
    assert_eq!(warnings(&camera(Model::Pinhole, [2048, 1944], [9200.0; 2], [1023.5, 971.5], &[])), "");
    let fisheye = camera(Model::KannalaBrandt, [1440, 1080], [458.0; 2], [719.5, 539.5], &[-0.05, 0.01, -0.003, 0.0]);
    assert_eq!(warnings(&fisheye), "");
    let circle = |deg| warnings(&camera::Config { theta_max_deg: Some(deg), ..fisheye.clone() });
    assert_eq!(circle(90.0), "");
    assert!(circle(1.57).contains("an image circle of 1.57 degrees leaves out most of the picture: is it in radians?"));
    assert!(warnings(&camera(Model::Equidistant, [1440, 1080], [4.0; 2], [719.5, 539.5], &[])).contains("millimetres"));
}

#[test]
fn coefficients_in_another_order_are_reported() {
    let with = |model, k: &[f64]| camera(model, [1920, 1080], [1235.0; 2], [963.0, 537.0], k);
    assert!(warnings(&with(Model::KannalaBrandt, &[1.0, -0.055, 0.011, -0.0035])).contains("leave the 1 of the first"));
    assert_eq!(warnings(&with(Model::BrownConrady, &[-0.3, 0.1, 0.001, -0.002, -0.02])), "");
    assert!(
        warnings(&with(Model::BrownConrady, &[-0.3, 0.1, -0.09, 0.001, -0.002]))
            .contains("order is k1, k2, p1, p2, k3")
    );
    let five = |k: &[f64]| explain_five_coefficients(&with(Model::KannalaBrandt, k));
    assert!(
        five(&[1.0, -0.055, 0.011, -0.0035, 0.0002]).unwrap().contains("write k = [-0.055, 0.011, -0.0035, 0.0002] (")
    );
    let in_px = five(&[1250.0, -62.5, 12.5, -4.0, 0.25]).unwrap();
    assert!(in_px.contains("write fx_px = fy_px = 1250 and k = [-0.05, 0.01, -0.0032, 0.0002] ("), "{in_px}");
    assert_eq!(five(&[-0.05, 0.01, 0.0, 0.0, 0.0002]), None);
}

#[test]
fn the_air_of_the_earth_around_another_sphere_is_reported() {
    let sphere = |radius_km, limb_height_km| {
        let kind = body::Kind::Sphere;
        let body = body::Config { kind, radius_km: Some(radius_km), limb_height_km, ..body::Config::default() };
        check_body(&body, &wide()).map(|d| d.what).unwrap_or_default()
    };
    let moon = sphere(1737.4, 17.0);
    assert!(moon.contains("a body without air has limb_height_km = 0.0, limb_height_sigma_km = 5.2, "), "{moon}");
    assert_eq!(sphere(1737.4, 0.0) + &sphere(6371.0, 17.0), "");
}

#[test]
fn a_mask_of_everything_or_nothing_is_reported() {
    let mut config = Config::new(camera(Model::Pinhole, [640, 480], [600.0; 2], [319.5, 239.5], &[]));
    let mut with = |corners: &[[f64; 2]]| {
        config.mask.polygons_px = [corners.iter().copied().collect()].into_iter().collect();
        find_implausible(&config).first().map(|d| d.what.clone()).unwrap_or_default()
    };
    let box_of = |x: f64, y: f64, w: f64, h: f64| [[x, y], [x + w, y], [x + w, y + h], [x, y + h]];
    assert!(with(&box_of(-1.0, -1.0, 642.0, 482.0)).starts_with("covers the whole picture"));
    assert!(with(&box_of(700.0, 0.0, 100.0, 100.0)).starts_with("polygon 1 lies outside of the picture"));
    assert_eq!(with(&box_of(0.0, 0.0, 640.0, 400.0)) + &with(&box_of(600.0, 0.0, 100.0, 100.0)), "");
}

/// A camera for the Earth from near.
fn wide() -> camera::Config {
    camera(Model::Pinhole, [640, 480], [600.0; 2], [319.5, 239.5], &[])
}

#[test]
fn a_camera_for_a_far_disc_is_far_away() {
    // 0.61 degrees, with the Earth of 0.49 degrees from the Lagrangian point, and the Moon from the Earth.
    let telescope = camera(Model::Pinhole, [2048, 2048], [192_360.0; 2], [1023.5; 2], &[]);
    let at = |camera: &camera::Config, kind, km| {
        let radius_km = (kind == body::Kind::Sphere).then_some(1737.4);
        let body = body::Config { kind, radius_km, altitude_km: Some(km), ..body::Config::default() };
        check_altitude(&body, camera)
    };
    assert_eq!(at(&telescope, body::Kind::Earth, 1_480_000.0), None);
    assert_eq!(at(&telescope, body::Kind::Sphere, 380_000.0), None);
    // The disc would be larger than the picture, or a dot in it.
    assert!(at(&telescope, body::Kind::Earth, 550_000.0).is_some());
    assert!(at(&wide(), body::Kind::Earth, 1_480_000.0).is_some());
    assert!(at(&wide(), body::Kind::Earth, 550_000.0).is_some());
}

#[test]
fn altitudes_in_metres_and_of_the_moon_are_reported() {
    let with = |kind, km| {
        let radius_km = (kind == body::Kind::Sphere).then_some(1737.4);
        let body = body::Config { kind, radius_km, altitude_km: Some(km), ..body::Config::default() };
        check_altitude(&body, &wide()).map(|d| d.what).unwrap_or_default()
    };
    assert_eq!(with(body::Kind::Earth, 35_786.0) + &with(body::Kind::Sphere, 100.0), "");
    assert!(with(body::Kind::Earth, 230_000.0).ends_with("is it in metres?"));
    assert!(with(body::Kind::Earth, 378_000.0).ends_with("as far away as the Moon it is right)"));
    assert!(with(body::Kind::Sphere, 100_000.0).contains("is it in metres?"));
    assert!(
        with(body::Kind::Moon, 100.0).contains("write kind = \"sphere\", radius_km = 1737.4, limb_height_km = 0.0")
    );
    assert!(with(body::Kind::Sun, 400.0).contains("is not used"));
}
