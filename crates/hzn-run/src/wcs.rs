//! World coordinates of FITS: where the centre of a body is in a picture, and the plate scale there.
//!
//! A limb shows the centre of a body and the scale, but no rotation about the centre. The world coordinates are offsets
//! from the centre (Greisen and Calabretta 2002, A&A 395, 1061; Calabretta and Greisen 2002, A&A 395, 1077; for the Sun
//! Thompson 2006, A&A 449, 791), by the tangent plane at the centre. The lens is linear there, and only there: the card
//! `HZNLIMB` says by how much the limb misses these coordinates.

use std::io::Read;
use std::path::Path;

use hzn_core::Solution;
use hzn_core::body::Kind;
use hzn_core::camera::Camera;
use hzn_core::frames::{Cam, UnitVec3};
use hzn_core::pixel::ImagePoint;

use crate::source::{FITS_START, FitsHeader, fits_header, open_file};

/// Length of a card of a header in bytes, and of a block.
const CARD: usize = 80;
const BLOCK: usize = 2880;
/// Half of the step of the derivatives at the centre, pixels.
const STEP_PX: f64 = 0.5;
/// Places on the limb at which the linear coordinates are compared with the lens.
const PLACES: usize = 16;
/// Half-angle up to which they are compared, radians: the tangent of larger ones is large.
const MAX_COMPARED_RAD: f64 = 1.2;

/// Returns whether a file begins as a FITS file.
pub fn is_fits(path: &Path) -> bool {
    let mut head = [0; FITS_START.len()];
    open_file(path).is_ok_and(|mut file| file.read_exact(&mut head).is_ok() && head == FITS_START)
}

/// The centre of a body in a picture, in the pixels of hzn: (u, v) from the centre of the upper left pixel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Centre {
    kind: Kind,
    centre_px: [f64; 2],
    /// Derivatives of the offsets to the right and up by u and v, radians a pixel.
    by_px: [[f64; 2]; 2],
    /// Covariance of `centre_px`, px².
    covariance_px2: [[f64; 2]; 2],
    half_angle_rad: f64,
    /// Largest distance of the limb from where the linear coordinates have it, pixels.
    limb_error_px: Option<f64>,
    /// Whether "up" is the north of the body, from an attitude.
    has_north: bool,
}

