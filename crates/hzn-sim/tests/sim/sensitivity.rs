//! Covariances by design, compared with the reference tables and with the covariances of the sensor.

use hzn_core::body::{self, Kind};
use hzn_core::camera::{self, Model};
use hzn_core::{Config, HostHorizon, Prior, covariance};
use hzn_host::Compiled;
use hzn_sim::pose::position_m;
use hzn_sim::sensitivity::{Design, Sigmas, ThirdAxis, reference};
use hzn_sim::{Look, Pose, Scene};

/// Returns a level pinhole camera of 1920×1080 pixels at 200 km, with R = 1 px², L = 300 px.
fn design(horizontal_fov_deg: f64) -> Design {
    pinhole(1920, 1080, 960.0 / (horizontal_fov_deg / 2.0).to_radians().tan())
}

fn pinhole(width: u16, height: u16, f_px: f64) -> Design {
    Design {
        camera: camera::Config::ideal(Model::Pinhole, width, height, f_px),
        radius_km: 6371.0,
        altitude_km: 200.0,
        altitude_sigma_km: 0.0,
        limb_height_km: 0.0,
        limb_height_sigma_km: 0.5,
        depression_deg: 0.0,
        roll_deg: 0.0,
        sigma_px: 1.0,
        correlation_px: 300.0,
    }
}

fn sigmas(design: &Design) -> Sigmas {
    design.sigmas().unwrap().unwrap()
}

/// Checks that three sigma agree within 2 %.
#[track_caller]
fn near(sigma_deg: f64, expected_3_sigma_deg: f64) {
    let ratio = 3.0 * sigma_deg / expected_3_sigma_deg;
    assert!((ratio - 1.0).abs() < 0.02, "{} {expected_3_sigma_deg}", 3.0 * sigma_deg);
}

/// Checks a row of `reference.rs`: roll, pitch (Braun & Barf 33), pitch with a known α, overbound (37).
#[track_caller]
fn row(design: &Design, [roll, pitch, known, bound]: [f64; 4]) {
    let s = sigmas(design);
    let paper = s.braun_barf.unwrap();
    near(paper.roll_deg, roll);
    near(paper.pitch_deg, pitch);
    near(s.known.pitch_deg, known);
    near(s.braun_barf_bound_deg.unwrap(), bound);
}

#[test]
fn altitudes() {
    for (altitude_km, expected) in reference::BY_ALTITUDE_KM {
        row(&Design { altitude_km, ..design(94.4) }, expected);
    }
}

#[test]
fn fields_of_view_and_their_optimum() {
    for (fov_deg, expected) in reference::BY_FOV_DEG {
        row(&design(fov_deg), expected);
    }
    let pitch = |d: &Design| sigmas(d).braun_barf.unwrap().pitch_deg;
    let best = |f: &dyn Fn(f64) -> Design| {
        let fovs = (160..=260).map(|i| 0.5 * f64::from(i));
        fovs.min_by(|a, b| pitch(&f(*a)).total_cmp(&pitch(&f(*b)))).unwrap()
    };
    assert!((best(&design) - 116.0).abs() <= 1.0);
    let square = |fov: f64| pinhole(1080, 1080, 540.0 / (fov / 2.0).to_radians().tan());
    // Near the optimum the curve is flat: from 108 to 115 degrees it changes by less than 0.3 %.
    assert!((best(&square) / 110.0 - 1.0).abs() < 0.02);
}

#[test]
fn resolutions_and_limb_heights() {
    let vertical = |rows: u16| {
        let f_px = f64::from(rows) / 2.0 / (94.4f64 / 2.0).to_radians().tan();
        pinhole(rows * 16 / 9, rows, f_px)
    };
    for (rows, [roll, pitch]) in reference::BY_ROWS {
        let s = sigmas(&vertical(rows)).braun_barf.unwrap();
        near(s.roll_deg, roll);
        near(s.pitch_deg, pitch);
    }
    for (limb_height_km, [roll, pitch]) in reference::BY_LIMB_HEIGHT_KM {
        let s = sigmas(&Design { limb_height_km, ..vertical(1080) }).braun_barf.unwrap();
        near(s.roll_deg, roll);
        near(s.pitch_deg, pitch);
    }
}

#[test]
fn fused_is_between_known_and_free() {
    for limb_height_sigma_km in [0.0, 0.5, 2.0, 1e6] {
        let s = sigmas(&Design { limb_height_sigma_km, ..design(94.4) });
        assert!(s.fused.pitch_deg <= s.free.pitch_deg * (1.0 + 1e-9));
        assert!((s.fused.roll_deg / s.free.roll_deg - 1.0).abs() < 1e-6, "a level camera's roll needs no half-angle");
        if limb_height_sigma_km == 1e6 {
            assert!((s.fused.pitch_deg / s.free.pitch_deg - 1.0).abs() < 1e-6);
        }
    }
    // A rolled camera has the same accuracy, but about other axes of the picture.
    let (level, rolled) = (sigmas(&design(94.4)), sigmas(&Design { roll_deg: 180.0, ..design(94.4) }));
    assert!((level.free.pitch_deg / rolled.free.pitch_deg - 1.0).abs() < 1e-3);
}

