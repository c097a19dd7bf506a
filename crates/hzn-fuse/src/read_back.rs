//! Reads results of `hzn fuse` back from its files, for programs that show them.

use std::path::{Path, PathBuf};

use serde::Deserialize;
use serde::de::DeserializeOwned;

use crate::error::Error;
use crate::sink::Phase;

/// Name of the settings that every recording of `hzn fuse` begins with.
const SETTINGS: &str = "fuse.toml";
/// First columns of a table of solutions.
const TABLE: &str = "time_s,phase,qw,";

/// A solution, as far as plots show it. `hzn_fuse::sink::StateRecord` has every number.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
pub struct State {
    /// Time of the inertial unit, s.
    pub time_s: f64,
    /// The origin of the solution.
    pub phase: Phase,
    /// Yaw of the vehicle against north, east and down at its position, degrees.
    pub yaw_deg: f64,
    /// Pitch, degrees.
    pub pitch_deg: f64,
    /// Roll, degrees.
    pub roll_deg: f64,
    /// 1-sigma of the attitude about the vehicle's x axis, degrees; `None` before the start.
    pub sigma_x_deg: Option<f64>,
    /// 1-sigma about the y axis.
    pub sigma_y_deg: Option<f64>,
    /// 1-sigma about the z axis.
    pub sigma_z_deg: Option<f64>,
    /// Largest 1-sigma of a component of the position, m.
    pub position_sigma_m: Option<f64>,
    /// Error of the limb height, km.
    pub limb_height_km: Option<f64>,
    /// Its 1-sigma, km.
    pub limb_height_sigma_km: Option<f64>,
}

/// An innovation of the filter.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Innovation {
    /// Time, s.
    pub time_s: f64,
    /// Name of the camera, `gnss`, or `star-tracker`.
    pub source: String,
    /// `limb`, `sun`, `moon`, `limb-position`, `position`, `velocity` or `attitude`.
    pub kind: String,
    first: Option<f64>,
    second: Option<f64>,
    third: Option<f64>,
    first_sigma: Option<f64>,
    second_sigma: Option<f64>,
    third_sigma: Option<f64>,
    /// Whether the filter took the measurement.
    pub taken: bool,
}

impl Innovation {
    /// Returns each component over its 1-sigma. A component that is missing or not finite is left out.
    pub fn sigmas(&self) -> impl Iterator<Item = f64> + use<> {
        let components =
            [(self.first, self.first_sigma), (self.second, self.second_sigma), (self.third, self.third_sigma)];
        components.into_iter().filter_map(|(value, sigma)| Some(value? / sigma?)).filter(|x| x.is_finite())
    }
}

/// Results of a flight.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Solution {
    /// All solutions in the order of the file.
    pub states: Vec<State>,
    /// All innovations in the order of the file.
    pub innovations: Vec<Innovation>,
}

/// Returns whether a file is one that `hzn fuse -o` wrote: a recording or the table of solutions. Only its beginning is
/// read; a file that cannot be read is none.
pub fn is_solution(path: &Path) -> bool {
    match ending(path).as_str() {
        "mcap" => hzn_mcap::begins_with_attachment(path, SETTINGS).unwrap_or(false),
        "csv" => begins_with(path, TABLE),
        _ => false,
    }
}

/// Reads the results of `hzn fuse -o nav.mcap`, or of `-o nav.csv` with its `nav.innovations.csv`.
///
/// # Errors
/// The file cannot be read, or it is none of `hzn fuse`; the message names the file and, in a table, the line.
pub fn read_solution(path: &Path) -> Result<Solution, Error> {
    if !is_solution(path) {
        let what = "is no result of hzn fuse; give the .mcap or .csv that `hzn fuse -o` wrote";
        return Err(Error::unusable(format!("{}: {what}", path.display())));
    }
    if ending(path) == "csv" {
        let innovations = path.with_extension("innovations.csv");
        let innovations = if innovations.exists() { read_table(&innovations)? } else { Vec::new() };
        return Ok(Solution { states: read_table(path)?, innovations });
    }
    read_recording(path)
}

fn read_recording(path: &Path) -> Result<Solution, Error> {
    let mut out = Solution::default();
    let mut broken = None;
    let wants = |topic: &str| topic.starts_with("/nav/");
    let take = |topic: &str, json: &[u8]| {
        let taken = match topic {
            "/nav/state" | "/nav/back" | "/nav/smoothed" => serde_json::from_slice(json).map(|s| out.states.push(s)),
            _ if topic.starts_with("/nav/innovation/") => serde_json::from_slice(json).map(|i| out.innovations.push(i)),
            _ => Ok(()),
        };
        if let Err(why) = taken {
            broken.get_or_insert(format!("{}: a message of {topic} cannot be read: {why}", path.display()));
        }
    };
    hzn_mcap::read_series(path, wants, take).map_err(Error::failed)?;
    broken.map_or(Ok(out), |why| Err(Error::unusable(why)))
}

fn read_table<T: DeserializeOwned>(path: &Path) -> Result<Vec<T>, Error> {
    let refuse = |e: csv::Error| Error::unusable(format!("{}: {e}", path.display()));
    csv::Reader::from_path(path).map_err(refuse)?.deserialize().collect::<Result<_, _>>().map_err(refuse)
}

