//! Finds values that are possible but probably a mistake: swapped, in another unit, or in another order.
//!
//! Each of them is only a warning, because an unusual camera may exist. The checks of hzn-core refuse impossible
//! values.

use hzn_core::Config;
use hzn_core::body;
use hzn_core::camera::{self, Camera, Model};
use hzn_core::image::region::{self, Region};
use hzn_core::pixel::ImagePoint;

/// A value that looks wrong.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Implausible {
    /// The key of sensor.toml, for example `camera.fx_px`.
    pub key: &'static str,
    /// Index of the body in `[[bodies]]`, from 0; `None` if there is only a `[body]`.
    pub body: Option<u8>,
    /// The warning, with the value that was probably meant.
    pub what: String,
}

impl Implausible {
    fn new(key: &'static str, what: impl Into<String>) -> Self {
        Self { key, body: None, what: what.into() }
    }
}

/// What is said of two focal lengths that differ, if nothing says that the pixels are so.
pub const NOT_SQUARE: &str = "make pixels that are not square";

/// Largest usual distance of the principal point from the picture's middle, as a fraction of the side. A cropped
/// picture may exceed it.
const MAX_OFF_CENTRE: f64 = 0.2;
/// Largest usual relative difference between the focal lengths along x and y, because pixels are square.
const MAX_FOCAL_DIFFERENCE: f64 = 0.2;
/// Largest usual field of view of a pinhole lens from side to side, in degrees.
pub(crate) const MAX_PINHOLE_FOV_DEG: f64 = 150.0;
/// Largest usual field of view of a fisheye lens, in degrees.
const MAX_FISHEYE_FOV_DEG: f64 = 250.0;
/// Smallest usual field of view, in degrees. Telescopes have a smaller one, and no limb in view.
const MIN_FOV_DEG: f64 = 0.5;
/// Largest usual tangential coefficient. It comes from a small tilt of the lens.
const MAX_TANGENTIAL: f64 = 0.05;
/// Largest usual altitude, in radii of the body. From farther away a body is a disc of less than 3 degrees, and
/// pictures of the Earth from beyond geostationary orbit are rare.
const MAX_ALTITUDE_RADII: f64 = 40.0;
/// Largest usual altitude above the Earth, in kilometres: just beyond geostationary orbit.
pub(crate) const MAX_ALTITUDE_KM: f64 = 40_000.0;
/// Altitudes of the Moon and of its orbiters above the Earth, in kilometres.
const MOON_ALTITUDES_KM: std::ops::Range<f64> = 340_000.0..420_000.0;
/// Largest relative difference of a radius from the Earth's for a sphere that stands for the Earth. Its semi-axes
/// differ by 0.3 %.
const MAX_EARTH_DIFFERENCE: f64 = 0.02;
/// Smallest part of the width of a picture that a large disc fills.
const LEAST_DISC: f64 = 0.3;
/// Number of pixels in a row and in a column of the picture that the check of the mask looks at.
const MASK_SAMPLES: u16 = 32;

/// Returns every value of a sensor that looks wrong.
pub fn find_implausible(config: &Config) -> Vec<Implausible> {
    let mut found = check_camera(&config.camera);
    if let Some(mount) = &config.mount
        && mount.q_vehicle_from_camera_wxyz == [0.0, 0.0, 0.0, 1.0]
    {
        let what = "is half a turn about the optical axis, because the scalar comes first; no rotation is [1, 0, 0, 0]";
        found.push(Implausible::new("mount.q_vehicle_from_camera_wxyz", what));
    }
    found.extend(check_mask(config));
    let several = !config.bodies.is_empty();
    for (which, body) in (0u8..).zip(config.each_body()) {
        found.extend(
            check_body(body, &config.camera)
                .map(|implausible| Implausible { body: several.then_some(which), ..implausible }),
        );
    }
    found
}

/// Returns the altitude in kilometres above which it is probably in metres.
pub(crate) fn max_altitude_km(body: body::Kind, radius_km: f64) -> f64 {
    match body {
        body::Kind::Earth | body::Kind::EarthSphere => MAX_ALTITUDE_KM,
        body::Kind::Sphere | body::Kind::Sun | body::Kind::Moon => MAX_ALTITUDE_RADII * radius_km,
        // A spacecraft sees a planet from any distance.
        _ => f64::INFINITY,
    }
}

