//! Gates and choice: whether a fitted cone is the body's limb, and which of several is.

mod attitude;
mod band;
mod circle;
mod departure;
mod half_angle;
mod polyline;
mod shape;
mod sky;
mod sun;
mod view;

use crate::base::error::{ConfigError, Limit, above, between, require};
use crate::base::linalg::V3;
use crate::base::real::Real;
use crate::geometry::block::{Block, LANES};
use crate::geometry::camera::Camera;
use crate::geometry::frames::UnitVec3;
use crate::image::Pixels;
use crate::model::body::Expected;
use crate::model::observer::Observer;
use crate::model::verdict::Verdict;
use crate::stages::contour::BinaryPicture;
use crate::stages::covariance::Fused;
use crate::stages::fit::{self, Fit};

/// `[select]` of sensor.toml: what an answer must fulfil.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(default, deny_unknown_fields))]
pub struct Config {
    /// Fewest inliers, 8 or more; a third of what a small body has around it is enough of it, and a third of the shorter side
    /// of a picture of fewer than 80 rows.
    pub min_inliers: u16,
    /// Shortest edge that inliers must cover, in pixels, 0 or more. Left out: a tenth of the picture's diagonal, or a
    /// third of the body's circumference where that is less. Shorter edges fit many curves.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Option::is_none"))]
    pub min_arc_px: Option<f64>,
    /// Largest weighted RMS distance of the inliers from the limb in pixels, above 0; larger by as much as the noise of
    /// the edge raises `reject.threshold_px`.
    pub max_rms_px: f64,
    /// Largest difference of the fitted half-angle from the expected one in standard deviations, above 0.
    pub max_half_angle_sigma: f64,
    /// Largest standard deviation of an answer in degrees, above 0 to 180.
    pub max_sigma_deg: f64,
    /// Smallest part of the fitted limb in view that must be edge, 0 to 1. A limb goes on where the edge of a mast or
    /// a cloud ends. The Sun, which has no phases, needs 0.7 where this is above 0: the Moon is no Sun.
    pub min_support: f64,
    /// Largest part of what lies beyond the fitted limb that may be lit, 0 to 1. Beyond a limb is the sky, but for
    /// what stands before it; beyond the edge of a cloud are other clouds.
    pub max_lit_sky: f64,
    /// Smallest part of an edge's points that must be inliers, 0 to 1. With one point in 20, three pixels of threshold and a
    /// cone free to turn, a curve passes through clutter by chance.
    pub min_inlier_share: f64,
    /// Most points that may lie beside the fitted limb, within three times the cut-off, as a part of the inliers; 0 or more. A
    /// limb stands alone; a curve laid through many edges has others close beside it.
    pub max_nearby: f64,
    /// An edge of whose points this part or more are inliers lies on the limb as a whole, 0 to 1. Of others a part may lie on
    /// it by chance, and is asked for more: see `max_way`. 0 asks no edge.
    pub whole_edge: f64,
    /// Longest way along the inliers of an edge that is not whole, as a multiple of what they cover of the limb, 1 or more: a
    /// cloud's edge winds, and has many parts of which one may lie on a limb.
    pub max_way: f64,
    /// As `min_support`, of a body without phases (the Sun) where `min_support` is above 0: it is a whole disc, and a gibbous
    /// Moon has less. 0 to 1.
    pub min_support_whole: f64,
    /// Largest ratio of the cone's residual to that of a rival shape through the same points: a circle of the image, as lens
    /// flares are, and up to four straight pieces, as an iris or a vehicle has. 1 or more. Where residuals are noise the
    /// ratio is about 1; where the points are the rival's, the cone's misfit makes it large. 2 stands for a likelihood of
    /// 4 to the power of half the independent points. A large value turns the gate off.
    pub max_rival_ratio: f64,
    /// How much likelier the points must be about the limb than about a straight line, and may be at most about a rival than
    /// about the limb: twice the logarithm, −1e6 to 1e6. 9 are three standard deviations. Points whose residuals are alike
    /// count once. A large negative value takes straight edges, too.
    pub min_evidence: f64,
    /// Residuals below this are not told apart, pixels, above 0: what sampling and interpolation leave of a perfect edge.
    pub rival_floor_px: f64,
    /// Smallest noise that the gate of the half-angle takes an edge to have when the residuals show less than was told,
    /// pixels, 0 or more. A large value leaves the gate to the told noise.
    pub residual_floor_px: f64,
    /// Largest length over which an edge may go on smoothly beside the fitted limb, as a part of its longest run of
    /// inliers; 0 or more. Only where it keeps its contrast, see `departure_contrast`. A large value turns the gate off.
    pub max_departure: f64,
    /// Smallest part of the fitted limb in view that must be edge where the edge leaves the limb with its contrast kept, see
    /// `departure_contrast`, 0 to 1. The corner of an iris and the crossing of two flares end an edge so. 0 turns the gate off,
    /// and is the default: 0.7 refuses half-lit discs, too.
    pub min_support_abrupt: f64,
    /// The largest turn from one 16 pixels of edge to the next that is smooth, degrees, 0 to 90: 8 degrees is a curve of 115
    /// pixels radius, sharper ones are corners of clouds. Room for the noise is added.
    pub departure_turn_deg: f64,
    /// A departing edge counts only where its contrast is at least this part of the limb's, 0 or more: a terminator fades,
    /// the rim of a flare does not.
    pub departure_contrast: f64,
    /// Largest part of the looks from the limb inwards that may end in the sky across a second edge, 0 to 1; for bodies that
    /// cannot lie whole in the picture: a crescent is a band. 1 turns the gate off.
    pub max_band: f64,
    /// A second edge is one whose step is at least this part of the limb's, above 0 to 1.
    pub band_step: f64,
    /// Largest angle between the axis and the one that a given attitude and position lead to, in standard deviations of both,
    /// above 0.
    pub max_attitude_sigma: f64,
    /// Fastest turn of the vehicle in degrees a second, above 0: an axis farther from the last answer is refused. Left out:
    /// any. Pictures must then come in order.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Option::is_none"))]
    pub max_rate_deg_s: Option<f64>,
    /// Largest part of the inliers over which the given Sun stands lower than `min_sun_elevation_deg`, 0 to 1. For bodies that
    /// are seen in its light, see `body.sunlit`. 1 turns the gate off.
    pub max_unlit: f64,
    /// Lowest Sun that still lights a limb, degrees above its horizon, −90 to 90. −18 is the end of twilight.
    pub min_sun_elevation_deg: f64,
    /// How far the fitted half-angle must lie from that of the body on the other side of the edge, in standard deviations,
    /// 0 or more: the edge itself tells the side.
    pub min_side_sigma: f64,
    /// Answers farther apart than this contradict each other, degrees, 0 to 180.
    pub ambiguous_deg: f64,
    /// Of answers that contradict each other the better is taken when its score is better by this factor, 1 or more.
    pub ambiguous_score: f64,
    /// An answer ends the search when its edge covers this part of the limb in view, 0 to 1 ...
    pub certain_support: f64,
    /// ... and this part of its edge is inliers, or their residual is a quarter of the threshold; 0 to 1.
    pub certain_share: f64,
    /// Least and largest half-angle of a Sun, as multiples of its own, above 0: it never shrinks, and blooms.
    pub sun_size: [f64; 2],
    /// Least and largest half-angle of a Moon, as multiples of its own, above 0: what saturates of it is smaller, and it is
    /// nearer at times.
    pub moon_size: [f64; 2],
    /// By how much a Moon blooms beyond that, pixels, 0 or more.
    pub moon_bloom_px: f64,
    /// Whether some of the limb of the expected half-angle about the fitted axis must lie in the picture.
    #[cfg(feature = "dlr")]
    pub limb_in_view: bool,
    /// Largest mean square distance of the points from the conic section of the expected half-angle about the fitted
    /// axis, along its principal axis, in focal lengths squared; above 0. Left out: any.
    #[cfg(feature = "dlr")]
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Option::is_none"))]
    pub max_section_residual: Option<f64>,
    /// Lowest and highest altitude in kilometres, 0 or more: the fitted circle's radius must be that of the limb from
    /// between. Left out: any. At 0 the limb is infinitely wide.
    #[cfg(feature = "horace")]
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Option::is_none"))]
    pub altitude_limits_km: Option<[f64; 2]>,
    /// By how much the radius may lie beyond its limits, as a part of them, 0 or more.
    #[cfg(feature = "horace")]
    pub radius_margin: f64,
    /// With `altitude_limits_km`: by how much more the radius may lie beyond its limits, in pixels, 0 to 1e6; 0 by default.
    /// HORACE gives its margin so, 5000 px (Barf 2014, (2.35)). Only a build with the feature `horace` reads it.
    pub radius_margin_px: f64,
}

