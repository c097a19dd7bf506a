//! Bias, spread and covariance of the position over many fits to noisy limb points: sphere, oblate and tri-axial
//! bodies, arcs of every length.

use super::*;
use crate::base::linalg::M3;
use crate::model::body::Target;
use crate::pipeline::Sensor;
use crate::stages::fit::{closed, fit_position_from};
use std::format;

/// A body as one camera sees it.
struct Scene {
    name: &'static str,
    sensor: Sensor<f64>,
    expected: Expected<f64>,
    /// From the camera to the centre, in units of the mean semi-axis.
    r: V3<f64>,
    points_per_turn: f64,
}

impl Scene {
    /// Makes a scene with a body at `distance` mean semi-axes, whose disc has a radius of 400 px. The body is turned by
    /// the quaternion; the camera looks `off_deg` past its centre.
    fn new(name: &'static str, radii_km: [f64; 3], distance: f64, model: Model, off_deg: f64, q: [f64; 4]) -> Self {
        let alpha = libm::asin(1.0 / distance);
        let focal_px = match model {
            Model::Pinhole => 400.0 / libm::tan(alpha),
            _ => 400.0 / alpha,
        };
        let camera = CameraConfig {
            cx_px: 0.0,
            cy_px: 0.0,
            theta_max_deg: (model == Model::Equidistant).then_some(160.0),
            ..CameraConfig::ideal(model, 65_000, 65_000, focal_px)
        };
        let mut config = crate::Config::new(camera);
        config.body = body::Config {
            limb_height_km: 0.0,
            limb_height_sigma_km: 0.0,
            ..body::Config::of_kind(body::Kind::Ellipsoid, Some(radii_km))
        };
        let sensor = Sensor::new(&config).unwrap();
        let fixed_from_camera = Rotation::assume_from_quaternion(q);
        let prior = Prior { fixed_from_camera, attitude_sigma_rad: Some(0.0), ..Prior::default() };
        let expected = sensor.expect(&prior).unwrap();
        let (sin, cos) = libm::sincos(off_deg.to_radians());
        Self { name, sensor, expected, r: V3::new(sin, 0.0, cos) * distance, points_per_turn: 1257.0 }
    }

    fn target(&self) -> &Target<f64> {
        self.expected.target.as_ref().unwrap()
    }

    /// Returns the exact limb over an arc, one point per two pixels.
    fn limb(&self, arc_deg: f64) -> Vec<(f64, f64)> {
        let camera = self.sensor.camera_for(&self.expected).unwrap();
        let y = self.target().scaling.to * self.r;
        let (e, sin) = (y.normalize(), 1.0 / y.norm());
        let (b1, b2) = basis(&e);
        let arc = arc_deg.to_radians();
        let count = (self.points_per_turn * arc_deg / 360.0) as usize;
        let point = |i: usize| {
            let (s, c) = libm::sincos(0.7 + arc * ((i as f64 + 0.5) / count as f64 - 0.5));
            let ray = e * libm::sqrt(1.0 - sin * sin) + (b1 * c + b2 * s) * sin;
            let p = camera.project(&UnitVec3::assume_unit(ray)).unwrap();
            (p.u, p.v)
        };
        (0..count).map(point).collect()
    }

    /// Fits the points without a prior; `None` outside the gate.
    fn fit(&self, points: &[(f64, f64)], sigma_px: f64) -> Option<(V3<f64>, M3<f64>)> {
        let camera = self.sensor.camera_for(&self.expected).unwrap();
        let lit = UnitVec3::assume_unit((self.target().scaling.to * self.r).normalize());
        let mut blocks = blocks(&camera, points, &lit);
        let start = closed::generalised_tls(&blocks)?;
        let fit = fit_position_from(&mut blocks, start, &self.target().scaling)?;
        let noise = covariance::Config::given(sigma_px, 0.0);
        let estimate = fit::Config::default();
        // The told noise is the true one; the residuals must not raise it.
        let fit = fit::Fit { rms_px: 0.0, ..fit };
        let fused = covariance::fuse(&blocks, &fit, &self.expected, &noise, &estimate, &camera, None)?;
        let located = fused.located?;
        Some((located.r, located.p))
    }