fn check_body(body: &body::Config, camera: &camera::Config) -> Option<Implausible> {
    check_altitude(body, camera).or_else(|| check_air(body))
}

/// Returns whether the whole disc of a body at an altitude is in the picture and large in it. Such a camera was made
/// for this distance; a camera near the body has a field of view that is much wider than such a disc.
pub(crate) fn is_for_the_disc(camera: &camera::Config, radius_km: f64, km: f64) -> bool {
    let disc_deg = (radius_km / (radius_km + km)).asin().to_degrees();
    half_width_deg(camera).is_some_and(|half| (LEAST_DISC * half..=half).contains(&disc_deg))
}

fn check_altitude(body: &body::Config, camera: &camera::Config) -> Option<Implausible> {
    let km = body.altitude_km?;
    if let Some(what) = explain_unused_altitude(body.kind) {
        return Some(Implausible::new("body.altitude_km", what));
    }
    let radius_km = body.mean_radius_km();
    let doubt = doubt_altitude(body.kind, radius_km, km).filter(|_| !is_for_the_disc(camera, radius_km, km))?;
    Some(Implausible::new("body.altitude_km", doubt))
}

/// Returns the doubt about an altitude in kilometres above a body, such as "550000 km is implausibly large: is it in
/// metres?"; `None` if the altitude is usual.
///
/// ```
/// use hzn_core::body::Kind;
/// use hzn_files::plausible::doubt_altitude;
///
/// assert!(doubt_altitude(Kind::Earth, 6371.0, 550_000.0).is_some_and(|doubt| doubt.contains("metres")));
/// assert_eq!(doubt_altitude(Kind::Earth, 6371.0, 550.0), None);
/// ```
pub fn doubt_altitude(body: body::Kind, radius_km: f64, km: f64) -> Option<String> {
    (km > max_altitude_km(body, radius_km)).then(|| format!("{km} km {}", suspect_metres(body, km)))
}

/// Returns the doubt about an altitude above [`max_altitude_km`].
pub(crate) fn suspect_metres(body: body::Kind, km: f64) -> String {
    let is_moon = matches!(body, body::Kind::Earth | body::Kind::EarthSphere) && MOON_ALTITUDES_KM.contains(&km);
    let moon = if is_moon { " (for a camera as far away as the Moon it is right)" } else { "" };
    format!("is implausibly large: is it in metres?{moon}")
}

/// Finds a sphere other than the Earth that has the limb height of the Earth's air.
fn check_air(body: &body::Config) -> Option<Implausible> {
    let earth = body::Config::default();
    let radius_km = body.radius_km.filter(|r| (r / earth.mean_radius_km() - 1.0).abs() > MAX_EARTH_DIFFERENCE)?;
    if body.kind != body::Kind::Sphere || body.limb_height_km != earth.limb_height_km {
        return None;
    }
    let what = format!(
        "{} km is the default, for the Earth's air: a body without air has {}",
        earth.limb_height_km,
        airless_limb(radius_km).replace('\n', ", ").trim_end_matches(", ")
    );
    Some(Implausible::new("body.limb_height_km", what))
}

/// Returns the keys of `[body]` for the limb of a body without air, with this radius in kilometres: the height of its
/// relief is uncertain, and overexposure does not raise the limb.
pub(crate) fn airless_limb(radius_km: f64) -> String {
    let body = body::Config::of_kind(body::Kind::Ellipsoid, Some([radius_km; 3]));
    format!(
        "limb_height_km = {:.1}\nlimb_height_sigma_km = {:.1}\nclipped_height_km = {:.1}\nclipped_sigma_km = {:.1}\n",
        body.limb_height_km, body.limb_height_sigma_km, body.clipped_height_km, body.clipped_sigma_km
    )
}

/// Returns the warning for an altitude of the Sun or the Moon, whose half-angle does not depend on it. The result is
/// `None` for other bodies.
pub fn explain_unused_altitude(body: body::Kind) -> Option<String> {
    match body {
        body::Kind::Moon => Some(format!(
            "is not used: kind = \"moon\" is the Moon as a disc of half a degree, as seen from near the Earth; for a \
             camera in orbit around the Moon write kind = \"sphere\", radius_km = {}, {} (`hzn init --body moon` does)",
            body::MOON_RADIUS_KM,
            airless_limb(body::MOON_RADIUS_KM).replace('\n', ", ").trim_end_matches(", ")
        )),
        body::Kind::Sun => Some("is not used: kind = \"sun\" is the Sun as a disc of half a degree".to_owned()),
        _ => None,
    }
}

