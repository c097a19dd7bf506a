//! The evidence that an edge is the limb: what the fit, the picture and the prior say about it beyond the gates.
//!
//! The edges of ghosts end within the blur of the optics, and air decays by e over one scale height. A layer of airglow
//! has the ground below it, with a second edge of its own.

use super::case::Case;
use super::lens;
use super::places::{MAX_PLACES, Places, mean_brightness};
use super::profile::{LEAST, Light, Values};
use super::shape::Residuals;
use super::sky::Sky;
use super::turn::angle_rad;
use crate::base::median;
use crate::base::real::Real;
use crate::image::Pixels;
use crate::model::evidence::{Evidence, Term};
use crate::model::observer::Observer;
use crate::stages::contour::BinaryPicture;

/// Error of an edge point on a clean edge, in pixels: sampling and blur cause as much. It is the default of
/// `covariance.sigma_px`.
const CLEAN_PX: f64 = 0.1;
/// Variation of the height of the visible edge along one limb (1σ), in scale heights of the air: 1.1 km for the Earth.
///
/// Clouds and haze lie within the air, so that their heights scale with it. The residuals of limbs by day have a median
/// of 0.6 to 0.8 km, and nine of ten are below 1.9 km (the seeds of the fit). The sigma of the limb height is no
/// measure of this: it is the error of the mean height of the whole limb, and a calibration makes it smaller.
const ROUGHNESS_SCALE_HEIGHTS: f64 = 0.15;
/// Distance from the edge at which the light of the air is read, in scale heights.
const SCALE_HEIGHTS: f64 = 1.5;
/// Smallest scale height at which the air can be told from the blur, in pixels.
const LEAST_SCALE_HEIGHT_PX: f64 = 1.2;
/// Distance from the edge at which the body is read if the scale height is small, in pixels.
const INSIDE_PX: f64 = 6.0;
/// Distance from the edge at which the sky is dark, in scale heights; where it is below the distance of the nearest
/// place of [`Sky`], the median of the sky is dark.
const DARK_SCALE_HEIGHTS: f64 = 6.0;
const NEAREST_PX: f64 = 16.0;
/// Light of sunlit air above the sky, as a part of the step at the edge: at 1.5 scale heights (from, to), and at three
/// scale heights from which on it is no evidence. A saturated limb, 1 − exp(−τ) with τ = ln 2 at its mid-level, leaves
/// 0.14 and 0.034; an sRGB picture leaves 0.42 and 0.21. The blur adds to both.
const AIR: [f64; 2] = [0.25, 0.337];
const HIGH_AIR: f64 = 0.07;
/// Faintest light that counts, as a part of the step, because the counts are whole numbers.
const FAINTEST: [f64; 2] = [0.02, 0.01];
/// Step of the places below the edge, km, and the number of places; the first one is two steps below. The peak of the
/// airglow stands 85 to 105 km above the ground, and its edge up to 20 km higher.
const LAYER_STEP_M: f64 = 20e3;
const LAYER_PLACES: usize = 6;
/// Height of the highest peak, 105 km, in scale heights of 7.5 km.
const LAYER_SCALE_HEIGHTS: f64 = 14.0;
/// Smallest step that resolves a layer, in pixels.
const LEAST_STEP_PX: f64 = 2.0;
/// Second difference of the logarithm of the brightness that is usual below a limb by day.
const USUAL_BEND: f64 = 0.05;
/// Part of the false edges whose direction is that of the limb: ghosts that match it, and airglow. The fit of the
/// weights has the same part.
const FOLLOWING: f64 = 0.4;

/// Weighs the evidence. `None` if the picture is not of a kind for which the weights hold: without a fitted half-angle,
/// and for a body without known air, because the weights come from pictures of the Earth.
pub(super) fn weigh<T: Real, P: Pixels, O: Observer<T>>(
    case: &Case<'_, T>,
    binary: &BinaryPicture<'_, T, P, O>,
    places: &Places<T>,
    sky: &Sky<T>,
    residuals: &mut Residuals<'_, T>,
) -> Option<Evidence<T>> {
    let Case { fit, fused, expected, .. } = *case;
    let var_cos = fused.var_free_cos.filter(|_| !expected.free && expected.scale_height_m > T::ZERO)?;
    let (zero, one) = (T::ZERO, T::one());
    let mut evidence = Evidence::new();
    let significance = fit.c.min(fit.k + fit.k) / var_cos.sqrt();
    evidence.set(Term::Curvature, significance.max(one).ln().min(T::from_f64(5.0)));
    let off = fit.c - expected.cos;
    let z2 = expected.variance_towards(fit.c, one).map_or(zero, |prior| off * off / (var_cos + prior));
    evidence.set(Term::HalfAngle, z2.min(T::from_f64(9.0)));
    let inliers = T::from_i32(fit.inliers as i32) / T::from_i32(case.points.max(1) as i32);
    evidence.set(Term::Gaps, (one - case.cover.share) + (one - inliers).max(zero));
    evidence.set(Term::Misfit, misfit(case, places, residuals));
    // Of a picture that came row by row, only lit and dark pixels are left. A thermal picture shows no sunlit air.
    if !P::STREAMED && expected.is_in_sunlight {
        weigh_looks(case, binary, places, sky, &mut evidence);
    }
    if let Some((axis, sigma)) = &expected.predicted {
        // The density of the direction is Gaussian for a limb, and 1/(4π) for an edge that may give any direction.
        let variance = (*sigma * *sigma + case.sigma_max_rad * case.sigma_max_rad).max(T::EPSILON);
        let off = angle_rad(&fused.e, axis);
        let two = one + one;
        let most = (off * off / (two * variance)).min(T::from_f64(50.0));
        evidence.set(Term::Attitude, ln_ratio_of_direction(variance / two * most.exp()));
    }
    if expected.sun_seen.is_some() && case.config.max_unlit < 1.0 {
        // The Sun lights half of all directions, and this edge passed the gate.
        evidence.set(Term::Sun, ln_ratio_of_direction(T::from_f64(0.5)));
    }
    Some(evidence)
}

