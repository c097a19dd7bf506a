//! The diagnosis: why a picture has no answer, in numbers, and a button for each cure.

use egui::{RichText, Ui, vec2};
use hzn_core::body::Kind;
use hzn_core::status::Status;
use hzn_core::{Config, threshold};

use super::viewer::Viewer;
use super::{altitude_trial, links, theme};
use crate::model::Session;
use crate::model::cause::Reason;
use crate::model::diagnosis::{self, Consensus, FitFacts, Implied, Pair, Remedy, Suspect};
use crate::work::frame_view::BodyResult;
use crate::work::trials::OtsuTrial;

/// Difference of the half-angles from which the table of causes is shown, in standard deviations.
const CONSPICUOUS: f64 = 3.0;
/// What a picture without a usable altitude needs.
const NOT_PROCESSED: &str = "The picture is not processed: the altitude says how large the limb is. Set \
                             body.altitude_km if it is the same in all pictures. Otherwise write the columns file and \
                             altitude_km into frames.csv next to the pictures, and reload them (F5).";
/// Number of frames that together say something about a cause.
const ENOUGH: usize = 3;

/// A change of the sensor.toml that cures a cause: keys of one step with their values.
pub(super) type Cure = Vec<(&'static str, &'static str, f64)>;

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
    let fill = ui.visuals().faint_bg_color;
    let border = theme::warning(ui.visuals().dark_mode);
    let width = if viewer.focus_diagnosis { 3.0 } else { 1.0 };
    let frame = egui::Frame::new().fill(fill).stroke(egui::Stroke::new(width, border)).corner_radius(6);
    let card = frame.inner_margin(egui::Margin::symmetric(8, 6)).show(ui, |ui| {
        ui.set_width(ui.available_width());
        ui.strong("Diagnosis");
        if let Some(cause) = answer.cause.and_then(|c| c.reason) {
            ui.label(format!("{}: {}", answer.row.status, cause.name()));
        }
        // The sensor has not looked at the picture, so the reason is all there is to say.
        if let Err(why) = &answer.report {
            links::tip(viewer, ui, why);
            if answer.row.status == Status::NoAltitude {
                wrapped(ui, NOT_PROCESSED);
            }
        }
        if let Some(otsu) = answer.otsu.filter(|_| refused) {
            threshold_cause(viewer, ui, &answer, otsu);
        }
        let wrong_level = answer.otsu.is_some_and(|o| o.answered);
        match answer.fit.filter(|_| differs) {
            // In the other frames the values of now are right.
            Some(fit) if is_as_expected && conspicuous(Some(fit.sigmas)) => wrapped(ui, &only_here(&fit)),
            Some(fit) => half_angle_causes(viewer, ui, &fit),
            None if answer.fit.is_none() && !wrong_level && is_as_expected => {
                let what = "No edge here fits a limb, and in most other pictures the limb is as expected. The body is \
                            probably out of view, or hidden.";
                wrapped(ui, what);
            }
            None => {}
        }
        let tips = answer.report.as_ref().map(hzn_run::explain::tips).unwrap_or_default();
        // General advice follows from the edges, and those of a wrong threshold are not the limb.
        if !differs && !wrong_level {
            tips.iter().for_each(|tip| links::tip(viewer, ui, tip));
        } else if !tips.is_empty() && !wrong_level {
            // The numbers above say more than general advice.
            egui::CollapsingHeader::new(RichText::new("More advice").size(12.5)).show(ui, |ui| {
                tips.iter().for_each(|tip| links::tip(viewer, ui, tip));
            });
        }
    });
    if viewer.focus_diagnosis {
        card.response.scroll_to_me(Some(egui::Align::TOP));
        viewer.focus_diagnosis = !ui.input(|i| i.pointer.any_pressed());
    }
    ui.add_space(4.0);
}