/// Finds a mask that covers everything, and polygons that cover nothing.
fn check_mask(config: &Config) -> Option<Implausible> {
    let (w, h) = (config.camera.width, config.camera.height);
    let is_outside = |polygon: &region::Polygon| {
        let all = |f: &dyn Fn(&[f64; 2]) -> bool| polygon.iter().all(f);
        all(&|c| c[0] < 0.0) || all(&|c| c[1] < 0.0) || all(&|c| c[0] > f64::from(w)) || all(&|c| c[1] > f64::from(h))
    };
    let polygons = &config.mask.polygons_px;
    if let Some(which) = polygons.iter().position(is_outside) {
        let what = format!("polygon {} lies outside of the picture of {w} x {h} px and masks nothing", which + 1);
        return Some(Implausible::new("mask.polygons_px", what));
    }
    if polygons.is_empty() {
        return None;
    }
    let camera = Camera::<f64>::try_new(&config.camera).ok()?;
    let region = Region::new(&config.mask, &camera);
    let place = |i: u16, side: u16| (u32::from(i) * u32::from(side.saturating_sub(1)) / u32::from(MASK_SAMPLES)) as u16;
    let sampled = (0..=MASK_SAMPLES).flat_map(|i| (0..=MASK_SAMPLES).map(move |j| (place(i, w), place(j, h))));
    let covers = sampled.filter(|(x, y)| region.contains(*x, *y)).all(|(x, y)| region.masked(x, y));
    let what = "covers the whole picture, so that nothing can be found; a polygon covers the parts to leave out";
    covers.then(|| Implausible::new("mask.polygons_px", what))
}

fn check_camera(c: &camera::Config) -> Vec<Implausible> {
    let mut found = Vec::new();
    found.extend(check_centre(c));
    found.extend(check_focal(c));
    found.extend(check_coefficients(c));
    if let Some(deg) = c.theta_max_deg {
        let wide = half_width_deg(c);
        if deg < std::f64::consts::PI && wide.is_some_and(|wide| wide > 3.0 * deg) {
            let what = format!("an image circle of {deg} degrees leaves out most of the picture: is it in radians?");
            found.push(Implausible::new("camera.theta_max_deg", what));
        }
    }
    found
}

fn check_centre(c: &camera::Config) -> Option<Implausible> {
    let (w, h) = (f64::from(c.width), f64::from(c.height));
    let offset = |x: f64, y: f64| ((x + 0.5) / w - 0.5).abs().max(((y + 0.5) / h - 0.5).abs());
    if offset(c.cx_px, c.cy_px) <= MAX_OFF_CENTRE {
        return None;
    }
    let what = format!("the centre ({}, {}) is far from the middle of {} x {} px", c.cx_px, c.cy_px, c.width, c.height);
    let unit = 0.0..=1.0;
    let why = if unit.contains(&c.cx_px) && unit.contains(&c.cy_px) {
        "; it is counted in pixels from the picture's upper left corner".to_owned()
    } else if offset(c.cy_px, c.cx_px) <= MAX_OFF_CENTRE / 2.0 {
        ": are cx_px and cy_px, or width and height, swapped?".to_owned()
    } else {
        // The centre may be the middle of a picture of another size.
        let [a, b] = [(c.cx_px + 0.5) / w * 2.0, (c.cy_px + 0.5) / h * 2.0];
        if a > 0.0 && b > 0.0 && (a / b - 1.0).abs() < 0.2 {
            let [w, h] = [w * a, h * b].map(f64::round);
            format!(": is the calibration for pictures of about {w} x {h} px?")
        } else {
            ": was the picture cut from a larger one?".to_owned()
        }
    };
    Some(Implausible::new("camera.cx_px", what + &why))
}

