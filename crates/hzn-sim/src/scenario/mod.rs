//! A whole simulated sequence in one description: the content of a `scene.toml`.
//!
//! A [`Scenario`] becomes a [`Flight`](crate::Flight): scenes with truth, and the sensor that takes them. [`BUILTIN`]
//! has the scenes that come with hzn. The command line reads the file, with lines and suggestions in errors.
//! [`Scenario::check`] checks every value, and [`Scenario::flight`] checks that something can be seen.

mod cameras;
mod check;
mod exposure;
mod file;
mod fly;
mod noise;
mod planet;
mod rig;
#[cfg(feature = "schema")]
pub mod schema;
mod view;

pub use cameras::{CameraOnVehicle, Clock, Fault};
pub use exposure::Exposure;
pub use file::{load, parse, refused, source};
pub use noise::{FIT_PICTURES, Fit, median_rms_px};
pub use planet::BodyFrameRow;

use std::path::{Path as FilePath, PathBuf};

use hzn_core::body::{self, Kind};
use hzn_core::camera;
use hzn_core::config::Mount;
use hzn_core::ellipsoid::EARTH_MEAN_RADIUS_M;
use hzn_files::rig::Common;
use hzn_files::utc;
use serde::{Deserialize, Serialize};

use crate::detector::Detector;
use crate::halves::Order;
use crate::optics::Optics;
use crate::scene::World;
use crate::trajectory::instruments::{Gnss, Imu};
use crate::trajectory::{Attitude, Path, Trajectory};

/// Scenes that come with hzn: name, description, text of the scene.toml.
pub const BUILTIN: [(&str, &str, &str); 16] = [
    (
        "rocket",
        "sounding rocket with the Sun, lens ghosts and payload in view, colour JPEG 1920x1080",
        include_str!("builtin/rocket.toml"),
    ),
    (
        "rocket-clean",
        "sounding rocket at noon without Sun, ghosts and payload in view, grey 1920x1080",
        include_str!("builtin/rocket-clean.toml"),
    ),
    (
        "leo-infrared",
        "infrared Earth sensor in low orbit, from nadir to 120 degrees off it, 384x288",
        include_str!("builtin/leo-infrared.toml"),
    ),
    (
        "thermal-array",
        "thermal array of 32x24 pixels over 110 degrees in low orbit, two half pictures",
        include_str!("builtin/thermal-array.toml"),
    ),
    (
        "horace",
        "HORACE's camera on a spinning rocket, motion blur and auto-exposure, 27 degrees wide, grey 1024x768",
        include_str!("builtin/horace.toml"),
    ),
    (
        "horace-wide",
        "the same flight through a lens of 59 degrees, grey 640x480",
        include_str!("builtin/horace-wide.toml"),
    ),
    (
        "full-disc",
        "the whole Earth from a high orbit, with its phases, 1024x1024",
        include_str!("builtin/full-disc.toml"),
    ),
    ("sun-moon", "Sun and Moon through a long lens, 1024x768", include_str!("builtin/sun-moon.toml")),
    ("tumble", "tumbling satellite, the limb in view now and then, 1280x960", include_str!("builtin/tumble.toml")),
    (
        "atek",
        "the rocket with two cameras that nobody synchronised, inertial unit and receiver, 1920x1080",
        include_str!("builtin/atek.toml"),
    ),
    (
        "ring",
        "four infrared Earth sensors around one satellite, with a rig.toml, 640x480",
        include_str!("builtin/ring.toml"),
    ),
    (
        "pair",
        "two cameras on both sides of the rocket, synchronised, with a rig.toml, 960x540",
        include_str!("builtin/pair.toml"),
    ),
    (
        "jupiter",
        "approach to Jupiter, from a disc of 8 px to one wider than the picture, 1024x1024",
        include_str!("builtin/jupiter.toml"),
    ),
    (
        "enceladus",
        "tri-axial Enceladus from full disc to a crescent at phase 165 degrees, 1024x1024",
        include_str!("builtin/enceladus.toml"),
    ),
    ("saturn", "Saturn with rings in front of its limb, 1024x1024", include_str!("builtin/saturn.toml")),
    (
        "geo",
        "the Earth as an ellipsoid from geostationary range, full and gibbous, 1024x1024",
        include_str!("builtin/geo.toml"),
    ),
];

