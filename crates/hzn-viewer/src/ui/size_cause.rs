//! A possible cause of a limb of another size, in words, with its cure.

use hzn_core::Config;
use hzn_core::body::Kind;
use hzn_core::camera::Intrinsic;

use crate::model::diagnosis::{Consensus, FitFacts, Suspect};

/// A change of the sensor.toml that cures a cause: keys of one step with their values.
pub(super) type Cure = Vec<(&'static str, &'static str, f64)>;

/// Heights at which cameras see the limb of the Earth, in km: from the ground, in the near infrared, to the band of
/// carbon dioxide and the haze in the blue, with a margin. Airglow at 90 km is not the limb.
const EARTH_LIMB_KM: core::ops::RangeInclusive<f64> = -5.0..=65.0;

/// Sigma of the focal length from which the lens is a guess, as a part of it. Calibrations are ten times as good, and
/// `hzn init` writes about 0.06.
const GUESSED: f64 = 0.02;

/// Returns the 1-sigma of the focal length as a part of it, if the lens is only a guess.
pub(super) fn guessed_lens(config: &Config) -> Option<f64> {
    let covariance = config.camera.covariance.as_ref()?;
    let place = covariance.order.iter().position(|i| *i == Intrinsic::FxPx)?;
    let variance = covariance.rows.get(place)?.get(place)?;
    Some(variance.max(0.0).sqrt() / config.camera.fx_px.abs()).filter(|part| *part > GUESSED)
}

/// Returns false for a limb height at which no camera sees the limb of the Earth.
pub(super) fn is_plausible(c: &Consensus, config: &Config, body: usize) -> bool {
    let bodies = config.each_body();
    let is_earth =
        bodies.get(body).or(bodies.first()).is_some_and(|b| matches!(b.kind, Kind::Earth | Kind::EarthSphere));
    c.suspect != Suspect::LimbHeight || !is_earth || EARTH_LIMB_KM.contains(&c.value)
}

/// One possible cause in words, with its cure.
pub(super) struct Cause {
    pub(super) suspect: Suspect,
    pub(super) now: String,
    pub(super) here: String,
    pub(super) all: String,
    pub(super) cure: Cure,
    /// Shift of the altitudes of all frames.
    pub(super) shift_km: Option<f64>,
    /// Reason why the value cannot be used.
    pub(super) impossible: Option<String>,
}

impl Cause {
    /// Describes a cause. `fit` is that of the shown picture, if it has one, and `all` is what all pictures say.
    pub(super) fn new(
        suspect: Suspect,
        fit: &FitFacts,
        is_here: bool,
        all: Option<&Consensus>,
        config: &Config,
        body: usize,
    ) -> Option<Self> {
        let here = fit.implied(suspect).filter(|_| is_here);
        // A frame may say nothing about a quantity that all frames together decide.
        let value = all.map(|c| c.value).or(here.map(|here| here.value));
        let Some(value) = value else {
            return (suspect == Suspect::Focal && guessed_lens(config).is_some()).then(|| Self::without_value(config));
        };
        let bodies = config.each_body();
        let limb_height_km = bodies.get(body).or(bodies.first())?.limb_height_km;
        let altitude_km = bodies.get(body).or(bodies.first())?.altitude_km;
        let words = Words { here: here.map(|h| (h.value, fit.total_sigma(suspect).unwrap_or(h.sigma))), all };
        let mut cause = match suspect {
            Suspect::Altitude => Self::altitude(fit, &words, value, altitude_km)?,
            Suspect::Focal => Self::focal(&words, value, config),
            Suspect::LimbHeight => Self::limb_height(&words, value, limb_height_km),
        };
        let is_wrong = suspect == Suspect::LimbHeight && all.is_some_and(|c| !is_plausible(c, config, body));
        if is_wrong && cause.impossible.is_none() {
            cause.impossible =
                Some("The limb of the Earth lies between the ground and 65 km, so another value is wrong".into());
        }
        if cause.impossible.is_none() && cause.is_now(config, limb_height_km) {
            cause.impossible = Some("This is the value now".into());
        }
        Some(cause)
    }

