//! The Earth in the infrared, around the carbon dioxide band at 15 µm, after section 3.2 of Wang et al. 2022. The
//! radiance by tangent height, latitude and season is interpolated in a table.
//!
//! The curves of their source are not printed, so hzn has analytic ones. The disc is a little brighter over warm
//! ground. The limb falls off as a logistic curve; its half level is at 25 km on average, higher over the summer
//! hemisphere and lower over the winter one. Users can read their own curves from a file ([`Radiance`]).

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::globe::{Globe, RayHit, View};
use crate::pose::Pose;
use crate::radiance::{Grid, Radiance, mean_over_globe};
use crate::texture::{CellCache, CloudField, Clouds};
use crate::weather::{Weather, WeatherField};
use hzn_core::body::Limb;
use hzn_core::camera::Camera;
use hzn_core::pixel::ImagePoint;
use hzn_files::limited;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The world that an infrared camera sees.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields)]
pub struct Infrared {
    /// Season as an angle in degrees: 0 is northern midsummer, 90 autumn, 180 midwinter. Without it, a scene.toml takes
    /// the season from `utc`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub season_deg: Option<f64>,
    /// Brightness of the disc as a fraction of full scale.
    pub brightness: f64,
    /// Relative increase of the disc's brightness over the equator, and its relative decrease over the poles.
    pub by_latitude: f64,
    /// Band whose name sensor.toml has as `body.limb` (`window-8-14um` or `co2-15um`), in place of the height of this
    /// world: the sensor then knows the limb as well as that of a real flight.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(feature = "schema", schemars(schema_with = "crate::foreign_schema::limb"))]
    pub limb: Option<Limb>,
    /// Mean tangent height at which half of the disc's brightness is left, kilometres.
    pub half_level_km: f64,
    /// Increase of that height over the pole in midsummer, kilometres. It is linear in latitude, and negative over the
    /// other pole.
    pub half_level_season_km: f64,
    /// Scale of the logistic curve, kilometres, above 0. Over this height the limb's odds (remaining over missing
    /// brightness) fall by e.
    pub scale_km: f64,
    /// Cold clouds. Their `brightness` is the brightness of a thick cloud as a fraction of the disc's brightness.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub clouds: Option<Clouds>,
    /// Weather: the height of the limb varies from place to place. Without it, the height depends on the latitude only.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub weather: Option<Weather>,
    /// Brightness of space.
    pub space: f64,
    /// CSV file with a table of radiances, see [`Radiance::parse`]. The table replaces the curves that the five keys
    /// after the season describe. The path is relative to the scene.toml.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub table: Option<PathBuf>,
    /// The table, read by [`Infrared::read_table`].
    #[serde(skip)]
    pub radiance: Option<Arc<Radiance>>,
}

impl Default for Infrared {
    fn default() -> Self {
        Self {
            season_deg: None,
            brightness: 0.75,
            by_latitude: 0.06,
            limb: None,
            half_level_km: 25.0,
            half_level_season_km: 4.5,
            scale_km: 4.0,
            clouds: None,
            weather: None,
            space: 0.03,
            table: None,
            radiance: None,
        }
    }
}

/// Number of latitudes in the table; they are 15° apart from −90°.
const LATITUDES: usize = 13;
/// Number of tangent heights in the table; they are 2 km apart from −30 km.
const HEIGHTS: usize = 81;
const FIRST_KM: f64 = -30.0;
const STEP_KM: f64 = 2.0;

impl Infrared {
    /// Returns the season as an angle in degrees, from the day of the year of a UTC time (seconds since 1970): 0 on
    /// 15 July.
    pub fn season_deg(unix_s: f64) -> f64 {
        // 15 July is 195 days after 1 January, and a year has 365.2425 days.
        ((unix_s / 86_400.0 - 195.0) / 365.2425).rem_euclid(1.0) * 360.0
    }

    /// Returns the same world; if it has no season, with the season of a UTC time (seconds since 1970).
    #[must_use]
    pub fn with_season(&self, unix_s: f64) -> Self {
        Self { season_deg: self.season_deg.or(Some(Self::season_deg(unix_s))), ..self.clone() }
    }

    /// Reads the table, if one is named; its path is relative to `folder`.
    ///
    /// # Errors
    /// Fails if the table cannot be read or is invalid, and if a key of the replaced curves is set.
    pub fn read_table(&mut self, folder: &Path) -> Result<(), String> {
        let Some(table) = &self.table else { return Ok(()) };
        let default = Self::default();
        let curves = [
            ("brightness", self.brightness, default.brightness),
            ("by_latitude", self.by_latitude, default.by_latitude),
            ("half_level_km", self.half_level_km, default.half_level_km),
            ("half_level_season_km", self.half_level_season_km, default.half_level_season_km),
            ("scale_km", self.scale_km, default.scale_km),
        ];
        if let Some((key, ..)) = curves.into_iter().find(|(_, value, default)| value != default) {
            return Err(format!("{key} has no effect with a table: remove {key} or the table"));
        }
        let path = folder.join(table);
        let text = limited::read_text(&path, limited::TABLE_BYTES).map_err(|e| format!("{}: {e}", path.display()))?;
        let radiance = Radiance::parse(&text).map_err(|e| format!("{}: {e}", path.display()))?;
        self.radiance = Some(Arc::new(radiance));
        Ok(())
    }