/// The JSON schema of scene.toml, which `scenario::schema` makes of the structures below and `cargo xtask keys` writes.
pub const SCHEMA: &str = include_str!("scene.schema.json");

/// A simulated sequence.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Scenario {
    /// Short name; the names of the pictures begin with it.
    pub name: String,
    /// Seed of all random numbers.
    #[serde(default = "one")]
    pub seed: u64,
    /// UTC of time 0, as a TOML date and time. It sets the positions of Sun and Moon, and the season.
    #[cfg_attr(feature = "schema", schemars(with = "String"))]
    pub utc: toml::value::Datetime,
    /// Bodies that the sensor looks for and that truth.csv lists: `earth`, `sun`, `moon`. A scene with
    /// `[world.ellipsoid]` has that body only.
    #[serde(default = "earth")]
    #[cfg_attr(feature = "schema", schemars(schema_with = "crate::foreign_schema::bodies"))]
    pub bodies: Vec<Kind>,
    /// Times and file format of the pictures.
    pub capture: Capture,
    /// The lens and the size of the picture, as in sensor.toml.
    #[cfg_attr(feature = "schema", schemars(schema_with = "crate::foreign_schema::camera"))]
    pub camera: camera::Config,
    /// Attitude of the camera on the vehicle, as in sensor.toml.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[cfg_attr(feature = "schema", schemars(schema_with = "crate::foreign_schema::mount"))]
    pub mount: Option<Mount>,
    /// Told attitude on the vehicle of the camera that `attitude` describes (`pointing`, `towards`, `aimed`, `table`).
    /// Without it, that is the first of `cameras`, or the camera of `mount`. [`Scenario::by_camera`] sets it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[cfg_attr(feature = "schema", schemars(schema_with = "crate::foreign_schema::mount"))]
    pub attitude_mount: Option<Mount>,
    /// Angle between the true mount of the camera and the told one, 1-sigma about each axis, degrees.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub mount_error_deg: f64,
    /// The clock of the camera.
    #[serde(default, skip_serializing_if = "Clock::is_right")]
    pub clock: Clock,
    /// Number of the camera on a vehicle with several: random numbers of the picture depend on it.
    #[serde(default, skip_serializing_if = "is_first")]
    pub camera_number: u32,
    /// The cameras of a vehicle with several; empty for one. Each replaces `name`, `mount`, `mount_error_deg`,
    /// `clock`, `fault` and `vehicle`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub cameras: Vec<CameraOnVehicle>,
    /// Faults of the camera.
    #[serde(default, skip_serializing_if = "Fault::is_none")]
    pub fault: Fault,
    /// The cameras are the heads of a rig: `hzn simulate` writes a rig.toml with these keys of its `[rig]`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rig: Option<Common>,
    /// Trajectory of the vehicle.
    pub trajectory: Trajectory,
    /// Attitude of the vehicle.
    pub attitude: Attitude,
    /// World in front of the camera.
    pub world: World,
    /// Imperfections of the lens.
    #[serde(default)]
    pub optics: Optics,
    /// Exposure and readout time of a picture.
    #[serde(default)]
    pub shutter: Shutter,
    /// Gain of the pictures, or its controller.
    #[serde(default)]
    pub exposure: Exposure,
    /// Detector, which turns light into numbers.
    #[serde(default)]
    pub detector: Detector,
    /// Parts of the vehicle in the picture.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub vehicle: Vec<Part>,
    /// Prior that the sensor gets with the pictures.
    #[serde(default)]
    pub known: Known,
    /// Inertial sensors, for imu.csv.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub imu: Option<Imu>,
    /// Satellite navigation receiver, for gnss.csv.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gnss: Option<Gnss>,
}

fn one() -> u64 {
    1
}
fn is_zero(x: &f64) -> bool {
    *x == 0.0
}
fn is_first(number: &u32) -> bool {
    *number == 0
}
fn earth() -> Vec<Kind> {
    vec![Kind::Earth]
}

