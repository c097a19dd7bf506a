//! Drawn bodies without air that the Sun lights from one side: the told Sun must agree with the picture.

use hzn_core::body::Kind;
use hzn_core::camera::{self, Model};
use hzn_core::frames::UnitVec3;
use hzn_core::image::{Grey, Layout};
use hzn_core::status::Status;
use hzn_core::{Config, HostHorizon, Prior, Report};

const RADIUS_KM: f64 = 1737.4;
const RANGE_KM: f64 = 40_000.0;
const WIDTH: u16 = 320;
const HEIGHT: u16 = 256;

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

fn unit(a: [f64; 3]) -> [f64; 3] {
    a.map(|x| x / dot(a, a).sqrt())
}

fn sensor() -> Config {
    let mut config = Config::new(camera::Config::ideal(Model::Pinhole, WIDTH, HEIGHT, 1600.0));
    config.body.kind = Kind::Moon;
    config.fit.position = Some(true);
    config
}

/// Brightness of a surface from the cosines of the angles to the Sun and to the camera.
type Law = fn(f64, f64) -> f64;

/// A picture of a body, with the direction to the Sun.
struct Scene {
    picture: Vec<u8>,
    sun: [f64; 3],
}

impl Scene {
    /// Draws a body at a phase angle, lit from an azimuth, both in degrees. Dark ground is 0.6 times as
    /// bright as the rest.
    fn draw(phase_deg: f64, azimuth_deg: f64, law: Law) -> Self {
        let (sin_azimuth, cos_azimuth) = azimuth_deg.to_radians().sin_cos();
        let (sin_phase, cos_phase) = phase_deg.to_radians().sin_cos();
        let sun = [sin_phase * cos_azimuth, sin_phase * sin_azimuth, -cos_phase];
        let camera = sensor().camera;
        let centre = [40.0, -25.0, RANGE_KM];
        // The dark ground lies about this point of the body.
        let dark = unit([-sin_azimuth, 0.4, -1.0 + 0.3 * cos_azimuth]);
        let light = |u: f64, v: f64| {
            let ray = unit([(u - camera.cx_px) / camera.fx_px, (v - camera.cy_px) / camera.fy_px, 1.0]);
            let along = dot(ray, centre);
            let below = along * along - dot(centre, centre) + RADIUS_KM * RADIUS_KM;
            if below <= 0.0 {
                return 0.0;
            }
            let distance = along - below.sqrt();
            let normal = [0, 1, 2].map(|k| (ray[k] * distance - centre[k]) / RADIUS_KM);
            let (mu0, mu) = (dot(normal, sun), -dot(normal, ray));
            let albedo = if dot(normal, dark) > 0.8 { 0.6 } else { 1.0 };
            if mu0 > 0.0 { law(mu0, mu) * albedo } else { 0.0 }
        };
        let mut noise = 12_345_u64;
        let picture = (0..usize::from(WIDTH) * usize::from(HEIGHT)).map(|i| {
            let (u, v) = ((i % usize::from(WIDTH)) as f64, (i / usize::from(WIDTH)) as f64);
            let offsets = (0..16).map(|k| [f64::from(k % 4) / 4.0 - 0.375, f64::from(k / 4) / 4.0 - 0.375]);
            // Twice as wide as a pixel: the blur of the lens.
            let mean = offsets.map(|[x, y]| light(u + 2.0 * x, v + 2.0 * y)).sum::<f64>() / 16.0;
            noise = noise.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            let noise = (noise >> 40) as f64 / f64::from(1 << 24) * 4.0;
            (mean * 180.0 + 8.0 + noise).clamp(0.0, 255.0) as u8
        });
        Self { picture: picture.collect(), sun }
    }

    /// Processes the picture with a told direction to the Sun.
    fn process(&self, told: [f64; 3], config: &Config) -> Report<f64> {
        let mut horizon = HostHorizon::boxed(config).unwrap();
        let sun = UnitVec3::try_new(told);
        let expected = horizon.expect(&Prior { sun, ..Prior::default() }).unwrap();
        let layout = Layout::packed(u32::from(WIDTH), u32::from(HEIGHT), 1, 8);
        horizon.process(&Grey::try_new(&self.picture, layout).unwrap(), &expected)
    }

    /// Returns the relative error of the range, if there is an answer.
    fn range_error(&self, told: [f64; 3], config: &Config) -> Option<f64> {
        let report = self.process(told, config);
        let position = report.solution.filter(|_| report.status == Status::Ok)?.position?;
        Some(dot(position.centre_m, position.centre_m).sqrt() / 1e3 / RANGE_KM - 1.0)
    }
}

fn scenes() -> impl Iterator<Item = (String, Scene)> {
    let laws: [(&str, Law); 2] = [("Lambert", |mu0, _| mu0), ("Lommel-Seeliger", |mu0, mu| 2.0 * mu0 / (mu0 + mu))];
    laws.into_iter().flat_map(|(name, law)| {
        [10.0, 20.0, 25.0, 30.0, 35.0, 50.0, 75.0, 100.0].into_iter().enumerate().flat_map(move |(i, phase)| {
            let azimuths = (0..3).map(move |k| 17.0 * i as f64 + 120.0 * f64::from(k));
            azimuths.map(move |azimuth| {
                (format!("{name}, phase {phase}°, azimuth {azimuth}°"), Scene::draw(phase, azimuth, law))
            })
        })
    })
}

#[test]
fn a_sun_with_the_wrong_sign_makes_no_limb_of_the_terminator() {
    let config = sensor();
    let mut unguarded = config.clone();
    unguarded.gates.max_unlit = 1.0;
    let mut misled = 0;
    for (name, scene) in scenes() {
        let told = scene.sun.map(|x| -x);
        let answer = scene.range_error(told, &config);
        let without = scene.range_error(told, &unguarded);
        println!("{name}: {answer:?}, without the gate {without:?}");
        assert_eq!(answer, None, "{name}");
        misled += i32::from(without.is_some());
    }
    assert!(misled >= 3, "only {misled} pictures would mislead: they are no test");
}

#[test]
fn a_sun_of_the_right_sign_keeps_the_answers() {
    let config = sensor();
    let mut unguarded = config.clone();
    unguarded.gates.max_unlit = 1.0;
    let mut answers = 0;
    for (name, scene) in scenes() {
        let answer = scene.range_error(scene.sun, &config);
        println!("{name}: {answer:?}");
        assert_eq!(answer, scene.range_error(scene.sun, &unguarded), "{name}");
        answers += i32::from(answer.is_some());
    }
    assert!(answers >= 40, "{answers} of 48");
}
