//! The table of what would make the fitted half-angle the expected one.

use std::sync::Arc;

use egui::{RichText, Ui, vec2};
use hzn_core::Config;

use super::agreement::Agreement;
use super::altitude_trial;
use super::size_cause::{Cause, Cure, guessed_lens, is_plausible};
use super::steps::{Step, wrapped};
use super::viewer::Viewer;
use crate::model::Session;
use crate::model::diagnosis::{self, Consensus, FitFacts, Pair, Suspect};

/// What the half-angles say about altitude, focal length and limb height.
pub(super) struct OfSize {
    /// What the fit of the shown picture says, or else the medians of all pictures.
    fit: FitFacts,
    /// The shown picture itself has a fit.
    is_here: bool,
    config: Arc<Config>,
    /// What all pictures say, without and with values that no limb has.
    plausible: Vec<Consensus>,
    impossible: Vec<Consensus>,
    pair: Option<Pair>,
    agreement: Option<Agreement>,
}

impl OfSize {
    /// Collects what the pictures say. A picture without a fit gets what the others say.
    pub(super) fn new(viewer: &Viewer, here: Option<FitFacts>) -> Option<Self> {
        let body = viewer.body;
        let facts = || viewer.rows.fits(body);
        let median = || diagnosis::median_fit(&facts().copied().collect::<Vec<_>>());
        let fit = here.or_else(median)?;
        let config = Arc::clone(viewer.session.as_ref()?.config()?);
        let all = diagnosis::summarise(facts());
        let (plausible, impossible): (Vec<_>, Vec<_>) = all.into_iter().partition(|c| is_plausible(c, &config, body));
        let of_body = config.each_body().get(body).or(config.each_body().first())?;
        let limb_km = [of_body.limb_height_km, of_body.limb_height_sigma_km];
        let shift_km = viewer.sequence.has_altitudes().then_some(viewer.sequence.altitude_shift_km);
        let correlation = |two| diagnosis::correlation(facts(), limb_km[0], two);
        let agreement = Agreement::new(&plausible, &impossible, shift_km, &correlation);
        let pair = diagnosis::find_pair(facts(), limb_km);
        Some(Self { fit, is_here: here.is_some(), config, plausible, impossible, pair, agreement })
    }

    /// Returns the 1-sigma of the focal length as a part of it, if it is a guess and the pictures do not decide for
    /// another value.
    fn doubted_lens(&self) -> Option<f64> {
        let excludes = |a: &Agreement| !a.open.contains(&Suspect::Focal) || a.open.len() == 1;
        guessed_lens(&self.config).filter(|_| !self.agreement.as_ref().is_some_and(excludes))
    }

    /// Returns what to do about the size of the limb.
    pub(super) fn step(&self) -> Step {
        let Some(pair) = self.pair else {
            let doubted = self.doubted_lens().map(|part| {
                let percent = 100.0 * part;
                format!(
                    "Correct the focal length first: it is a guess with a sigma of {percent:.1} %. The table says \
                     what it would have to be."
                )
            });
            let best = || self.agreement.as_ref().map(|agreement| agreement.step.clone());
            return Step::Say(doubted.or_else(best).unwrap_or_else(|| {
                "Correct the value that you know least. The table says what each would have to be.".into()
            }));
        };
        let words = format!("Two values are wrong: {}.", diagnosis::two_values(&pair, self.config.camera.fx_px));
        if pair.is_told_apart() { Step::Both(words, pair) } else { Step::Say(words) }
    }

    /// Returns all quantities: the plausible ones, those that explain all pictures best first, and then the others. A
    /// focal length that is only a guess comes before an altitude that was given, unless the pictures decide.
    fn in_order(&self) -> Vec<Suspect> {
        let known: Vec<Suspect> = self.plausible.iter().chain(&self.impossible).map(|c| c.suspect).collect();
        let rest = Suspect::ALL.into_iter().filter(|s| !known.contains(s));
        let mut all: Vec<Suspect> = known.iter().copied().chain(rest).collect();
        if self.doubted_lens().is_some() {
            all.sort_by_key(|suspect| *suspect != Suspect::Focal);
        }
        all
    }

    /// Draws the fitted and the expected half-angle, and what each possible cause would have to be.
    pub(super) fn show(&self, viewer: &mut Viewer, ui: &mut Ui) {
        let fit = &self.fit;
        let how = if !self.is_here {
            "No edge of this picture fits a limb. In the other ones the limb has the half-angle"
        } else if fit.is_trial {
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
            Some((suspect, Cause::new(suspect, fit, self.is_here, all, &self.config, body)?))
        };
        let causes: Vec<_> = self.in_order().into_iter().filter_map(row_of).collect();
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
