//! Files that are known by their content: prepared sensors, streams of packets, and what other programs read.

use std::path::Path;

use hzn_core::real::Real;
use hzn_core::{Config, Sensor, prepared};
use hzn_files::limited;
use hzn_flight::packet::SYNC;
use hzn_run::provenance;

use super::facts::Facts;
use crate::exit::{Stop, failed};
use crate::kind_of_file::content::{Content, PREPARED, TELECOMMANDS, TELEMETRY};

fn named(known: Content) -> Facts {
    let mut out = Facts::new(known.kind, known.what);
    out.line("for", known.command.to_owned());
    out
}

/// Describes a file whose content is known.
pub(super) fn describe(file: &Path, known: Content) -> Result<Facts, Stop> {
    let mut out = named(known);
    match known {
        TELEMETRY | TELECOMMANDS => {
            let bytes = read(file, limited::TABLE_BYTES)?;
            let packets = bytes.windows(SYNC.len()).filter(|window| *window == SYNC).count();
            out.fact("packets", format!("{packets}, by their sync markers"), "packets", packets);
        }
        _ => message(&mut out, file)?,
    }
    Ok(out)
}

fn read(file: &Path, limit: u64) -> Result<Vec<u8>, Stop> {
    limited::read(file, limit).map_err(|e| failed(format!("{}: cannot be read: {e}", file.display())))
}

/// Offset of the version of the layout, of the bytes of a number, and of the checksum: `hzn_core::prepared` has the
/// table.
const VERSION: usize = 6;
const NUMBER_BYTES: usize = 7;
const CHECKSUM: std::ops::Range<usize> = 16..20;

/// Describes a prepared sensor, and returns its configuration for the description of its camera.
pub(super) fn prepared_sensor(file: &Path) -> Result<(Facts, Config), Stop> {
    let mut out = named(PREPARED);
    // A page of flash may be larger than the sensor at its beginning.
    let bytes = read(file, limited::SETTINGS_BYTES)?;
    let byte = |place: usize| bytes.get(place).copied().unwrap_or_default();
    out.fact("layout", format!("version {}", byte(VERSION)), "version", byte(VERSION));
    out.fact("numbers", format!("f{}", 8 * u32::from(byte(NUMBER_BYTES))), "number_bytes", byte(NUMBER_BYTES));
    let sum = bytes.get(CHECKSUM).and_then(|sum| sum.try_into().ok()).map(u32::from_le_bytes).unwrap_or_default();
    let is_single = usize::from(byte(NUMBER_BYTES)) == size_of::<f32>();
    let config = if is_single { config_of::<f32>(&bytes) } else { config_of::<f64>(&bytes) };
    let config = config.map_err(|e| failed(format!("{}: is {}, but {e}", file.display(), PREPARED.what)))?;
    out.fact("checksum", format!("{sum:08x}, which is right"), "checksum", format!("{sum:08x}"));
    if let Some(hash) = provenance::hash(&config) {
        out.fact("sensor hash", format!("{hash} (that of its sensor.toml)"), "sensor_hash", hash);
    }
    for body in config.each_body() {
        let altitude = match body.altitude_km {
            Some(km) => format!("{km} +- {} km", body.altitude_sigma_km),
            None => "not in the sensor: the flight computer is told".to_owned(),
        };
        out.line("altitude", format!("{} ({})", altitude, body.kind.name()));
    }
    Ok((out, config))
}

fn config_of<T: Real>(bytes: &[u8]) -> Result<Config, prepared::PreparedError> {
    Sensor::<T>::from_prepared(bytes).map(|sensor| sensor.config().clone())
}

/// Keys of CCSDS messages with their names here.
const KEYS: [(&str, &str, &str); 6] = [
    ("OBJECT_NAME", "object", "object"),
    ("ORIGINATOR", "written by", "originator"),
    ("CREATION_DATE", "on", "creation_date"),
    ("START_TIME", "from", "start_time"),
    ("STOP_TIME", "to", "stop_time"),
    ("TIME_SYSTEM", "time system", "time_system"),
];

/// Adds what a CCSDS message says of itself; nothing for other files.
fn message(out: &mut Facts, file: &Path) -> Result<(), Stop> {
    let bytes = read(file, limited::TABLE_BYTES)?;
    let Ok(text) = str::from_utf8(&bytes) else { return Ok(()) };
    if !text.starts_with("CCSDS_") {
        return Ok(());
    }
    for (key, name, json) in KEYS {
        let value =
            |line: &str| line.split_once('=').filter(|(k, _)| k.trim() == key).map(|(_, v)| v.trim().to_owned());
        if let Some(value) = text.lines().find_map(value) {
            out.fact(name, value.clone(), json, value);
        }
    }
    Ok(())
}
