//! The rotation of a flattened body about the line to it (math.md, 13.8).
//!
//! The limb of a flattened body is not a circle. A rotation ψ of the body about the line of sight moves it by a second
//! harmonic of the azimuth, which the three unknowns of the position cannot follow. With the signal x of a unit
//! rotation ([`super::consider`]), the rows h of the fit and the residuals r,
//!
//! x' = x − hᵀ (Σ w h hᵀ)⁻¹ Σ w h x,    ψ = Σ w x' r / Σ w x'².
//!
//! An error that is the signal s in the residuals gives the error Σ w x' s / Σ w x'² of ψ. The second harmonic of the
//! limb height is the largest of them for a body with air: 0.1 km looks like 2.2° in a low orbit about the Earth.
//!
//! Sums are in double precision, because x' is a small part of x on a short arc.

use super::answer::Turn;
use super::noise::EdgeNoiseModel;
use crate::base::linalg::{M3, V3, basis, invert_spd3, unit};
use crate::base::real::Real;
use crate::geometry::block::{Block, LANES, LEAST_GRADIENT2};
use crate::geometry::camera::{Camera, INTRINSICS};
use crate::model::body::{Expected, Target};
use crate::model::edge_noise::Config;
use crate::stages::fit::Fit;

/// Signals of errors that no residual shows, without those of the lens.
const SIGNALS: usize = 16;
const ALL_SIGNALS: usize = SIGNALS + INTRINSICS;
/// A rotation ψ is sin(2ψ)/2 in the second harmonic. What the linear estimate lacks is 2/3 of ψ³.
const LACKING: f64 = 2.0 / 3.0;

/// Measures the rotation. `None` if its 1-sigma is above `limit_rad`, or if the given orientation is so wrong that the
/// estimate is not linear: 2/3 |ψ|³ is above the 1-sigma.
pub(super) fn measured<T: Real>(
    blocks: &[Block<T>],
    fit: &Fit<T>,
    expected: &Expected<T>,
    target: &Target<T>,
    config: &Config,
    camera: &Camera<T>,
    limit_rad: f64,
) -> Option<Turn<T>> {
    // The sums over all points in double precision are dear. With the default sigma of the limb height the Earth never
    // gets below the limit, therefore this is tested first.
    if !can_reach(target, limit_rad) {
        return None;
    }
    let limb = Limb::new(fit, target)?;
    let beta = limb.followed_by_the_fit(blocks)?;
    let length_px = EdgeNoiseModel::new(fit, config).length_px.to_f64();
    let sums = Sums::new(&limb, blocks, &beta, length_px, camera);
    // The rotation itself is no noise: what it explains leaves the residuals.
    let explained = sums.projected * sums.projected / (sums.square * fit.sums.weight.to_f64());
    let rms_px = fit.rms_px.to_f64();
    // Otherwise a body that is turned by a large angle would raise the noise by its own signal.
    let left_px = libm::sqrt((rms_px * rms_px - explained).max(0.0));
    let noise = &EdgeNoiseModel::with_residuals(fit, T::from_f64(left_px), config);
    let sigmas = signal_sigmas(&limb, expected, target, noise);
    let mut variance = noise.variance.to_f64() * sums.correlated;
    let square = |x: f64| x * x;
    variance += sums.by_signal.iter().zip(sigmas).map(|(sum, sigma)| square(sum * sigma)).sum::<f64>();
    for mode in camera.intrinsic_modes().into_iter().flatten() {
        let by_lens = sums.by_signal.iter().skip(SIGNALS);
        variance += square(mode.iter().zip(by_lens).map(|(m, sum)| m.to_f64() * sum).sum::<f64>());
    }
    let (rad, sigma_rad) = (sums.projected / sums.square, libm::sqrt(variance) / sums.square);
    let is_usable = sigma_rad <= limit_rad && LACKING * rad * rad * rad.abs() <= sigma_rad;
    is_usable.then(|| Turn { rad: T::from_f64(rad), sigma_rad: T::from_f64(sigma_rad) })
}

/// Returns whether the second harmonic of the limb height alone leaves a sigma below the limit. A rotation of one
/// radian moves the limb by at most the difference between the largest and the smallest semi-axis; the factor 2 keeps
/// away from the limit, where the whole computation decides.
fn can_reach<T: Real>(target: &Target<T>, limit_rad: f64) -> bool {
    let extreme = |pick: fn(T, T) -> T| target.semi_axes.iter().fold(target.semi_axes[0], |found, a| pick(found, *a));
    let flattening_m = ((extreme(T::max) - extreme(T::min)) * target.unit_m).to_f64();
    limit_rad > 0.0 && flattening_m > 0.0 && target.second_harmonic_sigma_m.to_f64() < 2.0 * limit_rad * flattening_m
}

