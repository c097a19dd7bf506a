//! The air: an exponential atmosphere with single scattering, by channel.

use serde::{Deserialize, Serialize};

/// The atmosphere. Its optical depth falls as exp(−height/scale height) in every channel.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields)]
pub struct Air {
    /// Optical depth from the ground to the zenith, for red, green and blue.
    pub optical_depth: [f64; 3],
    /// Height over which the density of the air falls by e, kilometres, above 0.
    pub scale_height_km: f64,
    /// Brightness of optically thick air under full sunlight.
    pub brightness: f64,
}

impl Default for Air {
    fn default() -> Self {
        // The values are for Rayleigh scattering at 650, 550 and 450 nm.
        Self { optical_depth: [0.049, 0.097, 0.22], scale_height_km: 8.0, brightness: 0.6 }
    }
}

impl Air {
    /// Returns the length of a grazing path from the ground to space divided by the path to the zenith: √(π R / 2 H).
    pub(crate) fn grazing(&self, radius_km: f64) -> f64 {
        (core::f64::consts::FRAC_PI_2 * radius_km / self.scale_height_km).sqrt()
    }

    /// Returns the tangent height in kilometres above the ground at which a channel mix has half the brightness of
    /// optically thick air. Ground light is not included. The `weights` of red, green and blue must sum to 1.
    pub fn half_height_km(&self, weights: [f64; 3], radius_km: f64) -> f64 {
        self.height_km(0.5, weights, radius_km)
    }

    /// Returns the height of [`Self::half_height_km`] for the part `light` of the brightness instead of a half.
    pub(crate) fn height_km(&self, light: f64, weights: [f64; 3], radius_km: f64) -> f64 {
        let chord = 2.0 * self.grazing(radius_km);
        let bright = |h_km: f64| -> f64 {
            let density_ratio = libm::exp(-h_km / self.scale_height_km);
            (0..3).map(|c| weights[c] * (1.0 - libm::exp(-self.optical_depth[c] * chord * density_ratio))).sum()
        };
        let (mut low, mut high) = (-100.0, 200.0);
        for _ in 0..60 {
            let mid = 0.5 * (low + high);
            if bright(mid) > light { low = mid } else { high = mid }
        }
        0.5 * (low + high)
    }
}

/// [`Air`] around one globe, prepared for rendering.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PreparedAir {
    depth: [f32; 3],
    per_m: f32,
    pub(crate) brightness: f32,
    /// Grazing path divided by zenith path.
    grazing: f32,
    /// R/2H; it determines how fast the shadow rises beyond the terminator.
    curve: f32,
    /// Tangent height in metres above which the light of the air is below a thousandth of a count.
    pub(crate) top_m: f64,
}

impl PreparedAir {
    pub(crate) fn new(air: &Air, radius_m: f64) -> Self {
        let scale_m = air.scale_height_km.max(1e-3) * 1e3;
        Self {
            depth: air.optical_depth.map(|x| x as f32),
            per_m: (1.0 / scale_m) as f32,
            brightness: air.brightness as f32,
            grazing: air.grazing(radius_m / 1e3) as f32,
            curve: (radius_m / (2.0 * scale_m)) as f32,
            top_m: 15.0 * scale_m,
        }
    }

    /// Returns the Sun's path through the air divided by the path to the zenith, by the cosine of the Sun's zenith
    /// angle. Beyond the terminator the ray dips below the horizontal. It then has twice the grazing path, in air that
    /// is denser because of the dip.
    #[inline(always)]
    pub(crate) fn sun_path(&self, mu0: f32) -> f32 {
        let g = self.grazing;
        let near = 1.0 / (mu0 * mu0 + 1.0 / (g * g)).sqrt();
        if mu0 >= 0.0 { near } else { 2.0 * g * libm::expf((self.curve * mu0 * mu0).min(60.0)) - near }
    }

    /// Returns the transmission of a ray with this optical depth, by channel.
    #[inline(always)]
    pub(crate) fn transmission(depth: [f32; 3]) -> [f32; 3] {
        depth.map(|d| libm::expf(-d))
    }

    /// Returns the optical depth of a ray that passes at a tangent height, by channel.
    #[inline(always)]
    pub(crate) fn limb_depth(&self, height_m: f32) -> [f32; 3] {
        let path = 2.0 * self.grazing * libm::expf(-height_m * self.per_m);
        self.depth.map(|d| d * path)
    }

    /// Returns the optical depth of a ray that meets the ground at this cosine of the zenith angle, by channel.
    #[inline(always)]
    pub(crate) fn ground_depth(&self, mu: f32) -> [f32; 3] {
        let path = 1.0 / (mu * mu + 1.0 / (self.grazing * self.grazing)).sqrt();
        self.depth.map(|d| d * path)
    }

