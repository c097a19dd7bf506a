//! The arguments of `hzn fuse`.

use std::path::{Path, PathBuf};

use hzn_fuse::finding::{Cause, Finding, Source};
use hzn_fuse::input::Inputs;
use hzn_fuse::sink::AemVersion;

/// Fuse the results of `hzn run` with inertial unit and receiver: attitude and position with covariance
///
/// The filter of a flight computer runs over a recorded flight. It begins with the first attitude from two directions,
/// for example limb and Sun, or from a star tracker. fuse.toml says what the filter estimates, considers or leaves out;
/// `--show-config` prints it with all defaults.
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// Results of `hzn run` of one camera (.mcap, .csv, .jsonl); once for each camera. The name of a camera is that of
    /// its file without the ending. A star tracker can replace them
    #[arg(long, value_name = "FILE", required_unless_present_any = ["show_config", "attitude", "direction"])]
    pub(super) nadir: Vec<PathBuf>,
    /// Samples of the inertial unit: time_s, gyro_{x,y,z}_radps, accel_{x,y,z}_mps2, saturated. Without it, --solve
    /// finds the orbit of a satellite from limbs and a star tracker
    #[arg(long, value_name = "CSV")]
    pub(super) imu: Option<PathBuf>,
    /// Fixes of the receiver: NMEA 0183, a CCSDS orbit ephemeris message (OEM) in KVN and ITRF, or a table with time_s
    /// and either x_m, y_m, z_m (ECEF) or lat_deg, lon_deg, height_m (above WGS-84). Velocities vx_mps, vy_mps, vz_mps,
    /// or v_north_mps, v_east_mps and v_down_mps or v_up_mps, and sigmas position_sigma_m, velocity_sigma_mps,
    /// horizontal_sigma_m, vertical_sigma_m may be left out. With a star tracker the attitude needs no receiver; the
    /// position is then not known
    #[arg(long, value_name = "FILE")]
    pub(super) gnss: Option<PathBuf>,
    /// Attitudes of a star tracker: time_s, qw, qx, qy, qz (vehicle to ECEF), sigma_deg
    #[arg(long, value_name = "CSV")]
    pub(super) attitude: Option<PathBuf>,
    /// Directions of another sensor, such as a magnetometer, a Sun sensor or an antenna; once for each: time_s, the
    /// measured x, y, z along the vehicle's axes, the same direction in ECEF ref_x, ref_y, ref_z, sigma_deg, and maybe
    /// noise_deg, the part of it that is new in every row. Its name is that of its file without the ending, and it has
    /// the settings, the mount and the clock of a camera
    #[arg(long, value_name = "CSV")]
    pub(super) direction: Vec<PathBuf>,
    /// A column of a table that somebody else wrote, once for each: TABLE (imu, gnss, attitude, direction), what it is,
    /// its name in the file, and its unit if that is another. Several names with colons mean the three axes:
    /// --map imu:time=t_us,us --map imu:gyro=wx:wy:wz,deg/s. A wrong name is answered with all right ones
    #[arg(long, value_name = "TABLE:NAME=COLUMN,UNIT")]
    pub(super) map: Vec<String>,
    /// The mount of a camera, instead of that in its recording: a TOML file with the table [mount]
    #[arg(long, value_name = "CAMERA=FILE", value_parser = pair)]
    pub(super) mount: Vec<(String, String)>,
    /// Seconds to add to the times of a camera, or of gnss or attitude, if its clock has another epoch than the
    /// inertial unit
    #[arg(long, value_name = "CAMERA=SECONDS", value_parser = pair, allow_hyphen_values = true)]
    pub(super) clock: Vec<(String, String)>,
    /// Settings of the filter: a fuse.toml
    #[arg(long, value_name = "FILE")]
    pub(super) config: Option<PathBuf>,
    /// The results: .mcap for Foxglove, or .csv with NAME.innovations.csv next to it
    #[arg(short, long, value_name = "FILE", required_unless_present = "show_config")]
    pub(super) output: Option<PathBuf>,
    /// A report with plots, as one page of HTML
    #[arg(long, value_name = "HTML")]
    pub(super) report: Option<PathBuf>,
    /// The attitude as a CCSDS attitude ephemeris message; it needs --utc
    #[arg(long, value_name = "FILE", requires = "utc")]
    pub(super) aem: Option<PathBuf>,
    /// Position and velocity with their covariance as a CCSDS orbit ephemeris message; it needs --utc, and --gnss if
    /// there is an inertial unit
    #[arg(long, value_name = "FILE", requires = "utc")]
    pub(super) oem: Option<PathBuf>,
    /// Version of the AEM: programs read the one of 2008, or that of 2024
    #[arg(long, value_name = "VERSION", default_value = "1.0", requires = "aem")]
    pub(super) aem_version: Version,
    /// The attitude as a SPICE CK of type 3 (FILE.bc), with FILE.tsc and FILE.tf next to it; it needs --utc
    #[arg(long, value_name = "FILE", requires = "utc")]
    pub(super) ck: Option<PathBuf>,
    /// UTC of time 0 of the inertial unit, for example 2019-06-13T04:00:00Z; the times of NMEA and of an OEM count from
    /// it
    #[arg(long, value_name = "TIME")]
    pub(super) utc: Option<String>,
    /// Name of the vehicle in the AEM and the OEM
    #[arg(long, value_name = "NAME", default_value = "VEHICLE")]
    pub(super) object: String,
    /// SPICE's number of the vehicle in the CK
    #[arg(long, value_name = "NUMBER", default_value_t = -999, allow_hyphen_values = true)]
    pub(super) spacecraft: i32,
    /// A frames.csv with the attitude of a camera, for a second `hzn run --frames`
    #[arg(long, value_name = "CAMERA=FILE", value_parser = pair)]
    pub(super) write_frames: Vec<(String, String)>,
    /// Also smooth: at every measurement, write the solution from all measurements, later ones included
    #[arg(long)]
    pub(super) smooth: bool,
    /// Also solve the whole flight at once: the most probable states, mounts, clocks and biases from all measurements.
    /// It replaces --smooth. It says which values the flight determined, and gives wrong measurements less weight
    /// instead of refusing them. Without --imu and --gnss, gravity joins the limbs of a satellite, and --attitude gives
    /// its attitude: the result is the orbit
    #[arg(long, conflicts_with = "smooth")]
    pub(super) solve: bool,
    /// With --solve: use what all edge points of a limb say, the cone that was fitted to them with a free half-angle,
    /// instead of the axis that the told altitude and limb height were fused into. The limb height of all pictures is
    /// then estimated from the size of the limb, too. It needs recordings with their sensor.toml, as in MCAP, and a
    /// receiver
    #[arg(long, requires = "solve")]
    pub(super) points: bool,
    /// Largest number of solutions per second in the results
    #[arg(long, value_name = "HZ", default_value_t = 10.0)]
    pub(super) rate: f64,
    /// Compare with the truth of `hzn simulate`: its vehicle.csv
    #[arg(long, value_name = "CSV")]
    pub(super) truth: Option<PathBuf>,
    /// Replace outputs that exist, and write --aem, --oem and --ck although the inputs contradict each other
    #[arg(long)]
    pub(super) force: bool,
    /// Print a fuse.toml with all defaults and do nothing else
    #[arg(long)]
    pub(super) show_config: bool,
}

