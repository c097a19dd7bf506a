//! The expected height of the limb in words.

use hzn_core::body::{self, Limb};
use hzn_core::config::Input;

/// Describes the height of the limb, its sigma, and what they follow from, for a camera at this altitude.
pub(crate) fn limb_in_words(body: &body::Config, input: &Input, altitude_km: f64) -> String {
    // Heights that follow from a tone have more digits than they are worth.
    let [height, sigma] = [body.limb_height_km, body.limb_height_sigma_km].map(|km| (km * 1e3).round() / 1e3);
    let mut words = format!("limb at {height} +- {sigma} km");
    if let Some(tone) = input.tone.filter(|_| body.limb == Limb::Visible) {
        words += &format!(" in pictures of tone {tone}");
    }
    if body.limb.thermal_km().is_some() {
        words += &format!(", the mean of the band {}", body.limb.name());
    }
    let raised_km = body.raised_by_air_km(altitude_km);
    if raised_km >= 0.005 {
        words += &format!(", raised by {raised_km:.2} km, because the air below the camera bends light");
    }
    words
}

#[cfg(test)]
mod tests {
    use hzn_core::tone::Tone;

    use super::*;

    #[test]
    fn tone_and_air_are_named_where_they_count() {
        let mut body = body::Config::default();
        assert_eq!(limb_in_words(&body, &Input::default(), 400.0), "limb at 17 +- 7 km");
        let input = Input { tone: Some(Tone::Srgb), ..Input::default() };
        body.follow_tone(Tone::Srgb);
        assert_eq!(limb_in_words(&body, &input, 400.0), "limb at 23.363 +- 7 km in pictures of tone srgb");
        let mut thermal = body::Config { limb: Limb::Window, ..body::Config::default() };
        thermal.follow_band();
        let words = limb_in_words(&thermal, &input, 400.0);
        assert_eq!(words, "limb at 12 +- 7 km, the mean of the band window-8-14um");
        body = body::Config { limb: Limb::Height, limb_height_km: 0.0, ..body };
        let balloon = limb_in_words(&body, &input, 30.0);
        assert!(balloon.starts_with("limb at 0 +- 7 km, raised by 1.7"), "{balloon}");
    }
}
