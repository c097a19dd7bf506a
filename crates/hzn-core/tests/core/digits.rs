//! Digits of the answers to drawn pictures, and the verdicts on edges that are bent, cut and dimmed until a gate
//! refuses them. They change only on purpose: `HZN_BLESS=1 cargo test --test core digits` writes them again, and the
//! change shows in the table. The other tests say what is right; these notice that something is different.

use std::fmt::Write as _;
use std::path::Path;

use crate::drawn::Noise;
use hzn_core::body::{Kind, Night};
use hzn_core::camera::{self, Model};
use hzn_core::frames::{Cam, Fixed, Rotation, UnitVec3};
use hzn_core::image::{Grey, Layout};
use hzn_core::tone::Tone;
use hzn_core::{Config, HostHorizon, Prior, Report, consensus, covariance, edge_points, fit};

const SIZE: [u16; 2] = [320, 240];
const FOCAL_PX: f64 = 600.0;

/// Draws a picture from the light at each image point, in counts, with noise of 1.5 counts.
// Only functions of libm take part, so that the pictures are the same on every machine.
fn draw(light: impl Fn([f64; 2]) -> f64) -> Vec<u8> {
    let mut noise = Noise(11);
    let [width, height] = SIZE.map(u32::from);
    (0..width * height)
        .map(|i| {
            let at = [f64::from(i % width), f64::from(i / width)];
            (light(at) + 1.5 * noise.normal()).round().clamp(0.0, 255.0) as u8
        })
        .collect()
}

fn unit(v: [f64; 3]) -> [f64; 3] {
    let length = v.iter().map(|x| x * x).sum::<f64>().sqrt();
    v.map(|x| x / length)
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

/// Returns the direction of an image point.
fn ray([u, v]: [f64; 2]) -> [f64; 3] {
    unit([(u - 159.5) / FOCAL_PX, (v - 119.5) / FOCAL_PX, 1.0])
}

fn lens() -> camera::Config {
    camera::Config::ideal(Model::Pinhole, SIZE[0], SIZE[1], FOCAL_PX)
}

/// Draws the Earth's limb from 400 km. `light` is the brightness at a height above the edge in km and at an image
/// point.
fn earth(light: impl Fn(f64, [f64; 2]) -> f64) -> Vec<u8> {
    let axis = unit([0.1, 0.94, 0.33]);
    draw(|at| light(6771.0 * libm::sqrt(1.0 - dot(ray(at), axis) * dot(ray(at), axis)) - 6388.0, at))
}

fn earth_sensor() -> Config {
    let mut config = Config::new(lens());
    config.body.kind = Kind::EarthSphere;
    config.body.altitude_km = Some(400.0);
    config
}

/// Light of the limb by day, as a part of that of thick air: the body becomes darker inwards.
fn limb(above_km: f64) -> f64 {
    let air = -libm::expm1(-core::f64::consts::LN_2 * libm::exp(-above_km / 7.5));
    air * (1.0 - 0.2 * (-above_km / 100.0).clamp(0.0, 1.0))
}

fn process(config: &Config, prior: &Prior<f64>, data: &[u8]) -> Report<f64> {
    let mut horizon = HostHorizon::boxed(config).unwrap();
    let expected = horizon.expect(prior).unwrap();
    let layout = Layout::packed(SIZE[0].into(), SIZE[1].into(), 1, 8);
    horizon.process(&Grey::try_new(data, layout).unwrap(), &expected)
}

/// The table of a test.
struct Table {
    name: &'static str,
    lines: String,
}

impl Table {
    fn new(name: &'static str) -> Self {
        Self { name, lines: String::new() }
    }

    /// Adds the row of a picture.
    fn add(&mut self, what: &str, report: &Report<f64>) {
        let verdicts: Vec<&str> = report.candidates.iter().map(|edge| edge.verdict.name()).collect();
        write!(self.lines, "{what},{},{},{}", report.status, verdicts.join(" "), report.counters.work).unwrap();
        if let Some(found) = &report.solution {
            let covariance = found.covariance.rows();
            let mut numbers = found.axis.xyz().to_vec();
            numbers.extend([covariance[0][0], covariance[0][1], covariance[1][1], covariance[2][2]]);
            numbers.extend(found.common.map(|common| common.rows()[0][0]));
            numbers.extend([found.half_angle_rad, found.fused_half_angle_rad, found.rms_px, found.noise_rad()]);
            numbers.extend(found.p_limb);
            if let Some(position) = &found.position {
                numbers.extend(position.centre_m.iter().chain(&position.covariance_m2));
                numbers.extend([position.free_range_m.0, position.free_range_m.1]);
                numbers.extend(position.yaw_rad.into_iter().flat_map(|(yaw, sigma)| [yaw, sigma]));
            }
            write!(self.lines, ",{}", found.inliers).unwrap();
            numbers.iter().for_each(|number| write!(self.lines, ",{number:.8e}").unwrap());
        }
        self.lines.push('\n');
    }

    fn check(&self) {
        compare_with_committed("digits", self.name, &self.lines);
    }
}

/// Compares a table with the committed one in a folder beside this file, or writes it with `HZN_BLESS=1`.
pub(crate) fn compare_with_committed(folder: &str, name: &str, lines: &str) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/core").join(folder).join(format!("{name}.csv"));
    if std::env::var_os("HZN_BLESS").is_some() {
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(&path, lines).unwrap();
        return;
    }
    let want = std::fs::read_to_string(&path).unwrap();
    for (now, before) in lines.lines().zip(want.lines()) {
        assert_eq!(now, before, "{name}: if this change is meant, run again with HZN_BLESS=1");
    }
    assert_eq!(lines.lines().count(), want.lines().count());
}

