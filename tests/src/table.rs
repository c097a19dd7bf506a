//! Measures accuracy by altitude, noise, visible arc and lens, and writes it as text.

use core::fmt::Write;

use hzn_core::camera::{self, Model};
use hzn_core::region::Polygon;
use hzn_core::{Config, Prior, body, covariance};
use hzn_sim::pose::position_m;
use hzn_sim::{Band, Clouds, Detector, Disc, Foreground, Look, Pose, Profile, Scene, flight};

use crate::sensors::process;
use crate::{Sensors, Tally};

/// Number of pictures per cell.
pub const FRAMES: usize = 8;
const SIZE: (u16, u16) = (640, 480);
const ALTITUDES_KM: [f64; 3] = [70.0, 240.0, 800.0];
const NOISE: [f64; 3] = [0.005, 0.02, 0.08];
/// Share of the picture's width that the vehicle does not cover.
const UNCOVERED_SHARE: [f64; 2] = [1.0, 0.3];
/// Difference of the true value and the value that the sensor gets, in sigmas. The numbers are the middles of eight
/// equally likely parts of a normal distribution, shuffled.
const SIGMAS: [f64; FRAMES] = [0.49, -1.53, 0.89, -0.16, -0.49, 1.53, 0.16, -0.89];
const HEIGHT_SIGMA_KM: f64 = 1.0;
const ATTITUDE_SIGMA_DEG: f64 = 5.0;

