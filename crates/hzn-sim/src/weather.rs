//! Weather of the limb: its height varies from place to place.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::counter::{Counter, Stream};

/// A random field of the limb height that is added to the height by latitude. It is normal, and stands still over the
/// Earth while the pictures are taken.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields)]
pub struct Weather {
    /// 1σ of the height, kilometres.
    pub sigma_km: f64,
    /// Distance at which the correlation has fallen to exp(−½), kilometres; it is that of a Gaussian curve.
    pub length_km: f64,
    /// Seed of the field; the seed of a scene is added to it.
    pub seed: u64,
}

impl Default for Weather {
    fn default() -> Self {
        Self { sigma_km: 1.5, length_km: 1000.0, seed: 1 }
    }
}

/// Number of waves. Their sum is nearly normal, and it does not repeat over the Earth.
const WAVES: u64 = 64;

/// [`Weather`], prepared for evaluation: a sum of waves in space with random directions, lengths and phases.
#[derive(Debug, Clone)]
pub(crate) struct WeatherField {
    /// Wave vector in radians per metre, and phase.
    waves: Vec<(Vector3<f64>, f64)>,
    amplitude_m: f64,
}

impl WeatherField {
    pub(crate) fn new(weather: &Weather) -> Self {
        let draws = Counter::new(weather.seed, Stream::Weather);
        // Normal wave vectors give a correlation with the shape of a Gaussian curve.
        let wave = |i: u64| {
            let k = [0, 1, 2].map(|axis| draws.normal(4 * i + axis) / (weather.length_km * 1e3));
            (Vector3::from(k), core::f64::consts::TAU * draws.uniform(4 * i + 3))
        };
        let amplitude_m = weather.sigma_km * 1e3 * (2.0 / WAVES as f64).sqrt();
        Self { waves: (0..WAVES).map(wave).collect(), amplitude_m }
    }

    /// Returns the height at a point of the surface (body-fixed, metres), in metres.
    pub(crate) fn height_m(&self, point_m: &Vector3<f64>) -> f64 {
        self.amplitude_m * self.waves.iter().map(|(k, phase)| libm::cos(k.dot(point_m) + phase)).sum::<f64>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_field_has_its_sigma_and_its_length() {
        let (mut own, mut near, mut far) = (0.0, 0.0, 0.0);
        let seeds = 2000;
        for seed in 0..seeds {
            let field = WeatherField::new(&Weather { seed, ..Weather::default() });
            let at = |east_m: f64| field.height_m(&Vector3::new(6.4e6, east_m, 0.0));
            let here = at(0.0);
            own += here * here;
            near += here * at(1e6);
            far += here * at(4e6);
        }
        let [own, near, far] = [own, near, far].map(|sum| sum / seeds as f64 / 2.25e6);
        assert!((own - 1.0).abs() < 0.1 && (near - 0.607).abs() < 0.1 && far.abs() < 0.1, "{own} {near} {far}");
    }
}
