//! Error of a disc that is lit from one side, without the direction to the Sun.
//!
//! The edge of such a disc is limb on one side and terminator on the other. If the phase is small, the terminator is so
//! close to the limb that the fit takes both, and finds another centre and another size. The sunlit half of the limb
//! fits a cone much better than the whole edge. The half is not known, so that each of eight halves is fitted by one
//! linear step from the whole cone; the one with the smallest residuals counts. Its cone may be the right one. The
//! difference is therefore an error of the answer: it is added to the covariance.
//!
//! A flattened body whose north is not known is no circle, and a terminator looks like more flattening. If the
//! flattening is more than the residuals, each half has a second harmonic of its own.

use super::answer::ConeCovariance;
use super::part::{Row, part};
use super::sandwich::response;
use crate::base::linalg::{V3, invert_spd2};
use crate::base::real::Real;
use crate::geometry::block::Block;
use crate::model::body::Expected;
use crate::stages::fit::Fit;

/// Number of sectors of the azimuth. Four neighbours are a half.
const SECTORS: usize = 8;
/// A half counts if its mean square distance is below this part of that of all points.
// A factor of two in the RMS. The points of a limb have the same noise on both sides, whatever it is.
const MAX_COST: f64 = 0.25;
/// Smallest part of the weight that a half must have.
const LEAST_WEIGHT: f64 = 0.25;

/// Sums of the points in a sector, or in several.
#[derive(Clone, Copy)]
struct Sector<T> {
    /// Upper triangle of Σ w h hᵀ, and Σ w h r with the residual r.
    normal: [T; 6],
    right: V3<T>,
    /// The same for the second harmonic q = (cos 2φ, sin 2φ): Σ w h qᵀ, the upper triangle of Σ w q qᵀ, and Σ w q r.
    mixed: [V3<T>; 2],
    round: [T; 3],
    wave: [T; 2],
    /// Σ of the robust weights, and of the squared distances times these weights, px².
    weight: T,
    cost: T,
    /// Number of points.
    points: i32,
}

impl<T: Real> Sector<T> {
    fn new() -> Self {
        Self {
            normal: [T::ZERO; 6],
            right: V3::zeros(),
            mixed: [V3::zeros(); 2],
            round: [T::ZERO; 3],
            wave: [T::ZERO; 2],
            weight: T::ZERO,
            cost: T::ZERO,
            points: 0,
        }
    }

    /// Returns the sums of one point.
    fn of_point(row: &Row<T>, fit: &Fit<T>) -> Self {
        let (r, cost) = row.residual(fit);
        let [c, s] = row.second_harmonic();
        let w = row.w();
        let mut one = Self {
            right: row.h * r,
            mixed: [row.h * c, row.h * s],
            round: [w * c * c, w * c * s, w * s * s],
            wave: [w * c * r, w * s * r],
            weight: row.weight,
            cost,
            points: 1,
            ..Self::new()
        };
        row.add_to(&mut one.normal);
        one
    }

    fn add(&mut self, other: &Self) {
        self.normal.iter_mut().zip(other.normal).for_each(|(sum, more)| *sum += more);
        self.right += other.right;
        self.mixed.iter_mut().zip(other.mixed).for_each(|(sum, more)| *sum += more);
        self.round.iter_mut().zip(other.round).for_each(|(sum, more)| *sum += more);
        self.wave.iter_mut().zip(other.wave).for_each(|(sum, more)| *sum += more);
        self.weight += other.weight;
        self.cost += other.cost;
        self.points += other.points;
    }

    /// Takes a second harmonic out: the sums for a cone beside which the points determine a harmonic, too.
    fn without_harmonic(&self) -> Option<Self> {
        let [a, b, d] = invert_spd2(self.round)?;
        let ([m1, m2], [q1, q2]) = (self.mixed, self.wave);
        // The harmonic of a unit of h, and that of the residuals.
        let (u1, u2) = (m1 * a + m2 * b, m1 * b + m2 * d);
        let outer = m1 * u1.transpose() + m2 * u2.transpose();
        let less = [outer.m11, outer.m12, outer.m13, outer.m22, outer.m23, outer.m33];
        let mut own = *self;
        own.normal.iter_mut().zip(less).for_each(|(sum, less)| *sum -= less);
        own.right -= u1 * q1 + u2 * q2;
        own.cost -= (q1 * (a * q1 + b * q2) + q2 * (b * q1 + d * q2)).min(self.cost);
        own.points -= 2;
        Some(own)
    }

