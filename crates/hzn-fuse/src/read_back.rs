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
