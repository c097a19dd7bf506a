//! The diagnosis: why a picture has no answer, in numbers, and a button for each cure.

use std::sync::Arc;

use egui::{RichText, Ui, vec2};
use hzn_core::Config;
use hzn_core::body::Kind;
use hzn_core::status::Status;

use super::steps::{self, Step};
use super::viewer::Viewer;
use super::{altitude_trial, links, theme};
use crate::model::Session;
use crate::model::cause::Reason;
use crate::model::diagnosis::{self, Consensus, FitFacts, Implied, Pair, Suspect};
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
    // In the other frames the values of now are right.
    let is_other_edge = is_as_expected && conspicuous(answer.fit.map(|f| f.sigmas));
    let of_size = answer.fit.filter(|_| differs && !is_other_edge).and_then(|fit| OfSize::new(viewer, fit));
    let otsu = answer.otsu.filter(|_| refused);
    let wrong_level = otsu.is_some_and(|o| o.is_better());
    // General advice follows from the edges, and those of a wrong threshold are not the limb.
    let tips = answer.report.as_ref().map(hzn_run::explain::tips).unwrap_or_default();
    let tips: Vec<String> = tips.into_iter().map(Into::into).filter(|_| !wrong_level).collect();
    let steps = steps_of(viewer, &answer, of_size.as_ref(), if differs { &[] } else { &tips });
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
        if differs && !tips.is_empty() {
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
        if answer.row.status == Status::NoAltitude {
            wrapped(ui, NOT_PROCESSED);
        }
    }
}