    /// Returns the mean square distance of the points from a cone that they determined, px². The three unknowns of a
    /// cone take as many degrees of freedom: a half with few points fits well by chance.
    fn mean_square(&self, cost: T) -> Option<T> {
        let freedom = self.points - 3;
        let points = T::from_i32(self.points);
        (freedom > 0 && self.weight > T::ZERO).then(|| cost / self.weight * points / T::from_i32(freedom))
    }

    /// Returns the step (δ₁₂, δc) from the whole cone to that of this half, and the mean square distance after it, px².
    fn step(&self, fit: &Fit<T>) -> Option<(V3<T>, T)> {
        let step = response(&fit.sums.with_normal(self.normal), fit.mean, true)? * self.right;
        let [m1, m2] = fit.mean;
        let (g, about_mean) = (self.right, step.z - m1 * step.x - m2 * step.y);
        let gain = g.x * step.x + g.y * step.y + g.z * about_mean;
        Some((step, self.mean_square((self.cost - gain).max(T::ZERO))?))
    }
}

/// Adds the difference between the whole edge and its best half, if the half-angles differ by more than one sigma.
pub(super) fn widen<T: Real>(blocks: &[Block<T>], fit: &Fit<T>, expected: &Expected<T>, p: &mut ConeCovariance<T>) {
    let Some(step) = to_best_half(blocks, fit, expected) else { return };
    let more = step * step.transpose();
    if more.m33 > p.whole.m33 + p.late.m33 {
        p.whole += more;
        // The light stays the same for many pictures.
        p.common += more;
    }
}

/// Returns the number of the sector of an azimuth, counted from the first tangent.
fn sector<T: Real>(x: T, y: T) -> usize {
    let is_steep = x.abs() < y.abs();
    match (x >= T::ZERO, y >= T::ZERO) {
        (true, true) => usize::from(is_steep),
        (false, true) => 3 - usize::from(is_steep),
        (false, false) => 4 + usize::from(is_steep),
        (true, false) => 7 - usize::from(is_steep),
    }
}

/// Returns the step (δ₁₂, δc) from the fitted cone to that of the half which fits best; `None` if no half fits much
/// better than the whole edge.
fn to_best_half<T: Real>(blocks: &[Block<T>], fit: &Fit<T>, expected: &Expected<T>) -> Option<V3<T>> {
    let mut sectors = [Sector::new(); SECTORS];
    let mut whole = Sector::new();
    part(blocks, fit).for_each(|row| {
        let one = Sector::of_point(&row, fit);
        whole.add(&one);
        if let Some(sector) = sectors.get_mut(sector(row.x, row.y)) {
            sector.add(&one);
        }
    });
    // Limb and terminator together are closed. An arc of a limb has no other side.
    if sectors.iter().any(|sector| sector.points == 0) {
        return None;
    }
    let least_weight = whole.weight * T::from_f64(LEAST_WEIGHT);
    // The amplitude of the harmonic in pixels: the mean square that it adds is half of its square.
    let amplitude = expected.unknown_harmonics_cos[1];
    let harmonic_px2 = amplitude * amplitude * (whole.round[0] + whole.round[2]) / whole.weight;
    let mut limit = whole.mean_square(whole.cost)?;
    let is_flat = harmonic_px2 > limit;
    if is_flat {
        limit = whole.without_harmonic()?.step(fit)?.1;
    }
    let mut best = (None, limit * T::from_f64(MAX_COST));
    for first in 0..SECTORS {
        let mut half = Sector::new();
        sectors.iter().cycle().skip(first).take(SECTORS / 2).for_each(|sector| half.add(sector));
        if half.weight >= least_weight
            && let Some(half) = if is_flat { half.without_harmonic() } else { Some(half) }
            && let Some((step, cost)) = half.step(fit)
            && cost < best.1
        {
            best = (Some(step), cost);
        }
    }
    best.0
}
