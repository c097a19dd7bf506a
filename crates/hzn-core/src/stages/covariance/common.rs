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
//! The signals vary slowly along the limb, so that a part of the points is used instead of all.

use super::light;
use super::noise::EdgeNoiseModel;
use super::part::{ByNumber, Row, part, step};
use super::sandwich::response;
use crate::base::linalg::{M3, V3};
use crate::base::real::Real;
use crate::geometry::block::Block;
use crate::geometry::camera::{Camera, INTRINSICS};
use crate::model::body::Expected;
use crate::model::error_budget::Term;
use crate::stages::fit::Fit;

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
