//! Gates and choice: decides whether a fitted cone is the limb of the body, and which of several cones is the answer.

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

use crate::base::error::{ConfigError, between};
use crate::base::keys::{Section, section};
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

section! {
    /// `[select]` of sensor.toml: the gates that an answer must pass, and the choice among answers.
    "select" pub struct Config: Copy {
        /// Fewest inliers; a small body or picture needs fewer.
        ///
        /// For a small disc, one third of its circumference in pixels is enough; in a picture of fewer than 80 rows or
        /// columns, one third of its shorter side.
        @110 min_inliers: u16 = 24, [8.0 or more];
        /// Shortest length of edge that inliers must cover, px.
        ///
        /// Shorter edges fit many curves.
        @111 min_arc_px: Option<f64> = None, [0.0 to 1e6] {
            unset: "a tenth of the diagonal, or a third of the body's circumference if less",
            example: "60.0",
        };
        /// Largest weighted RMS distance of the inliers from the limb, px; it grows as `reject.noise_sigma` raises the
        /// largest distance of an inlier.
        @112 max_rms_px: f64 = 2.0, [above 0.0];
        /// Largest difference between the fitted and the expected half-angle, in standard deviations.
        @113 max_half_angle_sigma: f64 = 3.0, [above 0.0];
        /// Largest standard deviation of an answer, degrees.
        @114 max_sigma_deg: f64 = 10.0, [above 0.0 to 180.0];
        /// Smallest part of the fitted limb in view that edge points must cover.
        ///
        /// A limb goes on where the edge of a mast or of a cloud ends.
        @115 min_support: f64 = 0.4, [0.0 to 1.0];
        /// Largest part of the sky beyond the fitted limb that may be lit.
        ///
        /// Beyond the edge of a cloud are other clouds. Ghosts in the sky next to a limb light up to a quarter of it.
        @116 max_lit_sky: f64 = 0.3, [0.0 to 1.0];
        /// Smallest part of an edge's points that must be inliers.
        ///
        /// With one inlier in 20 points and a threshold of three pixels, a cone that is free to turn passes through
        /// clutter by chance.
        @- min_inlier_share: f64 = 0.05, [0.0 to 1.0];
        /// Largest number of points close to the fitted limb that are no inliers, as a part of the inliers.
        ///
        /// Close means within three times the cut-off. A limb stands alone; a curve through many edges has other points
        /// close to it.
        @- max_nearby: f64 = 1.0 / 3.0, [0.0 to 1e6];
        /// An edge lies on the limb as a whole where at least this part of its points are inliers; 0 checks no edge for
        /// `max_way`.
        @- whole_edge: f64 = 0.8, [0.0 to 1.0];
        /// Longest way along the inliers of an edge that is not whole, as a multiple of the limb that they cover.
        ///
        /// A cloud's edge winds, and a part of it may lie on a limb by chance.
        @- max_way: f64 = 3.0, [1.0 to 1e6];
        /// For the Sun: smallest part of the fitted limb in view that edge points must cover, where `min_support` is
        /// above 0.
        ///
        /// The Sun is a whole disc; a gibbous Moon shows less.
        @- min_support_whole: f64 = 0.7, [0.0 to 1.0];
        /// Largest ratio of the cone's residual to that of a circle of the image or of four straight pieces; 1e6 turns
        /// the gate off.
        ///
        /// Lens flares are circles of the image; an iris and a vehicle have straight edges. Where residuals are noise
        /// the ratio is about 1. A ratio of 2 is a likelihood ratio of 4 to the power of half the number of independent
        /// points.
        @- max_rival_ratio: f64 = 2.0, [1.0 to 1e6];
        /// Smallest evidence for the limb over a straight line, and largest evidence for a rival shape over the limb:
        /// twice the logarithm of the likelihood ratio; −1e6 turns the gate off.
        ///
        /// A value of 9 is three standard deviations. Points with correlated residuals count once.
        @- min_evidence: f64 = 9.0, [-1e6 to 1e6];
        /// Residuals below this count as equal, px.
        ///
        /// Sampling and interpolation leave about this residual of a perfect edge.
        @- rival_floor_px: f64 = 0.03, [above 0.0 to 1e4];
        /// Smallest noise of an edge in the gate of the half-angle, where its residuals are smaller than the given
        /// noise, px; 1e4 leaves the gate to the given noise.
        @- residual_floor_px: f64 = 0.1, [0.0 to 1e4];
        /// Longest smooth continuation of an edge next to the fitted limb, as a part of its longest run of inliers; 1e6
        /// turns the gate off.
        ///
        /// A continuation counts where it keeps its contrast, see `departure_contrast`.
        @- max_departure: f64 = 0.2, [0.0 to 1e6];
        /// Smallest part of the fitted limb in view that edge points must cover, where the edge leaves the limb with
        /// its contrast kept; 0 turns the gate off.
        ///
        /// The corner of an iris and the crossing of two flares end an edge in this way. The default is 0, because 0.7
        /// also refuses half-lit discs and crescents.
        @- min_support_abrupt: f64 = 0.0, [0.0 to 1.0];
        /// Largest turn between two lengths of 16 px of edge that counts as smooth, degrees.
        ///
        /// 8 degrees are a curve of 115 px radius; corners of clouds are sharper. Room for the noise is added.
        @- departure_turn_deg: f64 = 8.0, [0.0 to 90.0];
        /// Smallest contrast of a continuation that counts, as a part of the limb's contrast.
        ///
        /// A terminator fades; the rim of a flare does not.
        @- departure_contrast: f64 = 0.6, [0.0 to 1e6];
        /// Largest part of the looks inwards from the limb that may end in the sky behind a second edge; 1 turns the
        /// gate off.
        ///
        /// The gate is for a body that cannot lie whole in the picture: a crescent is a band, too.
        @- max_band: f64 = 0.5, [0.0 to 1.0];
        /// Smallest step of a second edge, as a part of the limb's step.
        @- band_step: f64 = 0.4, [above 0.0 to 1.0];
        /// Largest angle between the axis and the axis that a given attitude and position predict, in standard
        /// deviations.
        @- max_attitude_sigma: f64 = 4.0, [above 0.0 to 1e6];
        /// Fastest turn of the vehicle, degrees per second: an axis farther from the previous answer is refused.
        ///
        /// Pictures are then processed in order.
        @- max_rate_deg_s: Option<f64> = None, [above 0.0 to 1e6] { unset: "any", example: "100.0" };
        /// Largest part of the inliers that the given Sun does not light; 1 turns the gate off, and so does
        /// `body.sunlit = false`.
        @- max_unlit: f64 = 0.5, [0.0 to 1.0];
        /// Lowest elevation of the Sun that lights a limb, degrees; −18 is the end of twilight.
        @- min_sun_elevation_deg: f64 = -18.0, [-90.0 to 90.0];
        /// Smallest distance of the fitted half-angle from that of a body on the other side of the edge, in standard
        /// deviations.
        ///
        /// The curvature of the edge shows on which side the body is.
        @- min_side_sigma: f64 = 4.0, [0.0 to 1e6];
        /// Answers farther apart than this contradict each other, degrees.
        @- ambiguous_deg: f64 = 5.0, [0.0 to 180.0];
        /// Of answers that contradict each other, the better one counts where its score is better by this factor.
        @- ambiguous_score: f64 = 2.0, [1.0 to 1e6];
        /// An answer ends the search where its edge covers more than this part of the limb in view; `certain_share`
        /// must hold, too.
        @- certain_support: f64 = 0.5, [0.0 to 1.0];
        /// An answer ends the search where more than this part of its edge's points are inliers; `certain_support` must
        /// hold, too.
        ///
        /// An RMS below a quarter of the largest distance of an inlier replaces this condition.
        @- certain_share: f64 = 0.8, [0.0 to 1.0];
        /// [smallest, largest] half-angle of a Sun, as multiples of its true one.
        ///
        /// The Sun never looks smaller than it is, and it blooms.
        @- sun_size: [f64; 2] = [0.9, 12.0], [above 0.0 to 1e6];
        /// [smallest, largest] half-angle of a Moon, as multiples of its mean one.
        ///
        /// The saturated part of the Moon is smaller than the Moon, and the Moon is sometimes nearer than on average.
        @- moon_size: [f64; 2] = [0.5, 1.1], [above 0.0 to 1e6];
        /// Largest blooming by which a Moon may exceed `moon_size`, px.
        @- moon_bloom_px: f64 = 10.0, [0.0 to 1e6];
        /// Some of the limb of the expected half-angle about the fitted axis must lie in the picture.
        @- limb_in_view: bool = false, ["true or false"] { needs: "dlr" };
        /// Largest mean square distance of the points from the expected conic section, focal lengths squared.
        ///
        /// The distance is taken along the section's principal axis.
        @- max_section_residual: Option<f64> = None, [above 0.0] { needs: "dlr", unset: "any", example: "0.025" };
        /// [lowest, highest] altitude, km: the radius of the fitted circle must be that of a limb between them.
        ///
        /// At altitude 0 the limb is infinitely wide.
        @- altitude_limits_km: Option<[f64; 2]> = None, [0.0 to 1e9]
            { needs: "horace", unset: "any", example: "[0.0, 1000.0]" };
        /// With `altitude_limits_km`: the radius may lie beyond its limits by this part of them.
        @- radius_margin: f64 = 0.1, [0.0 to 1000.0] { needs: "horace" };
        /// With `altitude_limits_km`: the radius may lie beyond its limits by this length, px.
        ///
        /// HORACE's margin is 5000 px (Barf 2014, (2.35)).
        @- radius_margin_px: f64 = 0.0, [0.0 to 1e6] { needs: "horace" };
    }
}

