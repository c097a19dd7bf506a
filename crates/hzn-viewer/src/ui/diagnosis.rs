//! The diagnosis: why a picture has no answer, in numbers, and a button for each cure.

use egui::{RichText, Ui};
use hzn_core::body::Kind;
use hzn_core::status::Status;

use super::agreement::ENOUGH;
use super::size_table::OfSize;
use super::steps::{self, Step, wrapped};
use super::viewer::Viewer;
use super::{facts, links, theme};
use crate::model::cause::Reason;
use crate::model::diagnosis::{self, FitFacts};
use crate::work::frame_view::BodyResult;
use crate::work::trials::OtsuTrial;

/// Difference of the half-angles from which the table of causes is shown, in standard deviations.
const CONSPICUOUS: f64 = 3.0;
/// What a picture without a usable altitude needs.
const NOT_PROCESSED: &str = "The picture is not processed: the altitude says how large the limb is. Set \
                             body.altitude_km if it is the same in all pictures. Otherwise write the columns file and \
                             altitude_km into frames.csv next to the pictures, and reload them (F5).";

/// Draws the diagnosis. It draws nothing if the picture has an answer and its half-angle is the expected one.
pub(super) fn show(viewer: &mut Viewer, ui: &mut Ui) {
    let Some(answer) = viewer.answer().cloned() else { return };
    let refused = answer.row.status != Status::Ok;
    let fits = viewer.rows.fits(viewer.body).count();
    let typical = diagnosis::typical_sigmas(viewer.rows.fits(viewer.body));
    let is_as_expected = fits >= ENOUGH && is_limb_as_expected(viewer);
    let conspicuous = |sigmas: Option<f64>| sigmas.is_some_and(|s| s.abs() > CONSPICUOUS);
    let differs = conspicuous(answer.fit.map(|f| f.sigmas)) || conspicuous(typical);
    if !refused && !differs {
        return;
    }
    // In the other frames the values of now are right.
    let is_other_edge = is_as_expected && conspicuous(answer.fit.map(|f| f.sigmas));
    let otsu = answer.otsu.filter(|_| refused);
    let wrong_level = otsu.is_some_and(|o| o.is_better());
    // What the other pictures say about the size of the limb does not help a picture without the limb's edge.
    let has_edge = answer.fit.is_some() || !wrong_level && answer.cause.is_some_and(|cause| cause.has_edge());
    let of_size = if differs && has_edge && !is_other_edge { OfSize::new(viewer, answer.fit) } else { None };
    let has_numbers = of_size.is_some() || is_other_edge;
    // General advice follows from the edges, and those of a wrong threshold are not the limb.
    let config = viewer.session.as_ref().and_then(|session| session.config());
    let tips = config.filter(|_| !wrong_level).map(|config| facts::tips(&answer, config)).unwrap_or_default();
    let steps = steps_of(viewer, &answer, of_size.as_ref(), if has_numbers { &[] } else { &tips });
    let fill = ui.visuals().faint_bg_color;
    let border = theme::warning(ui.visuals().dark_mode);
    let width = if viewer.focus_diagnosis { 3.0 } else { 1.0 };
    let frame = egui::Frame::new().fill(fill).stroke(egui::Stroke::new(width, border)).corner_radius(6);
    let card = frame.inner_margin(egui::Margin::symmetric(8, 6)).show(ui, |ui| {
        ui.set_width(ui.available_width());
        ui.strong("Diagnosis");
        say_cause(viewer, ui, &answer);
        steps::show(viewer, ui, &steps);
        if let Some(otsu) = otsu {
            threshold_cause(viewer, ui, &answer, otsu);
        }
        match (answer.fit.filter(|_| differs), &of_size) {
            (Some(fit), _) if is_other_edge => wrapped(ui, &only_here(&fit)),
            (_, Some(of_size)) => of_size.show(viewer, ui),
            _ if answer.fit.is_none() && !wrong_level && is_as_expected => {
                let what = "No edge here fits a limb, and in most other pictures the limb is as expected. The body is \
                            probably out of view, or hidden.";
                wrapped(ui, what);
            }
            _ => {}
        }
        if has_numbers && !tips.is_empty() {
            // The numbers above say more than general advice.
            egui::CollapsingHeader::new(RichText::new("More advice").size(12.5)).show(ui, |ui| {
                tips.iter().for_each(|tip| links::tip(viewer, ui, &format!("• {tip}")));
            });
        }
    });
    if viewer.focus_diagnosis {
        card.response.scroll_to_me(Some(egui::Align::TOP));
        viewer.focus_diagnosis = !ui.input(|i| i.pointer.any_pressed());
    }
    ui.add_space(4.0);
}