#[test]
fn of_limbs_that_become_dim_bright_or_soft() {
    let (config, mut table) = (earth_sensor(), Table::new("light"));
    let prior = Prior::default();
    for counts in [2.0, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0, 15.0, 20.0, 30.0, 60.0, 120.0, 300.0, 500.0, 1500.0] {
        let data = earth(|km, _| 5.0 + counts * limb(km));
        table.add(&format!("counts {counts}"), &process(&config, &prior, &data));
    }
    for softness in [0.1, 0.2, 0.5, 2.0, 4.0, 8.0] {
        let data = earth(|km, _| 5.0 + 150.0 * limb(km / softness));
        table.add(&format!("softness {softness}"), &process(&config, &prior, &data));
    }
    for sky in [0.1, 0.2, 0.4, 0.6, 0.8] {
        let data = earth(|km, [u, _]| 5.0 + 150.0 * limb(km).max(sky * (0.5 + 0.5 * libm::sin(u / 20.0))));
        table.add(&format!("sky {sky}"), &process(&config, &prior, &data));
    }
    for haze in [0.1, 0.3, 0.5, 0.8] {
        let data = earth(|km, _| 5.0 + 150.0 * limb(km).max(haze * libm::exp(-km.max(0.0) / 80.0)));
        table.add(&format!("haze {haze}"), &process(&config, &prior, &data));
    }
    table.check();
}

#[test]
fn of_limbs_that_are_bent_or_cut() {
    let (mut config, mut table) = (earth_sensor(), Table::new("shape"));
    // The size of the body is uncertain, so that the form of the edge decides.
    config.body.altitude_sigma_km = 60.0;
    let prior = Prior::default();
    let mut add = |what: String, light: &dyn Fn(f64, [f64; 2]) -> f64| {
        table.add(&what, &process(&config, &prior, &earth(light)));
    };
    // A pixel is 3.7 km at the limb.
    for wave_px in [0.2, 0.4, 0.6, 0.8, 1.0, 1.3, 1.6, 2.0, 3.0, 5.0] {
        add(format!("wave {wave_px}"), &|km, [u, _]| 5.0 + 150.0 * limb(km + 3.7 * wave_px * libm::sin(u / 15.0)));
        let fold = |u: f64| (u / 50.0 - (u / 50.0).floor() - 0.5).abs();
        add(format!("pieces {wave_px}"), &|km, [u, _]| 5.0 + 150.0 * limb(km + 7.4 * wave_px * fold(u)));
        add(format!("bend {wave_px}"), &|km, [u, _]| {
            5.0 + 150.0 * limb(km + 3.7 * wave_px * ((u - 160.0) / 80.0) * ((u - 160.0) / 80.0))
        });
    }
    for from_px in [20.0, 60.0, 100.0, 140.0, 180.0, 220.0, 260.0, 290.0] {
        add(format!("dark until {from_px}"), &|km, [u, _]| if u < from_px { 5.0 } else { 5.0 + 150.0 * limb(km) });
    }
    for slope in [0.02, 0.05, 0.1, 0.2, 0.4, 0.8, 1.6] {
        let beyond = |u: f64| (u - 200.0).max(0.0) * 3.7 * slope;
        add(format!("leaves with {slope}"), &|km, [u, _]| 5.0 + 150.0 * limb(km - beyond(u)));
    }
    for width_km in [10.0, 20.0, 40.0, 80.0, 160.0] {
        for rest in [0.0, 0.1, 0.3, 0.6] {
            let inside = |km: f64| if km < -width_km { rest } else { 1.0 };
            add(format!("band {width_km} {rest}"), &|km, _| 5.0 + 150.0 * limb(km) * inside(km));
        }
    }
    table.check();
}

