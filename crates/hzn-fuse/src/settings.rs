//! fuse.toml: what the filter estimates, considers, or leaves out, and how well everything is known.

use std::collections::BTreeMap;
use std::path::Path;

use hzn_files::limited;
use hzn_nav::frames::{Cam, Rotation, Vehicle};
use hzn_nav::options::{Block, CameraOptions, ImuOptions, Mode, Options, StartSigmas};
use serde::{Deserialize, Serialize};

use crate::error::Error;
use crate::input::Fix;

/// How the filter treats an error.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Treatment {
    /// The filter estimates and corrects it.
    Estimated,
    /// It widens the covariance, and is not corrected.
    Considered,
    /// It does not exist.
    Off,
}

/// An error with its 1-sigma at the start, in the unit that the key names.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ErrorSetting {
    /// How the filter treats it.
    pub mode: Treatment,
    /// 1-sigma of each component; 0 or more.
    pub sigma: f64,
}

impl ErrorSetting {
    const fn estimated(sigma: f64) -> Self {
        Self { mode: Treatment::Estimated, sigma }
    }
    const fn considered(sigma: f64) -> Self {
        Self { mode: Treatment::Considered, sigma }
    }
    fn block(self, unit: f64) -> Block {
        Block { mode: mode(self.mode), sigma: self.sigma * unit }
    }
}

/// An error of a lens. Without a sigma it is that of the recording's sensor.toml; without that the lens is exact.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LensSetting {
    /// How a solve of the whole flight treats it. With an inertial unit `considered` and `estimated` are the same: it
    /// is an unknown with this prior. In an orbit, `considered` widens the covariance, and is not corrected. With
    /// `off` it stays a part of each direction's covariance, as it is for the filter.
    pub mode: Treatment,
    /// 1-sigma; 0 or more.
    pub sigma: Option<f64>,
}

impl LensSetting {
    const CONSIDERED: Self = Self { mode: Treatment::Considered, sigma: None };

    /// Returns the 1-sigma; `told` is that of the sensor.toml. It is 0 for a parameter that is no unknown.
    pub(crate) fn sigma_or(&self, told: f64) -> f64 {
        if self.mode == Treatment::Off { 0.0 } else { self.sigma.unwrap_or(told) }
    }
}

fn mode(treatment: Treatment) -> Mode {
    match treatment {
        Treatment::Estimated => Mode::Estimated,
        Treatment::Considered => Mode::Considered,
        Treatment::Off => Mode::Off,
    }
}

/// The inertial measurement unit.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Imu {
    /// Bias of the accelerometers, mg.
    pub accel_bias_mg: ErrorSetting,
    /// Scale factor error of the accelerometers, parts per million.
    pub accel_scale_ppm: ErrorSetting,
    /// Rotation of the accelerometers' axes, mrad.
    pub accel_misalignment_mrad: ErrorSetting,
    /// Bias of the gyros, degrees per hour.
    pub gyro_bias_deg_h: ErrorSetting,
    /// Scale factor error of the gyros, parts per million.
    pub gyro_scale_ppm: ErrorSetting,
    /// Rotation of the gyros' axes, mrad.
    pub gyro_misalignment_mrad: ErrorSetting,
    /// White noise of the accelerometers, and the noise that stands for unmodelled errors, mg/√Hz.
    pub accel_noise_mg_rthz: [f64; 2],
    /// White noise of the gyros, and the noise that stands for unmodelled errors, °/√h.
    pub gyro_noise_deg_rth: [f64; 2],
    /// Longest time between two samples, s. A longer one is a gap.
    pub max_step_s: f64,
    /// 1-sigma of the rate during a gap and during saturation, °/s.
    pub gap_rate_deg_s: f64,
    /// 1-sigma of the specific force during a gap and during saturation, m/s².
    pub gap_accel_mps2: f64,
}

impl Default for Imu {
    fn default() -> Self {
        Self {
            accel_bias_mg: ErrorSetting::estimated(2.0),
            accel_scale_ppm: ErrorSetting::considered(300.0),
            accel_misalignment_mrad: ErrorSetting::considered(2.0),
            gyro_bias_deg_h: ErrorSetting::considered(6.0),
            gyro_scale_ppm: ErrorSetting::considered(2000.0),
            gyro_misalignment_mrad: ErrorSetting::considered(2.0),
            accel_noise_mg_rthz: [0.05, 2.5],
            gyro_noise_deg_rth: [0.05, 2.5],
            max_step_s: 0.5,
            gap_rate_deg_s: 57.3,
            gap_accel_mps2: 50.0,
        }
    }
}

