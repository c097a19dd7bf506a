//! The tables of `hzn fuse` from a recording of ROS 2: inertial unit and receiver.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

use hzn_mcap::{InstrumentMessage, Measured, read_instruments};

use crate::disk::{self, Checked};
use crate::error::{Error, unusable};
use crate::source;
use crate::source::measured::{self, Fix, Sample};

/// Longest time between a rate and the acceleration in its row, seconds. Cameras have 200 of them a second.
const MAX_APART_S: f64 = 0.02;

/// An instrument in a recording.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Instrument {
    /// The inertial unit: `sensor_msgs/msg/Imu`.
    Imu,
    /// The receiver: `sensor_msgs/msg/NavSatFix`.
    Gnss,
}

impl Instrument {
    /// Returns the schema of its messages.
    pub fn schema(self) -> &'static str {
        match self {
            Self::Imu => "sensor_msgs/msg/Imu",
            Self::Gnss => "sensor_msgs/msg/NavSatFix",
        }
    }

    fn header(self) -> &'static str {
        match self {
            Self::Imu => "time_s,gyro_x_radps,gyro_y_radps,gyro_z_radps,accel_x_mps2,accel_y_mps2,accel_z_mps2",
            Self::Gnss => "time_s,lat_deg,lon_deg,height_m,horizontal_sigma_m,vertical_sigma_m",
        }
    }
}

/// A table that was written.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Exported {
    /// Number of rows.
    pub rows: u64,
    /// The topic of the messages.
    pub topic: String,
    /// The frame that the first message names; empty without one.
    pub frame_id: String,
    /// Messages without a fix, and messages that end too early. They are left out.
    pub left_out: u64,
    /// Messages with a measurement and the stamp 0, whose times are not known. They are left out, unless all messages
    /// are such ones.
    pub without_stamp: u64,
    /// Whether the times are those of the log, because all stamps are 0.
    pub is_log_time: bool,
    /// The files that have no end, so that messages may be missing.
    pub cut: Vec<PathBuf>,
}

/// Returns the topics of the instruments in some recordings, each with its schema.
///
/// # Errors
/// A file cannot be read, or is not an MCAP.
pub fn topics(recordings: &[PathBuf]) -> Result<BTreeMap<String, String>, Error> {
    let mut found = BTreeMap::new();
    for path in recordings {
        let mut add = |message: &InstrumentMessage<'_>| {
            if !found.contains_key(message.topic) {
                found.insert(message.topic.to_owned(), message.schema.to_owned());
            }
        };
        read_instruments(path, &mut add).map_err(unusable)?;
    }
    Ok(found)
}

/// Returns the recordings of an input: a recording in MCAP, or the folder of a bag.
///
/// # Errors
/// There is none.
pub fn recordings(input: &Path) -> Result<Vec<PathBuf>, Error> {
    if source::is_bag(input) {
        return source::recordings_of_bag(input);
    }
    match source::check_exists(input)?.0.as_str() {
        "mcap" => Ok(vec![input.to_owned()]),
        _ => Err(unusable(format!("{}: is not a recording; {}", input.display(), source::conversion(input)))),
    }
}

/// Returns whether a topic has stamps. A driver that does not fill them in leaves them all at 0.
fn has_stamps(recordings: &[PathBuf], topic: &str) -> Result<bool, Error> {
    let mut found = false;
    for path in recordings {
        let look = |message: &InstrumentMessage<'_>| found |= message.topic == topic && message.stamp.is_some();
        read_instruments(path, look).map_err(Error::failed)?;
        if found {
            break;
        }
    }
    Ok(found)
}

