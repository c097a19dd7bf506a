//! Drawn options of a sensor.

use hzn_core::body::{Kind, Limb};
use hzn_core::camera::{self, Covariance, Intrinsic, Model};
use hzn_core::config::Mount;
use hzn_core::frames::{Rotation, UnitVec3};
use hzn_core::tone::Tone;
use hzn_core::{Config, Prior, consensus, contour, covariance, edge_points, fit, gates, retry, threshold};

use super::{Dice, V3, cross, dot, sum, unit};

/// Draws a lens with a field of view of about `field_rad` across the smaller side of the picture.
pub(super) fn lens(dice: &mut Dice, [width, height]: [u16; 2], field_rad: f64) -> camera::Config {
    use Model::{BrownConrady, DoubleSphere, Equidistant, Eucm, KannalaBrandt, Pinhole};
    let model = dice.pick(&[Pinhole, Pinhole, KannalaBrandt, Equidistant, BrownConrady, DoubleSphere, Eucm]);
    let half_px = 0.5 * f64::from(width.min(height));
    let focal_px = half_px / libm::tan(0.5 * field_rad);
    let mut lens = camera::Config::ideal(model, width, height, focal_px);
    lens.fy_px *= dice.between(0.98, 1.02);
    lens.cx_px += dice.between(-9.0, 9.0);
    lens.cy_px += dice.between(-9.0, 9.0);
    let k: &[f64] = match model {
        KannalaBrandt => &[-0.05, 0.01],
        BrownConrady => &[-0.12, 0.03, 1e-3, -5e-4, -0.002],
        DoubleSphere => &[-0.2, 0.55],
        Eucm => &[0.6, 1.1],
        _ => &[],
    };
    lens.k = k.iter().copied().collect();
    if dice.one_in(4) {
        lens.focal_sigma_percent = dice.between(0.01, 1.0);
        lens.centre_sigma_px = dice.between(0.0, 2.0);
    } else if dice.one_in(4) {
        let sigma = [dice.between(0.1, 3.0), dice.between(0.1, 3.0), dice.between(0.1, 1.0), dice.between(0.1, 1.0)];
        let rho = dice.between(-0.9, 0.9);
        let cell = |i: usize, j: usize| match (i, j) {
            _ if i == j => sigma[i] * sigma[i],
            (0, 1) | (1, 0) => rho * sigma[0] * sigma[1],
            _ => 0.0,
        };
        lens.covariance = Some(Covariance {
            order: [Intrinsic::FxPx, Intrinsic::FyPx, Intrinsic::CxPx, Intrinsic::CyPx].into_iter().collect(),
            rows: (0..4).map(|i| (0..4).map(|j| cell(i, j)).collect()).collect(),
        });
    }
    if dice.one_in(8) {
        lens.theta_max_deg = Some(f64::to_degrees(field_rad) * dice.between(0.45, 0.7));
    }
    if dice.one_in(12) {
        lens.theta_min_deg = Some(f64::to_degrees(field_rad) * dice.between(0.05, 0.2));
    }
    if dice.one_in(8) {
        let (focal_ppm_per_k, cx_px_per_k) = (dice.between(5.0, 80.0), dice.between(-0.05, 0.05));
        lens.temperature = Some(hzn_core::camera::Temperature {
            reference_c: 20.0,
            focal_ppm_per_k,
            cx_px_per_k,
            cy_px_per_k: 0.02,
            untold_sigma_k: dice.between(0.0, 15.0),
        });
    }
    if dice.one_in(6) {
        lens.readout_s = dice.between(-0.05, 0.05);
    }
    lens
}

