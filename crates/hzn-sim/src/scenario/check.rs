//! Checks of every value of a scenario against its limits.

use hzn_core::body::Kind;
use hzn_core::camera::Camera;
use hzn_files::utc;

use super::{Format, Scenario, ScenarioError};
use crate::infrared::Infrared;
use crate::scene::World;
use crate::texture::Clouds;
use crate::visible::Visible;

/// A key, its value, and the smallest and largest allowed value.
pub(super) struct Limit(String, f64, [f64; 2]);

/// No upper limit.
const UNLIMITED: f64 = f64::INFINITY;
/// Lower limit "above 0", for divisors.
pub(super) const ABOVE_ZERO: f64 = 1e-9;

impl Limit {
    fn new(key: impl Into<String>, value: f64, range: [f64; 2]) -> Self {
        Self(key.into(), value, range)
    }

    /// Returns the words of the key, for example `world`, `visible`, `air` and `brightness`.
    #[cfg(feature = "schema")]
    pub(super) fn path(&self) -> Vec<String> {
        let words = self.0.split(|c: char| "[]. ".contains(c));
        words.filter(|word| !word.is_empty()).map(str::to_owned).collect()
    }

    /// Returns the smallest and the largest allowed value.
    #[cfg(feature = "schema")]
    pub(super) fn range(&self) -> [f64; 2] {
        self.2
    }

    fn check(self) -> Result<(), ScenarioError> {
        let Self(key, value, [min, max]) = self;
        if value.is_finite() && value >= min && value <= max {
            return Ok(());
        }
        let low = if min == ABOVE_ZERO { "above 0".to_owned() } else { format!("{min}") };
        let rule = match (max == UNLIMITED, min == ABOVE_ZERO) {
            (true, true) => low,
            (true, false) => format!("{low} or more"),
            (false, true) => format!("{low}, at most {max}"),
            (false, false) => format!("{low} to {max}"),
        };
        Err(ScenarioError::new(key, format!("{value} is refused: must be {rule}")))
    }
}

impl Scenario {
    /// Checks all values.
    ///
    /// # Errors
    /// Returns the first value that is out of its limits, with the limit.
    pub fn check(&self) -> Result<(), ScenarioError> {
        let is_name = |name: &str| name.chars().all(|c| c.is_ascii_alphanumeric() || "-_.".contains(c));
        // A program would take such a picture as an option, and a spreadsheet as a formula.
        if self.name.is_empty() || self.name.starts_with('-') || !is_name(&self.name) {
            return Err(ScenarioError::new(
                "name",
                "must consist of letters, digits, '-', '_' and '.', and not begin with '-': the names of the pictures \
                 begin with it",
            ));
        }
        if utc::unix_s(&self.utc).is_none() {
            return Err(ScenarioError::new("utc", "must be a UTC date and time such as 2019-06-13T10:30:00Z"));
        }
        let refuse =
            |field: &str, value: f64, rule: &str| Err(ScenarioError::new(field, format!("{value} is refused: {rule}")));
        let c = &self.capture;
        if !(c.from_s.is_finite() && c.to_s.is_finite() && c.to_s >= c.from_s && (c.to_s - c.from_s) < 1e7) {
            return refuse("[capture] to_s", c.to_s, "must be finite and not before from_s");
        }
        Camera::<f64>::try_new(&self.camera).map_err(|e| {
            let shown = e.to_string();
            let rule = shown.split_once(": ").map_or(shown.as_str(), |(_, rule)| rule).to_owned();
            ScenarioError::new(format!("[camera] {}", e.field.trim_start_matches("camera.")), rule)
        })?;
        if !matches!(self.bodies.first(), Some(Kind::Earth | Kind::Sun | Kind::Moon))
            || self.bodies.iter().any(|b| matches!(b, Kind::Sphere | Kind::EarthSphere))
            || self.bodies.len() > 3
        {
            return Err(ScenarioError::new("bodies", "must be one to three of \"earth\", \"sun\", \"moon\""));
        }
        self.check_ellipsoid()?;
        self.check_cameras()?;
        self.check_rig()?;
        self.limits().into_iter().try_for_each(Limit::check)?;
        if c.format == Format::Jpeg && self.detector.bits != 8 {
            return refuse(
                "[detector] bits",
                self.detector.bits.into(),
                "must be 8 for JPEG; remove it, or set format = \"png\"",
            );
        }
        if let Some(part) = self.vehicle.iter().find(|p| !(3..=16).contains(&p.polygon_px.len())) {
            return refuse("[[vehicle]] polygon_px", part.polygon_px.len() as f64, "must have 3 to 16 corners");
        }
        for (table, mount) in [("mount", self.mount), ("attitude_mount", self.attitude_mount)] {
            let n2: f64 = mount.iter().flat_map(|m| m.q_vehicle_from_camera_wxyz).map(|x| x * x).sum();
            if mount.is_some() && !((n2 - 1.0).abs() < 0.01) {
                let key = format!("[{table}] q_vehicle_from_camera_wxyz");
                return refuse(&key, n2, "its squared length must be 1");
            }
        }
        self.check_halves_and_limb()?;
        self.imu.map_or(Ok(()), |imu| imu.check())?;
        self.gnss.as_ref().map_or(Ok(()), |gnss| gnss.check())?;
        Ok(())
    }

