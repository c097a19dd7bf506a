//! The limb height that a head has for itself: its error in the free fit of the head.

use core::f64::consts::TAU;

use super::head::{symmetric, upper};
use crate::base::linalg::{M3, V3, basis, invert_spd3};
use crate::base::real::Real;
use crate::geometry::camera::Camera;
use crate::geometry::frames::{Cam, Cov3, UnitVec3};
use crate::model::body::tilt_km;
use crate::model::report::{Free, FreeCommon};

/// Largest distance of two azimuths at which the height is taken: 5 degrees, which is 250 km or less for a low orbit
/// and finer than the weather.
const STEP_RAD: f64 = TAU / 72.0;

/// Smallest number of azimuths on an arc. The discrete sums then differ by less than 1% from the integrals.
const FEWEST: usize = 24;

/// Number of azimuths at which arcs in view are searched. If there is none, the search is finer: an arc shorter than
/// half a degree has too few edge points for an answer. Most pictures need the first search only, which saves half of
/// the time of a joint answer.
const SCANS: [usize; 2] = [180, 720];

/// Shortest arc, four degrees. A fit to a shorter arc takes up the same part of the weather, the height with its first
/// and second derivative, so that the error has a limit. At ten degrees it is 3% from the limit. The sums of an arc of
/// one degree would cancel to the last digits of an `f32`.
const SHORTEST_RAD: f64 = TAU / 90.0;

/// Most arcs of a limb in a picture: a circle crosses the four borders at most eight times.
const MOST_ARCS: usize = 4;

type Arcs<T> = heapless::Vec<[T; 2], MOST_ARCS>;

/// Most azimuths, if one of these arcs is nearly a circle.
const MOST: usize = 72 + MOST_ARCS * FEWEST;

/// What is known of the limb that all heads see.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limb<T> {
    /// Distance of the limb from the centre of the body, kilometres.
    pub radius_km: T,
    /// 1σ of a tilt of the limb, kilometres; `None` derives it from the half-angle, see [`tilt_km`].
    pub tilt_sigma_km: Option<T>,
    /// 1σ of the height that each head has for itself, kilometres: the weather of its part of the limb.
    pub own_sigma_km: T,
    /// Distance along the limb at which the correlation of that height has fallen to exp(−½), kilometres.
    pub own_length_km: T,
}

impl<T: Real> Limb<T> {
    /// The usual value of `own_sigma_km`: weather moves the half level of an infrared limb by 1 to 2 km from place to
    /// place.
    pub const OWN_SIGMA_KM: f64 = 1.5;
    /// The usual value of `own_length_km`: weather systems are about 1000 km long.
    pub const OWN_LENGTH_KM: f64 = 1000.0;

    /// Returns the 1σ of the axis that a tilt of the limb causes, in radians: the tilt times the derivative of the
    /// half-angle by the height, tan α/(R + d).
    pub(super) fn tilt_rad(&self, cos: T) -> T {
        let sin = (T::one() - cos * cos).max(T::ZERO).sqrt();
        let km = self.tilt_sigma_km.unwrap_or_else(|| tilt_km(sin.atan2(cos)));
        if cos > T::ZERO && self.radius_km > T::ZERO { km * sin / (cos * self.radius_km) } else { T::ZERO }
    }

