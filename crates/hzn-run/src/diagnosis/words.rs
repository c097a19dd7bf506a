//! What would fit, in words.

use hzn_core::camera::Camera;
use hzn_core::pixel::ImagePoint;

use super::facts::{FitFacts, Implied, Suspect};
use super::joint::{Pair, Remedy};
use super::together::{Contradiction, Fault};

/// Angle below which tenths of a degree are too coarse, degrees.
const SMALL_DEG: f64 = 10.0;

/// Says which half-angle the limb has, and which altitude or field of view would make it the expected one: `the limb
/// fits 78.6 +- 0.8 deg, expected 75.1 deg: altitude 146 +- 25 km, or a field of view of 91.0 deg at 240 km`. `width`
/// and `camera` are those of the picture.
pub fn what_fits(fit: &FitFacts, camera: &Camera<f64>, width: u16) -> String {
    // A small disc needs more digits than a limb of 70 degrees.
    let digits = if fit.expected_deg.min(fit.fitted_deg) < SMALL_DEG { 3 } else { 1 };
    let limb = format!(
        "the limb fits {:.digits$} +- {:.digits$} deg, expected {:.digits$} deg",
        fit.fitted_deg, fit.fitted_sigma_deg, fit.expected_deg
    );
    let altitude = fit
        .altitude_km
        .filter(|i| i.value > 0.0)
        .zip(fit.total_sigma(Suspect::Altitude).or(fit.altitude_km.map(|i| i.sigma)))
        .map(|(Implied { value, .. }, sigma)| format!("altitude {} km", with_sigma(value, sigma)));
    let at = fit.given_altitude_km.map(|km| format!(" at {km:.0} km")).unwrap_or_default();
    let field_of_view = fit
        .focal_factor
        .and_then(|factor| field_of_view_deg(camera, width, factor.value))
        .map(|deg| format!("a field of view of {deg:.*} deg{at}", if deg < SMALL_DEG { 3 } else { 1 }));
    match (altitude, field_of_view) {
        (Some(altitude), Some(field_of_view)) => format!("{limb}: {altitude}, or {field_of_view}"),
        (Some(one), None) | (None, Some(one)) => format!("{limb}: {one}"),
        (None, None) => limb,
    }
}

/// Returns a value with its sigma. A small sigma has enough digits that it is not zero.
fn with_sigma(value: f64, sigma: f64) -> String {
    let digits = if sigma > 0.0 { (-sigma.log10().floor()).clamp(0.0, 6.0) as usize } else { 0 };
    format!("{value:.digits$} +- {sigma:.digits$}")
}

/// Says which two values together explain the half-angles of several pictures: `no single value explains the 14
/// pictures, but two do: the altitude is 20.3 ± 1.1 km too low, and the focal length is 812.4 ± 1.9 px`. `focal_px` is
/// the focal length that the pictures were processed with.
pub fn two_values(pair: &Pair, focal_px: f64) -> String {
    let [a, b] = &pair.remedies;
    let pictures = pair.pictures;
    if !pair.is_told_apart() {
        let which = inseparable([a.suspect, b.suspect], pair.correlation);
        return format!("no single value explains the {pictures} pictures, and two do, but {which}");
    }
    let words = |r: &Remedy| match r.suspect {
        Suspect::Focal => {
            let [px, by] = [r.correction, r.sigma].map(|x| x * focal_px);
            format!("the focal length is {px:.1} ± {by:.1} px")
        }
        other => {
            let side = if r.correction > 0.0 { "low" } else { "high" };
            format!("the {} is {:.1} ± {:.1} km too {side}", other.name(), r.correction.abs(), r.sigma)
        }
    };
    format!("no single value explains the {pictures} pictures, but two do: {}, and {}", words(a), words(b))
}

/// Says that the pictures do not tell two values apart, and why.
pub fn inseparable([a, b]: [Suspect; 2], correlation: f64) -> String {
    let (a, b) = (a.name(), b.name());
    format!("{a} and {b} cannot be told apart (correlation {correlation:.2}): check the one that you know least")
}

/// Says which values would explain the half-angles of all answers. `altitude_km` is the median of those that the
/// pictures were processed with; `width` and `camera` are those of the pictures.
pub fn contradiction(
    found: &[Contradiction],
    altitude_km: Option<f64>,
    camera: &Camera<f64>,
    width: u16,
) -> Option<String> {
    let sigmas = found.first()?.sigmas;
    let one = |found: &Contradiction| {
        Some(match found.fault {
            Fault::Altitude => {
                format!("an altitude of {:.0} km instead of {:.0} km", altitude_km? + found.size, altitude_km?)
            }
            Fault::FieldOfView => {
                let [right, told] = [found.size.exp(), 1.0].map(|factor| field_of_view_deg(camera, width, factor));
                format!("a field of view of {:.1} deg instead of {:.1} deg", right?, told?)
            }
            Fault::Aspect => format!(
                "a ratio fx_px/fy_px that is {:.2} times as large, as in pictures that were scaled to another shape",
                found.size.exp()
            ),
        })
    };
    let each: Vec<String> = found.iter().filter_map(one).collect();
    (!each.is_empty()).then(|| {
        format!("their half-angles together are {sigmas:.1} sigma off. What would explain them: {}", each.join("; or "))
    })
}

/// Returns the field of view over the width of the picture in degrees if both focal lengths are multiplied by `factor`;
/// `None` if the lens does not reach to the edges of the picture.
fn field_of_view_deg(camera: &Camera<f64>, width: u16, factor: f64) -> Option<f64> {
    let centre = camera.principal_point();
    // The edge of a picture is half a pixel beyond the centre of its last column.
    let edges = [-0.5, f64::from(width) - 0.5];
    let [left, right] = edges.map(|u| {
        let at = ImagePoint { u: centre.u + (u - centre.u) / factor, v: centre.v };
        let [x, _, z] = camera.unproject(at)?.xyz();
        Some(x.atan2(z).to_degrees())
    });
    Some(right? - left?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_values_are_named_only_if_they_are_told_apart() {
        let remedy = |suspect, correction, sigma| Remedy { suspect, correction, sigma };
        let remedies = [remedy(Suspect::Altitude, 20.25, 1.1), remedy(Suspect::Focal, 1.02, 0.002)];
        let apart = two_values(&Pair { remedies, correlation: -0.4, pictures: 9 }, 800.0);
        assert!(apart.ends_with("the altitude is 20.2 ± 1.1 km too low, and the focal length is 816.0 ± 1.6 px"));
        let alike = two_values(&Pair { remedies, correlation: 0.98, pictures: 9 }, 800.0);
        assert!(alike.contains("altitude and focal length cannot be told apart (correlation 0.98)"), "{alike}");
        assert!(!alike.contains("20.2"), "{alike}");
    }
}