impl Default for Config {
    fn default() -> Self {
        Self {
            min_inliers: 24,
            min_arc_px: None,
            max_rms_px: 2.0,
            max_half_angle_sigma: 3.0,
            max_sigma_deg: 10.0,
            min_support: 0.4,
            max_lit_sky: 0.3,
            min_inlier_share: 0.05,
            max_nearby: 1.0 / 3.0,
            whole_edge: 0.8,
            max_way: 3.0,
            min_support_whole: 0.7,
            max_rival_ratio: 2.0,
            min_evidence: 9.0,
            rival_floor_px: 0.03,
            residual_floor_px: 0.1,
            max_departure: 0.2,
            min_support_abrupt: 0.0,
            departure_turn_deg: 8.0,
            departure_contrast: 0.6,
            max_band: 0.5,
            band_step: 0.4,
            max_attitude_sigma: 4.0,
            max_rate_deg_s: None,
            max_unlit: 0.5,
            min_sun_elevation_deg: -18.0,
            min_side_sigma: 4.0,
            ambiguous_deg: 5.0,
            ambiguous_score: 2.0,
            certain_support: 0.5,
            certain_share: 0.8,
            sun_size: [0.9, 12.0],
            moon_size: [0.5, 1.1],
            moon_bloom_px: 10.0,
            #[cfg(feature = "dlr")]
            limb_in_view: false,
            #[cfg(feature = "dlr")]
            max_section_residual: None,
            #[cfg(feature = "horace")]
            altitude_limits_km: None,
            #[cfg(feature = "horace")]
            radius_margin: 0.1,
            radius_margin_px: 0.0,
        }
    }
}