/// `[capture]`: times and file format of the pictures.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Capture {
    /// Time of the first picture, seconds from time 0.
    #[serde(default)]
    pub from_s: f64,
    /// Time of the last picture, seconds from time 0.
    pub to_s: f64,
    /// Number of pictures, evenly spaced in time, 1 to 100000.
    pub frames: u32,
    /// File format of the pictures.
    #[serde(default)]
    pub format: Format,
    /// Quality of JPEG files, 1 to 100.
    #[serde(default = "quality")]
    pub jpeg_quality: u8,
}

fn quality() -> u8 {
    92
}

/// Format of the pictures.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum Format {
    /// Lossless; 8 or 16 bits.
    #[default]
    Png,
    /// With losses; 8 bits.
    Jpeg,
}

impl Format {
    /// Returns the ending of the file names, without a dot.
    pub fn ending(self) -> &'static str {
        match self {
            Self::Png => "png",
            Self::Jpeg => "jpg",
        }
    }
}

/// `[shutter]`: exposure and readout time of a picture. If both are zero, a picture takes no time.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields)]
pub struct Shutter {
    /// Exposure time of a row, seconds.
    pub exposure_s: f64,
    /// Time from the first row's exposure to the last row's exposure, seconds; 0 is a global shutter.
    pub readout_s: f64,
    /// Pixels of two half pictures that are taken one after the other, as thermal arrays do: `chess` or `rows`. Without
    /// it, the picture is taken at once.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub halves: Option<Order>,
    /// Time from the first half picture to the second, seconds. The time of the picture is in the middle.
    pub halves_s: f64,
}

/// `[[vehicle]]`: a part of the vehicle in the picture.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Part {
    /// Corners (x, y) in pixels; the last corner is joined to the first.
    pub polygon_px: Vec<[f64; 2]>,
    /// Brightness of the part; a white surface under the Sun has 1.
    pub brightness: f64,
    /// If true, sensor.toml masks the part, four pixels beyond its outline.
    #[serde(default)]
    pub masked: bool,
}

/// `[known]`: errors of the prior in frames.csv and sensor.toml.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields)]
pub struct Known {
    /// 1-sigma error of every component of the position, kilometres.
    pub position_sigma_km: f64,
    /// 1-sigma error of the prior attitude in frames.csv about each axis, degrees. Without it frames.csv has no
    /// attitude.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub attitude_sigma_deg: Option<f64>,
    /// 1-sigma error of the distance to the centre of an ellipsoid, kilometres. Without it frames.csv has no range.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub range_sigma_km: Option<f64>,
}

/// The reason why a scenario is invalid.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{field}: {what}")]
pub struct ScenarioError {
    /// The key, for example `[capture] frames`.
    pub field: String,
    /// Description of the error, and how to correct it.
    pub what: String,
}

impl ScenarioError {
    fn new(field: impl Into<String>, what: impl Into<String>) -> Self {
        Self { field: field.into(), what: what.into() }
    }
}

impl From<(String, String)> for ScenarioError {
    fn from((field, what): (String, String)) -> Self {
        Self { field, what }
    }
}

impl Scenario {
    /// Returns a scene that comes with hzn; `None` for an unknown name.
    ///
    /// # Panics
    /// Never: the tests read every built-in scene.
    pub fn builtin(name: &str) -> Option<Self> {
        let text = BUILTIN.iter().find(|b| b.0 == name)?.2;
        Some(toml::from_str(text).expect("built-in scenes are valid"))
    }

    /// Reads and checks the text of a scene.toml; `path` is used in messages. It does not read the files that the
    /// scenario names.
    ///
    /// # Errors
    /// The first key or value that is refused, with its line.
    pub fn parse(text: &str, path: &FilePath) -> Result<Self, hzn_files::Problem> {
        let check = |scenario: &Self| scenario.check().map_err(|e| (e.field, e.what));
        hzn_files::document::parse(text, path, check)
    }

    /// Returns the scenario as the text of a scene.toml.
    ///
    /// # Errors
    /// A value is not TOML, for example a seed above 2⁶³.
    pub fn to_text(&self) -> Result<String, toml::ser::Error> {
        toml::to_string(self)
    }

