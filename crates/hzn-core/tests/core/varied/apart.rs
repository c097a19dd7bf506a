//! These tests call the stages one by one, and compute what is expected of a picture before it is seen.

use std::fmt::Write as _;

use hzn_core::body::{self, Kind};
use hzn_core::frames::{Rotation, UnitVec3};
use hzn_core::pipeline::edges::Edges;
use hzn_core::pixel::ImagePoint;
use hzn_core::{Config, HostHorizon, Prior, Sensor};

use super::journal::digest_of;
use super::limbs::Scene;
use super::options::{self, Told};
use super::{Dice, Table, cross, direction, dot, grey, sum, unit};

/// Adds the results of each stage for every edge of a picture.
fn call_each(table: &mut Table, what: &str, sensor: &Sensor<f64>, scene: &Scene, data: &[u8]) {
    let picture = grey(&scene.config, data);
    let Ok(expected) = sensor.expect(&scene.told.prior) else { return };
    let level = match sensor.level(&picture, &expected) {
        Ok(level) => level.level,
        Err(status) => return writeln!(table.lines, "{what},{status}").unwrap(),
    };
    let borders = sensor.borders(&picture, level, &expected);
    for (k, border) in borders.iter().enumerate().filter(|(_, border)| border.len() > 25).take(4) {
        let mut edges = Edges::pick(sensor, &picture, level, border);
        let points: Vec<_> = edges.points().collect();
        let rays: Vec<_> = edges.rays().collect();
        let mut digests = vec![digest_of(&format!("{border:?}")), digest_of(&format!("{points:?} {rays:?}"))];
        let cone = edges.consensus(&expected, &scene.config.consensus);
        digests.push(digest_of(&format!("{cone:?} {:?}", edges.weights().collect::<Vec<_>>())));
        let fit = cone.and_then(|cone| edges.fit(sensor, &cone, &expected));
        let weights: Vec<f64> = edges.weights().collect();
        digests.push(digest_of(&format!("{fit:?} {weights:?} {}", edges.inliers())));
        let fused = fit.and_then(|fit| edges.fuse(sensor, &fit, &expected));
        digests.push(digest_of(&format!("{fused:?}")));
        if let Some(fit) = fit {
            // The same cone with half of the points, and the points that another body takes away.
            let halves: Vec<f64> = weights.iter().enumerate().map(|(i, w)| if i % 2 == 0 { *w } else { 0.3 }).collect();
            edges.set_weights(&halves);
            let again = edges.fit_at(&fit.axis(), fit.cos_half_angle());
            let fused = again.and_then(|fit| edges.fuse(sensor, &fit, &expected));
            digests.push(digest_of(&format!("{again:?} {fused:?}")));
            let beside = UnitVec3::try_new(unit(sum([(1.0, fit.axis().xyz()), (0.002, [1.0, -1.0, 0.5])]))).unwrap();
            let taken = edges.withdraw(&beside, fit.cos_half_angle(), &scene.config.consensus);
            digests.push(digest_of(&format!("{taken} {:?}", edges.weights().collect::<Vec<_>>())));
        }
        let digests: String = digests.iter().map(|digest| format!(",{digest:08x}")).collect();
        let numbers = fit.map(|fit| (fit.inliers(), fit.rms_px())).unwrap_or_default();
        writeln!(table.lines, "{what} {k},{},{},{:.7e}{digests}", border.len(), numbers.0, numbers.1).unwrap();
    }
}

#[test]
fn of_stages_that_are_called_one_by_one() {
    let mut table = Table::new("apart");
    for seed in 3000..3040 {
        let mut dice = Dice::new(seed);
        let mut scene = Scene::new(&mut dice, [256, 192], 0.6);
        let data = scene.day(&mut dice);
        if dice.one_in(2) {
            options::stages(&mut dice, &mut scene.config);
        }
        let Ok(sensor) = Sensor::<f64>::new(&scene.config) else { continue };
        call_each(&mut table, &seed.to_string(), &sensor, &scene, &data);
    }
    table.check();
}

/// Points of a circle about an axis, as the camera sees them, with errors.
fn limb_points(dice: &mut Dice, sensor: &Sensor<f64>, e: [f64; 3], half_angle: f64) -> Vec<ImagePoint<f64>> {
    let right = unit(cross(e, [0.3, -0.8, 0.5]));
    let down = cross(e, right);
    let from = dice.between(0.0, 6.0);
    let turns = dice.pick(&[0.4, 1.5, 6.2]);
    let noise_px = dice.pick(&[0.01, 0.3]);
    (0..90)
        .filter_map(|i| {
            let (s, c) = libm::sincos(from + turns * f64::from(i) / 90.0);
            let (sin, cos) = libm::sincos(half_angle);
            let ray = sum([(cos, e), (sin * c, right), (sin * s, down)]);
            let at = sensor.camera().project(&UnitVec3::try_new(ray)?)?;
            Some(ImagePoint { u: at.u + noise_px * dice.normal(), v: at.v + noise_px * dice.normal() })
        })
        .collect()
}

