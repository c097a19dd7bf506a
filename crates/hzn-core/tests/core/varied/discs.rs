//! Discs of whole bodies, lit from one side, with the position of their centre.

use hzn_core::body::{self, Kind};
use hzn_core::frames::{Rotation, UnitVec3};
use hzn_core::{Config, FlightHorizon, HostHorizon, Prior, fit};

use super::options::{self, Told};
use super::{Canvas, Dice, Table, V3, cross, direction, dot, grey, sum, unit};
use crate::common::{KINDS, garbage};

/// A body of three semi-axes, with its axes in the camera frame.
struct Body {
    semi_axes: V3,
    axes: [V3; 3],
    centre: V3,
    sun: V3,
}

impl Body {
    /// Returns the brightness in a direction: Lambert's law on the sunlit side.
    fn light(&self, ray: V3) -> f64 {
        let scaled = |v: V3| [0, 1, 2].map(|k| dot(v, self.axes[k]) / self.semi_axes[k]);
        let (c, d) = (scaled(self.centre), scaled(ray));
        let (dd, dc, cc) = (dot(d, d), dot(d, c), dot(c, c));
        let below = dc * dc - dd * (cc - 1.0);
        if below <= 0.0 {
            return 0.0;
        }
        let t = (dc - below.sqrt()) / dd;
        let normal = unit([0, 1, 2].map(|k| (d[k] * t - c[k]) / self.semi_axes[k]));
        let sun = [0, 1, 2].map(|k| dot(self.sun, self.axes[k]));
        dot(normal, sun).max(0.0)
    }
}

/// How a body is seen.
#[derive(Clone, Copy)]
struct View {
    half_angles: &'static [f64],
    /// Whether the picture shows a part of the limb.
    is_arc: bool,
    hides_orientation: bool,
}

/// Whole discs, parts of a limb, and whole discs of which nothing is told.
const WHOLE: View = View { half_angles: &[0.012, 0.03, 0.06, 0.12], is_arc: false, hides_orientation: false };
const PART: View = View { half_angles: &[0.2, 0.4, 0.9, 1.2], is_arc: true, ..WHOLE };
const UNTOLD: View = View { half_angles: &[0.05, 0.1, 0.14], hides_orientation: true, ..WHOLE };

/// A disc before a camera.
struct Scene {
    config: Config,
    told: Told,
    data: Vec<u8>,
}

impl Scene {
    fn draw(dice: &mut Dice, kind: Kind, radii: [f64; 3], view: View) -> Self {
        let size = dice.pick(&[[240, 180], [180, 240]]);
        let mut config = Config::new(options::lens(dice, size, 0.35));
        config.body = body::Config {
            altitude_sigma_km: radii[0] * dice.pick(&[1e-3, 0.1, 1.0]),
            ..body::Config::of_kind(kind, (kind == Kind::Ellipsoid).then_some(radii))
        };
        config.body.radius_km = (kind == Kind::Sphere).then_some(radii[0]);
        (config.body.limb_height_km, config.body.limb_height_sigma_km) = (0.0, radii[0] * dice.pick(&[1e-4, 3e-3]));
        let half_angle = dice.pick(view.half_angles);
        let range = radii[0] / libm::sin(half_angle);
        config.body.altitude_km = Some(range - radii[0]);
        let off = if view.is_arc { half_angle + dice.between(-0.1, 0.1) } else { dice.between(0.0, 0.2) };
        let axis = direction(off, dice.between(0.0, core::f64::consts::TAU));
        let others = if view.is_arc { 0 } else { dice.pick(&[0, 0, 0, 1, 3]) };
        let north = unit([dice.between(-1.0, 1.0), dice.between(-1.0, 1.0), dice.between(-1.0, 1.0)]);
        let east = unit(cross(north, axis));
        let axes = [east, cross(north, east), north];
        let phase = dice.pick(&[0.0, 0.2, 0.5, 1.0, 1.5, 2.0]);
        let beside = direction(core::f64::consts::FRAC_PI_2, dice.between(0.0, core::f64::consts::TAU));
        let sun = unit(sum([(-libm::cos(phase), axis), (libm::sin(phase), beside)]));
        let bodies: Vec<Body> = (0..=others)
            .map(|k| {
                let aside = direction(dice.between(0.0, 0.25), dice.between(0.0, 6.3));
                let centre = if k == 0 { axis } else { aside }.map(|x| x * range * f64::from(1 + 2 * k));
                Body { semi_axes: radii, axes, centre, sun }
            })
            .collect();
        let told = Self::tell(dice, &config, (axis, range), axes, sun);
        let canvas = Canvas::new(&config.camera);
        let (counts, noise, sky) =
            (dice.pick(&[30.0, 110.0, 220.0]), dice.pick(&[0.5, 1.5, 4.0]), dice.pick(&[3.0, 12.0]));
        let corners = [[-0.25, -0.25], [0.25, -0.25], [-0.25, 0.25], [0.25, 0.25]];
        let data = canvas.draw(noise, u64::from(dice.number()), |_, [u, v]| {
            let rays = corners.iter().filter_map(|[x, y]| canvas.ray(u + x, v + y));
            sky + 0.25 * counts * rays.map(|ray| bodies.iter().map(|body| body.light(ray)).sum::<f64>()).sum::<f64>()
        });
        Self { config, told, data }
    }