/// Returns name, lens and edge noise of each camera. The edge noise is sigma and correlation length along the edge,
/// both in pixels. It was fitted to the table, as an engineer fits it to the pictures of a camera.
fn lenses() -> [(&'static str, camera::Config, [f64; 2]); 3] {
    let (w, h) = SIZE;
    // 180° across. The larger the pixels, the longer the part of an edge where clouds shine through.
    let wide = camera::Config { theta_max_deg: Some(90.0), ..camera::Config::ideal(Model::Equidistant, w, h, 203.0) };
    [
        // 60° across.
        ("pinhole 60°", camera::Config::ideal(Model::Pinhole, w, h, 554.0), [0.15, 60.0]),
        ("fisheye 94°", flight::rocket_camera(w, h), [0.15, 60.0]),
        ("equidistant 180°", wide, [0.25, 200.0]),
    ]
}

/// Returns the sensor and the scenes of one cell.
pub fn cell(
    camera: &camera::Config,
    [sigma_px, correlation_px]: [f64; 2],
    altitude_km: f64,
    noise: f64,
    open: f64,
) -> (Config, Vec<Scene>) {
    let (w, h) = (f64::from(camera.width), f64::from(camera.height));
    let mut sensor = Config::new(camera.clone());
    sensor.body = body::Config {
        altitude_sigma_km: 0.1,
        limb_height_km: 10.0,
        limb_height_sigma_km: HEIGHT_SIGMA_KM,
        ..sensor.body
    };
    sensor.covariance = covariance::Config { bias_px: 0.25, ..covariance::Config::given(sigma_px, correlation_px) };
    let edge = (1.0 - open) * w;
    // The mask is four pixels larger than the vehicle, because the vehicle's edge is blurred.
    let part = |grow: f64| [[-20.0, -20.0], [edge + grow, -20.0], [edge + grow, h + 20.0], [-20.0, h + 20.0]];
    if open < 1.0 {
        let polygon: Polygon = part(4.0).into_iter().collect();
        sensor.mask.polygons_px = [polygon].into_iter().collect();
    }
    let scenes = (0..FRAMES)
        .map(|i| {
            let x = i as f64 / FRAMES as f64;
            // This dip of the horizon puts the limb across the picture's middle at every altitude. libm gives the same
            // bits on every machine.
            let dip_rad = libm::acos(6381.0 / (6371.0 + altitude_km));
            let look = Look {
                azimuth_rad: core::f64::consts::TAU * x,
                depression_rad: dip_rad + 0.15 * (x - 0.4),
                roll_rad: 0.5 * (2.0 * x - 1.0),
            };
            let pose = Pose::looking(position_m(60.0 - 110.0 * x, 20.0 + 50.0 * x, altitude_km), look);
            let mut scene = Scene::new(camera.clone(), pose);
            scene.body = sensor.body.clone();
            scene.body.limb_height_km += HEIGHT_SIGMA_KM * SIGMAS[i];
            scene.profile = Profile::Exponential { scale_km: 4.0 };
            scene.disc = Disc {
                surface: 0.12,
                clouds: Some(Clouds { seed: i as u64, ..Clouds::default() }),
                band: Some(Band { brightness: 0.9, depth_km: 16.0, fade_km: 24.0 }),
            };
            scene.detector = Detector { psf_sigma_px: 0.9, read_noise: noise, ..Detector::default() };
            scene.seed = i as u64;
            if open < 1.0 {
                scene.foreground.push(Foreground { polygon_px: part(0.0).to_vec(), brightness: 0.45 });
            }
            scene
        })
        .collect();
    (sensor, scenes)
}

/// Runs the sensor of a workstation over one cell twice: with the position and an attitude that is wrong by about 5°,
/// and with the position only.
///
/// # Panics
/// Panics if a scene cannot be rendered.
pub fn measure((sensor, scenes): &(Config, Vec<Scene>)) -> [Tally; 2] {
    let mut sensors = Sensors::new(sensor);
    let mut tallies = [Tally::default(), Tally::default()];
    for (i, scene) in scenes.iter().enumerate() {
        let truth = scene.truth("", 0.0).expect("the scene is valid");
        let picture = scene.render().expect("the scene is valid");
        let error_rad = [0, 3, 5].map(|k| ATTITUDE_SIGMA_DEG.to_radians() * SIGMAS[(i + k) % FRAMES]);
        let position: Prior<f64> = crate::prior_of_scene(scene);
        let attitude = Prior { fixed_from_camera: scene.pose.disturbed(error_rad).fixed_from_camera(), ..position };
        for (tally, known) in tallies.iter_mut().zip([attitude, position]) {
            let answer = process(&mut sensors.host, picture.view(), &known);
            tally.add(answer.ok().as_ref(), [truth.axis_x, truth.axis_y, truth.axis_z]);
        }
    }
    tallies
}

/// Returns the whole table as Markdown, with numbers to two digits. The last three columns are without an attitude.
pub fn markdown() -> String {
    let mut out = String::from(
        "| lens | altitude | noise | open | answered | RMS error | median sigma | NEES | answered | RMS error | NEES \
         |\n\
         |---|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|\n",
    );
    for (name, camera, errors_px) in lenses() {
        for altitude_km in ALTITUDES_KM {
            for noise in NOISE {
                for open in UNCOVERED_SHARE {
                    let [t, u] = measure(&cell(&camera, errors_px, altitude_km, noise, open));
                    let _ = writeln!(
                        out,
                        "| {name} | {altitude_km} km | {} % | {} % | {}/{} | {}° | {}° | {} | {}/{} | {}° | {} |",
                        noise * 100.0,
                        open * 100.0,
                        t.answered(),
                        t.frames,
                        two_digits(t.rms_deg()),
                        two_digits(t.median_sigma_deg()),
                        two_digits(t.mean_nees()),
                        u.answered(),
                        u.frames,
                        two_digits(u.rms_deg()),
                        two_digits(u.mean_nees())
                    );
                }
            }
        }
    }
    out
}

/// Formats a number to two significant digits, without an exponent; returns `–` if it is not finite.
pub(crate) fn two_digits(x: f64) -> String {
    if !x.is_finite() {
        return "–".into();
    }
    // `{:e}` rounds to the digits first, so that 0.0996 is 0.10 and not 0.100.
    let rounded: f64 = format!("{x:.1e}").parse().unwrap_or(x);
    let decimals = if rounded > 0.0 { (1 - rounded.log10().floor() as i32).max(0) } else { 1 };
    format!("{rounded:.*}", decimals as usize)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_significant_digits() {
        let shown = [0.0123, 0.0996, 1.96, 12.4, 137.0, 0.0].map(two_digits);
        assert_eq!(shown, ["0.012", "0.10", "2.0", "12", "140", "0.0"]);
        assert_eq!(two_digits(f64::NAN), "–");
    }
}