impl Config {
    pub(crate) fn check(&self) -> Result<(), ConfigError> {
        require(self.min_inliers >= 8, "select.min_inliers", f64::from(self.min_inliers), Limit::AtLeast(8.0))?;
        if let Some(arc) = self.min_arc_px {
            between("select.min_arc_px", arc, 0.0, 1e6)?;
        }
        #[cfg(feature = "dlr")]
        if let Some(limit) = self.max_section_residual {
            above("select.max_section_residual", limit, 0.0)?;
        }
        #[cfg(feature = "horace")]
        {
            if let Some([low, high]) = self.altitude_limits_km {
                between("select.altitude_limits_km", low, 0.0, 1e9)?;
                between("select.altitude_limits_km", high, low, 1e9)?;
            }
            between("select.radius_margin", self.radius_margin, 0.0, 1e3)?;
        }
        between("select.radius_margin_px", self.radius_margin_px, 0.0, 1e6)?;
        above("select.max_rms_px", self.max_rms_px, 0.0)?;
        above("select.max_half_angle_sigma", self.max_half_angle_sigma, 0.0)?;
        above("select.max_sigma_deg", self.max_sigma_deg, 0.0)?;
        between("select.max_sigma_deg", self.max_sigma_deg, 0.0, 180.0)?;
        between("select.min_support", self.min_support, 0.0, 1.0)?;
        between("select.max_lit_sky", self.max_lit_sky, 0.0, 1.0)?;
        between("select.min_inlier_share", self.min_inlier_share, 0.0, 1.0)?;
        between("select.max_nearby", self.max_nearby, 0.0, 1e6)?;
        between("select.whole_edge", self.whole_edge, 0.0, 1.0)?;
        between("select.max_way", self.max_way, 1.0, 1e6)?;
        between("select.min_support_whole", self.min_support_whole, 0.0, 1.0)?;
        between("select.max_rival_ratio", self.max_rival_ratio, 1.0, 1e6)?;
        between("select.min_evidence", self.min_evidence, -1e6, 1e6)?;
        above("select.rival_floor_px", self.rival_floor_px, 0.0)?;
        between("select.rival_floor_px", self.rival_floor_px, 0.0, 1e4)?;
        between("select.residual_floor_px", self.residual_floor_px, 0.0, 1e4)?;
        between("select.max_departure", self.max_departure, 0.0, 1e6)?;
        between("select.min_support_abrupt", self.min_support_abrupt, 0.0, 1.0)?;
        between("select.departure_turn_deg", self.departure_turn_deg, 0.0, 90.0)?;
        between("select.departure_contrast", self.departure_contrast, 0.0, 1e6)?;
        between("select.max_band", self.max_band, 0.0, 1.0)?;
        above("select.band_step", self.band_step, 0.0)?;
        between("select.band_step", self.band_step, 0.0, 1.0)?;
        above("select.max_attitude_sigma", self.max_attitude_sigma, 0.0)?;
        between("select.max_attitude_sigma", self.max_attitude_sigma, 0.0, 1e6)?;
        if let Some(rate) = self.max_rate_deg_s {
            above("select.max_rate_deg_s", rate, 0.0)?;
            between("select.max_rate_deg_s", rate, 0.0, 1e6)?;
        }
        between("select.max_unlit", self.max_unlit, 0.0, 1.0)?;
        between("select.min_sun_elevation_deg", self.min_sun_elevation_deg, -90.0, 90.0)?;
        between("select.min_side_sigma", self.min_side_sigma, 0.0, 1e6)?;
        between("select.ambiguous_deg", self.ambiguous_deg, 0.0, 180.0)?;
        between("select.ambiguous_score", self.ambiguous_score, 1.0, 1e6)?;
        between("select.certain_support", self.certain_support, 0.0, 1.0)?;
        between("select.certain_share", self.certain_share, 0.0, 1.0)?;
        for (name, [least, most]) in [("select.sun_size", self.sun_size), ("select.moon_size", self.moon_size)] {
            above(name, least, 0.0)?;
            between(name, most, least, 1e6)?;
        }
        between("select.moon_bloom_px", self.moon_bloom_px, 0.0, 1e6)
    }