/// A camera.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Camera {
    /// Error of the mount, degrees.
    pub misalignment_deg: ErrorSetting,
    /// The slowly changing error of a direction; its sigma is that of the direction.
    pub slow_error: Treatment,
    /// Correlation time of the slow error, s.
    pub slow_error_time_s: f64,
    /// White noise of a direction, rad.
    pub white_rad: f64,
    /// Time that the camera's clock differs from that of the inertial unit, s.
    pub clock_s: ErrorSetting,
    /// Which measurement the filter takes from a row that has both: the limb's axis, or the position.
    pub limb: Limb,
    /// Focal length, percent: an unknown of a solve of the whole flight, or of the orbit.
    pub focal_percent: LensSetting,
    /// Each coordinate of the principal point, px: an unknown of a solve of the whole flight, or of the orbit.
    pub centre_px: LensSetting,
}

/// The measurement that the filter takes from a row with a limb.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Limb {
    /// The direction of the axis.
    #[default]
    Axis,
    /// The position of the body's centre (columns `position_*`); the axis of rows without one.
    Position,
}

impl Default for Camera {
    fn default() -> Self {
        Self {
            misalignment_deg: ErrorSetting::estimated(1.0),
            slow_error: Treatment::Considered,
            slow_error_time_s: 20.0,
            white_rad: 0.005,
            clock_s: ErrorSetting::estimated(0.2),
            limb: Limb::Axis,
            focal_percent: LensSetting::CONSIDERED,
            centre_px: LensSetting::CONSIDERED,
        }
    }
}

/// What is known at the start.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Start {
    /// The first attitude comes from the directions in a window of this length, s.
    pub window_s: f64,
    /// Smallest 1-sigma of the first attitude about each axis, degrees.
    pub attitude_deg: f64,
}

impl Default for Start {
    fn default() -> Self {
        Self { window_s: 10.0, attitude_deg: 2.0 }
    }
}

/// The limb height.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct LimbHeight {
    /// Error of the limb height, km: common to all cameras, and constant. Without a sigma it is that of the recordings'
    /// sensor.toml, else 7 km.
    pub mode: Treatment,
    /// 1-sigma, km.
    pub sigma_km: Option<f64>,
    /// 1-sigma of its change with the latitude φ of the limb, km: of c₁ and c₂ in c₁ sin φ + c₂ (3 sin² φ − 1)/2. With
    /// 0 the error is the same at all latitudes.
    pub latitude_sigma_km: f64,
}

impl Default for LimbHeight {
    fn default() -> Self {
        Self { mode: Treatment::Considered, sigma_km: None, latitude_sigma_km: 0.0 }
    }
}

/// The satellite navigation receiver, where its file has no sigma.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Gnss {
    /// 1-sigma of each component of a position, m.
    pub position_sigma_m: f64,
    /// 1-sigma of each component of a velocity, m/s.
    pub velocity_sigma_mps: f64,
}

impl Default for Gnss {
    fn default() -> Self {
        Self { position_sigma_m: 10.0, velocity_sigma_mps: 0.2 }
    }
}

/// The orbit of a satellite without an inertial unit.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Orbit {
    /// Accelerations beyond drag and the gravity to J4, as white noise, m/s²/√Hz: harmonics with the longitude are
    /// 3·10⁻⁵ m/s² in low orbit and last some minutes.
    pub accel_noise_mps2_rthz: f64,
    /// Correlation time of the slow error of a limb, s, instead of that of the camera: in a quarter of an orbit another
    /// part of the limb, with another light and weather, comes into view.
    pub slow_error_time_s: f64,
    /// Ballistic coefficient: drag coefficient 2.2 times area over mass, m²/kg. Small satellites with panels have 0.04,
    /// compact ones 0.005. With 0 there is no drag.
    pub ballistic_m2_kg: f64,
    /// 1-sigma of the drag, in percent of that of a mean Sun with `ballistic_m2_kg`. It is considered: it widens the
    /// covariance, and is not estimated. The density of the air at 300 km changes by a factor of 3 with the Sun.
    pub drag_sigma_percent: f64,
}

impl Default for Orbit {
    fn default() -> Self {
        Self {
            accel_noise_mps2_rthz: 1e-3,
            slow_error_time_s: 1400.0,
            ballistic_m2_kg: 0.02,
            drag_sigma_percent: 100.0,
        }
    }
}

