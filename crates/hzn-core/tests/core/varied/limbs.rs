//! Limbs of a body with air, of which the picture shows a part.

use hzn_core::body::Night;
use hzn_core::tone::Tone;
use hzn_core::{Config, FlightHorizon, HostHorizon};

use super::options::{self, Told};
use super::{Canvas, Dice, Table, V3, angle, cross, direction, dot, grey, sum, unit};

const SIZES: [[u16; 2]; 3] = [[320, 240], [240, 320], [256, 256]];

/// A limb before a camera.
pub(super) struct Scene {
    pub(super) config: Config,
    pub(super) told: Told,
    canvas: Canvas,
    axis: V3,
    half_angle: f64,
    /// Height above the limb for each radian.
    km_per_rad: f64,
    sun: V3,
}

impl Scene {
    /// Draws a camera, a body and what is told.
    pub(super) fn new(dice: &mut Dice, size: [u16; 2], field_rad: f64) -> Self {
        let mut config = Config::new(options::lens(dice, size, field_rad));
        options::body_with_air(dice, &mut config);
        let altitude_km = config.body.altitude_km.unwrap();
        let limb_km = 6371.0 + config.body.limb_height_km;
        let half_angle = libm::asin(limb_km / (6371.0 + altitude_km));
        let (off, azimuth) = (dice.between(-0.3, 0.3) * field_rad, dice.between(0.0, core::f64::consts::TAU));
        let axis = direction(half_angle + off, azimuth);
        // The limb that the picture shows, and the Sun above or below its horizon.
        let outward = direction(off, azimuth);
        let along = cross(axis, outward);
        let (s, c) = libm::sincos(dice.between(-0.2, 1.4));
        let up = unit(sum([(1.0, outward), (-dot(outward, axis), axis)]));
        let sun = unit(sum([(s, up), (c * dice.pick(&[-1.0, 1.0]), along), (0.3 * c, axis)]));
        let told = Told::draw(dice, &config, axis, sun, 1e3 * (6371.0 + altitude_km));
        let km_per_rad = limb_km / libm::tan(half_angle);
        Self { canvas: Canvas::new(&config.camera), config, told, axis, half_angle, km_per_rad, sun }
    }

    fn height_km(&self, ray: V3) -> f64 {
        (angle(ray, self.axis) - self.half_angle) * self.km_per_rad
    }

    /// Turns the body in the picture.
    pub(super) fn move_by(&mut self, turn: V3) {
        self.axis = unit(sum([(1.0, self.axis), (1.0, cross(turn, self.axis))]));
    }

    /// Draws the limb by day.
    pub(super) fn day(&self, dice: &mut Dice) -> Vec<u8> {
        let light = Light::draw(dice);
        self.in_light(&light, dice)
    }

    /// Draws a limb that every sensor finds.
    pub(super) fn calm_day(&self, dice: &mut Dice) -> Vec<u8> {
        let light = Light::calm(dice);
        self.in_light(&light, dice)
    }

    fn in_light(&self, light: &Light, dice: &mut Dice) -> Vec<u8> {
        let seed = u64::from(dice.number());
        self.canvas.draw(light.noise, seed, |ray, at| ray.map_or(0.0, |ray| light.at(self, ray, at)))
    }
}

/// Light of air and ground, as a part of that of thick air.
fn air(above_km: f64) -> f64 {
    let air = -libm::expm1(-core::f64::consts::LN_2 * libm::exp(-above_km / 7.5));
    air * (1.0 - 0.2 * (-above_km / 100.0).clamp(0.0, 1.0))
}

/// Drawn light of a picture.
pub(super) struct Light {
    counts: f64,
    sky: f64,
    pub(super) noise: f64,
    softness: f64,
    haze: f64,
    /// Depth, length and direction of clouds.
    clouds: [f64; 4],
    /// Height and length of waves of the edge.
    wave: [f64; 2],
    /// Whether the Sun dims the limb beyond its terminator.
    has_terminator: bool,
    /// Columns without light, a disc in the sky, and a bar.
    dark: [f64; 2],
    ghost: Option<([f64; 2], f64, f64)>,
    bar: Option<([f64; 2], f64)>,
    /// Width of the lit band, km, and the rest of the light inside.
    band: Option<(f64, f64)>,
    frame_px: f64,
}

