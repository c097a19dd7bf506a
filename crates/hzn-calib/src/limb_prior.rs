//! The limb height as it is known before a flight, and the heights that are possible.

use hzn_core::body::{self, Kind};

/// Largest difference between a flight and what was known before, in sigmas. One right flight in a hundred has a larger
/// one, because the normal distribution has 1 % outside of ± 2.58.
pub(crate) const TWO_SIDED: f64 = 2.58;
/// Sigmas of a limb height that nobody measured within which the limb of a body is looked for.
const RANGE: f64 = 3.0;

/// The limb height as it is known before the flight.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LimbPrior {
    /// Height in kilometres.
    pub km: f64,
    /// 1-sigma in kilometres; infinite if the height is not known.
    pub sigma_km: f64,
}

impl LimbPrior {
    /// Returns the limb height of a sensor as a prior, or one that is not known with `free`; `None` if the sensor looks
    /// only for Sun and Moon. The error of the altitude moves the limb by the same amount.
    pub fn of_sensor(sensor: &hzn_core::Config, free: bool) -> Option<Self> {
        let body = sensor.each_body().iter().find(|b| !b.half_angle_is_free())?;
        let rows = &body.limb_height_by_latitude_km;
        let heights = || rows.iter().map(|[_, km]| *km);
        let (km, spread_km) = if rows.is_empty() {
            (body.limb_height_km, 0.0)
        } else {
            let [low, high] = [heights().fold(f64::INFINITY, f64::min), heights().fold(f64::NEG_INFINITY, f64::max)];
            (0.5 * (low + high), 0.5 * (high - low))
        };
        let sigma_km = body.limb_height_sigma_km.hypot(spread_km).hypot(body.altitude_sigma_km);
        Some(Self { km, sigma_km: if free { f64::INFINITY } else { sigma_km } })
    }

    /// Returns the lowest and the highest limb height that are possible, in kilometres: those of the body without a
    /// measurement, and those that are told.
    pub(crate) fn possible_km(self, body: &body::Config) -> [f64; 2] {
        let own = unmeasured(body);
        // The prior has the error of the altitude as well.
        let told = [self.km, if self.sigma_km.is_finite() { self.sigma_km } else { 0.0 }];
        let all = [own, told].into_iter();
        let low = all.clone().map(|[km, sigma]| km - RANGE * sigma).fold(f64::INFINITY, f64::min);
        [low, all.map(|[km, sigma]| km + RANGE * sigma).fold(f64::NEG_INFINITY, f64::max)]
    }
}

/// Returns whether the limb of a body lies above its surface, as air makes it. Nothing is known of a body that is given
/// by its radii alone.
pub(crate) fn has_air(body: &body::Config) -> bool {
    let [km, sigma_km] = unmeasured(body);
    !matches!(body.kind, Kind::Sphere | Kind::Ellipsoid) && km > sigma_km
}

/// Returns the limb height and its 1-sigma that a sensor assumes for a body, in kilometres.
pub(crate) fn unmeasured(body: &body::Config) -> [f64; 2] {
    let unmeasured = body::Config::of_kind(body.kind, body.radii_km);
    [unmeasured.limb_height_km, unmeasured.limb_height_sigma_km]
}