    fn check_halves_and_limb(&self) -> Result<(), ScenarioError> {
        if self.shutter.halves.is_none() && self.shutter.halves_s != 0.0 {
            let what = "has no effect without halves: write halves = \"chess\" or \"rows\", or remove it";
            return Err(ScenarioError::new("[shutter] halves_s", what));
        }
        if let World::Infrared(Infrared { limb: Some(limb), .. }) = &self.world
            && limb.thermal_km().is_none()
        {
            let what = "is no thermal band: write \"window-8-14um\" or \"co2-15um\", or remove it";
            return Err(ScenarioError::new("[world] infrared.limb", what));
        }
        Ok(())
    }

    /// Returns the limits of single numbers, in the order of the file.
    pub(super) fn limits(&self) -> Vec<Limit> {
        let share = [0.0, 1.0];
        let Self { capture, optics, shutter, exposure, detector, known, fault, .. } = self;
        let mut all = vec![
            Limit::new("[capture] frames", capture.frames.into(), [1.0, 1e5]),
            Limit::new("[capture] jpeg_quality", capture.jpeg_quality.into(), [1.0, 100.0]),
            Limit::new("[optics] vignetting", optics.vignetting, share),
            Limit::new("[optics] bloom", optics.bloom, [0.0, UNLIMITED]),
            Limit::new("[optics] veil", optics.veil, [0.0, UNLIMITED]),
            Limit::new("[optics] ghosts", optics.ghosts, [0.0, UNLIMITED]),
            Limit::new("[shutter] exposure_s", shutter.exposure_s, [0.0, UNLIMITED]),
            Limit::new("[shutter] readout_s", shutter.readout_s, [0.0, UNLIMITED]),
            Limit::new("[shutter] halves_s", shutter.halves_s, [0.0, UNLIMITED]),
            Limit::new("[exposure] gain", exposure.gain, [ABOVE_ZERO, UNLIMITED]),
            Limit::new("[exposure] target_mean", exposure.target_mean.unwrap_or(0.5), [ABOVE_ZERO, 1.0]),
            Limit::new("[exposure] lag_s", exposure.lag_s, [0.0, UNLIMITED]),
            Limit::new("[exposure] limits", exposure.limits[0], [ABOVE_ZERO, exposure.limits[1]]),
            Limit::new("[exposure] limits", exposure.limits[1], [ABOVE_ZERO, UNLIMITED]),
            Limit::new("[detector] psf_sigma_px", detector.psf_sigma_px, [0.0, 50.0]),
            Limit::new("[detector] read_noise", detector.read_noise, share),
            Limit::new("[detector] full_well_electrons", detector.full_well_electrons.unwrap_or(1.0), [1.0, UNLIMITED]),
            Limit::new("[detector] hot_pixels", detector.hot_pixels, share),
            Limit::new("[detector] offset_pattern", detector.offset_pattern, share),
            Limit::new("[detector] gain_pattern", detector.gain_pattern, share),
            Limit::new("[detector] bits", detector.bits.into(), [8.0, 16.0]),
            Limit::new("mount_error_deg", self.mount_error_deg, [0.0, 45.0]),
            Limit::new("[clock] offset_s", self.clock.offset_s, [-1e6, 1e6]),
            Limit::new("[clock] latency_s", self.clock.latency_s, [0.0, 1e3]),
            Limit::new("[fault] turn_from_s", self.fault.turn_from_s, [-1e7, 1e7]),
            Limit::new("[fault] frozen_from_s", self.fault.frozen_from_s.unwrap_or_default(), [-1e7, 1e7]),
            Limit::new("[fault] late_s", self.fault.late_s, [-1e3, 1e3]),
            Limit::new("[clock] jitter_s", self.clock.jitter_s, [0.0, 1e3]),
            Limit::new("[known] position_sigma_km", known.position_sigma_km, [0.0, UNLIMITED]),
            Limit::new("[known] range_sigma_km", known.range_sigma_km.unwrap_or(1.0), [ABOVE_ZERO, UNLIMITED]),
            Limit::new("[known] attitude_sigma_deg", known.attitude_sigma_deg.unwrap_or(1.0), [ABOVE_ZERO, 180.0]),
        ];
        all.extend(fault.turn_deg.map(|deg| Limit::new("[fault] turn_deg", deg, [-180.0, 180.0])));
        for part in &self.vehicle {
            all.push(Limit::new("[[vehicle]] brightness", part.brightness, [0.0, UNLIMITED]));
            let corners = part.polygon_px.iter().flatten();
            all.extend(corners.map(|x| Limit::new("[[vehicle]] polygon_px", *x, [-1e5, 1e5])));
        }
        match &self.world {
            World::Visible(world) => all.extend(visible_limits(world)),
            World::Infrared(world) => all.extend(infrared_limits(world)),
            // An ellipsoid checks itself.
            World::Plain | World::Ellipsoid(_) => {}
        }
        all
    }
}