impl Centre {
    /// Finds the centre of an answer in the picture of its camera. The attitude, from the camera to the axes of the
    /// body with the scalar first, says where north is; those of Sun and Moon are not known.
    ///
    /// # Errors
    /// The reason why the picture has no such coordinates.
    pub fn find(
        solution: &Solution<f64>,
        camera: &Camera<f64>,
        kind: Kind,
        q_fixed_from_camera_wxyz: Option<[f64; 4]>,
    ) -> Result<Self, &'static str> {
        const OUTSIDE: &str =
            "the centre of the body is outside of the picture, and the coordinates are right only there";
        let axis = solution.axis.xyz();
        let at = camera.project(&solution.axis).ok_or(OUTSIDE)?;
        let is_inside = |x: f64, size: u16| (-0.5..=f64::from(size) - 0.5).contains(&x);
        if !(is_inside(at.u, camera.width()) && is_inside(at.v, camera.height())) {
            return Err(OUTSIDE);
        }
        let north = q_fixed_from_camera_wxyz.filter(|_| !matches!(kind, Kind::Sun | Kind::Moon)).and_then(north_of);
        let up_of = |north: [f64; 3]| {
            let along = dot(north, axis);
            unit(std::array::from_fn(|i| north[i] - along * axis[i])).filter(|_| along.abs() < 0.9999)
        };
        let north_up = north.and_then(up_of);
        // Without north, "right" is the first axis of the camera.
        let right = unit(std::array::from_fn(|i| f64::from(u8::from(i == 0)) - axis[0] * axis[i]));
        let up = north_up.or(right.map(|right| cross(right, axis))).ok_or(OUTSIDE)?;
        let plane = Plane { axis, right: cross(axis, up), up };
        let by_px = plane.by_px(camera, [at.u, at.v]).ok_or("the lens does not reach around the centre of the body")?;
        let to_px = inverse(by_px).ok_or("the lens has no scale at the centre of the body")?;
        let rows = solution.covariance.rows();
        let form = |a: [f64; 3], b: [f64; 3]| {
            (0..3).map(|i| (0..3).map(|j| a[i] * rows[i][j] * b[j]).sum::<f64>()).sum::<f64>()
        };
        let sides = [plane.right, plane.up];
        let of_plane: [[f64; 2]; 2] = std::array::from_fn(|i| std::array::from_fn(|j| form(sides[i], sides[j])));
        let half_angle_rad = solution.half_angle_rad;
        let mut centre = Self {
            kind,
            centre_px: [at.u, at.v],
            by_px,
            covariance_px2: product(product(to_px, of_plane), transposed(to_px)),
            half_angle_rad,
            limb_error_px: None,
            has_north: north_up.is_some(),
        };
        centre.limb_error_px = plane.limb_error_px(camera, &centre, to_px);
        Ok(centre)
    }

    /// Returns the contents of a FITS file with these coordinates in its first header. Earlier cards about the
    /// coordinates of these two axes are left out; the data are unchanged.
    ///
    /// # Errors
    /// The reason why the file has no place for them.
    pub fn write_into(&self, fits: &[u8]) -> Result<Vec<u8>, String> {
        let FitsHeader { height, from_below, end, data } = fits_header(fits).ok_or("is no FITS file")??;
        let mut out = Vec::with_capacity(fits.len() + BLOCK);
        let mut is_kept = true;
        for card in fits.get(..end).unwrap_or_default().chunks_exact(CARD) {
            // A long text goes on in the next card.
            is_kept = if card.starts_with(b"CONTINUE") { is_kept } else { !is_replaced(card) };
            if is_kept {
                out.extend_from_slice(card);
            }
        }
        for card in self.cards(height, from_below) {
            out.extend_from_slice(card.as_bytes());
        }
        out.extend_from_slice(format!("{:<CARD$}", "END").as_bytes());
        out.resize(out.len().next_multiple_of(BLOCK), b' ');
        out.extend_from_slice(fits.get(data..).unwrap_or_default());
        Ok(out)
    }

    /// Returns the cards for a picture of this height whose rows begin below or above.
    fn cards(&self, height: u32, from_below: bool) -> Vec<String> {
        // The first pixel of FITS is 1, and its second axis goes up if the first row is the lowest one.
        let [u, v] = self.centre_px;
        let side = if from_below { -1.0 } else { 1.0 };
        let pixel = [u + 1.0, if from_below { f64::from(height) - v } else { v + 1.0 }];
        let cd = self.by_px.map(|[by_u, by_v]| [by_u.to_degrees(), side * by_v.to_degrees()]);
        let step = |row: usize| {
            let size = cd[row][0].hypot(cd[row][1]);
            // The sign tells a picture whose rows go down. Axes that are turned to the side have no such sign.
            if cd[row][row] < -0.5 * size { -size } else { size }
        };
        let steps = [step(0), step(1)];
        let names = if self.kind == Kind::Sun { ["HPLN-TAN", "HPLT-TAN"] } else { ["NDLN-TAN", "NDLT-TAN"] };
        let axes = match (self.kind, self.has_north) {
            (Kind::Sun, _) => ["offset from the centre of the Sun, right", "offset from the centre of the Sun, up"],
            (_, true) => ["offset from the centre of the body, east", "offset from the centre of the body, north"],
            (_, false) => ["offset from the centre of the body, right", "offset from the centre of the body, up"],
        };
        let mut cards = Vec::new();
        for (i, name) in names.into_iter().enumerate() {
            let axis = i + 1;
            cards.push(card(&format!("CTYPE{axis}"), &format!("'{name}'"), axes[i]));
            cards.push(card(&format!("CUNIT{axis}"), "'deg     '", "unit of this axis"));
            cards.push(card(&format!("CRPIX{axis}"), &real(pixel[i]), "[pixel] centre of the body; first pixel is 1"));
            cards.push(card(&format!("CRVAL{axis}"), &real(0.0), "[deg] the centre is the origin"));
            cards.push(card(&format!("CDELT{axis}"), &real(steps[i]), "[deg/pixel] plate scale at the centre"));
        }
        for (i, row) in cd.iter().enumerate() {
            for (j, value) in row.iter().enumerate() {
                cards.push(card(&format!("PC{}_{}", i + 1, j + 1), &real(value / steps[i]), "direction of the axes"));
            }
        }
        self.own_cards(side, &mut cards);
        cards
    }

    /// Adds the cards that only hzn has, and the comments.
    fn own_cards(&self, side: f64, cards: &mut Vec<String>) {
        let deg = self.half_angle_rad.to_degrees();
        if self.kind == Kind::Sun {
            cards.push(card("RSUN_OBS", &real(deg * 3600.0), "[arcsec] fitted radius of the disc, with glare"));
        }
        cards.push(card("HZNRAD", &real(deg), "[deg] fitted angular radius of the body"));
        let [[uu, uv], [_, vv]] = self.covariance_px2;
        let sigmas = [uu, vv].map(|variance| variance.max(0.0).sqrt());
        cards.push(card("HZNSIG1", &real(sigmas[0]), "[pixel] 1-sigma of CRPIX1"));
        cards.push(card("HZNSIG2", &real(sigmas[1]), "[pixel] 1-sigma of CRPIX2"));
        let correlation = side * uv / (sigmas[0] * sigmas[1]).max(f64::MIN_POSITIVE);
        cards.push(card("HZNCORR", &real(correlation.clamp(-1.0, 1.0)), "correlation of the two"));
        if let Some(px) = self.limb_error_px {
            cards.push(card("HZNLIMB", &real(px), "[pixel] most by which the limb misses this WCS"));
        }
        let rotation = match self.has_north {
            true => "the rotation about the centre is that of the given attitude",
            false => "the rotation about the centre is not known: a limb does not show it",
        };
        let what = [rotation, "no lens distortion: the scale is right at the centre (see HZNLIMB)"];
        cards.extend(what.map(|what| format!("{:<CARD$}", format!("COMMENT hzn: {what}"))));
        let version = format!("HISTORY hzn {}: hzn run --wcs", env!("CARGO_PKG_VERSION"));
        cards.push(format!("{version:<CARD$}"));
    }
}