#[test]
fn of_the_layer_of_airglow() {
    let (mut config, mut table) = (earth_sensor(), Table::new("airglow"));
    config.body.night = Night::Airglow;
    let prior = Prior { sun_elevation_rad: Some(-1.0), ..Prior::default() };
    config.input.tone = Some(Tone::Linear);
    // The light along a line of sight with this tangent height, through a layer with its peak at 97 km.
    let emission = |height_km: f64| {
        let z = (height_km - 97.0) / 5.0;
        libm::exp(1.0 - z - libm::exp(-z))
    };
    let way = |tangent_km: f64, km: i32| libm::sqrt((6371.0 + tangent_km).powi(2) + f64::from(km * km)) - 6371.0;
    let glow: Vec<f64> = (-300..300)
        .map(|tangent_km| (0..800).map(|k| emission(way(f64::from(tangent_km), 2 * k))).sum::<f64>() / 500.0)
        .collect();
    let layer = |tangent_km: f64| {
        let at = (tangent_km + 300.0).clamp(0.0, 598.0);
        let (k, part) = (at as usize, at.fract());
        glow[k] * (1.0 - part) + glow[k + 1] * part
    };
    // Behind the ground no light is seen: half of the line is left.
    let seen = |km: f64, ground: f64| if km < 0.0 { 0.5 * layer(km) + ground } else { layer(km) };
    let mut add = |what: String, ground: f64, along: &dyn Fn(f64) -> f64| {
        let data = earth(|km, [u, _]| 5.0 + 240.0 * (seen(km + 17.0, ground) * along(u)).min(1.0));
        table.add(&what, &process(&config, &prior, &data));
    };
    for ground in [0.01, 0.1, 0.3, 0.6, 1.0] {
        add(format!("ground {ground}"), ground, &|_| 1.0);
    }
    for uneven in [0.1, 0.2, 0.25, 0.3, 0.35, 0.4, 0.5] {
        add(format!("uneven {uneven}"), 0.01, &|u| 1.0 - uneven * (1.0 - libm::sin(u / 7.0)));
    }
    for from_px in [5.0, 10.0, 15.0, 20.0, 60.0, 120.0, 200.0] {
        add(format!("dark until {from_px}"), 0.01, &|u| f64::from(u8::from(u >= from_px)));
    }
    table.check();
}

/// Draws an ellipsoid with these semi-axes about its own axes, lit from one side.
fn ellipsoid(
    semi_axes_km: [f64; 3],
    centre_km: [f64; 3],
    to_fixed: &Rotation<Cam, Fixed, f64>,
    sun: [f64; 3],
) -> Vec<u8> {
    let fixed = |v: [f64; 3]| {
        let length = dot(v, v).sqrt();
        let turned = to_fixed.apply(&UnitVec3::try_new(v).unwrap()).xyz();
        turned.map(|x| x * length)
    };
    let scaled = |v: [f64; 3]| [0, 1, 2].map(|k| v[k] / semi_axes_km[k]);
    let (centre, sun) = (fixed(centre_km), fixed(sun));
    let light = |at: [f64; 2]| {
        let (c, d) = (scaled(centre), scaled(fixed(ray(at))));
        let (dd, dc, cc) = (dot(d, d), dot(d, c), dot(c, c));
        let below = dc * dc - dd * (cc - 1.0);
        if below <= 0.0 {
            return 0.0;
        }
        let t = (dc - below.sqrt()) / dd;
        let normal = unit([0, 1, 2].map(|k| (d[k] * t - c[k]) / semi_axes_km[k]));
        dot(normal, sun).max(0.0)
    };
    let corners = [[-0.25, -0.25], [0.25, -0.25], [-0.25, 0.25], [0.25, 0.25]];
    draw(|[u, v]| 6.0 + 45.0 * corners.iter().map(|[x, y]| light([u + x, v + y])).sum::<f64>())
}