/// The content of a fuse.toml. Every key may be left out. The defaults are those of Braun & Barf 2022, table 3.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Settings {
    /// A measurement is refused if the square of its innovation over its covariance is above the value that a right one
    /// exceeds with this probability.
    pub gate_probability: f64,
    /// The filter begins again after this many directions in a row of which four fifths were refused.
    pub restart_after: u32,
    /// The inertial measurement unit.
    pub imu: Imu,
    /// Every camera.
    pub camera: Camera,
    /// A camera by the name of its recording, instead of `camera`.
    pub cameras: BTreeMap<String, Camera>,
    /// What is known at the start.
    pub start: Start,
    /// The limb height.
    pub limb_height: LimbHeight,
    /// The satellite navigation receiver.
    pub gnss: Gnss,
    /// The orbit of a satellite without an inertial unit.
    pub orbit: Orbit,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            gate_probability: 1e-4,
            restart_after: 20,
            imu: Imu::default(),
            camera: Camera::default(),
            cameras: BTreeMap::new(),
            start: Start::default(),
            limb_height: LimbHeight::default(),
            gnss: Gnss::default(),
            orbit: Orbit::default(),
        }
    }
}

/// Standard gravity, m/s².
const G_M_S2: f64 = 9.80665;

impl Settings {
    /// Reads a fuse.toml.
    ///
    /// # Errors
    /// The file cannot be read, or a key or value is refused; the message has the line and the key.
    ///
    /// ```
    /// # let folder = tempfile::tempdir()?;
    /// let path = folder.path().join("fuse.toml");
    /// std::fs::write(&path, "[limb_height]\nsigma_km = -1.0\n")?;
    /// let refused = hzn_fuse::Settings::load(&path).unwrap_err().to_string();
    /// let why = "fuse.toml:2: [limb_height] sigma_km: -1 is refused: must be 0 or more";
    /// assert!(refused.ends_with(why), "{refused}");
    /// # Ok::<(), std::io::Error>(())
    /// ```
    pub fn load(path: &Path) -> Result<Self, Error> {
        let text = limited::read_text(path, limited::SETTINGS_BYTES)
            .map_err(|e| Error::unusable(format!("{}: {e}", path.display())))?;
        hzn_files::document::parse(&text, path, Self::check).map_err(Error::unusable)
    }

    /// Fails for the first value that is out of its limits, with its key and the rule.
    ///
    /// # Errors
    /// The key as `[section] key`, and the rule.
    pub fn check(&self) -> Result<(), (String, String)> {
        let imu = &self.imu;
        let sigma = |key: &str, value: f64| (key.to_owned(), value, value.is_finite() && value >= 0.0, "0 or more");
        let above = |key: &str, value: f64| (key.to_owned(), value, value.is_finite() && value > 0.0, "above 0");
        let mut all = vec![
            (
                "gate_probability".to_owned(),
                self.gate_probability,
                (1e-12..=0.5).contains(&self.gate_probability),
                "1e-12 to 0.5",
            ),
            above("restart_after", f64::from(self.restart_after)),
            sigma("[imu] accel_bias_mg", imu.accel_bias_mg.sigma),
            sigma("[imu] accel_scale_ppm", imu.accel_scale_ppm.sigma),
            sigma("[imu] accel_misalignment_mrad", imu.accel_misalignment_mrad.sigma),
            sigma("[imu] gyro_bias_deg_h", imu.gyro_bias_deg_h.sigma),
            sigma("[imu] gyro_scale_ppm", imu.gyro_scale_ppm.sigma),
            sigma("[imu] gyro_misalignment_mrad", imu.gyro_misalignment_mrad.sigma),
            above("[imu] max_step_s", imu.max_step_s),
            sigma("[imu] gap_rate_deg_s", imu.gap_rate_deg_s),
            sigma("[imu] gap_accel_mps2", imu.gap_accel_mps2),
            above("[start] window_s", self.start.window_s),
            above("[start] attitude_deg", self.start.attitude_deg),
            sigma("[limb_height] sigma_km", self.limb_height.sigma_km.unwrap_or(0.0)),
            sigma("[limb_height] latitude_sigma_km", self.limb_height.latitude_sigma_km),
            above("[gnss] position_sigma_m", self.gnss.position_sigma_m),
            above("[gnss] velocity_sigma_mps", self.gnss.velocity_sigma_mps),
            above("[orbit] accel_noise_mps2_rthz", self.orbit.accel_noise_mps2_rthz),
            above("[orbit] slow_error_time_s", self.orbit.slow_error_time_s),
            sigma("[orbit] ballistic_m2_kg", self.orbit.ballistic_m2_kg),
            sigma("[orbit] drag_sigma_percent", self.orbit.drag_sigma_percent),
        ];
        all.extend(imu.accel_noise_mg_rthz.map(|x| sigma("[imu] accel_noise_mg_rthz", x)));
        all.extend(imu.gyro_noise_deg_rth.map(|x| sigma("[imu] gyro_noise_deg_rth", x)));
        let named = self.cameras.iter().map(|(name, camera)| (format!("[cameras.{name}]"), camera));
        for (section, camera) in std::iter::once(("[camera]".to_owned(), &self.camera)).chain(named) {
            all.push(sigma(&format!("{section} misalignment_deg"), camera.misalignment_deg.sigma));
            all.push(above(&format!("{section} slow_error_time_s"), camera.slow_error_time_s));
            all.push(sigma(&format!("{section} white_rad"), camera.white_rad));
            all.push(sigma(&format!("{section} clock_s"), camera.clock_s.sigma));
            all.push(sigma(&format!("{section} focal_percent"), camera.focal_percent.sigma.unwrap_or(0.0)));
            all.push(sigma(&format!("{section} centre_px"), camera.centre_px.sigma.unwrap_or(0.0)));
        }
        match all.into_iter().find(|(_, _, is_valid, _)| !is_valid) {
            Some((key, value, _, rule)) => Err((key, format!("{value} is refused: must be {rule}"))),
            None => Ok(()),
        }
    }