    /// Turns off every gate that compares an edge with what is no limb, for chains that are rebuilt as they were published.
    #[cfg(any(feature = "dlr", feature = "zju", feature = "horace"))]
    pub(crate) fn trust_every_shape(&mut self) {
        (self.max_rival_ratio, self.min_evidence, self.residual_floor_px) = (1e6, -1e6, 1e4);
        (self.min_support_abrupt, self.whole_edge) = (0.0, 0.0);
        (self.max_departure, self.max_band, self.max_unlit) = (1e6, 1.0, 1.0);
        self.max_attitude_sigma = 1e6;
    }
}

/// A fit with what the gates look at.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Judged<T> {
    /// `Passed`, or the gate that it failed.
    pub(crate) verdict: Verdict,
    /// Weighted RMS over the part of the limb in view that it explains: the smallest wins.
    pub(crate) score: T,
    /// The part of the limb in view that is edge, 0 to 1.
    pub(crate) support: T,
}

/// Looks a fit over, with the points that carry it. `points` of the edge were made. `raised` is how many times larger the
/// noise of the edge makes the threshold of the rejection, and with it the largest RMS.
pub(crate) fn judge<T: Real, P: Pixels, O: Observer<T>>(
    fit: &Fit<T>,
    fused: &Fused<T>,
    sigma_max_rad: T,
    expected: &Expected<T>,
    blocks: &[Block<T>],
    points: u32,
    raised: T,
    binary: &BinaryPicture<'_, T, P, O>,
    camera: &Camera<T>,
    config: &Config,
) -> Judged<T> {
    let limb_px = inliers(blocks, 1)
        .next()
        .map_or(T::ZERO, |(b, l)| view::limb_in_view(&fused.e, fused.c, &b.ray(l), camera, binary.region));
    let covered_px = view::covered(&fused.e, blocks);
    let support = (covered_px / limb_px.max(T::one())).min(T::one());
    let sigma_limit = T::from_f64(config.max_sigma_deg.to_radians());
    let chi = T::from_f64(config.max_half_angle_sigma);
    let least = config.min_inliers.min(small(expected.sin, camera, 3)).min(few_rows(camera, 3));
    let counts = |n: u32| T::from_i32(n as i32);
    let verdict = if counts(fit.inliers) < counts(points) * T::from_f64(config.min_inlier_share) {
        Verdict::NoConsensus
    } else if fit.inliers < u32::from(least) {
        Verdict::FewInliers
    } else if covered_px < min_arc(&fused.c, camera, config) {
        Verdict::ShortArc
    } else if !(fit.rms_px <= T::from_f64(config.max_rms_px) * raised) {
        Verdict::Residuals
    } else if !(fused.chi2 <= chi * chi) || !blooms_to(&fit.c, expected, camera, config) {
        Verdict::HalfAngle
    } else if !(sigma_max_rad <= sigma_limit) {
        Verdict::Uncertain
    } else if support < T::from_f64(least_support(config, expected)) {
        Verdict::Unsupported
    } else if counts(fit.nearby) > counts(fit.inliers) * T::from_f64(config.max_nearby)
        || is_by_chance(fit, points, covered_px, config)
    {
        Verdict::Indistinct
    } else {
        surroundings(fused, expected, blocks, binary, camera, config)
    };
    let verdict = match verdict {
        Verdict::Passed => attitude::verdict(&fused.e, sigma_max_rad, expected, config),
        failed => failed,
    };
    let verdict = match verdict {
        Verdict::Passed => rivals(fit, fused, expected, blocks, points, support, binary, camera, config),
        failed => failed,
    };
    Judged { verdict, score: fit.rms_px.max(T::from_f64(0.05)) / support.max(T::from_f64(1e-3)), support }
}