#[test]
fn what_cannot_be_seen_or_flown_is_said() {
    // At 3000 km the limb is beyond the lower border of a narrow level picture.
    assert_eq!(Design { altitude_km: 3000.0, ..design(30.0) }.sigmas().unwrap(), None);
    let inside = Design { limb_height_km: 300.0, ..design(94.4) }.sigmas().unwrap_err();
    assert!(inside.to_string().contains("at 200 km is not above the limb at 300 km"));
    let mut d = design(94.4);
    d.camera.fx_px = 0.0;
    assert!(d.sigmas().unwrap_err().to_string().contains("fx_px"));
}

/// The design predicts the covariance that the sensor reports for a picture without noise.
#[test]
fn the_sensor_reports_what_the_design_says() {
    for (model, f_px, depression_deg) in [(Model::Pinhole, 500.0, 10.0), (Model::Equidistant, 420.0, 20.0)] {
        let camera = camera::Config::ideal(model, 960, 540, f_px);
        let mut config = Config::new(camera.clone());
        config.body = body::Config {
            kind: Kind::EarthSphere,
            altitude_km: Some(200.0),
            altitude_sigma_km: 0.3,
            limb_height_km: 10.0,
            limb_height_sigma_km: 1.0,
            ..body::Config::default()
        };
        config.edge_points.keep_points = 0;
        config.covariance = covariance::Config::given(1.0, 100.0);
        let promised = sigmas(&Design {
            camera: camera.clone(),
            radius_km: config.body.mean_radius_km(),
            altitude_km: 200.0,
            altitude_sigma_km: 0.3,
            limb_height_km: 10.0,
            limb_height_sigma_km: 1.0,
            depression_deg,
            roll_deg: 0.0,
            sigma_px: 1.0,
            correlation_px: 100.0,
        });
        // At the equator the geodetic vertical points to the centre. The scale makes the radius there equal to the
        // sphere's.
        let [x, y, z] = position_m(0.0, 0.0, 0.0);
        let scale = (config.body.mean_radius_km() + 200.0) * 1e3 / x;
        let look = Look { depression_rad: depression_deg.to_radians(), ..Look::default() };
        let mut scene = Scene::new(camera, Pose::looking([x * scale, y, z], look));
        scene.body = config.body.clone();
        let picture = scene.render().unwrap();
        let mut horizon = HostHorizon::boxed(&config).unwrap();
        let expected = horizon.expect(&Prior::default()).unwrap();
        let report = horizon.find(picture.view(), &expected);
        let reported = report.solution.unwrap().covariance.sigma_max_rad().to_degrees();
        let largest = promised.fused.pitch_deg.max(promised.fused.roll_deg);
        assert!((reported / largest - 1.0).abs() < 0.03, "{model:?}: {reported} {largest}");
    }
}

/// The bounds of math.md, 13.8: white errors of 0.05 px, 2513 points on a disc with a radius of 400 px, and 0.1 km of
/// second harmonic at latitude 30. The published values have two digits.
#[test]
fn the_third_axis_has_its_bounds() {
    let design = |radii_km: [f64; 3], altitude_km: f64| {
        let radius_km = radii_km.iter().sum::<f64>() / 3.0;
        let focal_px = 400.0 / (radius_km / (radius_km + altitude_km)).asin();
        ThirdAxis {
            camera: camera::Config {
                theta_max_deg: Some(100.0),
                ..camera::Config::ideal(Model::Equidistant, 1000, 1000, focal_px)
            },
            radii_km,
            limb_height_km: 0.0,
            second_harmonic_km: 0.1,
            altitude_km,
            latitude_deg: 0.0,
            azimuth_deg: 0.0,
            depression_deg: 90.0,
            roll_deg: 0.0,
            sigma_px: 0.05,
            correlation_px: 0.0,
        }
    };
    let earth = [6378.137, 6378.137, 6356.752];
    let jupiter = [71_492.0, 71_492.0, 66_854.0];
    for (radii_km, altitude_km, by_latitude, by_height) in [
        (earth, 600.0, [0.19, 0.25, 0.75], Some(2.2)),
        (earth, 8000.0, [0.070, 0.093, 0.28], Some(0.44)),
        (earth, 35_786.0, [0.060, 0.080, 0.24], Some(0.37)),
        (jupiter, 83.0 * 71_492.0, [0.003, 0.004, 0.013], None),
    ] {
        for (latitude_deg, expected) in [0.0, 30.0, 60.0].into_iter().zip(by_latitude) {
            let at = ThirdAxis { latitude_deg, ..design(radii_km, altitude_km) };
            let sigmas = at.sigmas().unwrap().unwrap();
            println!("{altitude_km} km, {latitude_deg}: {sigmas:?}");
            assert!((sigmas.by_edges_deg / expected - 1.0).abs() < 0.17, "{altitude_km} {latitude_deg}: {sigmas:?}");
            if let Some(by_height) = by_height.filter(|_| latitude_deg == 30.0) {
                assert!((sigmas.by_height_deg / by_height - 1.0).abs() < 0.05, "{altitude_km}: {sigmas:?}");
            }
        }
    }
    // Over the pole of a body of revolution, and for a sphere, there is no third axis.
    let over_the_pole = ThirdAxis { latitude_deg: 90.0, ..design(earth, 600.0) };
    assert_eq!(over_the_pole.sigmas().unwrap(), None);
    assert_eq!(design([1737.4; 3], 600.0).sigmas().unwrap(), None);
    assert!(ThirdAxis { altitude_km: -100.0, ..design(earth, 600.0) }.sigmas().is_err());
}