/// The plane that touches the sphere of directions at the centre of the body.
struct Plane {
    axis: [f64; 3],
    right: [f64; 3],
    up: [f64; 3],
}

impl Plane {
    /// Returns the offsets of a picture point from the centre, to the right and up.
    fn offsets(&self, camera: &Camera<f64>, [u, v]: [f64; 2]) -> Option<[f64; 2]> {
        let ray = camera.unproject(ImagePoint { u, v })?.xyz();
        let along = dot(ray, self.axis);
        (along > 0.0).then(|| [dot(ray, self.right) / along, dot(ray, self.up) / along])
    }

    /// Returns the derivatives of the offsets by u and v.
    fn by_px(&self, camera: &Camera<f64>, [u, v]: [f64; 2]) -> Option<[[f64; 2]; 2]> {
        let by = |du: f64, dv: f64| {
            let (more, less) = (self.offsets(camera, [u + du, v + dv])?, self.offsets(camera, [u - du, v - dv])?);
            Some([0, 1].map(|i: usize| (more[i] - less[i]) / (2.0 * STEP_PX)))
        };
        let ([a, c], [b, d]) = (by(STEP_PX, 0.0)?, by(0.0, STEP_PX)?);
        Some([[a, b], [c, d]])
    }

    /// Returns the largest distance of the limb in the picture from where the linear coordinates have it; `None` if no
    /// place of it can be compared.
    fn limb_error_px(&self, camera: &Camera<f64>, centre: &Centre, to_px: [[f64; 2]; 2]) -> Option<f64> {
        let (sin, cos) = centre.half_angle_rad.sin_cos();
        let error_px = |place: usize| {
            let (up, right) = (place as f64 * std::f64::consts::TAU / PLACES as f64).sin_cos();
            let ray = std::array::from_fn(|i| cos * self.axis[i] + sin * (right * self.right[i] + up * self.up[i]));
            let at = camera.project(&UnitVec3::<Cam, f64>::try_new(ray)?)?;
            let tan = sin / cos;
            let [u, v] = to_px.map(|row| tan * (row[0] * right + row[1] * up));
            Some((at.u - centre.centre_px[0] - u).hypot(at.v - centre.centre_px[1] - v))
        };
        let places = (0..PLACES).filter(|_| centre.half_angle_rad < MAX_COMPARED_RAD).filter_map(error_px);
        places.reduce(f64::max)
    }
}

