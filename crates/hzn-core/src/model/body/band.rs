//! The height of the limb in the bands of thermal cameras.
//!
//! Three errors of such a height are independent. The *common* part is the same along the whole limb: the filter of the
//! camera and the model. The *weather* moves the limb from place to place, so that a camera sees it as another height,
//! a tilt and a bend. The *climate* counts only if the season or the place of the camera is unknown.

use super::band_table::CO2_HEIGHTS;
use super::{Config, Kind, Limb};
use crate::base::error::{ConfigError, Limit, require};
use crate::base::real::Real;

/// 1-sigma of the height in the band of CO₂ that all of the limb shares, kilometres.
// Two parts are independent. The filter: pass bands from 13.7 to 16.3 µm and from 14.5 to 15.5 µm put the limb 1.7 km
// lower and 2.7 km higher than 14 to 16 µm; evenly distributed, this is 1.3 km. The model: a band that is 10 % stronger
// raises the limb by 0.3 km, 10 % less CO₂ lowers it as much, and a rocket found 44 km where the table has 37 to 42;
// 1 km stands for all of it.
const CO2_COMMON_KM: f64 = 1.6;
/// 1-sigma of the weather, kilometres: that of the heads of a rig, see `limb_own_sigma_km` there.
const WEATHER_KM: f64 = 1.5;
/// 1-sigma of the heights of the table about their mean over all seasons and places.
const CO2_CLIMATE_KM: f64 = 1.1;
/// Mean of the table over months and over the area of the Earth, kilometres.
const CO2_MEAN_KM: f64 = 40.0;
/// Height of the limb from 8 to 14 µm, and its 1-sigma, kilometres.
// No published value was found. The tops of clouds are the limb where there are clouds: the tropopause is at 8 km at
// the poles and at 17 km at the equator. Without them water vapour ends at about 6 km, and ozone shines at 20 to 40 km
// in a sixth of the band. Two sigmas reach from the ground to 26 km.
const WINDOW_KM: [f64; 2] = [12.0, 7.0];
/// Part of this sigma that is weather, 1/√2.
// How much of the 7 km is the same along the whole limb is not known, so that half of the variance is. These 4.9 km are
// more than the 3.2 km of heights that are evenly distributed from clear air (6 km) to the tropopause (17 km), and
// leave room for ozone.
const WINDOW_WEATHER: f64 = core::f64::consts::FRAC_1_SQRT_2;
/// Length of the weather, metres: that of the heads of a rig, see `limb_own_length_km` there.
const WEATHER_LENGTH_M: f64 = 1e6;

/// Returns the part of the year that has passed at a time, 0 to 1, for [`Prior::year_part`](super::Prior::year_part).
/// `days` are counted from the beginning of 1970.
///
/// ```
/// // 1 July 2021.
/// assert!((hzn_core::body::year_part(18_809.0) - 0.4966).abs() < 0.003);
/// ```
pub fn year_part(days: f64) -> f64 {
    // The mean year of the calendar: the part is right to a day, in which the limb moves by 0.05 km at most.
    let years = days / 365.2425;
    years - libm::floor(years)
}

impl Limb {
    /// Returns the mean height and its 1-sigma where neither season nor place is known, kilometres; `None` unless it is
    /// the limb of a thermal band.
    pub fn thermal_km(self) -> Option<[f64; 2]> {
        let squares = [CO2_COMMON_KM, WEATHER_KM, CO2_CLIMATE_KM].map(|s| s * s);
        match self {
            Self::Co2 => Some([CO2_MEAN_KM, libm::sqrt(squares.iter().sum())]),
            Self::Window => Some(WINDOW_KM),
            Self::Visible | Self::Height => None,
        }
    }
}

impl Config {
    /// Takes the limb height and its sigma from the band; nothing if the limb is not that of a thermal band.
    pub fn follow_band(&mut self) {
        if let Some([height, sigma]) = self.limb.thermal_km() {
            (self.limb_height_km, self.limb_height_sigma_km) = (height, sigma);
        }
    }

    /// Sets a limb height and its sigma, in kilometres, that replace those of a band and of the tone. A body that
    /// shines by itself in its band still does.
    pub fn tell_limb_height(&mut self, height_km: f64, sigma_km: f64) {
        if self.limb.thermal_km().is_some() {
            self.sunlit = self.sunlit.or(Some(false));
        }
        self.limb = Limb::Height;
        (self.limb_height_km, self.limb_height_sigma_km) = (height_km, sigma_km);
    }

    /// Refuses a height of its own next to a band.
    pub(super) fn check_band(&self) -> Result<(), ConfigError> {
        let Some([height, _]) = self.limb.thermal_km() else { return Ok(()) };
        let is_earth = matches!(self.kind, Kind::Earth | Kind::EarthSphere);
        let rule = |holds, what| require(holds, "body.limb", f64::NAN, Limit::Rule(what));
        rule(is_earth, "only the Earth has the bands of its air: write limb = \"height\"")?;
        let is_own = self.limb_height_km == height && self.limb_height_by_latitude_km.is_empty();
        rule(is_own, "the band gives the limb height: remove limb_height..._km, or write limb = \"height\"")
    }

