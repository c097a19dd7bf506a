//! Converts a processed picture to the rows and records of files.

use hzn_calib::{FrameData, Orientation};
use hzn_core::status::Status;
use hzn_core::{Config, body};
use hzn_mcap::{
    Attitude, BodyOrientation, CandidateEdge, EncodedImage, FrameRecord, ImageFormat, LogLevel, LogLine, PicturePrior,
    Row, RowMeta,
};
use hzn_sim::evaluate;

use crate::engine::{BodyOutcome, Finished};

/// Returns the altitude above a body in kilometres: from the position if there is one, otherwise the given altitude.
/// Sun and Moon have none.
pub fn altitude_km(data: Option<&FrameData>, body: &body::Config) -> Option<f64> {
    if body.half_angle_is_free() {
        return None;
    }
    let own = data.and_then(|d| {
        let altitude = |p| hzn_calib::frames::altitude_at_km(p, body.kind, body.mean_radius_km());
        d.position_km.and_then(altitude).or(d.altitude_km)
    });
    own.or(body.altitude_km)
}

/// Returns the rows of a picture, one for each body.
pub fn rows(frame: &Finished, config: &Config) -> Vec<Row> {
    let row = |(body, found): (&body::Config, &BodyOutcome)| {
        let meta = RowMeta {
            index: frame.index,
            file: frame.name.clone(),
            time_s: frame.time_s,
            body: body.kind.name().to_owned(),
            altitude_km: altitude_km(frame.data.as_ref(), body),
        };
        match &found.report {
            Ok(report) => Row::from_report(&meta, report, Some(found.elapsed.as_nanos() as f64 / 1e3)),
            Err(e) => Row::unprocessed(&meta, e.status, e.why.clone()),
        }
    };
    config.each_body().iter().zip(&frame.outcomes).map(row).collect()
}

/// Returns the records of a picture, one for each body. The pixels and the drawing are moved out of the picture, into
/// the first record.
pub fn records(frame: &mut Finished, config: &Config) -> Vec<FrameRecord> {
    let mut records: Vec<FrameRecord> = rows(frame, config).into_iter().map(FrameRecord::new).collect();
    if let Some(first) = records.first_mut() {
        if let Some(data) = &frame.data {
            first.prior = to_picture_prior(data);
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
        match &found.report {
            Ok(report) => record.candidates = CandidateEdge::from_report(report),
            Err(e) => record.log.push(LogLine { level: LogLevel::Error, message: e.why.clone() }),
        }
    }
    records
}

/// Converts a row to an answer for the evaluation.
pub fn answer(row: &Row) -> evaluate::Answer {
    let covariance =
        || -> Option<[f64; 6]> { Some([row.cov_xx?, row.cov_xy?, row.cov_xz?, row.cov_yy?, row.cov_yz?, row.cov_zz?]) };
    let found = row.axis().filter(|_| row.status == Status::Ok).map(|axis| evaluate::MeasuredDirection {
        axis,
        // Without a covariance the error still counts, but its covariance is not evaluated.
        covariance_rad2: covariance().unwrap_or_default(),
        half_angle_deg: row.half_angle_deg,
    });
    let position = || {
        let (centre_km, covariance_km2) = (row.position_km()?, row.position_covariance_km2()?);
        Some(evaluate::MeasuredPosition { centre_km, covariance_km2 })
    };
    let position = found.and_then(|_| position());
    evaluate::Answer { file: row.file.clone(), body: row.body.clone(), status: row.status, found, position }
}

/// Converts a row of frames.csv to the prior that recordings store.
fn to_picture_prior(data: &FrameData) -> PicturePrior {
    PicturePrior {
        utc_s: data.utc_s,
        altitude_km: data.altitude_km,
        position_km: data.position_km,
        q_fixed_from_camera_wxyz: data.q_fixed_from_camera_wxyz,
        attitude_sigma_deg: data.attitude_sigma_deg,
        sun_camera: data.sun_camera,
        rate_rad_s: data.rate_rad_s,
        pole_camera: data.pole_camera,
        range_km: data.range_km,
        range_sigma_km: data.range_sigma_km,
        other_bodies: data.other_bodies.iter().map(to_recorded_orientation).collect(),
    }
}

fn to_recorded_orientation(other: &Orientation) -> BodyOrientation {
    BodyOrientation {
        body: other.body.clone(),
        q_vehicle_from_camera_wxyz: other.q_fixed_from_camera_wxyz,
        pole_camera: other.pole_camera,
    }
}