    fn altitude(fit: &FitFacts, words: &Words<'_>, value: f64, altitude_km: Option<f64>) -> Option<Self> {
        let given = fit.given_altitude_km?;
        Some(Self {
            suspect: Suspect::Altitude,
            now: format!("{given:.1} km"),
            here: words.here(&|value, sigma| format!("{} km", with_sigma(given + value, sigma))),
            // The frames have different altitudes, so only the shift is common to them.
            all: words.all(&|value, sigma| format!("Δ {:+.1} ± {} km", value, digits(sigma))),
            cure: vec![("body", "altitude_km", altitude_km.unwrap_or(given) + value)],
            shift_km: Some(value),
            impossible: (given + value <= 0.0).then(|| "This altitude is below the ground".into()),
        })
    }

    fn focal(words: &Words<'_>, value: f64, config: &Config) -> Self {
        let camera = &config.camera;
        let in_words = |factor: f64, by: f64| format!("{} px", with_sigma(camera.fx_px * factor, camera.fx_px * by));
        Self {
            suspect: Suspect::Focal,
            now: format!("fx {:.1} px", camera.fx_px),
            here: words.here(&in_words),
            all: words.all(&in_words),
            cure: vec![("camera", "fx_px", camera.fx_px * value), ("camera", "fy_px", camera.fy_px * value)],
            shift_km: None,
            impossible: None,
        }
    }

    fn limb_height(words: &Words<'_>, value: f64, now_km: f64) -> Self {
        let in_words = |value: f64, sigma: f64| format!("{} km", with_sigma(value, sigma));
        let is_possible = (-50.0..=500.0).contains(&value);
        Self {
            suspect: Suspect::LimbHeight,
            now: format!("{now_km:.1} km"),
            here: words.here(&in_words),
            all: words.all(&in_words),
            cure: vec![("body", "limb_height_km", value)],
            shift_km: None,
            impossible: (!is_possible).then(|| "No limb is this high: sensor.toml allows −50 to 500 km".into()),
        }
    }

    /// Returns the row of a focal length that is only guessed, and for which no picture says a value.
    fn without_value(config: &Config) -> Self {
        Self {
            suspect: Suspect::Focal,
            now: format!("fx {:.1} px", config.camera.fx_px),
            here: "none found".into(),
            all: String::new(),
            cure: Vec::new(),
            shift_km: None,
            impossible: Some(
                "No focal length from 0.3 to 3 times this one makes the half-angles equal, so the edge may not be \
                 the limb"
                    .into(),
            ),
        }
    }

    /// Returns whether the values of the cure are those of now, to as many digits as the table shows.
    fn is_now(&self, config: &Config, limb_height_km: f64) -> bool {
        self.cure.iter().all(|(_, name, x)| {
            let now = match *name {
                "fx_px" => config.camera.fx_px,
                "fy_px" => config.camera.fy_px,
                "limb_height_km" => limb_height_km,
                _ => return false,
            };
            (now - x).abs() < 0.05
        })
    }
}

/// What a quantity would have to be: in the shown picture with its sigma, and in all pictures.
struct Words<'a> {
    here: Option<(f64, f64)>,
    all: Option<&'a Consensus>,
}

impl Words<'_> {
    /// Returns what the shown picture says.
    fn here(&self, words: &dyn Fn(f64, f64) -> String) -> String {
        self.here.map_or_else(|| "–".to_owned(), |(value, sigma)| words(value, sigma))
    }
    /// Returns what all pictures say.
    fn all(&self, words: &dyn Fn(f64, f64) -> String) -> String {
        self.all.map(|c| words(c.value, c.sigma)).unwrap_or_default()
    }
}

/// Returns a sigma with one digit behind the point, or with as many that it is not zero.
fn digits(sigma: f64) -> String {
    let digits = if sigma > 0.0 { (-sigma.log10().floor()).clamp(1.0, 6.0) as usize } else { 1 };
    format!("{sigma:.digits$}")
}

fn with_sigma(value: f64, sigma: f64) -> String {
    format!("{value:.1} ± {}", digits(sigma))
}
