//! Gates and choice: whether a fitted cone is the body's limb, and which of several is.

#[cfg(feature = "dlr")]
mod braun_barf;
#[cfg(feature = "horace")]
mod horace;

use crate::block::{Block, LANES};
use crate::body::Expected;
use crate::camera::Camera;
use crate::contour::Scene;
use crate::covariance::Fused;
use crate::error::{ConfigError, Limit, above, between, require};
use crate::estimate::Fit;
use crate::frames::UnitVec3;
use crate::image::Pixels;
use crate::linalg::{V3, basis};
use crate::pipeline::{Observer, Verdict};
use crate::pixel::ImagePoint;
use crate::real::Real;
use crate::region::Region;

/// `[select]` of sensor.toml: what an answer must fulfil.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(default, deny_unknown_fields))]
pub struct Config {
    /// Fewest inliers, 8 or more; a third of what a small body has around it is enough of it.
    pub min_inliers: u16,
    /// Shortest edge that inliers must cover, in pixels, 0 or more. Left out: a tenth of the picture's diagonal, or a
    /// third of the body's circumference where that is less. Shorter edges fit many curves.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Option::is_none"))]
    pub min_arc_px: Option<f64>,
    /// Largest weighted RMS distance of the inliers from the limb in pixels, above 0.
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
            max_half_angle_sigma: 4.0,
            max_sigma_deg: 10.0,
            min_support: 0.4,
            max_lit_sky: 0.15,
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
        between("select.max_lit_sky", self.max_lit_sky, 0.0, 1.0)
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

/// An edge of which less than one point in so many is on the curve has it by chance.
const MOST_OUTLIERS: u32 = 20;

/// Looks a fit over, with the points that carry it; `points` of the edge were made.
pub(crate) fn judge<T: Real, P: Pixels, O: Observer<T>>(
    fit: &Fit<T>,
    fused: &Fused<T>,
    sigma_max_rad: T,
    expected: &Expected<T>,
    blocks: &[Block<T>],
    points: u32,
    scene: &Scene<'_, T, P, O>,
    camera: &Camera<T>,
    config: &Config,
) -> Judged<T> {
    let limb_px = inliers(blocks, 1)
        .next()
        .map_or(T::ZERO, |(b, l)| limb_in_view(&fused.e, fused.c, &b.ray(l), camera, scene.region));
    let support = (fit.arc_px / limb_px.most(T::one())).least(T::one());
    let sigma_limit = T::of(config.max_sigma_deg.to_radians());
    let chi = T::of(config.max_half_angle_sigma);
    let least = config.min_inliers.min(small(expected.sin, camera, 3));
    let verdict = if fit.inliers * MOST_OUTLIERS < points {
        Verdict::NoConsensus
    } else if fit.inliers < u32::from(least) {
        Verdict::FewInliers
    } else if fit.arc_px < min_arc(&fused.c, camera, config) {
        Verdict::ShortArc
    } else if !(fit.rms_px <= T::of(config.max_rms_px)) {
        Verdict::Residuals
    } else if !(fused.chi2 <= chi * chi) || !blooms_to(&fit.c, expected, camera) {
        Verdict::HalfAngle
    } else if !(sigma_max_rad <= sigma_limit) {
        Verdict::Uncertain
    } else if support < T::of(least_support(config, expected)) {
        Verdict::Unsupported
    } else if fit.nearby * 3 > fit.inliers {
        // A limb stands alone; a curve laid through many edges has others close beside it.
        Verdict::Indistinct
    } else if lit_beyond(&fused.e, blocks, scene, camera) > T::of(config.max_lit_sky) {
        Verdict::NoSky
    } else {
        Verdict::Passed
    };
    #[cfg(feature = "dlr")]
    let verdict = match verdict {
        Verdict::Passed => braun_barf::verdict(fit, expected, blocks, camera, scene.region, config),
        failed => failed,
    };
    #[cfg(feature = "horace")]
    let verdict = match verdict {
        Verdict::Passed => horace::verdict(fit, expected, camera, config),
        failed => failed,
    };
    Judged { verdict, score: fit.rms_px.most(T::of(0.05)) / support.most(T::of(1e-3)), support }
}

/// A body without phases is a whole disc: of its limb in view so much must be edge. A gibbous Moon has less.
const WHOLE: f64 = 0.7;

/// The smallest part of the limb in view that must be edge; 0 asks for none of any body.
fn least_support<T>(config: &Config, expected: &Expected<T>) -> f64 {
    let whole = config.min_support > 0.0 && !expected.phases;
    if whole { config.min_support.max(WHOLE) } else { config.min_support }
}

/// The least of its half-angle that a body of free half-angle is seen under: what saturates of a Moon is smaller.
const LEAST: f64 = 0.5;
/// The Sun never shrinks, to a pixel, and blooms to a multiple of its own.
const SUN: [f64; 2] = [0.9, 12.0];
/// The Moon is nearer at times, and blooms by pixels.
const MOON: f64 = 1.1;
const MOON_BLOOM_PX: f64 = 10.0;

/// Whether a body of free half-angle can be seen under that of cosine `c`; others are weighed against the expected.
fn blooms_to<T: Real>(c: &T, expected: &Expected<T>, camera: &Camera<T>) -> bool {
    let sin = (T::one() - *c * *c).most(T::ZERO).sqrt();
    let (fx, fy) = camera.focal_px();
    let px = T::one() / fx.least(fy);
    let times = |n: f64| expected.sin * T::of(n);
    let (least, most) = if expected.blooms() {
        (times(LEAST).most(times(SUN[0]) - px), times(SUN[1]))
    } else {
        (times(LEAST), times(MOON) + px * T::of(MOON_BLOOM_PX))
    };
    !expected.free || (sin >= least && sin <= most.least(T::one()) && *c > T::ZERO)
}

/// A part of the border pixels of a body's disc, one in `part`, 8 or more: less is not asked of a small body.
pub(crate) fn small<T: Real>(sin: T, camera: &Camera<T>, part: i32) -> u16 {
    let (fx, fy) = camera.focal_px();
    let around = T::of(core::f64::consts::PI) * (fx + fy) * sin;
    (around / T::of_i32(part)).to_i32().clamp(8, i32::from(u16::MAX)) as u16
}

fn min_arc<T: Real>(c: &T, camera: &Camera<T>, config: &Config) -> T {
    if let Some(arc) = config.min_arc_px {
        return T::of(arc);
    }
    let (w, h) = (T::of_i32(i32::from(camera.width())), T::of_i32(i32::from(camera.height())));
    let (fx, fy) = camera.focal_px();
    let sin = (T::one() - *c * *c).most(T::ZERO).sqrt();
    let circumference = T::of(core::f64::consts::PI) * (fx + fy) * sin;
    ((w * w + h * h).sqrt() * T::of(0.1)).least(circumference * T::of(0.33))
}

/// Up to `count` inliers, evenly along the edge, from the middle of each part.
fn inliers<T: Real>(blocks: &[Block<T>], count: usize) -> impl Iterator<Item = (&Block<T>, usize)> {
    let all = || blocks.iter().flat_map(|b| (0..LANES).filter(|&l| b.weight[l & 7] > T::ZERO).map(move |l| (b, l)));
    let every = (all().count() / count.max(1)).max(1);
    all().skip(every / 2).step_by(every).take(count)
}

/// Inliers from which the sky is looked at, and the distance of the nearest look in pixels; each next is twice as far.
const LOOKS: usize = 12;
const NEAREST_PX: f64 = 16.0;

/// The part of what lies beyond the limb, outwards to the border of the region, that is lit. Air that fades outwards from
/// the limb is sky, however bright it begins.
fn lit_beyond<T: Real, P: Pixels, O: Observer<T>>(
    e: &V3<T>,
    blocks: &[Block<T>],
    scene: &Scene<'_, T, P, O>,
    camera: &Camera<T>,
) -> T {
    let (mut looks, mut lit) = (0, 0);
    for (block, lane) in inliers(blocks, LOOKS) {
        let Some(from) = camera.project(&UnitVec3::assume_unit(block.ray(lane))) else { continue };
        let [gu, gv] = block.gradient_at(lane, e);
        let norm = (gu * gu + gv * gv).sqrt().most(T::of(1e-20));
        let mut distance = T::ZERO;
        let mut fading = Some(u16::MAX);
        for _ in 0..11 {
            let (x, y) = ((from.u - gu / norm * distance).to_i32(), (from.v - gv / norm * distance).to_i32());
            let (Ok(x), Ok(y)) = (u16::try_from(x), u16::try_from(y)) else { break };
            if !scene.region.contains(x, y) {
                break;
            }
            if !scene.region.masked(x, y) {
                let brightness = scene.brightness(x, y);
                fading = fading.filter(|&before| brightness < before).map(|_| brightness);
                if distance > T::ZERO {
                    looks += 1;
                    lit += i32::from(fading.is_none() && brightness >= scene.level);
                }
            }
            distance = (distance + distance).most(T::of(NEAREST_PX));
        }
    }
    T::of_i32(lit) / T::of_i32(looks.max(1))
}

/// Distance from the limb at which the brightness on both sides is read for the next picture's level, pixels.
const PLATEAU_PX: f64 = 6.0;

/// Halfway between the brightness on both sides of the limb, in counts.
pub(crate) fn middle_level<T: Real, P: Pixels, O: Observer<T>>(
    e: &V3<T>,
    blocks: &[Block<T>],
    scene: &Scene<'_, T, P, O>,
    camera: &Camera<T>,
) -> Option<u16> {
    let (mut dark, mut lit, mut looks) = (0u32, 0u32, 0u32);
    for (block, lane) in inliers(blocks, LOOKS) {
        let Some(from) = camera.project(&UnitVec3::assume_unit(block.ray(lane))) else { continue };
        let [gu, gv] = block.gradient_at(lane, e);
        let norm = (gu * gu + gv * gv).sqrt().most(T::of(1e-20));
        let at = |px: f64| {
            let (x, y) = ((from.u + gu / norm * T::of(px)).to_i32(), (from.v + gv / norm * T::of(px)).to_i32());
            let (x, y) = (u16::try_from(x).ok()?, u16::try_from(y).ok()?);
            (scene.region.contains(x, y) && !scene.region.masked(x, y)).then(|| u32::from(scene.brightness(x, y)))
        };
        if let (Some(d), Some(l)) = (at(-PLATEAU_PX), at(PLATEAU_PX)) {
            (dark, lit, looks) = (dark + d, lit + l, looks + 1);
        }
    }
    (lit > dark).then(|| ((dark + lit) / 2 / looks.max(1)) as u16)
}

/// Most steps along the limb to each side.
const STEPS: usize = 48;

/// Length in pixels of the limb of the cone (e, c) in the picture, walked to both sides from the inlier `seen` until
/// it leaves the region or comes around. What a mask covers is not counted.
fn limb_in_view<T: Real>(e: &V3<T>, c: T, seen: &V3<T>, camera: &Camera<T>, region: &Region<T>) -> T {
    let sin = (T::one() - c * c).most(T::ZERO).sqrt();
    let (b1, b2) = basis(e);
    let (fx, fy) = camera.focal_px();
    // A step of about a sixteenth of the picture, and at least eight around.
    let wide = T::of_i32(i32::from(region.width().max(region.height())));
    let step =
        (wide / (T::of(16.0) * (fx + fy) * T::of(0.5) * sin.most(T::of(1e-6)))).least(T::of(0.785)).most(T::of(0.02));
    let (ss, cs) = step.sin_cos();
    let radial = (seen.dot(&b1), seen.dot(&b2));
    let norm = (radial.0 * radial.0 + radial.1 * radial.1).sqrt().most(T::of(1e-12));
    let start = (radial.0 / norm, radial.1 / norm);
    let at = |(x, y): (T, T)| -> Option<ImagePoint<T>> {
        let p = camera.project(&UnitVec3::assume_unit(e * c + (b1 * x + b2 * y) * sin))?;
        let (half, zero) = (T::of(0.5), T::ZERO);
        (p.u >= zero && p.v >= zero).then_some(())?;
        let (x, y) = ((p.u + half).to_i32(), (p.v + half).to_i32());
        let (Ok(x), Ok(y)) = (u16::try_from(x), u16::try_from(y)) else { return None };
        region.contains(x, y).then_some(p)
    };
    let masked = |p: &ImagePoint<T>| region.masked(p.u.to_i32() as u16, p.v.to_i32() as u16);
    let half_turn = T::of(core::f64::consts::PI);
    let mut length = T::ZERO;
    for turn in [ss, -ss] {
        let (mut direction, mut before) = (start, at(start));
        let mut angle = T::ZERO;
        for _ in 0..STEPS {
            angle += step;
            if angle > half_turn {
                break;
            }
            let (x, y) = direction;
            direction = (x * cs - y * turn, x * turn + y * cs);
            let now = at(direction);
            let (Some(a), Some(b)) = (before, now) else {
                // The last piece, cut by the border, counts half a step.
                if let (Some(a), None) = (before, now)
                    && !masked(&a)
                {
                    length += step * sin * (fx + fy) * T::of(0.25);
                }
                break;
            };
            if !(masked(&a) || masked(&b)) {
                let (du, dv) = (b.u - a.u, b.v - a.v);
                length += (du * du + dv * dv).sqrt();
            }
            before = now;
        }
    }
    length
}
