//! Opens the heads of a rig with their sensors and tables.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use hzn_core::rig::Mount;
use hzn_files::rig::{self, Head};
use hzn_files::{FrameData, Frames, Problem, Sensor, files_of_sensor};

use super::joint::Joiner;
use super::mounts;
use crate::engine;
use crate::error::{Error, Remedy, unusable};
use crate::open::{self, SensorChoice};
use crate::source::{Raw, Source};

/// Difference of two mounts with quaternions of five digits, degrees.
const MOUNT_ROUNDING_DEG: f64 = 0.002;

/// The rig.toml to open, and the values that replace those of its files.
#[derive(Debug, Clone, Default)]
pub struct Request {
    /// The rig.toml.
    pub rig: PathBuf,
    /// The frames.csv of the vehicle; without it, the one next to rig.toml.
    pub frames: Option<PathBuf>,
    /// Size and format of headerless pictures, of all heads.
    pub raw: Option<Raw>,
    /// Altitude of the vehicle, km, which replaces `body.altitude_km` of each sensor.
    pub altitude_km: Option<f64>,
    /// Whether the sensors are those of the flight computer.
    pub flight: bool,
}

/// An open rig.
pub struct Opened {
    /// The content of rig.toml.
    pub rig: rig::Rig,
    /// The heads, in the order of rig.toml.
    pub heads: Vec<OpenHead>,
    /// The frames.csv of the vehicle.
    pub frames: Option<Arc<Frames>>,
    /// The text of rig.toml.
    pub text: String,
    /// Values that are possible but look wrong.
    pub warnings: Vec<String>,
    /// What the user should know about the pictures.
    pub notes: Vec<String>,
    /// Every file that is read, so that no output replaces one of them.
    pub files: Vec<PathBuf>,
}

/// An open head.
pub struct OpenHead {
    /// Its name.
    pub name: String,
    /// Its pictures.
    pub source: Box<dyn Source>,
    /// Its sensor.
    pub sensor: Sensor,
    /// The frames.csv next to its pictures.
    pub frames: Option<Frames>,
    pub(super) vehicle: Option<Vehicle>,
}

/// The frames.csv of the vehicle, which all heads share, as one head sees it.
pub(super) struct Vehicle {
    pub(super) frames: Arc<Frames>,
    q_vehicle_from_camera_wxyz: [f64; 4],
}

impl Vehicle {
    /// Returns the data of the nearest row, with the time to it in seconds.
    pub(super) fn nearest(&self, time_s: f64) -> Option<(f64, FrameData)> {
        let row = self.frames.nearest(time_s, f64::INFINITY)?;
        Some(((row.time_s? - time_s).abs(), row.seen_by_camera(self.q_vehicle_from_camera_wxyz)))
    }
}

/// Opens a rig, and checks every file that it names.
///
/// # Errors
/// rig.toml, a sensor, a table or the pictures of a head cannot be used. The message names the head.
pub fn open(request: &Request) -> Result<Opened, Error> {
    let file = hzn_files::rig::load(&request.rig)?;
    let text = hzn_files::limited::read_text(&request.rig, hzn_files::limited::SETTINGS_BYTES)?;
    let folder = request.rig.parent().unwrap_or(Path::new("")).to_owned();
    let beside = || Some(folder.join("frames.csv")).filter(|path| path.exists());
    let path = request.frames.clone().or_else(beside);
    let frames = path.as_ref().map(|path| hzn_files::frames::load_vehicle(path)).transpose()?.map(Arc::new);
    let mut opened = Opened {
        rig: file.clone(),
        heads: Vec::new(),
        text,
        warnings: frames.iter().flat_map(|f| &f.warnings).map(Problem::to_string).collect(),
        notes: Vec::new(),
        files: std::iter::once(request.rig.clone()).chain(path).collect(),
        frames,
    };
    for head in &file.heads {
        opened.add(head, &folder, request)?;
    }
    // It checks what the heads must have in common.
    opened.joiner()?;
    Ok(opened)
}

