//! The sigma of each answer, divided among its sources of error.

use egui::{Color32, Ui};
use egui_plot::{FilledArea, PlotUi};
use hzn_core::error_budget::Term;
use hzn_run::explain::term_text;

use super::axis::robust_range;
use super::frame::heading;
use super::over_time::{Pointed, TimeAxis, frame_plot};
use crate::model::sigma_parts::{SigmaParts, largest_terms};
use crate::ui::viewer::Viewer;

/// Name of the plot.
pub(in crate::ui) const SIGMA_PARTS: &str = "σ budget";

/// The least share of an answer that a source needs for a band of its own. A narrower band is not seen in a low plot.
const LEAST_SHARE: f64 = 0.03;
/// The colours of the bands; all further sources share the last one. They are those of Okabe and Ito, which
/// colour-blind people can distinguish.
const COLOURS: [Color32; 7] = [
    Color32::from_rgb(0, 114, 178),
    Color32::from_rgb(230, 159, 0),
    Color32::from_rgb(0, 158, 115),
    Color32::from_rgb(204, 121, 167),
    Color32::from_rgb(86, 180, 233),
    Color32::from_rgb(213, 94, 0),
    Color32::from_rgb(140, 140, 140),
];

/// A band of the plot.
struct Band {
    name: &'static str,
    colour: Color32,
    terms: Vec<Term>,
}

/// Returns the bands from the bottom to the top, the largest source first.
fn bands(all: &[Option<SigmaParts>]) -> Vec<Band> {
    let named = largest_terms(all.iter().flatten(), LEAST_SHARE);
    let last = COLOURS.len() - 1;
    let own = named.iter().take(last).zip(COLOURS);
    let mut bands: Vec<Band> =
        own.map(|(term, colour)| Band { name: term_text(*term), colour, terms: vec![*term] }).collect();
    let is_other = |term: &Term| !named.iter().take(last).any(|own| own == term);
    let terms: Vec<Term> = Term::ALL.into_iter().filter(is_other).collect();
    if terms.iter().any(|term| all.iter().flatten().any(|parts| parts.of(*term) > 0.0)) {
        bands.push(Band { name: "others", colour: COLOURS[last], terms });
    }
    bands
}

/// Returns the parts of all pictures.
pub(super) fn parts(viewer: &Viewer) -> Vec<Option<SigmaParts>> {
    (0..viewer.sequence.len()).map(|i| viewer.rows.sigma_parts(i, viewer.body)).collect()
}

/// Returns the names of the bands, and the height of each band for each picture.
pub(super) fn heights(all: &[Option<SigmaParts>]) -> Vec<(&'static str, Vec<Option<f64>>)> {
    let height = |band: &Band, parts: &SigmaParts| band.terms.iter().map(|term| parts.of(*term)).sum();
    let of = |band: Band| (band.name, all.iter().map(|parts| Some(height(&band, parts.as_ref()?))).collect());
    bands(all).into_iter().map(of).collect()
}

/// Plots the parts of all pictures on top of each other; returns the picture under the pointer.
pub(super) fn show(viewer: &Viewer, ui: &mut Ui, axis: &TimeAxis, height: f32) -> Pointed {
    let all = parts(viewer);
    let title = format!("{SIGMA_PARTS} [°]");
    let tops = || all.iter().flatten().map(SigmaParts::sum_deg);
    let Some([_, high]) = robust_range(tops()) else {
        heading(ui, &title, &[], "");
        ui.weak("No picture has an answer yet, so there is nothing to plot.");
        return None;
    };
    let values_of = |i: usize| all.get(i).copied().flatten().map_or(String::new(), |parts| parts.text());
    let at = viewer.hovered_frame.unwrap_or(viewer.playback.frame());
    let bands = bands(&all);
    let legend: Vec<(&str, Color32)> = bands.iter().map(|band| (band.name, band.colour)).collect();
    heading(ui, &title, &legend, &values_of(at));
    frame_plot(viewer, ui, SIGMA_PARTS, axis, [0.0, high], false, height, &values_of, |ui, _| {
        let mut below = vec![0.0; all.len()];
        for band in &bands {
            let above: Vec<f64> = below
                .iter()
                .zip(&all)
                .map(|(low, parts)| parts.map_or(*low, |p| low + band.terms.iter().map(|t| p.of(*t)).sum::<f64>()))
                .collect();
            fill(ui, band, axis, &all, [&below, &above], high);
            below = above;
        }
    })
}

/// Fills a band, which is interrupted where a picture has no answer.
fn fill(
    ui: &mut PlotUi<'_>,
    band: &Band,
    axis: &TimeAxis,
    all: &[Option<SigmaParts>],
    [low, high]: [&[f64]; 2],
    most: f64,
) {
    let [first, last] = axis.ends();
    // A single answer is as wide as a mark.
    let half = 0.004 * (last - first);
    let mut from = 0;
    while from < all.len() {
        let to = all.iter().skip(from).position(Option::is_none).map_or(all.len(), |n| from + n);
        let (mut xs, mut lows, mut highs) = (Vec::new(), Vec::new(), Vec::new());
        for i in from..to {
            let (Some(x), Some(a), Some(b)) = (axis.place(i), low.get(i), high.get(i)) else { continue };
            let places = if to - from == 1 { vec![x - half, x + half] } else { vec![x] };
            for x in places {
                xs.push(x);
                lows.push(a.min(most));
                highs.push(b.min(most));
            }
        }
        if xs.len() > 1 {
            ui.add(FilledArea::new(band.name, &xs, &lows, &highs).fill_color(band.colour).allow_hover(false));
        }
        from = to + 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parts(sigma_deg: f64, budget: &[(Term, f64)]) -> Option<SigmaParts> {
        SigmaParts::new(sigma_deg, budget)
    }

    #[test]
    fn the_bands_of_each_picture_end_at_its_sigma() {
        let many: Vec<(Term, f64)> = Term::ALL.iter().map(|term| (*term, 1e-4)).collect();
        let all = [
            parts(0.02, &[(Term::EdgeNoise, 1e-4), (Term::LimbHeight, 3e-4)]),
            None,
            parts(0.05, &many),
            parts(0.01, &[(Term::Altitude, 1e-4), (Term::Lens, 1e-6)]),
        ];
        let heights = heights(&all);
        assert_eq!(heights.len(), COLOURS.len(), "all sources beyond the sixth are one band");
        assert_eq!(heights.last().unwrap().0, "others");
        for (i, parts) in all.iter().enumerate() {
            let sum: Option<f64> = heights.iter().map(|(_, of)| of[i]).sum();
            assert_eq!(sum.is_some(), parts.is_some());
            let top = parts.map_or(0.0, |p| p.sum_deg());
            assert!((sum.unwrap_or(0.0) - top).abs() < 1e-9, "{i}: {sum:?} {top}");
        }
    }

    #[test]
    fn sources_without_an_error_have_no_band() {
        let all = [parts(0.02, &[(Term::EdgeNoise, 3e-4), (Term::LimbHeight, 1e-4), (Term::Lens, 0.0)])];
        let names: Vec<&str> = heights(&all).iter().map(|(name, _)| *name).collect();
        assert_eq!(names, ["edge noise", "the limb height"]);
    }
}