impl Config {
    pub(crate) fn check(&self) -> Result<(), ConfigError> {
        self.check_keys()?;
        if let Some([low, high]) = self.altitude_limits_km {
            between("select.altitude_limits_km", high, low, 1e9)?;
        }
        for (name, [smallest, largest]) in [("select.sun_size", self.sun_size), ("select.moon_size", self.moon_size)] {
            between(name, largest, smallest, 1e6)?;
        }
        Ok(())
    }

    /// Turns off every gate that compares an edge with shapes other than a limb. This is for the presets that rebuild
    /// published systems.
    pub(crate) fn trust_every_shape(&mut self) {
        (self.max_rival_ratio, self.min_evidence, self.residual_floor_px) = (1e6, -1e6, 1e4);
        (self.min_support_abrupt, self.whole_edge) = (0.0, 0.0);
        (self.max_departure, self.max_band, self.max_unlit) = (1e6, 1.0, 1.0);
        self.max_attitude_sigma = 1e6;
    }
}

/// Result of the gates for a fit.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Judged<T> {
    /// `Passed`, or the gate that it failed.
    pub(crate) verdict: Verdict,
    /// Weighted RMS divided by the part of the limb in view that edge points cover; the smallest score wins.
    pub(crate) score: T,
    /// Part of the limb in view that edge points cover, 0 to 1.
    pub(crate) support: T,
}

