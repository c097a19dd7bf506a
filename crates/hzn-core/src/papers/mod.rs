//! The presets of whole sensors.

mod braun_barf_2022;
mod common;
mod horace;
mod wang_2022;

use crate::base::error::ConfigError;
use crate::base::keys::{Value, choices};
use crate::config::Config;
use crate::geometry::camera;
use crate::model::body::Kind;
use crate::stages::covariance;
use crate::stages::threshold;

choices! {
    /// Starting values of a whole sensor; keys in sensor.toml replace them.
    pub enum Preset {
        /// The best known chain: every value is the default.
        @- Hzn = "hzn";
        /// The Sun: a disc that blooms, so that its apparent size is not a measurement.
        @- Sun = "sun";
        /// The Moon, lit from any side.
        @- Moon = "moon";
        /// The optical horizon sensor of Braun & Barf 2022.
        @- Dlr2022 = "dlr-2022" needs "dlr";
        /// The infrared Earth sensor of Wang et al. 2022.
        @- Zju2022 = "zju-2022" needs "zju";
        /// HORACE on REXUS-16 as in Barf 2014.
        @- Horace2014 = "horace-2014" needs "horace";
        /// HORACE on REXUS-16 as in Barf et al. 2015.
        @- Horace2015 = "horace-2015" needs "horace";
    }
}

impl Preset {
    /// Returns the preset with that name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|p| p.name() == name)
    }

    /// Checks that this build has the methods of the preset.
    ///
    /// # Errors
    /// Returns the feature that is missing.
    pub fn check(self) -> Result<(), ConfigError> {
        Value::check(&self, "preset", 0.0, false, 0.0)
    }
}

impl Config {
    /// Makes a sensor with this camera and every other value from the preset.
    ///
    /// ```
    /// use hzn_core::camera::{self, Model};
    /// use hzn_core::{Config, Preset};
    ///
    /// let preset = Preset::from_name("sun").expect("a preset of this name");
    /// let config = Config::preset(preset, camera::Config::ideal(Model::Pinhole, 640, 480, 500.0));
    /// assert!(config.body.blooms());
    /// ```
    pub fn preset(preset: Preset, camera: camera::Config) -> Self {
        let mut config = Self::new(camera);
        match preset {
            Preset::Hzn => {}
            // The Sun saturates every camera that was not made for it; the sky next to it does not.
            Preset::Sun => set_disc(&mut config, Kind::Sun, threshold::SUN.level),
            Preset::Moon => {
                set_disc(&mut config, Kind::Moon, 0.25);
                // At most half of the Moon's limb is lit, and less than that is bright.
                config.gates.min_support = 0.25;
            }
            Preset::Dlr2022 => braun_barf_2022::preset(&mut config),
            Preset::Zju2022 => wang_2022::preset(&mut config),
            Preset::Horace2014 => horace::preset(&mut config, &horace::IN_2014),
            Preset::Horace2015 => horace::preset(&mut config, &horace::IN_2015),
        }
        config
    }
}

/// Sets a disc with a fixed threshold (fraction of full scale), because its histogram is nearly all sky. The edge of a
/// blooming disc lies within 3 px, by the same amount in all directions (Braun & Barf 2022, section 5).
fn set_disc(config: &mut Config, kind: Kind, level: f64) {
    config.body.kind = kind;
    config.threshold = threshold::Config { method: threshold::Method::Fixed, level, ..config.threshold };
    config.covariance = covariance::Config { sigma_px: 3.0, correlation_px: 300.0, bias_px: 0.0, ..config.covariance };
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::camera::Model;

    #[test]
    fn every_preset_is_accepted_and_found_by_its_name() {
        for &preset in Preset::ALL {
            let config = Config::preset(preset, camera::Config::ideal(Model::Pinhole, 64, 48, 60.0));
            // A build without the preset's methods refuses its configuration.
            assert_eq!(config.check().is_ok(), preset.check().is_ok(), "{}", preset.name());
            assert_eq!(Preset::from_name(preset.name()), Some(preset));
        }
        assert_eq!(Preset::from_name("hznn"), None);
    }

    #[test]
    #[cfg(all(feature = "dlr", feature = "horace", feature = "zju"))]
    fn published_systems_keep_their_noise_and_limb() {
        for preset in [Preset::Dlr2022, Preset::Zju2022, Preset::Horace2014, Preset::Horace2015] {
            let config = Config::preset(preset, camera::Config::ideal(Model::Pinhole, 64, 48, 60.0));
            let covariance::Config { noise, sigma_px, correlation_px, bias_px, tilt_px, .. } = config.covariance;
            assert_eq!(noise, covariance::Noise::Given);
            assert_eq!([sigma_px, correlation_px, bias_px, tilt_px], [1.0, 300.0, 0.0, 0.0]);
            assert_eq!([config.body.limb_height_km, config.body.limb_height_sigma_km], [10.0, 2.0]);
            let braun_barf = config.covariance.method == covariance::Method::BraunBarf;
            assert_eq!(braun_barf, preset == Preset::Dlr2022);
        }
    }
}
