//! Gates and choice: decides whether a fitted cone is the limb of the body, and which of several cones is the answer.

mod attitude;
mod band;
mod circle;
mod config;
mod departure;
mod faint;
mod glow;
mod half_angle;
mod places;
mod polyline;
mod shape;
mod size;
mod sky;
mod sun;
mod view;

use crate::base::real::Real;
use crate::geometry::block::Block;
use crate::geometry::camera::Camera;
use crate::image::Pixels;
use crate::model::body::Expected;
use crate::model::observer::Observer;
use crate::model::verdict::Verdict;
use crate::stages::contour::BinaryPicture;
use crate::stages::covariance::Fused;
use crate::stages::fit::{self, Fit};
use places::{Places, along_limb, inliers};
use size::{disc_px, is_possible_size, lit_share, min_arc, min_support, sin_for_points};

pub use config::Config;
pub(crate) use places::middle_level;
pub(crate) use size::{small_disc_points, small_picture_points};

/// Result of the gates for a fit.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Judged<T> {
    /// `Passed`, or the gate that it failed.
    pub(crate) verdict: Verdict,
    /// Weighted RMS divided by the part of the limb in view that edge points cover; the smallest score wins.
    pub(crate) score: T,
    /// Part of the limb in view that edge points cover, 0 to 1.
    pub(crate) support: T,
    /// Whether light reaches higher above the limb than air does, see [`Verdict::Glow`]. The candidate stays in the
    /// choice, because another edge in the same glow is no better. If it wins, the picture has no answer.
    pub(crate) glows: bool,
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
    let limb_px = inliers(blocks, fit.inliers, 1)
        .next()
        .map_or(T::ZERO, |(b, l)| view::limb_in_view(&fused.e, fused.c, &b.ray(l), camera, binary.region));
    let covered_px = view::covered(&fused.e, blocks);
    let support = (covered_px / limb_px.max(T::one())).min(T::one());
    let sigma_limit = T::from_f64(config.max_sigma_deg.to_radians());
    let chi = T::from_f64(config.max_half_angle_sigma);
    let lit = T::from_f64(lit_share(expected));
    let least = config
        .min_inliers
        .min(small_disc_points(sin_for_points(fused, expected), camera, 3))
        .min(small_picture_points(camera, 3));
    let counts = |n: u32| T::from_i32(n as i32);
    let mut places = Places::new();
    let verdict = if counts(fit.inliers) < counts(points) * T::from_f64(config.min_inlier_share) {
        Verdict::NoConsensus
    } else if fit.inliers < u32::from(least) {
        Verdict::FewInliers
    } else if covered_px < min_arc(&fused.c, camera, config) * lit {
        Verdict::ShortArc
    } else if !(fit.rms_px <= T::from_f64(config.max_rms_px) * raised) {
        Verdict::Residuals
    } else if !(fused.chi2 <= chi * chi) || !is_possible_size(&fit.c, expected, camera, config) {
        Verdict::HalfAngle
    } else if !(sigma_max_rad <= sigma_limit) {
        Verdict::Uncertain
    } else if support < T::from_f64(min_support(config, expected)) * lit {
        Verdict::Unsupported
    } else if counts(fit.nearby) > counts(fit.inliers) * T::from_f64(config.max_nearby)
        || is_by_chance(fit, points, covered_px, config)
    {
        Verdict::Indistinct
    } else {
        judge_surroundings(fit, fused, expected, blocks, &mut places, binary, camera, config)
    };
    let verdict = match verdict {
        Verdict::Passed => attitude::verdict(&fused.e, sigma_max_rad, expected, config),
        failed => failed,
    };
    let verdict = match verdict {
        Verdict::Passed => judge_rivals(fit, fused, expected, blocks, points, support, binary, camera, config),
        failed => failed,
    };
    // Of a picture that came row by row, only lit and dark pixels are left.
    let looks = !P::STREAMED && verdict == Verdict::Passed;
    let glows = looks && glow::is_likely(&places, fused.c, binary, expected, T::from_f64(config.max_glow));
    Judged { verdict, score: fit.rms_px.max(T::from_f64(0.05)) / support.max(T::from_f64(1e-3)), support, glows }
}

/// Returns whether only a part of a winding edge is on the cone; this may happen by chance.
fn is_by_chance<T: Real>(fit: &Fit<T>, points: u32, covered_px: T, config: &Config) -> bool {
    let whole = T::from_i32(fit.inliers as i32) >= T::from_i32(points as i32) * T::from_f64(config.whole_edge);
    !whole && fit.arc_px > covered_px * T::from_f64(config.max_path)
}

