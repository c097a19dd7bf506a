//! Advice for a picture without an answer.
//!
//! Each piece of advice is for some bodies only. The altitude says how large the Earth is in a picture, but Sun and
//! Moon have one size for every camera near the Earth, and only the Earth has clouds and airglow.

use std::borrow::Cow;

use hzn_core::Report;
use hzn_core::body::{self, Kind};
use hzn_core::status::{Stage, Status};
use hzn_core::verdict::Verdict;

use crate::explain::{best_candidate, is_free};

/// The body that was looked for, as far as advice depends on it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Subject {
    kind: Kind,
    is_sunlit: bool,
    is_far: bool,
}

/// Half-angle below which a body is far, in radians: its whole disc is in view of most cameras. The limb height is then
/// less than a hundredth of what the distance is.
const FAR_RAD: f64 = 0.35;

impl Subject {
    /// Returns what advice about a body depends on. The half-angle is the expected one in radians; without it, the body
    /// counts as near.
    pub fn new(body: &body::Config, half_angle_rad: Option<f64>) -> Self {
        let is_far = half_angle_rad.is_some_and(|rad| rad < FAR_RAD);
        Self { kind: body.kind, is_sunlit: body.is_seen_in_sunlight(), is_far }
    }

    fn is_earth(self) -> bool {
        matches!(self.kind, Kind::Earth | Kind::EarthSphere)
    }
}

/// Returns advice for a picture without an answer. Advice for the best candidate comes first, then advice for longer
/// ones, because the longest edge is most likely the limb.
pub fn tips(report: &Report<f64>, subject: Subject) -> Vec<Cow<'static, str>> {
    let mut candidates: Vec<_> = report.candidates.iter().collect();
    candidates.sort_by_key(|c| std::cmp::Reverse(c.length_px));
    let candidates = best_candidate(report).into_iter().chain(candidates);
    let mut tips: Vec<Cow<'static, str>> = of_status(report, subject).into_iter().collect();
    for tip in candidates.filter_map(|c| of_verdict(c.verdict, subject)) {
        if !tips.contains(&tip) {
            tips.push(tip);
        }
    }
    tips
}

/// Returns advice that follows from the status of a picture.
fn of_status(report: &Report<f64>, subject: Subject) -> Option<Cow<'static, str>> {
    if report.status == Status::NoLimb && report.stage == Stage::Threshold {
        let size = match report.counters.sampled {
            0 => String::new(),
            places => format!(" of {places} places"),
        };
        return Some(Cow::Owned(format!(
            "no bright pixel in the sample{size}: nothing is in view, the exposure does not show it, or the body is \
             smaller than the distance between two places (then set threshold.method = \"fixed\")"
        )));
    }
    Some(Cow::Borrowed(match report.status {
        Status::TooDark => "the picture is darker than brightness.min_mean allows: lower it, or expose longer",
        Status::TooBright => "the picture is brighter than brightness.max_mean allows: raise it, or expose shorter",
        Status::TooFewPoints => {
            "only short edges were found, for example of stars, noise or hot pixels. Is the body in view? If the body \
             is very small, lower edge_points.min_points"
        }
        Status::Truncated if subject.is_earth() => {
            "the edges of the picture cost more than the work budget: raise limits.max_work, mask structure in view, \
             or set a threshold above the clouds (threshold.method = \"fixed\")"
        }
        Status::Truncated => {
            "the edges of the picture cost more than the work budget: raise limits.max_work, mask structure in view, \
             or set a threshold above the structure (threshold.method = \"fixed\")"
        }
        Status::Ambiguous => "two directions fit about equally well: mask structure in view (mask.polygons_px)",
        Status::NoLimb if report.candidates.is_empty() => {
            "no edge is long enough. Is the limb in view? If it is, try another threshold (threshold.scale, or \
             threshold.level if threshold.method is \"fixed\")"
        }
        _ => return None,
    }))
}

/// Returns advice for a picture that has a candidate with this verdict; `None` where the meaning of the verdict says
/// everything, or where the gate never refuses this body.
pub fn of_verdict(verdict: Verdict, subject: Subject) -> Option<Cow<'static, str>> {
    let tip = match verdict {
        Verdict::NoConsensus | Verdict::FewInliers => return Some(of_form(subject)),
        Verdict::HalfAngle => return Some(of_size(subject)),
        Verdict::Night | Verdict::Sun => of_light(verdict, subject)?,
        Verdict::Straight => {
            "too little of the limb is in view, or the lens is too uncertain, to show on which side the body is: a \
             calibrated lens or a wider one shows more of the curvature"
        }
        Verdict::Residuals => {
            "the edge does not follow the limb closely: check the calibration, or raise gates.max_rms_px"
        }
        Verdict::ShortArc | Verdict::Uncertain => {
            "too little of the limb is in view for a good answer: if a less accurate answer is sufficient, lower \
             gates.min_arc_px or raise gates.max_sigma_deg"
        }
        Verdict::Unsupported if subject.is_earth() => {
            "an edge fits by chance (cloud, structure): mask the parts of the vehicle in view, or try another threshold"
        }
        Verdict::Unsupported => {
            "an edge fits by chance (structure, a reflection): mask the parts of the vehicle in view, or try another \
             threshold"
        }
        Verdict::Attitude if subject.is_earth() => {
            "the picture contradicts the given attitude: check the order of the quaternion (qw, qx, qy, qz: camera to \
             ECEF), its time, and attitude_sigma_deg"
        }
        // No attitude predicts where Sun and Moon are.
        Verdict::Attitude if !is_free(subject.kind) => {
            "the picture contradicts the given attitude: check the order of the quaternion (qw, qx, qy, qz: camera to \
             the axes of x_km, y_km, z_km, which turn with the body), its time, and attitude_sigma_deg"
        }
        Verdict::Radius if !is_free(subject.kind) => {
            "no altitude within gates.altitude_limits_km gives a limb of this size: check these limits and the focal \
             length"
        }
        Verdict::Unlikely => of_evidence(subject),
        Verdict::Glow if subject.is_earth() => {
            "light reaches high above the edge: by day, expose shorter until the body is below full scale, and keep \
             stray light from the lens; a larger gates.max_glow passes more of it, but at night airglow, too"
        }
        Verdict::Glow => {
            "light reaches high above the edge: expose shorter until the body is below full scale, and keep stray \
             light from the lens; a larger gates.max_glow passes more of it"
        }
        _ => return None,
    };
    Some(Cow::Borrowed(tip))
}