/// Tests a fit with its inliers in `blocks`. `points` is the number of points of the edge. `raised` is the factor by
/// which the noise of the edge raises the threshold of the consensus; the largest RMS grows by the same factor.
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
    let least = config.min_inliers.min(small_disc_points(expected.sin, camera, 3)).min(small_picture_points(camera, 3));
    let counts = |n: u32| T::from_i32(n as i32);
    let verdict = if counts(fit.inliers) < counts(points) * T::from_f64(config.min_inlier_share) {
        Verdict::NoConsensus
    } else if fit.inliers < u32::from(least) {
        Verdict::FewInliers
    } else if covered_px < min_arc(&fused.c, camera, config) {
        Verdict::ShortArc
    } else if !(fit.rms_px <= T::from_f64(config.max_rms_px) * raised) {
        Verdict::Residuals
    } else if !(fused.chi2 <= chi * chi) || !is_possible_size(&fit.c, expected, camera, config) {
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
        check_surroundings(fused, expected, blocks, binary, camera, config)
    };
    let verdict = match verdict {
        Verdict::Passed => attitude::verdict(&fused.e, sigma_max_rad, expected, config),
        failed => failed,
    };
    let verdict = match verdict {
        Verdict::Passed => check_rivals(fit, fused, expected, blocks, points, support, binary, camera, config),
        failed => failed,
    };
    Judged { verdict, score: fit.rms_px.max(T::from_f64(0.05)) / support.max(T::from_f64(1e-3)), support }
}