    /// Returns whether the limb height depends on the latitude.
    pub(super) fn is_limb_by_latitude(&self) -> bool {
        !self.limb_height_by_latitude_km.is_empty() || (self.limb == Limb::Co2 && self.kind == Kind::Earth)
    }

    /// Returns the 1-sigma of the limb height in kilometres. `is_placed` says whether place and season are known.
    pub(super) fn limb_sigma_km(&self, is_placed: bool) -> f64 {
        let told = self.limb_height_sigma_km;
        // A sigma that somebody told holds always.
        let is_default = self.limb == Limb::Co2 && self.limb.thermal_km().is_some_and(|[_, sigma]| sigma == told);
        if is_default && is_placed { libm::sqrt(CO2_COMMON_KM * CO2_COMMON_KM + WEATHER_KM * WEATHER_KM) } else { told }
    }

    /// Returns the 1-sigma of the weather along the limb of a thermal band, kilometres; 0 for another limb.
    /// [`Self::tilt_sigma_m`] has the climate.
    pub(super) fn weather_km(&self) -> f64 {
        match self.limb {
            Limb::Co2 => WEATHER_KM.min(self.limb_height_sigma_km),
            Limb::Window => WINDOW_WEATHER * self.limb_height_sigma_km,
            Limb::Visible | Limb::Height => 0.0,
        }
    }

    /// Returns the 1-sigma of the mean height along a limb of this radius in metres, and that of the weather, metres.
    pub(super) fn limb_sigmas_m<T: Real>(&self, is_placed: bool, radius_m: T) -> [T; 2] {
        let km = T::from_f64(1000.0);
        let [local, weather] = [self.limb_sigma_km(is_placed), self.weather_km()].map(|sigma| T::from_f64(sigma) * km);
        if !(weather > T::ZERO) {
            return [local, T::ZERO];
        }
        // The sigma is that of the height at one place. What changes along the limb has a term of its own.
        let along = weather * weather * (T::one() - weather_mean_part(weather_kappa(radius_m)));
        [(local * local - along).max(T::ZERO).sqrt(), weather]
    }

    /// Returns the height in kilometres from the table of the band at a geodetic latitude in degrees; the mean over the
    /// year without a season. `None` for a limb without a table.
    pub(super) fn band_height_km(&self, latitude_deg: f64, year_part: Option<f64>) -> Option<f64> {
        if self.limb != Limb::Co2 {
            return None;
        }
        let column = ((latitude_deg + 90.0) / 15.0).clamp(0.0, 12.0);
        let of = |month: &[u16; 13]| between(month, column);
        let Some(part) = year_part else {
            return Some(CO2_HEIGHTS.iter().map(of).sum::<f64>() / CO2_HEIGHTS.len() as f64);
        };
        // The rows are those of the middle of each month, and January follows December.
        let months = (part - libm::floor(part)) * 12.0 + 11.5;
        let before = libm::floor(months);
        let row = |i: usize| CO2_HEIGHTS.get(i % 12).map_or(CO2_MEAN_KM, of);
        let (low, high) = (row(before as usize), row(before as usize + 1));
        Some(low + (high - low) * (months - before))
    }
}

/// Returns the square of the radius of a limb over the length of the weather.
pub(crate) fn weather_kappa<T: Real>(radius_m: T) -> T {
    let lengths = radius_m * T::from_f64(1.0 / WEATHER_LENGTH_M);
    (lengths * lengths).max(T::from_f64(1e-3))
}

/// Returns the part of the variance of the weather that the mean along the whole limb has: exp(−κ) I₀(κ), close to
/// 1/√(2πκ).
pub(super) fn weather_mean_part<T: Real>(kappa: T) -> T {
    T::one() / (kappa * T::from_f64(core::f64::consts::TAU)).max(T::one()).sqrt()
}