/// Returns true if the pictures with an answer show that the expected half-angle is right.
fn is_limb_as_expected(viewer: &Viewer) -> bool {
    let causes = || (0..viewer.sequence.len()).filter_map(|i| viewer.rows.cause(i, viewer.body));
    // A picture without an edge says nothing about the half-angle.
    let with_edge = causes().filter(|c| c.status == Status::Ok || c.reason.is_some()).count();
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
fn threshold_cause(viewer: &mut Viewer, ui: &mut Ui, answer: &BodyResult, otsu: OtsuTrial) {
    let level = answer.row.level.unwrap_or(0);
    let times = f64::from(level) / f64::from(otsu.level.max(1));
    let outcome = if otsu.answered { "gives an answer" } else { "gives no answer, either" };
    let now = format!("The threshold in use is {level} counts, {times:.2} times as high.");
    wrapped(ui, &format!("Otsu's threshold, {} counts, {outcome}. {now}", otsu.level));
    let all = viewer.sequence.len();
    let same =
        (0..all).filter_map(|i| viewer.rows.cause(i, viewer.body)).filter(|c| c.reason == Some(Reason::Level)).count();
    if same > 1 {
        wrapped(ui, &format!("The same holds for {same} of {all} pictures."));
    }
    let hint = "Sets threshold.method = \"otsu\" and threshold.scale = 1";
    if otsu.answered && ui.button("Use Otsu's threshold").on_hover_text(hint).clicked() {
        use_otsu(viewer);
    }
}

/// Sets Otsu's threshold without a factor.
fn use_otsu(viewer: &mut Viewer) {
    let body = viewer.body;
    let Some(session) = &mut viewer.session else { return };
    let name = threshold::Method::Otsu.name();
    session.set_all(&[("threshold", "method", Some(name.into())), ("threshold", "scale", None)], body);
}

fn wrapped(ui: &mut Ui, text: &str) {
    ui.add(egui::Label::new(RichText::new(text).size(12.5)).wrap());
}

/// Draws the fitted and the expected half-angle, and what each possible cause would have to be.
fn half_angle_causes(viewer: &mut Viewer, ui: &mut Ui, fit: &FitFacts) {
    let how = if fit.is_trial { "The limb in this picture has the half-angle" } else { "Half-angle of the answer" };
    wrapped(
        ui,
        &format!(
            "{how} {:.3}°, expected is {:.3}°: {:+.3}°, {:+.1} σ. These values would make them equal:",
            fit.fitted_deg,
            fit.expected_deg,
            fit.fitted_deg - fit.expected_deg,
            fit.sigmas
        ),
    );
    let consensus = diagnosis::summarise(viewer.rows.fits(viewer.body));
    let Some(session) = &viewer.session else { return };
    let Some(config) = session.config().cloned() else { return };
    let body = viewer.body;
    let (plausible, impossible): (Vec<_>, Vec<_>) = consensus.iter().partition(|c| is_plausible(c, &config, body));
    let (mut chosen, mut shift_km) = (None, None);
    egui::Grid::new("causes").num_columns(5).spacing(vec2(8.0, 3.0)).show(ui, |ui| {
        for head in ["", "now", "this picture", "all pictures", ""] {
            ui.weak(RichText::new(head).size(11.5));
        }
        ui.end_row();
        for suspect in in_order(&plausible, &impossible) {
            let all = consensus.iter().find(|c| c.suspect == suspect);
            let Some(cause) = Cause::new(suspect, fit, all, &config, body) else { continue };
            for text in [suspect.name().to_owned(), cause.now.clone(), cause.here.clone()] {
                ui.label(RichText::new(text).size(12.0));
            }
            let all = ui.label(RichText::new(cause.all.clone()).size(12.0));
            if suspect == Suspect::Altitude {
                all.on_hover_text("A shift of the altitudes of all pictures");
            }
            match cause.shift_km.filter(|_| viewer.sequence.has_altitudes()) {
                Some(by_km) => try_shift(ui, by_km, &mut shift_km),
                None => apply(ui, &cause, &mut chosen),
            }
            ui.end_row();
        }
    });
    if let Some(by_km) = shift_km {
        return altitude_trial::shift(viewer, by_km);
    }
    let given_km = viewer.sequence.has_altitudes().then_some(viewer.sequence.altitude_shift_km);
    let of_body = config.each_body().get(body).or(config.each_body().first());
    let limb_km = of_body.map(|b| [b.limb_height_km, b.limb_height_sigma_km]);
    let pair = limb_km.and_then(|limb_km| diagnosis::find_pair(viewer.rows.fits(body), limb_km));
    if let Some(pair) = pair {
        return two_causes(viewer, ui, &pair, &config);
    }
    if let Some(words) = agreement(&plausible, &impossible, given_km) {
        wrapped(ui, &words);
    }
    if let (Some(cure), Some(session)) = (chosen, &mut viewer.session) {
        let values: Vec<_> = cure.iter().map(|(s, n, x)| (*s, *n, Some(Session::tidy_value(*x)))).collect();
        session.set_all(&values, body);
    }
}

/// Says that two values are wrong, and draws the button that corrects both.
fn two_causes(viewer: &mut Viewer, ui: &mut Ui, pair: &Pair, config: &Config) {
    let words = |r: &Remedy| match r.suspect {
        Suspect::Focal => {
            let [fx, by] = [r.correction, r.sigma].map(|x| x * config.camera.fx_px);
            format!("the focal length is {fx:.1} ± {by:.1} px")
        }
        other => {
            let side = if r.correction > 0.0 { "low" } else { "high" };
            format!("the {} is {:.1} ± {:.1} km too {side}", other.name(), r.correction.abs(), r.sigma)
        }
    };
    let [a, b] = &pair.remedies;
    let pictures = pair.pictures;
    let what = format!("Two values are wrong. No single value explains the {pictures} pictures, but two do:");
    wrapped(ui, &format!("{what} {}, and {}.", words(a), words(b)));
    let hint = "Corrects both values. Altitudes of frames.csv are shifted on trial, and no file changes.";
    if !ui.button("Apply both").on_hover_text(hint).clicked() {
        return;
    }
    let (body, has_altitudes) = (viewer.body, viewer.sequence.has_altitudes());
    let mut values: Vec<(&str, &str, Option<toml_edit::Value>)> = Vec::new();
    let mut shift_km = None;
    if let Some(session) = &viewer.session {
        let mut set = |section, name, change: &dyn Fn(f64) -> f64| {
            let now = session.number(section, name, body);
            values.extend(now.map(|now| (section, name, Some(Session::tidy_value(change(now))))));
        };
        for remedy in &pair.remedies {
            match remedy.suspect {
                Suspect::Altitude if has_altitudes => shift_km = Some(remedy.correction),
                Suspect::Altitude => set("body", "altitude_km", &|km| km + remedy.correction),
                Suspect::LimbHeight => set("body", "limb_height_km", &|km| km + remedy.correction),
                Suspect::Focal => {
                    set("camera", "fx_px", &|px| px * remedy.correction);
                    set("camera", "fy_px", &|px| px * remedy.correction);
                }
            }
        }
    }
    if let Some(session) = &mut viewer.session {
        session.set_all(&values, body);
    }
    if let Some(km) = shift_km {
        altitude_trial::shift(viewer, km);
    }
}

/// Draws the button that applies a cause, or says why it cannot be applied.
fn apply(ui: &mut Ui, cause: &Cause, chosen: &mut Option<Cure>) {
    let values = || cause.cure.iter().map(|(s, n, x)| format!("{s}.{n} = {x:.6}")).collect::<Vec<_>>().join("\n");
    let hint = cause.impossible.clone().unwrap_or_else(values);
    let can = cause.impossible.is_none();
    let response = ui.add_enabled(can, egui::Button::new("Apply").small());
    let name = format!("Apply {}", cause.suspect.name());
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Button, can, &name));
    if response.on_hover_text(&hint).on_disabled_hover_text(&hint).clicked() {
        *chosen = Some(cause.cure.clone());
    }
}