/// Whether only a part of a winding edge is on the cone: this may happen by chance.
fn is_by_chance<T: Real>(fit: &Fit<T>, points: u32, covered_px: T, config: &Config) -> bool {
    let whole = T::from_i32(fit.inliers as i32) >= T::from_i32(points as i32) * T::from_f64(config.whole_edge);
    !whole && fit.arc_px > covered_px * T::from_f64(config.max_way)
}

/// Tests whether the sky is beyond the fitted limb, and the body is inside.
fn check_surroundings<T: Real, P: Pixels, O: Observer<T>>(
    fused: &Fused<T>,
    expected: &Expected<T>,
    blocks: &[Block<T>],
    binary: &BinaryPicture<'_, T, P, O>,
    camera: &Camera<T>,
    config: &Config,
) -> Verdict {
    let sky = sky::measure_sky(&fused.e, blocks, binary, camera);
    if sky.lit > T::from_f64(config.max_lit_sky) {
        return Verdict::NoSky;
    }
    if sun::unlit(&fused.e, fused.c, blocks, expected, config.min_sun_elevation_deg) > T::from_f64(config.max_unlit) {
        return Verdict::Sun;
    }
    // Of a picture that came row by row, only lit and dark pixels are left, and a terminator is as steep as an edge. A
    // disc that is whole in the picture may be a crescent, which is a band, too.
    let disc_px = disc_px(expected, camera);
    let wide = disc_px > T::from_i32(camera.width().min(camera.height()).into());
    let looks = !P::STREAMED && config.max_band < 1.0 && wide;
    let step = T::from_f64(config.band_step);
    if looks && band::banded(&fused.e, blocks, binary, camera, &sky, disc_px, step) >= T::from_f64(config.max_band) {
        return Verdict::Band;
    }
    Verdict::Passed
}

/// Returns the diameter of the body's disc, 2 α f, in pixels.
fn disc_px<T: Real>(expected: &Expected<T>, camera: &Camera<T>) -> T {
    let (fx, fy) = camera.focal_px();
    expected.half_angle_rad() * (fx + fy)
}

