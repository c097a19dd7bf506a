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
use super::sums::{self, Weights, pass};
use crate::base::linalg::{V3, basis, invert_spd3, unit};
use crate::base::real::Real;
use crate::geometry::block::{Block, HALF_LANES, LANES, LEAST_GRADIENT2};
use crate::geometry::scaling::Scaling;

/// Largest number of steps. From the robust fit, three are enough (math.md, 13.3).
const STEPS: usize = 6;
/// Smallest component across the axis of a ray that has an azimuth.
const LEAST_SIN: f64 = 1e-7;

/// Fits axis and half-angle with the weights that the points have. `None` if the points do not determine the cone.
/// `at_start` are the normal equations at the start, if they are known. If the first step is the last one, the result
/// is so near that they hold for it, too.
pub(super) fn settle<T: Real>(
    blocks: &mut [Block<T>],
    start: State<T>,
    at_start: Option<sums::Sums<T>>,
    scaling: &Scaling<T>,
) -> Option<Cone<T>> {
    let scaling = Some(scaling).filter(|scaling| !scaling.is_uniform());
    let mut at = start;
    let mut alpha = at.sin().atan2(at.c());
    let (b1, b2) = basis(&at.e);
    // The means are subtracted, so that single precision suffices: in the cosine form the relative error of the
    // covariance falls from 5e-4 to 2e-6 by it.
    let centre = (b1 * at.mean[0] + b2 * at.mean[1]) * (T::one() / at.sin().max(T::from_f64(LEAST_SIN)));
    let mut known = at_start;
    for _ in 0..STEPS {
        let (b1, b2) = basis(&at.e);
        let sums = Sums::new(blocks, &at.e, [&b1, &b2], alpha, &centre, scaling);
        let ([d1, d2, d_alpha], gain, is_last) = sums.step()?;
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
            // The sums of the robust fit are used again, so that the usual case saves a pass over all points.
            known.iter_mut().for_each(|known| known.cost = (sums.cost - gain).max(T::ZERO));
            break;
        }
        known = None;
    }
    let (half, _) = (alpha * T::from_f64(0.5)).sin_cos();
    at.k = half * half * T::from_f64(2.0);
    let (b1, b2) = basis(&at.e);
    let mean = at.mean;
    let sums = known.unwrap_or_else(|| pass(blocks, &at.e, &b1, &b2, at.k, mean, &Weights::Kept, None));
    (sums.weight > T::from_f64(2.5) && sums.cost >= T::ZERO).then_some(Cone {
        at,
        mean,
        sums,
        free: true,
        quadric: None,
    })
}

/// Normal equations about a value `mean` near the mean of Bᵀu.
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
    /// Sums over the points. `centre` is near the mean of u. Without a scaling, the scaled rays are the rays.
    fn new(
        blocks: &[Block<T>],
        e: &V3<T>,
        [b1, b2]: [&V3<T>; 2],
        alpha: T,
        centre: &V3<T>,
        scaling: Option<&Scaling<T>>,
    ) -> Self {
        let mean = [centre.dot(b1), centre.dot(b2)];
        let (sin, cos) = alpha.sin_cos();
        let mut totals = [[T::ZERO; HALF_LANES]; 11];
        for block in blocks {
            let mut gradient = block.gradient(e);
            let [mut x, mut y, mut rho] = [[T::ZERO; LANES]; 3];
            let mut sin_rho = [T::ZERO; LANES];
            for l in 0..LANES {
                let d = V3::new(block.s[0][l] - e.x, block.s[1][l] - e.y, block.s[2][l] - e.z);
                (x[l], y[l]) = (d.dot(b1), d.dot(b2));
                // One root a point gives sine and azimuth; the angle itself would need an arc tangent for each point.
                let across = (x[l] * x[l] + y[l] * y[l]).sqrt();
                let per = T::one() / across.max(T::from_f64(LEAST_SIN));
                let along = T::one() - d.dot(&d) * T::from_f64(0.5);
                (x[l], y[l]) = (x[l] * per, y[l] * per);
                sin_rho[l] = across * cos - along * sin;
                rho[l] = arc_sine(sin_rho[l]);
                // At the foot point the limb moves along u cos α − e sin α when α grows, and the derivative of the ray
                // does not contain the ray.
                let at_foot = -(along * cos + across * sin) * per;
                (gradient[0][l], gradient[1][l]) = (gradient[0][l] * at_foot, gradient[1][l] * at_foot);
            }
            if let Some(scaling) = scaling {
                scaling.add_length(block, &sin_rho, &mut gradient);
            }
            for l in 0..HALF_LANES {
                let terms = |l: usize| {
                    let (weight, rho) = (block.weight[l], rho[l]);
                    let g2 = gradient[0][l] * gradient[0][l] + gradient[1][l] * gradient[1][l];
                    let w = weight / g2.max(T::from_f64(LEAST_GRADIENT2));
                    let (h1, h2) = (x[l] - mean[0], y[l] - mean[1]);
                    let (w1, w2, wr) = (w * h1, w * h2, w * rho);
                    [w1 * h1, w1 * h2, w1, w2 * h2, w2, w, wr * h1, wr * h2, wr, wr * rho, weight]
                };
                let (one, other) = (terms(l), terms(l + HALF_LANES));
                for (total, (a, b)) in totals.iter_mut().zip(one.iter().zip(&other)) {
                    total[l] += *a + *b;
                }
            }
        }
        let [n @ .., g1, g2, g3, cost, weight] = totals.map(|[a, b, c, d]| (a + b) + (c + d));
        Self { n, g: [g1, g2, g3], cost, weight, mean }
    }

    /// Returns the step of the axis on its tangent basis and of the half-angle, how much the step reduces the cost, and
    /// whether it is the last one. The last step is shorter than a hundredth of the sigma of white noise, and what
    /// remains to the solution after it is less than a hundredth of that (math.md, 13.3).
    fn step(&self) -> Option<([T; 3], T, bool)> {
        let [g1, g2, g3] = self.g;
        let d = invert_spd3(&self.n)? * V3::new(g1, g2, g3);
        let gain = d.x * g1 + d.y * g2 + d.z * g3;
        let is_last = gain * self.weight < self.cost * T::from_f64(1e-4);
        Some(([d.x, d.y, d.z - self.mean[0] * d.x - self.mean[1] * d.y], gain, is_last))
    }
}

/// Returns the arc sine of a small number: the error is below 1e-12 up to 0.05, and nothing depends on larger ones,
/// because only outliers without a weight are so far from the limb.
#[inline(always)]
fn arc_sine<T: Real>(x: T) -> T {
    let x2 = x * x;
    x * (T::one() + x2 * (T::from_f64(1.0 / 6.0) + x2 * (T::from_f64(0.075) + x2 * T::from_f64(15.0 / 336.0))))
}
