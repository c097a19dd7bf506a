//! Named starting values.

use crate::body::Kind;
use crate::camera;
use crate::pipeline::Config;

/// Starting values of a whole sensor: what is written besides beats them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Preset {
    /// The best chain that is known: every value at its default.
    #[default]
    Hzn,
    /// The Sun: a disc whose apparent size is no measure, because it blooms.
    Sun,
    /// The Moon, lit from any side.
    Moon,
}

impl Preset {
    /// Every preset of this build.
    pub const ALL: &[Self] = &[Self::Hzn, Self::Sun, Self::Moon];

    /// The name used in files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Hzn => "hzn",
            Self::Sun => "sun",
            Self::Moon => "moon",
        }
    }

    /// The preset of that name.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|p| p.name() == name)
    }
}

impl Config {
    /// A sensor with this camera and every other value as the preset has it.
    pub fn preset(preset: Preset, camera: camera::Config) -> Self {
        let mut config = Self::new(camera);
        match preset {
            Preset::Hzn => {}
            Preset::Sun => disc(&mut config, Kind::Sun),
            Preset::Moon => disc(&mut config, Kind::Moon),
        }
        config
    }
}

/// Braun & Barf 2022, section 5: the edge of a blooming disc stands within 3 px, alike all around.
fn disc(config: &mut Config, kind: Kind) {
    config.body.kind = kind;
    config.body.limb_height_km = 0.0;
    config.body.limb_height_sigma_km = 0.0;
    config.covariance.sigma_px = 3.0;
    config.covariance.correlation_px = 300.0;
    // A disc at arm's length of the whole sky is a few pixels around.
    config.candidates.min_points = 8;
    config.select.min_inliers = 8;
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::Model;

    #[test]
    fn every_preset_is_accepted_and_found_by_its_name() {
        for &preset in Preset::ALL {
            let config = Config::preset(preset, camera::Config::ideal(Model::Pinhole, 64, 48, 60.0));
            assert_eq!(config.check(), Ok(()), "{}", preset.name());
            assert_eq!(Preset::named(preset.name()), Some(preset));
        }
        assert_eq!(Preset::named("hznn"), None);
    }
}