/// Returns the height in kilometres at a place between two columns.
fn between(row: &[u16; 13], column: f64) -> f64 {
    let first = (column as usize).min(11);
    let at = |i: usize| row.get(i).map_or(CO2_MEAN_KM, |h| f64::from(*h) * 0.01);
    at(first) + (at(first + 1) - at(first)) * (column - first as f64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::body::{Expected, Prior};

    fn co2() -> Config {
        let mut body = Config { limb: Limb::Co2, ..Config::default() };
        body.follow_band();
        body
    }

    #[test]
    fn the_table_is_the_generated_one() {
        // A changed digit changes the sum; the study writes both.
        let sum: u32 = CO2_HEIGHTS.iter().flatten().enumerate().map(|(i, h)| (i as u32 + 1) * u32::from(*h)).sum();
        assert_eq!(sum, CHECK_SUM);
        assert!(core::mem::size_of_val(&CO2_HEIGHTS) <= 2048);
        // The mean over the area and the spread about it, from which two constants follow.
        let cells = || {
            CO2_HEIGHTS.iter().flat_map(|row| {
                (0..180).map(|i| {
                    let latitude = f64::from(i) - 89.5;
                    (latitude.to_radians().cos(), between(row, (latitude + 90.0) / 15.0))
                })
            })
        };
        let area: f64 = cells().map(|(w, _)| w).sum();
        let mean = cells().map(|(w, h)| w * h).sum::<f64>() / area;
        let rms = (cells().map(|(w, h)| w * (h - mean).powi(2)).sum::<f64>() / area).sqrt();
        assert!((mean - CO2_MEAN_KM).abs() < 0.1 && (rms - CO2_CLIMATE_KM).abs() < 0.1, "{mean} {rms}");
    }
    const CHECK_SUM: u32 = 48679950;

    #[test]
    fn season_and_place_select_a_height() {
        let body = co2();
        let at = |latitude, part| body.band_height_km(latitude, part).unwrap();
        let table = |month: usize, column: usize| f64::from(CO2_HEIGHTS[month][column]) * 0.01;
        // The middle of January and of July over the north pole, and the turn of the year.
        assert!((at(90.0, Some(0.5 / 12.0)) - table(0, 12)).abs() < 1e-9);
        assert!((at(90.0, Some(6.5 / 12.0)) - table(6, 12)).abs() < 1e-9);
        assert!((at(0.0, Some(0.0)) - 0.5 * (table(11, 6) + table(0, 6))).abs() < 1e-9);
        assert!((at(0.0, Some(0.999_999)) - at(0.0, Some(0.0))).abs() < 1e-3);
        assert!((at(7.5, Some(0.5 / 12.0)) - 0.5 * (table(0, 6) + table(0, 7))).abs() < 1e-9);
        assert!(at(90.0, Some(6.5 / 12.0)) - at(90.0, Some(0.5 / 12.0)) > 4.0);
    }

    #[test]
    fn what_is_known_narrows_the_sigma() {
        let body = co2();
        let place = [0.0, 0.0, 6_956.752e3];
        let expect = |prior: Prior<f64>| Expected::new(&body, &prior).unwrap();
        let both = expect(Prior { position_m: Some(place), year_part: Some(0.5 / 12.0), ..Prior::default() });
        let where_only = expect(Prior { position_m: Some(place), ..Prior::default() });
        let neither = expect(Prior { altitude_m: Some(600e3), ..Prior::default() });
        // The mean along the limb has 0.15 of the variance of the weather; the rest is along the limb.
        let local = |e: &Expected<f64>| {
            let along = 1.0 - weather_mean_part(weather_kappa((e.radius_m + e.limb_m) * e.cos));
            (e.limb_sigma_parts_m[0].powi(2) + e.weather_m.powi(2) * along).sqrt()
        };
        let sigma = |e: &Expected<f64>| e.limb_sigma_parts_m[0];
        assert!((local(&both) - 2193.0).abs() < 1.0 && (local(&neither) - 2454.0).abs() < 1.0);
        assert!((1650.0..1750.0).contains(&sigma(&both)), "{}", sigma(&both));
        assert!((local(&where_only) - local(&neither)).abs() < 1e-6);
        assert!((neither.limb_m - 40e3).abs() < 1e-6);
        // Over the north pole the limb is that of 66° north in every direction.
        assert!((both.limb_m - body.band_height_km(66.0, Some(0.5 / 12.0)).unwrap() * 1e3).abs() < 400.0);
        assert!(both.tilt_sigma_m < neither.tilt_sigma_m);
        assert_eq!(both.weather_m, 1500.0);
        // A told sigma stays that of the height at one place.
        let told = Config { limb_height_sigma_km: 4.0, ..co2() };
        let told = Expected::<f64>::new(&told, &Prior { position_m: Some(place), ..Prior::default() }).unwrap();
        assert!((local(&told) - 4000.0).abs() < 1e-9 && told.weather_m == 1500.0);
    }

    #[test]
    fn a_band_beside_a_height_is_refused() {
        assert_eq!(co2().check(), Ok(()));
        assert!(Config { limb_height_km: 17.0, ..co2() }.check().is_err());
        assert!(Config { kind: Kind::Moon, ..co2() }.check().is_err());
        let mut told = co2();
        told.tell_limb_height(25.0, 2.0);
        assert!(told.check().is_ok() && !told.is_seen_in_sunlight() && told.limb_height_km == 25.0);
        assert!(!co2().is_seen_in_sunlight() && Config { sunlit: Some(true), ..co2() }.is_seen_in_sunlight());
    }
}