/// What says how large a body is in the picture.
fn size_keys(subject: Subject) -> &'static str {
    match subject.kind {
        Kind::Earth | Kind::EarthSphere => "altitude_km",
        Kind::Sphere => "body.radius_km, the altitude (altitude_km or x_km, y_km, z_km)",
        Kind::Ellipsoid => "body.radii_km, the distance (altitude_km or x_km, y_km, z_km)",
        _ => "body.kind, the distance (altitude_km or x_km, y_km, z_km)",
    }
}

/// What to write for a camera near the Moon, which the kind `moon` is not for.
const NEAR_MOON: &str = "For the limb of the Moon from nearby, write kind = \"sphere\" with the size of the Moon";

/// Nothing in the picture has the form of the body.
fn of_form(subject: Subject) -> Cow<'static, str> {
    const TOLERATE: &str = "a larger consensus.threshold_px tolerates a poor calibration";
    match subject.kind {
        Kind::Sun => format!("no candidate is a disc: is the Sun whole in view, and sharp? {TOLERATE}"),
        Kind::Moon if subject.is_sunlit => format!(
            "no candidate has the form of the Moon's limb: is it in view, and sharp? The border of its night is no \
             limb, and the Sun's direction (sun_x, sun_y, sun_z) leaves it out; {TOLERATE}. {NEAR_MOON}"
        ),
        Kind::Moon => format!("no candidate is a disc: is the Moon whole in view, and sharp? {TOLERATE}. {NEAR_MOON}"),
        _ => {
            let keys = size_keys(subject);
            format!(
                "no candidate has the form of the expected limb: check {keys}, the focal length and the lens model; \
                 {TOLERATE}"
            )
        }
    }
    .into()
}

/// The limb has another size than expected.
fn of_size(subject: Subject) -> Cow<'static, str> {
    match subject.kind {
        Kind::Sun => "a disc was found, but the Sun never looks so small or so large: check the focal length. Is the \
                      disc a lamp, a reflection, or the Moon? Glare makes the Sun larger: expose shorter"
            .into(),
        Kind::Moon => format!(
            "a disc was found, but the Moon never looks so small or so large: check the focal length. Is the disc a \
             lamp, a reflection, or the Sun? Glare makes the Moon larger: expose shorter. {NEAR_MOON}"
        )
        .into(),
        _ => {
            let keys = if subject.is_earth() { "altitude" } else { size_keys(subject) };
            // From afar, the height of the limb hardly changes the size of the disc.
            let (what, sigma) = if subject.is_far {
                ("disc", "body.altitude_sigma_km if the distance is less certain")
            } else {
                ("limb", "body.limb_height_sigma_km")
            };
            format!(
                "a {what} was found, but it is larger or smaller than expected: check {keys} and focal length, or \
                 raise {sigma}"
            )
            .into()
        }
    }
}

/// The edge has few signs of a limb. An attitude is evidence only where it predicts where the body is.
fn of_evidence(subject: Subject) -> &'static str {
    match (is_free(subject.kind), subject.is_sunlit) {
        (true, false) => {
            "the edge has few signs of a limb (see evidence): is the disc whole, sharp and free from glare? \
             gates.min_p_limb = 0 takes the risk"
        }
        (true, true) => {
            "the edge has few signs of a limb (see evidence): the Sun (sun_x, sun_y, sun_z) is evidence, too; \
             gates.min_p_limb = 0 takes the risk"
        }
        (false, true) => {
            "the edge has few signs of a limb (see evidence): an attitude (qw, qx, qy, qz) or the Sun (sun_x, sun_y, \
             sun_z) is evidence, too; gates.min_p_limb = 0 takes the risk"
        }
        (false, false) => {
            "the edge has few signs of a limb (see evidence): an attitude (qw, qx, qy, qz) is evidence, too; \
             gates.min_p_limb = 0 takes the risk"
        }
    }
}

/// The given Sun does not light the edge. A body that shines by itself is not refused for it.
fn of_light(verdict: Verdict, subject: Subject) -> Option<&'static str> {
    let tip = match verdict {
        Verdict::Night if subject.is_earth() => {
            "it is night below the camera: check utc and x_km, y_km, z_km; for a thermal camera set body.sunlit = \
             false; gates.max_unlit = 1 takes the risk that the edge is airglow"
        }
        Verdict::Night => {
            "the Sun does not light what is in view: check sun_x, sun_y, sun_z; for a thermal camera set body.sunlit = \
             false; gates.max_unlit = 1 takes the risk that the edge is not the limb"
        }
        _ => {
            "the limb is on the night side of the given Sun: check the sign and the frame of sun_x, sun_y, sun_z \
             (from the camera to the Sun, in the axes of the camera); for a thermal camera set body.sunlit = false"
        }
    };
    subject.is_sunlit.then_some(tip)
}
