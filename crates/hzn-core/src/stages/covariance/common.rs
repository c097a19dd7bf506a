//! Errors that all points of an edge share, so that they do not appear in the residuals.
//!
//! Each error is a signal x along the edge, in radians. The fit converts a signal of unit size into the error
//! v = R Σ w h x of (δ₁₂, δc), where R is the response of the fit. The covariance grows by σ² v vᵀ.
//!
//! | term | signal |
//! |---|---|
//! | common shift | g: every point one pixel across the limb |
//! | common tilt | g τ, τ from −1 to 1 along the edge |
//! | common bend | g (3τ² − 1)/2, the second Legendre polynomial |
//! | unknown azimuth | cos kφ and sin kφ of the azimuth φ about the axis, k = 1, 2 |
//! | lens | g·∂u/∂p, the pixel's move for an intrinsic parameter p |
//!
//! The limb of an ellipsoid differs from its mean cone by a second harmonic of the azimuth. A limb height that varies
//! with latitude also adds a first harmonic. The phase is unknown unless an attitude gives the direction of north. With
//! the amplitude a, the residuals contain a cos(kφ + ψ) with ψ uniformly distributed, so that each of the two signals
//! counts with a²/2. Around the whole limb, the second harmonic causes no error. On a short arc, nearly all of it is
//! fitted as a tilt or as another half-angle; the visible arc decides which.
//!
//! The fit absorbs a bend as another half-angle, so that the residuals do not show it. They show the next shapes along
//! the edge, the Legendre polynomials of the degrees 3 to 5. The bend is assumed to be as strong as the strongest of
//! them, as in `hzn calibrate noise`. Noise that is new at every point has little of these shapes.
//!
//! The signals vary slowly along the limb, so that a part of the points is used instead of all. This part has its own
//! normal equations; a signal that the cone can follow is then fitted completely.

use super::light;
use super::noise::EdgeNoiseModel;
use super::sandwich::response;
use crate::base::linalg::{M3, V3, basis};
use crate::base::real::Real;
use crate::geometry::block::{Block, LEAST_GRADIENT2, every_weighted};
use crate::geometry::camera::{Camera, INTRINSICS};
use crate::model::body::Expected;
use crate::model::error_budget::Term;
use crate::stages::fit::Fit;

/// Largest number of points over which the signals are summed, evenly along the edge.
// Even so the signals cost half as much as the double sum over all points (23 and 44 thousand instructions of a clean
// picture in an earlier version), which is why there are no more.
const PART: usize = 64;

/// Standard deviation of the position along the edge, for positions from −1 to 1: 1/√3.
const SPREAD: f64 = 0.577_350_269_189_625_8;

/// Value of a bend at the ends of the edge if its RMS along the edge is 1: √5.
const BEND_END_PER_RMS: f64 = 2.236_067_977_499_79;

/// Returns the Legendre polynomials of the degrees 3 to 5 at t from −1 to 1, with an RMS of 1.
fn shapes<T: Real>(t: T) -> [T; 3] {
    // √7/2, √9/8 and √11/8.
    const SCALES: [f64; 3] = [1.322_875_655_532_295_4, 0.375, 0.414_578_098_794_425];
    let (n, t2) = (T::from_f64, t * t);
    [
        t * (t2 * n(5.0) - n(3.0)) * n(SCALES[0]),
        (t2 * (t2 * n(35.0) - n(30.0)) + n(3.0)) * n(SCALES[1]),
        t * (t2 * (t2 * n(63.0) - n(70.0)) + n(15.0)) * n(SCALES[2]),
    ]
}

/// Returns the distance between the points of the part, counted in inliers.
fn step<T: Real>(fit: &Fit<T>) -> usize {
    (fit.inliers as usize).div_ceil(PART).max(1)
}