/// Whether a part of an edge lies on the cone as a part of any edge that winds may.
fn is_by_chance<T: Real>(fit: &Fit<T>, points: u32, covered_px: T, config: &Config) -> bool {
    let whole = T::from_i32(fit.inliers as i32) >= T::from_i32(points as i32) * T::from_f64(config.whole_edge);
    !whole && fit.arc_px > covered_px * T::from_f64(config.max_way)
}

/// Whether what lies beyond and within the fitted limb is the sky and the body.
fn surroundings<T: Real, P: Pixels, O: Observer<T>>(
    fused: &Fused<T>,
    expected: &Expected<T>,
    blocks: &[Block<T>],
    binary: &BinaryPicture<'_, T, P, O>,
    camera: &Camera<T>,
    config: &Config,
) -> Verdict {
    let sky = sky::beyond(&fused.e, blocks, binary, camera);
    if sky.lit > T::from_f64(config.max_lit_sky) {
        return Verdict::NoSky;
    }
    if sun::unlit(&fused.e, fused.c, blocks, expected, config.min_sun_elevation_deg) > T::from_f64(config.max_unlit) {
        return Verdict::Sun;
    }
    // Of a picture that came row by row only lit and dark is left, where a terminator is as steep as an edge.
    // A disc that lies whole in the picture may be a crescent, which is a band.
    let disc_px = disc_px(expected, camera);
    let wide = disc_px > T::from_i32(camera.width().min(camera.height()).into());
    let looks = !P::STREAMED && config.max_band < 1.0 && wide;
    let step = T::from_f64(config.band_step);
    if looks && band::banded(&fused.e, blocks, binary, camera, &sky, disc_px, step) >= T::from_f64(config.max_band) {
        return Verdict::Band;
    }
    Verdict::Passed
}