/// Weighs what the picture shows on both sides of the edge.
// Not inlined: its lists must not be on the stack while the lens is fitted.
#[inline(never)]
fn weigh_looks<T: Real, P: Pixels, O: Observer<T>>(
    case: &Case<'_, T>,
    binary: &BinaryPicture<'_, T, P, O>,
    places: &Places<T>,
    sky: &Sky<T>,
    evidence: &mut Evidence<T>,
) {
    Looks::new(case, binary, places, sky).weigh(binary, places, evidence);
}

/// Returns the logarithm of the residuals over those that a limb may have; 0 where a limb may have as large ones.
///
/// A limb departs from its cone by the noise from point to point, by the sampling, and by the roughness of clouds and
/// haze, which is a length at the limb and hence an angle of the picture: σ² = max(n, 0.1)² + (0.15 H/d)², with d
/// metres at the limb per pixel. Near the Earth a pixel is some kilometres, and clouds cause residuals of a pixel.
/// Where the Earth is a small disc, a pixel is hundreds of kilometres: no limb departs from its cone by a pixel there,
/// but a chance curve does.
///
/// What the stated errors of the lens bend is taken out first. A lens that is known exactly has no such part.
fn misfit<T: Real>(case: &Case<'_, T>, places: &Places<T>, residuals: &mut Residuals<'_, T>) -> T {
    let own_px = residuals.rms_px;
    let rms_px = lens::without_lens(case, residuals, |_, bent| bent.rms_px.min(own_px)).unwrap_or(own_px);
    let scale_px = places
        .get(places.len() / 2)
        .map_or(T::ZERO, |middle| case.expected.scale_height_m * case.cos_by_m() / middle.by_px);
    let rough = scale_px * T::from_f64(ROUGHNESS_SCALE_HEIGHTS);
    let noise = residuals.noise_px.max(T::from_f64(CLEAN_PX));
    (rms_px / (noise * noise + rough * rough).sqrt()).max(T::one()).ln()
}

/// Returns the logarithm of the likelihood ratio of a direction. `against` is the likelihood of an edge that may give
/// any direction over that of the limb.
///
/// The direction is no evidence against edges that follow the limb.
fn ln_ratio_of_direction<T: Real>(against: T) -> T {
    let along = T::from_f64(FOLLOWING);
    -(along + (T::one() - along) * against).ln()
}

/// What the picture shows on both sides of the edge.
struct Looks<T> {
    light: Light<T>,
    /// Whether the brightness of the sky is known.
    shows_air: bool,
    /// Whether the camera is so high that a layer of airglow has a limb.
    is_above_layer: bool,
}

impl<T: Real> Looks<T> {
    fn new<P: Pixels, O: Observer<T>>(
        case: &Case<'_, T>,
        binary: &BinaryPicture<'_, T, P, O>,
        places: &Places<T>,
        sky: &Sky<T>,
    ) -> Self {
        let expected = case.expected;
        let (altitude_m, _) = expected.altitude_and_sigma_m();
        let looks = Self {
            light: Light { by_m: case.cos_by_m(), scale_height_m: expected.scale_height_m, sky: sky.median },
            shows_air: true,
            is_above_layer: altitude_m > expected.scale_height_m * T::from_f64(LAYER_SCALE_HEIGHTS),
        };
        let Some(middle) = places.get(places.len() / 2) else { return looks };
        let dark_px = looks.light.scale_px(middle) * T::from_f64(DARK_SCALE_HEIGHTS);
        if dark_px <= T::from_f64(NEAREST_PX) {
            return looks;
        }
        let mut far = heapless::Vec::<u16, MAX_PLACES>::new();
        for place in places {
            let _ = mean_brightness(place, -dark_px, binary).map(|b| far.push(b));
        }
        let shows_air = far.len() >= LEAST;
        let sky = if shows_air { T::from_i32(median::median_of_counts(&far).into()) } else { looks.light.sky };
        Self { light: Light { sky, ..looks.light }, shows_air, ..looks }
    }

