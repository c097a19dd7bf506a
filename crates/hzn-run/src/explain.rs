//! Explains in words and numbers what happened to a picture.

use hzn_core::body::{self, Kind};
use hzn_core::covariance::Term;
use hzn_core::report::Candidate;
use hzn_core::section::{self, Section};
use hzn_core::status::Status;
use hzn_core::verdict::Verdict;
use hzn_core::{Report, Solution, evidence, gates};

use crate::engine::Trace;

/// Returns the meaning of a verdict on an edge of a body of this kind, with the limit that was not met.
pub fn verdict_text(verdict: Verdict, s: &gates::Config, kind: Kind) -> String {
    match verdict {
        Verdict::Chosen => "the answer".into(),
        Verdict::Passed => "passed every gate, but another fits better".into(),
        Verdict::NoConsensus => "too few edge points agree on one limb".into(),
        Verdict::FewInliers => format!("fewer than {} inliers (gates.min_inliers)", s.min_inliers),
        Verdict::ShortArc => short_arc_text(s.min_arc_px),
        Verdict::Residuals => residuals_text(s.max_rms_px),
        Verdict::HalfAngle if is_free(kind) => format!("the {} never has a disc of this size", kind.name()),
        Verdict::HalfAngle => format!(
            "half-angle more than {} sigma from the expected one (gates.max_half_angle_sigma)",
            s.max_half_angle_sigma
        ),
        Verdict::Uncertain => format!("sigma above {} deg (gates.max_sigma_deg)", s.max_sigma_deg),
        Verdict::NoFit => "the fit did not converge".into(),
        Verdict::Indistinct => {
            "the edge is clutter: many of its points lie close to the fitted limb but not on it, or \
                                a part of it follows the limb by chance"
                .into()
        }
        Verdict::NoSky => "the region beyond the fitted limb is not sky (gates.max_lit_sky)".into(),
        Verdict::Taken => "this limb was already assigned to another body".into(),
        Verdict::OutOfView => {
            "the expected limb around the fitted axis is outside the picture (gates.limb_in_view)".into()
        }
        Verdict::Straight => {
            "a straight line fits the edge nearly as well (gates.min_evidence), or its curvature is too uncertain to \
             say on which side the body is"
                .into()
        }
        Verdict::Radius => "no allowed altitude gives a limb of this half-angle (gates.altitude_limits_km)".into(),
        Verdict::Unsupported => "the picture shows no edge along a part of the fitted limb".into(),
        Verdict::Circle => format!(
            "a circle in the picture fits more than {} times better than the limb: it is a lens flare \
             (gates.max_rival_ratio)",
            s.max_rival_ratio
        ),
        Verdict::Polyline => format!(
            "straight lines fit more than {} times better than the limb: it is an iris or a part of the vehicle \
             (gates.max_rival_ratio)",
            s.max_rival_ratio
        ),
        Verdict::Departure => "the edge leaves the fitted limb smoothly (gates.max_departure)".into(),
        Verdict::Band => "behind the edge there is a narrow band, and then the sky again (gates.max_band)".into(),
        Verdict::Night => "it is night at this time and position (gates.max_unlit, body.sunlit)".into(),
        Verdict::Layer => {
            "at night, the light below the edge does not become less, or none is left: it is no layer of airglow".into()
        }
        Verdict::Faint => "the light fades slowly across the edge, as in twilight or high above a limb".into(),
        Verdict::Unlikely => format!("its probability to be the limb is below {} (gates.min_p_limb)", s.min_p_limb),
        Verdict::Glow => glow_text(kind),
        Verdict::Attitude => format!(
            "the axis is more than {} sigma from the given attitude (gates.max_attitude_sigma)",
            s.max_attitude_sigma
        ),
        Verdict::Sun => "the given Sun does not light this limb (gates.max_unlit): check its sign and frame".into(),
        Verdict::Fixed => "suspect: fixed in the picture, while the vehicle turns (gates.fixed_edge)".into(),
        Verdict::Rate => "the axis is farther from the last answer than it can turn (gates.max_rate_deg_s)".into(),
    }
}