impl Opened {
    fn add(&mut self, head: &Head, folder: &Path, request: &Request) -> Result<(), Error> {
        self.check_own_pictures(head, folder)?;
        let sensor = head.sensor.as_ref().map(|path| folder.join(path));
        let own = open::Request {
            inputs: vec![folder.join(&head.pictures)],
            raw: request.raw,
            sensor: sensor.map_or(SensorChoice::Neighbour, SensorChoice::File),
            altitude_km: request.altitude_km,
            flight: request.flight,
            ..open::Request::default()
        };
        let named = |e: Error| e.in_head(&head.name);
        let opened = open::open(&own).map_err(named)?;
        let source = opened.source.as_ref();
        self.files.extend(source.files());
        self.files.extend(open::sensor_path(&own, source).iter().flat_map(|path| files_of_sensor(path)));
        self.files.extend(open::frames_path(&own, source));
        let name = |text: &String| format!("{}: {text}", head.name);
        self.warnings.extend(opened.warnings.iter().map(name));
        self.notes.extend(opened.notes.iter().map(name));
        let mount = head.mount.as_ref().and_then(|mount| mounts::mount(&self.rig.rig.mount, mount));
        let Some(mount) = mount else { return Err(unusable(format!("{}: [head.mount] is missing", head.name))) };
        self.warnings.extend(self.doubt_mount(&mount, &opened.sensor).map(|doubt| name(&doubt)));
        // The checks are about sizes, which the mount does not change.
        if let Some(vehicle) = self.frames.as_deref() {
            let config = &opened.sensor.config;
            engine::check_frames(config, request.flight, Some(vehicle)).map_err(|e| named(e.into()))?;
            self.warnings.extend(vehicle.check_sensor(config).iter().map(|w| name(&w.to_string())));
            if let Some(unused) = opened.frames.as_ref().filter(|frames| frames.has_priors()) {
                self.notes.push(format!(
                    "{}: {}: only its names and times are used, because {} has the data of the vehicle",
                    head.name,
                    unused.path.display(),
                    vehicle.path.display()
                ));
            }
        }
        open::check_size(source, &opened.sensor.config).map_err(named)?;
        let known = self.frames.as_deref().or(opened.frames.as_ref());
        open::check_altitude(source, &opened.sensor.config, known).map_err(|why| {
            let Some(vehicle) = self.frames.as_ref() else { return named(why) };
            let what = format!("{why}, or write altitude_km or x_km, y_km, z_km into {}", vehicle.path.display());
            let what = if opened.frames.as_ref().is_some_and(Frames::has_distances) {
                format!("{what}: that table replaces the one of the head, which has them")
            } else {
                what
            };
            named(unusable(what).with_remedy(Remedy::Altitude))
        })?;
        let vehicle = self.frames.as_ref().map(|frames| Vehicle {
            frames: Arc::clone(frames),
            q_vehicle_from_camera_wxyz: mount.q_vehicle_from_camera_wxyz(),
        });
        let (name, open::Opened { source, sensor, frames, .. }) = (head.name.clone(), opened);
        self.heads.push(OpenHead { name, source, sensor, frames, vehicle });
        Ok(())
    }

    /// Refuses pictures that another head has, too.
    fn check_own_pictures(&self, head: &Head, folder: &Path) -> Result<(), Error> {
        let pictures = |head: &Head| folder.join(&head.pictures).canonicalize().ok();
        let same = |other: &&Head| pictures(other).is_some() && pictures(other) == pictures(head);
        match self.rig.heads.iter().take(self.heads.len()).find(same) {
            Some(other) => Err(unusable(format!(
                "head {}: {}: these are the pictures of head {}, too",
                head.name,
                head.pictures.display(),
                other.name
            ))),
            None => Ok(()),
        }
    }

    /// Returns the doubt about a mount of rig.toml that contradicts the one of the head's sensor.
    fn doubt_mount(&self, mount: &Mount<f64>, sensor: &Sensor) -> Option<String> {
        let angle_deg = mounts::angle_deg(mount, sensor.config.mount.as_ref()?.q_vehicle_from_camera_wxyz);
        let sigma_deg = self.rig.rig.mount.sigma_deg.hypot(mounts::sigma_deg(mount));
        (angle_deg > 3.0 * sigma_deg + MOUNT_ROUNDING_DEG).then(|| {
            format!(
                "[mount] of its sensor.toml is {angle_deg:.2} degrees away from [head.mount] of rig.toml, which the \
                 joint answer uses; only the columns of the head's own rows that are in the vehicle's frame use \
                 [mount]: correct one of them"
            )
        })
    }

    /// Prepares the joint answers.
    ///
    /// # Errors
    /// See [`Joiner::new`]; [`open()`] has refused it already.
    pub fn joiner(&self) -> Result<Joiner, Error> {
        Joiner::new(&self.rig, self.heads.iter().map(|head| &head.sensor.config))
    }

    /// Returns the number of pictures of all heads, if it is known before.
    pub fn pictures(&self) -> Option<u64> {
        self.heads.iter().map(|head| head.source.total()).sum()
    }
}

impl Error {
    /// Returns the same error with the name of the head.
    fn in_head(self, name: &str) -> Self {
        // An option for the sensor or the altitude of one head would be that of all.
        let remedy = self.remedy().filter(|remedy| !matches!(remedy, Remedy::Sensor | Remedy::Altitude));
        let error = unusable(format!("head {name}: {self}"));
        remedy.map_or_else(|| unusable(&error), |remedy| unusable(&error).with_remedy(remedy))
    }
}