    fn weigh<P: Pixels, O: Observer<T>>(
        &self,
        binary: &BinaryPicture<'_, T, P, O>,
        places: &Places<T>,
        evidence: &mut Evidence<T>,
    ) {
        let (mut body, mut air, mut high) = (Values::new(), Values::new(), Values::new());
        for place in places {
            let scale_px = self.light.scale_px(place);
            let off = scale_px * T::from_f64(SCALE_HEIGHTS);
            let shown = self.shows_air && scale_px >= T::from_f64(LEAST_SCALE_HEIGHT_PX);
            let inside = off.max(T::from_f64(if shown { 0.0 } else { INSIDE_PX }));
            let Some(step) = self.light.above_sky(place, inside, binary) else { continue };
            let _ = body.push(step.max(T::ZERO));
            let part = |light: T| (light / step.max(T::one())).max(T::ZERO);
            if shown && let Some(light) = self.light.above_sky(place, -off, binary) {
                let _ = air.push(part(light));
                let _ = self.light.above_sky(place, -(off + off), binary).map(|light| high.push(part(light)));
            }
        }
        if self.shows_air && body.len() >= LEAST {
            let most = body.iter().fold(T::one(), |most, x| most.max(*x));
            let body = median::median_of_reals(&body, most);
            evidence.set(Term::Sky, (self.light.sky / (self.light.sky + body).max(T::one())).max(T::ZERO));
            self.light.mottled_sky(body, binary, places).iter().for_each(|x| evidence.set(Term::MottledSky, *x));
        }
        let ln_of = |values: &Values<T>, faintest: f64, usual: f64| {
            let part = (values.len() >= LEAST).then(|| median::median_of_reals(values, T::one()))?;
            Some((part.max(T::from_f64(faintest)) / T::from_f64(usual)).ln())
        };
        if let Some(ln) = ln_of(&air, FAINTEST[0], AIR[0]) {
            evidence.set(Term::FaintAir, ln.min(T::ZERO));
            evidence.set(Term::BrightAir, (ln - T::from_f64((AIR[1] / AIR[0]).ln())).max(T::ZERO));
        }
        if let Some(ln) = ln_of(&high, FAINTEST[1], HIGH_AIR) {
            evidence.set(Term::FaintHighAir, ln.min(T::ZERO));
        }
        if self.is_above_layer
            && let Some(bend) = self.common_bend(binary, places)
        {
            let usual = T::from_f64(USUAL_BEND);
            evidence.set(Term::Layer, ((usual + bend.min(T::one())) / usual).ln());
            self.light.second_edge(binary, places).iter().for_each(|x| evidence.set(Term::SecondEdge, *x));
        }
        self.light.flatness(binary, places).iter().for_each(|x| evidence.set(Term::Flat, *x));
    }

    /// Returns the bend of the profile of the brightness below the edge that all places share: the largest value that
    /// the second difference of ln b reaches at every place, at the same depth and with the same sign. `None` if the
    /// picture does not resolve the depths.
    ///
    /// Clouds bend the profile differently at each place. Every second place is read, and the reads end when no common
    /// bend is left.
    fn common_bend<P: Pixels, O: Observer<T>>(
        &self,
        binary: &BinaryPicture<'_, T, P, O>,
        places: &Places<T>,
    ) -> Option<T> {
        const BENDS: usize = LAYER_PLACES - 2;
        let one = T::one();
        // The smallest bend upwards and downwards at each depth, and the number of places that show it.
        let mut common = [([T::from_f64(9.0); 2], 0); BENDS];
        for place in places.iter().step_by(2) {
            let step_px = T::from_f64(LAYER_STEP_M) * self.light.by_m / place.by_px;
            if !(step_px > T::from_f64(LEAST_STEP_PX)) {
                continue;
            }
            let light =
                |k: i32| self.light.above_sky(place, step_px * T::from_i32(k), binary).map(|light| light.max(one));
            let (Some(mut before), Some(mut here)) = (light(2), light(3)) else { continue };
            for (k, (least, looks)) in (4..).zip(&mut common) {
                let Some(after) = light(k) else { break };
                // ln b₁ − 2 ln b₂ + ln b₃ is ln(b₁ b₃/b₂²), nearly its argument less 1.
                let bend = before * after / (here * here) - one;
                *least = [least[0].min(bend), least[1].min(-bend)];
                *looks += 1;
                (before, here) = (here, after);
            }
            if common.iter().all(|(least, _)| !least.iter().any(|bend| *bend > T::ZERO)) {
                return Some(T::ZERO);
            }
        }
        let shown = common.iter().filter(|(_, looks)| *looks >= LEAST);
        shown.flat_map(|(least, _)| least).copied().reduce(T::max).map(|bend| bend.max(T::ZERO))
    }
}