/// Returns the north of the body in the camera, from the rotation from the camera to the axes of the body.
fn north_of([w, x, y, z]: [f64; 4]) -> Option<[f64; 3]> {
    let n = w * w + x * x + y * y + z * z;
    unit([2.0 * (x * z - w * y), 2.0 * (y * z + w * x), n - 2.0 * (x * x + y * y)])
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn unit(a: [f64; 3]) -> Option<[f64; 3]> {
    let n = dot(a, a).sqrt();
    (n > 1e-9).then(|| a.map(|x| x / n))
}

fn inverse([[a, b], [c, d]]: [[f64; 2]; 2]) -> Option<[[f64; 2]; 2]> {
    let det = a * d - b * c;
    (det.abs() > 0.0 && det.is_finite()).then(|| [[d / det, -b / det], [-c / det, a / det]])
}

fn product(a: [[f64; 2]; 2], b: [[f64; 2]; 2]) -> [[f64; 2]; 2] {
    a.map(|row| [0, 1].map(|j: usize| row[0] * b[0][j] + row[1] * b[1][j]))
}

fn transposed([[a, b], [c, d]]: [[f64; 2]; 2]) -> [[f64; 2]; 2] {
    [[a, c], [b, d]]
}

/// Returns a card of a header.
fn card(key: &str, value: &str, comment: &str) -> String {
    let value = if value.starts_with('\'') { format!("{value:<20}") } else { format!("{value:>20}") };
    let text: String = format!("{key:<8}= {value} / {comment}").chars().take(CARD).collect();
    format!("{text:<CARD$}")
}

fn real(value: f64) -> String {
    // A negative zero is a zero.
    let value = if value.abs() < 1e-11 { 0.0 } else { value };
    let size = value.abs();
    if size == 0.0 || (1e-3..1e8).contains(&size) { format!("{value:.10}") } else { format!("{value:.11E}") }
}

/// Returns whether a card is about the coordinates of the first two axes, from any convention, or of an earlier run.
fn is_replaced(card: &[u8]) -> bool {
    const OF_AN_AXIS: [&str; 6] = ["CTYPE", "CUNIT", "CRPIX", "CRVAL", "CDELT", "CROTA"];
    const WHOLE: [&str; 9] =
        ["LONPOLE", "LATPOLE", "WCSNAME", "RADESYS", "EQUINOX", "RSUN_OBS", "CHECKSUM", "A_DMAX", "B_DMAX"];
    let text = String::from_utf8_lossy(card);
    let (key, rest) = text.split_at_checked(8).unwrap_or((&text, ""));
    let key = key.trim_end();
    if matches!(key, "COMMENT" | "HISTORY") {
        return rest.trim_start().starts_with("hzn: ") || rest.contains("hzn run --wcs");
    }
    let of_axis = |name: &str| matches!(key.strip_prefix(name), Some("1" | "2"));
    let is_pair = |rest: &str| {
        let sides = rest.split_once('_').map(|(i, j)| [i, j]);
        sides.is_some_and(|sides| sides.iter().all(|side| side.parse::<u8>().is_ok()))
    };
    let of_pair = |name: &str| key.strip_prefix(name).is_some_and(is_pair);
    // The distortion of SIP and of TPV belongs to the coordinates that it was fitted with.
    let is_distortion = ["A_", "B_", "AP_", "BP_"]
        .iter()
        .any(|name| key.strip_prefix(name).is_some_and(|rest| rest == "ORDER" || is_pair(rest)));
    OF_AN_AXIS.iter().any(|name| of_axis(name))
        || ["CD", "PC", "PV", "PS"].iter().any(|name| of_pair(name))
        || is_distortion
        || WHOLE.contains(&key)
        || key.starts_with("HZN")
}