/// Calls `add` with each term and its covariance of (δ₁₂, δc). The result is the covariance from light that changes
/// along the edge, which is not among them; `None` inside where there is no such light.
pub(super) fn add_terms<T: Real>(
    blocks: &[Block<T>],
    fit: &Fit<T>,
    expected: &Expected<T>,
    noise: &EdgeNoiseModel<T>,
    camera: &Camera<T>,
    mut add: impl FnMut(Term, &M3<T>),
) -> Option<Option<M3<T>>> {
    let sums = Sums::new(blocks, fit, expected, camera);
    let response = response(&fit.sums.with_normal(sums.normal), fit.mean, fit.free)?;
    let error = |sum: &V3<T>| response * sum;
    let outer = |v: &V3<T>, variance: T| v * v.transpose() * variance;
    add(Term::CommonShift, &outer(&error(sums.by_number.shift()), noise.shift_px * noise.shift_px));
    let [tilt, bend] = sums.along();
    add(Term::CommonTilt, &outer(&error(&tilt), noise.tilt_px * noise.tilt_px));
    let bend_px = if noise.measures_bend { noise.bend_px.max(sums.strongest_shape_px()) } else { noise.bend_px };
    add(Term::CommonBend, &outer(&error(&bend), bend_px * bend_px));
    let mut uneven = M3::zeros();
    for (amplitude, pair) in expected.unknown_harmonics_cos.iter().zip(&sums.harmonics) {
        for sum in pair {
            uneven += outer(&error(sum), *amplitude * *amplitude * T::from_f64(0.5));
        }
    }
    add(Term::UnknownAzimuth, &uneven);
    if let Some(modes) = camera.intrinsic_modes() {
        let mut lens = M3::zeros();
        for mode in modes {
            let sum = mode.iter().zip(&sums.lens).fold(V3::zeros(), |sum, (m, by)| sum + by * *m);
            lens += outer(&error(&sum), T::one());
        }
        add(Term::Lens, &lens);
    }
    let light = sums.light.as_ref();
    Some(light.and_then(|view| light::covariance(view, &sums.by_number, &response, fit, expected)))
}

/// A point of the part, as a row of the normal equations.
pub(super) struct Row<T> {
    /// The ray, and its components on the tangent basis.
    s: V3<T>,
    pub(super) x: T,
    pub(super) y: T,
    /// Derivative of s·e by (u, v), and its square.
    gradient: [T; 2],
    g2: T,
    /// w h.
    pub(super) h: V3<T>,
    /// The first two components of h, and w.
    h12: [T; 2],
    w: T,
    /// Robust weight and number of the point.
    pub(super) weight: T,
    place: usize,
}

impl<T: Real> Row<T> {
    /// Returns w h x for the shift of this point by one pixel across the limb.
    pub(super) fn shift(&self) -> V3<T> {
        self.h * self.g2.sqrt()
    }
    /// Returns the residual r = cos α − s·e, and its square in px² times the weight.
    pub(super) fn residual(&self, fit: &Fit<T>) -> (T, T) {
        // 1 − s·e = |s − e|²/2 keeps the digits of a small disc.
        let d = self.s - fit.e;
        let r = d.dot(&d) * T::from_f64(0.5) - fit.k;
        (r, self.w * r * r)
    }
    /// Returns the weight w of the normal equations.
    pub(super) fn w(&self) -> T {
        self.w
    }
    /// Returns the number of the point along the edge.
    pub(super) fn place(&self) -> usize {
        self.place
    }
    /// Returns how many pixels across the limb one pixel along the axis of its profile is.
    pub(super) fn across_by_axis(&self) -> T {
        let [gu, gv] = self.gradient;
        gu.abs().max(gv.abs()) / self.g2.sqrt()
    }
    /// Returns whether the Sun in the direction `sun` is above the horizon of the point.
    pub(super) fn is_in_sunlight(&self, sun: &V3<T>, fit: &Fit<T>) -> bool {
        // The surface normal is (s cos α − e)/sin α.
        self.s.dot(sun) * fit.c > fit.e.dot(sun)
    }
    /// Returns cos φ and sin φ of the azimuth φ about the axis.
    pub(super) fn azimuth(&self) -> [T; 2] {
        let per = T::one() / (self.x * self.x + self.y * self.y).max(T::from_f64(1e-20)).sqrt();
        [self.x * per, self.y * per]
    }
    /// Returns w h.
    pub(super) fn h(&self) -> V3<T> {
        self.h
    }
    /// Returns cos 2φ and sin 2φ of the azimuth φ about the axis.
    pub(super) fn second_harmonic(&self) -> [T; 2] {
        let (x2, y2) = (self.x * self.x, self.y * self.y);
        let rho2 = (x2 + y2).max(T::from_f64(1e-20));
        [(x2 - y2) / rho2, (self.x + self.x) * self.y / rho2]
    }
    /// Adds w h hᵀ to the upper triangle of the normal matrix.
    pub(super) fn add_to(&self, normal: &mut [T; 6]) {
        let (Self { h, w, .. }, [h1, h2]) = (self, self.h12);
        let terms = [h.x * h1, h.x * h2, -h.x, h.y * h2, -h.y, *w];
        normal.iter_mut().zip(terms).for_each(|(sum, term)| *sum += term);
    }
}