/// Draws the options of the stages. Of each stage most pictures have the defaults.
pub(super) fn stages(dice: &mut Dice, config: &mut Config) {
    config.consensus.seed = dice.number();
    if dice.one_in(6) {
        use threshold::Method::{Dynamic, Fixed, Otsu, Track};
        config.threshold.method = dice.pick(&[Dynamic, Fixed, Otsu, Track]);
        (config.threshold.level, config.threshold.scale) = (dice.between(25.0, 90.0), dice.between(0.6, 1.5));
    }
    if dice.one_in(4) {
        use edge_points::SubPixel::{Erf, Linear, None, Zernike};
        config.edge_points.sub_pixel = dice.pick(&[Linear, None, Erf, Zernike]);
        config.edge_points.blur_px = dice.pick(&[0.0, 0.7, 1.2]);
    }
    if dice.one_in(4) {
        config.edge_points.keep_points = dice.pick(&[0, 16, 60, 100, 200]);
        config.edge_points.min_points = dice.pick(&[10, 25, 70]);
    }
    if dice.one_in(3) {
        use consensus::Method::{Mlesac, None, Ransac, RansacPreverify, TwoPoint};
        config.consensus.method = dice.pick(&[TwoPoint, TwoPoint, None, Ransac, RansacPreverify, Mlesac]);
        config.consensus.threshold_px = dice.between(0.7, 5.0);
        config.consensus.noise_sigma = dice.between(0.0, 4.0);
        config.consensus.max_draws = dice.pick(&[30, 200, 800]);
    }
    if dice.one_in(4) {
        use fit::HalfAngle::{Free, Fused, Known};
        config.fit.half_angle = dice.pick(&[Fused, Known, Free]);
    }
    noise(dice, config);
    judge(dice, config);
    looks(dice, config);
}

/// Draws the model of the noise.
fn noise(dice: &mut Dice, config: &mut Config) {
    if !dice.one_in(2) {
        return;
    }
    use covariance::Noise::{Given, Reml, Rms};
    let noise = &mut config.covariance;
    noise.noise = dice.pick(&[Rms, Rms, Given, Reml]);
    (noise.sigma_px, noise.correlation_px) = (dice.between(0.02, 0.5), dice.pick(&[0.0, 10.0, 40.0, 150.0]));
    (noise.bias_px, noise.tilt_px) = (dice.between(0.0, 0.5), dice.between(0.0, 0.4));
    (noise.bend_px, noise.white_px) = (dice.pick(&[0.0, 0.1, 0.4]), dice.pick(&[0.0, 0.05, 0.15]));
}

/// Draws limits of the gates, so that each of them is near to the values of some edges.
fn judge(dice: &mut Dice, config: &mut Config) {
    let gates = &mut config.gates;
    let mut near = |value: &mut f64, factor: f64| {
        if dice.one_in(6) {
            *value *= libm::exp(dice.between(-1.0, 1.0) * libm::log(factor));
        }
    };
    near(&mut gates.max_rms_px, 8.0);
    near(&mut gates.max_half_angle_sigma, 4.0);
    near(&mut gates.max_sigma_deg, 17.0);
    near(&mut gates.max_rival_ratio, 2.0);
    near(&mut gates.min_evidence, 8.0);
    near(&mut gates.residual_floor_px, 5.0);
    near(&mut gates.max_departure, 10.0);
    near(&mut gates.max_glow, 4.0);
    near(&mut gates.prior_odds, 30.0);
    gates.max_rival_ratio = gates.max_rival_ratio.max(1.0);
    let mut part = |value: &mut f64| {
        if dice.one_in(6) {
            *value = dice.between(0.02, 0.98);
        }
    };
    part(&mut gates.min_support);
    part(&mut gates.min_support_abrupt);
    part(&mut gates.max_lit_sky);
    part(&mut gates.dark_sky);
    part(&mut gates.whole_edge);
    part(&mut gates.max_band);
    part(&mut gates.max_unlit);
    if dice.one_in(5) {
        gates.min_p_limb = dice.between(0.1, 0.98);
    }
    if dice.one_in(5) {
        (gates.min_inliers, gates.min_arc_px) = (dice.pick(&[8, 60, 200]), Some(dice.between(10.0, 250.0)));
    }
    if dice.one_in(8) {
        use gates::Choice::{Longest, Score, SectionResidual};
        gates.choice = dice.pick(&[Longest, Score, SectionResidual]);
    }
    gates.limb_in_view = dice.one_in(3);
    if dice.one_in(6) {
        gates.max_section_residual = Some(libm::exp(dice.between(-14.0, -1.0)));
    }
}