fn check_focal(c: &camera::Config) -> Option<Implausible> {
    let ratio = c.fx_px / c.fy_px;
    if (ratio - 1.0).abs() > MAX_FOCAL_DIFFERENCE && (1.0 / ratio - 1.0).abs() > MAX_FOCAL_DIFFERENCE {
        let what = format!("{} and fy_px = {} {NOT_SQUARE}: is one of them wrong?", c.fx_px, c.fy_px);
        return Some(Implausible::new("camera.fx_px", what));
    }
    let half = half_width_deg(c)?;
    let widest = if c.model == Model::Pinhole || c.model == Model::BrownConrady {
        MAX_PINHOLE_FOV_DEG
    } else {
        MAX_FISHEYE_FOV_DEG
    };
    if 2.0 * half > widest && c.theta_max_deg.is_none() {
        let what = format!(
            "{} px over {} px of width is a field of view of {:.0} degrees: is it in millimetres? (divide millimetres \
             by the width of a pixel)",
            c.fx_px,
            c.width,
            2.0 * half
        );
        return Some(Implausible::new("camera.fx_px", what));
    }
    (2.0 * half < MIN_FOV_DEG).then(|| {
        let what =
            format!("{} px over {} px of width is a field of view of {:.2} degrees", c.fx_px, c.width, 2.0 * half);
        Implausible::new("camera.fx_px", what)
    })
}

/// Returns the half-width of the field of view: the mean angle off axis of the middles of the picture's left and right
/// sides, in degrees.
fn half_width_deg(c: &camera::Config) -> Option<f64> {
    // Beyond 180 degrees there are no rays.
    let linear = linear_half_width_deg(c);
    if linear > 180.0 {
        return Some(linear);
    }
    // The whole lens counts, without the limit of its image circle.
    let free = camera::Config { theta_max_deg: None, ..c.clone() };
    let camera = Camera::<f64>::try_new(&free).or_else(|_| Camera::try_new(c)).ok()?;
    let side = |u: f64| camera.unproject(ImagePoint { u, v: c.cy_px });
    let [left, right] = [side(-0.5 + 1e-6), side(f64::from(c.width) - 0.5 - 1e-6)].map(|ray| {
        let [x, y, z] = ray?.xyz();
        Some(x.hypot(y).atan2(z).to_degrees())
    });
    match (left, right) {
        (Some(a), Some(b)) => Some((a + b) / 2.0),
        // If a side has no ray, it is beyond the range of the lens.
        _ => Some(linear),
    }
}

/// Returns the same as [`half_width_deg`], for a lens without coefficients. A lens with equations of its own counts as
/// one that is linear in the angle.
fn linear_half_width_deg(c: &camera::Config) -> f64 {
    let half = f64::from(c.width) / 2.0 / c.fx_px;
    if c.model.is_planar() { half.atan().to_degrees() } else { half.to_degrees() }
}

fn check_coefficients(c: &camera::Config) -> Option<Implausible> {
    let k = c.k.as_slice();
    match (c.model, k) {
        (Model::KannalaBrandt, [first, ..]) if (first - 1.0).abs() < 1e-9 => Some(Implausible::new(
            "camera.k",
            "begins with 1: k1 is the coefficient of the angle's third power; leave the 1 of the first power out",
        )),
        (Model::BrownConrady, [_, _, p1, p2, rest @ ..])
            if p1.abs().max(p2.abs()) > MAX_TANGENTIAL && rest.iter().all(|k3| k3.abs() <= p1.abs().max(p2.abs())) =>
        {
            Some(Implausible::new(
                "camera.k",
                format!("has tangential coefficients {p1} and {p2}, which are large: the order is k1, k2, p1, p2, k3"),
            ))
        }
        _ => None,
    }
}

/// Returns the message for a fisheye lens with five coefficients instead of four. They are those of Braun & Barf 2022,
/// (13); the message has hzn's coefficients for the same lens.
pub(crate) fn explain_five_coefficients(c: &camera::Config) -> Option<String> {
    let [first, higher @ ..] = c.k.as_slice() else { return None };
    if c.model != Model::KannalaBrandt || higher.len() != 4 || higher.last() == Some(&0.0) {
        return None;
    }
    let in_px = (first - 1.0).abs() > 1e-9;
    let k: Vec<String> = higher.iter().map(|k| format!("{}", if in_px { k / first } else { *k })).collect();
    let focal = if in_px { format!("fx_px = fy_px = {first} and ") } else { String::new() };
    let plausible = !in_px || (first / c.fx_px - 1.0).abs() < 0.2;
    plausible.then(|| {
        format!(
            "has five coefficients that begin with the angle's first power, as in Braun & Barf 2022; hzn has only the \
             four higher ones: write {focal}k = [{}] (`hzn camera convert --braun-barf` converts them)",
            k.join(", ")
        )
    })
}

#[cfg(test)]
mod tests;
