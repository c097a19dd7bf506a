//! Explains one picture, stage by stage.

use std::time::{Duration, Instant};

use hzn_core::Config;
use hzn_files::FrameData;
use hzn_mcap::{Row, RowMeta};
use hzn_run::engine::{AnySensor, Traces, Unprocessed};
use hzn_run::explained::{PictureToExplain, Work};
use hzn_run::overlay::caption::{self, Caption};
use hzn_run::provenance;
use hzn_run::source::Item;

use super::args::Args;
use super::drawing::Drawing;
use crate::exit::{Exit, Stop, usage};
use crate::tell::{self, one_line};

/// What is left after a picture is explained.
pub(super) struct Explained {
    pub(super) exit: Exit,
    /// The drawing over the picture, if one is wanted and the picture can be read.
    pub(super) drawing: Option<image::RgbImage>,
}

/// Decodes and explains a picture. The title of its drawing begins with `title`.
pub(super) fn explain_item(
    item: Item,
    config: &Config,
    data: Option<&FrameData>,
    title: &str,
    args: &Args,
) -> Result<Explained, Stop> {
    let Item { name, payload, .. } = item;
    let decoding = Instant::now();
    let picture = match payload.decode(Some(config)) {
        Ok((picture, _)) => picture,
        Err(why) => {
            tell::result(format_args!("{}\n", one_line(format_args!("{name}: unreadable: {why}"))))?;
            return Ok(Explained { exit: Exit::SomeUnreadable, drawing: None });
        }
    };
    let decoding = decoding.elapsed();
    if picture.pages > 1 {
        let what = "pictures; only the first is explained";
        tell::line(format_args!("note: {name} contains {} {what}", picture.pages));
    }
    let flight = args.sensor.flight;
    explain(&PictureToExplain { name: &name, config, data, picture: &picture, flight }, title, args, decoding)
}

/// Processes the picture and explains each body; draws the overlay.
fn explain(picture: &PictureToExplain<'_>, title: &str, args: &Args, decoding: Duration) -> Result<Explained, Stop> {
    let PictureToExplain { name: file, config, data, picture: pixels, .. } = *picture;
    let mut sensor = AnySensor::new(config, args.sensor.flight).map_err(usage)?;
    let half_angles = sensor.expected_half_angles_rad(data);
    let view = pixels.view(config.input.channel).map_err(|e| usage(format!("input.channel: {e}")))?;
    // The first pass warms up: the first picture of a process also pays for the first access to its memory.
    sensor.process(&view, data, None);
    let times = sensor.process(&view, data, None);
    let traces = Traces::new(config.each_body().len());
    let mut drawing = Drawing::default();
    let mut answers = Vec::new();
    let processed = sensor.process(&view, data, Some(&traces)).into_iter().zip(times);
    let mut exit = Exit::Done;
    for (which, ((processed, time), half_angle)) in processed.zip(half_angles).enumerate() {
        let (Some(body), Some(trace)) = (config.each_body().get(which), traces.each.get(which)) else { continue };
        let between = if which > 0 { "\n" } else { "" };
        let name = body.kind.name();
        let (report, half_angle) = match (processed.report, half_angle) {
            (Ok(report), Ok(half_angle)) => (report, half_angle),
            (Err(why), _) | (_, Err(why)) => {
                let Unprocessed { status, why, .. } = why.into();
                let text = one_line(format_args!("{file}: {name}: {status}: {why}"));
                tell::result(format_args!("{between}{text}\n"))?;
                answers.push(format!("{name}: {status} ({why})"));
                exit = Exit::SomeUnreadable;
                continue;
            }
        };
        let times = Some([decoding, time.elapsed]);
        let work = Work { which, trace, report: &report, half_angle_rad: half_angle, times };
        if let Some(text) = picture.explain(&mut sensor, &work)? {
            tell::result(format_args!("{between}{text}"))?;
        }
        // The camera includes the rate of rotation, so that the drawing fits each row of a rolling shutter.
        let camera = sensor.camera_of(data);
        drawing.add(trace, report.solution.as_ref(), &camera);
        let meta = RowMeta { index: 0, file: String::new(), time_s: None, body: name.to_owned(), altitude_km: None };
        answers.push(caption::answer(&Row::from_report(&meta, &report, None), None));
    }
    let camera = sensor.camera_of(data);
    let provenance = provenance::line(provenance::hash(config).as_deref(), &provenance::command("hzn"));
    let caption = Caption { text: format!("{title}{file}; {}", answers.join("; ")), ..Caption::default() };
    let caption = caption.with_scale(config.camera.fx_px).with_provenance(provenance);
    let over = |_| drawing.over(pixels, args.undistorted.then_some(&camera), &caption);
    let drawing = args.overlay.as_ref().map(over).transpose()?;
    Ok(Explained { exit, drawing })
}
