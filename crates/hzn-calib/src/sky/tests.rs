//! Tests with flights of edge points whose lens, limb height and noise are known.

use hzn_core::Prior;
use hzn_core::body;
use hzn_core::camera::{Camera, Config, Model};
use nalgebra::Vector3;

use super::{LimbPrior, Unknowns, Verdict, View, check, estimate};
use crate::draws::Draws;
use crate::noise::tests::{Noise, earth, limb, solution};

/// A flight with a known lens.
#[derive(Clone)]
struct Flight {
    /// The real lens.
    lens: Config,
    pictures: usize,
    /// Lowest and highest altitude, in kilometres.
    altitude_km: [f64; 2],
    limb_km: f64,
    scatter_km: f64,
    noise: Noise,
    shift_px: f64,
    /// Smallest and largest angle from the optical axis to the limb axis, as parts of the half-angle of the limb.
    off_axis: [f64; 2],
    seed: u64,
}

impl Flight {
    fn new(lens: Config, seed: u64) -> Self {
        Self {
            lens,
            pictures: 40,
            altitude_km: [80.0, 240.0],
            limb_km: 17.0,
            scatter_km: 0.3,
            noise: Noise(0.15, 60.0, 0.3),
            shift_px: 0.05,
            off_axis: [0.8, 1.2],
            seed,
        }
    }

    fn body(&self) -> body::Config {
        body::Config { limb_height_km: 17.0, limb_height_sigma_km: 7.0, altitude_sigma_km: 0.0, ..earth() }
    }

    /// Returns the pictures, whose fits start about a degree off.
    fn views(&self) -> Vec<View> {
        let camera = Camera::try_new(&self.lens).unwrap();
        let mut draws = Draws(self.seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1);
        for _ in 0..10 {
            draws.uniform();
        }
        let radius = self.body().mean_radius_km();
        let part = |low: f64, high: f64, x: f64| low + (high - low) * x;
        let each = (0..self.pictures).map(|k| {
            let x = k as f64 / (self.pictures.max(2) - 1) as f64;
            let altitude_km = part(self.altitude_km[0], self.altitude_km[1], x);
            let km = self.limb_km + self.scatter_km * draws.normal();
            let alpha = ((radius + km) / (radius + altitude_km)).asin();
            let below = alpha * part(self.off_axis[0], self.off_axis[1], draws.uniform());
            let roll = core::f64::consts::TAU * draws.uniform();
            let axis = Vector3::new(below.sin() * roll.cos(), below.sin() * roll.sin(), below.cos());
            let mut points = limb(&camera, axis, &|_| alpha.cos(), self.noise, &mut draws);
            for (p, _) in &mut points {
                let j = camera.ray(hzn_core::pixel::ImagePoint { u: p[0], v: p[1] }).unwrap().jacobian();
                let g = [0, 1].map(|i| (0..3).map(|r| j[r][i] * axis[r]).sum::<f64>());
                let norm = g[0].hypot(g[1]);
                *p = [p[0] + self.shift_px * g[0] / norm, p[1] + self.shift_px * g[1] / norm];
            }
            let prior = Prior { altitude_m: Some(altitude_km * 1e3), ..Prior::default() };
            let start = (axis + Vector3::new(0.01, -0.01, 0.005)).normalize();
            View::new(&format!("{k}"), points, prior, &solution(start, alpha + 1e-3))
        });
        each.filter(|v| v.points.len() > 60).collect()
    }
}

fn lens(fov_deg: f64) -> Config {
    let mut lens = Config::ideal(Model::KannalaBrandt, 960, 720, 960.0 / fov_deg.to_radians());
    lens.k.extend_from_slice(&[-0.05, 0.01]).unwrap();
    lens
}

fn with_focal(lens: &Config, percent: f64) -> Config {
    let part = 1.0 + 0.01 * percent;
    Config { fx_px: lens.fx_px * part, fy_px: lens.fy_px * part, ..lens.clone() }
}

#[test]
#[ignore = "a campaign"]
fn campaign() {
    let limbs = [LimbPrior { km: 17.0, sigma_km: 7.0 }, LimbPrior { km: 17.0, sigma_km: 1.0 }];
    for (fov, altitude) in
        [(90.0, [80.0, 240.0]), (60.0, [80.0, 240.0]), (120.0, [80.0, 240.0]), (90.0, [600.0, 610.0])]
    {
        for limb in limbs {
            let told = with_focal(&lens(fov), 2.0);
            let told = Config { cx_px: told.cx_px + 4.0, cy_px: told.cy_px - 3.0, ..told };
            let n = 40;
            let mut draws = Draws(77);
            let (mut z, mut errors, mut sigmas, mut height) = (vec![], vec![], vec![], vec![]);
            let (mut verdicts, mut wrong) = ([0; 3], [0; 3]);
            let time = std::time::Instant::now();
            for seed in 0..n {
                let mut flight = Flight::new(lens(fov), seed);
                flight.altitude_km = altitude;
                flight.limb_km = 17.0 + if limb.sigma_km > 2.0 { 5.0 } else { limb.sigma_km } * draws.normal();
                flight.shift_px = 0.1 * draws.normal();
                let views = flight.views();
                let unknowns = Unknowns::new(&told, &[]);
                match estimate(&unknowns, &flight.body(), &views, limb) {
                    Ok(e) => {
                        let error = 100.0 * (e.camera.fx_px / flight.lens.fx_px - 1.0);
                        let sigma = e.focal_percent[1];
                        z.push((error / sigma).powi(2));
                        errors.push(error * error);
                        sigmas.push(sigma);
                        height.push(((e.height_km[0] - flight.limb_km) / e.height_km[1]).powi(2));
                        if seed == 0 {
                            println!("{:?} {:?} {:?} {:?}", e.observability, e.scatter_km, e.chi2, e.parameters);
                        }
                    }
                    Err(why) => println!("{fov} {altitude:?} {limb:?} {seed}: {why}"),
                }
                let right = Config { centre_sigma_px: 0.3, ..flight.lens.clone() };
                let off = with_focal(&right, 0.3);
                for (config, count) in [(&right, &mut verdicts), (&off, &mut wrong)] {
                    match check(config, &flight.body(), &views, limb, 0.3) {
                        Ok(c) => count[c.verdict as usize] += 1,
                        Err(why) => println!("check {why}"),
                    }
                }
            }
            let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64;
            println!(
                "fov {fov} altitude {altitude:?} limb {limb:?}: rms {:.3} % sigma {:.3} % z2 {:.2} max z {:.1} \
                 height z2 {:.2}; \
                 right {verdicts:?} wrong {wrong:?} (holds, not, cannot) {:?}",
                mean(&errors).sqrt(),
                mean(&sigmas),
                mean(&z),
                z.iter().fold(0.0f64, |a, b| a.max(b.sqrt())),
                mean(&height),
                time.elapsed() / n as u32
            );
        }
    }
    let _ = Verdict::Holds;
}
