//! Haze: an exponential layer of particles that scatter sunlight, most of it forward.

use serde::{Deserialize, Serialize};

use crate::visible::Air;

/// `[world.ellipsoid.haze]`: a layer whose density falls as exp(−height/scale height) above the surface.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields)]
pub struct Haze {
    /// Height over which the density falls by e, kilometres.
    pub scale_height_km: f64,
    /// Optical depth from the surface to the zenith.
    pub optical_depth: f64,
    /// Brightness of optically thick haze under full sunlight at a right angle to the ray.
    pub brightness: f64,
    /// Asymmetry of the scattering, g of Henyey and Greenstein: 0 scatters evenly, 0.9 almost only forward.
    pub asymmetry: f64,
}

impl Default for Haze {
    fn default() -> Self {
        Self { scale_height_km: 25.0, optical_depth: 0.3, brightness: 0.4, asymmetry: 0.3 }
    }
}

impl Haze {
    /// Returns the height above the surface at which the haze along a ray has half the brightness of thick haze: there
    /// its optical depth, τ₀ √(2 π R/H) e^(−h/H), is ln 2. It is negative for haze that is thinner everywhere.
    pub fn half_height_km(&self, radius_km: f64) -> f64 {
        let chord = 2.0 * self.air().grazing(radius_km);
        self.scale_height_km * libm::log(chord * self.optical_depth / core::f64::consts::LN_2)
    }

    /// Returns the same layer as air of one colour.
    pub(super) fn air(&self) -> Air {
        Air {
            optical_depth: [self.optical_depth; 3],
            scale_height_km: self.scale_height_km,
            brightness: self.brightness,
        }
    }

    /// Returns the scattering at an angle relative to that at a right angle (Henyey and Greenstein 1941). `cos` is the
    /// cosine of the angle by which the light turns: 1 is forward, towards a camera that looks at the Sun.
    pub(super) fn phase(&self, cos: f64) -> f32 {
        let g = self.asymmetry;
        let share = (1.0 + g * g) / (1.0 + g * g - 2.0 * g * cos);
        (share * share.sqrt()) as f32
    }

    pub(super) fn limits(&self, radius_km: f64) -> [(&'static str, f64, [f64; 2]); 4] {
        [
            ("haze.scale_height_km", self.scale_height_km, [1e-3, 0.1 * radius_km]),
            ("haze.optical_depth", self.optical_depth, [1e-6, 100.0]),
            ("haze.brightness", self.brightness, [0.0, 100.0]),
            ("haze.asymmetry", self.asymmetry, [-0.95, 0.95]),
        ]
    }
}