/// Says in a word why there is no answer.
fn say_cause(viewer: &mut Viewer, ui: &mut Ui, answer: &BodyResult) {
    if let Some(cause) = answer.cause.and_then(|c| c.reason) {
        ui.label(format!("{}: {}", answer.row.status, cause.name()));
    }
    // The sensor has not looked at the picture, so the reason is all there is to say.
    if let Err(why) = &answer.report {
        links::tip(viewer, ui, &format!("• {why}"));
        // Sun and Moon need no altitude, so that another value of the picture is the reason.
        if answer.row.status == Status::NoAltitude && !matches!(answer.kind, Kind::Sun | Kind::Moon) {
            wrapped(ui, NOT_PROCESSED);
        }
    }
}

/// Returns what to do. A trial ends first, because the rest would be said about values that nobody gave. The threshold
/// follows, because the limb is not seen without it, then the size of the limb, then other edges, and general advice
/// last.
fn steps_of(viewer: &Viewer, answer: &BodyResult, of_size: Option<&OfSize>, tips: &[String]) -> Vec<Step> {
    let mut steps = Vec::new();
    if viewer.sequence.altitude_shift_km != 0.0 {
        let by_km = viewer.sequence.altitude_shift_km;
        let what = format!("End the trial: all altitudes are shifted by {by_km:+.1} km, which no file says.");
        steps.push(Step::Say(format!(
            "{what} The button is in the card above. The rest is said about these altitudes."
        )));
    }
    let refused = answer.row.status != Status::Ok;
    if let Some(otsu) = answer.otsu.filter(|otsu| refused && otsu.is_better()) {
        let now = answer.row.level.unwrap_or(0);
        steps.push(Step::Otsu(format!("Use Otsu's threshold of {} counts instead of {now}.", otsu.level)));
    }
    steps.extend(of_size.map(OfSize::step));
    if viewer.steady.area.is_some() {
        steps.push(Step::Say("Mask the edge that does not move: “Mask this” is in the card below.".into()));
    }
    steps.extend(tips.iter().cloned().map(Step::Tip));
    steps
}

/// Returns true if the pictures with an answer show that the expected half-angle is right.
fn is_limb_as_expected(viewer: &Viewer) -> bool {
    let causes = || (0..viewer.sequence.len()).filter_map(|i| viewer.rows.cause(i, viewer.body));
    // A picture without an edge says nothing about the half-angle, and neither does one that is unreadable.
    let with_edge = causes().filter(|c| c.has_edge()).count();
    let answered = causes().filter(|c| c.status == Status::Ok).count();
    diagnosis::is_limb_as_expected(viewer.rows.fits(viewer.body), answered, with_edge)
}

/// Says that the half-angle of this frame alone is not the expected one.
fn only_here(fit: &FitFacts) -> String {
    format!(
        "An edge here fits a half-angle of {:.3}°, expected is {:.3}° ({:+.1} σ). Most other pictures agree with the \
         expected one, so this edge is probably not the limb.",
        fit.fitted_deg, fit.expected_deg, fit.sigmas
    )
}

/// Compares the threshold with Otsu's.
fn threshold_cause(viewer: &Viewer, ui: &mut Ui, answer: &BodyResult, otsu: OtsuTrial) {
    let level = answer.row.level.unwrap_or(0);
    let times = f64::from(level) / f64::from(otsu.level.max(1));
    let outcome = match (otsu.answered, otsu.finds_limb) {
        (true, _) => "gives an answer",
        (false, true) => "shows a limb of another size",
        (false, false) => "gives no answer, either",
    };
    let now = format!("The threshold in use is {level} counts, {times:.2} times as high.");
    wrapped(ui, &format!("Otsu's threshold, {} counts, {outcome}. {now}", otsu.level));
    let all = viewer.sequence.len();
    let same =
        (0..all).filter_map(|i| viewer.rows.cause(i, viewer.body)).filter(|c| c.reason == Some(Reason::Level)).count();
    if same > 1 {
        wrapped(ui, &format!("The same holds for {same} of {all} pictures."));
    }
}