    /// Returns the free fit with the error of the limb's weather: a random height at the part of the limb that the
    /// camera sees.
    ///
    /// A height h(ψ) moves the edge at the azimuth ψ outward by h ∂α/∂d. Least squares over the arc takes it for errors
    /// of the axis and of the cosine: with the rows g = (sin α cos ψ, sin α sin ψ, −1) and the widths of the parts of
    /// the arc as weights W, the error is (GᵀWG)⁻¹ GᵀW sin α ∂α/∂d h. On a short arc, a height that changes along the
    /// arc moves the free fit far more than a constant one.
    pub fn with_weather(&self, free: &Free<T>, camera: &Camera<T>) -> Free<T> {
        let (one, cos) = (T::one(), free.cos);
        let sin = (one - cos * cos).max(T::ZERO).sqrt();
        if !(self.own_sigma_km > T::ZERO && cos > T::ZERO && sin > T::ZERO && self.radius_km > T::ZERO) {
            return *free;
        }
        // sin α ∂α/∂d times the height.
        let by_height = self.own_sigma_km * sin * sin / (cos * self.radius_km);
        let (b1, b2) = basis(free.axis.v());
        let edge = Edge { camera, e: *free.axis.v(), b: [b1, b2], cos, sin };
        let arcs = edge.arcs();
        let middle = arcs.first().zip(arcs.last()).map_or(T::ZERO, |(a, b)| (a[0] + b[1]) * T::from_f64(0.5));
        let chords = self.radius_km * cos * T::from_f64(2.0) / self.own_length_km;
        let mut own = *free;
        // Without an arc the height is taken as a constant.
        let constant = || M3::from_diagonal(&V3::new(T::ZERO, T::ZERO, one));
        let p = taken_up(&arcs, middle, sin, chords).unwrap_or_else(constant) * (by_height * by_height);
        let (s, c) = middle.sin_cos();
        // The directions to the middle of the arcs and along them.
        let (to, along) = (b1 * c + b2 * s, b2 * c - b1 * s);
        let both = to * along.transpose();
        let added = to * to.transpose() * p.m11 + (both + both.transpose()) * p.m12 + along * along.transpose() * p.m22;
        let axis = |free: &Cov3<Cam, T>| Cov3::from_upper(upper(&(symmetric(&free.upper_rad2) + added)));
        let moved = to * p.m13 + along * p.m23;
        let with_cos = |[x, y, z]: [T; 3]| [x + moved.x, y + moved.y, z + moved.z];
        own.covariance = axis(&free.covariance);
        own.axis_with_cos = free.axis_with_cos.map(with_cos);
        own.var_cos += p.m33;
        // Pictures that are less than a length of the weather apart see the same weather, so that all of it is common.
        // That is too much for a slow sequence, and never too little.
        own.common = free.common.map(|common| FreeCommon {
            covariance: axis(&common.covariance),
            var_cos: common.var_cos + p.m33,
            axis_with_cos: with_cos(common.axis_with_cos),
        });
        own
    }
}

/// Returns the covariance of what the fit takes up of a height with the 1σ 1, on the axis towards the middle of the
/// arcs, the axis along them, and the cosine. `chords` is the diameter of the limb in lengths of the weather. `None` if
/// the arcs do not determine three unknowns.
///
/// The unknowns of the sums are the factors of 1, sin δ and 1 − cos δ, each divided by its largest value, with δ from
/// the middle: a short arc then loses no digits.
fn taken_up<T: Real>(arcs: &[[T; 2]], middle: T, sin: T, chords: T) -> Option<M3<T>> {
    let (one, half, two) = (T::one(), T::from_f64(0.5), T::from_f64(2.0));
    // The number of the arc, δ, and a row of G with its weight.
    let mut seen = heapless::Vec::<(usize, T, V3<T>), MOST>::new();
    let (mut scale_sin, mut scale_cos) = (T::ZERO, T::ZERO);
    for (arc, &[from, to]) in arcs.iter().enumerate() {
        let count = ((to - from) / T::from_f64(STEP_RAD)).to_i32().saturating_add(1).max(FEWEST as i32);
        let width = (to - from) / T::from_i32(count);
        for i in 0..count {
            let delta = from - middle + (T::from_i32(i) + half) * width;
            let s = delta.sin();
            let h = (delta * half).sin();
            let versine = two * h * h;
            (scale_sin, scale_cos) = (scale_sin.max(s.abs()), scale_cos.max(versine));
            // There is room for all of them, see `MOST`.
            let _ = seen.push((arc, delta, V3::new(width, s, versine)));
        }
    }
    let scaled = |row: &V3<T>| V3::new(one, row.y / scale_sin, row.z / scale_cos);
    let normal = seen.iter().fold(M3::zeros(), |sum, (.., row)| sum + scaled(row) * scaled(row).transpose() * row.x);
    let inverse = invert_spd3(&upper(&normal))?;
    for (.., row) in &mut seen {
        *row = inverse * scaled(row) * row.x;
    }
    let both = |a: T, b: T| {
        let chord = ((a - b) * half).sin();
        let chord = chords * chord;
        (-half * chord * chord).exp()
    };
    // The azimuths of an arc are equally far from each other, so that their correlations are those with its first one.
    let mut p = M3::zeros();
    let (mut start, mut lags) = (0, heapless::Vec::<T, MOST>::new());
    for (i, (arc, a, gain)) in seen.iter().enumerate() {
        if seen.get(start).is_none_or(|(own, ..)| own != arc) {
            start = i;
            lags.clear();
        }
        let first = seen.get(start).map_or(*a, |(_, first, _)| *first);
        let _ = lags.push(both(*a, first));
        let mut before = V3::zeros();
        for (_, b, other) in seen.iter().take(start) {
            before += other * both(*a, *b);
        }
        for ((.., other), lag) in seen.iter().take(i).skip(start).zip(lags.iter().rev()) {
            before += other * *lag;
        }
        let cross = gain * before.transpose();
        p += gain * gain.transpose() + cross + cross.transpose();
    }
    // sin α (x cos δ + y sin δ) − z equals the sum of the three terms.
    let (x, y) = (-one / (scale_cos * sin), one / (scale_sin * sin));
    let zero = T::ZERO;
    let from_terms = M3::new(zero, zero, x, zero, y, zero, -one, zero, -one / scale_cos);
    Some(from_terms * p * from_terms.transpose())
}