impl Light {
    fn calm(dice: &mut Dice) -> Self {
        Self {
            counts: dice.pick(&[60.0, 120.0, 200.0]),
            sky: dice.between(2.0, 10.0),
            noise: dice.pick(&[0.3, 1.0, 2.0]),
            softness: 1.0,
            haze: 0.0,
            clouds: [dice.pick(&[0.0, 0.3]), 9.0, 0.4, 0.0],
            wave: [dice.pick(&[0.0, 0.0, 1.5]), 20.0],
            has_terminator: false,
            dark: [0.0; 2],
            ghost: None,
            bar: None,
            band: None,
            frame_px: 0.0,
        }
    }

    pub(super) fn draw(dice: &mut Dice) -> Self {
        if dice.one_in(2) {
            return Self::calm(dice);
        }
        let at = |dice: &mut Dice| [dice.between(20.0, 240.0), dice.between(20.0, 240.0)];
        Self {
            counts: dice.pick(&[12.0, 40.0, 100.0, 160.0, 220.0, 500.0]),
            sky: dice.between(2.0, 20.0),
            noise: dice.pick(&[0.3, 1.0, 2.0, 5.0]),
            softness: dice.pick(&[0.05, 0.5, 1.0, 1.0, 1.0, 3.0]),
            haze: if dice.one_in(4) { dice.between(0.02, 0.6) } else { 0.0 },
            clouds: [
                if dice.one_in(2) { dice.between(0.1, 0.9) } else { 0.0 },
                dice.between(3.0, 25.0),
                dice.between(-1.0, 1.0),
                dice.between(0.0, 6.0),
            ],
            wave: [if dice.one_in(3) { dice.between(0.5, 15.0) } else { 0.0 }, dice.between(5.0, 60.0)],
            has_terminator: dice.one_in(4),
            dark: if dice.one_in(5) { [dice.between(0.0, 150.0), dice.between(150.0, 330.0)] } else { [0.0; 2] },
            ghost: dice.one_in(4).then(|| (at(dice), dice.between(4.0, 45.0), dice.between(20.0, 160.0))),
            bar: dice.one_in(6).then(|| (at(dice), dice.between(-1.5, 1.5))),
            band: dice.one_in(6).then(|| (dice.between(15.0, 150.0), dice.between(0.0, 0.9))),
            frame_px: if dice.one_in(8) { dice.between(1.0, 5.0).floor() } else { 0.0 },
        }
    }

    fn at(&self, scene: &Scene, ray: V3, [u, v]: [f64; 2]) -> f64 {
        let [w, h] = scene.canvas.size.map(f64::from);
        if u < self.frame_px || v < self.frame_px || u >= w - self.frame_px || v >= h - self.frame_px {
            return 0.0;
        }
        let across = u - v;
        let km = scene.height_km(ray) + self.wave[0] * libm::sin(across / self.wave[1]);
        let mut light = air(km / self.softness).max(self.haze * libm::exp(-km.max(0.0) / 80.0));
        let [depth, length, slope, phase] = self.clouds;
        if km < 0.0 && depth > 0.0 {
            let texture = libm::sin((u + slope * v) / length + phase) * libm::sin((v - slope * u) / (0.7 * length));
            light *= 1.0 - depth * (0.5 + 0.5 * texture);
        }
        if self.has_terminator {
            let up = unit(sum([(1.0, ray), (-libm::cos(scene.half_angle), scene.axis)]));
            light *= (0.05 + 3.0 * dot(up, scene.sun)).clamp(0.0, 1.0);
        }
        if self.band.is_some_and(|(width, _)| km < -width) {
            light *= self.band.map_or(1.0, |(_, rest)| rest);
        }
        if self.dark[0] < u && u < self.dark[1] {
            light = 0.0;
        }
        let mut counts = self.sky + self.counts * light;
        if let Some(([x, y], radius, bright)) = self.ghost {
            let off = libm::hypot(u - x, v - y) - radius;
            counts += bright * (0.5 - off / 2.0).clamp(0.0, 1.0);
        }
        if let Some(([x, y], slope)) = self.bar {
            let off = (v - y - slope * (u - x)) / libm::sqrt(1.0 + slope * slope);
            counts = if off.abs() < 4.0 { 150.0 } else { counts };
        }
        counts
    }
}

fn limbs_with(name: &'static str, seeds: core::ops::Range<u64>, change: fn(&mut Dice, &mut Config)) {
    let mut table = Table::new(name);
    for seed in seeds {
        let mut dice = Dice::new(seed);
        let size = dice.pick(&SIZES);
        let field_rad = dice.pick(&[0.3, 0.5, 0.8, 1.3]);
        let mut scene = Scene::new(&mut dice, size, field_rad);
        let data = scene.day(&mut dice);
        change(&mut dice, &mut scene.config);
        let made: Option<Box<HostHorizon>> = table.sensor(&seed.to_string(), &scene.config);
        let Some(mut horizon) = made else { continue };
        table.process(&seed.to_string(), &mut horizon, &grey(&scene.config, &data), &scene.told.prior);
    }
    table.check();
}