/// Returns whether the half-angle of a body is free, as that of Sun and Moon is.
pub(crate) fn is_free(kind: Kind) -> bool {
    body::Config { kind, ..body::Config::default() }.half_angle_is_free()
}

fn glow_text(kind: Kind) -> String {
    let glare = "an overexposed body, haze on the lens, or stray light";
    let cause = match kind {
        Kind::Earth | Kind::EarthSphere => format!("at night it is airglow or aurora, by day {glare}"),
        _ => glare.to_owned(),
    };
    format!("light reaches high above the edge (gates.max_glow): {cause}")
}

fn residuals_text(max_rms_px: f64) -> String {
    format!(
        "rms above {max_rms_px} px (gates.max_rms_px), or, without a known distance, above the noise of the edge: any \
         smooth curve is near some cone"
    )
}

/// Says what the limb of an answer is in the plane of a pinhole, and whether its axis is in view there.
pub fn section_text(solution: &Solution<f64>, is_axis_shown: bool) -> String {
    let curve = match Section::new(&solution.axis, solution.fused_half_angle_rad.cos()) {
        // Nearly a parabola: its principal frame lies far away, and lengths say nothing.
        Some(section) if section.semi_axes().iter().any(|a| !(*a < 1e3)) => "nearly a parabola".to_owned(),
        Some(section) => {
            let [along, across] = section.semi_axes();
            let name = if section.kind() == section::Kind::Ellipse { "an ellipse" } else { "a hyperbola" };
            format!("{name} with the semi-axes {along:.4} and {across:.4} focal lengths")
        }
        None => "not in front of the camera".to_owned(),
    };
    let off_deg = solution.axis.xyz()[2].clamp(-1.0, 1.0).acos().to_degrees();
    let axis = if is_axis_shown { "the cross" } else { "too far off to be shown" };
    format!("the limb is {curve}; its axis, {off_deg:.2} deg off the optical axis, is {axis}")
}

/// The verdicts of candidates, from the one that says least about the body in view to the one that says most: first
/// those of edges that were not fitted or belong to another body, then the gates in the order in which an edge passes
/// them (`judge` in `hzn_core`). A verdict of several gates has the place of its first one.
const ORDER: &[Verdict] = &[
    Verdict::NoFit,
    Verdict::Taken,
    Verdict::NoConsensus,
    Verdict::FewInliers,
    Verdict::ShortArc,
    Verdict::Residuals,
    Verdict::HalfAngle,
    Verdict::Uncertain,
    Verdict::Unsupported,
    Verdict::Indistinct,
    Verdict::NoSky,
    Verdict::Night,
    Verdict::Sun,
    Verdict::Faint,
    Verdict::Band,
    Verdict::Layer,
    Verdict::Attitude,
    Verdict::Rate,
    Verdict::Straight,
    Verdict::Circle,
    Verdict::Polyline,
    Verdict::Departure,
    Verdict::OutOfView,
    Verdict::Radius,
    Verdict::Unlikely,
    Verdict::Glow,
    Verdict::Fixed,
    Verdict::Passed,
    Verdict::Chosen,
];

/// Returns the candidate that most probably is the body: the one that reached the furthest gate, and among several the
/// one with the most inliers. Structure in view can have more inliers than the limb, but it fails an early gate.
pub fn best_candidate(r: &Report<f64>) -> Option<&Candidate<f64>> {
    // Among equals the first is used. It begins next to the longest dark stretch of the border.
    r.candidates.iter().rev().max_by_key(|c| (reached(c.verdict), c.inliers))
}

/// Returns the verdict of the best candidate, of which only the verdict is known.
pub fn best_verdict(verdicts: impl IntoIterator<Item = Verdict>) -> Option<Verdict> {
    verdicts.into_iter().max_by_key(|verdict| reached(*verdict))
}