    fn tell(dice: &mut Dice, config: &Config, (axis, range): (V3, f64), axes: [V3; 3], sun: V3) -> Told {
        let mut told = Told::draw(dice, config, axis, sun, 1e3 * range);
        let prior = &mut told.prior;
        // The rotation whose rows are the axes of the body, a little wrong.
        let [[a, b, c], [d, e, f], [g, h, i]] = axes;
        let w = 0.5 * libm::sqrt((1.0 + a + e + i).max(1e-9));
        told.quaternion = Some([w, (h - f) / (4.0 * w), (c - g) / (4.0 * w), (d - b) / (4.0 * w)]);
        prior.position_m = None;
        prior.attitude_sigma_rad = Some(dice.pick(&[1e-3, 0.02, 0.1]));
        prior.fixed_from_camera = told.quaternion.and_then(Rotation::assume_from_quaternion);
        if prior.fixed_from_camera.is_none() || dice.one_in(4) {
            (prior.fixed_from_camera, told.quaternion) = (None, None);
            prior.pole = UnitVec3::try_new(axes[2]);
        }
        if dice.one_in(3) {
            let sigma = dice.pick(&[1e-4, 0.01, 0.2]);
            prior.range_m = Some(1e3 * range * (1.0 + sigma * dice.normal()));
            prior.range_sigma_m = Some(1e3 * range * sigma);
        }
        told
    }
}

/// Draws how the position is fitted.
fn position(dice: &mut Dice, config: &mut Config) {
    let is_fitted = dice.pick(&[Some(true), Some(true), None, Some(false)]);
    if config.fit.position.is_none() {
        config.fit.position = is_fitted;
    }
    config.fit.yaw_limit_deg = dice.pick(&[1.0, 10.0, 90.0]);
    if config.fit.position == Some(true) {
        use fit::Method::{GeneralisedTls, LeastSquares, Sphere};
        config.fit.method = dice.pick(&[Sphere, Sphere, GeneralisedTls, LeastSquares]);
    }
    if dice.one_in(3) {
        config.body.limb_height_harmonic_sigma_km = Some(config.body.limb_height_sigma_km * 0.1);
        config.body.radii_sigma_km = config.body.limb_height_sigma_km * dice.pick(&[0.0, 0.2]);
    }
    if dice.one_in(3) {
        config.body.sunlit = Some(dice.one_in(2));
    }
}