/// Draws the button that shifts the altitudes of all frames on trial: the window does not change frames.csv.
fn try_shift(ui: &mut Ui, by_km: f64, chosen: &mut Option<f64>) {
    let response = ui.add(egui::Button::new("Try").small());
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Button, true, "Try altitude"));
    let hint = format!("Processes all pictures with altitudes shifted by {by_km:+.1} km. No file changes.");
    if response.on_hover_text(hint).clicked() {
        *chosen = Some(by_km);
    }
}

/// Returns all quantities: the plausible ones, those that explain all pictures best first, and then the others.
fn in_order(plausible: &[Consensus], impossible: &[Consensus]) -> Vec<Suspect> {
    let known: Vec<Suspect> = plausible.iter().chain(impossible).map(|c| c.suspect).collect();
    let rest = Suspect::ALL.into_iter().filter(|s| !known.contains(s));
    known.iter().copied().chain(rest).collect()
}

/// Heights at which cameras see the limb of the Earth, in km: from the ground, in the near infrared, to the band of
/// carbon dioxide and the haze in the blue, with a margin. Airglow at 90 km is not the limb.
const EARTH_LIMB_KM: core::ops::RangeInclusive<f64> = -5.0..=65.0;

/// Returns false for a limb height at which no camera sees the limb of the Earth.
fn is_plausible(c: &Consensus, config: &Config, body: usize) -> bool {
    let bodies = config.each_body();
    let is_earth =
        bodies.get(body).or(bodies.first()).is_some_and(|b| matches!(b.kind, Kind::Earth | Kind::EarthSphere));
    c.suspect != Suspect::LimbHeight || !is_earth || EARTH_LIMB_KM.contains(&c.value)
}

