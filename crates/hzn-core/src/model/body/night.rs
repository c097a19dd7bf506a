//! Night: the Sun lights no part of the limb, and the layer of airglow is a limb of its own.
//!
//! The layer is a Chapman layer, exp(1 − z − e^−z) with z = (h − p)/H: its peak p is from 85 to 105 km, and its
//! thickness H from 3 to 12 km. Above the peak its light falls with height. Where the fraction l of the largest light
//! is left, along lines of sight through the layer, the edge is H (0.94 + 1.20 ln(0.5/l)) above the peak.

use super::{Config, Kind, Limb, Night};
use crate::base::error::{ConfigError, Limit, require};

/// Mean and 1-sigma of the height of the peak: evenly distributed from 85 to 105 km.
const PEAK_KM: [f64; 2] = [95.0, 5.77];
/// Mean and 1-sigma of the thickness: evenly distributed from 3 to 12 km.
const THICKNESS_KM: [f64; 2] = [7.5, 2.6];
/// Height of the edge above the peak in thicknesses, at half of the light, and its change with the logarithm of the
/// light. The test of this module computes both.
const EDGE: [f64; 2] = [0.94, 1.20];
/// Returns the height of the edge of the layer and its 1-sigma, kilometres, where this part of the light is left.
fn edge_km(light: f64) -> [f64; 2] {
    let above = EDGE[0] + EDGE[1] * libm::log(0.5 / light);
    [PEAK_KM[0] + THICKNESS_KM[0] * above, libm::hypot(PEAK_KM[1], THICKNESS_KM[1] * above)]
}

impl Config {
    /// Sets the height of the edge of the airglow, and its sigma, to those where this part of the light is left, each
    /// if it is still the default, if the sensor searches for it.
    pub(super) fn follow_tone_at_night(&mut self, light: f64) {
        if self.night != Night::Airglow {
            return;
        }
        let [height, sigma] = edge_km(light);
        let default = Self::default();
        if self.airglow_height_km == default.airglow_height_km {
            self.airglow_height_km = height;
        }
        if self.airglow_height_sigma_km == default.airglow_height_sigma_km {
            self.airglow_height_sigma_km = sigma;
        }
    }

    /// Returns the body whose limb is the edge of the layer of airglow.
    // Overexposure moves this edge as it moves that of the air: the mean thickness is the scale height of the air.
    pub(super) fn with_airglow(&self) -> Self {
        Self {
            night: Night::Refuse,
            limb: Limb::Height,
            limb_height_km: self.airglow_height_km,
            limb_height_sigma_km: self.airglow_height_sigma_km,
            limb_height_by_latitude_km: heapless::Vec::new(),
            sunlit: Some(false),
            ..self.clone()
        }
    }

