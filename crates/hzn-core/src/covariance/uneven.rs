//! What a limb that is no circle leaves open where the direction of north is unknown.
//!
//! The limb of an ellipsoid differs from its mean cone by a second harmonic of the azimuth about the axis, one whose
//! height varies with latitude also by a first. Unless an attitude tells where north is, the phase is anything: with the
//! amplitude a the residuals hold a cos(kφ + ψ), ψ evenly distributed. The fit turns each of the two signals
//! into an error N⁻¹ Σ w h cos kφ and N⁻¹ Σ w h sin kφ, so that the covariance grows by a²/2 times the sum of their outer
//! products. Around the whole limb the second harmonic leaves nothing behind, on a short arc nearly all of it is taken for
//! a tilt or another half-angle: which, the visible arc tells.

use crate::block::{Block, LANES, sum};
use crate::estimate::{self, Fit};
use crate::linalg::{M3, V3, basis, invert_spd2};
use crate::real::Real;

/// Blocks that the signals are summed over: they vary slowly along the limb.
const PART: usize = 16;

/// The errors in (δ₁₂, δc) that the four signals of unit amplitude make, by harmonic.
type Errors<T> = [[V3<T>; 2]; 2];

/// Covariance of (δ₁₂, δc), with the half-angle free, that the amplitudes add.
pub(super) fn free<T: Real>(blocks: &[Block<T>], fit: &Fit<T>, amplitudes: &[T; 2]) -> Option<M3<T>> {
    let n = estimate::inverse(&fit.sums)?;
    let [m1, m2] = fit.mean;
    Some(outer(
        amplitudes,
        &signals(blocks, fit).map(|pair| {
            pair.map(|u| {
                let d = n * u;
                V3::new(d.x, d.y, d.z + m1 * d.x + m2 * d.y)
            })
        }),
    ))
}

/// As [`free`], with the half-angle held: (11, 12, 22) of δ₁₂.
pub(super) fn known<T: Real>(blocks: &[Block<T>], fit: &Fit<T>, amplitudes: &[T; 2]) -> Option<[T; 3]> {
    let [a, b, d] = invert_spd2(fit.sums.known(fit.mean))?;
    let [m1, m2] = fit.mean;
    let p = outer(
        amplitudes,
        &signals(blocks, fit).map(|pair| {
            pair.map(|u| {
                let (u1, u2) = (u.x - m1 * u.z, u.y - m2 * u.z);
                V3::new(a * u1 + b * u2, b * u1 + d * u2, T::ZERO)
            })
        }),
    );
    Some([p.m11, p.m12, p.m22])
}

fn outer<T: Real>(amplitudes: &[T; 2], errors: &Errors<T>) -> M3<T> {
    let mut p = M3::zeros();
    for (a, pair) in amplitudes.iter().zip(errors) {
        let half = *a * *a * T::of(0.5);
        for d in pair {
            p += d * d.transpose() * half;
        }
    }
    p
}

/// Σ w h cos kφ and Σ w h sin kφ, estimated on a part of the blocks.
fn signals<T: Real>(blocks: &[Block<T>], fit: &Fit<T>) -> Errors<T> {
    let (b1, b2) = basis(&fit.e);
    let [m1, m2] = fit.mean;
    let mut sums = [[[T::ZERO; LANES]; 3]; 4];
    let mut weight = [T::ZERO; LANES];
    for block in blocks.iter().step_by(blocks.len().div_ceil(PART).max(1)) {
        let g = block.gradient(&fit.e);
        for l in 0..LANES {
            let (sx, sy, sz) = (block.s[0][l], block.s[1][l], block.s[2][l]);
            let w = block.weight[l] / (g[0][l] * g[0][l] + g[1][l] * g[1][l]).most(T::of(1e-20));
            let (x, y) = (sx * b1.x + sy * b1.y + sz * b1.z, sx * b2.x + sy * b2.y + sz * b2.z);
            let per = T::one() / (x * x + y * y).most(T::of(1e-20)).sqrt();
            let (c, s) = (x * per, y * per);
            let h = [w * (x - m1), w * (y - m2), -w];
            for (sum, signal) in sums.iter_mut().zip([c, s, c * c - s * s, (c + c) * s]) {
                for (sum, h) in sum.iter_mut().zip(h) {
                    sum[l] += h * signal;
                }
            }
            weight[l] += w;
        }
    }
    // As many as all of them weigh.
    let times = fit.sums.n[5] / sum(&weight).most(T::of(1e-20));
    let [c1, s1, c2, s2] = sums.map(|s| V3::new(sum(&s[0]), sum(&s[1]), sum(&s[2])) * times);
    [[c1, s1], [c2, s2]]
}
