//! The height of the visible limb, which depends on what is known of the light at the edge.

use super::{Config, Kind, Limb};
use crate::model::tone::Tone;

/// 1-sigma of the height of the Earth's visible limb in linear pictures, kilometres.
// Two parts are independent. The wavelength: 24 km at 440 nm to 12 km at 650 nm, evenly distributed, which is 3.5 km.
// The light next to the limb: the ground there may be half as bright as the air (a dark sea) or twice as bright
// (cloud), evenly distributed in the logarithm, which moves the edge by 7.5 km ln 4/√12 = 3.0 km. Without a tone, the
// height has the default sigma, 7 km. So it has in every other tone: cameras change the contrast before they encode a
// picture, and no file says how.
const SIGMA_KM: f64 = 4.6;

impl Config {
    /// Sets the height of the visible limb to that in pictures of this tone, if [`Self::limb`] is [`Limb::Visible`] and
    /// if the height is still the default; and the sigma, too, if it is still the default. A height that somebody
    /// measured or set already is that of the pictures. `light` is the part of the light inside the limb at which its
    /// edge is located: a half if the edge is located with the tone, [`Tone::light_at_half`] if it is located in
    /// counts.
    ///
    /// The light of the air falls by a factor of e over its scale height h. At the fraction l of the light the limb
    /// lies h ln(0.5/l) higher than at half of the light. Overexposure follows the same law, and comes on top
    /// unchanged: full scale at 1/B of the light moves both limbs by h ln B.
    pub fn follow_tone(&mut self, tone: Tone, light: f64) {
        if tone == Tone::Unknown {
            return;
        }
        self.follow_tone_at_night(light);
        let scale_height_km = self.scale_height_km();
        let default = Self::of_kind(self.kind, self.radii_km);
        let is_default = self.limb_height_km == default.limb_height_km && self.limb_height_by_latitude_km.is_empty();
        if self.limb != Limb::Visible || !is_default || !(scale_height_km > 0.0) {
            return;
        }
        self.limb_height_km += scale_height_km * libm::log(0.5 / light);
        let is_sigma_default = self.limb_height_sigma_km == default.limb_height_sigma_km;
        if is_sigma_default && tone == Tone::Linear && matches!(self.kind, Kind::Earth | Kind::EarthSphere) {
            self.limb_height_sigma_km = SIGMA_KM;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn height(body: Config, tone: Tone) -> [f64; 2] {
        let mut body = body;
        body.follow_tone(tone, 0.5);
        [body.limb_height_km, body.limb_height_sigma_km]
    }

    /// Returns the same for an edge at half of the counts.
    fn height_at_half_of_counts(mut body: Config, tone: Tone) -> [f64; 2] {
        body.follow_tone(tone, tone.light_at_half().unwrap_or(f64::NAN));
        [body.limb_height_km, body.limb_height_sigma_km]
    }

    #[test]
    fn the_limb_at_half_of_the_light_has_one_height() {
        let earth = Config::default();
        assert_eq!(height(earth.clone(), Tone::Linear), [17.0, 4.6]);
        for tone in [Tone::Unknown, Tone::Srgb, Tone::Bt709, Tone::Gamma(2.2)] {
            assert_eq!(height(earth.clone(), tone), [17.0, 7.0], "{tone}");
        }
    }

    #[test]
    fn the_limb_of_a_photograph_is_higher_at_half_of_its_counts() {
        let height = height_at_half_of_counts;
        let earth = Config::default();
        assert_eq!(height(earth.clone(), Tone::Linear), [17.0, 4.6]);
        assert_eq!(height(earth.clone(), Tone::Unknown), [17.0, 7.0]);
        let [srgb, sigma] = height(earth.clone(), Tone::Srgb);
        assert!((srgb - 23.36).abs() < 0.01 && sigma == 7.0, "{srgb}");
        // Air at half of the counts has the light of the tone: exp(−(d − 17 km)/7.5 km)/2.
        let [bt709, _] = height(earth.clone(), Tone::Bt709);
        assert!((0.5 * libm::exp(-(bt709 - 17.0) / 7.5) - Tone::Bt709.light_at_half().unwrap()).abs() < 1e-12);
        let [jupiter, sigma] = height(Config::of_kind(Kind::Jupiter, None), Tone::Gamma(2.0));
        assert!((jupiter - (80.0 + 27.0 * core::f64::consts::LN_2)).abs() < 1e-9 && sigma == 80.0, "{jupiter}");
    }

    #[test]
    fn a_height_that_was_set_stays() {
        let height = height_at_half_of_counts;
        let told = |limb, km| Config { limb, limb_height_km: km, ..Config::default() };
        assert_eq!(height(told(Limb::Height, 17.0), Tone::Srgb), [17.0, 7.0]);
        assert_eq!(height(told(Limb::Visible, 18.9), Tone::Srgb), [18.9, 7.0]);
        // A sigma alone leaves the height to the tone.
        let narrow = Config { limb_height_sigma_km: 2.0, ..Config::default() };
        assert_eq!(height(narrow.clone(), Tone::Linear), [17.0, 2.0]);
        let [srgb, sigma] = height(narrow, Tone::Srgb);
        assert!((srgb - 23.36).abs() < 0.01 && sigma == 2.0, "{srgb}");
        let rows = Config { limb_height_by_latitude_km: [[0.0, 25.0]].into_iter().collect(), ..Config::default() };
        assert_eq!(height(rows, Tone::Srgb), [17.0, 7.0]);
        // There is no air whose light could fall with height.
        let moon = Config::of_kind(Kind::Charon, None);
        assert_eq!(height(moon.clone(), Tone::Srgb), [moon.limb_height_km, moon.limb_height_sigma_km]);
        let mut twice = Config::default();
        twice.follow_tone(Tone::Srgb, 0.2);
        let once = twice.clone();
        twice.follow_tone(Tone::Srgb, 0.2);
        assert_eq!(twice, once);
    }
}
