//! The surface: how it reflects sunlight, its bands and patches.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::texture::{CellCache, Relief};

/// Law of reflection: brightness by the cosines of the angles of the Sun (μ₀) and of the camera (μ) from the vertical.
/// Each law has the value 1 at μ₀ = μ = 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum Reflection {
    /// A matt surface: μ₀. At full phase it darkens to zero at the limb.
    #[default]
    Lambert,
    /// Dark regolith (Lommel and Seeliger): 2 μ₀/(μ₀ + μ). At full phase it does not darken towards the limb.
    LommelSeeliger,
    /// Between the two (Minnaert): μ₀^k μ^(k − 1), with the exponent `minnaert`.
    Minnaert,
}

/// `[world.ellipsoid.surface]`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields)]
pub struct Surface {
    /// Brightness under the Sun at the zenith, seen from the zenith.
    pub albedo: f64,
    /// Law of reflection.
    pub reflection: Reflection,
    /// Exponent k of Minnaert's law: 0.5 does not darken at full phase, 1 is Lambert's law.
    pub minnaert: f64,
    /// Relative change of the albedo from band to band along latitude, 1-sigma.
    pub band_contrast: f64,
    /// Number of bands from pole to pole.
    pub bands: u32,
    /// Relative change of the albedo from patch to patch, 1-sigma.
    pub patch_contrast: f64,
    /// Sizes of the largest and the smallest patches, kilometres.
    pub patches_km: [f64; 2],
    /// Seed of bands and patches; another seed gives other ones.
    pub seed: u64,
}

impl Default for Surface {
    fn default() -> Self {
        Self {
            albedo: 0.8,
            reflection: Reflection::Lambert,
            minnaert: 0.8,
            band_contrast: 0.0,
            bands: 12,
            patch_contrast: 0.0,
            patches_km: [1000.0, 10.0],
            seed: 1,
        }
    }
}

impl Surface {
    pub(super) fn limits(&self) -> [(&'static str, f64, [f64; 2]); 7] {
        [
            ("surface.albedo", self.albedo, [0.0, 100.0]),
            ("surface.minnaert", self.minnaert, [0.5, 2.0]),
            ("surface.band_contrast", self.band_contrast, [0.0, 1.0]),
            ("surface.bands", self.bands.into(), [1.0, 1000.0]),
            ("surface.patch_contrast", self.patch_contrast, [0.0, 1.0]),
            ("surface.patches_km", self.patches_km[0], [1e-3, 1e6]),
            ("surface.patches_km", self.patches_km[1], [1e-3, self.patches_km[0]]),
        ]
    }
}

/// Smallest cosine of the camera's angle. Minnaert's law has no limit at the limb, where real surfaces, which are not
/// smooth, deviate from it.
const LEAST_MU: f64 = 0.02;

/// [`Surface`], prepared for rendering.
#[derive(Debug, Clone)]
pub(super) struct PreparedSurface {
    surface: Surface,
    bands: Option<Relief>,
    patches: Option<Relief>,
}

impl PreparedSurface {
    pub(super) fn new(surface: &Surface, radius_m: f64) -> Self {
        let band_km = 2e-3 * radius_m / f64::from(surface.bands.max(1));
        let relief = |sizes_km, seed| Relief::new(sizes_km, 0.6, radius_m, seed);
        Self {
            surface: *surface,
            bands: (surface.band_contrast > 0.0).then(|| relief([band_km, 0.25 * band_km], !surface.seed)),
            patches: (surface.patch_contrast > 0.0).then(|| relief(surface.patches_km, surface.seed)),
        }
    }

    /// Returns the brightness at a point of the unit sphere, in scaled axes. Detail finer than `footprint_km` is left
    /// out.
    #[inline]
    pub(super) fn brightness(
        &self,
        point: &Vector3<f64>,
        [mu0, mu]: [f64; 2],
        footprint_km: f32,
        caches: &mut [CellCache; 2],
    ) -> f32 {
        if mu0 <= 0.0 {
            return 0.0;
        }
        let law = match self.surface.reflection {
            Reflection::Lambert => mu0,
            Reflection::LommelSeeliger => 2.0 * mu0 / (mu0 + mu),
            Reflection::Minnaert => {
                let mu = mu.max(LEAST_MU);
                let k = self.surface.minnaert;
                libm::pow(mu0, k) * libm::pow(mu, k - 1.0)
            }
        };
        let mut relative = 1.0f32;
        let [band_cache, patch_cache] = caches;
        if let Some(bands) = &self.bands {
            // The noise changes along one line only, so that it depends on the latitude alone.
            let line = Vector3::new(0.37, 0.61, point.z);
            relative += self.surface.band_contrast as f32 * bands.sample(&line, footprint_km, band_cache);
        }
        if let Some(patches) = &self.patches {
            relative += self.surface.patch_contrast as f32 * patches.sample(point, footprint_km, patch_cache);
        }
        (self.surface.albedo * law) as f32 * relative.max(0.05)
    }
}