    fn run(&self, arc_deg: f64, sigma_px: f64, runs: u32) -> Outcome {
        let exact = self.limb(arc_deg);
        let (_, bound) = self.fit(&exact, sigma_px).expect("the arc is inside the gate");
        let (distance, u) = (self.r.norm(), self.r.normalize());
        let sigma = libm::sqrt(u.dot(&(bound * u))) / distance;
        let mut gauss = Gauss(crate::base::rng::Rng::new(11));
        let mut out = Outcome { sigma, ..Outcome::default() };
        for _ in 0..runs {
            let noisy: Vec<_> =
                exact.iter().map(|&(u, v)| (u + sigma_px * gauss.next(), v + sigma_px * gauss.next())).collect();
            let Some((r, p)) = self.fit(&noisy, sigma_px) else {
                out.outside += 1;
                continue;
            };
            let off = self.r - r;
            let inverse = distance * (1.0 / distance - 1.0 / r.norm()) / sigma;
            out.counted += 1;
            out.bias += inverse;
            out.square += inverse * inverse;
            out.nees += off.dot(&(p.try_inverse().unwrap() * off));
        }
        let n = f64::from(out.counted);
        (out.bias, out.square, out.nees) = (out.bias / n, libm::sqrt(out.square / n), out.nees / n);
        out
    }
}

/// Bias and RMSE of 1/r in units of the bound, NEES with three degrees of freedom, runs outside the gate.
#[derive(Default)]
struct Outcome {
    sigma: f64,
    bias: f64,
    square: f64,
    nees: f64,
    counted: u32,
    outside: u32,
}

fn scenes() -> [Scene; 4] {
    let tilted = [0.8, 0.3, -0.4, 0.33];
    [
        Scene::new("sphere, 11.5 radii", [1737.4; 3], 11.5, Model::Pinhole, 0.0, [1.0, 0.0, 0.0, 0.0]),
        Scene::new("Jupiter, 84 radii", [71492.0, 71492.0, 66854.0], 84.0, Model::Pinhole, 0.1, tilted),
        Scene::new("Enceladus, 12 radii", [256.6, 251.4, 248.3], 12.0, Model::Pinhole, 1.0, tilted),
        Scene::new("Earth, 600 km", [6378.137, 6378.137, 6356.752], 6971.0 / 6371.0, Model::Equidistant, 20.0, tilted),
    ]
}

/// Arc in degrees and noise in pixels, all inside the gate and with σ_r/r of at most 7 %.
const ARCS: [(f64, f64); 9] = [
    (10.0, 0.1),
    (20.0, 0.3),
    (20.0, 1.0),
    (40.0, 1.0),
    (60.0, 1.0),
    (90.0, 1.0),
    (120.0, 1.0),
    (180.0, 1.0),
    (360.0, 1.0),
];

/// A part of the campaign below: limits for 200 runs.
#[test]
fn the_position_has_no_bias_and_an_honest_covariance() {
    for scene in scenes() {
        for (arc, sigma_px) in [(20.0, 0.3), (60.0, 1.0), (360.0, 1.0)] {
            let o = scene.run(arc, sigma_px, 200);
            let what = format!("{}, {arc} deg: bias {:.3} rms {:.3} nees {:.2}", scene.name, o.bias, o.square, o.nees);
            assert!(o.bias.abs() < 0.25 && o.square < 1.2 && (2.4..3.6).contains(&o.nees) && o.outside == 0, "{what}");
        }
    }
}

/// The campaign: `cargo test --release -p hzn-core --features position,std,_edges -- --ignored --nocapture campaign`.
#[test]
#[ignore = "takes two minutes; the line above is its command"]
fn position_campaign() {
    std::println!("| body | arc, noise | σ_r/r | bias of 1/r | RMSE/bound | NEES (3) | outside the gate |");
    for scene in scenes() {
        for (arc, sigma_px) in ARCS {
            let o = scene.run(arc, sigma_px, 2000);
            std::println!(
                "| {} | {arc}°, {sigma_px} px | {:.3} % | {:+.3} | {:.3} | {:.2} | {} |",
                scene.name,
                o.sigma * 100.0,
                o.bias,
                o.square,
                o.nees,
                o.outside
            );
            assert!(o.bias.abs() <= 0.1 || o.outside > 0, "{}: {}", scene.name, o.bias);
            assert!(o.square <= 1.1 && (2.7..=3.4).contains(&o.nees) || o.outside > 0, "{}: {}", scene.name, o.nees);
        }
    }
}
