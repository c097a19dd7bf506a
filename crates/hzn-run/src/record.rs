//! Converts a processed picture to the rows and records of files.

use hzn_core::{Config, body};
use hzn_files::FrameData;
use hzn_mcap::{Attitude, CandidateEdge, EncodedImage, FrameRecord, ImageFormat, LogLevel, LogLine, Row, RowMeta};

use crate::engine::{BodyOutcome, Finished};

/// Returns the altitude above a body in kilometres: from the position if there is one, otherwise the given altitude.
/// Sun and Moon have none.
pub fn altitude_km(data: Option<&FrameData>, body: &body::Config) -> Option<f64> {
    if body.half_angle_is_free() {
        return None;
    }
    let own = data.and_then(|d| {
        let altitude = |p| hzn_files::frames::altitude_at_km(p, body.kind, body.mean_radius_km());
        d.position_km.and_then(altitude).or(d.altitude_km)
    });
    own.or(body.altitude_km)
}

/// Returns the rows of a picture, one for each body.
pub fn rows(frame: &Finished, config: &Config) -> Vec<Row> {
    let row = |(which, (body, found)): (u8, (&body::Config, &BodyOutcome))| {
        let meta = RowMeta {
            index: frame.index,
            file: frame.name.clone(),
            time_s: frame.time_s,
            body: body.kind.name().to_owned(),
            altitude_km: altitude_km(frame.data.as_ref(), body),
        };
        match &found.report {
            // Without a clock there is no time, rather than a time of zero.
            Ok(report) => {
                Row::from_report(&meta, report, Some(found.elapsed.as_nanos() as f64 / 1e3).filter(|us| *us > 0.0))
                    .with_protection(config.protection_factor(which))
            }
            Err(e) => Row::unprocessed(&meta, e.status, e.why.clone()),
        }
    };
    let rows = (0..).zip(config.each_body().iter().zip(&frame.outcomes)).map(row);
    rows.map(|row| if frame.is_flight { row.as_sent() } else { row }).collect()
}

/// Returns the records of a picture, one for each body. The pixels and the drawing are moved out of the picture, into
/// the first record.
pub fn records(frame: &mut Finished, config: &Config) -> Vec<FrameRecord> {
    let mut records: Vec<FrameRecord> = rows(frame, config).into_iter().map(FrameRecord::new).collect();
    if let Some(first) = records.first_mut() {
        if let Some(data) = &frame.data {
            first.prior = data.clone();
            first.attitude = data.q_fixed_from_camera_wxyz.map(|q| Attitude {
                q_fixed_from_camera_wxyz: q,
                position_m: data.position_km.unwrap_or_default().map(|km| km * 1e3),
            });
        }
        first.image = frame.picture.take().map(|bytes| {
            let png = matches!(crate::source::decode::guess_format(&bytes), Some(image::ImageFormat::Png));
            EncodedImage { format: if png { ImageFormat::Png } else { ImageFormat::Jpeg }, bytes }
        });
        first.annotations = std::mem::take(&mut frame.drawing);
    }
    for (record, found) in records.iter_mut().zip(&frame.outcomes) {
        record.stamp.clone_from(&frame.stamp);
        match &found.report {
            Ok(report) => record.candidates = CandidateEdge::from_report(report),
            Err(e) => record.log.push(LogLine { level: LogLevel::Error, message: e.why.clone() }),
        }
    }
    records
}