/// The diameter of the body's disc, 2 α f, in pixels.
fn disc_px<T: Real>(expected: &Expected<T>, camera: &Camera<T>) -> T {
    let (fx, fy) = camera.focal_px();
    expected.half_angle_rad() * (fx + fy)
}

/// Whether the points are another curve's: that they fit the cone no worse than what is no limb, agree with its half-angle
/// by their own noise, and do not go on beside it.
fn rivals<T: Real, P: Pixels, O: Observer<T>>(
    fit: &Fit<T>,
    fused: &Fused<T>,
    expected: &Expected<T>,
    blocks: &[Block<T>],
    points: u32,
    support: T,
    binary: &BinaryPicture<'_, T, P, O>,
    camera: &Camera<T>,
    config: &Config,
) -> Verdict {
    let curve = shape::Curve::new(fit, fit::azimuth(expected));
    let shape = shape::inliers(blocks, fit, &curve, camera);
    let (ratio, floor) = (T::from_f64(config.max_rival_ratio), T::from_f64(config.rival_floor_px));
    let (rms, noise) = (shape::rms(&shape), shape::local_noise(&shape));
    let independent = shape::independent(&shape);
    let evidence = T::from_f64(config.min_evidence);
    // How much likelier the points are about one curve than about another: n ln(v/v').
    let likelier = |rms: T, than: T| {
        let v = rms.max(floor) / than.max(floor);
        independent * (v * v).ln()
    };
    if !(likelier(polyline::straight_rms(&shape), rms) > evidence) {
        return Verdict::Straight;
    }
    // No smooth curve fits better than the noise from point to point.
    if rms > ratio * noise.max(floor) || likelier(rms, noise) > evidence {
        let worse = |rival: T| rms > ratio * rival.max(floor);
        if circle::rms(&shape).is_some_and(|c| worse(c) || (likelier(rms, c) > evidence && evidence > T::ZERO)) {
            return Verdict::Circle;
        }
        // What it has more to turn makes its residual smaller, whatever the points are; of few points it tells nothing.
        let (points, turns) = (T::from_i32(shape.len() as i32), T::from_f64(polyline::PARAMETERS));
        let left = points - T::from_f64(3.0) - turns;
        if left > T::ZERO {
            let pieces = polyline::rms(&shape, rms) * ((left + turns) / left).sqrt();
            let more = independent.ln() * turns;
            if worse(pieces) || (likelier(rms, pieces) > evidence + more && evidence > T::ZERO) {
                return Verdict::Polyline;
            }
        }
    }
    if half_angle::disagrees(fit, fused, expected, blocks, config) {
        return Verdict::HalfAngle;
    }
    if !P::STREAMED
        && fit.inliers < points
        && departure::departs(blocks, points, &curve, noise, support, binary, camera, config)
    {
        return Verdict::Departure;
    }
    Verdict::Passed
}

/// The smallest part of the limb in view that must be edge; 0 asks for none of any body.
fn least_support<T>(config: &Config, expected: &Expected<T>) -> f64 {
    let whole = config.min_support > 0.0 && !expected.phases;
    if whole { config.min_support.max(config.min_support_whole) } else { config.min_support }
}

/// Whether a body of free half-angle can be seen under that of cosine `c`; others are weighed against the expected.
fn blooms_to<T: Real>(c: &T, expected: &Expected<T>, camera: &Camera<T>, config: &Config) -> bool {
    let sin = (T::one() - *c * *c).max(T::ZERO).sqrt();
    let (fx, fy) = camera.focal_px();
    let px = T::one() / fx.min(fy);
    let times = |n: f64| expected.sin * T::from_f64(n);
    let (least, most) = if expected.blooms() {
        // A pixel is within the measure's own error, but half of the Sun is no Sun.
        let [least, most] = config.sun_size;
        ((times(least) - px).max(times(least * 0.5)), times(most))
    } else {
        let [least, most] = config.moon_size;
        (times(least), times(most) + px * T::from_f64(config.moon_bloom_px))
    };
    !expected.free || (sin >= least && sin <= most.min(T::one()) && *c > T::ZERO)
}

