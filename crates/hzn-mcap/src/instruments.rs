//! Inertial units and receivers in recordings of ROS 2.

use std::path::Path;

use crate::cdr;
use crate::error::Error;
use crate::header::Header;
use crate::series_reader::read_messages;

/// What a message of an instrument says.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Measured {
    /// `sensor_msgs/msg/Imu`: a value that the message does not have is NaN.
    Imu {
        /// Rates about the axes of the unit, rad/s.
        gyro_rad_s: [f64; 3],
        /// Specific forces along these axes, m/s².
        accel_m_s2: [f64; 3],
    },
    /// `sensor_msgs/msg/NavSatFix`.
    Fix {
        /// Whether the receiver has a fix.
        has_fix: bool,
        /// Latitude and longitude, degrees (WGS-84).
        lat_lon_deg: [f64; 2],
        /// Height above the ellipsoid, m.
        height_m: f64,
        /// Variances to east, north and up, m²; `None` if they are not known.
        variances_m2: Option<[f64; 3]>,
    },
}

/// A message of an instrument.
#[derive(Debug, Clone, PartialEq)]
pub struct InstrumentMessage<'a> {
    /// Its topic.
    pub topic: &'a str,
    /// The schema of its topic, such as `sensor_msgs/msg/Imu`.
    pub schema: &'a str,
    /// Seconds and nanoseconds of the header; `None` if they are 0, or cannot be read.
    pub stamp: Option<(i64, u32)>,
    /// Seconds and nanoseconds of the log time.
    pub log_time: (i64, u32),
    /// The frame that the header names; empty without one.
    pub frame_id: String,
    /// The measurement; `None` if the message ends too early.
    pub measured: Option<Measured>,
}

/// Hands the messages of inertial units and receivers in a recording of ROS 2 to `take`, in file order. Returns whether
/// the file has its end: one that was cut off or damaged gives the messages before that place.
///
/// # Errors
/// The file cannot be read, is not an MCAP, or has a compression that hzn does not read.
pub fn read_instruments(path: impl AsRef<Path>, mut take: impl FnMut(&InstrumentMessage<'_>)) -> Result<bool, Error> {
    read_messages(path.as_ref(), |channel, message| {
        let read = match channel.schema.as_str() {
            _ if channel.encoding != "cdr" => return,
            "sensor_msgs/msg/Imu" => cdr::parse_imu(message.data)
                .map(|(head, [gyro_rad_s, accel_m_s2])| (head, Measured::Imu { gyro_rad_s, accel_m_s2 })),
            "sensor_msgs/msg/NavSatFix" => cdr::parse_fix(message.data).map(|fix| {
                let [lat, lon, height_m] = fix.place;
                let (has_fix, variances_m2) = (fix.has_fix, fix.variances_m2);
                (fix.header, Measured::Fix { has_fix, lat_lon_deg: [lat, lon], height_m, variances_m2 })
            }),
            _ => return,
        };
        let (head, measured) = read.map_or((Header::default(), None), |(head, measured)| (head, Some(measured)));
        let ns = message.log_time_ns;
        let log_time = ((ns / 1_000_000_000) as i64, (ns % 1_000_000_000) as u32);
        let stamp = head.stamp().map(|(s, ns)| (i64::from(s), ns));
        let (topic, schema) = (channel.topic.as_str(), channel.schema.as_str());
        take(&InstrumentMessage { topic, schema, stamp, log_time, frame_id: head.frame_id, measured });
    })
}
