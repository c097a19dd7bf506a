//! Land, sea and ice: generated, or from a map.

use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use hzn_files::png::WithoutProfiles;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::texture::{CellCache, Relief, smoothstep};

/// The ground without its clouds.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields)]
pub struct Ground {
    /// Approximate share of land, 0 to 1.
    pub land: f64,
    /// Mean latitude in degrees beyond which land and sea are white.
    pub ice_deg: f64,
    /// Seed of the continents; another seed gives other continents.
    pub seed: u64,
    /// A map that replaces the generated ground: a picture in equirectangular projection, 180° W to 180° E and 90° N to
    /// 90° S, sRGB. The path is relative to the scene.toml.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub map: Option<PathBuf>,
    /// The map, read by [`Ground::read_map`].
    #[serde(skip)]
    pub texture: Option<Arc<Texture>>,
}

impl Default for Ground {
    fn default() -> Self {
        Self { land: 0.35, ice_deg: 74.0, seed: 1, map: None, texture: None }
    }
}

impl Ground {
    /// Reads the map, if one is named; its path is relative to `folder`.
    ///
    /// # Errors
    /// Fails if the picture cannot be read.
    pub fn read_map(&mut self, folder: &Path) -> Result<(), String> {
        if let Some(map) = &self.map {
            let path = folder.join(map);
            let refused = |e: &dyn std::fmt::Display| format!("{}: {e}", path.display());
            let mut file = Vec::new();
            let contents = File::open(&path).and_then(|file| WithoutProfiles::new(Box::new(file)));
            contents.and_then(|mut contents| contents.read_to_end(&mut file)).map_err(|e| refused(&e))?;
            // The decoders of memory are compiled in `image`, those of `image::open` would be compiled here.
            let picture = image::load_from_memory(&file).map_err(|e| refused(&e))?.into_rgb8();
            self.texture = Some(Arc::new(Texture::new(&picture)));
        }
        Ok(())
    }
}

/// A map of the globe in equirectangular projection.
#[derive(Debug, Clone, PartialEq)]
pub struct Texture {
    width: usize,
    height: usize,
    /// Linear light, row by row from the north.
    data: Vec<[f32; 3]>,
}

impl Texture {
    /// Converts a picture in sRGB that spans 360° by 180°.
    pub fn new(picture: &image::RgbImage) -> Self {
        let linear = |v: u8| {
            let v = f32::from(v) / 255.0;
            if v <= 0.04045 { v / 12.92 } else { libm::powf((v + 0.055) / 1.055, 2.4) }
        };
        Self {
            width: picture.width() as usize,
            height: picture.height() as usize,
            data: picture.pixels().map(|p| p.0.map(linear)).collect(),
        }
    }

    /// Interpolates between four pixels; the longitude wraps around.
    fn interpolate(&self, lon_rad: f64, lat_rad: f64) -> [f32; 3] {
        let u = (lon_rad / core::f64::consts::TAU + 0.5) * self.width as f64 - 0.5;
        let v = (0.5 - lat_rad / core::f64::consts::PI) * self.height as f64 - 0.5;
        let (x, y) = (u.floor(), v.floor());
        let (fx, fy) = ((u - x) as f32, (v - y) as f32);
        let pixel = |dx: f64, dy: f64| {
            let column = (x + dx).rem_euclid(self.width as f64) as usize;
            let row = (y + dy).clamp(0.0, self.height as f64 - 1.0) as usize;
            self.data.get(row * self.width + column).copied().unwrap_or_default()
        };
        let (a, b, c, d) = (pixel(0.0, 0.0), pixel(1.0, 0.0), pixel(0.0, 1.0), pixel(1.0, 1.0));
        core::array::from_fn(|i| {
            let (top, bottom) = (a[i] + fx * (b[i] - a[i]), c[i] + fx * (d[i] - c[i]));
            top + fy * (bottom - top)
        })
    }
}

const SEA: [f32; 3] = [0.012, 0.030, 0.060];
const FOREST: [f32; 3] = [0.035, 0.060, 0.025];
const STEPPE: [f32; 3] = [0.16, 0.14, 0.08];
const DESERT: [f32; 3] = [0.40, 0.30, 0.19];
const ICE: [f32; 3] = [0.70, 0.74, 0.78];

fn mix(a: [f32; 3], b: [f32; 3], t: f32) -> [f32; 3] {
    core::array::from_fn(|i| a[i] + t * (b[i] - a[i]))
}