/// Draws how edges are searched, and what follows if there is no answer.
fn looks(dice: &mut Dice, config: &mut Config) {
    if dice.one_in(6) {
        config.contour.line_spacing_px = Some(dice.pick(&[3, 8, 20]));
    }
    if dice.one_in(4) {
        config.retry.levels.clear();
        config.retry.min_sigma = dice.between(0.0, 8.0);
    }
    if dice.one_in(10) {
        config.retry.method = retry::Method::Division;
        config.retry.least_part = dice.pick(&[0.05, 0.1, 0.3]);
        config.retry.combine = dice.pick(&[retry::Combine::Median, retry::Combine::Mean]);
    }
    if dice.one_in(10) {
        config.limits.max_work = Some(dice.pick(&[10_000, 20_000, 40_000, 100_000]));
    }
    if dice.one_in(4) {
        config.input.tone = Some(dice.pick(&[Tone::Linear, Tone::Srgb, Tone::Bt709, Tone::Gamma(1.8)]));
    }
    if dice.one_in(4) {
        let q = unit4([dice.between(-1.0, 1.0), dice.between(-1.0, 1.0), dice.between(-1.0, 1.0), 0.4]);
        config.mount = Some(Mount { q_vehicle_from_camera_wxyz: q });
    }
    if dice.one_in(5) {
        let [w, h] = [config.camera.width, config.camera.height].map(f64::from);
        for _ in 0..1 + dice.number() % 3 {
            let (x, y) = (dice.between(0.0, w), dice.between(0.0, h));
            let corners = [(0.0, 0.0), (dice.between(10.0, 60.0), 4.0), (dice.between(0.0, 50.0), 45.0)];
            let _ = config.mask.polygons_px.push(corners.iter().map(|(a, b)| [x + a, y + b]).collect());
        }
    }
}

/// Draws another way to find edges, which most systems do not use.
pub(super) fn other_methods(dice: &mut Dice, config: &mut Config) {
    use contour::Method::{BorderFollowing, Erode, Raster, Sobel};
    config.contour.method = dice.pick(&[BorderFollowing, Erode, Raster, Sobel]);
    config.contour.erode_size_px = dice.pick(&[3, 5, 7]);
    config.contour.erode_threshold = dice.pick(&[5, 8, 9]);
    use fit::Method as F;
    config.fit.method = dice.pick(&[F::Sphere, F::Direct, F::Conic, F::Tls, F::Wtls, F::LeastSquares, F::Circle]);
    config.fit.weigh_above_deg = dice.pick(&[0.0, 20.0, 60.0]);
    if dice.one_in(3) {
        config.covariance.method = covariance::Method::BraunBarf;
        config.covariance.overbound = dice.one_in(2);
    }
    if dice.one_in(4) {
        config.input.scale_to_height = Some(config.camera.height / dice.pick(&[2, 3]));
    }
    if dice.one_in(3) {
        config.gates.altitude_limits_km = Some([dice.between(100.0, 400.0), dice.between(450.0, 1500.0)]);
        (config.gates.radius_margin, config.gates.radius_margin_px) = (dice.between(0.0, 0.3), dice.pick(&[0.0, 50.0]));
    }
    if dice.one_in(2) {
        config.gates.min_evidence = -1e6;
        config.gates.max_rival_ratio = 1e6;
    }
}

/// Draws the keys of a body with air.
pub(super) fn body_with_air(dice: &mut Dice, config: &mut Config) {
    let body = &mut config.body;
    body.kind = dice.pick(&[Kind::Earth, Kind::EarthSphere]);
    body.altitude_km = Some(dice.pick(&[250.0, 400.0, 700.0, 1400.0]));
    body.altitude_sigma_km = dice.pick(&[0.5, 0.5, 5.0, 50.0]);
    body.limb_height_sigma_km = dice.pick(&[7.0, 2.0, 0.3]);
    if dice.one_in(4) {
        body.limb_tilt_sigma_km = Some(dice.between(0.1, 2.0));
    }
    if dice.one_in(4) && body.kind == Kind::Earth {
        let rows = [[-90.0, 14.0], [-20.0, 18.5], [35.0, 17.0], [90.0, 12.0]];
        body.limb_height_by_latitude_km = rows.into_iter().collect();
    } else if dice.one_in(6) {
        body.limb = dice.pick(&[Limb::Co2, Limb::Window, Limb::Height]);
        body.follow_band();
    }
    if dice.one_in(3) {
        body.sunlit = Some(dice.one_in(2));
    }
}