fn reached(verdict: Verdict) -> Option<usize> {
    ORDER.iter().position(|other| *other == verdict)
}

/// Returns the meaning of [`Verdict::ShortArc`]; without a limit in pixels, it is a part of the picture's diagonal.
fn short_arc_text(min_arc_px: Option<f64>) -> String {
    match min_arc_px {
        Some(px) => format!("inliers cover less than {px} px (gates.min_arc_px)"),
        None => "inliers cover less than a tenth of the picture's diagonal (gates.min_arc_px)".into(),
    }
}

/// Returns the name of a source of error in words.
pub fn term_text(term: Term) -> &'static str {
    match term {
        Term::EdgeNoise => "edge noise",
        Term::CommonShift => "a shift that the whole edge shares",
        Term::CommonTilt => "a tilt that the whole edge shares",
        Term::CommonBend => "a bend that the whole edge shares",
        Term::UnknownAzimuth => "the limb's unknown azimuth",
        Term::Weather => "the weather along the limb",
        Term::Lens => "the calibration of the lens",
        Term::LimbTilt => "a tilt of the limb",
        Term::LowSun => "the low Sun",
        Term::Clipping => "the limb height where the picture is clipped at full scale",
        Term::LimbHeight => "the limb height",
        Term::Altitude => "the altitude",
        Term::Radius => "the unknown local radius",
    }
}

/// Returns the meaning of a status for a picture in which no edge was fitted.
pub fn status_text(status: Status) -> &'static str {
    match status {
        Status::Ok => "the answer",
        Status::NoLimb => "no edge can be a limb, or the whole picture has one brightness",
        Status::TooDark => "the picture is darker than brightness.min_mean allows",
        Status::TooBright => "the picture is brighter than brightness.max_mean allows",
        Status::TooFewPoints => "only short edges were found (edge_points.min_points)",
        Status::Ambiguous => "two directions fit about equally well",
        Status::Rejected => "an edge failed a gate",
        Status::Truncated => "the picture has more edges than the work budget allows (limits.max_work)",
        Status::Unreadable => "the picture cannot be read",
        Status::NoAltitude => "no altitude above the limb height is known",
    }
}

/// Returns the standard deviations of the axis along its two principal directions, the larger first, and the angle of
/// the larger one, measured from image x towards image y. All are in radians.
pub fn principal_sigmas(s: &Solution<f64>) -> ([f64; 2], f64) {
    let [x, y, z] = s.axis.xyz();
    // Image x and y are rotated to the axis by the shortest rotation, as for the rays.
    let q = 1.0 / (1.0 + z).max(1e-9);
    let b1 = [1.0 - x * x * q, -x * y * q, -x];
    let b2 = [-x * y * q, 1.0 - y * y * q, -y];
    let rows = s.covariance.rows();
    let form =
        |a: [f64; 3], b: [f64; 3]| (0..3).map(|i| (0..3).map(|j| a[i] * rows[i][j] * b[j]).sum::<f64>()).sum::<f64>();
    let (p11, p12, p22) = (form(b1, b1), form(b1, b2), form(b2, b2));
    let half = (p11 + p22) / 2.0;
    let root = ((p11 - p22) / 2.0).hypot(p12);
    let angle = (2.0 * p12).atan2(p11 - p22) / 2.0;
    ([(half + root).max(0.0).sqrt(), (half - root).max(0.0).sqrt()], angle)
}