/// [`Ground`], prepared for rendering.
#[derive(Debug, Clone)]
pub(crate) struct Soil {
    texture: Option<Arc<Texture>>,
    continents: Arc<Relief>,
    plants: Arc<Relief>,
    sea_level: f32,
    ice: f32,
}

impl Soil {
    pub(crate) fn new(ground: &Ground, radius_m: f64) -> Self {
        let land = ground.land.clamp(0.001, 0.999);
        Self {
            texture: ground.texture.clone(),
            continents: Arc::new(Relief::new([5000.0, 5.0], 0.55, radius_m, ground.seed)),
            plants: Arc::new(Relief::new([700.0, 3.0], 0.7, radius_m, ground.seed.wrapping_add(77))),
            // A logistic curve approximates the distribution function; this is its inverse.
            sea_level: (libm::log((1.0 - land) / land) / 1.7) as f32,
            ice: libm::sin(ground.ice_deg.to_radians()) as f32,
        }
    }

    /// Returns the reflectance by channel and the share of open sea, at a point of the unit sphere with this normal.
    pub(crate) fn sample(
        &self,
        point: &Vector3<f64>,
        normal: &Vector3<f64>,
        footprint_km: f32,
        [continents, plants]: &mut [CellCache; 2],
    ) -> ([f32; 3], f32) {
        if let Some(texture) = &self.texture {
            let colour = texture.interpolate(libm::atan2(normal.y, normal.x), libm::asin(normal.z.clamp(-1.0, 1.0)));
            // Dark and blue ground counts as water.
            let sea =
                ((colour[2] - 1.2 * colour[0]) * 20.0).clamp(0.0, 1.0) * ((0.25 - colour[0]) * 8.0).clamp(0.0, 1.0);
            return (colour, sea);
        }
        let height = self.continents.sample(point, footprint_km, continents) - self.sea_level;
        let dry = self.plants.sample(point, footprint_km, plants);
        let sin_lat = normal.z.abs() as f32;
        // Deserts are under the descending air of the horse latitudes.
        let belt = 1.0 - ((sin_lat - 0.40).abs() * 5.0).min(1.0);
        let steppe = smoothstep((0.35 + 0.25 * dry + 0.4 * belt + 0.15 * height).clamp(0.0, 1.0));
        let desert = smoothstep((0.9 * belt + 0.3 * dry - 0.35).clamp(0.0, 1.0));
        let land = mix(mix(FOREST, STEPPE, steppe), DESERT, desert);
        let ashore = (height * 25.0 + 0.5).clamp(0.0, 1.0);
        let ice = smoothstep(((sin_lat - self.ice) * 18.0 + 0.25 * dry + 0.3 * height.min(1.0)).clamp(0.0, 1.0));
        (mix(mix(SEA, land, ashore), ICE, ice), (1.0 - ashore) * (1.0 - ice))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_map_is_read_where_it_should_be() {
        // The map is red in the west and green in the east; its southernmost row is blue.
        let picture = image::RgbImage::from_fn(8, 4, |x, y| {
            image::Rgb(if y == 3 {
                [0, 0, 255]
            } else if x < 4 {
                [255, 0, 0]
            } else {
                [0, 255, 0]
            })
        });
        let texture = Texture::new(&picture);
        assert_eq!(texture.interpolate(-1.5, 0.3), [1.0, 0.0, 0.0]);
        assert_eq!(texture.interpolate(1.5, 0.3), [0.0, 1.0, 0.0]);
        assert_eq!(texture.interpolate(0.5, -1.5), [0.0, 0.0, 1.0]);
        // The map wraps around at the date line.
        let seam = texture.interpolate(core::f64::consts::PI, 0.3);
        assert!((seam[0] - 0.5).abs() < 1e-6 && (seam[1] - 0.5).abs() < 1e-6);
    }

    #[test]
    fn as_much_land_as_asked_for() {
        for land in [0.2, 0.5] {
            let soil = Soil::new(&Ground { land, ice_deg: 90.0, ..Ground::default() }, 6.371e6);
            let n = 20_000;
            let sea: f32 = (0..n)
                .map(|i| {
                    let z = 1.0 - (2.0 * f64::from(i) + 1.0) / f64::from(n);
                    let (s, c) = libm::sincos(f64::from(i) * 2.399_963);
                    let r = (1.0 - z * z).sqrt();
                    let p = Vector3::new(r * c, r * s, z);
                    soil.sample(&p, &p, 10.0, &mut Default::default()).1
                })
                .sum();
            let share = 1.0 - f64::from(sea) / f64::from(n);
            assert!((share - land).abs() < 0.15, "{land}: {share}");
        }
    }
}