#[test]
fn of_positions_of_an_ellipsoid() {
    let mut table = Table::new("position");
    let semi_axes_km = [71_492.0, 71_492.0, 66_854.0];
    for (k, turn) in [0.0, 0.3, 0.7, 1.1, 1.5].into_iter().enumerate() {
        let q = [libm::cos(turn), libm::sin(turn) * 0.6, 0.0, libm::sin(turn) * 0.8];
        let to_fixed = Rotation::<Cam, Fixed, f64>::assume_from_quaternion(q).unwrap();
        for (phase, sigma_km) in [(0.0, 1.0), (0.4, 1.0), (0.9, 50.0), (1.3, 50.0)] {
            let centre = [9e4 + 1e4 * k as f64, -4e4, 1e6];
            let sun = [libm::sin(phase), 0.0, -libm::cos(phase)];
            let mut config = Config::new(lens());
            config.body = hzn_core::body::Config {
                limb_height_km: 0.0,
                limb_height_sigma_km: sigma_km,
                ..hzn_core::body::Config::of_kind(Kind::Ellipsoid, Some(semi_axes_km))
            };
            config.fit.position = Some(true);
            config.fit.yaw_limit_deg = 60.0;
            let data = ellipsoid(semi_axes_km, centre, &to_fixed, sun);
            let told = Prior { fixed_from_camera: Some(to_fixed), attitude_sigma_rad: Some(0.02), ..Prior::default() };
            let with_sun = Prior { sun: UnitVec3::try_new(sun), ..told };
            let near = Prior { range_m: Some(1.01e9), range_sigma_m: Some(2e7), ..with_sun };
            for (what, prior) in [("attitude", told), ("sun", with_sun), ("range", near)] {
                table.add(&format!("turn {turn} phase {phase} {what}"), &process(&config, &prior, &data));
            }
            // Only the direction is fitted; the distance is that of the altitude.
            config.fit.position = Some(false);
            (config.body.altitude_km, config.body.altitude_sigma_km) = (Some(dot(centre, centre).sqrt() - 71e3), 2e4);
            table.add(&format!("turn {turn} phase {phase} direction"), &process(&config, &with_sun, &data));
        }
    }
    table.check();
}

#[test]
fn of_a_disc_that_leaves_the_picture_and_of_a_told_sun() {
    let mut table = Table::new("disc");
    let mut config = Config::new(lens());
    config.body.kind = Kind::Sphere;
    config.body.radius_km = Some(1000.0);
    (config.body.limb_height_km, config.body.limb_height_sigma_km) = (0.0, 2.0);
    (config.body.altitude_km, config.body.altitude_sigma_km) = (Some(9000.0), 100.0);
    let to_fixed = Rotation::<Cam, Fixed, f64>::assume_from_quaternion([1.0, 0.0, 0.0, 0.0]).unwrap();
    let draw = |x_km: f64, sun: [f64; 3]| ellipsoid([1000.0; 3], [x_km, 400.0, 9987.0], &to_fixed, sun);
    for x_km in [0.0, 1200.0, 1600.0, 2000.0, 2400.0, 2800.0, 3200.0, 3500.0] {
        let report = process(&config, &Prior::default(), &draw(x_km, [0.0, 0.0, -1.0]));
        table.add(&format!("centre {x_km}"), &report);
    }
    for phase in [0.3, 0.8, 1.2, 1.6] {
        let data = draw(300.0, [libm::sin(phase), 0.0, -libm::cos(phase)]);
        for told_deg in [0.0, 20.0, 45.0, 70.0, 90.0, 110.0, 135.0, 180.0, 270.0] {
            let told = f64::to_radians(told_deg);
            let across = libm::sin(phase);
            let sun = [across * libm::cos(told), across * libm::sin(told), -libm::cos(phase)];
            let prior = Prior { sun: UnitVec3::try_new(sun), ..Prior::default() };
            table.add(&format!("phase {phase} told {told_deg}"), &process(&config, &prior, &data));
        }
    }
    table.check();
}