/// Says which of the plausible causes agrees with all pictures, and names the impossible ones. `shift_km` is the shift
/// that is on trial, if the frames have altitudes of their own.
fn agreement(plausible: &[Consensus], impossible: &[Consensus], shift_km: Option<f64>) -> Option<String> {
    let (best, others) = plausible.split_first()?;
    if best.pictures < ENOUGH || others.len() + impossible.len() == 0 {
        return None;
    }
    let words = |c: &Consensus| format!("{} {:.1}", c.suspect.name(), c.disagreement);
    let none = |c: &Consensus| format!("{} impossible ({:.0} km)", c.suspect.name(), c.value);
    let all: Vec<String> = plausible.iter().map(words).chain(impossible.iter().map(none)).collect();
    // A wrong cause scatters more. Below 1 the scatter is the noise of the edges, and says nothing.
    let scatters = |c: &Consensus| c.disagreement > 2.0 * best.disagreement.max(1.0);
    let end = if others.iter().all(scatters) {
        let wrong_km = shift_km.filter(|_| best.suspect == Suspect::Altitude).map(|shift| best.value + shift);
        let where_to = wrong_km.map(|km| {
            let side = if km < 0.0 { "high" } else { "low" };
            format!(" The given altitudes are {:.1} km too {side}; correct them where they come from.", km.abs())
        });
        format!("So the {} is the likely cause.{}", best.suspect.name(), where_to.unwrap_or_default())
    } else {
        let names: Vec<&str> = plausible.iter().filter(|c| !scatters(c)).map(|c| c.suspect.name()).collect();
        format!(
            "So the cause is one of these: {}. The pictures do not tell them apart; check the one that you know least.",
            names.join(", ")
        )
    };
    let what = format!("The true cause has the same value in every picture. Scatter over {} pictures", best.pictures);
    Some(format!("{what}, divided by σ: {}; 1 is only noise. {end}", all.join(", ")))
}

/// One possible cause in words, with its cure.
struct Cause {
    suspect: Suspect,
    now: String,
    here: String,
    all: String,
    cure: Cure,
    /// Shift of the altitudes of all frames.
    shift_km: Option<f64>,
    /// Reason why the value cannot be used.
    impossible: Option<String>,
}

impl Cause {
    fn new(suspect: Suspect, fit: &FitFacts, all: Option<&Consensus>, config: &Config, body: usize) -> Option<Self> {
        let here = fit.implied(suspect);
        let bodies = config.each_body();
        let of_body = bodies.get(body).or(bodies.first())?;
        // A frame may say nothing about a quantity that all frames together decide.
        let value = all.map(|c| c.value).or(here.map(|here| here.value))?;
        let in_words = |words: &dyn Fn(Implied) -> String| here.map_or_else(|| "–".to_owned(), words);
        let camera = &config.camera;
        let mut cause = Self {
            suspect,
            now: String::new(),
            here: String::new(),
            all: String::new(),
            cure: Vec::new(),
            shift_km: None,
            impossible: None,
        };
        match suspect {
            Suspect::Altitude => {
                let given = fit.given_altitude_km?;
                cause.now = format!("{given:.1} km");
                cause.here = in_words(&|here| format!("{:.1} ± {:.1} km", given + here.value, here.sigma));
                // The frames have different altitudes, so only the shift is common to them.
                cause.all = all.map(|c| format!("Δ {:+.1} ± {:.1} km", c.value, c.scatter)).unwrap_or_default();
                cause.cure = vec![("body", "altitude_km", of_body.altitude_km.unwrap_or(given) + value)];
                cause.shift_km = Some(value);
                cause.impossible = (given + value <= 0.0).then(|| "This altitude is below the ground".into());
            }
            Suspect::Focal => {
                cause.now = format!("fx {:.1} px", camera.fx_px);
                let words =
                    |factor: f64, by: f64| format!("{:.1} ± {:.1} px", camera.fx_px * factor, camera.fx_px * by);
                cause.here = in_words(&|here| words(here.value, here.sigma));
                cause.all = all.map(|c| words(c.value, c.scatter)).unwrap_or_default();
                cause.cure = vec![("camera", "fx_px", camera.fx_px * value), ("camera", "fy_px", camera.fy_px * value)];
            }
            Suspect::LimbHeight => {
                cause.now = format!("{:.1} km", of_body.limb_height_km);
                cause.here = in_words(&|here| format!("{:.1} ± {:.1} km", here.value, here.sigma));
                cause.all = all.map(|c| format!("{:.1} ± {:.1} km", c.value, c.scatter)).unwrap_or_default();
                cause.cure = vec![("body", "limb_height_km", value)];
                cause.impossible = all.is_some_and(|c| !is_plausible(c, config, body)).then(|| {
                    "The limb of the Earth lies between the ground and 65 km, so another value is wrong".into()
                });
                if !(-50.0..=500.0).contains(&value) {
                    cause.impossible = Some("No limb is this high: sensor.toml allows −50 to 500 km".into());
                }
            }
        }
        if cause.impossible.is_none() && cause.is_now(config, of_body.limb_height_km) {
            cause.impossible = Some("This is the value now".into());
        }
        Some(cause)
    }

    /// Returns whether the values of the cure are those of now, to as many digits as the table shows.
    fn is_now(&self, config: &Config, limb_height_km: f64) -> bool {
        self.cure.iter().all(|(_, name, x)| {
            let now = match *name {
                "fx_px" => config.camera.fx_px,
                "fy_px" => config.camera.fy_px,
                "limb_height_km" => limb_height_km,
                _ => return false,
            };
            (now - x).abs() < 0.05
        })
    }
}