    /// Returns the settings of a camera by its name.
    pub fn camera(&self, name: &str) -> &Camera {
        self.cameras.get(name).unwrap_or(&self.camera)
    }

    /// Returns the options of the filter. `limb_sigma_km` is the sigma of the limb height that the recordings tell.
    pub fn options(&self, limb_sigma_km: Option<f64>, start: StartSigmas) -> Options {
        let rad = f64::to_radians(1.0);
        let imu = &self.imu;
        let limb_sigma_km = self.limb_height.sigma_km.or(limb_sigma_km).unwrap_or(7.0);
        Options {
            imu: ImuOptions {
                accel_bias: imu.accel_bias_mg.block(1e-3 * G_M_S2),
                accel_scale: imu.accel_scale_ppm.block(1e-6),
                accel_misalignment: imu.accel_misalignment_mrad.block(1e-3),
                gyro_bias: imu.gyro_bias_deg_h.block(rad / 3600.0),
                gyro_scale: imu.gyro_scale_ppm.block(1e-6),
                gyro_misalignment: imu.gyro_misalignment_mrad.block(1e-3),
                accel_noise: imu.accel_noise_mg_rthz.map(|x| x * 1e-3 * G_M_S2),
                gyro_noise: imu.gyro_noise_deg_rth.map(|x| x * rad / 60.0),
                max_step_s: imu.max_step_s,
                gap_rate_rad_s: imu.gap_rate_deg_s * rad,
                gap_accel_m_s2: imu.gap_accel_mps2,
            },
            start,
            limb_height: Block { mode: mode(self.limb_height.mode), sigma: limb_sigma_km },
            limb_latitude: if self.limb_height.latitude_sigma_km > 0.0 {
                Block { mode: mode(self.limb_height.mode), sigma: self.limb_height.latitude_sigma_km }
            } else {
                Block { mode: Mode::Off, sigma: 0.0 }
            },
            gate_probability: self.gate_probability,
        }
    }

    /// Returns the sigmas of a fix, m and m/s: its own, else those of the settings.
    pub fn fix_sigmas(&self, fix: &Fix) -> [f64; 2] {
        let or = |own: f64, default: f64| if own > 0.0 && own.is_finite() { own } else { default };
        [or(fix.position_sigma_m, self.gnss.position_sigma_m), or(fix.velocity_sigma_m_s, self.gnss.velocity_sigma_mps)]
    }

    /// Returns the options of a camera with its mount, that sees a number of bodies.
    pub fn camera_options(&self, name: &str, mount: Rotation<Cam, Vehicle>, bodies: usize) -> CameraOptions {
        let camera = self.camera(name);
        CameraOptions {
            mount,
            misalignment: camera.misalignment_deg.block(f64::to_radians(1.0)),
            slow_error: mode(camera.slow_error),
            slow_error_time_s: camera.slow_error_time_s,
            bodies,
            white_rad: camera.white_rad,
            clock: camera.clock_s.block(1.0),
        }
    }
}