/// Returns the 1-sigma of each signal of [`Row::signals`].
fn signal_sigmas<T: Real>(
    limb: &Limb,
    expected: &Expected<T>,
    target: &Target<T>,
    noise: &EdgeNoiseModel<T>,
) -> [f64; SIGNALS] {
    let per_unit = |m: T| (m / target.unit_m).to_f64();
    let half = core::f64::consts::FRAC_1_SQRT_2;
    let second = per_unit(target.second_harmonic_sigma_m);
    let [first, uneven] = expected.unknown_harmonics_cos.map(|a| a.to_f64() * half);
    let (shift, tilt) = (noise.shift_px.to_f64(), noise.tilt_px.to_f64());
    // Light that changes along the limb is a first harmonic in the azimuth from the Sun, which may be unknown.
    let sun = expected.sun_seen.map(|sun| limb.azimuth(&sun.map(Real::to_f64)));
    let light = if expected.is_in_sunlight { shift } else { 0.0 };
    let [light_x, light_y] = sun.map_or([half; 2], |[x, y]| [x.abs(), y.abs()]).map(|part| part * light);
    let turned = target.attitude_sigma_rad.to_f64();
    let radii = per_unit(target.radii_sigma_m);
    let height = per_unit(target.limb_sigma_m);
    [
        second, second, first, first, uneven, uneven, turned, turned, radii, radii, radii, height, shift, tilt,
        light_x, light_y,
    ]
}

/// The fitted limb in scaled space, in double precision.
struct Limb {
    e: V3<f64>,
    b1: V3<f64>,
    b2: V3<f64>,
    sin: f64,
    cos: f64,
    /// 1 − cos α.
    k: f64,
    /// U and U⁻¹.
    to: M3<f64>,
    from: M3<f64>,
    /// The direction to the body, and two directions perpendicular to it.
    sight: [V3<f64>; 3],
    camera_from_fixed: M3<f64>,
    semi_axes: [f64; 3],
}

/// One point.
struct Row {
    h: V3<f64>,
    /// The signal of a unit rotation about the line of sight.
    x: f64,
    w: f64,
    residual: f64,
    /// Derivative of σ·e by (u, v).
    gradient: [f64; 2],
    /// Cosine and sine of the azimuth.
    azimuth: [f64; 2],
    outward: V3<f64>,
}

impl Limb {
    fn new<T: Real>(fit: &Fit<T>, target: &Target<T>) -> Option<Self> {
        let double = |m: M3<T>| m.map(Real::to_f64);
        let e = fit.e.map(Real::to_f64);
        let k = fit.k.to_f64();
        let (to, from) = (double(target.scaling.to), double(target.scaling.from));
        let (b1, b2) = basis(&e);
        let u = unit(&(from * e))?;
        let (across, down) = basis(&u);
        Some(Self {
            e,
            b1,
            b2,
            sin: libm::sqrt(k * (2.0 - k)),
            cos: 1.0 - k,
            k,
            to,
            from,
            sight: [u, across, down],
            camera_from_fixed: double(target.camera_from_fixed),
            semi_axes: target.semi_axes.map(|a| a.to_f64()),
        })
    }

    /// Returns cosine and sine of the azimuth of a scaled direction; zeros for a direction without one.
    fn azimuth(&self, direction: &V3<f64>) -> [f64; 2] {
        let d = direction - self.e;
        let (x, y) = (d.dot(&self.b1), d.dot(&self.b2));
        let across = libm::sqrt(x * x + y * y);
        if across > 1e-9 { [x / across, y / across] } else { [0.0; 2] }
    }

    fn row<T: Real>(&self, block: &Block<T>, lane: usize) -> Option<Row> {
        let weight = block.weight[lane & 7].to_f64();
        if !(weight > 0.0) {
            return None;
        }
        let ray = block.ray(lane).map(Real::to_f64);
        let azimuth = self.azimuth(&ray);
        let d = ray - self.e;
        let radial = self.b1 * azimuth[0] + self.b2 * azimuth[1];
        let outward = radial * self.cos - self.e * self.sin;
        let gradient = block.gradient_at(lane, &self.e.map(T::from_f64)).map(|g| g.to_f64());
        let g2 = (gradient[0] * gradient[0] + gradient[1] * gradient[1]).max(LEAST_GRADIENT2);
        let mut row = Row {
            h: V3::new(self.sin * azimuth[0], self.sin * azimuth[1], -1.0),
            x: 0.0,
            w: weight / g2,
            // 1 − σ·e is half of the squared distance of two unit vectors. The difference of cosines would lose the
            // digits of a small disc.
            residual: 0.5 * d.dot(&d) - self.k,
            gradient,
            azimuth,
            outward,
        };
        row.x = self.by_rotation(&row).dot(&self.sight[0]);
        Some(row)
    }