/// Returns what to do. The threshold comes first, because the limb is not seen without it, then the size of the limb,
/// then other edges, and general advice last.
fn steps_of(viewer: &Viewer, answer: &BodyResult, of_size: Option<&OfSize>, tips: &[String]) -> Vec<Step> {
    let mut steps = Vec::new();
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

fn wrapped(ui: &mut Ui, text: &str) {
    ui.add(egui::Label::new(RichText::new(text).size(12.5)).wrap());
}

/// What the half-angles say about altitude, focal length and limb height.
struct OfSize {
    fit: FitFacts,
    config: Arc<Config>,
    /// What all pictures say, without and with values that no limb has.
    plausible: Vec<Consensus>,
    impossible: Vec<Consensus>,
    pair: Option<Pair>,
    agreement: Option<Agreement>,
}

impl OfSize {
    fn new(viewer: &Viewer, fit: FitFacts) -> Option<Self> {
        let body = viewer.body;
        let facts = || viewer.rows.fits(body);
        let config = Arc::clone(viewer.session.as_ref()?.config()?);
        let all = diagnosis::summarise(facts());
        let (plausible, impossible): (Vec<_>, Vec<_>) = all.into_iter().partition(|c| is_plausible(c, &config, body));
        let of_body = config.each_body().get(body).or(config.each_body().first())?;
        let limb_km = [of_body.limb_height_km, of_body.limb_height_sigma_km];
        let shift_km = viewer.sequence.has_altitudes().then_some(viewer.sequence.altitude_shift_km);
        let correlation = |two| diagnosis::correlation(facts(), limb_km[0], two);
        let agreement = Agreement::new(&plausible, &impossible, shift_km, &correlation);
        let pair = diagnosis::find_pair(facts(), limb_km);
        Some(Self { fit, config, plausible, impossible, pair, agreement })
    }

    /// Returns what to do about the size of the limb.
    fn step(&self) -> Step {
        let Some(pair) = self.pair else {
            let best = self.agreement.as_ref().map(|agreement| agreement.step.clone());
            return Step::Say(best.unwrap_or_else(|| {
                "Correct the value that you know least. The table says what each would have to be.".into()
            }));
        };
        let words = format!("Two values are wrong: {}.", diagnosis::two_values(&pair, self.config.camera.fx_px));
        if pair.is_told_apart() { Step::Both(words, pair) } else { Step::Say(words) }
    }

    /// Draws the fitted and the expected half-angle, and what each possible cause would have to be.
    fn show(&self, viewer: &mut Viewer, ui: &mut Ui) {
        let fit = &self.fit;
        let how = if fit.is_trial {
            "The limb in this picture has the half-angle"
        } else {
            "The best edge has the half-angle"
        };
        let by_deg = fit.fitted_deg - fit.expected_deg;
        let [fitted, expected] = [fit.fitted_deg, fit.expected_deg];
        let half_angles = format!("{fitted:.3}°, expected is {expected:.3}°: {by_deg:+.3}°, {:+.1} σ", fit.sigmas);
        let body = viewer.body;
        let row_of = |suspect: Suspect| {
            let all = self.plausible.iter().chain(&self.impossible).find(|c| c.suspect == suspect);
            Some((suspect, Cause::new(suspect, fit, all, &self.config, body)?))
        };
        let causes: Vec<_> = in_order(&self.plausible, &self.impossible).into_iter().filter_map(row_of).collect();
        if causes.is_empty() {
            return wrapped(ui, &format!("{how} {half_angles}. No single value within its limits makes them equal."));
        }
        wrapped(ui, &format!("{how} {half_angles}. These values would make them equal:"));
        let (mut chosen, mut shift_km) = (None, None);
        egui::Grid::new("causes").num_columns(5).spacing(vec2(8.0, 3.0)).show(ui, |ui| {
            for head in ["", "now", "this picture", "all pictures", ""] {
                ui.weak(RichText::new(head).size(11.5));
            }
            ui.end_row();
            for (suspect, cause) in causes {
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
        // Two wrong values make each single one scatter, so that the scatter says nothing.
        if let Some(agreement) = self.agreement.as_ref().filter(|_| self.pair.is_none()) {
            wrapped(ui, &agreement.words);
        }
        if let Some(by_km) = shift_km {
            return altitude_trial::shift(viewer, by_km);
        }
        if let (Some(cure), Some(session)) = (chosen, &mut viewer.session) {
            let values: Vec<_> = cure.iter().map(|(s, n, x)| (*s, *n, Some(Session::tidy_value(*x)))).collect();
            session.set_all(&values, body);
        }
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

/// Which of the plausible causes agrees with all pictures.
struct Agreement {
    /// The reason in words.
    words: String,
    /// What to do.
    step: String,
}

impl Agreement {
    /// Compares the causes. `shift_km` is the shift that is on trial, if the frames have altitudes of their own, and
    /// `correlation` that of two causes.
    fn new(
        plausible: &[Consensus],
        impossible: &[Consensus],
        shift_km: Option<f64>,
        correlation: &dyn Fn([Suspect; 2]) -> Option<f64>,
    ) -> Option<Self> {
        let (best, others) = plausible.split_first()?;
        if best.pictures < ENOUGH || others.len() + impossible.len() == 0 {
            return None;
        }
        let words = |c: &Consensus| format!("{} {:.1}", c.suspect.name(), c.disagreement);
        let none = |c: &Consensus| format!("{} impossible ({:.0} km)", c.suspect.name(), c.value);
        let all: Vec<String> = plausible.iter().map(words).chain(impossible.iter().map(none)).collect();
        let what =
            format!("The true cause has the same value in every picture. Scatter over {} pictures", best.pictures);
        let what = format!("{what}, divided by σ: {}; 1 is only noise.", all.join(", "));
        // A wrong cause scatters more. Below 1 the scatter is the noise of the edges, and says nothing.
        let scatters = |c: &Consensus| c.disagreement > 2.0 * best.disagreement.max(1.0);
        if others.iter().all(scatters) {
            let name = best.suspect.name();
            let wrong_km = shift_km.filter(|_| best.suspect == Suspect::Altitude).map(|shift| best.value + shift);
            let where_to = wrong_km.map(|km| {
                let side = if km < 0.0 { "high" } else { "low" };
                format!(" The given altitudes are {:.1} km too {side}; correct them where they come from.", km.abs())
            });
            let words = format!("{what} So the {name} is the likely cause.{}", where_to.unwrap_or_default());
            return Some(Self { words, step: format!("Correct the {name}: its row of the table has the button.") });
        }
        let open: Vec<Suspect> = plausible.iter().filter(|c| !scatters(c)).map(|c| c.suspect).collect();
        let names = open.iter().map(|suspect| suspect.name()).collect::<Vec<_>>().join(", ");
        let pairs = open.iter().enumerate().flat_map(|(i, a)| open.iter().skip(i + 1).map(move |b| [*a, *b]));
        let alike = |two| {
            let r = correlation(two).filter(|r| r.abs() > diagnosis::MOST_CORRELATION)?;
            Some(format!("In these pictures {}.", diagnosis::inseparable(two, r)))
        };
        let alike: Vec<String> = pairs.filter_map(alike).collect();
        let end = if alike.is_empty() {
            "Each explains the pictures nearly as well. Pictures from other altitudes, or with the limb at other \
             places, decide."
                .to_owned()
        } else {
            alike.join(" ")
        };
        let words = format!("{what} So the cause is one of these: {names}. {end}");
        Some(Self { words, step: format!("Check these, and correct the one that is wrong: {names}.") })
    }
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