/// The mount and the clock of a camera, as a flight has estimated them.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct EstimatedMount {
    /// Rotation from the told mount to the estimated one, about the axes of the camera, degrees.
    pub misalignment_deg: [f64; 3],
    /// Its 1-sigma.
    pub misalignment_sigma_deg: [f64; 3],
    /// Seconds to add to the times of the camera.
    pub clock_s: f64,
    /// Its 1-sigma.
    pub clock_sigma_s: f64,
    /// The mount that the flight was told, scalar first; `None` in results of version 0.1.0.
    #[serde(default)]
    pub told_q_vehicle_from_camera_wxyz: Option<[f64; 4]>,
    /// The verdict over the flight; `None` in results of version 0.1.0.
    #[serde(skip)]
    pub verdict: Option<String>,
}

/// Reads the mount of a camera from the results of `hzn fuse -o`: that of the last smoothed or solved state, else of
/// the last one of the filter.
///
/// # Errors
/// The file cannot be read, or has no such camera; the message lists its cameras.
pub fn estimated_mount(path: &Path, camera: &str) -> Result<EstimatedMount, Error> {
    let (found, known) =
        if ending(path) == "csv" { mount_of_table(path, camera)? } else { mount_of_recording(path, camera)? };
    found.ok_or_else(|| {
        let shown = path.display();
        let known = if known.is_empty() { "none".to_owned() } else { known.join(", ") };
        Error::unusable(format!("{shown}: has no mount of a camera {camera:?}; its cameras: {known}"))
    })
}

type MountAndCameras = (Option<EstimatedMount>, Vec<String>);

fn mount_of_table(path: &Path, camera: &str) -> Result<MountAndCameras, Error> {
    let refuse = |e: csv::Error| Error::unusable(format!("{}: {e}", path.display()));
    let mut reader = csv::Reader::from_path(path).map_err(refuse)?;
    let header = reader.headers().map_err(refuse)?.clone();
    let known = header.iter().filter_map(|name| name.strip_suffix("_misalignment_x_deg")).map(str::to_owned).collect();
    let names = ["misalignment_x_deg", "misalignment_y_deg", "misalignment_z_deg"];
    let sigmas = ["misalignment_sigma_x_deg", "misalignment_sigma_y_deg", "misalignment_sigma_z_deg"];
    let place = |name: &str| header.iter().position(|c| c.strip_prefix(camera) == Some(&format!("_{name}")));
    let places: Option<Vec<usize>> =
        names.iter().chain(&sigmas).chain(&["clock_s", "clock_sigma_s"]).map(|name| place(name)).collect();
    let told: Option<Vec<usize>> =
        ["w", "x", "y", "z"].map(|part| place(&format!("told_q_vehicle_from_camera_{part}"))).into_iter().collect();
    let verdict = header.iter().position(|c| c == "verdict");
    let (Some(places), Some(phase)) = (places, header.iter().position(|c| c == "phase")) else {
        return Ok((None, known));
    };
    let (mut last, mut is_smoothed) = (None, false);
    for record in reader.records() {
        let record = record.map_err(refuse)?;
        let of_all = record.get(phase) == Some("smoothed");
        if record.get(phase) == Some("back") || (is_smoothed && !of_all) {
            continue;
        }
        let number = |i: &usize| record.get(*i).and_then(|cell| cell.parse().ok()).unwrap_or(f64::NAN);
        let numbers: Vec<f64> = places.iter().map(number).collect();
        let told =
            told.as_ref().and_then(|places| <[f64; 4]>::try_from(places.iter().map(number).collect::<Vec<_>>()).ok());
        let [x, y, z, sx, sy, sz, clock_s, clock_sigma_s] = numbers[..] else { continue };
        (last, is_smoothed) = (
            Some(EstimatedMount {
                misalignment_deg: [x, y, z],
                misalignment_sigma_deg: [sx, sy, sz],
                clock_s,
                clock_sigma_s,
                told_q_vehicle_from_camera_wxyz: told,
                verdict: verdict.and_then(|i| record.get(i)).map(str::to_owned),
            }),
            of_all,
        );
    }
    Ok((last, known))
}

fn mount_of_recording(path: &Path, camera: &str) -> Result<MountAndCameras, Error> {
    #[derive(Deserialize)]
    struct Named {
        name: String,
        #[serde(flatten)]
        mount: EstimatedMount,
    }
    #[derive(Deserialize)]
    struct Cameras {
        cameras: Vec<Named>,
        #[serde(default)]
        verdict: Option<String>,
    }
    let (mut filtered, mut smoothed, mut known) = (None, None, Vec::new());
    let take = |topic: &str, json: &[u8]| {
        let Ok(Cameras { cameras, verdict }) = serde_json::from_slice(json) else { return };
        let found = cameras.iter().find(|c| c.name == camera).map(|c| EstimatedMount { verdict, ..c.mount.clone() });
        *(if topic == "/nav/smoothed" { &mut smoothed } else { &mut filtered }) = found;
        known = cameras.into_iter().map(|c| c.name).collect();
    };
    let wants = |topic: &str| matches!(topic, "/nav/state" | "/nav/smoothed");
    hzn_mcap::read_series(path, wants, take).map_err(Error::failed)?;
    Ok((smoothed.or(filtered), known))
}

/// Returns the results of `hzn fuse` in a folder: `nav.mcap`, else `nav.csv`, the names that the guide uses.
pub fn find_solution(folder: &Path) -> Option<PathBuf> {
    ["nav.mcap", "nav.csv"].into_iter().map(|name| folder.join(name)).find(|path| is_solution(path))
}

fn ending(path: &Path) -> String {
    path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default()
}

fn begins_with(path: &Path, text: &str) -> bool {
    use std::io::Read;
    let mut begin = vec![0; text.len()];
    std::fs::File::open(path).and_then(|mut file| file.read_exact(&mut begin)).is_ok() && begin == text.as_bytes()
}