    /// Returns the radiances of the season.
    fn grid(&self) -> Grid {
        if let Some(radiance) = &self.radiance {
            return radiance.season_grid(self.season_deg.unwrap_or(0.0));
        }
        let latitudes_deg = (0..LATITUDES).map(|i| 180.0 * i as f64 / (LATITUDES - 1) as f64 - 90.0).collect();
        let heights_km = (0..HEIGHTS).map(|i| FIRST_KM + STEP_KM * i as f64).collect();
        Grid::from_function(heights_km, latitudes_deg, |height_km, latitude_deg| self.curve(height_km, latitude_deg))
    }

    /// Returns the mean half level over the globe, in kilometres.
    pub fn mean_half_level_km(&self) -> f64 {
        match &self.radiance {
            Some(_) => {
                let half_level_km = self.half_levels();
                mean_over_globe(half_level_km)
            }
            None => self.half_level_km,
        }
    }

    /// Returns the half level in kilometres at a geodetic latitude in degrees.
    pub fn half_level_at_km(&self, latitude_deg: f64) -> f64 {
        self.half_levels()(latitude_deg)
    }

    /// Returns a function from geodetic latitude (degrees) to the half level (kilometres), for many latitudes.
    pub(crate) fn half_levels(&self) -> impl Fn(f64) -> f64 {
        let grid = self.radiance.is_some().then(|| self.grid());
        let (mean_km, season_km) = (self.half_level_km, self.half_level_season_km);
        let season = libm::cos(self.season_deg.unwrap_or(0.0).to_radians());
        move |latitude_deg| match &grid {
            // A table that has a half level at all its latitudes and seasons also has one between them.
            Some(grid) => grid.half_level_km(latitude_deg).unwrap_or(0.0),
            None => mean_km + season_km * season * latitude_deg / 90.0,
        }
    }

    /// Returns the half level as rows of (geodetic latitude in degrees, kilometres), for the sensor's configuration.
    /// The list is empty if the half level is the same everywhere.
    pub fn half_level_by_latitude_km(&self) -> Vec<[f64; 2]> {
        let half_level_km = self.half_levels();
        let latitudes_deg: &[f64] = match &self.radiance {
            Some(_) => &[-90.0, -75.0, -60.0, -45.0, -30.0, -15.0, 0.0, 15.0, 30.0, 45.0, 60.0, 75.0, 90.0],
            None => &[-90.0, 0.0, 90.0],
        };
        let rows: Vec<[f64; 2]> = latitudes_deg.iter().map(|lat| [*lat, half_level_km(*lat)]).collect();
        let flat = rows.iter().all(|row| row[1] == rows[0][1]);
        if flat { Vec::new() } else { rows }
    }

    /// Returns the radiance at a tangent height and a geodetic latitude as a fraction of full scale, without space and
    /// clouds.
    fn curve(&self, height_km: f64, latitude_deg: f64) -> f64 {
        let disc = self.brightness * (1.0 + self.by_latitude * libm::cos(2.0 * latitude_deg.to_radians()));
        disc / (1.0 + libm::exp((height_km - self.half_level_at_km(latitude_deg)) / self.scale_km))
    }
}

/// [`Infrared`], prepared for one camera.
#[derive(Debug, Clone)]
pub(crate) struct InfraredPainter {
    camera: Camera<f64>,
    globe: Globe,
    view: View,
    table: Arc<Grid>,
    clouds: Option<Arc<CloudField>>,
    weather: Option<Arc<WeatherField>>,
    space: f32,
    disc: f32,
    pixel_rad: f64,
    near: f64,
}

/// Number of rays along each side of a pixel at the limb.
const SAMPLES: i32 = 9;

impl InfraredPainter {
    pub(crate) fn try_new(world: &Infrared, camera: Camera<f64>, globe: Globe, pose: &Pose) -> Option<Self> {
        let view = View::try_new(globe, pose)?;
        let (fx, fy) = camera.focal_px();
        let pixel_rad = 1.0 / fx.min(fy);
        let away_m = Vector3::from(pose.position_m).norm();
        let limb_m = (away_m * away_m - globe.b_m * globe.b_m).max(0.0).sqrt();
        let table = world.grid();
        Some(Self {
            near: 2.0 * (1.3e5 + 3.0 * limb_m * pixel_rad) / globe.b_m,
            clouds: world.clouds.map(|c| Arc::new(CloudField::new(&c, globe.a_m))),
            weather: world.weather.map(|weather| Arc::new(WeatherField::new(&weather))),
            space: world.space as f32,
            disc: if world.radiance.is_some() { table.lowest_mean() } else { world.brightness as f32 },
            table: Arc::new(table),
            camera,
            globe,
            view,
            pixel_rad,
        })
    }