#[test]
fn of_positions_by_closed_forms() {
    let mut table = Table::new("closed");
    for seed in 3100..3160 {
        let mut dice = Dice::new(seed);
        let mut config = Config::new(options::lens(&mut dice, [320, 240], 0.5));
        let radii = [286.3, 278.6, 223.2].map(|a| a * dice.pick(&[1.0, 1.2]));
        config.body = body::Config::of_kind(Kind::Ellipsoid, Some(radii));
        (config.body.limb_height_km, config.body.limb_height_sigma_km) = (0.0, 0.5);
        config.fit.position = Some(true);
        let Ok(sensor) = Sensor::<f64>::new(&config) else { continue };
        let half_angle = dice.pick(&[0.05, 0.12, 0.5]);
        let e = direction(if half_angle > 0.2 { half_angle } else { 0.05 }, dice.between(0.0, 6.3));
        let q = [1.0, dice.between(-0.5, 0.5), dice.between(-0.5, 0.5), dice.between(-0.5, 0.5)];
        let length = q.iter().map(|x| x * x).sum::<f64>().sqrt();
        let range_m = 1e3 * radii[1] / libm::sin(half_angle);
        let prior = Prior {
            fixed_from_camera: Rotation::assume_from_quaternion(q.map(|x| x / length)),
            attitude_sigma_rad: Some(0.01),
            range_m: dice.one_in(2).then_some(range_m),
            range_sigma_m: Some(range_m * 0.01),
            ..Prior::default()
        };
        let Ok(expected) = sensor.expect(&prior) else { continue };
        let points = limb_points(&mut dice, &sensor, e, half_angle);
        let lit = UnitVec3::try_new(e).unwrap();
        let mut edges = Edges::for_body(&sensor, &expected, &points, &lit);
        let plain = edges.least_squares(&expected);
        let fit = edges.fit_position(&expected);
        let fused = fit.and_then(|fit| edges.fuse(&sensor, &fit, &expected));
        let range_km = plain.map(|plain| dot(plain.centre_m, plain.centre_m).sqrt() / 1e3).unwrap_or_default();
        writeln!(
            table.lines,
            "{seed},{},{range_km:.7e},{:08x},{:08x},{:08x}",
            points.len(),
            digest_of(&format!("{plain:?}")),
            digest_of(&format!("{fit:?} {:?}", edges.weights().collect::<Vec<_>>())),
            digest_of(&format!("{fused:?}"))
        )
        .unwrap();
    }
    table.check();
}

/// Priors near the limits from which on nothing can be expected of a picture.
#[test]
fn of_priors_at_their_limits() {
    let mut table = Table::new("priors");
    for seed in 3200..3700 {
        let mut dice = Dice::new(seed);
        let mut config = Config::new(options::lens(&mut dice, [160, 120], 0.5));
        let is_ellipsoid = dice.one_in(2);
        let radii = [286.3, 278.6, 223.2];
        if is_ellipsoid {
            config.body = body::Config::of_kind(Kind::Ellipsoid, Some(radii));
        } else {
            options::body_with_air(&mut dice, &mut config);
            if dice.one_in(2) {
                config.body.altitude_km = None;
                config.gates.altitude_limits_km = dice.one_in(2).then_some([dice.between(0.0, 300.0), 900.0]);
            }
        }
        config.fit.position = dice.pick(&[Some(true), None]);
        let made: Option<Box<HostHorizon>> = table.sensor(&seed.to_string(), &config);
        let Some(horizon) = made else { continue };
        let radius_m = if is_ellipsoid { 280e3 } else { 6378e3 };
        let range_m = radius_m * libm::exp(dice.pick(&[0.01, 0.1, 0.4, 1.0, 4.0, 5.0, 6.0]));
        // The axis is up to a half-angle and the field of view away from the optical axis.
        let off = dice.pick(&[0.0, 0.3, 0.8, 1.1]) * libm::asin((radius_m / range_m).min(1.0));
        let axis = direction(off, dice.between(0.0, 6.3));
        let mut told = Told::draw(&mut dice, &config, axis, unit([1.0, 2.0, -1.0]), range_m);
        if dice.one_in(2) {
            told.prior.range_m = Some(range_m * dice.pick(&[1.0, 1.0, 1.3]));
            told.prior.range_sigma_m = dice.pick(&[None, Some(range_m * 0.01)]);
        }
        if dice.one_in(3) {
            told.prior.altitude_m = Some(dice.between(-2e3, 30e3));
        }
        match horizon.expect(&told.prior) {
            Ok(expected) => {
                let (cos, sigma) = expected.cos_and_sigma();
                writeln!(table.lines, "{seed},{cos:.7e},{sigma:.7e}").unwrap();
            }
            Err(error) => writeln!(table.lines, "{seed},{error:?}").unwrap(),
        }
    }
    table.check();
}