/// The edge of a cone in a picture.
struct Edge<'a, T> {
    camera: &'a Camera<T>,
    e: V3<T>,
    b: [V3<T>; 2],
    cos: T,
    sin: T,
}

impl<T: Real> Edge<'_, T> {
    /// Returns whether the picture has the edge at this azimuth.
    fn is_in_view(&self, psi: T) -> bool {
        let (s, c) = psi.sin_cos();
        self.is_at(s, c)
    }

    /// Returns the same for the sine and the cosine of an azimuth.
    fn is_at(&self, s: T, c: T) -> bool {
        let ray = self.e * self.cos + (self.b[0] * c + self.b[1] * s) * self.sin;
        let point = self.camera.project(&UnitVec3::<Cam, T>::assume_unit(ray));
        let half = T::from_f64(0.5);
        let inside = |x: T, size: u16| x >= -half && x <= T::from_i32(size.into()) - half;
        point.is_some_and(|p| inside(p.u, self.camera.width()) && inside(p.v, self.camera.height()))
    }

    /// Returns a function that says whether the picture has the edge at the azimuth `first`, at its second call at
    /// `first + step`, and so on.
    ///
    /// It turns the direction by the step. The sine and the cosine of every azimuth would be two thirds of a joint
    /// answer on a Cortex-M4F, because libm computes them in double precision. Rounding adds up to less than 1e-4 rad
    /// in an `f32`, and [`Self::end`] finds the ends of the arcs with the azimuth itself.
    fn in_turn(&self, first: T, step: T) -> impl FnMut() -> bool {
        let ((mut s, mut c), (step_s, step_c)) = (first.sin_cos(), step.sin_cos());
        move || {
            let is_in_view = self.is_at(s, c);
            (s, c) = (s * step_c + c * step_s, c * step_c - s * step_s);
            is_in_view
        }
    }

    /// Returns the arcs in view as pairs of azimuths, in rising order, within one turn.
    fn arcs(&self) -> Arcs<T> {
        let mut arcs = Arcs::new();
        for scan in SCANS {
            arcs = self.search(scan);
            if !arcs.is_empty() {
                return arcs;
            }
        }
        // An arc that is not in view is taken as a short one on the side of the optical axis.
        let middle = self.b[1].z.atan2(self.b[0].z);
        let half = T::from_f64(0.5 * SHORTEST_RAD);
        let _ = arcs.push([middle - half, middle + half]);
        arcs
    }

    /// Searches for arcs in view at a number of azimuths.
    fn search(&self, scan: usize) -> Arcs<T> {
        let mut arcs = Arcs::new();
        let step = T::from_f64(TAU / scan as f64);
        // The scan begins opposite the optical axis, so that an arc seldom lies across its ends, and that nothing
        // depends on the choice of the tangent vectors.
        let opposite = (-self.b[1].z).atan2(-self.b[0].z);
        let at = |i: usize| opposite + T::from_i32(i as i32) * step;
        let half = T::from_f64(0.5 * SHORTEST_RAD);
        let mut is_next_in_view = self.in_turn(opposite, step);
        let Some(first) = (0..scan).find(|_| !is_next_in_view()) else {
            let _ = arcs.push([opposite, opposite + T::from_f64(TAU)]);
            return arcs;
        };
        let mut start = None;
        for i in first + 1..=first + scan {
            match (start, is_next_in_view()) {
                (None, true) => start = Some(self.end(at(i), at(i - 1))),
                (Some(from), false) => {
                    let to = self.end(at(i - 1), at(i));
                    let short = (half - (to - from) * T::from_f64(0.5)).max(T::ZERO);
                    // A lens that bends a limb into more arcs than a circle can have loses the last of them.
                    let _ = arcs.push([from - short, to + short]);
                    start = None;
                }
                _ => {}
            }
        }
        arcs
    }

    /// Returns the end of an arc by bisection, between an azimuth in view and one that is not.
    fn end(&self, mut seen: T, mut unseen: T) -> T {
        for _ in 0..30 {
            let half = (seen + unseen) * T::from_f64(0.5);
            // No number lies between the two any more, in an `f32` after about 16 steps.
            if half == seen || half == unseen {
                break;
            }
            *if self.is_in_view(half) { &mut seen } else { &mut unseen } = half;
        }
        seen
    }
}

#[cfg(test)]
mod tests;