    pub(crate) fn with_pose(&self, pose: &Pose) -> Self {
        Self { view: View::try_new(self.globe, pose).unwrap_or_else(|| self.view.clone()), ..self.clone() }
    }

    pub(crate) fn render_row(&self, v: f64, weight: f32, row: &mut [f32]) {
        let cache = &mut CellCache::default();
        for (x, p) in row.iter_mut().enumerate() {
            let Some(ray) = self.camera.ray(ImagePoint { u: x as f64, v }) else { continue };
            let hit = self.view.intersect(ray.direction().xyz());
            let middle = self.view.tangent_height_m(&hit);
            let light = if hit.miss > self.near {
                self.space
            } else if hit.miss < -self.near {
                self.locate_ground(&hit, cache).brightness(middle)
            } else {
                let ground = self.locate_ground(&hit, cache);
                let gradient = self.view.tangent_height_gradient(&hit, &ray.jacobian());
                let mut sum = 0.0;
                for (i, j) in (0..SAMPLES).flat_map(|i| (0..SAMPLES).map(move |j| (i, j))) {
                    let [du, dv] = [i, j].map(|k| (f64::from(k) + 0.5) / f64::from(SAMPLES) - 0.5);
                    sum += ground.brightness(middle + gradient[0] * du + gradient[1] * dv);
                }
                sum / (SAMPLES * SAMPLES) as f32
            };
            *p += weight * light;
        }
    }

    /// Returns latitude, weather and cloud where a ray meets or passes the globe.
    fn locate_ground(&self, hit: &RayHit, cache: &mut CellCache) -> GroundPoint<'_> {
        let point = self.view.point(hit);
        let latitude_deg = libm::asin(self.view.normal(&point).z.clamp(-1.0, 1.0)).to_degrees();
        let mut cloud = None;
        if hit.miss < 0.0
            && let Some(clouds) = &self.clouds
        {
            let (range_m, cos) = self.view.range_m_and_incidence(hit, &point);
            let footprint_km = (range_m * 1e-3 * self.pixel_rad / cos.max(0.02)) as f32;
            // Towards the limb, the light of the stratosphere hides the clouds.
            let visible = (2.0 * cos * cos).min(1.0) as f32;
            cloud =
                clouds.sample(&point, footprint_km, cache).map(|(cover, bright)| (cover * visible, bright * self.disc));
        }
        // The disc has the same brightness at any height below the limb.
        let weather = self.weather.as_ref().filter(|_| hit.miss >= -self.near);
        let weather_m = weather.map_or(0.0, |field| field.height_m(&(point * self.globe.a_m)));
        GroundPoint { painter: self, latitude_deg, weather_m, cloud }
    }
}

/// Latitude, weather and cloud under a ray.
struct GroundPoint<'a> {
    painter: &'a InfraredPainter,
    latitude_deg: f64,
    /// Height of the limb above that of its latitude, metres.
    weather_m: f64,
    /// Weight and light of a cloud; `None` under a clear sky.
    cloud: Option<(f32, f32)>,
}

impl GroundPoint<'_> {
    /// Returns the brightness of a ray with this tangent height in metres.
    fn brightness(&self, height_m: f64) -> f32 {
        let clear = self.painter.table.interpolate((height_m - self.weather_m) * 1e-3, self.latitude_deg);
        let light = self.cloud.map_or(clear, |(weight, cloud)| clear + weight * (cloud - clear));
        self.painter.space + light * (1.0 - self.painter.space)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_level_flips_with_the_season() {
        let july = Infrared { season_deg: Some(0.0), ..Infrared::default() };
        assert_eq!(july.half_level_by_latitude_km(), [[-90.0, 20.5], [0.0, 25.0], [90.0, 29.5]]);
        let january = Infrared { season_deg: Some(180.0), ..july.clone() };
        assert_eq!(january.half_level_at_km(90.0), 20.5);
        for lat in [-60.0, 0.0, 45.0] {
            let deep = july.curve(-1e3, lat);
            assert!((july.curve(july.half_level_at_km(lat), lat) / deep - 0.5).abs() < 1e-12);
        }
        // The two dates are 2021-07-15 and 2022-01-14.
        assert!(Infrared::season_deg(1_626_307_200.0) < 2.0);
        assert!((Infrared::season_deg(1_642_118_400.0) - 180.0).abs() < 2.0);
    }
}
