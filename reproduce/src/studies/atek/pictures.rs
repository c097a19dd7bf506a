//! Flights through pictures: rendering, horizon sensor with default settings, recordings.

use anyhow::anyhow;
use hzn_calib::frames::FrameData;
use hzn_core::Config;
use hzn_core::body::{self, Kind};
use hzn_fuse::input::{Inputs, Recording};
use hzn_fuse::simulated;
use hzn_mcap::{Row, RowMeta};
use hzn_run::engine::AnySensor;
use hzn_sim::{FlightFrame, Scenario};
use rayon::prelude::*;

/// Pictures that are rendered before they are processed.
const BATCH: usize = 32;

/// Returns everything that the flight records.
pub(super) fn inputs(scene: &Scenario) -> anyhow::Result<Inputs> {
    let mut inputs = simulated::instruments(scene)?;
    for one in scene.by_camera() {
        inputs.recordings.push(recording(&one)?);
    }
    Ok(inputs)
}

/// Returns the sensor that knows camera, mount and bodies, and has defaults for everything else.
fn sensor(one: &Scenario) -> Config {
    let mut sensor = one.sensor();
    for body in &mut sensor.bodies {
        *body = body::Config { kind: body.kind, binarize: body.binarize, ..body::Config::default() };
    }
    sensor
}

fn recording(one: &Scenario) -> anyhow::Result<Recording> {
    let flight = one.flight()?;
    let config = sensor(one);
    let mut sensor = AnySensor::new(&config, false)?;
    let mut rows = Vec::new();
    for (batch, frames) in flight.frames.chunks(BATCH).enumerate() {
        let pictures: Vec<_> = frames.par_iter().map(FlightFrame::render).collect::<Result<_, _>>()?;
        for (k, (frame, picture)) in frames.iter().zip(&pictures).enumerate() {
            let index = (batch * BATCH + k) as u64;
            let data = known(one, frame);
            for (kind, done) in one.bodies.iter().zip(sensor.process(&picture.view(), Some(&data), None)) {
                let report = done.report.map_err(|e| anyhow!("{}: {e}", frame.file))?;
                let meta = RowMeta {
                    index,
                    file: frame.file.clone(),
                    time_s: data.time_s,
                    body: kind.name().into(),
                    altitude_km: data.altitude_km,
                };
                rows.push(Row::from_report(&meta, &report, None));
            }
        }
    }
    Ok(Recording::new(one.name.clone(), rows, Some(&config))?)
}

/// Returns the row of frames.csv.
fn known(one: &Scenario, frame: &FlightFrame) -> FrameData {
    let row = one.frame_row(frame);
    let rate = [row.rate_x, row.rate_y, row.rate_z];
    FrameData {
        file: row.file,
        time_s: Some(row.time_s),
        utc_s: Some(one.start_unix_s() + row.time_s),
        altitude_km: Some(row.altitude_km),
        position_km: Some([row.x_km, row.y_km, row.z_km]),
        rate_rad_s: rate[0].zip(rate[1]).zip(rate[2]).map(|((x, y), z)| [x, y, z]),
        ..FrameData::default()
    }
}

/// Returns whether a body is the Earth.
pub(super) fn is_earth(kind: Kind) -> bool {
    matches!(kind, Kind::Earth | Kind::EarthSphere)
}