#[test]
fn of_an_uncertain_lens() {
    let mut table = Table::new("lens");
    for (focal, k1) in [(0.001, 0.0), (0.02, 0.0), (0.02, 0.05), (0.05, 0.5)] {
        let mut config = earth_sensor();
        config.camera = camera::Config::ideal(Model::KannalaBrandt, SIZE[0], SIZE[1], FOCAL_PX);
        config.camera.k = [1.0 / 3.0].into_iter().collect();
        let (ff, kk) = ((focal * FOCAL_PX) * (focal * FOCAL_PX), k1 * k1 + 1e-12);
        config.camera.covariance = Some(camera::Covariance {
            order: [camera::Intrinsic::FxPx, camera::Intrinsic::FyPx, camera::Intrinsic::K1].into_iter().collect(),
            rows: [[ff, ff, 0.0], [ff, ff, 0.0], [0.0, 0.0, kk]]
                .iter()
                .map(|row| row.iter().copied().collect())
                .collect(),
        });
        for bend_px in [0.0, 0.3, 0.6, 1.0, 2.0, -0.6, -2.0] {
            let bend = |u: f64| 3.7 * bend_px * ((u - 160.0) / 80.0) * ((u - 160.0) / 80.0);
            let data = earth(|km, [u, _]| 5.0 + 150.0 * limb(km + bend(u)));
            table.add(&format!("focal {focal} k1 {k1} bend {bend_px}"), &process(&config, &Prior::default(), &data));
        }
    }
    table.check();
}

#[test]
fn of_every_method() {
    let mut table = Table::new("methods");
    let outliers = earth(|km, [u, v]| 5.0 + 150.0 * limb(km) + if u > 250.0 && v > 60.0 { 60.0 } else { 0.0 });
    let clean = earth(|km, _| 5.0 + 150.0 * limb(km));
    let mut all: Vec<(String, Config)> = Vec::new();
    let mut add = |what: &str, change: &dyn Fn(&mut Config)| {
        let mut config = earth_sensor();
        change(&mut config);
        all.push((what.to_owned(), config));
    };
    use consensus::Method as C;
    for method in [C::TwoPoint, C::None, C::Ransac, C::RansacPreverify, C::Mlesac] {
        add(&format!("{method:?}"), &|config| config.consensus.method = method);
    }
    use fit::Method as F;
    for method in [F::Sphere, F::Direct, F::Conic, F::Tls, F::Wtls, F::LeastSquares] {
        add(&format!("{method:?}"), &|config| config.fit.method = method);
    }
    for half_angle in [fit::HalfAngle::Fused, fit::HalfAngle::Known, fit::HalfAngle::Free] {
        add(&format!("{half_angle:?}"), &|config| config.fit.half_angle = half_angle);
    }
    use edge_points::SubPixel as S;
    for method in [S::Linear, S::None, S::Erf, S::Zernike] {
        add(&format!("{method:?}"), &|config| config.edge_points.sub_pixel = method);
    }
    for sigma_px in [0.1, 0.5] {
        add(&format!("given {sigma_px}"), &|config| config.covariance = covariance::Config::given(sigma_px, 0.0));
    }
    for (what, config) in all {
        table.add(&format!("{what} clean"), &process(&config, &Prior::default(), &clean));
        table.add(&format!("{what} outliers"), &process(&config, &Prior::default(), &outliers));
    }
    table.check();
}

/// The axis of a fit with a known half-angle moves with it, as its derivative says.
#[test]
fn a_known_half_angle_moves_the_axis() {
    let data = earth(|km, _| 5.0 + 150.0 * limb(km));
    let at = |limb_height_km: f64, half_angle: fit::HalfAngle| {
        let mut config = earth_sensor();
        config.body.limb_height_km = limb_height_km;
        config.fit.half_angle = half_angle;
        let mut horizon = HostHorizon::boxed(&config).unwrap();
        let expected = horizon.expect(&Prior::default()).unwrap();
        let picture = Grey::try_new(&data, Layout::packed(SIZE[0].into(), SIZE[1].into(), 1, 8)).unwrap();
        (expected.cos_and_sigma().0, horizon.process(&picture, &expected).solution.unwrap())
    };
    for (half_angle, tolerance) in [(fit::HalfAngle::Known, 0.01), (fit::HalfAngle::Fused, 0.05)] {
        let (low, high) = (at(16.5, half_angle), at(17.5, half_angle));
        let by_cos = low.1.axis_by_cos.unwrap();
        let (before, after) = (low.1.axis.xyz(), high.1.axis.xyz());
        let moved = [0, 1, 2].map(|k| (after[k] - before[k]) / (high.0 - low.0));
        let off = [0, 1, 2].map(|k| moved[k] - by_cos[k]);
        let size = dot(by_cos, by_cos).sqrt();
        assert!(size > 0.5 && dot(off, off).sqrt() < tolerance * size, "{half_angle:?}: {moved:?} {by_cos:?}");
    }
}
