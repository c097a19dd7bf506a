//! The processing of one picture: decoding, the sensor, the drawing, the overlay.

use hzn_core::Config;
use hzn_core::camera::Camera;
use hzn_core::status::Status;
use hzn_mcap::Annotations;

use super::annotate::annotate;
use super::outcome::{BodyOutcome, Bytes, Finished};
use super::plan::Plan;
use super::sensor::AnySensor;
use super::told_sun;
use super::trace::Traces;
use crate::error::{Error, failed};
use crate::overlay::OverlayFolder;
use crate::source::{Held, Item, Picture};
use crate::unread;
#[cfg(feature = "recordings")]
use crate::{overlay, overlay::caption::Caption, record};

/// Decodes and processes one picture, and writes its mask.
///
/// # Errors
/// An overlay or a mask cannot be written.
pub fn process_one(plan: &Plan, sensor: &mut AnySensor, index: u64, item: Item) -> Result<Finished, Error> {
    // A file that is replaced while it is read then counts as changed.
    let identity = item.payload.identity();
    let mut finished = Finished { identity, ..process_and_draw(plan, sensor, index, item)? };
    if let Some(masks) = &plan.masks {
        let data = finished.data.as_ref();
        finished.mask = Some(masks.write(&finished.name, &finished.answers(), data, &sensor.camera_of(data))?);
    }
    Ok(finished)
}

fn process_and_draw(plan: &Plan, sensor: &mut AnySensor, index: u64, mut item: Item) -> Result<Finished, Error> {
    let time = item.time_source(plan.frames.as_ref());
    let data = item.take_prior(plan.frames.as_ref());
    // It is dropped at the end of this function, after the picture.
    let mut held = Held::default();
    let decoded = item.payload.decode_holding(Some(&plan.config), &mut held);
    let exif = || decoded.as_ref().ok().and_then(|(p, _)| p.exif_time_s);
    let time_s = time.time_s(data.as_ref(), exif, index, plan.fps);
    let mut finished = Finished {
        index,
        name: item.name,
        time_s,
        stamp: item.stamp,
        data,
        outcomes: Vec::new(),
        is_flight: plan.flight,
        drawing: Annotations::default(),
        picture: None,
        glimpse: None,
        traces: None,
        tip: None,
        pages: decoded.as_ref().map_or(1, |(p, _)| p.pages),
        mask: None,
        identity: None,
        bytes: decoded.as_ref().ok().map(|(picture, _)| Bytes::of(picture, time)),
        brightness_by_sun: None,
    };
    let (picture, original) = match decoded {
        Ok(decoded) => decoded,
        Err(why) => return Ok(without_picture(sensor, finished, &why)),
    };
    let traces =
        (plan.trace || plan.keep_traces || plan.overlay.is_some()).then(|| Traces::new(plan.config.each_body().len()));
    let view = match picture.view(plan.config.input.channel) {
        Ok(view) => view,
        Err(why) => {
            return Ok(without_picture(sensor, finished, &unread::other_channel(why)));
        }
    };
    let data = finished.data.as_ref();
    finished.glimpse = sensor.glimpse(&view);
    sensor.set_time(finished.time_s);
    finished.outcomes = sensor.process(&view, data, traces.as_ref()).into_iter().map(BodyOutcome::from).collect();
    look_at_pixels(plan, sensor, &picture, &mut finished);
    let data = finished.data.as_ref();
    if let Some(traces) = traces.as_ref().filter(|_| plan.trace || plan.overlay.is_some()) {
        // The drawing is made here, because in the single writing thread it would delay all other threads.
        let drawing = draw(&finished.outcomes, traces, &sensor.camera_of(data));
        if let Some(folder) = &plan.overlay {
            write_overlay(plan, folder, &picture, &finished, &drawing)?;
        }
        finished.drawing = drawing;
    }
    finished.traces = traces.filter(|_| plan.keep_traces).map(|traces| traces.with_digest(picture.digest()));
    if plan.keep_picture {
        let png = || picture.to_png().map_err(|e| failed(format!("{}: {e}", finished.name)));
        finished.picture = Some(original.map_or_else(png, Ok)?);
    }
    Ok(finished)
}

/// Takes what the pixels say beyond the answers: along the limbs, towards the Sun, and if there is no answer.
fn look_at_pixels(plan: &Plan, sensor: &AnySensor, picture: &Picture, finished: &mut Finished) {
    if let Some(bytes) = &mut finished.bytes {
        // Without the rate: the flight computer compares the same tiles.
        bytes.see_limbs(&finished.outcomes, &sensor.camera_of(None));
    }
    let camera = sensor.camera_of(finished.data.as_ref());
    finished.brightness_by_sun = brightness_by_sun(&plan.config, picture, &camera, finished);
    if finished.outcomes.iter().all(|f| f.report.as_ref().is_ok_and(|r| r.status != Status::Ok)) {
        finished.tip = picture.doubt_samples();
    }
}

/// Returns whether the first body becomes brighter towards the Sun that was told, see [`told_sun`].
fn brightness_by_sun(config: &Config, picture: &Picture, camera: &Camera<f64>, finished: &Finished) -> Option<f64> {
    let sun = finished.data.as_ref()?.sun_camera?;
    let is_lit = config.each_body().first()?.is_sunlit();
    let limb = finished.answers().first().copied().flatten().filter(|_| is_lit)?;
    told_sun::brightness_by_sun(picture, camera, limb, sun)
}

/// Finishes a picture that cannot be read. It is a gap in the sequence, after which no limb is tracked.
fn without_picture(sensor: &mut AnySensor, finished: Finished, why: &str) -> Finished {
    sensor.forget_limb();
    finished.into_unreadable(sensor.bodies(), why)
}

/// Returns the drawing over the picture for all of its bodies.
fn draw(outcomes: &[BodyOutcome], traces: &Traces, camera: &Camera<f64>) -> Annotations {
    let mut drawing = Annotations::default();
    for (outcome, trace) in outcomes.iter().zip(&traces.each) {
        let solution = outcome.report.as_ref().ok().and_then(|r| r.solution.as_ref());
        drawing.add(annotate(trace, solution, camera));
    }
    drawing
}

/// Writes the overlay of a picture.
#[cfg(feature = "recordings")]
fn write_overlay(
    plan: &Plan,
    folder: &OverlayFolder,
    picture: &Picture,
    finished: &Finished,
    drawing: &Annotations,
) -> Result<(), Error> {
    let rows = record::rows(finished, &plan.config);
    let caption = Caption::new(&finished.name, finished.time_s, &rows, drawing);
    let caption = caption.with_scale(plan.config.camera.fx_px).with_provenance(&folder.provenance);
    let image = overlay::draw(picture.to_rgb(), drawing, &[], &caption);
    overlay::save(&image, &folder.path.join(overlay::file_name(&finished.name)))
}

/// Refuses an overlay: its letters are not built in.
#[cfg(not(feature = "recordings"))]
fn write_overlay(_: &Plan, _: &OverlayFolder, _: &Picture, _: &Finished, _: &Annotations) -> Result<(), Error> {
    Err(failed("an overlay needs the feature `recordings` of hzn-run"))
}