    /// Reads the files that the scenario names (maps, tables); their paths are relative to `folder`.
    ///
    /// # Errors
    /// Fails if a file cannot be read.
    pub fn read_files(&mut self, folder: &FilePath) -> Result<(), ScenarioError> {
        if let World::Visible(world) = &mut self.world {
            world.ground.read_map(folder).map_err(|e| ScenarioError::new("[world] visible.ground.map", e))?;
        }
        if let World::Infrared(world) = &mut self.world {
            world.read_table(folder).map_err(|e| ScenarioError::new("[world] infrared.table", e))?;
        }
        if let Trajectory::Table(table) = &mut self.trajectory {
            table.read(folder).map_err(|e| ScenarioError::new("[trajectory] table.file", e))?;
        }
        Ok(())
    }

    /// Returns the paths of the files that the scenario names, each with a word for its content.
    pub fn files_mut(&mut self) -> Vec<(&'static str, &mut PathBuf)> {
        let world = match &mut self.world {
            World::Visible(world) => world.ground.map.as_mut().map(|map| ("map", map)),
            World::Infrared(world) => world.table.as_mut().map(|table| ("radiance", table)),
            World::Plain | World::Ellipsoid(_) => None,
        };
        let trajectory = match &mut self.trajectory {
            Trajectory::Table(table) => Some(("trajectory", &mut table.file)),
            Trajectory::Rocket(_) | Trajectory::Orbit(_) | Trajectory::Encounter(_) => None,
        };
        world.into_iter().chain(trajectory).collect()
    }

    /// Returns UTC of time 0 in seconds since 1970.
    pub fn start_unix_s(&self) -> f64 {
        utc::unix_s(&self.utc).unwrap_or(0.0)
    }

    /// Returns the times of the first and the last picture, seconds.
    pub fn span_s(&self) -> [f64; 2] {
        [self.capture.from_s, self.capture.to_s]
    }

    /// Prepares trajectory and attitude.
    ///
    /// # Errors
    /// Fails for an invalid value and names its key.
    pub fn path(&self) -> Result<Path, ScenarioError> {
        let [from_s, to_s] = self.span_s();
        let early_s = [self.imu.and_then(|imu| imu.from_s), self.gnss.as_ref().and_then(|gnss| gnss.from_s)];
        let from_s = early_s.into_iter().flatten().fold(from_s, f64::min);
        // A table covers only its rows; the other trajectories need a span above zero.
        let span = match self.trajectory {
            Trajectory::Table(_) => [from_s, to_s],
            _ => [from_s, to_s.max(from_s + 1e-3)],
        };
        let told = self.pointed_mount().map_or([1.0, 0.0, 0.0, 0.0], |m| m.q_vehicle_from_camera_wxyz);
        let start_unix_s = self.start_unix_s();
        let path = Path::try_new(&self.sized_trajectory(), &self.attitude, told, span, start_unix_s, self.seed)?;
        Ok(path.with_camera(self.true_q_vehicle_from_camera_wxyz()))
    }

    /// Returns the sensor's configuration of a body, with the limb height of the simulated limb.
    pub fn body_config(&self, kind: Kind) -> body::Config {
        if let Some(body) = self.ellipsoid() {
            return Self::ellipsoid_config(body);
        }
        let limb_height_km = match (&self.world, kind) {
            (_, Kind::Sun | Kind::Moon) => 0.0,
            (World::Visible(w), _) => w.air.half_height_km([1.0 / 3.0; 3], EARTH_MEAN_RADIUS_M / 1e3),
            (World::Infrared(w), _) => w.with_season(self.start_unix_s()).mean_half_level_km(),
            (World::Plain | World::Ellipsoid(_), _) => body::Config::default().limb_height_km,
        };
        let by_latitude = match (&self.world, kind) {
            (World::Infrared(w), Kind::Earth) => w.with_season(self.start_unix_s()).half_level_by_latitude_km(),
            _ => Vec::new(),
        };
        let limb_height_by_latitude_km = by_latitude.into_iter().collect();
        // Only a visible world is lit by the Sun; the others shine by themselves, at night, too.
        let shines = kind == Kind::Earth && !matches!(self.world, World::Visible(_));
        let sunlit = shines.then_some(false);
        body::Config { kind, limb_height_km, limb_height_by_latitude_km, sunlit, ..body::Config::default() }
    }
}

#[cfg(test)]
mod tests;
