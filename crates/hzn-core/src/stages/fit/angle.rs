//! Gauss-Newton with the half-angle itself as the third unknown: the fit of a position (math.md, (13.10), (13.11)).
//!
//! The cosine form of the robust fit takes the direction of each row from the point, which has the same error as the
//! residual. Their product does not vanish on average, and on a short arc the half-angle has a bias of several sigmas.
//! Here the residual is the angle ρ = θ − α from the limb, and the row h = [Bᵀu, 1] contains the point only through its
//! azimuth, which does not depend on the error across the limb. So the fit is without bias, and it is as good for a
//! disc of a milliradian as for the whole sky.
//!
//! With d = σ − e, 1 − σ·e is |d|²/2 and |e × σ| is |e × d|. The sine of ρ, |e × σ| cos α − (σ·e) sin α, is small, so
//! that its arc sine is a short series.

use super::cone::{Cone, State};
use super::sums::{Weights, pass};
use crate::base::linalg::{V3, basis, invert_spd3, unit};
use crate::base::real::Real;
use crate::geometry::block::{Block, LANES, sum};
use crate::geometry::scaling::Scaling;

/// Largest number of steps. From the robust fit, three are enough (math.md, 13.3).
const STEPS: usize = 6;
/// Smallest component across the axis of a ray that has an azimuth.
const LEAST_SIN: f64 = 1e-7;

/// Fits axis and half-angle with the weights that the points have. `None` if the points do not determine the cone.
pub(super) fn settle<T: Real>(blocks: &mut [Block<T>], start: State<T>, scaling: &Scaling<T>) -> Option<Cone<T>> {
    let mut at = start;
    let mut alpha = at.sin().atan2(at.c());
    for _ in 0..STEPS {
        let (b1, b2) = basis(&at.e);
        let sums = Sums::new(blocks, &at.e, [&b1, &b2], alpha, scaling);
        let ([d1, d2, d_alpha], is_last) = sums.step()?;
        at.e = unit(&(at.e + b1 * d1 + b2 * d2))?;
        alpha += d_alpha;
        let quarter_turn = T::from_f64(core::f64::consts::FRAC_PI_2);
        // An axis more than 20° from the robust solution belongs to another cone.
        if !(alpha > T::ZERO && alpha < quarter_turn) || at.e.dot(&start.e) < T::from_f64(0.94) {
            return None;
        }
        let size = d1.abs() + d2.abs() + d_alpha.abs();
        // Exact rays leave no residuals to compare with; the convergence is then quadratic.
        if is_last || size * size < T::EPSILON * T::from_f64(2.0) * alpha {
            break;
        }
    }
    let (half, _) = (alpha * T::from_f64(0.5)).sin_cos();
    at.k = half * half * T::from_f64(2.0);
    let (b1, b2) = basis(&at.e);
    let (mean, sums) = (at.mean, pass(blocks, &at.e, &b1, &b2, at.k, at.mean, &Weights::Kept, None));
    (sums.weight > T::from_f64(2.5) && sums.cost >= T::ZERO).then_some(Cone {
        at,
        mean,
        sums,
        free: true,
        #[cfg(feature = "zju")]
        quadric: None,
    })
}

/// Normal equations about the mean of Bᵀu.
struct Sums<T> {
    /// Upper triangle of Σ w h hᵀ.
    n: [T; 6],
    g: [T; 3],
    /// Σ w ρ², and the sum of the robust weights.
    cost: T,
    weight: T,
    mean: [T; 2],
}

impl<T: Real> Sums<T> {
    fn new(blocks: &[Block<T>], e: &V3<T>, b: [&V3<T>; 2], alpha: T, scaling: &Scaling<T>) -> Self {
        let mean = mean_azimuth(blocks, e, b);
        let (sin, cos) = alpha.sin_cos();
        let mut sums = [[T::ZERO; LANES]; 11];
        for block in blocks {
            for lane in 0..LANES {
                let ray = block.ray(lane);
                let [x, y, across] = azimuth(&ray, e, b);
                let d = ray - e;
                let along = T::one() - d.dot(&d) * T::from_f64(0.5);
                let rho = arc_sine(across * cos - along * sin);
                // The direction in which the limb moves when α grows, at the foot point.
                let outward = (b[0] * x + b[1] * y) * cos - e * sin;
                let [gu, gv] = block.gradient_at(lane, &scaling.at_foot(&ray, &outward));
                let weight = block.weight[lane];
                let w = weight / (gu * gu + gv * gv).max(T::from_f64(1e-20));
                let (h1, h2) = (x - mean[0], y - mean[1]);
                let (w1, w2, wr) = (w * h1, w * h2, w * rho);
                let terms = [w1 * h1, w1 * h2, w1, w2 * h2, w2, w, wr * h1, wr * h2, wr, wr * rho, weight];
                for (sum, term) in sums.iter_mut().zip(terms) {
                    sum[lane] += term;
                }
            }
        }
        let [n @ .., g1, g2, g3, cost, weight] = sums.map(|lanes| sum(&lanes));
        Self { n, g: [g1, g2, g3], cost, weight, mean }
    }

    /// Returns the step of the axis on its tangent basis, and of the half-angle, and whether it is the last one: it is
    /// shorter than a hundredth of the sigma of white noise, and what is left of it is less than a hundredth of that
    /// (math.md, 13.3).
    fn step(&self) -> Option<([T; 3], bool)> {
        let [g1, g2, g3] = self.g;
        let d = invert_spd3(&self.n)? * V3::new(g1, g2, g3);
        let in_sigmas = (d.x * g1 + d.y * g2 + d.z * g3) * self.weight;
        let is_last = in_sigmas < self.cost * T::from_f64(1e-4);
        Some(([d.x, d.y, d.z - self.mean[0] * d.x - self.mean[1] * d.y], is_last))
    }
}

/// Returns the azimuth of a ray as the components of its unit vector u, and |e × σ|.
#[inline(always)]
fn azimuth<T: Real>(ray: &V3<T>, e: &V3<T>, [b1, b2]: [&V3<T>; 2]) -> [T; 3] {
    let d = ray - e;
    let (x, y) = (d.dot(b1), d.dot(b2));
    let across = (x * x + y * y).sqrt();
    let per = T::one() / across.max(T::from_f64(LEAST_SIN));
    [x * per, y * per, across]
}

/// Returns the mean of Bᵀu over the points with a weight.
fn mean_azimuth<T: Real>(blocks: &[Block<T>], e: &V3<T>, b: [&V3<T>; 2]) -> [T; 2] {
    let mut sums = [[T::ZERO; LANES]; 3];
    for block in blocks {
        for lane in 0..LANES {
            let w = block.weight[lane];
            let [x, y, _] = azimuth(&block.ray(lane), e, b);
            for (sum, term) in sums.iter_mut().zip([w * x, w * y, w]) {
                sum[lane] += term;
            }
        }
    }
    let [x, y, w] = sums.map(|lanes| sum(&lanes));
    let n = w.max(T::from_f64(1e-20));
    [x / n, y / n]
}

/// Returns the arc sine of a small number: the error is below 1e-12 up to 0.05, and nothing depends on larger ones,
/// because only outliers without a weight are so far from the limb.
#[inline(always)]
fn arc_sine<T: Real>(x: T) -> T {
    let x2 = x * x;
    x * (T::one() + x2 * (T::from_f64(1.0 / 6.0) + x2 * (T::from_f64(0.075) + x2 * T::from_f64(15.0 / 336.0))))
}