/// Returns the evidence that the answer, or else the last edge with evidence, is the limb: the names and texts of
/// lines.
pub fn evidence(
    trace: &Trace,
    report: &Report<f64>,
    gates: &gates::Config,
) -> impl Iterator<Item = (&'static str, String)> + use<> {
    let edges = trace.edges();
    let answer = report.solution.as_ref().map(|s| s.candidate);
    let shown = edges.iter().rev().find(|e| e.evidence.is_some() && answer.is_none_or(|n| n == e.candidate));
    let mut lines = Vec::new();
    if let Some((edge, evidence)) = shown.and_then(|edge| Some((edge.candidate, edge.evidence?))) {
        let odds = gates.prior_odds;
        let (p_limb, ratio) = (evidence.p_limb(odds), evidence.ln_ratio_of_all());
        lines.push((
            "evidence",
            format!(
                "edge {edge} is the limb with probability {p_limb:.4}: odds {odds}, log likelihood ratio {ratio:+.2}"
            ),
        ));
        for term in evidence::Term::ALL {
            if let Some(value) = evidence.value(term) {
                let (name, ratio, text) = (term.name(), evidence.ln_ratio(term), evidence_text(term));
                lines.push(("", format!("{ratio:+6.2} {name:<15} {value:.4}  {text}")));
            }
        }
    }
    lines.into_iter()
}

/// Returns the meaning of a piece of evidence.
fn evidence_text(term: evidence::Term) -> &'static str {
    match term {
        evidence::Term::Curvature => "log of the curvature, or of the size of a small disc, over its sigma",
        evidence::Term::HalfAngle => "squared difference from the expected half-angle, in sigmas",
        evidence::Term::Gaps => "parts of the limb without edge, and of the edge without limb",
        evidence::Term::Misfit => "log of the residuals over those that a limb may have",
        evidence::Term::Sky => "brightness of the sky over that of the body",
        evidence::Term::FaintAir => "log of the light 1.5 scale heights up, if too faint for air",
        evidence::Term::BrightAir => "log of the light 1.5 scale heights up, if too bright for air",
        evidence::Term::FaintHighAir => "log of the light three scale heights up, if too faint for air",
        evidence::Term::Layer => "a second edge below, as the ground has below airglow",
        evidence::Term::SecondEdge => "fall of the light below the edge to a break at one depth",
        evidence::Term::Flat => "log of how uneven and how much darker the body is inside, if it is little",
        evidence::Term::MottledSky => "log of how uneven the sky is",
        evidence::Term::Attitude => "agreement with the given attitude",
        evidence::Term::Sun => "the given Sun lights the edge",
    }
}

/// Returns a number with its noun: `1 picture`, `2 pictures`.
pub fn counted(n: u64, what: &str) -> String {
    if n == 1 { format!("1 {what}") } else { format!("{n} {what}s") }
}

#[cfg(test)]
mod tests {
    use hzn_core::status::Stage;

    use super::*;

    fn report(edges: &[(Verdict, u32)]) -> Report<f64> {
        let mut report = Report {
            status: Status::Rejected,
            stage: Stage::Gates,
            level: 9,
            next_level: None,
            counters: Default::default(),
            candidates: Default::default(),
            solution: None,
            is_suspect: false,
        };
        for (number, &(verdict, inliers)) in (0..).zip(edges) {
            let edge = Candidate { number, length_px: 9, points: 9, inliers, rms_px: 0.5, verdict };
            report.candidates.push(edge).unwrap();
        }
        report
    }

    /// The limb contradicts a wrong attitude. A longer edge of the vehicle does not even have the size of the body.
    #[test]
    fn the_edge_that_came_furthest_is_the_best() {
        let best = |edges: &[(Verdict, u32)]| best_candidate(&report(edges)).map(|c| c.number);
        assert_eq!(best(&[(Verdict::HalfAngle, 900), (Verdict::Attitude, 300), (Verdict::Taken, 2000)]), Some(1));
        assert_eq!(best(&[(Verdict::Residuals, 100), (Verdict::Residuals, 300), (Verdict::Residuals, 300)]), Some(1));
        assert_eq!(best(&[]), None);
    }

    #[test]
    fn every_verdict_has_one_place() {
        assert_eq!(ORDER.len(), Verdict::ALL.len());
        assert!(Verdict::ALL.iter().all(|verdict| ORDER.contains(verdict)));
    }
}