    /// Refuses the airglow of a body that has none, or that is not seen in sunlight by day.
    pub(super) fn check_night(&self) -> Result<(), ConfigError> {
        let is_earth = matches!(self.kind, Kind::Earth | Kind::EarthSphere);
        let rule = "airglow is for the Earth in visible light: remove night, or sunlit = false and a thermal limb";
        let is_possible = self.night == Night::Refuse || is_earth && self.is_seen_in_sunlight();
        require(is_possible, "body.night", f64::NAN, Limit::Rule(rule))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::body::{Expected, Prior};
    use crate::model::tone::Tone;

    /// Height of the edge and its sigma for an unknown tone, as the keys have it.
    const UNKNOWN_TONE_KM: [f64; 2] = [106.0, 8.0];

    /// Returns the height above its peak, in thicknesses, at which a Chapman layer has this part of its largest light.
    fn edge(peak_km: f64, thick_km: f64, part: f64) -> f64 {
        let light = |tangent_km: f64| -> f64 {
            // The integral of the emission along half of the line of sight, in steps of the distance.
            (0..4000).fold(0.0, |sum, i| {
                let along_km = (f64::from(i) + 0.5) * 0.5;
                let height_km = (6371.0 + tangent_km).hypot(along_km) - 6371.0;
                let z = (height_km - peak_km) / thick_km;
                sum + (1.0 - z - (-z).exp()).exp()
            })
        };
        let at = |i: i32| peak_km + f64::from(i) * 0.05 * thick_km;
        let most = (-40..20).map(|i| light(at(i))).fold(0.0, f64::max);
        let last = (0..200).find(|&i| light(at(i)) < part * most).unwrap();
        f64::from(last) * 0.05
    }

    #[test]
    fn the_edge_of_drawn_layers_is_where_the_constants_put_it() {
        for (peak, thick) in [(85.0, 3.0), (95.0, 7.5), (105.0, 12.0), (90.0, 10.0)] {
            for tone in [Tone::Linear, Tone::Srgb, Tone::Gamma(2.0)] {
                let light = tone.light_at_half().unwrap();
                let constants = EDGE[0] + EDGE[1] * (0.5 / light).ln();
                let layer = edge(peak, thick, light);
                assert!((layer - constants).abs() < 0.15, "{peak} {thick} {tone}: {layer} {constants}");
            }
        }
        let [linear, srgb] = [Tone::Linear, Tone::Srgb].map(|tone| edge_km(tone.light_at_half().unwrap()));
        let near = |[a, b]: [f64; 2], [c, d]: [f64; 2]| (a - c).abs() < 0.5 && (b - d).abs() < 0.1;
        assert!(near(linear, [102.0, 6.3]) && near(srgb, [109.7, 7.7]), "{linear:?} {srgb:?}");
        let mean = 0.5 * (linear[0] + srgb[0]);
        let square = 0.5 * (linear[1].powi(2) + srgb[1].powi(2)) + (0.5 * (srgb[0] - linear[0])).powi(2);
        assert!(near([mean, square.sqrt()], UNKNOWN_TONE_KM), "{mean} {square}");
        let even = |low: f64, high: f64| [(low + high) * 0.5, (high - low) / 12f64.sqrt()];
        assert!(near(even(85.0, 105.0), PEAK_KM) && near(even(3.0, 12.0), THICKNESS_KM));
    }

    #[test]
    fn only_a_known_night_has_the_airglow() {
        let body = Config { night: Night::Airglow, ..Config::default() };
        assert_eq!(body.check(), Ok(()));
        let prior = |deg: Option<f64>| Prior {
            altitude_m: Some(400e3),
            sun_elevation_rad: deg.map(f64::to_radians),
            ..Prior::default()
        };
        let expect = |body: &Config, deg| Expected::<f64>::new(body, &prior(deg)).unwrap();
        // The dip of the horizon at 400 km is 19.7°.
        for (deg, is_airglow) in [(None, false), (Some(30.0), false), (Some(-37.0), false), (Some(-38.5), true)] {
            let expected = expect(&body, deg);
            assert_eq!((expected.is_airglow, expected.limb_m == 106e3), (is_airglow, is_airglow), "{deg:?}");
        }
        assert!(!expect(&Config::default(), Some(-80.0)).is_airglow);
        // A camera in the layer has no limb.
        let inside = Prior { altitude_m: Some(100e3), ..prior(Some(-80.0)) };
        assert!(Expected::<f64>::new(&body, &inside).is_err());
        let refused = [Config { kind: Kind::Moon, ..body.clone() }, Config { sunlit: Some(false), ..body.clone() }];
        assert!(refused.iter().all(|body| body.check().is_err()));
    }

    #[test]
    fn a_height_that_was_set_stays() {
        let height = |mut body: Config, tone| {
            body.follow_tone(tone, 0.5);
            [body.airglow_height_km, body.airglow_height_sigma_km]
        };
        let night = Config { night: Night::Airglow, ..Config::default() };
        assert_eq!(height(Config::default(), Tone::Srgb), UNKNOWN_TONE_KM);
        assert_eq!(height(night.clone(), Tone::Unknown), UNKNOWN_TONE_KM);
        assert_eq!(height(night.clone(), Tone::Srgb), edge_km(0.5));
        let told = Config { airglow_height_km: 98.0, airglow_height_sigma_km: 3.0, ..night };
        assert_eq!(height(told, Tone::Srgb), [98.0, 3.0]);
    }
}