#[test]
fn of_limbs_with_the_defaults() {
    limbs_with("limbs", 0..90, |_, _| {});
}

#[test]
fn of_limbs_with_drawn_options() {
    limbs_with("options", 100..190, options::stages);
}

#[test]
fn of_limbs_with_more_drawn_options() {
    limbs_with("more_options", 200..290, options::stages);
}

#[test]
fn of_limbs_with_the_methods_of_other_systems() {
    limbs_with("systems", 300..390, |dice, config| {
        if dice.one_in(2) {
            options::stages(dice, config);
        }
        options::other_methods(dice, config);
    });
}

#[test]
fn of_limbs_in_single_precision() {
    let mut table = Table::new("single");
    for seed in 400..460 {
        let mut dice = Dice::new(seed);
        let mut scene = Scene::new(&mut dice, [320, 240], 0.6);
        let data = scene.day(&mut dice);
        options::stages(&mut dice, &mut scene.config);
        let made: Option<Box<FlightHorizon>> = table.sensor(&seed.to_string(), &scene.config);
        let Some(mut horizon) = made else { continue };
        table.process(&seed.to_string(), &mut horizon, &grey(&scene.config, &data), &scene.told.single());
    }
    table.check();
}

/// Returns the light of a layer of airglow along a line of sight, by its lowest height in km.
fn layer(peak_km: f64, thickness_km: f64) -> impl Fn(f64) -> f64 {
    let emission = move |height_km: f64| {
        let z = (height_km - peak_km) / thickness_km;
        libm::exp(1.0 - z - libm::exp(-z))
    };
    let way = |tangent_km: f64, km: i32| libm::sqrt((6371.0 + tangent_km).powi(2) + f64::from(km * km)) - 6371.0;
    let sums: Vec<f64> = (-400..400)
        .map(|km| (0..400).map(|k| emission(way(f64::from(km), 4 * k))).sum::<f64>() / 50.0 / thickness_km)
        .collect();
    move |tangent_km: f64| {
        let at = (tangent_km + 400.0).clamp(0.0, 798.0);
        let (k, part) = (at as usize, at.fract());
        sums[k] * (1.0 - part) + sums[k + 1] * part
    }
}

#[test]
fn of_airglow() {
    let mut table = Table::new("night");
    for seed in 500..560 {
        let mut dice = Dice::new(seed);
        let field_rad = dice.between(0.3, 0.8);
        let mut scene = Scene::new(&mut dice, [320, 240], field_rad);
        scene.config.body.night = Night::Airglow;
        (scene.told.prior.sun, scene.told.prior.sun_elevation_rad) = (None, Some(dice.between(-1.2, -0.6)));
        scene.config.input.tone = dice.one_in(2).then_some(Tone::Linear);
        let glow = layer(dice.between(86.0, 104.0), dice.between(3.0, 9.0));
        let (ground, counts) = (dice.pick(&[0.01, 0.1, 0.4, 0.9]), dice.pick(&[40.0, 120.0, 200.0]));
        let (uneven, length) = (dice.pick(&[0.0, 0.1, 0.25, 0.4]), dice.between(5.0, 60.0));
        let (dark, city) = (dice.between(-150.0, 150.0), dice.between(50.0, 250.0));
        let noise = dice.pick(&[0.5, 1.5, 4.0]);
        let data = scene.canvas.draw(noise, seed, |ray, [u, v]| {
            let km = ray.map_or(900.0, |ray| scene.height_km(ray) + 17.0);
            let seen = if km < 0.0 { 0.5 * glow(km) + ground } else { glow(km) };
            let light = seen * (1.0 - uneven * (1.0 - libm::sin((u + v) / length)));
            let spot = if libm::hypot(u - city, v - city) < 6.0 { 60.0 } else { 0.0 };
            if u < dark { 4.0 } else { 4.0 + spot + counts * light.min(1.5) }
        });
        if dice.one_in(2) {
            options::stages(&mut dice, &mut scene.config);
        }
        let made: Option<Box<HostHorizon>> = table.sensor(&seed.to_string(), &scene.config);
        let Some(mut horizon) = made else { continue };
        table.process(&seed.to_string(), &mut horizon, &grey(&scene.config, &data), &scene.told.prior);
    }
    table.check();
}