/// What is told about a picture. The quaternion is that of the attitude, for the other precision.
#[derive(Clone, Copy, Default)]
pub(super) struct Told {
    pub(super) prior: Prior<f64>,
    pub(super) quaternion: Option<[f64; 4]>,
}

fn unit4(q: [f64; 4]) -> [f64; 4] {
    let length = q.iter().map(|x| x * x).sum::<f64>().sqrt();
    q.map(|x| x / length)
}

/// Returns the quaternion of a rotation from `a` to `b`.
fn turn(a: V3, b: V3) -> [f64; 4] {
    let [x, y, z] = cross(a, b);
    unit4([1.0 + dot(a, b), x, y, z])
}

impl Told {
    /// Adds what may be known of a vehicle from which the body is in the direction `e`, lit from `sun`.
    pub(super) fn draw(dice: &mut Dice, config: &Config, e: V3, sun: V3, radius_m: f64) -> Self {
        let mut told = Self::default();
        let prior = &mut told.prior;
        if dice.one_in(2) {
            prior.sun = UnitVec3::try_new(sun);
        }
        if dice.one_in(6) {
            prior.sun_elevation_rad = Some(dice.between(-1.0, 1.2));
        }
        if dice.one_in(3) {
            let place = unit([dice.between(-1.0, 1.0), dice.between(-1.0, 1.0), dice.between(-1.0, 1.0)]);
            prior.position_m = Some(place.map(|x| x * radius_m));
            let sigma = dice.pick(&[0.002, 0.02, 0.1, 0.7]);
            let wrong = [dice.normal(), dice.normal(), dice.normal()];
            let seen = unit(sum([(1.0, e), (sigma * dice.pick(&[0.0, 1.0, 3.0]), wrong)]));
            told.quaternion = Some(turn(seen, place.map(|x| -x)));
            prior.attitude_sigma_rad = Some(sigma);
            prior.year_part = dice.one_in(2).then(|| dice.between(0.0, 1.0));
        }
        if config.camera.readout_s != 0.0 {
            prior.rate_rad_s = Some([dice.normal() * 0.03, dice.normal() * 0.03, dice.normal() * 0.03]);
        }
        if config.camera.temperature.is_some() && dice.one_in(2) {
            prior.camera_temperature_c = Some(dice.between(0.0, 40.0));
        }
        prior.fixed_from_camera = told.quaternion.and_then(Rotation::assume_from_quaternion);
        told
    }

    /// Returns the prior in single precision.
    pub(super) fn single(&self) -> Prior<f32> {
        let (prior, narrow) = (&self.prior, |x: f64| x as f32);
        Prior {
            altitude_m: prior.altitude_m.map(narrow),
            position_m: prior.position_m.map(|p| p.map(narrow)),
            fixed_from_camera: self.quaternion.and_then(|q| Rotation::assume_from_quaternion(q.map(narrow))),
            pole: prior.pole.and_then(|pole| UnitVec3::try_new(pole.xyz().map(narrow))),
            range_m: prior.range_m.map(narrow),
            range_sigma_m: prior.range_sigma_m.map(narrow),
            level: prior.level,
            sun: prior.sun.and_then(|sun| UnitVec3::try_new(sun.xyz().map(narrow))),
            sun_elevation_rad: prior.sun_elevation_rad.map(narrow),
            year_part: prior.year_part.map(narrow),
            attitude_sigma_rad: prior.attitude_sigma_rad.map(narrow),
            last: None,
            rate_rad_s: prior.rate_rad_s.map(|rate| rate.map(narrow)),
            camera_temperature_c: prior.camera_temperature_c.map(narrow),
        }
    }
}
