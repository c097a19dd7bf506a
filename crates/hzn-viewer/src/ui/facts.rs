//! Short lines about the work of each stage.

use hzn_core::status::{Stage, Status};
use hzn_core::{Config, Report, Solution, body};
use hzn_run::advice::{self, Subject};

use crate::work::frame_view::{BodyResult, FrameView, Outcome};

/// A card in the column of stages: its title, its stage, and the sections of sensor.toml that belong to it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Card {
    pub(super) title: &'static str,
    pub(super) stage: Option<Stage>,
    pub(super) sections: &'static [&'static str],
    pub(super) open: bool,
}

const fn card(title: &'static str, stage: Option<Stage>, sections: &'static [&'static str], open: bool) -> Card {
    Card { title, stage, sections, open }
}

/// All cards, in the order in which a picture is processed.
pub(super) const CARDS: &[Card] = &[
    card("Picture", None, &["input", "brightness"], false),
    card("Body", None, &["body"], false),
    card("Threshold", Some(Stage::Threshold), &["threshold"], true),
    card("Mask", None, &["mask"], false),
    card("Contour", Some(Stage::Contour), &["contour"], false),
    card("Edge points", Some(Stage::EdgePoints), &["edge_points"], true),
    card("Rays", Some(Stage::Rays), &["camera"], false),
    card("Consensus", Some(Stage::Consensus), &["consensus"], true),
    card("Fit", Some(Stage::Fit), &["fit"], false),
    card("Covariance", Some(Stage::Covariance), &["covariance"], false),
    card("Gates", Some(Stage::Gates), &["gates"], false),
    card("Further looks", None, &["retry"], false),
    card("Work budget", None, &["limits"], false),
];

/// Returns lines about the input of a stage, its output, and the points that it dropped.
pub(super) fn lines(card: &Card, frame_view: &FrameView, outcome: &Outcome, answer: &BodyResult) -> Vec<String> {
    let Ok(report) = &answer.report else { return Vec::new() };
    let (c, config) = (report.counters, &outcome.config);
    let reached = |stage| report.stage >= stage;
    match card.title {
        "Picture" => picture(frame_view, config),
        "Body" => expected(answer),
        "Threshold" => threshold(answer, config),
        "Mask" => vec![match config.mask.polygons_px.len() {
            0 => "nothing is masked".into(),
            1 => "1 area is masked".into(),
            n => format!("{n} areas are masked"),
        }],
        "Contour" if reached(Stage::Contour) => contour(report, outcome),
        "Further looks" if c.looks > 1 => vec![format!("{} looks, each with another threshold", c.looks)],
        "Work budget" => vec![format!("{} steps of work", c.work)],
        "Edge points" if reached(Stage::Contour) => edge_points(report, config),
        "Rays" if reached(Stage::Rays) => {
            let temperature_c = frame_view.data.as_ref().and_then(|data| data.camera_temperature_c);
            let points = format!("{} points became rays", c.edge_points);
            core::iter::once(points).chain(lens(&config.camera, temperature_c)).collect()
        }
        "Consensus" if reached(Stage::Consensus) => consensus(report, answer),
        "Fit" => answer.solution().map_or_else(Vec::new, |s| fit(s, answer)),
        "Covariance" => answer.solution().map_or_else(Vec::new, |s| covariance(s, answer)),
        "Gates" => gates(report, answer, config),
        _ => Vec::new(),
    }
}

fn picture(frame_view: &FrameView, config: &Config) -> Vec<String> {
    let Ok(picture) = &frame_view.picture else { return Vec::new() };
    let l = picture.layout;
    let form = match l.channels {
        1 => "grey".to_owned(),
        n => format!("{n} channels"),
    };
    let mut out = vec![format!("{} × {} px, {form}, {} bits", l.width, l.height, l.bits)];
    if l.channels >= 3 {
        out.push(format!("brightness: {}", format!("{:?}", config.input.channel).to_lowercase()));
    }
    if let Some(time) = frame_view.decoding {
        out.push(format!("decoded in {:.1} ms", time.as_secs_f64() * 1e3));
    }
    out
}

fn expected(answer: &BodyResult) -> Vec<String> {
    let mut out = vec![answer.kind.name().to_owned()];
    if let (Some(rad), false) = (answer.expected_rad, matches!(answer.kind, body::Kind::Sun | body::Kind::Moon)) {
        out.push(format!("half-angle {:.4}° expected", rad.to_degrees()));
    }
    out.extend(answer.row.altitude_km.map(|km| format!("altitude {km:.2} km")));
    out
}

fn threshold(answer: &BodyResult, config: &Config) -> Vec<String> {
    let Ok(report) = &answer.report else { return Vec::new() };
    match (report.status, answer.sample) {
        (Status::TooDark | Status::TooBright, _) => vec![format!(
            "mean brightness is outside of {} to {} of full scale",
            config.brightness.min_mean, config.brightness.max_mean
        )],
        (_, Some((mean, n))) => {
            vec![format!("threshold {} counts, mean {mean:.1} counts in a sample of {n} pixels", report.level)]
        }
        _ => vec![format!("threshold {} counts", report.level)],
    }
}

fn contour(report: &Report<f64>, outcome: &Outcome) -> Vec<String> {
    let (c, config) = (report.counters, &outcome.config);
    let mut out = vec![format!("{} border pixels followed", c.followed)];
    if let Some(n) = outcome.touched_pixels {
        let all = f64::from(config.camera.width) * f64::from(config.camera.height);
        out.push(format!("{n} pixels read, {:.2} % of the picture", 100.0 * n as f64 / all));
    }
    if c.dropped > 0 {
        out.push(format!("{} dropped: a list was full", c.dropped));
    }
    out
}

fn edge_points(report: &Report<f64>, config: &Config) -> Vec<String> {
    let c = report.counters;
    let edges = if c.candidates == 1 { "edge" } else { "edges" };
    let mut out = vec![format!("{} {edges} of {} px or more", c.candidates, config.edge_points.min_points)];
    if c.fallback_points > 0 {
        out.push(format!("{} points were located at the global threshold", c.fallback_points));
    }
    out
}

/// Says which lens a picture has, if the lens changes with the temperature.
fn lens(camera: &hzn_core::camera::Config, temperature_c: Option<f64>) -> Option<String> {
    camera.temperature?;
    let Some(at_c) = temperature_c else { return Some("temperature unknown: the lens of the reference".to_owned()) };
    Some(format!("lens at {at_c} °C: fx {:.3} px", camera.at_temperature(at_c).fx_px))
}

fn consensus(report: &Report<f64>, answer: &BodyResult) -> Vec<String> {
    let mut out = vec![format!("{} draws", report.counters.draws)];
    if let Some(edge) = answer.chosen() {
        let kept = edge.weights.iter().filter(|w| **w > 0.0).count();
        out.push(format!("{kept} inliers of {} edge points, {} outliers", edge.points.len(), edge.points.len() - kept));
    }
    out
}

fn fit(s: &Solution<f64>, answer: &BodyResult) -> Vec<String> {
    let mut out = vec![
        format!("half-angle {:.4}° fitted freely", s.half_angle_rad.to_degrees()),
        format!(
            "{:.4}° fused, {:.4}° expected",
            s.fused_half_angle_rad.to_degrees(),
            answer.expected_rad.unwrap_or(f64::NAN).to_degrees()
        ),
        format!("RMS {:.3} px over {:.0} px of edge", s.rms_px, s.arc_px),
    ];
    out.extend(s.altitude_m.map(|(h, sigma)| format!("altitude {:.1} ± {:.1} km", h / 1e3, sigma / 1e3)));
    out
}

fn covariance(s: &Solution<f64>, answer: &BodyResult) -> Vec<String> {
    let ([major, minor], angle) = hzn_run::explain::principal_sigmas(s);
    let mut out = vec![format!(
        "σ {:.4}° at {:.0}° from image x, {:.4}° perpendicular to it",
        major.to_degrees(),
        angle.to_degrees(),
        minor.to_degrees()
    )];
    let terms = answer.chosen().map_or(&[][..], |edge| edge.budget_rad.as_slice());
    let text = |term, rad: f64| format!("• {:.4}° from {}", rad.to_degrees(), hzn_run::explain::term_text(term));
    out.extend(terms.iter().filter(|(_, rad)| *rad > 0.0).map(|(term, rad)| text(*term, *rad)));
    out
}

/// Returns advice for a picture without an answer, about this body.
pub(super) fn tips(answer: &BodyResult, config: &Config) -> Vec<String> {
    let body = config.each_body().iter().find(|body| body.kind == answer.kind);
    let (Ok(report), Some(body)) = (&answer.report, body) else { return Vec::new() };
    advice::tips(report, Subject::new(body, answer.expected_rad)).into_iter().map(Into::into).collect()
}

fn gates(report: &Report<f64>, answer: &BodyResult, config: &Config) -> Vec<String> {
    match report.status {
        Status::Ok => vec!["passed every gate".into()],
        status => {
            let mut out = vec![format!("{status} at {}", report.stage.name())];
            out.extend(tips(answer, config).into_iter().map(|tip| format!("• {tip}")));
            out
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lens_that_follows_the_temperature_is_told() {
        use hzn_core::camera::{Config, Model, Temperature};
        let mut camera = Config::ideal(Model::Pinhole, 640, 480, 500.0);
        assert_eq!(lens(&camera, Some(0.0)), None);
        camera.temperature = Some(Temperature { reference_c: 20.0, focal_ppm_per_k: 100.0, ..Temperature::default() });
        assert_eq!(lens(&camera, Some(0.0)).as_deref(), Some("lens at 0 °C: fx 499.000 px"));
        assert!(lens(&camera, None).is_some_and(|text| text.contains("reference")));
    }

    #[test]
    fn every_section_has_a_card_and_every_stage() {
        for key in hzn_files::keys::all() {
            // The viewer searches each picture by itself, so that `[track]` changes nothing that it shows.
            let elsewhere = ["", "mount", "bodies", "track"];
            let shown = CARDS.iter().any(|c| c.sections.contains(&key.section()));
            assert!(shown || elsewhere.contains(&key.section()), "{}", key.path);
        }
        for stage in Stage::ALL {
            assert!(CARDS.iter().any(|c| c.stage == Some(stage)), "{}", stage.name());
        }
    }
}
