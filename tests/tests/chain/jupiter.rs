//! Two photographs of Jupiter whose distance is known: a body that is 6.5 % flat, from the limb alone.

use std::cell::RefCell;
use std::path::Path;

use hzn_core::camera::Camera;
use hzn_core::image::{Grey, Layout};
use hzn_core::observer::{Observer, Unobserved};
use hzn_core::pixel::ImagePoint;
use hzn_core::status::Status;
use hzn_core::{Config, HostHorizon, Prior, Report, body};
use hzn_host::Compiled;
use hzn_tests::real::read_picture;

/// Distances from NAIF kernels, kilometres.
const PICTURES: [(&str, f64); 2] =
    [("jupiter-cassini-n1351122421.png", 62_707_977.6), ("jupiter-cassini-n1352037683.png", 53_060_402.5)];

fn folder() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/data/real/jupiter"))
}

fn sensor() -> Config {
    hzn_files::sensor::load(&folder().join("sensor.toml")).unwrap_or_else(|e| panic!("{e}")).config
}

fn process(config: &Config, file: &str) -> Report<f64> {
    process_observed(config, file, &Unobserved)
}

fn process_observed(config: &Config, file: &str, observer: &dyn Observer<f64>) -> Report<f64> {
    let frames = hzn_files::frames::load(&folder().join("frames.csv")).unwrap_or_else(|e| panic!("{e}"));
    let mut horizon = HostHorizon::boxed(config).unwrap();
    let expected = horizon.expect(&frames.get(file).unwrap().to_prior(None)).unwrap();
    let picture = read_picture(&folder().join(file)).into_luma8();
    let layout = Layout::packed(picture.width(), picture.height(), 1, 8);
    horizon.find_observed(&Grey::try_new(picture.as_raw(), layout).unwrap(), &expected, observer)
}

#[test]
fn the_range_is_right_from_the_limb_alone() {
    for (file, range_km) in PICTURES {
        let report = process(&sensor(), file);
        let solution = report.solution.unwrap_or_else(|| panic!("{file}: {}", report.status));
        let position = solution.position.expect("half of the limb is lit");
        let found_km = position.centre_m.map(|x| x * x).iter().sum::<f64>().sqrt() / 1e3;
        let error = found_km / range_km - 1.0;
        let sigma = position.free_range_m.1 / 1e3 / range_km;
        println!("{file}: {:.3} px, range {:+.3} % ± {:.3} %", solution.rms_px, error * 100.0, sigma * 100.0);
        assert!(error.abs() < 0.0025 && error.abs() < 3.0 * sigma && sigma < 0.004, "{file}: {error}");
        // The goal of 0.12 px is missed by 0.01 px in the second picture, by the shape of Jupiter's own limb: see
        // `the_residuals_are_the_limb_of_jupiter`.
        assert!(solution.rms_px < 0.14, "{file}: {}", solution.rms_px);
        // The camera is in the plane of the equator within four degrees, as the pole in the picture says.
        let [_, _, z] = position.body_fixed_m.expect("the attitude is known");
        assert!((z / 1e3 / range_km).asin().to_degrees().abs() < 4.0);
    }
}

/// Without the direction to the Sun, the fit takes the terminator for limb: Jupiter seems 3 % farther away, by 3.4
/// sigmas before the difference between the whole edge and its best half was added to the covariance.
#[test]
fn the_terminator_is_no_limb_without_the_sun() {
    let frames = hzn_files::frames::load(&folder().join("frames.csv")).unwrap_or_else(|e| panic!("{e}"));
    for (file, range_km) in PICTURES {
        for told in [0.98, 0.99, 1.0, 1.01, 1.02] {
            let mut config = sensor();
            config.body.altitude_sigma_km = 0.0159 * range_km;
            let mut horizon = HostHorizon::boxed(&config).unwrap();
            let known: Prior<f64> = frames.get(file).unwrap().to_prior(None);
            let prior = Prior { sun: None, altitude_m: Some((told * range_km - 71_492.0) * 1e3), ..known };
            let picture = read_picture(&folder().join(file)).into_luma8();
            let layout = Layout::packed(picture.width(), picture.height(), 1, 8);
            let grey = Grey::try_new(picture.as_raw(), layout).unwrap();
            let report = horizon.find(&grey, &horizon.expect(&prior).unwrap());
            let Some(position) = report.solution.and_then(|s| s.position) else { continue };
            let [x, y, z] = position.centre_m;
            let [xx, xy, xz, yy, yz, zz] = position.covariance_m2;
            let found_m = (x * x + y * y + z * z).sqrt();
            let twice = 2.0 * (xy * x * y + xz * x * z + yz * y * z);
            let sigma_m = (xx * x * x + yy * y * y + zz * z * z + twice).sqrt() / found_m;
            let off_m = found_m - range_km * 1e3;
            println!("{file}, told {told}: range {:+.2} % = {:+.1} sigma", off_m / range_km / 10.0, off_m / sigma_m);
            assert!(off_m.abs() <= 2.0 * sigma_m, "{file}, told {told}: {off_m} m, sigma {sigma_m} m");
        }
    }
}