fn discs(name: &'static str, seeds: core::ops::Range<u64>, bodies: &[Shape], view: View, all_options: bool) {
    let mut table = Table::new(name);
    for seed in seeds {
        let mut dice = Dice::new(seed);
        let (kind, radii) = dice.pick(bodies);
        let mut scene = Scene::draw(&mut dice, kind, radii, view);
        if all_options {
            options::stages(&mut dice, &mut scene.config);
        }
        if view.hides_orientation {
            scene.told.prior =
                Prior { camera_temperature_c: scene.told.prior.camera_temperature_c, ..Prior::default() };
            scene.told.quaternion = None;
            scene.config.fit.position = Some(false);
        }
        position(&mut dice, &mut scene.config);
        if scene.config.fits_position(&scene.config.body) {
            scene.config.fit.half_angle = fit::HalfAngle::Fused;
        }
        let picture = grey(&scene.config, &scene.data);
        if dice.one_in(4) {
            let made: Option<Box<FlightHorizon>> = table.sensor(&format!("{seed} single"), &scene.config);
            let Some(mut horizon) = made else { continue };
            table.process(&format!("{seed} single"), &mut horizon, &picture, &scene.told.single());
        } else {
            let made: Option<Box<HostHorizon>> = table.sensor(&seed.to_string(), &scene.config);
            let Some(mut horizon) = made else { continue };
            table.process(&seed.to_string(), &mut horizon, &picture, &scene.told.prior);
        }
    }
    table.check();
}

type Shape = (Kind, [f64; 3]);

const ROUND: [Shape; 3] = [(Kind::Moon, [1737.4; 3]), (Kind::Sphere, [1188.3; 3]), (Kind::Sun, [695_700.0; 3])];
const FLAT: [Shape; 4] = [
    (Kind::Ellipsoid, [71_492.0, 71_492.0, 66_854.0]),
    (Kind::Ellipsoid, [286.3, 278.6, 223.2]),
    (Kind::Ellipsoid, [13.0, 11.4, 9.1]),
    (Kind::Saturn, [60_268.0, 60_268.0, 54_364.0]),
];
const EARTH: Shape = (Kind::Earth, [6378.137, 6378.137, 6356.752]);

#[test]
fn of_round_bodies() {
    discs("round", 1000..1080, &ROUND, WHOLE, false);
}

#[test]
fn of_round_bodies_with_drawn_options() {
    discs("round_options", 1100..1180, &ROUND, WHOLE, true);
}

#[test]
fn of_flattened_bodies() {
    discs("flat", 1200..1280, &FLAT, WHOLE, false);
}

#[test]
fn of_flattened_bodies_with_drawn_options() {
    discs("flat_options", 1300..1380, &FLAT, WHOLE, true);
}

#[test]
fn of_parts_of_a_limb() {
    discs("parts", 1600..1690, &[FLAT[0], FLAT[1], ROUND[1], EARTH], PART, false);
}

#[test]
fn of_flattened_bodies_of_which_nothing_is_told() {
    discs("untold", 1700..1790, &[FLAT[0], FLAT[1], EARTH, ROUND[1]], UNTOLD, false);
}

#[test]
fn of_pictures_without_a_meaning() {
    let mut table = Table::new("garbage");
    for seed in 1400..1520 {
        let mut dice = Dice::new(seed);
        let mut config = Config::new(options::lens(&mut dice, [96, 64], 1.2));
        options::stages(&mut dice, &mut config);
        options::body_with_air(&mut dice, &mut config);
        config.edge_points.min_points = 8;
        config.gates.min_inliers = dice.pick(&[4, 8]);
        if dice.one_in(2) {
            config.gates.min_arc_px = Some(10.0);
            (config.gates.min_evidence, config.gates.max_half_angle_sigma) = (-1e6, 60.0);
            config.body.altitude_sigma_km = 100.0;
        }
        if dice.one_in(4) {
            options::other_methods(&mut dice, &mut config);
            config.input.scale_to_height = config.input.scale_to_height.map(|_| 40);
        }
        let data = garbage((seed % u64::from(KINDS)) as u8, seed, dice.number() as u8);
        let made: Option<Box<HostHorizon>> = table.sensor(&seed.to_string(), &config);
        let Some(mut horizon) = made else { continue };
        table.process(&seed.to_string(), &mut horizon, &grey(&config, &data), &Told::default().prior);
    }
    table.check();
}
