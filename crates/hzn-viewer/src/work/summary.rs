//! The short result of a picture, for the plots and for the diagnosis over the sequence.

use hzn_core::Config;
use hzn_core::image::ImageView;
use hzn_core::status::Status;
use hzn_run::engine::{AnySensor, BodyOutcome, Traces};
use hzn_run::sink;

use super::frame_view::FrameInput;
use super::trials::Trials;
use crate::model::Processed;
use crate::model::cause::Cause;
use crate::model::sigma_parts::SigmaParts;
use crate::model::steady_edge::EdgeCells;

/// Processes a picture and returns its results with their causes and fits. Without `trials` there are only results.
pub(super) fn summarise(
    view: &ImageView<'_>,
    input: FrameInput<'_>,
    config: &Config,
    sensor: &mut AnySensor,
    trials: Option<&mut Trials>,
) -> Processed {
    let traces = Traces::new(config.each_body().len());
    let found = match &trials {
        // The time without the observer counts. A sensor that tracks the threshold sees each picture once.
        Some(_) if config.tracks() => sensor.process(view, input.data, Some(&traces)),
        Some(_) => {
            sensor.process(view, input.data, Some(&traces));
            sensor.process(view, input.data, None)
        }
        None => sensor.process(view, input.data, None),
    };
    let finished = input.finish(found.into_iter().map(BodyOutcome::from).collect());
    let mut processed = Processed { rows: sink::rows(&finished, config), ..Processed::default() };
    let Some(trials) = trials else { return processed };
    let refused = processed.rows.iter().any(|r| r.status != Status::Ok);
    let otsu = trials.try_otsu(view, input.data, refused).unwrap_or_default();
    let camera = sensor.camera_of(input.data);
    for (index, outcome) in finished.outcomes.iter().enumerate() {
        let row = processed.rows.get(index);
        let (Ok(report), Some(trace), Some(row)) = (&outcome.report, traces.each.get(index), row) else {
            let unknown = Cause { status: Status::Unreadable, reason: None };
            processed.causes.push(row.map_or(unknown, Cause::from_row));
            processed.fits.push(None);
            processed.sigma_parts.push(None);
            continue;
        };
        let answered = otsu.get(index).is_some_and(|o| o.answered);
        // The edge of a wrong threshold is not the limb.
        let find =
            |trials: &mut Trials| trials.find_fit(&trace.edges(), report, row.altitude_km, &camera, (view, input.data));
        let fit = if answered { None } else { find(&mut *trials) };
        let needs_otsu = fit.as_ref().is_some_and(|(_, _, needs_otsu)| *needs_otsu);
        processed.causes.push(Cause::from_report(report, answered || needs_otsu));
        processed.fits.push(fit.map(|(facts, _, _)| facts));
        let parts = report.solution.as_ref().and_then(|s| SigmaParts::of_answer(s, &trace.edges()));
        processed.sigma_parts.push(parts);
    }
    let size = [input.picture.layout.width, input.picture.layout.height];
    let each: Vec<_> = traces.each.iter().map(|trace| trace.edges()).collect();
    let chosen = |outcome: &BodyOutcome| Some(outcome.report.as_ref().ok()?.solution.as_ref()?.candidate);
    let bodies = each.iter().map(|edges| edges.as_slice()).zip(finished.outcomes.iter().map(chosen));
    processed.edges = EdgeCells::of(size, bodies);
    processed
}
