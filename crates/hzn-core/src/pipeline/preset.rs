//! Named starting values.

use crate::body::Kind;
use crate::pipeline::Config;
use crate::{binarize, camera, covariance};

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
    /// The optical horizon sensor of Braun & Barf 2022.
    #[cfg(feature = "dlr")]
    Dlr2022,
    /// The infrared Earth sensor of Wang et al. 2022.
    #[cfg(feature = "zju")]
    Zju2022,
    /// HORACE on REXUS-16 (Barf 2014, Barf et al. 2015).
    #[cfg(feature = "horace")]
    Horace2015,
}

impl Preset {
    /// Every preset of this build.
    pub const ALL: &[Self] = &[
        Self::Hzn,
        Self::Sun,
        Self::Moon,
        #[cfg(feature = "dlr")]
        Self::Dlr2022,
        #[cfg(feature = "zju")]
        Self::Zju2022,
        #[cfg(feature = "horace")]
        Self::Horace2015,
    ];

    /// The name used in files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Hzn => "hzn",
            Self::Sun => "sun",
            Self::Moon => "moon",
            #[cfg(feature = "dlr")]
            Self::Dlr2022 => "dlr-2022",
            #[cfg(feature = "zju")]
            Self::Zju2022 => "zju-2022",
            #[cfg(feature = "horace")]
            Self::Horace2015 => "horace-2015",
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
            // It saturates any camera that was not made for it; the sky beside it does not.
            Preset::Sun => disc(&mut config, Kind::Sun, binarize::SUN.level),
            Preset::Moon => {
                disc(&mut config, Kind::Moon, 0.25);
                // Half of its limb is lit at most, and less of it bright.
                config.select.min_support = 0.25;
            }
            #[cfg(feature = "dlr")]
            Preset::Dlr2022 => dlr_2022(&mut config),
            #[cfg(feature = "zju")]
            Preset::Zju2022 => zju_2022(&mut config),
            #[cfg(feature = "horace")]
            Preset::Horace2015 => horace_2015(&mut config),
        }
        config
    }
}

/// A disc with a level (fraction of full scale) that it stands above: its histogram is nearly all sky. The edge of a
/// blooming disc stands within 3 px, alike all around (Braun & Barf 2022, section 5).
fn disc(config: &mut Config, kind: Kind, level: f64) {
    config.body.kind = kind;
    config.binarize = binarize::Config { method: binarize::Method::Fixed, level, ..config.binarize };
    config.covariance = covariance::Config { sigma_px: 3.0, correlation_px: 300.0, bias_px: 0.0, ..config.covariance };
}

/// The noise model and limb height that the published systems' presets have always had: told values, for comparison.
#[cfg(any(feature = "dlr", feature = "horace", feature = "zju"))]
fn told(config: &mut Config) {
    config.body.limb_height_km = 10.0;
    config.body.limb_height_sigma_km = 2.0;
    [config.body.clipped_height_km, config.body.clipped_sigma_km] = [0.0; 2];
    config.covariance = covariance::Config::told(1.0, 300.0);
    config.reject.noise_sigma = 0.0;
}

/// Braun & Barf 2022 as flown on ATEK: fixed threshold, whole pixels, RANSAC on three points, the direct nadir, the
/// overbound of its covariance, and none of the gates that came with `hzn`.
#[cfg(feature = "dlr")]
fn dlr_2022(config: &mut Config) {
    use crate::{candidates, estimate, reject};
    told(config);
    config.binarize.method = binarize::Method::Fixed;
    config.candidates.sub_pixel = candidates::SubPixel::None;
    config.candidates.keep_points = 0;
    config.reject.method = reject::Method::Ransac;
    config.estimate.method = estimate::Method::Direct;
    config.estimate.half_angle = estimate::HalfAngle::Free;
    config.covariance.method = covariance::Method::BraunBarf;
    config.covariance.overbound = true;
    ungated(config);
    config.select.limb_in_view = true;
    // Section 7.3, for the Earth. Ours is the mean and not the sum, in focal lengths squared.
    config.select.max_section_residual = Some(0.025);
}