/// Tests whether the points belong to another curve. They pass if they fit the cone as well as other shapes, if they
/// agree with its half-angle within their own noise, and if the edge does not continue next to the cone.
fn check_rivals<T: Real, P: Pixels, O: Observer<T>>(
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
    // Log-likelihood ratio of the points for one curve over another: n ln(v/v').
    let likelier = |rms: T, than: T| {
        let v = rms.max(floor) / than.max(floor);
        independent * (v * v).ln()
    };
    if !(likelier(polyline::straight_rms(&shape), rms) > evidence) {
        return Verdict::Straight;
    }
    // No smooth curve can fit better than the noise from point to point.
    if rms > ratio * noise.max(floor) || likelier(rms, noise) > evidence {
        let worse = |rival: T| rms > ratio * rival.max(floor);
        if circle::rms(&shape).is_some_and(|c| worse(c) || (likelier(rms, c) > evidence && evidence > T::ZERO)) {
            return Verdict::Circle;
        }
        // The additional parameters of a polyline reduce its residual for any points. With too few points, the
        // comparison proves nothing.
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

/// Returns the smallest part of the limb in view that edge points must cover; 0 means no minimum for any body.
fn least_support<T>(config: &Config, expected: &Expected<T>) -> f64 {
    let whole = config.min_support > 0.0 && !expected.phases;
    if whole { config.min_support.max(config.min_support_whole) } else { config.min_support }
}

/// Whether a body with a free half-angle can appear with the half-angle of cosine `c`. Other bodies always pass,
/// because another gate compares them with the expected half-angle.
fn is_possible_size<T: Real>(c: &T, expected: &Expected<T>, camera: &Camera<T>, config: &Config) -> bool {
    let sin = (T::one() - *c * *c).max(T::ZERO).sqrt();
    let (fx, fy) = camera.focal_px();
    let px = T::one() / fx.min(fy);
    let times = |n: f64| expected.sin * T::from_f64(n);
    let (least, most) = if expected.blooms() {
        // The lower limit is reduced by one pixel, the error of the measurement, but never below half of its value.
        let [least, most] = config.sun_size;
        ((times(least) - px).max(times(least * 0.5)), times(most))
    } else {
        let [least, most] = config.moon_size;
        (times(least), times(most) + px * T::from_f64(config.moon_bloom_px))
    };
    !expected.free || (sin >= least && sin <= most.min(T::one()) && *c > T::ZERO)
}

/// Returns one `part`-th of the circumference of the body's disc in pixels, at least 8. A small body needs no more
/// points.
pub(crate) fn small_disc_points<T: Real>(sin: T, camera: &Camera<T>, part: i32) -> u16 {
    let (fx, fy) = camera.focal_px();
    let around = T::from_f64(core::f64::consts::PI) * (fx + fy) * sin;
    (around / T::from_i32(part)).to_i32().clamp(8, i32::from(u16::MAX)) as u16
}

/// Pictures with shorter sides than this are small, in pixels: an edge has fewer points there than the defaults
/// require.
const SMALL_PICTURE: u16 = 80;

/// Returns one `part`-th of the shorter side of a small picture in pixels, at least 8. In a thermal array of 24 rows, a
/// limb has no more points. Other pictures have no limit.
pub(crate) fn small_picture_points<T: Real>(camera: &Camera<T>, part: u16) -> u16 {
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

/// Returns up to `count` inliers, evenly along the edge, each from the middle of its part.
fn inliers<T: Real>(blocks: &[Block<T>], count: usize) -> impl Iterator<Item = (&Block<T>, usize)> {
    let all = || blocks.iter().flat_map(|b| (0..LANES).filter(|&l| b.weight[l & 7] > T::ZERO).map(move |l| (b, l)));
    let every = (all().count() / count.max(1)).max(1);
    all().skip(every / 2).step_by(every).take(count)
}

/// Number of inliers from which the gates look outwards and inwards.
const MAX_PLACES: usize = 12;

/// Distance from the limb at which the brightness on both sides is read for the threshold of the next picture, in
/// pixels.
const PLATEAU_PX: i32 = 6;

/// Returns the brightness halfway between both sides of the limb, in counts; `None` if the body is not brighter than
/// the sky.
pub(crate) fn middle_level<T: Real, P: Pixels, O: Observer<T>>(
    e: &V3<T>,
    blocks: &[Block<T>],
    binary: &BinaryPicture<'_, T, P, O>,
    camera: &Camera<T>,
) -> Option<u16> {
    let (mut dark, mut lit, mut looks) = (0u32, 0u32, 0u32);
    for (block, lane) in inliers(blocks, MAX_PLACES) {
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