/// A part of the border pixels of a body's disc, one in `part`, 8 or more: less is not asked of a small body.
pub(crate) fn small<T: Real>(sin: T, camera: &Camera<T>, part: i32) -> u16 {
    let (fx, fy) = camera.focal_px();
    let around = T::from_f64(core::f64::consts::PI) * (fx + fy) * sin;
    (around / T::from_i32(part)).to_i32().clamp(8, i32::from(u16::MAX)) as u16
}

/// Pictures with shorter sides than this are small: an edge across one has fewer points than the defaults ask for.
const SMALL_PICTURE: u16 = 80;

/// A part of a small picture's shorter side, one in `part`, 8 or more: of a thermal array of 24 rows a limb has no more.
pub(crate) fn few_rows<T: Real>(camera: &Camera<T>, part: u16) -> u16 {
    let side = camera.width().min(camera.height());
    if side < SMALL_PICTURE { (side / part.max(1)).max(8) } else { u16::MAX }
}

fn min_arc<T: Real>(c: &T, camera: &Camera<T>, config: &Config) -> T {
    if let Some(arc) = config.min_arc_px {
        return T::from_f64(arc);
    }
    let (w, h) = (T::from_i32(i32::from(camera.width())), T::from_i32(i32::from(camera.height())));
    let (fx, fy) = camera.focal_px();
    let sin = (T::one() - *c * *c).max(T::ZERO).sqrt();
    let circumference = T::from_f64(core::f64::consts::PI) * (fx + fy) * sin;
    ((w * w + h * h).sqrt() * T::from_f64(0.1)).min(circumference * T::from_f64(0.33))
}

/// Up to `count` inliers, evenly along the edge, from the middle of each part.
fn inliers<T: Real>(blocks: &[Block<T>], count: usize) -> impl Iterator<Item = (&Block<T>, usize)> {
    let all = || blocks.iter().flat_map(|b| (0..LANES).filter(|&l| b.weight[l & 7] > T::ZERO).map(move |l| (b, l)));
    let every = (all().count() / count.max(1)).max(1);
    all().skip(every / 2).step_by(every).take(count)
}

/// Inliers from which is looked outwards and inwards.
const LOOKS: usize = 12;

/// Distance from the limb at which the brightness on both sides is read for the next picture's level, pixels.
const PLATEAU_PX: i32 = 6;

/// Halfway between the brightness on both sides of the limb, in counts.
pub(crate) fn middle_level<T: Real, P: Pixels, O: Observer<T>>(
    e: &V3<T>,
    blocks: &[Block<T>],
    binary: &BinaryPicture<'_, T, P, O>,
    camera: &Camera<T>,
) -> Option<u16> {
    let (mut dark, mut lit, mut looks) = (0u32, 0u32, 0u32);
    for (block, lane) in inliers(blocks, LOOKS) {
        let Some(from) = camera.project(&UnitVec3::assume_unit(block.ray(lane))) else { continue };
        let [gu, gv] = block.gradient_at(lane, e);
        let norm = (gu * gu + gv * gv).sqrt().max(T::from_f64(1e-20));
        let at = |px: i32| {
            let px = T::from_i32(px);
            let (x, y) = ((from.u + gu / norm * px).to_i32(), (from.v + gv / norm * px).to_i32());
            let (x, y) = (u16::try_from(x).ok()?, u16::try_from(y).ok()?);
            (binary.region.contains(x, y) && !binary.region.masked(x, y)).then(|| u32::from(binary.brightness(x, y)))
        };
        if let (Some(d), Some(l)) = (at(-PLATEAU_PX), at(PLATEAU_PX)) {
            (dark, lit, looks) = (dark + d, lit + l, looks + 1);
        }
    }
    (lit > dark).then(|| ((dark + lit) / 2 / looks.max(1)) as u16)
}