fn visible_limits(world: &Visible) -> Vec<Limit> {
    let Visible { ground, air, .. } = world;
    let limit = |key: &str, value: f64, range: [f64; 2]| Limit::new(format!("[world] visible.{key}"), value, range);
    let mut all = vec![
        limit("star_brightness", world.star_brightness, [0.0, UNLIMITED]),
        limit("ground.land", ground.land, [0.0, 1.0]),
        limit("ground.ice_deg", ground.ice_deg, [0.0, 90.0]),
        limit("air.scale_height_km", air.scale_height_km, [0.1, 100.0]),
        limit("air.brightness", air.brightness, [0.0, UNLIMITED]),
    ];
    all.extend(air.optical_depth.map(|depth| limit("air.optical_depth", depth, [0.0, 100.0])));
    all.extend(cloud_limits("[world] visible.clouds", &world.clouds));
    all
}

fn infrared_limits(world: &Infrared) -> Vec<Limit> {
    let limit = |key: &str, value: f64, range: [f64; 2]| Limit::new(format!("[world] infrared.{key}"), value, range);
    let mut all = vec![
        limit("season_deg", world.season_deg.unwrap_or(0.0), [-360.0, 360.0]),
        limit("brightness", world.brightness, [ABOVE_ZERO, 1.0]),
        limit("by_latitude", world.by_latitude, [-0.9, 0.9]),
        limit("half_level_km", world.half_level_km, [-100.0, 300.0]),
        limit("half_level_season_km", world.half_level_season_km, [-100.0, 100.0]),
        limit("scale_km", world.scale_km, [0.01, 50.0]),
        limit("space", world.space, [0.0, 0.99]),
    ];
    all.extend(world.clouds.iter().flat_map(|clouds| cloud_limits("[world] infrared.clouds", clouds)));
    if let Some(weather) = &world.weather {
        all.push(limit("weather.sigma_km", weather.sigma_km, [0.0, 50.0]));
        all.push(limit("weather.length_km", weather.length_km, [10.0, 1e5]));
    }
    all
}

fn cloud_limits(table: &str, clouds: &Clouds) -> Vec<Limit> {
    let limit = |key: &str, value: f64, range: [f64; 2]| Limit::new(format!("{table}.{key}"), value, range);
    vec![
        limit("cover", clouds.cover, [0.0, 1.0]),
        limit("largest_km", clouds.largest_km, [0.01, 20_000.0]),
        limit("smallest_km", clouds.smallest_km, [0.01, clouds.largest_km]),
        limit("softness", clouds.softness, [0.0, 1.0]),
        limit("brightness", clouds.brightness, [0.0, UNLIMITED]),
    ]
}
