//! The cameras of the trials.

use hzn_core::camera::{Camera, Config, Model};

use super::dice::Dice;
use super::kind::Kind;

/// Weights and sizes of the pictures (columns, rows).
const SIZES: [(f64, (u16, u16)); 7] = [
    (4.0, (480, 360)),
    (4.0, (640, 480)),
    (2.0, (800, 600)),
    (1.0, (1024, 1024)),
    (1.0, (1280, 960)),
    (1.0, (1280, 720)),
    (1.0, (752, 480)),
];

/// Draws a camera for a kind. A pinhole is 27° to 110° wide, an equidistant lens 27° to 140°, a Kannala-Brandt lens 60°
/// to 150°. The principal point is up to 2 % of the width off the middle. A kind that needs a fisheye gets no pinhole.
/// The Moon sometimes gets a tele lens of 4° to 27°. A kind of ground gets at most 75°.
pub(super) fn draw(dice: &mut Dice, kind: Kind) -> Config {
    let (width, height) = dice.pick(&SIZES).unwrap_or((640, 480));
    let pinhole = if kind == Kind::FarDisc { 0.0 } else { 4.0 };
    let model = dice.pick(&[(pinhole, Model::Pinhole), (3.0, Model::Equidistant), (3.0, Model::KannalaBrandt)]);
    let model = model.unwrap_or(Model::Equidistant);
    let (low, high) = match model {
        Model::Pinhole => (27.0, 110.0),
        Model::KannalaBrandt => (60.0, 150.0),
        _ => (27.0, 140.0),
    };
    let degrees = match kind {
        Kind::Moon if dice.chance(0.4) => dice.between_log(4.0, 27.0),
        _ if kind.is_ground() => dice.between(15.0, 75.0),
        _ => dice.between(low, high),
    };
    let half = 0.5 * degrees.to_radians();
    let k: &[f64] = if model == Model::KannalaBrandt { &[-0.055, 0.011, -0.0035, 0.0002] } else { &[] };
    let radius = match model {
        Model::Pinhole => libm::tan(half),
        _ => half * k.iter().rev().fold(0.0, |sum, k| (sum + k) * half * half) + half,
    };
    let mut camera = Config::ideal(model, width, height, 0.5 * f64::from(width) / radius);
    camera.k = k.iter().copied().collect();
    camera.cx_px += 0.02 * f64::from(width) * dice.between(-1.0, 1.0);
    camera.cy_px += 0.02 * f64::from(width) * dice.between(-1.0, 1.0);
    if model != Model::Pinhole && half > 0.9 && dice.chance(0.5) {
        camera.theta_max_deg = Some((0.5 * degrees * dice.between(0.9, 1.15)).min(88.0));
    }
    if Camera::<f64>::try_new(&camera).is_err() {
        // The polynomial is not monotone to the corner, so the image circle ends before it.
        camera.theta_max_deg = Some(70.0);
    }
    camera
}