/// Tests whether the sky is beyond the fitted limb and the body is inside it. The function fills `places` with the
/// places from which it looks.
fn judge_surroundings<T: Real, P: Pixels, O: Observer<T>>(
    fit: &Fit<T>,
    fused: &Fused<T>,
    expected: &Expected<T>,
    blocks: &[Block<T>],
    places: &mut Places<T>,
    binary: &BinaryPicture<'_, T, P, O>,
    camera: &Camera<T>,
    config: &Config,
) -> Verdict {
    let lit_from = if expected.free {
        (T::from_i32(binary.level.into()) * T::from_f64(config.dark_sky)).to_i32().max(1) as u16
    } else {
        binary.level
    };
    *places = along_limb(&fused.e, blocks, fit.inliers, camera);
    let sky = sky::measure_sky(places, binary, lit_from);
    if sky.lit > T::from_f64(config.max_lit_sky) {
        return Verdict::NoSky;
    }
    if sun::unlit(&fused.e, fused.c, blocks, expected, config.min_sun_elevation_deg) > T::from_f64(config.max_unlit) {
        return Verdict::Sun;
    }
    // Of a picture that came row by row, only lit and dark pixels are left, and a terminator is as steep as an edge.
    // Where bands are allowed, the inside of the limb may be as dark as the sky.
    if P::STREAMED || config.max_band >= 1.0 {
        return Verdict::Passed;
    }
    let disc_px = disc_px(expected, camera);
    if faint::is_faint(places, binary, disc_px) {
        return Verdict::Faint;
    }
    // A disc that is whole in the picture may be a crescent, which is a band, too.
    let wide = disc_px > T::from_i32(camera.width().min(camera.height()).into());
    let step = T::from_f64(config.band_step);
    if wide && band::banded(places, binary, &sky, disc_px, step) >= T::from_f64(config.max_band) {
        return Verdict::Band;
    }
    Verdict::Passed
}

/// Returns whether `fits` accepts a polyline in place of the cone. It gets the polyline's residual and the margin that
/// the additional parameters cost.
fn rivals_polyline<T: Real>(shape: &shape::Shape<T>, rms: T, independent: T, fits: impl Fn(T, T) -> bool) -> bool {
    // The additional parameters of a polyline reduce its residual for any points. With too few points, the comparison
    // proves nothing.
    let (points, turns) = (T::from_i32(shape.len() as i32), T::from_f64(polyline::PARAMETERS));
    let left = points - T::from_f64(3.0) - turns;
    left > T::ZERO && fits(polyline::rms(shape, rms) * ((left + turns) / left).sqrt(), independent.ln() * turns)
}

/// Tests whether the points belong to another curve. They pass if they fit the cone as well as other shapes, if they
/// agree with its half-angle within their own noise, and if the edge does not continue next to the cone.
fn judge_rivals<T: Real, P: Pixels, O: Observer<T>>(
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
    // Without a known distance, a part of any smooth curve, a ring or a shadow, is near some cone. Only the residuals
    // tell them apart: those of the body's own shape are noise, or less than half of the shift in the covariance.
    if expected.target().is_some_and(|target| target.range.is_none())
        && rms > ratio * noise.max(floor)
        && rms + rms > fused.edge.shift_px
    {
        return Verdict::Residuals;
    }
    // No smooth curve can fit better than the noise from point to point.
    if rms > ratio * noise.max(floor) || likelier(rms, noise) > evidence {
        let worse = |rival: T| rms > ratio * rival.max(floor);
        if circle::rms(&shape).is_some_and(|c| worse(c) || (likelier(rms, c) > evidence && evidence > T::ZERO)) {
            return Verdict::Circle;
        }
        if rivals_polyline(&shape, rms, independent, |rival, margin| {
            worse(rival) || (likelier(rms, rival) > evidence + margin && evidence > T::ZERO)
        }) {
            return Verdict::Polyline;
        }
    }
    if half_angle::disagrees(fit, fused, expected, blocks, config) {
        return Verdict::HalfAngle;
    }
    if !P::STREAMED
        && fit.inliers < points
        && departure::departs(blocks, [points, fit.inliers], &curve, noise, support, binary, camera, expected, config)
    {
        return Verdict::Departure;
    }
    Verdict::Passed
}