/// Wang et al. 2022 as flown on Tianping-2B: Zernike moments on every Sobel edge pixel, RANSAC with pre-verification,
/// an elliptic cone by total least squares, weighed where the limb leaves the picture, and no gates.
///
/// Their threshold is 1°, which is 1.6 px with their lens (384×288, 92 px/rad); for another it is to be set.
#[cfg(feature = "zju")]
fn zju_2022(config: &mut Config) {
    use crate::{candidates, contour, estimate, reject};
    told(config);
    config.contour.method = contour::Method::Sobel;
    config.candidates.sub_pixel = candidates::SubPixel::Zernike;
    config.candidates.keep_points = 0;
    config.reject.method = reject::Method::RansacPreverify;
    config.reject.threshold_px = 1.6;
    config.reject.max_draws = 20_000;
    config.estimate.method = estimate::Method::Wtls;
    config.estimate.weigh_above_deg = 60.0;
    config.estimate.half_angle = estimate::HalfAngle::Free;
    ungated(config);
}

/// HORACE: brightness gate, dynamic threshold, a smaller copy, outer borders of the whole picture, a circle through each,
/// the radius check, and halves of the picture where that gives nothing.
///
/// Its own numbers: 0.75 times the mean; the limb's radius from 100 to 20 km, give or take 5000 px of its picture of 768
/// rows; a pixel that at most γ = 5 of its eight neighbours light is edge, for whom chooses `erode` (counted here with
/// the pixel itself, and from 0: fewer than 7). Ours: the copy's height, the brightness gate, the shortest edge.
#[cfg(feature = "horace")]
fn horace_2015(config: &mut Config) {
    use crate::{candidates, contour, estimate, recover, reject};
    told(config);
    config.gate.min_mean = 0.02;
    config.gate.max_mean = 0.9;
    config.binarize.method = binarize::Method::Dynamic;
    config.binarize.factor = 0.75;
    // Lengths are in pixels of the copy.
    let rows = config.camera.height.min(HORACE_ROWS);
    config.input.scale_to_height = (rows < config.camera.height).then_some(rows);
    config.contour.method = contour::Method::Raster;
    config.contour.erode_threshold = 7;
    config.candidates.sub_pixel = candidates::SubPixel::None;
    config.candidates.min_points = 100;
    config.candidates.keep_points = 0;
    config.reject.method = reject::Method::None;
    config.estimate.method = estimate::Method::Circle;
    config.estimate.half_angle = estimate::HalfAngle::Free;
    config.recover.method = recover::Method::Division;
    ungated(config);
    config.select.altitude_limits_km = Some([20.0, 100.0]);
    config.select.radius_margin = 0.0;
    config.select.radius_margin_px = 5000.0 * f64::from(rows) / 768.0;
}

/// Rows of the copy that `horace-2015` looks at.
#[cfg(feature = "horace")]
const HORACE_ROWS: u16 = 240;

/// Only what every fit must have, and what these methods cost, of which some look at every pixel and every point.
#[cfg(any(feature = "dlr", feature = "horace", feature = "zju"))]
fn ungated(config: &mut Config) {
    config.limits.max_work = Some(200_000_000);
    // They looked once.
    config.recover.levels.clear();
    config.recover.frame_px = 0;
    config.select.min_arc_px = Some(0.0);
    config.select.max_rms_px = 1e6;
    config.select.max_half_angle_sigma = 1e6;
    config.select.max_sigma_deg = 180.0;
    config.select.min_support = 0.0;
    config.select.max_lit_sky = 1.0;
    config.select.trust_every_shape();
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

    #[test]
    #[cfg(all(feature = "dlr", feature = "horace", feature = "zju"))]
    fn published_systems_keep_their_noise_and_limb() {
        for preset in [Preset::Dlr2022, Preset::Zju2022, Preset::Horace2015] {
            let config = Config::preset(preset, camera::Config::ideal(Model::Pinhole, 64, 48, 60.0));
            let covariance::Config { noise, sigma_px, correlation_px, bias_px, tilt_px, .. } = config.covariance;
            assert_eq!(noise, covariance::Noise::Told);
            assert_eq!([sigma_px, correlation_px, bias_px, tilt_px], [1.0, 300.0, 0.0, 0.0]);
            assert_eq!([config.body.limb_height_km, config.body.limb_height_sigma_km], [10.0, 2.0]);
            let braun_barf = config.covariance.method == covariance::Method::BraunBarf;
            assert_eq!(braun_barf, preset == Preset::Dlr2022);
        }
    }
}