    /// Returns the sunlight at a height as a fraction of the sunlight in space, by channel. `density_ratio` is
    /// exp(−height/scale height).
    #[inline(always)]
    pub(crate) fn sunlight(&self, sun_path: f32, density_ratio: f32) -> [f32; 3] {
        self.depth.map(|d| libm::expf(-(d * density_ratio * sun_path).min(60.0)))
    }

    /// Returns exp(−height/scale height).
    #[inline(always)]
    pub(crate) fn density_ratio(&self, height_m: f32) -> f32 {
        libm::expf(-height_m.max(0.0) * self.per_m)
    }

    /// Returns the light that the air along a ray of this optical depth sends to the camera; `transmission` is
    /// exp(−depth). The light of optically thick air comes from its upper part, where the density is lower by
    /// 1 + depth.
    #[inline(always)]
    pub(crate) fn glow(
        &self,
        depth: [f32; 3],
        transmission: [f32; 3],
        density_ratio: f32,
        sun_path: f32,
        phase: f32,
    ) -> [f32; 3] {
        core::array::from_fn(|c| {
            let sun = libm::expf(-(self.depth[c] * density_ratio / (1.0 + depth[c]) * sun_path).min(60.0));
            self.brightness * phase * sun * (1.0 - transmission[c])
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_height_is_where_one_channel_is_at_half() {
        let air = Air::default();
        // 1 − exp(−τ) = ½ holds at τ = ln 2; √(2 π R/H) is 70.7 for 6371 km and 8 km.
        for (c, weights) in [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].into_iter().enumerate() {
            let tau0 = air.optical_depth[c] * (core::f64::consts::TAU * 6371.0 / 8.0).sqrt();
            let want = 8.0 * (tau0 / core::f64::consts::LN_2).ln();
            assert!((air.half_height_km(weights, 6371.0) - want).abs() < 1e-6);
        }
    }

    #[test]
    fn the_sun_sets_red_and_then_goes_out() {
        let air = PreparedAir::new(&Air::default(), 6.371e6);
        let sunlight = |deg: f64| air.sunlight(air.sun_path(libm::sin(deg.to_radians()) as f32), 1.0);
        let (noon, low, night) = (sunlight(90.0), sunlight(2.0), sunlight(-4.0));
        assert!((noon[1] - (-0.097f32).exp()).abs() < 1e-3);
        assert!(low[0] > 2.0 * low[1] && low[1] > 2.0 * low[2]);
        assert!(night.iter().all(|&x| x < 1e-6));
        // The path is continuous at the horizon.
        assert!((air.sun_path(1e-6) / air.sun_path(-1e-6) - 1.0).abs() < 1e-4);
    }

    /// book/theory/methods.md gives users the limb height in their band.
    #[test]
    fn half_levels_by_wavelength_are_those_of_the_documents() {
        let text = include_str!("../../../../book/theory/methods.md");
        let (_, table) = text.split_once("| wavelength | τ₀ |").unwrap();
        let rows: Vec<&str> = table.lines().skip(2).take_while(|l| l.starts_with('|')).collect();
        assert!(rows.len() >= 6, "{rows:?}");
        let (scale_km, radius_km) = (7.5, 6371.0f64);
        for row in rows {
            let cells: Vec<&str> = row.split('|').map(str::trim).collect();
            let um = cells[1].split(' ').next().unwrap().parse::<f64>().unwrap() * 1e-3;
            let depth = 0.008569 * um.powi(-4) * (1.0 + 0.0113 * um.powi(-2) + 0.00013 * um.powi(-4));
            let height_km = |level: f64| {
                let grazing = depth * (core::f64::consts::TAU * radius_km / scale_km).sqrt();
                scale_km * (grazing / -(1.0 - level).ln()).ln()
            };
            let words = |text: &str| text.trim_end_matches(" km").replace('−', "-");
            let numbers = |text: &str| words(text).split(" to ").map(|n| n.parse().unwrap()).collect::<Vec<f64>>();
            for (cell, level) in numbers(cells[4]).into_iter().zip([0.75, 0.25]).chain([(numbers(cells[3])[0], 0.5)]) {
                assert!((cell - height_km(level)).abs() < 0.06, "{row}: {}", height_km(level));
            }
            assert!((numbers(cells[2])[0] - depth).abs() < 0.0006, "{row}: {depth}");
            // The simulator's air has the same half level.
            let air = Air { optical_depth: [depth; 3], scale_height_km: scale_km, ..Air::default() };
            assert!((air.half_height_km([1.0 / 3.0; 3], radius_km) - height_km(0.5)).abs() < 1e-6);
        }
    }
}