/// Returns the rows of a part of the points.
pub(super) fn part<'a, T: Real>(blocks: &'a [Block<T>], fit: &'a Fit<T>) -> impl Iterator<Item = Row<T>> + 'a {
    let (b1, b2) = basis(&fit.e);
    let [m1, m2] = fit.mean;
    every_weighted(blocks, step(fit)).map(move |(place, block, l)| {
        let s = block.ray(l);
        let [gu, gv] = block.gradient_at(l, &fit.e);
        let g2 = (gu * gu + gv * gv).max(T::from_f64(LEAST_GRADIENT2));
        let w = block.weight[l & 7] / g2;
        let (x, y) = (s.dot(&b1), s.dot(&b2));
        let (h1, h2) = (x - m1, y - m2);
        let h = V3::new(h1, h2, -T::one()) * w;
        Row { s, x, y, gradient: [gu, gv], g2, h, h12: [h1, h2], w, weight: block.weight[l & 7], place }
    })
}

/// Sums Σ w h g iⁿ over a part of the points for n = 0, 1 and 2, with the number i of the point: from them follows the
/// sum for each signal g y that is a parabola y(i) along the edge.
pub(super) struct ByNumber<T>(pub(super) [V3<T>; 3]);

impl<T: Real> ByNumber<T> {
    /// Returns Σ w h g.
    fn shift(&self) -> &V3<T> {
        let [shift, _, _] = &self.0;
        shift
    }

    /// Returns Σ w h g y for the parabola y(i) through three values.
    pub(super) fn of_curve(&self, [i0, i1, i2]: [T; 3], [y0, y1, y2]: [T; 3]) -> V3<T> {
        let per = |from: T, to: T| (to - from).max(T::one());
        let (first, second) = ((y1 - y0) / per(i0, i1), (y2 - y1) / per(i1, i2));
        let curve = (second - first) / per(i0, i2);
        // y = y₀ + first (i − i₀) + curve (i − i₀)(i − i₁)
        let constant = y0 - first * i0 + curve * i0 * i1;
        let slope = first - curve * (i0 + i1);
        let [shift, by_number, by_square] = &self.0;
        shift * constant + by_number * slope + by_square * curve
    }
}

/// Sums Σ w h x over a part of the points, for each signal x.
struct Sums<T> {
    /// Upper triangle of Σ w h hᵀ.
    normal: [T; 6],
    by_number: ByNumber<T>,
    /// Σ, Σ i and Σ i² of the robust weights, from which τ is computed.
    // The mean of the numbers is known only after the pass. With these sums tilt and bend need no second one.
    numbers: [T; 3],
    /// Σ of the robust weight times the distance from the fitted limb, px, times each of the shapes of [`shapes`].
    residuals: [T; 3],
    /// Sums of the harmonics: for each harmonic, cosine and sine.
    harmonics: [[V3<T>; 2]; 2],
    /// Sums for each intrinsic parameter.
    lens: [V3<T>; INTRINSICS],
    light: Option<light::View<T>>,
}

