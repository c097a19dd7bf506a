//! The expected height of the limb in words.

use hzn_core::body::{self, Limb};
use hzn_core::config::Input;

use crate::engine::ExpectedLimb;

/// Describes the height of the limb, its sigma, and what they follow from, for a camera at this altitude. Without an
/// expected limb the height is that of the configuration.
pub(crate) fn limb_in_words(
    body: &body::Config,
    input: &Input,
    expected: Option<ExpectedLimb>,
    altitude_km: f64,
) -> String {
    let configured = [body.limb_height_km, body.limb_height_sigma_km];
    let used = expected.map_or(configured, |limb| limb.height_and_sigma_km);
    let is_airglow = expected.is_some_and(|limb| limb.is_airglow);
    // Heights that follow from a tone or a table have more digits than they are worth.
    let [height, sigma] = used.map(|km| (km * 1e3).round() / 1e3);
    let what = if is_airglow { "outer edge of the airglow" } else { "limb" };
    let mut words = format!("{what} at {height} +- {sigma} km");
    if let Some(tone) = input.tone.filter(|_| body.limb == Limb::Visible || is_airglow) {
        words += &format!(" in pictures of tone {tone}");
    }
    if let Some([_, sigma_of_all]) = body.limb.thermal_km() {
        let is_selected = sigma < sigma_of_all && body.limb_height_sigma_km == sigma_of_all;
        let from = if is_selected { "at this time and place, from" } else { "the mean of" };
        words += &format!(", {from} the band {}", body.limb.name());
    }
    let raised_km = body.raised_by_air_km(altitude_km);
    if raised_km >= 0.005 {
        words += &format!(", raised by {raised_km:.2} km, because the air below the camera bends light");
        if let Some(wider_deg) = widened_deg(body, [height, altitude_km], raised_km) {
            words += &format!(
                " (half-angle + {wider_deg:.2} deg; without this, altitude_est_km would be {raised_km:.1} km too low)"
            );
        }
    }
    words
}

/// Returns how much wider the cone of the limb is because the limb appears raised. `None` for a camera below the limb.
fn widened_deg(body: &body::Config, [limb_km, altitude_km]: [f64; 2], raised_km: f64) -> Option<f64> {
    let radius_km = body.mean_radius_km();
    let half_angle = |limb_km: f64| ((radius_km + limb_km) / (radius_km + altitude_km)).asin();
    let wider_deg = (half_angle(limb_km + raised_km) - half_angle(limb_km)).to_degrees();
    wider_deg.is_finite().then_some(wider_deg)
}

#[cfg(test)]
mod tests {
    use hzn_core::tone::Tone;

    use super::*;

    #[test]
    fn tone_and_air_are_named_where_they_count() {
        let mut body = body::Config::default();
        assert_eq!(limb_in_words(&body, &Input::default(), None, 400.0), "limb at 17 +- 7 km");
        let input = Input { tone: Some(Tone::Srgb), ..Input::default() };
        body.follow_tone(Tone::Srgb, 0.214);
        assert_eq!(limb_in_words(&body, &input, None, 400.0), "limb at 23.365 +- 7 km in pictures of tone srgb");
        let mut thermal = body::Config { limb: Limb::Window, ..body::Config::default() };
        thermal.follow_band();
        let words = limb_in_words(&thermal, &input, None, 400.0);
        assert_eq!(words, "limb at 12 +- 7 km, the mean of the band window-8-14um");
        let co2 = body::Config { limb: Limb::Co2, ..body::Config::default() };
        let co2 =
            body::Config { limb_height_km: 40.0, limb_height_sigma_km: Limb::Co2.thermal_km().unwrap()[1], ..co2 };
        let limb = |height_and_sigma_km, is_airglow| {
            Some(ExpectedLimb { half_angle_rad: 1.2, height_and_sigma_km, is_airglow })
        };
        let words = limb_in_words(&co2, &Input::default(), limb([37.2, 2.19], false), 400.0);
        assert_eq!(words, "limb at 37.2 +- 2.19 km, at this time and place, from the band co2-15um");
        let words = limb_in_words(&body, &Input::default(), limb([106.0, 8.0], true), 400.0);
        assert_eq!(words, "outer edge of the airglow at 106 +- 8 km");
        body = body::Config { limb: Limb::Height, limb_height_km: 0.0, ..body };
        let balloon = limb_in_words(&body, &input, None, 30.0);
        assert!(balloon.starts_with("limb at 0 +- 7 km, raised by 1.7"), "{balloon}");
        // 0.16 degrees, as a ray through the U.S. Standard Atmosphere gives.
        let wider = "(half-angle + 0.16 deg; without this, altitude_est_km would be 1.7 km too low)";
        assert!(balloon.ends_with(wider), "{balloon}");
    }
}