impl Args {
    /// Returns every file that is read.
    pub(super) fn inputs(&self) -> Vec<PathBuf> {
        let tables = [&self.imu, &self.gnss, &self.attitude, &self.config, &self.truth];
        let mounts = self.mount.iter().map(|(_, file)| PathBuf::from(file));
        self.nadir.iter().chain(&self.direction).chain(tables.into_iter().flatten()).cloned().chain(mounts).collect()
    }
}

impl Args {
    /// Returns the file that a finding is about: for a mount, the file with the mount if there is one.
    pub(super) fn file_of(&self, finding: &Finding) -> Option<&Path> {
        match &finding.source {
            Source::Imu => self.imu.as_deref(),
            Source::Receiver => self.gnss.as_deref(),
            Source::StarTracker => self.attitude.as_deref(),
            Source::Camera(name) => {
                let mount =
                    self.mount.iter().filter(|_| finding.cause == Cause::Mount).find(|(camera, _)| camera == name);
                let recording = self
                    .nadir
                    .iter()
                    .chain(&self.direction)
                    .find(|path| path.file_stem().is_some_and(|stem| stem == name.as_str()));
                mount.map(|(_, file)| Path::new(file)).or(recording.map(PathBuf::as_path))
            }
            Source::Cameras | Source::All => None,
        }
    }
}

/// The version of an AEM.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub(super) enum Version {
    /// CCSDS 504.0-B-1, which GMAT, Orekit and ccsds-ndm read
    #[value(name = "1.0")]
    One,
    /// CCSDS 504.0-B-2, which brahe and Orekit read
    #[value(name = "2.0")]
    Two,
}

impl From<Version> for AemVersion {
    fn from(version: Version) -> Self {
        match version {
            Version::One => Self::One,
            Version::Two => Self::Two,
        }
    }
}

/// Parses NAME=VALUE.
fn pair(text: &str) -> Result<(String, String), String> {
    match text.split_once('=') {
        Some((name, value)) if !name.is_empty() && !value.is_empty() => Ok((name.to_owned(), value.to_owned())),
        _ => Err("CAMERA=VALUE is expected".into()),
    }
}

/// Returns the names of the cameras in words.
pub(super) fn names(inputs: &Inputs) -> String {
    let names: Vec<&str> = inputs.recordings.iter().map(|r| r.name.as_str()).collect();
    format!("the cameras are {}", names.join(", "))
}