impl<T: Real> Sums<T> {
    fn new(blocks: &[Block<T>], fit: &Fit<T>, expected: &Expected<T>, camera: &Camera<T>) -> Self {
        let zero = V3::zeros();
        let mut sums = Self {
            normal: [T::ZERO; 6],
            by_number: ByNumber([zero; 3]),
            numbers: [T::ZERO; 3],
            residuals: [T::ZERO; 3],
            harmonics: [[zero; 2]; 2],
            lens: [zero; INTRINSICS],
            light: light::View::new(expected),
        };
        let every = step(fit);
        let per_point = T::from_f64(2.0 * every as f64) / T::from_f64(f64::from(fit.inliers.max(1)));
        // The middle of each stretch of points, from −1 to 1.
        let mut along = per_point * T::from_f64(0.5) - T::one();
        let is_uncertain = camera.intrinsic_modes().is_some();
        part(blocks, fit).for_each(|row| {
            let Row { s, gradient: [gu, gv], h, weight, place, .. } = row;
            row.add_to(&mut sums.normal);
            let shift = row.shift();
            let i = T::from_i32(place as i32);
            let [plain, by_number, by_square] = &mut sums.by_number.0;
            *plain += shift;
            *by_number += shift * i;
            *by_square += shift * (i * i);
            if let Some(view) = &mut sums.light {
                view.add(&row, fit, expected);
            }
            let d = s - fit.e;
            // 1 − s·e is half of the squared distance of two unit vectors; the difference of cosines would lose the
            // digits of a small disc.
            let off_px = (d.dot(&d) * T::from_f64(0.5) - fit.k) / row.g2.sqrt();
            sums.residuals.iter_mut().zip(shapes(along)).for_each(|(sum, shape)| *sum += weight * off_px * shape);
            along += per_point;
            sums.numbers[0] += weight;
            sums.numbers[1] += weight * i;
            sums.numbers[2] += weight * i * i;
            let [c, s_] = row.azimuth();
            sums.harmonics[0][0] += h * c;
            sums.harmonics[0][1] += h * s_;
            sums.harmonics[1][0] += h * (c * c - s_ * s_);
            sums.harmonics[1][1] += h * ((c + c) * s_);
            // An exact lens saves nine derivatives a point.
            if is_uncertain {
                for (sum, [du, dv]) in sums.lens.iter_mut().zip(camera.shift_by_intrinsics(&s)) {
                    *sum += h * (gu * du + gv * dv);
                }
            }
        });
        sums
    }

    /// Returns the value at the ends of a bend that is as strong as the strongest of the next shapes, in pixels.
    fn strongest_shape_px(&self) -> T {
        let strongest = self.residuals.iter().fold(T::ZERO, |largest, sum| largest.max(sum.abs()));
        strongest * T::from_f64(BEND_END_PER_RMS) / self.numbers[0].max(T::one())
    }

    /// Returns the sums for tilt and bend, with τ = (i − ī)/(√3 σ_i). For evenly distributed points τ goes from −1 to
    /// 1.
    fn along(&self) -> [V3<T>; 2] {
        let [n, sum, squares] = self.numbers;
        let mean = sum / n.max(T::one());
        let spread = (squares / n.max(T::one()) - mean * mean).max(T::one()).sqrt();
        let per_number = T::from_f64(SPREAD) / spread;
        let ByNumber([shift, by_number, by_square]) = &self.by_number;
        let tilt = (by_number - shift * mean) * per_number;
        // Σ g τ², from τ² = (i² − 2 ī i + ī²)/(3 σ_i²).
        let square = (by_square - by_number * (mean + mean) + shift * (mean * mean)) * (per_number * per_number);
        [tilt, square * T::from_f64(1.5) - shift * T::from_f64(0.5)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_parabola_goes_through_its_values() {
        let points = [0.0, 1.0, 2.0, 5.0, 9.0_f64];
        let y = |i: f64| 0.3 - 0.2 * i + 0.07 * i * i;
        let sum = |f: &dyn Fn(f64) -> f64| points.iter().map(|i| V3::new(1.0, *i, 2.0) * f(*i)).sum::<V3<f64>>();
        let sums = ByNumber([sum(&|_| 1.0), sum(&|i| i), sum(&|i| i * i)]);
        let found = sums.of_curve([1.0, 4.0, 8.5], [1.0, 4.0, 8.5].map(y));
        assert!((found - sum(&y)).norm() < 1e-12, "{found} {}", sum(&y));
    }
}