/// Writes the messages of a topic as a table that `hzn fuse` reads. All rows have times of one clock: the stamps in the
/// headers, or the log times if all stamps are 0.
///
/// # Errors
/// A recording cannot be read, or the table cannot be written.
pub fn write_table(
    recordings: &[PathBuf],
    instrument: Instrument,
    topic: &str,
    table: &Path,
) -> Result<Exported, Error> {
    let cannot_write = |e: std::io::Error| disk::cannot_write(table, &e);
    let mut out = BufWriter::new(Checked::create(table).map_err(cannot_write)?);
    let is_log_time = !has_stamps(recordings, topic)?;
    let mut exported = Exported { topic: topic.to_owned(), is_log_time, ..Exported::default() };
    writeln!(out, "{}", instrument.header()).map_err(cannot_write)?;
    for path in recordings {
        let mut written = Ok(());
        let is_whole = read_instruments(path, |message| {
            if message.topic != topic || written.is_err() {
                return;
            }
            let Some(values) = values(instrument, message) else {
                exported.left_out += 1;
                return;
            };
            exported.without_stamp += u64::from(message.stamp.is_none());
            let Some((s, ns)) = message.stamp.filter(|_| !is_log_time).or(is_log_time.then_some(message.log_time))
            else {
                return;
            };
            if exported.rows == 0 {
                exported.frame_id.clone_from(&message.frame_id);
            }
            exported.rows += 1;
            written = writeln!(out, "{s}.{ns:09}{values}");
        });
        written.map_err(cannot_write)?;
        if !is_whole.map_err(Error::failed)? {
            exported.cut.push(path.clone());
        }
    }
    out.flush().map_err(cannot_write)?;
    Ok(exported)
}

/// Writes what an action camera measured as a table that `hzn fuse` reads. The rows have the times of the video, and
/// the axes of the camera. Returns the number of rows.
///
/// # Errors
/// The table cannot be written.
pub fn write_measured(measured: &measured::Measured, instrument: Instrument, table: &Path) -> Result<u64, Error> {
    let rows: Vec<String> = match instrument {
        Instrument::Imu => measured.rates.iter().map(|rate| imu_row(measured, rate)).collect(),
        Instrument::Gnss => measured.fixes.iter().map(gnss_row).collect(),
    };
    let cannot_write = |e: std::io::Error| disk::cannot_write(table, &e);
    let mut out = BufWriter::new(Checked::create(table).map_err(cannot_write)?);
    writeln!(out, "{}", instrument.header()).map_err(cannot_write)?;
    for row in &rows {
        writeln!(out, "{row}").map_err(cannot_write)?;
    }
    out.flush().map_err(cannot_write)?;
    Ok(rows.len() as u64)
}

/// Returns the row of a rate, with the acceleration that is nearest in time.
fn imu_row(measured: &measured::Measured, rate: &Sample) -> String {
    let all = &measured.accelerations;
    let next = all.partition_point(|sample| sample.time_s < rate.time_s);
    let around = [next.checked_sub(1), Some(next)].into_iter().flatten().filter_map(|i| all.get(i));
    let apart = |sample: &&Sample| (sample.time_s - rate.time_s).abs();
    let nearest = around.min_by(|a, b| apart(a).total_cmp(&apart(b))).filter(|s| apart(s) < MAX_APART_S);
    let [x, y, z] = rate.xyz;
    let mut row = format!("{:.6},{x},{y},{z}", rate.time_s);
    match nearest {
        Some(Sample { xyz: [x, y, z], .. }) => {
            let _ = write!(row, ",{x},{y},{z}");
        }
        None => row.push_str(",,,"),
    }
    row
}

/// Returns the row of a fix, whose sigmas the camera does not tell.
fn gnss_row(fix: &Fix) -> String {
    let Fix { time_s, lat_lon_deg: [lat, lon], height_m, .. } = fix;
    format!("{time_s:.6},{lat},{lon},{height_m},,")
}

/// Returns the row of a message after its time; `None` if it has no measurement.
fn values(instrument: Instrument, message: &InstrumentMessage<'_>) -> Option<String> {
    let mut row = String::new();
    let mut add = |value: f64| {
        row.push(',');
        // An empty cell is a value that is not known.
        if value.is_finite() {
            let _ = write!(row, "{value}");
        }
    };
    match (instrument, message.measured?) {
        (Instrument::Imu, Measured::Imu { gyro_rad_s, accel_m_s2 }) => {
            gyro_rad_s.into_iter().chain(accel_m_s2).for_each(&mut add);
        }
        (Instrument::Gnss, Measured::Fix { has_fix: true, lat_lon_deg: [lat, lon], height_m, variances_m2 }) => {
            [lat, lon, height_m].into_iter().for_each(&mut add);
            let [east, north, up] = variances_m2.unwrap_or([f64::NAN; 3]);
            [east.max(north).sqrt(), up.sqrt()].into_iter().for_each(&mut add);
        }
        _ => return None,
    }
    Some(row)
}