    /// Returns the signal of a unit rotation of the body about each axis of the camera.
    fn by_rotation(&self, row: &Row) -> V3<f64> {
        (self.from * row.outward).cross(&(self.to * row.outward)) * self.per_radian()
    }

    /// Returns the residual for a limb that moves outward by one unit of the scaled space.
    fn per_radian(&self) -> f64 {
        self.sin * self.sin / self.cos
    }

    /// Returns (Σ w h hᵀ)⁻¹ Σ w h x: the part of a rotation that the fit of the position follows.
    fn followed_by_the_fit<T: Real>(&self, blocks: &[Block<T>]) -> Option<V3<f64>> {
        let (mut normal, mut by_x) = ([0.0; 6], V3::zeros());
        for row in self.rows(blocks) {
            let wh = row.h * row.w;
            let terms =
                [wh.x * row.h.x, wh.x * row.h.y, wh.x * row.h.z, wh.y * row.h.y, wh.y * row.h.z, wh.z * row.h.z];
            normal.iter_mut().zip(terms).for_each(|(sum, term)| *sum += term);
            by_x += wh * row.x;
        }
        Some(invert_spd3(&normal)? * by_x)
    }

    fn rows<'a, T: Real>(&'a self, blocks: &'a [Block<T>]) -> impl Iterator<Item = Row> + 'a {
        blocks.iter().flat_map(move |block| (0..LANES).filter_map(move |lane| self.row(block, lane)))
    }

    /// Returns the signals of the errors that no residual shows, without those of the lens; `along` is the place on the
    /// edge, from −1 to 1.
    fn signals(&self, row: &Row, along: f64) -> [f64; SIGNALS] {
        let [c, s] = row.azimuth;
        let (c2, s2) = (c * c - s * s, 2.0 * c * s);
        let normal = self.to * row.outward;
        let height = self.per_radian() * libm::sqrt(normal.dot(&normal));
        let turned = self.by_rotation(row);
        let (n, q) =
            (self.camera_from_fixed.tr_mul(&normal), self.camera_from_fixed.tr_mul(&(self.from * row.outward)));
        let radius = |i: usize| self.per_radian() * n[i] * q[i] / self.semi_axes[i];
        let shift = libm::hypot(row.gradient[0], row.gradient[1]);
        [
            height * c2,
            height * s2,
            c,
            s,
            c2,
            s2,
            turned.dot(&self.sight[1]),
            turned.dot(&self.sight[2]),
            radius(0),
            radius(1),
            radius(2),
            height,
            shift,
            shift * along,
            shift * c,
            shift * s,
        ]
    }
}

/// Sums with x', the part of the rotation that the position cannot follow.
struct Sums {
    /// Σ w x'².
    square: f64,
    /// Σ w x' r.
    projected: f64,
    /// Variance of `projected` for errors of 1 px on each axis, with their correlation along the edge.
    correlated: f64,
    /// Σ w x' s for each signal.
    by_signal: [f64; ALL_SIGNALS],
}

impl Sums {
    fn new<T: Real>(limb: &Limb, blocks: &[Block<T>], beta: &V3<f64>, length_px: f64, camera: &Camera<T>) -> Self {
        let mut sums = Self { square: 0.0, projected: 0.0, correlated: 0.0, by_signal: [0.0; ALL_SIGNALS] };
        let count = limb.rows(blocks).count().max(2) as f64 - 1.0;
        let mut place = 0.0;
        let mut carried = [0.0; 2];
        let has_lens = camera.intrinsic_modes().is_some();
        for block in blocks {
            for lane in 0..LANES {
                let row = limb.row(block, lane);
                let before = carried;
                let step = block.step_px[lane & 7].to_f64();
                let rho = if length_px > 0.0 { libm::exp(-step / length_px) } else { 0.0 };
                sums.correlated += (1.0 - rho * rho) * (before[0] * before[0] + before[1] * before[1]);
                carried = before.map(|c| c * rho);
                let Some(row) = row else { continue };
                let q = row.w * (row.x - row.h.dot(beta));
                carried = [carried[0] + q * row.gradient[0], carried[1] + q * row.gradient[1]];
                sums.square += q * q / row.w;
                sums.projected += q * row.residual;
                let by_lens =
                    if has_lens { camera.shift_by_intrinsics(&block.ray(lane)) } else { [[T::ZERO; 2]; INTRINSICS] };
                let [gu, gv] = row.gradient;
                let lens = by_lens.map(|[du, dv]| gu * du.to_f64() + gv * dv.to_f64());
                let signals = limb.signals(&row, 2.0 * place / count - 1.0).into_iter().chain(lens);
                sums.by_signal.iter_mut().zip(signals).for_each(|(sum, s)| *sum += q * s);
                place += 1.0;
            }
        }
        sums.correlated += carried[0] * carried[0] + carried[1] * carried[1];
        sums
    }
}