/// With an altitude alone, the flattening has any azimuth, and the terminator looks like a part of it: the axis was
/// wrong by 5 to 7 sigmas of both answers. The answer with attitude and Sun is the truth here, because the pointing of
/// the camera is not known well enough.
#[test]
fn the_terminator_of_a_flat_disc_is_no_limb_without_attitude_and_sun() {
    let mut answered = 0;
    for (file, range_km) in PICTURES {
        let right = process(&sensor(), file).solution.unwrap();
        let mut plain = Config::new(sensor().camera);
        plain.body = body::Config::of_kind(body::Kind::Jupiter, None);
        let mut horizon = HostHorizon::boxed(&plain).unwrap();
        let prior = Prior { altitude_m: Some((range_km - 69_911.0) * 1e3), ..Prior::default() };
        let picture = read_picture(&folder().join(file)).into_luma8();
        let layout = Layout::packed(picture.width(), picture.height(), 1, 8);
        let grey = Grey::try_new(picture.as_raw(), layout).unwrap();
        let report = horizon.find(&grey, &horizon.expect(&prior).unwrap());
        let Some(solution) = report.solution.filter(|_| report.status == Status::Ok) else { continue };
        answered += 1;
        let off: Vec<f64> = solution.axis.xyz().iter().zip(right.axis.xyz()).map(|(a, b)| a - b).collect();
        let off_rad = off.iter().map(|x| x * x).sum::<f64>().sqrt();
        let sigma_rad = solution.covariance.sigma_max_rad();
        println!("{file}: {:.5}°, sigma {:.5}°", off_rad.to_degrees(), sigma_rad.to_degrees());
        assert!(off_rad < 2.0 * sigma_rad && off_rad.to_degrees() < 0.002, "{file}: {off_rad}");
    }
    assert!(answered > 0);
}

#[test]
fn a_sphere_is_refused() {
    for (file, range_km) in PICTURES {
        let mut config = sensor();
        config.body = body::Config {
            kind: body::Kind::Sphere,
            radius_km: Some(69_911.0),
            altitude_km: Some(range_km - 69_911.0),
            altitude_sigma_km: 1000.0,
            ..config.body
        };
        let report = process(&config, file);
        assert!(report.solution.is_none() && report.status == Status::Rejected, "{file}: {}", report.status);
    }
}

/// Collects the points of the only candidate, with their weights.
#[derive(Default)]
struct Points(RefCell<Vec<(ImagePoint<f64>, f64)>>);

impl Observer<f64> for Points {
    fn point(&self, _: u32, point: ImagePoint<f64>) {
        self.0.borrow_mut().push((point, 0.0));
    }
    fn weight(&self, _: u32, point: u32, weight: f64) {
        self.0.borrow_mut()[point as usize].1 = weight;
    }
}

/// Places of a limb from 72 degrees north of the equator to 72 degrees south of it, and their distance.
const PLACES: usize = 24;
const STEP_DEG: f64 = 6.0;

/// Returns the mean distance of the points outside of the fitted limb, km, for each place along the sunlit limb.
fn heights_km(file: &str, range_km: f64) -> Vec<f64> {
    let config = sensor();
    let points = Points::default();
    let position = process_observed(&config, file, &points).solution.unwrap().position.unwrap();
    let camera = Camera::<f64>::try_new(&config.camera).unwrap();
    let limb: Vec<_> = (0..7200)
        .map(|i| camera.project(&position.limb_direction(f64::from(i).to_radians() / 20.0)).unwrap())
        .collect();
    let n = limb.len() as f64;
    let centre = [limb.iter().map(|p| p.u).sum::<f64>() / n, limb.iter().map(|p| p.v).sum::<f64>() / n];
    let polar = |p: &ImagePoint<f64>| {
        let (u, v) = (p.u - centre[0], p.v - centre[1]);
        (v.atan2(u).to_degrees(), u.hypot(v))
    };
    let mut sums = vec![[0.0; 2]; PLACES];
    for (point, _) in points.0.borrow().iter().filter(|(_, weight)| *weight > 0.0) {
        let (azimuth, radius) = polar(point);
        let off = |p: &&ImagePoint<f64>| (polar(p).0 - azimuth).abs();
        let at = limb.iter().min_by(|a, b| off(a).total_cmp(&off(b))).unwrap();
        let place = ((azimuth / STEP_DEG).floor() + PLACES as f64 / 2.0) as usize;
        if azimuth.abs() < STEP_DEG * PLACES as f64 / 2.0 {
            sums[place][0] += (radius - polar(at).1) * range_km / config.camera.fx_px;
            sums[place][1] += 1.0;
        }
    }
    sums.iter().map(|[sum, count]| sum / count).collect()
}

/// The residuals of the fit are not noise. Both pictures have the same profile of residuals in kilometres, although
/// they show other longitudes, eleven days apart. The profile is the height of Jupiter's haze and clouds by latitude,
/// about 40 km, which the 1-sigma of the limb height of 80 km covers. The RMS of the second picture is larger in
/// pixels (0.130), because the camera was closer: a pixel is 318 km there, and 376 km in the first.
#[test]
fn the_residuals_are_the_limb_of_jupiter() {
    let [first, second] = PICTURES.map(|(file, range_km)| heights_km(file, range_km));
    println!("{first:.0?}\n{second:.0?}");
    let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64;
    let (m1, m2) = (mean(&first), mean(&second));
    let product = |a: &[f64], am: f64, b: &[f64], bm: f64| {
        a.iter().zip(b).map(|(a, b)| (a - am) * (b - bm)).sum::<f64>() / a.len() as f64
    };
    let (p11, p22, p12) =
        (product(&first, m1, &first, m1), product(&second, m2, &second, m2), product(&first, m1, &second, m2));
    let correlation = p12 / (p11 * p22).sqrt();
    println!("RMS {:.0} km and {:.0} km, correlation {correlation:.2}", p11.sqrt(), p22.sqrt());
    assert!(correlation > 0.8, "{correlation}");
    assert!(p22.sqrt() < 60.0);
}
