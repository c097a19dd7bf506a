//! Recordings of simulated flights through pictures.

use std::path::Path;

use anyhow::anyhow;
use hzn_core::Config;
use hzn_core::body::{self, Kind};
use hzn_files::frames::{FrameData, Frames};
use hzn_fuse::input::{Inputs, Recording};
use hzn_fuse::simulated;
use hzn_mcap::{Row, RowMeta};
use hzn_run::engine::AnySensor;
use hzn_run::sink::{Existing, RowFile};
use hzn_sim::{FlightFrame, Scenario};
use rayon::prelude::*;

/// Pictures that are rendered before they are processed.
const BATCH: usize = 32;

/// Returns everything that a flight records. `told` gives the sensor of a camera. Recordings are read from the folder
/// `kept` if they are there, and written to it if not.
pub(super) fn inputs(
    scene: &Scenario,
    told: impl Fn(&Scenario) -> Config,
    kept: Option<&Path>,
) -> anyhow::Result<Inputs> {
    let mut inputs = simulated::instruments(scene)?;
    for one in scene.by_camera() {
        let config = told(&one);
        let name = format!("{}-{}-{}-{}.jsonl", scene.name, scene.seed, one.capture.frames, one.name);
        let file = kept.map(|dir| dir.join(name));
        let rows = match &file {
            Some(file) if file.exists() => hzn_run::results::read(file).map_err(|e| anyhow!("{e}"))?.rows,
            _ => process(&one, &config, None)?,
        };
        if let Some(file) = file.filter(|file| !file.exists()) {
            keep(&file, &rows)?;
        }
        inputs.recordings.push(Recording::new(one.name.clone(), rows, Some(&config))?);
    }
    Ok(inputs)
}

fn keep(file: &Path, rows: &[Row]) -> anyhow::Result<()> {
    std::fs::create_dir_all(file.parent().unwrap_or(Path::new(".")))?;
    let mut out = RowFile::create(file, Existing::Refuse).map_err(|e| anyhow!("{e}"))?;
    rows.iter().try_for_each(|row| out.write(row))?;
    out.finish().map_err(|e| anyhow!("{e}"))
}

/// Returns the sensor that knows camera, mount and bodies, and has defaults for everything else.
pub(super) fn untold(one: &Scenario) -> Config {
    let mut sensor = one.sensor();
    sensor.covariance = hzn_core::covariance::Config::default();
    for body in &mut sensor.bodies {
        *body = body::Config { kind: body.kind, threshold: body.threshold, ..body::Config::default() };
    }
    sensor
}

/// Renders the pictures of a camera and runs the sensor on them. `given` replaces the rows of frames.csv.
pub(super) fn process(one: &Scenario, config: &Config, given: Option<&Frames>) -> anyhow::Result<Vec<Row>> {
    process_each(one, [config], given).map(|[rows]| rows)
}

/// Does the same with several sensors on the same pictures.
pub(super) fn process_each<const N: usize>(
    one: &Scenario,
    configs: [&Config; N],
    given: Option<&Frames>,
) -> anyhow::Result<[Vec<Row>; N]> {
    let flight = one.flight()?;
    let mut sensors = configs.iter().map(|config| AnySensor::new(config, false)).collect::<Result<Vec<_>, _>>()?;
    let mut rows = [const { Vec::new() }; N];
    for (batch, frames) in flight.frames.chunks(BATCH).enumerate() {
        let pictures: Vec<_> = frames.par_iter().map(FlightFrame::render).collect::<Result<_, _>>()?;
        for (k, (frame, picture)) in frames.iter().zip(&pictures).enumerate() {
            let index = (batch * BATCH + k) as u64;
            let data = given.and_then(|g| g.get(&frame.file)).cloned().unwrap_or_else(|| known(one, frame));
            for ((sensor, config), rows) in sensors.iter_mut().zip(configs).zip(&mut rows) {
                for (body, done) in config.each_body().iter().zip(sensor.process(&picture.view(), Some(&data), None)) {
                    let report = done.report.map_err(|e| anyhow!("{}: {e}", frame.file))?;
                    let meta = RowMeta {
                        index,
                        file: frame.file.clone(),
                        time_s: data.time_s,
                        body: body.kind.name().into(),
                        altitude_km: data.altitude_km,
                    };
                    rows.push(Row::from_report(&meta, &report, None));
                }
            }
        }
    }
    Ok(rows)
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
